//! The source image at playback: texels by position, and what belongs to a chart.
//! Borrowed from the bundle or unpacked by `pack`; read by `coverage`, `filter` and `texels`.

use crate::fixed::{PLAY_BITS, PlayUv};
use crate::mask::Mask;

/// Texels and the mask.
#[derive(Clone, Copy, Debug, Default)]
pub struct Texture<'a> {
    /// Texels of the bundle's [`crate::format::TexelKind`], row by row.
    pub texels: &'a [u8],
    /// What of it belongs to a chart; empty where no label is masked.
    pub mask: Mask<'a>,
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
