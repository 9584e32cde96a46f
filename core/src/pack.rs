//! Packed pictures: how a source image's mask and texels are coded, in one description for decoder and encoder alike. Bits come from
//! (or go to) `coder`, texels and mask lie in the caller's memory; `memory` unpacks there what the bundle holds packed, once.
//!
//! Most texels are what one beside them is; of the others most are what was seen before below the same texel; the rest are spelt out,
//! bit by bit, near what the texels around them would go on to. How likely each is follows from how much those agree.
//!
//! That is said of bytes. Texels that are no bytes are coded as planes of them: see [`code_nibbles`] and [`code_direct`].

use crate::coder::{Bits, Probability};
use crate::fixed::{PLAY_BITS, PlayUv};
use crate::mask::{BLOCK_LOG2, Block, Mask, PLAIN, Shape, Tile};
use heapless::Vec;

/// Texels that were last seen below one of a certain index, the latest first.
pub type Recent = [u8; WAYS];
/// Texels in a [`Recent`].
pub const WAYS: usize = 8;
/// How many [`Recent`]s coding takes: one for every index.
pub const INDICES: usize = 256;
/// Texels of a row, at most.
const WIDEST: usize = 1 << 10;
/// Contexts that coding takes.
pub const CONTEXTS: usize = SAME + AGAIN + SPELT;

/// Neighbours that a texel is compared with.
const PLACES: usize = 4;
/// How much the neighbours differ: classes.
const ACTIVITIES: usize = 4;
/// Contexts of "the same as a neighbour": by which neighbours are equal, activity, which of them it is, and whether the texel is covered.
const SAME: usize = 64 * ACTIVITIES * PLACES * 2;
/// Contexts of "seen here before": by the number of those asked about, activity, covered.
const AGAIN: usize = WAYS * ACTIVITIES * 2;
/// Bits of an index's prediction that spelling it out depends on.
const SPELT_BITS: u32 = 3;
/// Contexts of spelling out: a tree of the bits above for each prediction.
const SPELT: usize = INDICES << SPELT_BITS;

/// What coding works in, whatever it holds.
#[derive(Debug)]
pub struct Scratch<'s> {
    /// [`CONTEXTS`] of them.
    pub contexts: &'s mut [Probability],
    /// [`INDICES`] of them.
    pub recent: &'s mut [Recent],
    /// [`row_bytes`] of them; none for texels of a byte.
    pub rows: &'s mut [u8],
}

/// A picture as it is coded: an encoder finds here what to code, a decoder leaves here what it read.
#[derive(Debug)]
pub struct Picture<'p> {
    /// Its size, and its mask's.
    pub shape: Shape,
    /// Texels, row by row.
    pub texels: &'p mut [u8],
    /// The mask's tiles, and its blocks in the order in which they first stand there, after the plain ones. Empty: all texels belong to a chart.
    pub tiles: &'p mut [Tile],
    /// Likewise.
    pub blocks: &'p mut [Block],
}

impl<'p> Picture<'p> {
    /// The texels, and the mask as it is.
    fn parts(&mut self) -> (&mut [u8], Mask<'_>) {
        (self.texels, Mask { tiles: self.tiles, blocks: self.blocks, shape: self.shape })
    }
}

/// Codes `picture`, of a byte a texel, its mask first.
pub fn code<B: Bits>(bits: &mut B, Scratch { contexts, recent, .. }: Scratch<'_>, picture: &mut Picture<'_>) {
    contexts.fill(Probability::NEW);
    code_mask(bits, contexts, picture);
    let Some(mut models) = Models::new(contexts, recent) else { return };
    let (texels, mask) = picture.parts();
    let width_log2 = mask.shape.width_log2;
    let width = 1usize.wrapping_shl(width_log2);
    let mut known = [0; WIDEST >> 3];
    for row in 0..texels.len().wrapping_shr(width_log2) {
        let start = row.wrapping_shl(width_log2);
        let Some((done, own)) = texels.split_at_mut_checked(start) else { return };
        // Rows that are not there are empty.
        let above = |rows: usize| done.get(start.wrapping_sub(width.wrapping_mul(rows))..).unwrap_or(&[]);
        covered(&mask, row, &mut known);
        models.row(bits, own.get_mut(..width).unwrap_or(&mut []), above(1), above(2), &known);
    }
}

