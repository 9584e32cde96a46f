//! Spans: the inner loops. Pixels of a row are made from positions that step along it: in runs of blocks that show one sheet each, or
//! block by block where several sheets take turns. What is where comes from `plan`; pixels go to the caller's row.

use crate::atlas::Texture;
use crate::coverage::{Chart, Cover};
use crate::fixed::PlayUv;
use crate::sheet::Corners;
use crate::window::{TILE_LOG2, Tile, fraction};

/// A position in a window: v in its lower bits, [`fraction`] of them its fraction and ROWS above, then u, its upper WIDTH bits the texel.
#[derive(Clone, Copy, Debug)]
pub struct Packed<const WIDTH: u32, const ROWS: u32>(pub u32);

impl<const WIDTH: u32, const ROWS: u32> Packed<WIDTH, ROWS> {
    const FRACTION: u32 = fraction(WIDTH);
    const BITS: u32 = Self::FRACTION.wrapping_add(ROWS);
    const LOW: u32 = (1 << Self::BITS) - 1;
    /// How far the texel's column is shifted down.
    const ACROSS: u32 = 32 - WIDTH;
    /// How far its row stands above where its place in the window has it: most stand there.
    const ABOVE: u32 = Self::FRACTION.wrapping_sub(WIDTH);
    /// The texel's row, there.
    const DOWN: u32 = ((1 << ROWS) - 1) << WIDTH;

    /// The texel's place in its window, below 2^(WIDTH + ROWS).
    #[must_use]
    #[inline(always)]
    pub const fn texel(self) -> usize {
        (self.0 >> Self::ACROSS | self.0 >> Self::ABOVE & Self::DOWN) as usize
    }

    /// The position in the picture, for a window from `row` on.
    #[must_use]
    pub fn at(self, row: u16) -> PlayUv {
        let u = (self.0 >> Self::BITS).wrapping_shl(Self::BITS.wrapping_add(WIDTH).wrapping_sub(16));
        let v = (self.0 & Self::LOW).wrapping_shl(16u32.wrapping_sub(Self::FRACTION)).wrapping_add(u32::from(row).wrapping_shl(16));
        PlayUv { u: u as i32, v: v as i32 }
    }
}

/// Paints `out`, row `row` of a run's `tiles` of `PIXELS` pixels each. `make` turns a position into a pixel, once it is moved by one of `offsets`
/// where the pixel is an even or an odd one of its row.
#[inline(always)]
pub fn run<T, const WIDTH: u32, const ROWS: u32, const PIXELS: usize>(
    tiles: &[Tile],
    row: u32,
    out: &mut [T],
    offsets: [u32; 2],
    make: impl Fn(Packed<WIDTH, ROWS>) -> T,
) {
    for (tile, pixels) in tiles.iter().zip(out.as_chunks_mut::<PIXELS>().0) {
        alternate(pixels, tile.row(row), offsets, &make);
    }
}

/// Like [`run`], with tiles of any 2^`log2` pixels.
#[inline(always)]
pub fn any_run<T, const WIDTH: u32, const ROWS: u32>(
    tiles: &[Tile],
    row: u32,
    out: &mut [T],
    log2: u32,
    offsets: [u32; 2],
    make: impl Fn(Packed<WIDTH, ROWS>) -> T,
) {
    let mut out = out;
    for tile in tiles {
        let Some((pixels, rest)) = out.split_at_mut_checked(1 << log2.min(TILE_LOG2)) else { return };
        out = rest;
        alternate(pixels, tile.row(row), offsets, &make);
    }
}

/// Paints `pixels` from `at` on, `step` further each, moved by one of the offsets in turn.
#[inline(always)]
fn alternate<T, const WIDTH: u32, const ROWS: u32>(
    pixels: &mut [T],
    [at, step]: [u32; 2],
    [even, odd]: [u32; 2],
    make: impl Fn(Packed<WIDTH, ROWS>) -> T,
) {
    let turn = odd.wrapping_sub(even);
    let (there, back) = (step.wrapping_add(turn), step.wrapping_sub(turn));
    let mut at = at.wrapping_add(even);
    for (x, pixel) in pixels.iter_mut().enumerate() {
        *pixel = make(Packed(at));
        at = at.wrapping_add(if x & 1 == 0 { there } else { back });
    }
}

/// Paints those of `pixels`, row `row` of `tile`, that `shown` names, a bit each, like [`run`].
#[inline(always)]
pub fn part<T, const WIDTH: u32, const ROWS: u32>(
    tile: &Tile,
    row: u32,
    mut shown: u32,
    pixels: &mut [T],
    [even, odd]: [u32; 2],
    make: impl Fn(Packed<WIDTH, ROWS>) -> T,
) {
    let [mut at, step] = tile.row(row);
    for (x, pixel) in pixels.iter_mut().enumerate() {
        if shown & 1 != 0 {
            *pixel = make(Packed(at.wrapping_add(if x & 1 == 0 { even } else { odd })));
        }
        (shown, at) = (shown >> 1, at.wrapping_add(step));
    }
}

/// A sheet along a row of a block: the position at its first pixel, and the step to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// At the first pixel.
    pub from: PlayUv,
    /// From pixel to pixel.
    pub step: PlayUv,
}

