//! FORMAT.md against a real bundle, `fixtures/format/cone.cubist`: its dump is made anew, field by field, by a reader that shares
//! no code with the core, and the pixels that the document promises are played.
//!
//! After a change of the format, bake the bundle anew by [`COMMAND`] and put the block that the failing test prints into FORMAT.md.

use cubist_core::checksum;
use cubist_tests::play;
use std::fmt::Write;
use std::path::PathBuf;

/// What made the bundle.
const COMMAND: &str = "cubist-bake builtin:cone-orbit --size 48x32 --frames 5 --key-interval 4 --cell 4 --atlas 64 --colours 16 --truth none \
                       -o fixtures/format/cone.cubist";
const MARK: &str = "<!-- dump -->\n";

fn read(path: &str) -> Vec<u8> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", path].iter().collect();
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_dump_is_that_of_the_bundle() {
    let bytes = read("fixtures/format/cone.cubist");
    let text = String::from_utf8(read("FORMAT.md")).unwrap();
    let stands = text.split(MARK).nth(1).expect("FORMAT.md has no dump between two marks");
    let block = block(&bytes);
    assert!(stands == block, "FORMAT.md holds another dump than\n{MARK}{block}{MARK}");
}

/// What stands between the marks.
fn block(bytes: &[u8]) -> String {
    let mut dump = Dump { bytes, at: 0, text: String::new() };
    dump.bundle();
    assert_eq!(dump.at, bytes.len(), "the dump ends where the bundle does");
    let frames = [0, 2, 4].map(|frame| format!("frame {frame}: {:08x}", frame_checksum(bytes, frame)));
    format!(
        "\n`fixtures/format/cone.cubist`, {} bytes; numbers in hexadecimal on the left, decimal on the right. CRC-32 of its pixels (RGB565,\n\
         two bytes a pixel, little-endian, row by row): {}.\n\n{}\nMade by `{COMMAND}`.\n\n",
        bytes.len(),
        frames.join(", "),
        dump.text
    )
}

fn frame_checksum(bytes: &[u8], frame: u32) -> u32 {
    let mut sum = 0;
    play::visit(bytes, [frame], |_, player| {
        let pixels: Vec<u8> = play::pixels(player).into_iter().flat_map(u16::to_le_bytes).collect();
        sum = checksum(&pixels);
    })
    .unwrap();
    sum
}

/// Reads a bundle and writes down what it reads.
struct Dump<'b> {
    bytes: &'b [u8],
    at: usize,
    text: String,
}