/// Codes `picture`, of half a byte a texel, like [`code`]: as if its texels were bytes.
pub fn code_nibbles<B: Bits>(bits: &mut B, scratch: Scratch<'_>, picture: &mut Picture<'_>) {
    let Scratch { contexts, recent, rows } = scratch;
    contexts.fill(Probability::NEW);
    code_mask(bits, contexts, picture);
    let (texels, mask) = picture.parts();
    code_plane(bits, contexts, recent, rows, mask.shape.width_log2, &mut Nibbles { texels, mask });
}

/// Codes `picture`, of RGB565, like [`code`], but as three planes one after the other: green; then red and blue, each less half of
/// green, modulo 32, plus 16.
pub fn code_direct<B: Bits>(bits: &mut B, scratch: Scratch<'_>, picture: &mut Picture<'_>) {
    let Scratch { contexts, recent, rows } = scratch;
    contexts.fill(Probability::NEW);
    code_mask(bits, contexts, picture);
    let (texels, mask) = picture.parts();
    for part in [Part::Green, Part::Red, Part::Blue] {
        let texels = texels.as_chunks_mut().0;
        code_plane(bits, contexts, recent, rows, mask.shape.width_log2, &mut Direct { texels, mask, part });
    }
}

/// Bytes that coding texels that are no bytes works in, for a picture 2^`width_log2` texels wide: three rows, and a bit each.
#[must_use]
pub const fn row_bytes(width_log2: u32) -> usize {
    let width = 1usize.wrapping_shl(width_log2);
    width.wrapping_mul(3).wrapping_add(width >> 3)
}

/// A picture whose texels are no bytes, or a part of each: told as bytes, row by row. `start`: texels before the row.
trait Plane {
    /// Rows of 2^`width_log2` texels.
    fn height(&self, width_log2: u32) -> usize;
    /// Makes `own` what there is to code of its row, and `known` what is known of it beforehand, a bit each.
    fn load(&self, start: usize, own: &mut [u8], known: &mut [u8]);
    /// Keeps what was coded.
    fn store(&mut self, start: usize, own: &[u8]);
}

/// Codes a plane, in new contexts.
fn code_plane<B: Bits>(
    bits: &mut B,
    contexts: &mut [Probability],
    recent: &mut [Recent],
    rows: &mut [u8],
    width_log2: u32,
    plane: &mut impl Plane,
) {
    let Some(mut models) = Models::new(contexts, recent) else { return };
    let width = 1usize.wrapping_shl(width_log2);
    let Some((own, rest)) = rows.split_at_mut_checked(width) else { return };
    let Some((above, rest)) = rest.split_at_mut_checked(width) else { return };
    let Some((second, known)) = rest.split_at_mut_checked(width) else { return };
    let mut lines = [own, above, second];
    for row in 0..plane.height(width_log2) {
        let start = row.wrapping_shl(width_log2);
        let [own, above, second] = &mut lines;
        plane.load(start, own, known);
        models.row(bits, own, if row > 0 { above } else { &[] }, if row > 1 { second } else { &[] }, known);
        plane.store(start, own);
        lines.rotate_right(1);
    }
}

/// Texels of half a byte, two in each.
struct Nibbles<'p> {
    texels: &'p mut [u8],
    mask: Mask<'p>,
}

impl Plane for Nibbles<'_> {
    fn height(&self, width_log2: u32) -> usize {
        self.texels.len().wrapping_mul(2).wrapping_shr(width_log2)
    }

    fn load(&self, start: usize, own: &mut [u8], known: &mut [u8]) {
        let texels = self.texels.get(start >> 1..).unwrap_or(&[]);
        for ([low, high], two) in own.as_chunks_mut().0.iter_mut().zip(texels) {
            (*low, *high) = (two & 15, two >> 4);
        }
        covered(&self.mask, start.wrapping_shr(self.mask.shape.width_log2), known);
    }

    fn store(&mut self, start: usize, own: &[u8]) {
        let texels = self.texels.get_mut(start >> 1..).unwrap_or(&mut []);
        for ([low, high], two) in own.as_chunks().0.iter().zip(texels) {
            *two = low & 15 | high << 4;
        }
    }
}

/// Which of the texels of row `row` belong to a chart, as far as the bit of the `mask` to the right of their middle and below it knows; all without a mask.
#[inline(never)]
fn covered(mask: &Mask<'_>, row: usize, known: &mut [u8]) {
    if mask.tiles.is_empty() {
        return known.fill(0xff);
    }
    known.fill(0);
    let at = |texel: usize| (texel as i32).wrapping_shl(PLAY_BITS) | (1 << PLAY_BITS) >> 1;
    for texel in 0..1usize.wrapping_shl(mask.shape.width_log2) {
        if let Some(eight) = known.get_mut(texel >> 3) {
            *eight |= u8::from(mask.covers(PlayUv { u: at(texel), v: at(row) })) << (texel & 7);
        }
    }
}