/// The value `step` / 2^`log2` of the way from `from` to `to`, rounded down.
#[inline(always)]
const fn down(from: i32, to: i32, step: u32, log2: u32) -> i32 {
    let far = to.wrapping_sub(from);
    let rows = step as i32;
    // Positions differ by less than 2^28.6.
    if log2 <= 2 {
        return from.wrapping_add(far.wrapping_mul(rows) >> log2);
    }
    // In two parts, because the product does not fit.
    let rest = far & 1i32.wrapping_shl(log2).wrapping_sub(1);
    from.wrapping_add((far >> log2).wrapping_mul(rows)).wrapping_add(rest.wrapping_mul(rows) >> log2)
}

/// One of a position's coordinates along row `row` of a block of 2^`log2` pixels, given those at its corners: at the first pixel, and from pixel to pixel.
#[inline(always)]
const fn along([a, b, c, d]: [i32; 4], row: u32, log2: u32) -> (i32, i32) {
    let (from, to) = (down(a, c, row, log2), down(b, d, row, log2));
    (from, to.wrapping_sub(from).wrapping_add((1i32 << log2) >> 1) >> log2)
}

impl Span {
    /// The span of row `row` of a block of 2^`log2` pixels, whose corners are given; steps rounded to nearest, so that the last pixel is at
    /// most 2^(log2 - 1) / 65536 texel off.
    #[must_use]
    #[inline]
    pub const fn new([a, b, c, d]: Corners, row: u32, log2: u32) -> Self {
        let (u, step_u) = along([a.u, b.u, c.u, d.u], row, log2);
        let (v, step_v) = along([a.v, b.v, c.v, d.v], row, log2);
        Self { from: PlayUv { u, v }, step: PlayUv { u: step_u, v: step_v } }
    }

    /// Like [`Span::new`], `across` and `down` quarters of a pixel beside the pixels' centres.
    #[must_use]
    pub const fn beside(corners: Corners, row: u32, log2: u32, [across, down]: [i32; 2]) -> Self {
        // In quarters of pixels there are four times as many.
        let Self { from, step } = Self::new(corners, row.wrapping_mul(4).wrapping_add_signed(down), log2.wrapping_add(2));
        Self {
            from: PlayUv { u: from.u.wrapping_add(step.u.wrapping_mul(across)), v: from.v.wrapping_add(step.v.wrapping_mul(across)) },
            step: PlayUv { u: step.u.wrapping_mul(4), v: step.v.wrapping_mul(4) },
        }
    }

    /// The position `pixels` pixels on.
    #[must_use]
    pub const fn at(&self, pixels: usize) -> PlayUv {
        let count = pixels as i32;
        PlayUv {
            u: self.from.u.wrapping_add(self.step.u.wrapping_mul(count)),
            v: self.from.v.wrapping_add(self.step.v.wrapping_mul(count)),
        }
    }
}

/// Paints the pixels of `out` that `shown` names, a bit each; `make` turns a position into a pixel, given its place in `out`. Positions outside the
/// picture count as its edge.
#[inline(always)]
pub fn paint<T>(out: &mut [T], mut shown: u32, span: Span, texture: &Texture<'_>, make: impl Fn(PlayUv, usize) -> T) {
    let mut uv = span.from;
    // A span is straight: if both its ends are inside, all of it is.
    let inside = texture.holds(uv) && texture.holds(span.at(out.len().wrapping_sub(1)));
    for (x, pixel) in out.iter_mut().enumerate() {
        if shown & 1 != 0 {
            *pixel = make(if inside { uv } else { texture.clamp(uv) }, x);
        }
        shown >>= 1;
        uv = uv.plus(span.step);
    }
}

/// A field along a row of a block, Q16 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    from: i32,
    step: i32,
}

impl Field {
    /// The field of row `row` of a cell of 2^`log2` pixels from pixel `first` on, given what it is at the cell's corners, Q16 pixels.
    #[must_use]
    #[inline(always)]
    pub fn new([a, b, c, d]: [i32; 4], row: u32, log2: u32, first: u32) -> Self {
        let half = (1i32 << log2) >> 1;
        // Fields differ by less than 2^24; there are at most 2^5 rows, or quarters of 2^7: the product fits.
        let down = |from: i32, to: i32| from.wrapping_add(to.wrapping_sub(from).wrapping_mul(row as i32) >> log2);
        let (from, to) = (down(a, c), down(b, d));
        let step = to.wrapping_sub(from).wrapping_add(half) >> log2;
        Self { from: from.wrapping_add(step.wrapping_mul(first as i32)), step }
    }

    /// Like [`Field::new`], `across` and `down` quarters of a pixel beside the pixels' centres.
    #[must_use]
    pub fn beside(corners: [i32; 4], row: u32, log2: u32, first: u32, [across, down]: [i32; 2]) -> Self {
        let first = first.wrapping_mul(4).wrapping_add_signed(across);
        let Self { from, step } = Self::new(corners, row.wrapping_mul(4).wrapping_add_signed(down), log2.wrapping_add(2), first);
        Self { from, step: step.wrapping_mul(4) }
    }