impl Dump<'_> {
    /// Writes down `count` bytes from here on, the first ten of them, with what they mean.
    fn take(&mut self, count: usize, meaning: &str) {
        let taken = &self.bytes[self.at..self.at + count];
        let mut hex: Vec<String> = taken.iter().take(10).map(|byte| format!("{byte:02x}")).collect();
        if count > 10 {
            hex.push("..".to_owned());
        }
        writeln!(self.text, "    {:6}  {:32}  {meaning}", self.at, hex.join(" ")).unwrap();
        self.at += count;
    }

    /// A varint's value and length.
    fn peek_varint(&self) -> (usize, usize) {
        let length = 1 + self.bytes[self.at..].iter().take_while(|&&byte| byte & 0x80 != 0).count();
        let value = self.bytes[self.at..self.at + length].iter().rev().fold(0, |value, &byte| value << 7 | usize::from(byte & 0x7f));
        (value, length)
    }

    fn varint(&mut self, before: &str, after: &str) -> usize {
        let (value, length) = self.peek_varint();
        self.take(length, &format!("{before}{value}{after}"));
        value
    }

    fn byte(&mut self, before: &str) -> u8 {
        let value = self.bytes[self.at];
        self.take(1, &format!("{before}{value}"));
        value
    }

    fn little_endian(&self, at: usize, count: usize) -> usize {
        self.bytes[at..at + count].iter().rev().fold(0, |value, &byte| value << 8 | usize::from(byte))
    }

    /// Three numbers of 32 bits with a sign.
    fn vector(&mut self, name: &str) {
        let [x, y, z] = [0, 4, 8].map(|offset| self.little_endian(self.at + offset, 4) as u32 as i32);
        self.take(12, &format!("{name}({x}, {y}, {z})"));
    }

    fn bundle(&mut self) {
        self.take(6, "magic: CUBIST");
        self.varint("version ", "");
        let sections = self.varint("", " sections");
        for _ in 0..sections {
            self.text.push('\n');
            let tag = String::from_utf8(self.bytes[self.at..self.at + 4].to_vec()).unwrap();
            self.take(4, &format!("section {tag}"));
            self.byte("required: ");
            let length = self.varint("", " bytes of value");
            match tag.as_str() {
                "PATH" => self.path(),
                "ATLS" => self.atlas(),
                "LABL" => self.labels(length),
                "MASK" => self.take(length, "tiles of the mask, two bytes each, then its blocks, eight bytes each"),
                _ => self.take(length, "text"),
            }
        }
        self.text.push('\n');
        self.take(4, "CRC-32 of everything above");
    }

    fn path(&mut self) {
        for name in ["width ", "height ", "frames ", "fps "] {
            self.varint(name, "");
        }
        self.byte("looping: ");
        self.byte("cell_log2 ");
        for name in ["time ", "space ", "key_bits ", "step_log2 "] {
            self.byte(name);
        }
        for name in ["key_layers ", "row_layers ", "key_chains ", "row_chains ", "key_fields ", "list_bytes ", "row_sheets "] {
            self.varint(name, "");
        }
        self.byte("cell_sheets ");
        self.byte("fields ");
        self.varint("seek_keys ", "");
        let table = self.varint("", " bytes of key table");
        let mut ends = vec![0];
        for key in 0..table / 8 {
            let (frame, end) = (self.little_endian(self.at, 4), self.little_endian(self.at + 4, 4));
            let independent = if frame >> 31 == 1 { ", independent" } else { "" };
            self.take(8, &format!("key {key}: frame {}{independent}; its record ends at {end}", frame & 0x7fff_ffff));
            ends.push(end);
        }
        let planes = self.varint("", " bytes of planes");
        for _ in 0..planes / 38 {
            self.byte("plane of label ");
            self.byte("  shift ");
            for name in ["origin", "along_u", "along_v"] {
                self.vector(&format!("  {name} "));
            }
        }
        let cameras = self.varint("", " bytes of cameras");
        for key in 0..cameras / 48 {
            for name in ["eye", "first", "column", "row"] {
                self.vector(&format!("camera of key {key}: {name} "));
            }
        }
        self.varint("", " bytes of records");
        for (key, ends) in ends.windows(2).enumerate() {
            self.take(ends[1] - ends[0], &format!("record of key {key}"));
        }
    }

    fn atlas(&mut self) {
        self.byte("width_log2 ");
        self.varint("height ", "");
        self.byte("encoding ");
        self.byte("finer ");
        self.varint("", " blocks of the mask");
        let palette = self.varint("", " bytes of palette");
        self.take(palette, "RGB565");
        let texels = self.varint("", " bytes of texels");
        self.take(texels, "one palette index a texel");
    }

    fn labels(&mut self, length: usize) {
        for label in 0..length / 20 {
            let [left, top, right, bottom] = [0, 2, 4, 6].map(|offset| self.little_endian(self.at + offset, 2));
            let flags = self.bytes[self.at + 8];
            self.take(8, &format!("label {label}: left {left}, top {top}, right {right}, bottom {bottom}"));
            self.byte("  flags ");
            self.take(3, "  tint");
            self.take(8, if flags & 2 == 2 { "  fixed: origin and step" } else { "  not fixed: unused" });
        }
    }
}
