//! Coverage: the chart test. A sheet of a torn cell shows at a pixel where its own position in the source image falls
//! inside its label's chart. It costs no data and is near exact for every polygonal outline, however thin.
//! Labels come from the bundle, positions from `span`, which also makes the other test, that of the fields; `plan` asks for blocks.

use crate::atlas::Texture;
use crate::fixed::{PLAY_BITS, PlayUv};
use crate::format::{LabelRecord, MASKED, STRIP};

/// How much of something a sheet covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cover {
    /// None of it.
    Nothing,
    /// Perhaps some of it.
    Part,
    /// All of it.
    All,
}

impl Cover {
    /// What two tests that both have to pass leave.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, _) | (_, Self::Nothing) => Self::Nothing,
            (Self::All, Self::All) => Self::All,
            _ => Self::Part,
        }
    }
}

/// A label's chart, ready for testing, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Chart {
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
    /// The label's.
    flags: u32,
}

impl Chart {
    /// The chart of `label`.
    #[must_use]
    pub fn new(label: &LabelRecord) -> Self {
        let edge = |texel: u16| i32::from(texel).wrapping_shl(PLAY_BITS);
        let LabelRecord { left, top, right, bottom, flags, .. } = *label;
        Self { left: edge(left), top: edge(top), right: edge(right), bottom: edge(bottom), flags: flags.into() }
    }

    /// The label's outline is told by two fields.
    #[must_use]
    #[inline]
    pub const fn strip(&self) -> bool {
        self.flags & STRIP as u32 != 0
    }

    const fn masked(&self) -> bool {
        self.flags & MASKED as u32 != 0
    }

    /// Whether `uv` falls inside the chart.
    #[must_use]
    #[inline]
    pub fn covers(&self, uv: PlayUv, texture: &Texture<'_>) -> bool {
        let inside = uv.u >= self.left && uv.u < self.right && uv.v >= self.top && uv.v < self.bottom;
        inside && (!self.masked() || texture.covered(uv))
    }

    /// How much the chart covers of what lies between `points`, with some room for rounding.
    #[must_use]
    #[inline]
    pub fn cover<const N: usize>(&self, points: &[PlayUv; N]) -> Cover {
        // Q16 texels.
        const SLACK: i32 = 64;
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        for uv in points {
            low = [low[0].min(uv.u), low[1].min(uv.v)];
            high = [high[0].max(uv.u), high[1].max(uv.v)];
        }
        let (left, right) = (self.left.wrapping_sub(SLACK), self.right.wrapping_add(SLACK));
        let (top, bottom) = (self.top.wrapping_sub(SLACK), self.bottom.wrapping_add(SLACK));
        if high[0] < left || low[0] >= right || high[1] < top || low[1] >= bottom {
            return Cover::Nothing;
        }
        const TWICE: i32 = 2 * SLACK;
        let across = low[0] >= left.wrapping_add(TWICE) && high[0] < right.wrapping_sub(TWICE);
        let down = low[1] >= top.wrapping_add(TWICE) && high[1] < bottom.wrapping_sub(TWICE);
        if across && down && !self.masked() { Cover::All } else { Cover::Part }
    }
}
