//! The source image at playback: texels by position, and whether a texel belongs to its chart.
//! Borrowed from the bundle or unpacked by `pack`; read by `coverage`, `filter` and `texels`.

use crate::fixed::{PLAY_BITS, PlayUv};

/// The colour plane and the mask.
#[derive(Clone, Copy, Debug, Default)]
pub struct Texture<'a> {
    /// Texels of the bundle's [`crate::format::TexelKind`], row by row.
    pub texels: &'a [u8],
    /// One bit a texel, least significant first; empty where no label is masked.
    pub mask: &'a [u8],
    /// A row is 2^this texels.
    pub width_log2: u32,
    /// Rows.
    pub height: u32,
}

impl Texture<'_> {
    /// The index of the texel that holds `uv`; any index at all for a position outside.
    #[must_use]
    pub const fn index(&self, uv: PlayUv) -> usize {
        ((uv.v >> PLAY_BITS << self.width_log2) | (uv.u >> PLAY_BITS)) as u32 as usize
    }

    /// Whether the texel at `uv` belongs to a chart.
    #[must_use]
    pub fn covered(&self, uv: PlayUv) -> bool {
        let index = self.index(uv);
        self.mask.get(index >> 3).is_some_and(|byte| byte >> (index & 7) & 1 == 1)
    }

    /// Whether `uv` lies inside the picture.
    #[must_use]
    #[inline]
    pub const fn holds(&self, uv: PlayUv) -> bool {
        ((uv.u >> PLAY_BITS) as u32) < 1 << self.width_log2 && ((uv.v >> PLAY_BITS) as u32) < self.height
    }

    /// The position inside the picture that is closest to `uv`.
    #[must_use]
    pub fn clamp(&self, uv: PlayUv) -> PlayUv {
        let limit = |size: u32| (size.wrapping_shl(PLAY_BITS) as i32).wrapping_sub(1).max(0);
        PlayUv { u: uv.u.clamp(0, limit(1 << self.width_log2)), v: uv.v.clamp(0, limit(self.height)) }
    }
}
