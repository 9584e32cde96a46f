//! Coverage: the chart test. A sheet of a torn cell shows at a pixel where its own position in the source image falls
//! inside its label's chart. It costs no data and is near exact for every polygonal outline, however thin.
//! Labels come from the bundle, positions from `span`, which also makes the other test, that of the fields; `plan` asks for blocks.

use crate::atlas::Texture;
use crate::bounds::Bounds;
use crate::fixed::{PLAY_BITS, PlayUv};
use crate::format::{LabelRecord, MASKED, STRIP};
use core::ops::Range;

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
    /// Q16 texels.
    pub left: i32,
    /// Likewise.
    pub top: i32,
    /// Exclusive.
    pub right: i32,
    /// Exclusive.
    pub bottom: i32,
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

    /// The fields that tell the label's outline: one, or two of a strip.
    #[must_use]
    #[inline]
    pub const fn fields(&self) -> Range<usize> {
        0..if self.flags & STRIP as u32 != 0 { 2 } else { 1 }
    }

    /// The chart does not fill its rectangle: the mask says where it is.
    #[must_use]
    pub const fn masked(&self) -> bool {
        self.flags & MASKED as u32 != 0
    }

    /// Whether `uv` falls inside the chart.
    #[must_use]
    #[inline]
    pub fn covers(&self, uv: PlayUv, texture: &Texture<'_>) -> bool {
        let inside = uv.u >= self.left && uv.u < self.right && uv.v >= self.top && uv.v < self.bottom;
        inside && (!self.masked() || texture.mask.covers(uv))
    }

    /// Whether nothing of the chart lies within `bounds`, with some room for rounding.
    #[must_use]
    #[inline(always)]
    pub const fn misses(&self, &Bounds { low, high }: &Bounds) -> bool {
        let (left, right) = (self.left.wrapping_sub(SLACK), self.right.wrapping_add(SLACK));
        let (top, bottom) = (self.top.wrapping_sub(SLACK), self.bottom.wrapping_add(SLACK));
        high.v < top || low.v >= bottom || high.u < left || low.u >= right
    }

    /// Whether the chart covers all that lies within `bounds`, with some room for rounding.
    #[must_use]
    #[inline(always)]
    pub fn fills(&self, bounds: &Bounds, texture: &Texture<'_>) -> bool {
        let &Bounds { low, high } = bounds;
        let (left, right) = (self.left.wrapping_add(SLACK), self.right.wrapping_sub(SLACK));
        let (top, bottom) = (self.top.wrapping_add(SLACK), self.bottom.wrapping_sub(SLACK));
        let inside = low.u >= left && high.u < right && low.v >= top && high.v < bottom;
        inside && (!self.masked() || texture.mask.fills(&bounds.wider(PlayUv { u: SLACK, v: SLACK })))
    }

    /// Passes those of the rectangle's edges on that what lies within `bounds` may cross, each with what is said of its coordinate: u or v.
    #[inline(always)]
    pub fn crossed<T: Copy>(&self, [u, v]: [T; 2], &Bounds { low, high }: &Bounds, mut pass: impl FnMut(T, Edge)) {
        // One after the other: a list of them would be written to memory.
        if low.u < self.left.wrapping_add(SLACK) {
            pass(u, Edge { at: self.left, ends: [low.u, high.u], upper: false });
        }
        if high.u >= self.right.wrapping_sub(SLACK) {
            pass(u, Edge { at: self.right, ends: [low.u, high.u], upper: true });
        }
        if low.v < self.top.wrapping_add(SLACK) {
            pass(v, Edge { at: self.top, ends: [low.v, high.v], upper: false });
        }
        if high.v >= self.bottom.wrapping_sub(SLACK) {
            pass(v, Edge { at: self.bottom, ends: [low.v, high.v], upper: true });
        }
    }
}

/// An edge of a chart's rectangle beside a block.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// The coordinate that is the same all along it, Q16 texels.
    pub at: i32,
    /// Between which the block has that.
    pub ends: [i32; 2],
    /// The chart is on the near side; else on the far one.
    pub upper: bool,
}

impl Edge {
    /// How far the block's pixels are from it, at most, either way.
    #[inline(always)]
    pub fn reach(&self) -> u32 {
        let [low, high] = self.ends.map(|end| end.abs_diff(self.at));
        low.max(high)
    }
}

/// Rounding moves positions by less than this, Q16 texels: by half a unit for each of a cell's pixels at most, and half of that for curves.
const SLACK: i32 = 1024;
