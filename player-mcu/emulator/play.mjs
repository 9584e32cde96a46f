// Runs the Pico's firmware in an emulator and holds every frame that its display shows, pixel for pixel, against the host's. In this folder, once `npm ci`
// has fetched the emulator:
//
//   node play.mjs --firmware ELF --display st7789|ili9341 --frames FILE --size WxH [--bundle FILE] [--stops N] [--run N] [--png DIR]
//
// FILE of --frames has the host's frames, RGB565, little-endian, one after the other (`cargo run -p cubist-mcu -- frames BUNDLE FILE` writes it). The bundle is put into flash where the
// firmware looks for one; without it that is erased. The potentiometer is turned to so many stops, from each of which so many frames
// are played; at the end the last frames are played to and fro. Out comes a line of JSON for each frame: its number, the mode it was shown in,
// the cycles that the processor worked on it (no wait states), its wrong pixels; then one with sums and the deepest stack. Exit code 1: a wrong pixel, or no end.
import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { Board } from './board.mjs';
import { Display } from './display.mjs';
import { pieces, staticsEnd } from './elf.mjs';
import { writePng } from './png.mjs';

// As the firmware's `slot`, `controls` and `panel` have them.
const SLOT = 0x10100000;
const [DATA_PIN, PING_PONG_PIN, BY_HAND_PIN, WORKING_PIN, TURN_PIN] = [16, 14, 15, 21, 22];
const [POTENTIOMETER, POSITIONS] = [0, 4096];
// A frame takes some ten million instructions, setting up a third of a second.
const INSTRUCTIONS = 3e9;

function options() {
  const text = { type: 'string' };
  const names = { firmware: text, display: text, frames: text, size: text, bundle: text, png: text };
  const { values } = parseArgs({
    options: { ...names, stops: { type: 'string', default: '3' }, run: { type: 'string', default: '8' }, seconds: { type: 'string', default: '120' } },
  });
  for (const name of ['firmware', 'display', 'frames', 'size']) {
    if (!values[name]) throw new Error(`--${name} is missing`);
  }
  const size = /^(\d+)x(\d+)$/.exec(values.size);
  if (!size) throw new Error(`--size ${values.size}: expected WIDTHxHEIGHT`);
  const number = (name) => {
    if (!/^\d+$/.test(values[name])) throw new Error(`--${name} ${values[name]}: expected a number`);
    return Number(values[name]);
  };
  return { ...values, width: Number(size[1]), height: Number(size[2]), stops: number('stops'), run: number('run'), seconds: number('seconds') };
}

/** The host's frames in `file`. */
function hostFrames(file, width, height) {
  const bytes = readFileSync(file);
  const pixels = Uint16Array.from({ length: bytes.length >> 1 }, (_, index) => bytes.readUInt16LE(index * 2));
  if (pixels.length === 0 || pixels.length % (width * height) !== 0) {
    throw new Error(`${file}: ${bytes.length} bytes are no frames of ${width}x${height}`);
  }
  return Array.from({ length: pixels.length / (width * height) }, (_, frame) =>
    pixels.subarray(frame * width * height, (frame + 1) * width * height),
  );
}

/** What is to be shown, frame by frame: in which mode, and what the firmware must make of it. */
function schedule(frames, stops, run) {
  const shown = [{ mode: 'start', frame: 0 }];
  if (frames === 1) return shown;
  const seek = (frame) => shown.push({ mode: 'position', frame, position: Math.ceil((frame * POSITIONS) / frames) });
  for (let stop = 0; stop < stops; stop++) {
    const first = Math.floor((stop * frames) / stops);
    seek(first);
    for (let step = 1; step <= run; step++) shown.push({ mode: 'loop', frame: (first + step) % frames });
  }
  seek(frames - 1);
  shown.push({ mode: 'ping-pong', frame: frames - 2 }, { mode: 'ping-pong', frame: Math.max(frames - 3, 0) });
  return shown;
}

/** The whole panel as it should look: `frame` in its middle, black around it. */
function framed({ width, height }, frame, size) {
  const out = new Uint16Array(width * height);
  const [left, top] = [(width - size.width) >> 1, (height - size.height) >> 1];
  if (left < 0 || top < 0) throw new Error(`frames of ${size.width}x${size.height} on a panel of ${width}x${height}`);
  for (let y = 0; y < size.height; y++) out.set(frame.subarray(y * size.width, (y + 1) * size.width), (top + y) * width + left);
  return out;
}

function main() {
  const given = options();
  const expected = hostFrames(given.frames, given.width, given.height);
  const plan = schedule(expected.length, given.stops, given.run);
  const bundle = given.bundle ? [{ address: SLOT, bytes: readFileSync(given.bundle) }] : [];
  const board = new Board([...pieces(given.firmware), ...bundle]);
  let [begun, ended, wrong] = [0, 0, 0];
  const cycles = plan.map(() => 0);

  const set = ({ mode, position }) => {
    board.tie(PING_PONG_PIN, mode !== 'ping-pong');
    board.tie(BY_HAND_PIN, mode !== 'position');
    if (position !== undefined) board.turn(POTENTIOMETER, position);
  };
  set(plan[0]);
  let turn = false;
  board.onPin(TURN_PIN, (high) => {
    if (high === turn) return;
    turn = high;
    // The mode of the next frame is read when this one has been drawn.
    if (++begun < plan.length) set(plan[begun]);
  });
  let since;
  board.onPin(WORKING_PIN, (high) => {
    if (high) since ??= board.cycles;
    else if (since !== undefined) {
      if (begun <= plan.length) cycles[begun - 1] += board.cycles - since;
      since = undefined;
    }
  });

  const display = new Display(given.display, () => {
    // Before the first frame the display is made black.
    if (begun === 0 || ended === plan.length) return;
    const { mode, frame } = plan[ended];
    const seen = display.seen();
    const meant = framed(display.panel, expected[frame], given);
    const different = seen.reduce((count, pixel, index) => count + (pixel !== meant[index]), 0);
    const line = { frame, mode, cycles: cycles[ended], wrong: different };
    if (different > 0) {
      const at = seen.findIndex((pixel, index) => pixel !== meant[index]);
      const colour = (pixel) => pixel.toString(16).padStart(4, '0');
      line.first = { x: at % display.panel.width, y: Math.floor(at / display.panel.width), expected: colour(meant[at]), found: colour(seen[at]) };
    }
    console.log(JSON.stringify(line));
    if (given.png) {
      mkdirSync(given.png, { recursive: true });
      const name = `${String(ended).padStart(4, '0')}-frame-${String(frame).padStart(4, '0')}.png`;
      writePng(join(given.png, name), display.panel.width, display.panel.height, seen);
    }
    wrong += different;
    ended++;
  });
  let data = false;
  board.onPin(DATA_PIN, (high) => (data = high));
  board.onSpi((byte) => (data ? display.takeData(byte) : display.takeCommand(byte)));

  const start = Date.now();
  board.run(() => ended === plan.length || wrong > 0, { instructions: INSTRUCTIONS, seconds: given.seconds });
  const stack = board.stackPeak(staticsEnd(given.firmware));
  console.log(JSON.stringify({ frames: ended, wrong, stack, cycles: board.cycles, seconds: (Date.now() - start) / 1000 }));
  return wrong > 0 ? 1 : 0;
}

try {
  process.exitCode = main();
} catch (error) {
  console.error(`play: ${error.message}`);
  process.exitCode = 1;
}