    /// At which of the next `pixels` pixels the field is positive: a bit each.
    #[must_use]
    #[inline(always)]
    pub fn positive(&self, pixels: usize) -> u32 {
        // What is below zero where the field is above.
        negative(self.from.wrapping_neg(), self.step.wrapping_neg(), pixels)
    }
}

/// Which of the next `pixels` pixels have a value below zero, from `value` on, `step` more each: a bit each.
#[inline(always)]
fn negative(mut value: i32, step: i32, pixels: usize) -> u32 {
    // A line: where both ends are of one sign, all of it is. Of four pixels, telling takes as long as they do.
    let last = value.wrapping_add(step.wrapping_mul(pixels.wrapping_sub(1) as i32));
    if pixels > 4 && value ^ last >= 0 {
        return if value < 0 { u32::MAX.wrapping_shr(32u32.wrapping_sub(pixels as u32)) } else { 0 };
    }
    let mut below = 0u32;
    for first in (0..pixels as u32).step_by(4) {
        let mut four = 0u32;
        for pixel in 0..4 {
            four |= (value as u32 >> 31).wrapping_shl(pixel);
            value = value.wrapping_add(step);
        }
        below |= four.wrapping_shl(first);
    }
    below
}

/// Which pixels of row `row` of a block of 2^`log2`, four at least, lie on the near side of an edge that its corners are so far `beyond`: a bit each, at
/// positions as [`Span::new`] has them.
#[inline(always)]
#[must_use]
pub fn near(beyond: [i32; 4], row: u32, log2: u32) -> u32 {
    let (from, step) = along(beyond, row, log2);
    negative(from, step, 1 << log2)
}

/// Those of the pixels that `shown` names whose texels the mask has.
#[inline(always)]
#[must_use]
pub fn covered(shown: u32, span: Span, texture: &Texture<'_>) -> u32 {
    let (mut uv, mut rest, mut bit, mut covered) = (span.from, shown, 1u32, 0u32);
    while rest != 0 {
        if rest & 1 != 0 && texture.covered(uv) {
            covered |= bit;
        }
        (rest, bit, uv) = (rest >> 1, bit.wrapping_shl(1), uv.plus(span.step));
    }
    covered
}

/// Those of the pixels that `shown` names, of a span of `pixels`, at which the span lies inside `chart`.
#[inline(always)]
#[must_use]
pub fn inside(chart: &Chart, shown: u32, pixels: usize, span: Span, texture: &Texture<'_>) -> u32 {
    match chart.cover([[span.from, span.at(pixels.wrapping_sub(1))]; 2], texture) {
        Cover::Nothing => return 0,
        Cover::All => return shown,
        Cover::Part => {}
    }
    let Span { from: PlayUv { u, v }, step } = span;
    let across = before(u, chart.right, step.u, pixels) & !before(u, chart.left, step.u, pixels);
    let shown = shown & across & before(v, chart.bottom, step.v, pixels) & !before(v, chart.top, step.v, pixels);
    if chart.masked() { covered(shown, span, texture) } else { shown }
}

/// Which of the next `pixels` pixels have a value below `edge`, from `value` on, `step` more each: a bit each.
#[inline(never)]
fn before(value: i32, edge: i32, step: i32, pixels: usize) -> u32 {
    negative(value.wrapping_sub(edge), step, pixels)
}

#[cfg(test)]
mod tests {
    use super::{Span, inside, near};
    use crate::atlas::Texture;
    use crate::coverage::{Bounds, Chart};
    use crate::fixed::PlayUv;
    use crate::format::LabelRecord;

    #[test]
    fn edges_that_a_block_may_cross_tell_what_a_test_of_each_position_does() {
        let mut seed = 9u32;
        let mut next = |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(seed) * u64::from(below)) >> 32) as i32
        };
        let texture = Texture { texels: &[], mask: &[], width_log2: 9, height: 512 };
        let chart = Chart::new(&LabelRecord { left: 20, top: 30, right: 24, bottom: 33, ..LabelRecord::default() });
        let (mut some, mut none) = (0, 0);
        for round in 0..20_000u32 {
            let reach = if round % 2 == 0 { 1 << 17 } else { 1 << 20 };
            let corners = [(); 4].map(|()| PlayUv { u: (20 << 16) + next(reach) - next(reach), v: (31 << 16) + next(reach) - next(reach) });
            for log2 in [2, 3] {
                let pixels = 1usize << log2;
                for row in 0..pixels as u32 {
                    let all = u32::MAX >> (32 - pixels);
                    let mut told = all;
                    chart.crossed(&corners, &Bounds::around(&corners), |edge| {
                        let near = near(edge.beyond, row, log2);
                        told &= if edge.upper { near } else { !near };
                    });
                    let exact = inside(&chart, all, pixels, Span::new(corners, row, log2), &texture);
                    assert_eq!(told, exact, "{corners:?}, row {row}");
                    (some, none) = (some + u32::from(exact != 0), none + u32::from(exact == 0));
                }
            }
        }
        assert!(some > 10_000 && none > 10_000, "{some} {none}");
    }
}
