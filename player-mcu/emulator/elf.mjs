// An ELF as a programmer writes it to a chip: what is to be loaded comes from the file's program headers, as pieces with the address each
// goes to, to `board`; and where the firmware's statics end, to `play`.
import { readFileSync } from 'node:fs';

const MAGIC = 0x464c457f;
const LOAD = 1;

/** The program headers of the 32-bit little-endian ELF in `file` that load something, as { address, bytes, end }: to where it is written, what, and
 * where the room for it ends when it runs. */
function loads(file) {
  const bytes = readFileSync(file);
  if (bytes.length < 52 || bytes.readUInt32LE(0) !== MAGIC || bytes[4] !== 1 || bytes[5] !== 1) {
    throw new Error(`${file}: expected a 32-bit little-endian ELF`);
  }
  const [table, size, count] = [bytes.readUInt32LE(28), bytes.readUInt16LE(42), bytes.readUInt16LE(44)];
  const found = [];
  for (let header = table; header < table + size * count; header += size) {
    const [kind, offset, place, address, length, room] = [0, 4, 8, 12, 16, 20].map((field) => bytes.readUInt32LE(header + field));
    if (kind === LOAD) found.push({ address, bytes: bytes.subarray(offset, offset + length), end: place + room });
  }
  return found;
}

/** The pieces of the ELF in `file`: { address, bytes } each. */
export function pieces(file) {
  return loads(file).filter(({ bytes }) => bytes.length > 0);
}

/** Where the statics in memory end, and the stack may begin to grow down to. */
export function staticsEnd(file) {
  return Math.max(...loads(file).map(({ end }) => end));
}
