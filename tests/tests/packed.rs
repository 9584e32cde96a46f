//! Packed source images: what a bundle that holds one plays, and what memory it takes, against the same scene's with a raw one.
//! Scenes come from `scenes`, baked both ways; real pictures go through the packer and back.

use cubist_baker::atlas::Storage;
use cubist_baker::bake::{Flat, Settings};
use cubist_baker::encode;
use cubist_baker::inspect::Inspection;
use cubist_core::format::{ATLAS, MASK, TexelKind};
use cubist_core::{Bundle, ByteOrder, Indexed8, MemoryError, Player};
use cubist_tests::{play, scenes};

const SIZE: [u32; 2] = [104, 78];
const FRAMES: u32 = 12;
/// One with masks, one with charts of every size.
const SCENES: [&str; 2] = ["street", "terrain"];

/// A scene baked raw and packed.
fn both(name: &str) -> (Flat, [Vec<u8>; 2]) {
    let scene = scenes::reduced(name, SIZE, FRAMES).expect("a built-in scene");
    scenes::raw_and_packed(&scene, &Settings::default()).expect("it bakes")
}

/// A scene baked packed, with texels of `kind` and 2^`outline` bits of outline a texel. Of a few frames: it is about the picture.
fn packed_of(name: &str, kind: TexelKind, outline: u32) -> (Flat, Vec<u8>) {
    let scene = scenes::reduced(name, SIZE, 3).expect("a built-in scene");
    let mut settings = Settings::default();
    (settings.atlas.texels, settings.atlas.outline, settings.atlas.storage) = (kind, Some(outline), Storage::Packed);
    let (flat, encoded) = scenes::bake(&scene, &settings).expect("it bakes");
    (flat, encoded.bundle)
}

/// The texels of a source image, a byte each.
fn bytes_of(flat: &Flat) -> Vec<u8> {
    flat.atlas.image.texels.iter().map(|&texel| texel as u8).collect()
}

/// Some frames, plain and antialiased, from memory filled with `fill`.
fn pixels(bytes: &[u8], fill: u8) -> Vec<u16> {
    play::every_way::<Indexed8>(bytes, &[0, 5, 6, 11, 2], fill, ByteOrder::Native).expect("sound, and the memory it asked for")
}

#[test]
fn packed_plays_the_pixels_of_raw() {
    for name in SCENES {
        let (flat, [raw, packed]) = both(name);
        assert!(pixels(&raw, 0) == pixels(&packed, 0xa5), "{name}: other pixels");
        let (raw_bundle, packed_bundle) = (Bundle::parse(&raw).expect("raw"), Bundle::parse(&packed).expect("packed"));
        assert!(encode::unpacked(&raw_bundle) == encode::unpacked(&packed_bundle), "{name}: other texels or another mask");
        assert!(encode::unpacked(&packed_bundle).texels == bytes_of(&flat), "{name}: other texels");
        let (before, after) = (Inspection::of(&raw).expect("raw"), Inspection::of(&packed).expect("packed"));
        let [was, is] = [&before, &after].map(|i| i.section_bytes(ATLAS) + i.section_bytes(MASK));
        println!("{name}: {} -> {} bytes, image and mask {was} -> {is}", raw.len(), packed.len());
        assert!(is * 2 < was, "{name}: {was} bytes became {is}");
        assert!(before.section_bytes(MASK) > 0 && after.section_bytes(MASK) == 0, "{name}: the mask is in the picture");
        assert_eq!(before.image.mask, after.image.mask);
        // Unpacking itself needs no more than what playing has there later.
        assert_eq!(after.workspace - before.workspace, after.unpacked_bytes(), "{name}");
        assert_eq!(before.unpacked_bytes(), 0);
        assert!(after.text().contains("packed") && before.text().contains("raw"));
    }
}

#[test]
fn the_document_says_how_to_unpack() {
    for (name, finer) in SCENES.into_iter().flat_map(|name| [0, 1, 2].map(|finer| (name, finer))) {
        let (flat, packed) = packed_of(name, TexelKind::Indexed8, finer);
        let bundle = Bundle::parse(&packed).expect("packed");
        let (width, height) = (flat.atlas.image.width as i32, flat.atlas.image.height as i32);
        let bytes = bundle.packed().expect("it is packed");
        let mut reader = Reader::new(bytes);
        let mask = reader.mask(width, height, finer, bundle.atlas().blocks as usize);
        assert!(*mask == *flat.atlas.image.outline.bits, "{name}: another mask");
        let texels = reader.texels(width, height, &middles(&mask, width, height, finer));
        assert!(texels == bytes_of(&flat), "{name}: other texels");
    }
}

