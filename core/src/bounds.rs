//! Upright rectangles of the source image around positions.
//! Made of what blocks show, asked for by the mask, the chart test and windows.

use crate::fixed::PlayUv;

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

    /// By so much more to either side, and above and below.
    #[must_use]
    #[inline(always)]
    pub const fn wider(self, by: PlayUv) -> Self {
        let Self { low, high } = self;
        Self { low: low.less(by), high: high.plus(by) }
    }
}
