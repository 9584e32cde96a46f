// play.mjs MODULE BUNDLE...: plays bundles in the WebAssembly module built here and prints `FILE FRAME CHECKSUM` for every frame, to
// `cubist-identical`. A fresh instance for each. What lies where is said in src/main.rs.
import { readFileSync } from "node:fs";

const [file, ...bundles] = process.argv.slice(2);
const module = new WebAssembly.Module(readFileSync(file));

for (const name of bundles) {
  const { memory, main } = new WebAssembly.Instance(module, {}).exports;
  const bundle = readFileSync(name);
  const door = Buffer.from(memory.buffer).indexOf("cubist identity:");
  if (door < 0) throw new Error(`${file}: no words to find its door by`);
  const before = new DataView(memory.buffer);
  new Uint8Array(memory.buffer).set(bundle, before.getUint32(door + 16, true));
  before.setUint32(door + 20, bundle.length, true);
  main(0, 0);
  // Memory that grew is another buffer.
  const after = new DataView(memory.buffer);
  const sums = after.getUint32(door + 24, true);
  const frames = after.getUint32(door + 28, true);
  if (frames === 0) throw new Error(`${name}: does not play`);
  for (let frame = 0; frame < frames; frame++) {
    console.log(`${name} ${frame} ${after.getUint32(sums + 4 * frame, true).toString(16).padStart(8, "0")}`);
  }
}
