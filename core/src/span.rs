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

    /// The position `pixels` pixels on.
    const fn at(&self, pixels: usize) -> PlayUv {
        let count = pixels as i32;
        PlayUv {
            u: self.from.u.wrapping_add(self.step.u.wrapping_mul(count)),
            v: self.from.v.wrapping_add(self.step.v.wrapping_mul(count)),
        }
    }
}

impl PlayUv {
    const fn plus(self, step: Self) -> Self {
        Self { u: self.u.wrapping_add(step.u), v: self.v.wrapping_add(step.v) }
    }
}

/// Paints every pixel of `out`; `make` turns a position into a pixel. Positions outside the picture count as its edge.
#[inline(always)]
pub fn all<T>(out: &mut [T], span: Span, texture: &Texture<'_>, make: impl Fn(PlayUv) -> T) {
    let mut uv = span.from;
    // A span is straight: if both its ends are inside, all of it is.
    if texture.holds(uv) && texture.holds(span.at(out.len())) {
        for pixel in out {
            *pixel = make(uv);
            uv = uv.plus(span.step);
        }
    } else {
        for pixel in out {
            *pixel = make(texture.clamp(uv));
            uv = uv.plus(span.step);
        }
    }
}

/// A sheet's fields along a row of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fields {
    from: [i32; 2],
    step: [i32; 2],
}

impl Fields {
    /// The fields between a cell's left edge and its right edge, 2^`log2` pixels further, Q16 pixels.
    #[must_use]
    pub const fn between([a, b]: [i32; 2], [c, d]: [i32; 2], log2: u32) -> Self {
        let half = (1i32 << log2) >> 1;
        let step = [c.wrapping_sub(a).wrapping_add(half) >> log2, d.wrapping_sub(b).wrapping_add(half) >> log2];
        Self { from: [a, b], step }
    }

    /// The same fields from `pixels` pixels on.
    #[must_use]
    pub const fn after(self, pixels: i32) -> Self {
        let ([a, b], [da, db]) = (self.from, self.step);
        Self { from: [a.wrapping_add(da.wrapping_mul(pixels)), b.wrapping_add(db.wrapping_mul(pixels))], step: self.step }
    }
}

/// What decides whether a sheet shows at a pixel: its chart, its fields, or both.
#[derive(Clone, Copy, Debug)]
pub struct Test<'t> {
    /// The chart, where it is tested.
    pub chart: Option<Chart>,
    /// The fields, where they are tested.
    pub fields: Option<Fields>,
    /// The second field counts too.
    pub strip: bool,
    /// Where charts lie.
    pub texture: Texture<'t>,
}

/// Paints the pixels of `out` at which `test` lets the span show.
#[inline(always)]
pub fn covered<T>(out: &mut [T], span: Span, test: &Test<'_>, make: impl Fn(PlayUv) -> T) {
    let mut uv = span.from;
    let Fields { from: [mut a, mut b], step: [da, db] } = test.fields.unwrap_or(Fields { from: [1, 1], step: [0, 0] });
    for pixel in out {
        let inside = a > 0 && (!test.strip || b > 0);
        if inside && test.chart.is_none_or(|chart| chart.covers(uv, &test.texture)) {
            *pixel = make(test.texture.clamp(uv));
        }
        uv = uv.plus(span.step);
        (a, b) = (a.wrapping_add(da), b.wrapping_add(db));
    }
}
