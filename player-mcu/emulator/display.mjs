// A display's controller, ST7789 or ILI9341, as far as both are MIPI's: bytes come from `board`'s SPI bus, and what a person in front of the panel
// would see goes to `play`. Anything that a real controller would not show as meant is an error.

const [RESET, INVERSION_OFF, INVERSION_ON, OFF, ON] = [0x01, 0x20, 0x21, 0x28, 0x29];
const [COLUMNS, ROWS, WRITE, WRITE_ON, ACCESS, FORMAT] = [0x2a, 0x2b, 0x2c, 0x3c, 0x36, 0x3a];
// Bits of ACCESS: mirrored rows, mirrored columns, both exchanged, blue first.
const [MIRROR_Y, MIRROR_X, SWAP, BLUE_FIRST] = [0x80, 0x40, 0x20, 0x08];
const RGB565 = 5;

/** The panels that the firmware knows, as they are mounted; both controllers have memory for 240x320 pixels. */
export const PANELS = {
  // IPS panels show a colour's opposite unless told otherwise.
  st7789: { width: 240, height: 240, inverted: true, access: 0 },
  // Lies on its side; its blue is where others have red.
  ili9341: { width: 320, height: 240, inverted: false, access: SWAP | BLUE_FIRST },
};

const [MEMORY_WIDTH, MEMORY_HEIGHT] = [240, 320];

export class Display {
  /** `onFrame` is called when a window has been filled. */
  constructor(name, onFrame) {
    this.panel = PANELS[name];
    if (!this.panel) throw new Error(`--display ${name}: expected ${Object.keys(PANELS).join(' or ')}`);
    this.onFrame = onFrame;
    this.memory = new Uint16Array(MEMORY_WIDTH * MEMORY_HEIGHT);
    this.reset();
  }

  reset() {
    Object.assign(this, { command: 0, given: [], access: 0, format: 0, inverted: false, on: false, window: { columns: [0, 0], rows: [0, 0] } });
  }

  /** A byte while the data pin is low. */
  takeCommand(byte) {
    if (this.left > 0 && this.command === WRITE && this.started) {
      throw new Error(`command ${hex(byte)} when ${this.left} pixels of a window were missing`);
    }
    if (this.high !== undefined) throw new Error(`command ${hex(byte)} in the middle of a pixel`);
    this.command = byte;
    this.given = [];
    if (byte === RESET) this.reset();
    if (byte === INVERSION_OFF || byte === INVERSION_ON) this.inverted = byte === INVERSION_ON;
    if (byte === OFF || byte === ON) this.on = byte === ON;
    if (byte === WRITE) this.begin();
  }

  begin() {
    const { columns, rows } = this.window;
    this.width = columns[1] - columns[0] + 1;
    this.height = rows[1] - rows[0] + 1;
    const [most, deepest] = this.access & SWAP ? [MEMORY_HEIGHT, MEMORY_WIDTH] : [MEMORY_WIDTH, MEMORY_HEIGHT];
    if (this.width < 1 || this.height < 1 || columns[1] >= most || rows[1] >= deepest) {
      throw new Error(`a window of columns ${columns} and rows ${rows} in a memory of ${most}x${deepest}`);
    }
    this.left = this.width * this.height;
    this.next = 0;
    this.started = false;
  }

  /** A byte while the data pin is high. */
  takeData(byte) {
    if (this.command === WRITE) return this.takePixel(byte);
    if (this.command === WRITE_ON) throw new Error('WRITE MEMORY CONTINUE, which the firmware has no use for');
    this.given.push(byte);
    const [first, second, third, fourth] = this.given;
    if (this.command === ACCESS) this.access = first;
    if (this.command === FORMAT) this.format = first;
    if (this.command === COLUMNS && this.given.length === 4) this.window.columns = [(first << 8) | second, (third << 8) | fourth];
    if (this.command === ROWS && this.given.length === 4) this.window.rows = [(first << 8) | second, (third << 8) | fourth];
  }

  takePixel(byte) {
    this.started = true;
    if (this.high === undefined) {
      this.high = byte;
      return;
    }
    if (this.left === 0) throw new Error(`more pixels than the window's ${this.width}x${this.height}`);
    const { columns, rows } = this.window;
    const [x, y] = [columns[0] + (this.next % this.width), rows[0] + Math.floor(this.next / this.width)];
    this.memory[this.cell(x, y, this.access)] = (this.high << 8) | byte;
    this.high = undefined;
    this.next++;
    if (--this.left === 0) this.onFrame(this.window);
  }

  /** Where in memory the controller keeps column `x` of row `y`. */
  cell(x, y, access) {
    if (access & SWAP) [x, y] = [y, x];
    if (access & MIRROR_X) x = MEMORY_WIDTH - 1 - x;
    if (access & MIRROR_Y) y = MEMORY_HEIGHT - 1 - y;
    return y * MEMORY_WIDTH + x;
  }

  /** What a person sees of the panel, RGB565, row by row. The panel decides what it shows of the memory, whatever the firmware has set. */
  seen() {
    const { width, height, inverted, access } = this.panel;
    if (!this.on) throw new Error('the display is off');
    if ((this.format & 7) !== RGB565) throw new Error(`pixels of format ${hex(this.format)}, expected RGB565 (5)`);
    const out = new Uint16Array(width * height);
    const exchanged = (this.access ^ access) & BLUE_FIRST;
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        let pixel = this.memory[this.cell(x, y, access)];
        if (exchanged) pixel = (pixel << 11) | (pixel & 0x07e0) | (pixel >> 11);
        out[y * width + x] = this.inverted === inverted ? pixel : ~pixel;
      }
    }
    return out;
  }
}

const hex = (byte) => `0x${byte.toString(16).padStart(2, '0')}`;
