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

/// What pixels are made from.
#[derive(Clone, Copy, Debug)]
pub struct Paint<'a> {
    /// The source image.
    pub texture: Texture<'a>,
    /// RGB565 in the byte order wanted.
    pub palette: &'a [u16; 256],
}

impl Paint<'_> {
    fn colour(&self, uv: PlayUv) -> u16 {
        self.palette.get(usize::from(self.texture.texel(uv))).copied().unwrap_or(0)
    }

    /// Paints every pixel of `out`.
    pub fn all(&self, out: &mut [u16], span: Span) {
        let mut uv = span.from;
        for pixel in out {
            *pixel = self.colour(uv);
            uv = uv.plus(span.step);
        }
    }

    /// Paints the pixels of `out` at which `chart` covers the span.
    pub fn covered(&self, out: &mut [u16], span: Span, chart: &Chart) {
        let mut uv = span.from;
        for pixel in out {
            if chart.covers(uv, &self.texture) {
                *pixel = self.colour(uv);
            }
            uv = uv.plus(span.step);
        }
    }
}