#[test]
fn the_document_says_how_to_unpack_texels_that_are_no_bytes() {
    for kind in [TexelKind::Indexed4, TexelKind::Direct565] {
        let (flat, packed) = packed_of("street", kind, 1);
        let image = &flat.atlas.image;
        let (width, height) = (image.width as i32, image.height as i32);
        let bundle = Bundle::parse(&packed).expect("packed");
        let mut reader = Reader::new(bundle.packed().expect("it is packed"));
        let mask = reader.mask(width, height, 1, bundle.atlas().blocks as usize);
        assert!(*mask == *image.outline.bits, "another mask");
        let mask = middles(&mask, width, height, 1);
        if kind == TexelKind::Indexed4 {
            let texels = reader.texels(width, height, &mask);
            assert!(texels.iter().zip(image.texels.iter()).all(|(&found, &wanted)| u16::from(found & 15) == wanted), "other texels");
            continue;
        }
        let wanted: Vec<u16> = image.texels.iter().map(|&texel| encode::rgb565(image.palette[usize::from(texel)])).collect();
        // Whether what is known of a texel is as to its left.
        let as_left = |known: &[i32]| -> Vec<bool> {
            (0..known.len()).map(|at| !at.is_multiple_of(width as usize) && known[at] == known[at - 1]).collect()
        };
        let green: Vec<i32> = reader.texels(width, height, &mask).into_iter().map(|byte| i32::from(byte) >> 2).collect();
        let other = |bytes: Vec<u8>| -> Vec<i32> {
            bytes.into_iter().zip(&green).map(|(byte, green)| ((i32::from(byte) >> 3) + 16 + (green >> 1)) & 31).collect()
        };
        let red = other(reader.texels(width, height, &as_left(&green)));
        let both: Vec<i32> = red.iter().zip(&green).map(|(red, green)| red << 6 | green).collect();
        let blue = other(reader.texels(width, height, &as_left(&both)));
        let texels: Vec<u16> = both.iter().zip(blue).map(|(both, blue)| (both << 5 | blue) as u16).collect();
        assert!(texels == wanted, "other texels");
    }
}

/// Reads packed pictures by FORMAT.md's words alone.
struct Reader<'b> {
    bytes: &'b [u8],
    range: u32,
    code: u32,
}

/// p and n of a context.
type Context = (u32, usize);
const NEW: Context = (2048, 0);

impl<'b> Reader<'b> {
    fn new(bytes: &'b [u8]) -> Self {
        let mut reader = Self { bytes, range: u32::MAX, code: 0 };
        (0..4).for_each(|_| reader.shift());
        reader
    }

    fn shift(&mut self) {
        let (next, rest) = self.bytes.split_first().map_or((0, self.bytes), |(&next, rest)| (next, rest));
        (self.code, self.bytes) = (self.code << 8 | u32::from(next), rest);
    }

    fn bit(&mut self, (p, n): &mut Context) -> bool {
        let bound = (self.range >> 12) * (*p).clamp(32, 4064);
        let bit = self.code >= bound;
        let rate = [1, 2, 2, 3, 3, 3, 4, 4, 4, 4, 4, 5, 5, 5, 5, 5][*n];
        if bit {
            (self.code, self.range) = (self.code - bound, self.range - bound);
            *p -= *p >> rate;
        } else {
            self.range = bound;
            *p += (4095 - *p) >> rate;
        }
        *n = (*n + 1).min(15);
        if self.range < 1 << 24 {
            self.range <<= 8;
            self.shift();
        }
        bit
    }

    /// The mask of a picture with masked labels: the bits, row by row.
    fn mask(&mut self, width: i32, height: i32, finer: u32, blocks: usize) -> Vec<bool> {
        let [wide, high] = [width << finer, height << finer];
        let row = wide as usize / 8;
        let (mut bits, mut kinds) = (vec![NEW; 1024], vec![NEW; 45]);
        let mut known = vec![[[true; 8]; 8], [[false; 8]; 8]];
        let mut tiles = Vec::new();
        // Whole blocks below each other, with the last ones' rows beyond the picture.
        let mut mask = vec![false; 64 * row * (high as usize).div_ceil(8)];
        for at in 0..row * (high as usize).div_ceil(8) {
            let west = if at % row == 0 { 1 } else { tiles[at - 1] };
            let north = if at < row { 1 } else { tiles[at - row] };
            let context = |way: usize| 9 * way + 3 * usize::min(west, 2) + usize::min(north, 2);
            let mut number = None;
            let mut tried = Vec::new();
            for (way, c) in [west, north, 0, 1].into_iter().enumerate() {
                if number.is_none() && !tried.contains(&c) {
                    number = self.bit(&mut kinds[context(way)]).then_some(c);
                    tried.push(c);
                }
            }
            let (left, top) = ((at % row * 8) as i32, (at / row * 8) as i32);
            if number.is_none() && known.len() < blocks && self.bit(&mut kinds[context(4)]) {
                number = Some(known.len());
                known.push([[false; 8]; 8]);
                for (x, y) in places(8, 8) {
                    let m = |i: i32, j: i32| {
                        let (x, y) = (left + x + i, top + y + j);
                        usize::from((0..wide).contains(&x) && y >= 0 && mask[(y * wide + x) as usize])
                    };
                    let around = [(-1, -2), (0, -2), (1, -2), (-2, -1), (-1, -1), (0, -1), (1, -1), (2, -1), (-2, 0), (-1, 0)];
                    let context = around.iter().fold(0, |context, &(i, j)| 2 * context + m(i, j));
                    let bit = self.bit(&mut bits[context]);
                    mask[((top + y) * wide + left + x) as usize] = bit;
                    known.last_mut().expect("just made")[y as usize][x as usize] = bit;
                }
            }
            let number = number.unwrap_or_else(|| (0..16).fold(0, |bits, _| 2 * bits + usize::from(self.flat())));
            for (x, y) in places(8, 8) {
                mask[((top + y) * wide + left + x) as usize] = known[number][y as usize][x as usize];
            }
            tiles.push(number);
        }
        assert_eq!(known.len(), blocks);
        mask.truncate((wide * high) as usize);
        mask
    }

