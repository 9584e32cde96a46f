//! Spans: the inner loops. A span is one sheet along one row of pixels of a cell.
//! Its ends come from `cell`; pixels go to the caller's row.

use crate::atlas::Texture;
use crate::coverage::Chart;
use crate::fixed::PlayUv;

/// A sheet along a row of a cell: the position at its first pixel, and the step to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// At the first pixel.
    pub from: PlayUv,
    /// From pixel to pixel.
    pub step: PlayUv,
}

impl Span {
    /// The span between the cell's left edge and its right edge, 2^`log2` pixels further; steps rounded to
    /// nearest, so that the last pixel is at most 2^(log2 - 1) / 65536 texel off.
    #[must_use]
    pub const fn between(from: PlayUv, to: PlayUv, log2: u32) -> Self {
        let half = (1i32 << log2) >> 1;
        Self {
            from,
            step: PlayUv {
                u: to.u.wrapping_sub(from.u).wrapping_add(half) >> log2,
                v: to.v.wrapping_sub(from.v).wrapping_add(half) >> log2,
            },
        }
    }
}

impl PlayUv {
    const fn plus(self, step: Self) -> Self {
        Self { u: self.u.wrapping_add(step.u), v: self.v.wrapping_add(step.v) }
    }
}

/// Paints every pixel of `out`; `make` turns a position into a pixel.
#[inline(always)]
pub fn all<T>(out: &mut [T], span: Span, make: impl Fn(PlayUv) -> T) {
    let mut uv = span.from;
    for pixel in out {
        *pixel = make(uv);
        uv = uv.plus(span.step);
    }
}

/// Paints the pixels of `out` at which `chart` covers the span.
#[inline(always)]
pub fn covered<T>(out: &mut [T], span: Span, chart: &Chart, texture: &Texture<'_>, make: impl Fn(PlayUv) -> T) {
    let mut uv = span.from;
    for pixel in out {
        if chart.covers(uv, texture) {
            *pixel = make(uv);
        }
        uv = uv.plus(span.step);
    }
}
