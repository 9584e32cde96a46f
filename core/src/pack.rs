//! Packed pictures: how a source image's mask and texels are coded, in one description for decoder and encoder alike. Bits come from
//! (or go to) `coder`, texels and mask lie in the caller's memory; `memory` unpacks there what the bundle holds packed, once.
//!
//! Most texels are what one beside them is; of the others most are what was seen before below the same texel; the rest are spelt out,
//! bit by bit, near what the texels around them would go on to. How likely each is follows from how much those agree.

use crate::coder::{Bits, Probability};
use heapless::Vec;

/// Texels that were last seen below one of a certain index, the latest first.
pub type Recent = [u8; WAYS];
/// Texels in a [`Recent`].
pub const WAYS: usize = 8;
/// How many [`Recent`]s coding takes: one for every index.
pub const INDICES: usize = 256;
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

/// A picture as it is coded: an encoder finds here what to code, a decoder leaves here what it read.
#[derive(Debug)]
pub struct Picture<'p> {
    /// A row is 2^this texels.
    pub width_log2: u32,
    /// One palette index a texel, row by row.
    pub texels: &'p mut [u8],
    /// One bit a texel, least significant first: does it belong to a chart? Empty: all do.
    pub mask: &'p mut [u8],
}

/// Codes `picture`, its mask first, in `contexts` ([`CONTEXTS`] of them) and `recent` ([`INDICES`] of them), whatever these hold.
pub fn code<B: Bits>(bits: &mut B, contexts: &mut [Probability], recent: &mut [Recent], picture: &mut Picture<'_>) {
    contexts.fill(Probability::NEW);
    code_mask(bits, contexts, picture);
    contexts.fill(Probability::NEW);
    recent.fill([0; WAYS]);
    let Some((same, rest)) = contexts.split_at_mut_checked(SAME) else { return };
    let Some((again, spelt)) = rest.split_at_mut_checked(AGAIN) else { return };
    let mut models = Models { same, again, spelt, recent };
    for row in 0..picture.texels.len().wrapping_shr(picture.width_log2) {
        for column in 0..1usize.wrapping_shl(picture.width_log2) {
            let at = row.wrapping_shl(picture.width_log2).wrapping_add(column);
            let around = Around::of(picture, at, row, column);
            if let Some(texel) = picture.texels.get_mut(at) {
                *texel = models.texel(bits, &around, *texel);
            }
        }
    }
}

/// Codes a bit in one of `contexts`.
#[inline]
fn coded<B: Bits>(bits: &mut B, contexts: &mut [Probability], context: usize, bit: bool) -> bool {
    contexts.get_mut(context).is_some_and(|context| bits.bit(context, bit))
}

/// Codes the mask: each bit by the two to its left, the five above these and the three above those.
fn code_mask<B: Bits>(bits: &mut B, contexts: &mut [Probability], picture: &mut Picture<'_>) {
    let (log2, mask) = (picture.width_log2, &mut *picture.mask);
    let width = 1usize.wrapping_shl(log2);
    for row in 0..mask.len().wrapping_mul(8).wrapping_shr(log2) {
        // The bit `up` rows above, in a column; 0 outside the picture.
        let above = |mask: &[u8], up: usize, column: usize| {
            let Some(row) = row.checked_sub(up).filter(|_| column < width) else { return 0 };
            let at = row.wrapping_shl(log2).wrapping_add(column);
            usize::from(mask.get(at >> 3).copied().unwrap_or(0) >> (at & 7) & 1)
        };
        let mut own = 0usize;
        let mut first = above(mask, 1, 0) << 1 | above(mask, 1, 1);
        let mut second = above(mask, 2, 0);
        for column in 0..width {
            first = (first << 1 | above(mask, 1, column.wrapping_add(2))) & 31;
            second = (second << 1 | above(mask, 2, column.wrapping_add(1))) & 7;
            let at = row.wrapping_shl(log2).wrapping_add(column);
            let Some(byte) = mask.get_mut(at >> 3) else { return };
            let bit = coded(bits, contexts, second << 7 | first << 2 | own, *byte >> (at & 7) & 1 == 1);
            *byte = *byte & !(1u8 << (at & 7)) | u8::from(bit) << (at & 7);
            own = (own << 1 | usize::from(bit)) & 3;
        }
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
    /// What is known around the texel with the index `at`.
    #[inline]
    fn of(picture: &Picture<'_>, at: usize, row: usize, column: usize) -> Self {
        let width = 1usize.wrapping_shl(picture.width_log2);
        let texel = |exists: bool, before: usize| picture.texels.get(at.wrapping_sub(before)).copied().filter(|_| exists);
        let (up, left) = (row > 0, column > 0);
        let above = texel(up, width);
        let west = texel(left, 1).or(above).unwrap_or(0);
        let north = above.unwrap_or(west);
        let north_west = texel(up && left, width.wrapping_add(1)).unwrap_or(north);
        let north_east = texel(up && column.wrapping_add(1) < width, width.wrapping_sub(1)).unwrap_or(north);
        let west_west = texel(column > 1, 2).unwrap_or(west);
        let north_north = texel(row > 1, width.wrapping_mul(2)).unwrap_or(north);
        let pairs = [(west, north), (north, north_west), (north_west, west), (north, north_east), (west, west_west), (north, north_north)];
        let agree = pairs.iter().rev().fold(0, |bits, (a, b)| bits << 1 | usize::from(a == b));
        let apart = |a: u8, b: u8| u32::from(a.abs_diff(b));
        let activity = match apart(west, north_west).wrapping_add(apart(north, north_west)).wrapping_add(apart(north, north_east)) {
            0..3 => 0,
            3..10 => 1,
            10..40 => 2,
            _ => 3,
        };
        let covered = picture.mask.get(at >> 3).is_none_or(|byte| byte >> (at & 7) & 1 == 1);
        Self { west, north, north_east, north_west, agree, activity, covered: usize::from(covered) }
    }

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

impl Models<'_> {
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
