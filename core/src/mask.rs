//! The mask: what of the source image belongs to a chart, in bits of a texel's size, or of a half or a quarter of it where outlines want that.
//! Borrowed from the bundle or unpacked by `pack`; asked by `coverage` and `span`.
//!
//! Most of a picture is all covered or not at all, and alike elsewhere: the mask is made of blocks of 8 by 8 bits, each different one once, and tiles
//! that say which one stands where.

use crate::bounds::Bounds;
use crate::fixed::{PLAY_BITS, PlayUv};

/// A block is 2^this bits wide and high.
pub const BLOCK_LOG2: u32 = 3;
/// A block's rows from the top; the leftmost bit is the least one.
pub type Block = [u8; 8];
/// Which block stands at a tile: its number, little-endian.
pub type Tile = [u8; 2];
/// The block that covers all, and the one that covers nothing: blocks 0 and 1.
pub const PLAIN: [Block; 2] = [[0xff; 8], [0; 8]];

/// How large a picture's mask is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// A row of texels is 2^this long.
    pub width_log2: u32,
    /// Rows of texels.
    pub height: u32,
    /// 2^this bits of the mask are as wide and as high as a texel: 0 to [`crate::format::MOST_FINER`].
    pub finer: u32,
}

impl Shape {
    /// A row is 2^this tiles.
    #[must_use]
    pub const fn row_log2(self) -> u32 {
        self.width_log2.wrapping_add(self.finer).wrapping_sub(BLOCK_LOG2)
    }

    /// Tiles: rows of them cover all rows of bits, the last one perhaps more.
    #[must_use]
    pub const fn tiles(self) -> usize {
        let rows = self.height.wrapping_shl(self.finer).wrapping_add(7) >> BLOCK_LOG2;
        (rows as usize).wrapping_shl(self.row_log2())
    }
}

/// A mask.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mask<'a> {
    /// Row by row from the top; none where no label is masked.
    pub tiles: &'a [Tile],
    /// The blocks that they name. One that is not there covers nothing.
    pub blocks: &'a [Block],
    /// Its size.
    pub shape: Shape,
}

