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

    /// The label's outline is told by two fields.
    #[must_use]
    #[inline]
    pub const fn strip(&self) -> bool {
        self.flags & STRIP as u32 != 0
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
        inside && (!self.masked() || texture.covered(uv))
    }

    /// How much the chart covers of a block whose left and right edges end at these positions, with some room for rounding.
    // Without what lies around them: one position mostly tells that not all are beyond an edge.
    #[must_use]
    #[inline(always)]
    pub fn cover(&self, [[a, b], [c, d]]: [[PlayUv; 2]; 2], texture: &Texture<'_>) -> Cover {
        let (left, right) = (self.left.wrapping_sub(SLACK), self.right.wrapping_add(SLACK));
        let (top, bottom) = (self.top.wrapping_sub(SLACK), self.bottom.wrapping_add(SLACK));
        if a.u < left && b.u < left && c.u < left && d.u < left
            || a.u >= right && b.u >= right && c.u >= right && d.u >= right
            || a.v < top && b.v < top && c.v < top && d.v < top
            || a.v >= bottom && b.v >= bottom && c.v >= bottom && d.v >= bottom
        {
            return Cover::Nothing;
        }
        const TWICE: i32 = 2 * SLACK;
        let (left, right) = (left.wrapping_add(TWICE), right.wrapping_sub(TWICE));
        let (top, bottom) = (top.wrapping_add(TWICE), bottom.wrapping_sub(TWICE));
        let inside = |uv: PlayUv| uv.u >= left && uv.u < right && uv.v >= top && uv.v < bottom;
        let all = inside(a) && inside(b) && inside(c) && inside(d);
        if all && (!self.masked() || filled(texture, &Bounds::around(&[a, b, c, d]).wider(SLACK))) { Cover::All } else { Cover::Part }
    }

    /// Passes those of the rectangle's edges on that what lies between the corners of a block, within `bounds`, may cross.
    #[inline(always)]
    pub fn crossed(&self, corners: &[PlayUv; 4], &Bounds { low, high }: &Bounds, mut pass: impl FnMut(Edge)) {
        let (across, down) = (corners.map(|uv| uv.u), corners.map(|uv| uv.v));
        // One after the other: a list of them would be written to memory.
        if low.u < self.left.wrapping_add(SLACK) {
            pass(Edge::new(across, self.left, false));
        }
        if high.u >= self.right.wrapping_sub(SLACK) {
            pass(Edge::new(across, self.right, true));
        }
        if low.v < self.top.wrapping_add(SLACK) {
            pass(Edge::new(down, self.top, false));
        }
        if high.v >= self.bottom.wrapping_sub(SLACK) {
            pass(Edge::new(down, self.bottom, true));
        }
    }
}

/// Whether all texels within `bounds`, which lie inside the picture, are known to belong to a chart: not of more than 25 in a row.
#[inline(never)]
fn filled(texture: &Texture<'_>, &Bounds { low, high }: &Bounds) -> bool {
    let (left, right) = ((low.u >> PLAY_BITS) as u32, (high.u >> PLAY_BITS) as u32);
    let all = match right.wrapping_sub(left) {
        more @ ..25 => u32::MAX >> 31u32.wrapping_sub(more),
        _ => return false,
    };
    let mut rows = low.v >> PLAY_BITS..=high.v >> PLAY_BITS;
    rows.all(|row| {
        let index = (row as u32).wrapping_shl(texture.width_log2) | left;
        let bits = texture.mask.get((index >> 3) as usize..).and_then(<[u8]>::first_chunk).copied();
        bits.is_some_and(|bytes| !u32::from_le_bytes(bytes) >> (index & 7) & all == 0)
    })
}

/// An upright rectangle of the source image.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Its left upper corner,
    pub low: PlayUv,
    /// and the right lower one, inclusive.
    pub high: PlayUv,
}

impl Bounds {
    /// Around nothing.
    pub const NOTHING: Self = Self { low: PlayUv { u: i32::MAX, v: i32::MAX }, high: PlayUv { u: i32::MIN, v: i32::MIN } };

    /// Around two positions.
    #[must_use]
    #[inline(always)]
    pub fn of(a: PlayUv, b: PlayUv) -> Self {
        Self { low: PlayUv { u: a.u.min(b.u), v: a.v.min(b.v) }, high: PlayUv { u: a.u.max(b.u), v: a.v.max(b.v) } }
    }

    /// Around both.
    #[must_use]
    #[inline(always)]
    pub fn join(self, other: Self) -> Self {
        Self { low: Self::of(self.low, other.low).low, high: Self::of(self.high, other.high).high }
    }

    /// By so much more, every way.
    #[must_use]
    #[inline(always)]
    const fn wider(self, by: i32) -> Self {
        let Self { low, high } = self;
        let by = PlayUv { u: by, v: by };
        Self { low: low.less(by), high: high.plus(by) }
    }

    /// Around a block's corners.
    #[must_use]
    #[inline(always)]
    pub fn around(&[a, b, c, d]: &[PlayUv; 4]) -> Self {
        Self::of(a, b).join(Self::of(c, d))
    }
}

/// An edge of a chart's rectangle beside a block.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// How far beyond it the block's corners are, above left and right, below left and right, Q16 texels.
    pub beyond: [i32; 4],
    /// The chart is on the near side; else on the far one.
    pub upper: bool,
}

impl Edge {
    /// The edge at `at` beside such `corners`.
    #[inline(always)]
    fn new(corners: [i32; 4], at: i32, upper: bool) -> Self {
        Self { beyond: corners.map(|corner| corner.wrapping_sub(at)), upper }
    }
}

/// Rounding moves positions by less than this, Q16 texels.
const SLACK: i32 = 64;