/// A component of RGB565.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Green,
    Red,
    Blue,
}

/// One component of texels of RGB565.
struct Direct<'p> {
    texels: &'p mut [[u8; 2]],
    mask: Mask<'p>,
    part: Part,
}

impl Part {
    /// Where the component's lowest bit stands.
    const fn shift(self) -> u32 {
        match self {
            Self::Green => 5,
            Self::Red => 11,
            Self::Blue => 0,
        }
    }

    /// What stands for the component of `texel`: green as it is, the others by what they are more than half of it, both in a byte's upper bits.
    const fn byte(self, texel: u16) -> u8 {
        let green = texel >> 5 & 63;
        let own = texel.wrapping_shr(self.shift());
        match self {
            Self::Green => (green << 2) as u8,
            _ => (own.wrapping_sub(green >> 1).wrapping_add(16) << 3) as u8,
        }
    }

    /// `texel` with the component that `byte` stands for.
    const fn set(self, texel: u16, byte: u8) -> u16 {
        let green = texel >> 5 & 63;
        let (value, all) = match self {
            Self::Green => (byte as u16 >> 2, 63u16),
            _ => ((byte as u16 >> 3).wrapping_add(16).wrapping_add(green >> 1) & 31, 31),
        };
        texel & !all.wrapping_shl(self.shift()) | value.wrapping_shl(self.shift())
    }
}

impl Plane for Direct<'_> {
    fn height(&self, width_log2: u32) -> usize {
        self.texels.len().wrapping_shr(width_log2)
    }

    fn load(&self, start: usize, own: &mut [u8], known: &mut [u8]) {
        let texels = self.texels.get(start..).unwrap_or(&[]);
        for (byte, texel) in own.iter_mut().zip(texels) {
            *byte = self.part.byte(u16::from_le_bytes(*texel));
        }
        if self.part == Part::Green {
            return covered(&self.mask, start.wrapping_shr(self.mask.shape.width_log2), known);
        }
        // Where what is known of a texel is as to the left, the rest most often is too.
        let all = if self.part == Part::Red { 0x07e0 } else { 0xffe0 };
        let mut left = None;
        for (bits, texels) in known.iter_mut().zip(texels.chunks(8)) {
            *bits = 0;
            for (place, texel) in texels.iter().enumerate() {
                let own = Some(u16::from_le_bytes(*texel) & all);
                *bits |= u8::from(own == left) << (place & 7);
                left = own;
            }
        }
    }

    fn store(&mut self, start: usize, own: &[u8]) {
        let texels = self.texels.get_mut(start..).unwrap_or(&mut []);
        for (byte, texel) in own.iter().zip(texels) {
            *texel = self.part.set(u16::from_le_bytes(*texel), *byte).to_le_bytes();
        }
    }
}

/// Codes a bit in one of `contexts`.
#[inline]
fn coded<B: Bits>(bits: &mut B, contexts: &mut [Probability], context: usize, bit: bool) -> bool {
    contexts.get_mut(context).is_some_and(|context| bits.bit(context, bit))
}

/// The numbers of the blocks that cover all, and nothing.
const PLAINS: [u16; 2] = [0, 1];
/// Contexts of a block's bits; those of what stands at a tile come after.
const BITS: usize = 1 << 10;
/// Ways to tell what stands at a tile: as to the left, as above, all, nothing, a new block.
const NEW: usize = 4;