    fn flat(&mut self) -> bool {
        self.range >>= 1;
        let bit = self.code >= self.range;
        self.code -= if bit { self.range } else { 0 };
        if self.range < 1 << 24 {
            self.range <<= 8;
            self.shift();
        }
        bit
    }

    /// The texels of a picture of bytes; `known`: the mask, or what stands for it.
    fn texels(&mut self, width: i32, height: i32, known: &[bool]) -> Vec<u8> {
        let (mut same, mut again, mut spelt) = (vec![NEW; 2048], vec![NEW; 64], vec![NEW; 2048]);
        let mut recent = vec![vec![0u8; 8]; 256];
        let mut texels: Vec<u8> = Vec::new();
        for (x, y) in places(width, height) {
            let t = |i: i32, j: i32| {
                ((0..width).contains(&(x + i)) && y + j >= 0).then(|| i32::from(texels[((y + j) * width + x + i) as usize]))
            };
            let w = t(-1, 0).or(t(0, -1)).unwrap_or(0);
            let n = t(0, -1).unwrap_or(w);
            let (nw, ne, nn) = (t(-1, -1).unwrap_or(n), t(1, -1).unwrap_or(n), t(0, -2).unwrap_or(n));
            let ww = t(-2, 0).unwrap_or(w);
            let covered = usize::from(known[(y * width + x) as usize]);
            let equal = [w == n, n == nw, nw == w, n == ne, w == ww, n == nn];
            let agree: usize = equal.iter().enumerate().map(|(k, &equal)| usize::from(equal) << k).sum();
            let d = (w - nw).abs() + (n - nw).abs() + (n - ne).abs();
            let activity = [3, 10, 40].iter().filter(|&&least| d >= least).count();
            let mut tried = Vec::new();
            let mut texel = None;
            for (place, c) in [w, n, ne, nw].into_iter().enumerate() {
                if texel.is_none() && !tried.contains(&c) {
                    texel = self.bit(&mut same[((4 * agree + activity) * 4 + place) * 2 + covered]).then_some(c);
                    tried.push(c);
                }
            }
            if let Some(texel) = texel {
                texels.push(texel as u8);
                continue;
            }
            let mut rank = 0;
            for c in recent[n as usize].iter().map(|&c| i32::from(c)) {
                if texel.is_none() && !tried.contains(&c) {
                    texel = self.bit(&mut again[(4 * rank + activity) * 2 + covered]).then_some(c);
                    tried.push(c);
                    rank += 1;
                }
            }
            let texel = texel.unwrap_or_else(|| {
                let g = (w + n - nw).clamp(w.min(n).min(nw), w.max(n).max(nw)) as usize >> 5;
                let mut node = 1;
                for _ in 0..8 {
                    node = 2 * node + usize::from(self.bit(&mut spelt[256 * g + node]));
                }
                node as i32 - 256
            }) as u8;
            let list = &mut recent[n as usize];
            list.remove(list.iter().position(|&c| c == texel).unwrap_or(7));
            list.insert(0, texel);
            texels.push(texel);
        }
        texels
    }
}

/// The bits of `mask` that hold the middles of texels.
fn middles(mask: &[bool], width: i32, height: i32, finer: u32) -> Vec<bool> {
    let middle = |at: i32| ((2 * at + 1) << finer) / 2;
    places(width, height).map(|(x, y)| mask[(middle(y) * (width << finer) + middle(x)) as usize]).collect()
}

/// A picture's columns and rows, row by row.
fn places(width: i32, height: i32) -> impl Iterator<Item = (i32, i32)> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

#[test]
fn a_byte_less_than_it_takes_is_refused() {
    let (_, bundles) = both("terrain");
    for bytes in &bundles {
        let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
        let needed = bundle.memory_needed();
        let mut memory = vec![0; needed - 1];
        assert_eq!(Player::new(&bundle, &mut memory).err(), Some(MemoryError::TooSmall { needed, given: needed - 1 }));
        // What is asked for is enough wherever it starts.
        let mut memory = vec![0u8; needed + 8];
        for start in 0..8 {
            assert!(Player::new(&bundle, &mut memory[start..start + needed]).is_ok());
        }
    }
}
