// Pictures: RGB565 pixels from `play` go into a PNG file, by what Node brings along.
import { writeFileSync } from 'node:fs';
import { deflateSync } from 'node:zlib';

const TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  for (let bit = 0; bit < 8; bit++) byte = byte & 1 ? (byte >>> 1) ^ 0xedb88320 : byte >>> 1;
  return byte >>> 0;
});

function crc(bytes) {
  let sum = 0xffffffff;
  for (const byte of bytes) sum = TABLE[(sum ^ byte) & 255] ^ (sum >>> 8);
  return (sum ^ 0xffffffff) >>> 0;
}

function chunk(name, body) {
  const bytes = Buffer.alloc(body.length + 12);
  bytes.writeUInt32BE(body.length, 0);
  bytes.write(name, 4, 'latin1');
  body.copy(bytes, 8);
  bytes.writeUInt32BE(crc(bytes.subarray(4, -4)), bytes.length - 4);
  return bytes;
}

/** Writes `pixels`, RGB565, row by row, to `file`. */
export function writePng(file, width, height, pixels) {
  const rows = Buffer.alloc((width * 3 + 1) * height);
  let at = 0;
  pixels.forEach((pixel, index) => {
    if (index % width === 0) rows[at++] = 0; // this row's filter: none
    const [red, green, blue] = [pixel >> 11, (pixel >> 5) & 63, pixel & 31];
    rows[at++] = (red << 3) | (red >> 2);
    rows[at++] = (green << 2) | (green >> 4);
    rows[at++] = (blue << 3) | (blue >> 2);
  });
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([8, 2, 0, 0, 0], 8); // eight bits each of red, green and blue
  const start = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  const chunks = [chunk('IHDR', header), chunk('IDAT', deflateSync(rows)), chunk('IEND', Buffer.alloc(0))];
  writeFileSync(file, Buffer.concat([start, ...chunks]));
}