impl Mask<'_> {
    /// The block at a tile.
    #[inline(always)]
    fn block(&self, [across, down]: [u32; 2]) -> Option<&Block> {
        let tile = self.tiles.get((down.wrapping_shl(self.shape.row_log2()) | across) as usize)?;
        self.blocks.get(usize::from(u16::from_le_bytes(*tile)))
    }

    /// The bit that holds `uv`, from the picture's left upper corner.
    #[inline(always)]
    const fn place(&self, uv: PlayUv) -> [u32; 2] {
        let bits = PLAY_BITS.wrapping_sub(self.shape.finer);
        [uv.u.wrapping_shr(bits) as u32, uv.v.wrapping_shr(bits) as u32]
    }

    /// A bit, from the left upper corner; any at all for one outside.
    #[inline(always)]
    pub(crate) fn bit(&self, [x, y]: [u32; 2]) -> bool {
        let row = self.block([x >> BLOCK_LOG2, y >> BLOCK_LOG2]).and_then(|block| block.get((y & 7) as usize));
        row.is_some_and(|row| row >> (x & 7) & 1 == 1)
    }

    /// Whether what lies at `uv` belongs to a chart; any answer at all for a position outside the picture.
    #[must_use]
    #[inline]
    pub fn covers(&self, uv: PlayUv) -> bool {
        self.bit(self.place(uv))
    }

    /// Whether all that lies within `bounds`, which are inside the picture, belongs to a chart; so that it takes no longer than what it saves, no
    /// is said of bounds that are larger than any block of pixels should be.
    #[must_use]
    #[inline(never)]
    pub fn fills(&self, &Bounds { low, high }: &Bounds) -> bool {
        const MOST: u32 = 8;
        let ([left, top], [right, bottom]) = (self.place(low), self.place(high));
        if (right >> BLOCK_LOG2).wrapping_sub(left >> BLOCK_LOG2) >= MOST || (bottom >> BLOCK_LOG2).wrapping_sub(top >> BLOCK_LOG2) >= MOST
        {
            return false;
        }
        // The first and the last bit of a row or column that counts, in the block that `at` is in, of bits from `first` to `last`.
        let part = |at: u32, first: u32, last: u32| [first.saturating_sub(at), last.wrapping_sub(at).min(7)];
        let mut y = top & !7;
        while y <= bottom {
            let [from, to] = part(y, top, bottom);
            let mut x = left & !7;
            while x <= right {
                let Some(block) = self.block([x >> BLOCK_LOG2, y >> BLOCK_LOG2]) else { return false };
                let [first, last] = part(x, left, right);
                let wanted = 0xffu32.wrapping_shl(first) & 0xffu32.wrapping_shr(7u32.wrapping_sub(last));
                let rows = block.iter().skip(from as usize).take(to.wrapping_sub(from).wrapping_add(1) as usize);
                if !rows.fold(0xff, |all, &row| all & u32::from(row)) & wanted != 0 {
                    return false;
                }
                x = x.wrapping_add(8);
            }
            y = y.wrapping_add(8);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_larger_than_blocks_should_be_is_not_looked_through() {
        let shape = Shape { width_log2: 10, height: 1024, finer: 2 };
        let tiles = [Tile::default(); 512 * 512];
        let mask = Mask { tiles: &tiles, blocks: &[[0xff; 8]], shape };
        let fills = |side: i32| mask.fills(&Bounds { low: PlayUv { u: 0, v: 0 }, high: PlayUv { u: side << 16, v: 5 << 16 } });
        assert_eq!([15, 16, 1023].map(fills), [true, false, false]);
    }

    #[test]
    fn what_is_covered_and_filled_is_what_bits_say() {
        let mut seed = 3u32;
        let mut next = |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(seed) * u64::from(below)) >> 32) as u32
        };
        for finer in 0..3 {
            let shape = Shape { width_log2: 5, height: 12, finer };
            // A dozen blocks, most of them nearly full; more numbers than that.
            let mut blocks: [Block; 12] = core::array::from_fn(|at| {
                let holes = if at < 2 { 0 } else { next(4) };
                (0..holes).fold(u64::MAX, |bits, _| bits & !(1 << next(64))).to_le_bytes()
            });
            blocks.iter_mut().zip(PLAIN).for_each(|(block, plain)| *block = plain);
            let tiles: [Tile; 96] = core::array::from_fn(|_| (next(16) as u16).saturating_sub(3).to_le_bytes());
            let tiles = tiles.get(..shape.tiles()).unwrap_or(&[]);
            let mask = Mask { tiles, blocks: &blocks, shape };
            let wide = 32u32 << finer;
            let bit = |x: u32, y: u32| {
                let tile = tiles.get(((y >> 3) * (wide >> 3) + (x >> 3)) as usize).copied().unwrap_or_default();
                let block = blocks.get(usize::from(u16::from_le_bytes(tile)));
                block.is_some_and(|block| u64::from_le_bytes(*block) >> (8 * (y & 7) + (x & 7)) & 1 == 1)
            };
            let (mut some, mut all) = (0, 0);
            for _ in 0..20_000 {
                let [u, v] = [next(32 << 16), next(12 << 16)];
                let [right, bottom] = [(u + next(8 << 16)).min((32 << 16) - 1), (v + next(8 << 16)).min((12 << 16) - 1)];
                let at = |u: u32, v: u32| PlayUv { u: u as i32, v: v as i32 };
                let bits = 16 - finer;
                assert_eq!(mask.covers(at(u, v)), bit(u >> bits, v >> bits));
                let filled = (v >> bits..=bottom >> bits).all(|y| (u >> bits..=right >> bits).all(|x| bit(x, y)));
                assert_eq!(mask.fills(&Bounds { low: at(u, v), high: at(right, bottom) }), filled);
                (some, all) = (some + u32::from(!filled), all + u32::from(filled));
            }
            assert!(some > 1000 && all > 1000, "{some} {all}");
            // Outside any answer will do, but there is one.
            for (u, v) in [(-1, -1), (i32::MAX, i32::MIN), (-1 << 16, 5 << 16), (5 << 16, 4000 << 16)] {
                let _ = mask.covers(PlayUv { u, v });
            }
        }
        assert!(!Mask::default().covers(PlayUv::default()));
    }
}
