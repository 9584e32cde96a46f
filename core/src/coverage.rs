//! Coverage: the chart test. A sheet of a torn cell shows at a pixel where its own position in the source image falls
//! inside its label's chart. It costs no data and is near exact for every polygonal outline, however thin.
//! Labels come from the bundle, positions from `span`, which also makes the other test, that of the fields.

use crate::atlas::Texture;
use crate::fixed::{PLAY_BITS, PlayUv};
use crate::format::{LabelRecord, MASKED};

/// A label's chart, ready for testing.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
    masked: bool,
}

impl Chart {
    /// The chart of `label`.
    #[must_use]
    pub fn new(label: &LabelRecord) -> Self {
        let edge = |texel: u16| i32::from(texel).wrapping_shl(PLAY_BITS);
        Self {
            left: edge(label.left),
            top: edge(label.top),
            right: edge(label.right),
            bottom: edge(label.bottom),
            masked: label.flags & MASKED != 0,
        }
    }

    /// Whether `uv` falls inside the chart.
    #[must_use]
    pub fn covers(&self, uv: PlayUv, texture: &Texture<'_>) -> bool {
        let inside = uv.u >= self.left && uv.u < self.right && uv.v >= self.top && uv.v < self.bottom;
        inside && (!self.masked || texture.covered(uv))
    }
}
