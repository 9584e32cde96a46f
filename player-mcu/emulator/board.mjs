// A Pico in rp2040js: firmware and what else is in flash come in, pins and bytes of the SPI bus go out to `play`.
//
// There is no boot ROM in it: what that would do, copying the second stage of the boot loader to memory and calling it, is done here.
import { ConsoleLogger, GPIOPinState, LogLevel, RP2040 } from 'rp2040js';

const [FLASH, FLASH_END, RAM, RAM_END] = [0x10000000, 0x11000000, 0x20000000, 0x20042000];
// Where the boot ROM puts the second stage, and how long that is.
const [BOOT2, BOOT2_BYTES] = [0x20041f00, 256];
// What memory holds that nothing has written to.
const PAINT = 0xcc;

export class Board {
  /** A Pico whose flash holds `pieces`, { address, bytes } each. */
  constructor(pieces) {
    this.mcu = new RP2040();
    this.mcu.logger = new ConsoleLogger(LogLevel.Error, true);
    // Erased flash, the firmware's pieces in it; a reset of the emulator would erase it again.
    this.mcu.flash.fill(0xff);
    this.mcu.sram.fill(PAINT);
    for (const { address, bytes } of pieces) this.load(address, bytes);
    this.mcu.sram.set(this.mcu.flash.subarray(0, BOOT2_BYTES), BOOT2 - RAM);
    const core = this.mcu.core;
    core.SP = BOOT2;
    core.LR = 0;
    core.PC = BOOT2;
    this.mcu.onBreak = (code) => {
      throw new Error(`breakpoint ${code} at ${core.PC.toString(16)}`);
    };
  }

  load(address, bytes) {
    const end = address + bytes.length;
    if (address >= FLASH && end <= FLASH_END) this.mcu.flash.set(bytes, address - FLASH);
    else if (address >= RAM && end <= RAM_END) this.mcu.sram.set(bytes, address - RAM);
    else throw new Error(`${bytes.length} bytes at 0x${address.toString(16)}: neither flash nor memory`);
  }

  /** Cycles so far. */
  get cycles() {
    return this.mcu.core.cycles;
  }

  /** How deep the stack has been, bytes, if it may grow down to `bottom`. */
  stackPeak(bottom) {
    const free = this.mcu.sram.subarray(bottom - RAM).findIndex((byte) => byte !== PAINT);
    if (free < 16) throw new Error('the stack has grown into the statics, or is about to');
    return RAM_END - bottom - free;
  }

  /** Calls `listener` with true or false whenever output `pin` changes. */
  onPin(pin, listener) {
    this.mcu.gpio[pin].addListener((state) => listener(state === GPIOPinState.High));
  }

  /** Ties input `pin` high or low. The emulator knows no pull-ups: one that is not tied reads low. */
  tie(pin, high) {
    this.mcu.gpio[pin].setInputValue(high);
  }

  /** Turns the potentiometer at `channel` to `position`, 0 to 4095. */
  turn(channel, position) {
    this.mcu.adc.channelValues[channel] = position;
  }

  /** Calls `listener` with every byte of SPI 0; each takes the time that it takes on the wire. */
  onSpi(listener) {
    const spi = this.mcu.spi[0];
    const sent = this.mcu.clock.createAlarm(() => spi.completeTransmit(0));
    spi.onTransmit = (byte) => {
      listener(byte);
      sent.schedule((spi.dataBits / spi.clockFrequency) * 1e9);
    };
  }

  /** Runs until `done`, for at most so many instructions and seconds. */
  run(done, { instructions, seconds }) {
    const { mcu } = this;
    const { core, clock } = mcu;
    const end = Date.now() + seconds * 1000;
    for (let count = 0; !done(); count++) {
      if (count >= instructions) throw new Error(`not done after ${instructions} instructions, at ${core.PC.toString(16)}`);
      if (count % 1e6 === 0 && Date.now() > end) throw new Error(`not done after ${seconds} seconds, at ${core.PC.toString(16)}`);
      if (core.waiting) {
        if (!clock.nanosToNextAlarm) throw new Error('asleep for good');
        clock.tick(clock.nanosToNextAlarm);
        continue;
      }
      const stack = this.stackBranch(core.PC);
      const cycles = core.executeInstruction() + stack;
      core.cycles += stack;
      clock.tick((cycles * 1e9) / mcu.clkSys);
    }
  }

  /** The cycle that the emulator forgets where `push` saves a return address or `pop` returns: the Cortex-M0+'s manual has 1 + N and 3 + N. */
  stackBranch(pc) {
    const { mcu } = this;
    let code = 0;
    if (pc >= FLASH && pc < FLASH_END) code = mcu.flash16[(pc - FLASH) >> 1];
    else if (pc >= RAM && pc < RAM_END) code = mcu.sramView.getUint16(pc - RAM, true);
    return (code & 0xf700) === 0xb500 ? 1 : 0;
  }
}