/// Codes the mask, tile by tile: which block stands there, and where that is a new one its bits.
// Seldom, and long: so are the others that say so.
#[inline(never)]
fn code_mask<B: Bits>(bits: &mut B, contexts: &mut [Probability], picture: &mut Picture<'_>) {
    let Picture { shape, tiles, blocks, .. } = picture;
    let Some((contexts, kinds)) = contexts.split_at_mut_checked(BITS) else { return };
    let width = 1usize.wrapping_shl(shape.row_log2());
    blocks.iter_mut().zip(PLAIN).for_each(|(block, plain)| *block = plain);
    let mut known = PLAIN.len();
    for at in 0..tiles.len() {
        let Some((done, [own, ..])) = tiles.split_at_mut_checked(at) else { break };
        let column = at & width.wrapping_sub(1);
        let number = |back: usize| done.get(at.wrapping_sub(back)).map_or(PLAINS[1], |tile| u16::from_le_bytes(*tile));
        let (west, north) = (if column == 0 { PLAINS[1] } else { number(1) }, number(width));
        let wanted = u16::from_le_bytes(*own);
        let class = |number: u16| usize::from(number.min(2));
        let around = class(west).wrapping_mul(3).wrapping_add(class(north));
        let tried = [west, north, PLAINS[0], PLAINS[1]];
        let mut like = tried.iter().enumerate().filter(|&(way, candidate)| !tried.iter().take(way).any(|before| before == candidate));
        let found = like.find(|&(way, &candidate)| told(bits, kinds, [way, around], candidate == wanted)).map(|(_, &candidate)| candidate);
        let found = found.unwrap_or_else(|| {
            if known < blocks.len() && told(bits, kinds, [NEW, around], usize::from(wanted) == known) {
                let (before, rest) = blocks.split_at_mut(known);
                if let Some(block) = rest.first_mut() {
                    let place = [column, at.wrapping_shr(shape.row_log2())].map(|tile| (tile << BLOCK_LOG2) as u32);
                    let mask = Mask { tiles: done, blocks: before, shape: *shape };
                    *block = Before { mask, block: PLAIN[1], place }.code(bits, contexts, *block);
                }
                known = known.wrapping_add(1);
                return known.wrapping_sub(1) as u16;
            }
            bits.flat(16, wanted.into()) as u16
        });
        *own = found.to_le_bytes();
    }
    // What is not told must not show what the caller's memory held.
    blocks.get_mut(known..).unwrap_or(&mut []).fill(PLAIN[1]);
}

/// Codes whether what stands at a tile is told this `way`, given what stands `around` it.
#[inline(never)]
fn told<B: Bits>(bits: &mut B, kinds: &mut [Probability], [way, around]: [usize; 2], is: bool) -> bool {
    coded(bits, kinds, way.wrapping_mul(9).wrapping_add(around), is)
}

/// What of a mask is coded before a bit: the tiles before its block, and the block's own bits so far.
struct Before<'m> {
    mask: Mask<'m>,
    block: Block,
    /// The block's first bit.
    place: [u32; 2],
}

impl Before<'_> {
    /// The bit in column `x` and row `y`, counted from the block's; 0 where none is coded, and beyond the picture.
    #[inline(never)]
    fn bit(&self, x: u32, y: u32) -> usize {
        if let Some(row) = self.block.get(y as usize).filter(|_| x < 8) {
            return usize::from(row >> x & 1);
        }
        let [left, top] = self.place;
        let at = [left.wrapping_add(x), top.wrapping_add(y)];
        // What is to the left of the picture or above it comes to more than its size.
        let inside = at[0] >> BLOCK_LOG2 >> self.mask.shape.row_log2() == 0 && at[1] < u32::MAX >> 1;
        usize::from(inside && self.mask.bit(at))
    }

    /// Codes the block, which is to be `wanted` where bits are written: each bit by the two to its left, the five above these and the three above those.
    #[inline(never)]
    fn code<B: Bits>(mut self, bits: &mut B, contexts: &mut [Probability], wanted: Block) -> Block {
        for (y, wanted) in (0u32..).zip(wanted) {
            for x in 0..8u32 {
                let mut context = 0;
                for (above, from, to) in [(2u32, 1u32, 1u32), (1, 2, 2), (0, 2, 0)] {
                    let end = x.wrapping_add(to).wrapping_add(u32::from(above > 0));
                    let mut at = x.wrapping_sub(from);
                    while at != end {
                        context = context << 1 | self.bit(at, y.wrapping_sub(above));
                        at = at.wrapping_add(1);
                    }
                }
                let covered = coded(bits, contexts, context, wanted >> x & 1 == 1);
                if let Some(row) = self.block.get_mut(y as usize) {
                    *row |= u8::from(covered) << x;
                }
            }
        }
        self.block
    }
}

/// What is known around a texel.
struct Around {
    west: u8,
    north: u8,
    north_east: u8,
    north_west: u8,
    /// Which of them are equal: six bits.
    agree: usize,
    /// How much they differ.
    activity: usize,
    /// 1 if the texel belongs to a chart.
    covered: usize,
}

impl Around {
    /// Where the neighbours would go on to: a plane through them, kept between the least and the most of them.
    fn onwards(&self) -> i32 {
        let [west, north, corner] = [self.west, self.north, self.north_west].map(i32::from);
        let (least, most) = (west.min(north).min(corner), west.max(north).max(corner));
        west.wrapping_add(north).wrapping_sub(corner).max(least).min(most)
    }
}

