//! What a player says about its work and its pixels. Counted by `playing` and `draw`, read by callers.

use crate::fixed::PlayUv;

/// Work done since the last `seek`, for figures and overlays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Work {
    /// Keys that the seek decoded whole, or whose last slice it decoded.
    pub keys: u32,
    /// Slices of keys that it decoded: a slice is a row of nodes, or the lists of a few rows of cells.
    pub slices: u32,
    /// Bytes that it read of those keys' records.
    pub record_bytes: u32,
    /// Layers interpolated in time.
    pub layers: u32,
    /// Pixels drawn in smooth cells.
    pub smooth_pixels: u32,
    /// Pixels drawn in torn cells.
    pub torn_pixels: u32,
    /// Coverage tests made for them.
    pub coverage_tests: u32,
    /// Pixels of blocks that [`crate::Player::smooth_row`] or [`crate::Player::fine_row`] sampled four times.
    pub smoothed_pixels: u32,
}

/// Where a pixel comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Probe {
    /// The label of the sheet that shows.
    pub label: u8,
    /// Its position in the source image, Q15.16 texels.
    pub at: PlayUv,
}