/// What coding texels learns.
struct Models<'m> {
    same: &'m mut [Probability],
    again: &'m mut [Probability],
    spelt: &'m mut [Probability],
    recent: &'m mut [Recent],
}

impl<'m> Models<'m> {
    /// New ones, in `contexts` and `recent`; `None` where these are too few.
    fn new(contexts: &'m mut [Probability], recent: &'m mut [Recent]) -> Option<Self> {
        contexts.fill(Probability::NEW);
        recent.fill([0; WAYS]);
        let (same, rest) = contexts.split_at_mut_checked(SAME)?;
        let (again, spelt) = rest.split_at_mut_checked(AGAIN)?;
        Some(Self { same, again, spelt, recent })
    }
}

impl Models<'_> {
    /// Codes a row of texels; `above` and `second` begin with the rows above it, `mask` with its own bits. Any of them is empty where it is not there.
    fn row<B: Bits>(&mut self, bits: &mut B, own: &mut [u8], above: &[u8], second: &[u8], mask: &[u8]) {
        let mut mask = mask.iter();
        let mut covered = 0u32;
        let mut west = above.first().copied().unwrap_or(0);
        let (mut west_west, mut corner) = (west, west);
        // Row ends are where rows above end, whatever follows.
        let above = above.get(..own.len()).unwrap_or(&[]);
        for (column, texel) in own.iter_mut().enumerate() {
            if column & 7 == 0 {
                covered = mask.next().map_or(0xff, |&byte| u32::from(byte));
            }
            let north = above.get(column).copied().unwrap_or(west);
            let north_west = if above.is_empty() { north } else { corner };
            let north_east = above.get(column.wrapping_add(1)).copied().unwrap_or(north);
            let north_north = second.get(column).copied().unwrap_or(north);
            let pairs =
                [(west, north), (north, north_west), (north_west, west), (north, north_east), (west, west_west), (north, north_north)];
            let agree = pairs.iter().rev().fold(0, |bits, (a, b)| bits << 1 | usize::from(a == b));
            let apart = |a: u8, b: u8| u32::from(a.abs_diff(b));
            let activity = match apart(west, north_west).wrapping_add(apart(north, north_west)).wrapping_add(apart(north, north_east)) {
                0..3 => 0,
                3..10 => 1,
                10..40 => 2,
                _ => 3,
            };
            let around = Around { west, north, north_east, north_west, agree, activity, covered: covered as usize & 1 };
            *texel = self.texel(bits, &around, *texel);
            covered >>= 1;
            west_west = if column == 0 { *texel } else { west };
            (west, corner) = (*texel, north);
        }
    }

    /// Codes one texel.
    fn texel<B: Bits>(&mut self, bits: &mut B, around: &Around, wanted: u8) -> u8 {
        let &Around { west, north, north_east, north_west, agree, activity, covered } = around;
        let mut tried: Vec<u8, { PLACES + WAYS }> = Vec::new();
        for (place, candidate) in [west, north, north_east, north_west].into_iter().enumerate() {
            if tried.contains(&candidate) {
                continue;
            }
            let context = ((agree << 2 | activity) << 2 | place) << 1 | covered;
            if coded(bits, self.same, context, candidate == wanted) {
                return candidate;
            }
            let _ = tried.push(candidate);
        }
        let mut none = [0; WAYS];
        let recent = self.recent.get_mut(usize::from(north)).unwrap_or(&mut none);
        let (mut found, mut rank) = (None, 0usize);
        for &candidate in recent.iter() {
            if tried.contains(&candidate) {
                continue;
            }
            if coded(bits, self.again, (rank << 2 | activity) << 1 | covered, candidate == wanted) {
                found = Some(candidate);
                break;
            }
            let _ = tried.push(candidate);
            rank = rank.wrapping_add(1);
        }
        let texel = found.unwrap_or_else(|| {
            let tree = (around.onwards() as usize) >> (8u32.wrapping_sub(SPELT_BITS)) << 8;
            let mut node = 1usize;
            for shift in (0..8).rev() {
                node = node << 1 | usize::from(coded(bits, self.spelt, tree | node, wanted >> shift & 1 == 1));
            }
            node as u8
        });
        // To the front, where it was left out of the way; what is last falls off where it was not there.
        let mut moved = texel;
        for slot in recent {
            moved = core::mem::replace(slot, moved);
            if moved == texel {
                break;
            }
        }
        texel
    }
}
