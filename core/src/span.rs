//! Spans: the inner loops. Pixels of a row are made from positions that step along it: tile by tile, or those of a tile that show. What is where comes
//! from `plan`; pixels go to the caller's row.

use crate::atlas::Texture;
use crate::bounds::Bounds;
use crate::coverage::Chart;
use crate::fixed::PlayUv;
use crate::form::Form;
use crate::window::{Line, Tile, fraction};

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

/// A row of tiles to paint.
#[derive(Clone, Copy, Debug)]
pub struct Tiles<'t> {
    /// From left to right.
    pub tiles: &'t [Tile],
    /// Which row of their pixels.
    pub row: u32,
    /// They are 2^this pixels wide.
    pub log2: u32,
    /// Where the backdrop is, if it is of one colour.
    pub backdrop: PlayUv,
}

impl Tiles<'_> {
    /// Paints `out`, tiles of `PIXELS` pixels each. `window` gives the texels of that from some row on, in which `along` paints a line of pixels; `pair`
    /// tells an even and an odd one at some place in the picture, where it is told that they are needed. `by_fours`: `along` is so short that it is
    /// written out for four tiles at a time.
    #[inline(always)]
    pub fn paint<T: Copy, W: Copy, const PIXELS: usize>(
        &self,
        out: &mut [T],
        by_fours: bool,
        window: impl Fn(u16) -> Option<W>,
        along: impl Fn(W, &mut [T; PIXELS], Line<'_>),
        pair: impl Fn(PlayUv, bool) -> [T; 2],
    ) {
        let blocks = out.as_chunks_mut::<PIXELS>().0;
        // The last tile may reach past the end.
        let most = blocks.len().min(self.tiles.len());
        let (Some(mut tiles), Some(mut blocks)) = (self.tiles.get(..most), blocks.get_mut(..most)) else { return };
        while let Some(first) = tiles.first() {
            let run = first.head.run().min(tiles.len());
            let split = tiles.split_at_checked(run).zip(core::mem::take(&mut blocks).split_at_mut_checked(run));
            let Some(((here, others), (painted, unpainted))) = split else { return };
            (tiles, blocks) = (others, unpainted);
            let Some(window) = window(first.head.row()) else {
                let [even, odd] = pair(self.backdrop, first.is_plain());
                for pixels in painted.iter_mut().filter(|_| first.is_plain()) {
                    *pixels = core::array::from_fn(|x| if x & 1 == 0 { even } else { odd });
                }
                continue;
            };
            let one = |tile: &Tile, pixels: &mut [T; PIXELS]| along(window, pixels, tile.row(self.row, PIXELS.trailing_zeros()));
            // A small processor has no register left to count with: it does so once for four.
            let ((fours, here), (four_blocks, painted)) = match by_fours && here.len() >= 4 {
                true => (here.as_chunks::<4>(), painted.as_chunks_mut::<4>()),
                false => ((&[][..], here), (&mut [][..], painted)),
            };
            for ([a, b, c, d], [e, f, g, h]) in fours.iter().zip(four_blocks) {
                one(a, e);
                one(b, f);
                one(c, g);
                one(d, h);
            }
            for (tile, pixels) in here.iter().zip(painted) {
                one(tile, pixels);
            }
        }
    }
}

/// Paints `pixels` along a line; `make` turns a position into one.
#[inline(always)]
pub fn along<T, const WIDTH: u32, const ROWS: u32>(
    pixels: &mut [T],
    Line { mut at, mut step, bend }: Line<'_>,
    make: impl Fn(Packed<WIDTH, ROWS>) -> T,
) {
    let (left, right) = pixels.split_at_mut(pixels.len() >> 1);
    for half in [left, right] {
        for pixel in half {
            *pixel = make(Packed(at));
            at = at.wrapping_add(step);
        }
        step = step.wrapping_add(*bend);
    }
}

/// Likewise, an even number of them, positions moved by one of the offsets in turn.
#[inline(always)]
pub fn by_turns<T, const WIDTH: u32, const ROWS: u32>(
    pixels: &mut [T],
    Line { at, step, bend }: Line<'_>,
    [even, odd]: [u32; 2],
    make: impl Fn(Packed<WIDTH, ROWS>) -> T,
) {
    // From each to the next of its turn it is two steps, which takes no addition more than from pixel to pixel: an offset for each pixel would.
    let apart = odd.wrapping_sub(even);
    let (mut at, mut step) = (at.wrapping_add(even), step);
    let (left, right) = pixels.split_at_mut(pixels.len() >> 1);
    for half in [left, right] {
        let there = step.wrapping_add(apart);
        for [first, second] in half.as_chunks_mut::<2>().0 {
            *first = make(Packed(at));
            *second = make(Packed(at.wrapping_add(there)));
            at = at.wrapping_add(step.wrapping_mul(2));
        }
        step = step.wrapping_add(*bend);
    }
}

/// Paints those of `pixels`, row `row` of `tile` of 2^`log2` pixels, that `shown` names, a bit each, moved by one of the offsets in turn.
#[inline(always)]
pub fn part<T, const WIDTH: u32, const ROWS: u32>(
    tile: &Tile,
    [row, log2]: [u32; 2],
    mut shown: u32,
    pixels: &mut [T],
    [even, odd]: [u32; 2],
    make: impl Fn(Packed<WIDTH, ROWS>) -> T,
) {
    let Line { mut at, mut step, bend } = tile.row(row, log2);
    for (x, pixel) in pixels.iter_mut().enumerate() {
        if shown & 1 != 0 {
            *pixel = make(Packed(at.wrapping_add(if x & 1 == 0 { even } else { odd })));
        }
        (shown, at) = (shown >> 1, at.wrapping_add(step));
        if x.wrapping_add(1) == 1 << log2 >> 1 {
            step = step.wrapping_add(*bend);
        }
    }
}

/// A sheet along a row of a block: the position at its first pixel, the step to the next, and how steps change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// At the first pixel.
    pub from: PlayUv,
    /// From there to the next.
    pub step: PlayUv,
    /// From step to step.
    pub bend: PlayUv,
}

impl Span {
    /// The first row of `forms`, of u and v.
    #[must_use]
    #[inline(always)]
    pub const fn new(&[u, v]: &[Form; 2]) -> Self {
        Self { from: PlayUv { u: u.at, v: v.at }, step: PlayUv { u: u.step, v: v.step }, bend: PlayUv { u: u.bend, v: v.bend } }
    }

    /// One pixel on.
    #[inline(always)]
    const fn next(&mut self) {
        (self.from, self.step) = (self.from.plus(self.step), self.step.plus(self.bend));
    }

    /// What lies around its first `pixels` pixels.
    #[must_use]
    #[inline(always)]
    pub fn bounds(&self, pixels: u32) -> Bounds {
        let steps = pixels.wrapping_sub(1);
        let (steps, curves) = (steps as i32, (steps.wrapping_mul(steps.wrapping_sub(1)) >> 1) as i32);
        let on = |from: i32, step: i32, bend: i32| from.wrapping_add(step.wrapping_mul(steps)).wrapping_add(bend.wrapping_mul(curves));
        let Self { from, step, bend } = *self;
        let last = PlayUv { u: on(from.u, step.u, bend.u), v: on(from.v, step.v, bend.v) };
        // An eighth of what steps change, times their number, is how far a curve bulges.
        let bulge = |bend: i32| (bend.unsigned_abs().wrapping_mul(steps.wrapping_mul(steps) as u32) >> 3) as i32;
        Bounds::of(from, last).wider(PlayUv { u: bulge(bend.u), v: bulge(bend.v) })
    }
}

/// A sheet along a row of a block as it is drawn: straight to the middle, and straight on from there.
#[derive(Clone, Copy, Debug)]
pub struct Straight {
    /// At the first pixel.
    from: PlayUv,
    /// From pixel to pixel in the left half,
    step: PlayUv,
    /// and how much more in the right one.
    bend: PlayUv,
    /// Pixels of the left half.
    half: u32,
}

impl Straight {
    /// The first row of `forms`, of u and v, which is row `row` of the 2^`log2` of its block.
    #[must_use]
    #[inline(always)]
    pub fn new(forms: &[Form; 2], row: u32, log2: u32) -> Self {
        let Span { from, step, bend } = Span::new(&forms.map(|form| form.straightened(row, log2)));
        Self { from, step, bend, half: 1u32.wrapping_shl(log2) >> 1 }
    }

    /// At pixel `x`.
    #[inline(always)]
    fn at(&self, x: u32) -> PlayUv {
        let (steps, bends) = (x as i32, x.saturating_sub(self.half) as i32);
        let on = |from: i32, step: i32, bend: i32| from.wrapping_add(step.wrapping_mul(steps)).wrapping_add(bend.wrapping_mul(bends));
        let Self { from, step, bend, .. } = self;
        PlayUv { u: on(from.u, step.u, bend.u), v: on(from.v, step.v, bend.v) }
    }

    /// What lies around its pixels from `first` to `last`.
    #[must_use]
    #[inline(always)]
    pub fn bounds(&self, first: u32, last: u32) -> Bounds {
        let ends = Bounds::of(self.at(first), self.at(last));
        let middle = self.at(self.half.max(first).min(last));
        ends.join(Bounds::of(middle, middle))
    }
}

/// Paints the pixels of `out` that `shown` names, a bit each; `make` turns a position into a pixel, given its place in `out`. Positions outside the
/// picture count as its edge.
#[inline(always)]
pub fn paint<T>(out: &mut [T], mut shown: u32, line: Straight, texture: &Texture<'_>, make: impl Fn(PlayUv, usize) -> T) {
    let Bounds { low, high } = line.bounds(0, (out.len() as u32).wrapping_sub(1));
    let inside = texture.holds(low) && texture.holds(high);
    let Straight { mut from, mut step, bend, half } = line;
    let (left, right) = out.split_at_mut((half as usize).min(out.len()));
    let mut x = 0usize;
    for pixels in [left, right] {
        for pixel in pixels {
            if shown & 1 != 0 {
                *pixel = make(if inside { from } else { texture.clamp(from) }, x);
            }
            (shown, x, from) = (shown >> 1, x.wrapping_add(1), from.plus(step));
        }
        step = step.plus(bend);
    }
}

/// Those of the pixels that `shown` names whose texels the mask has.
#[inline(always)]
#[must_use]
pub fn covered(shown: u32, mut span: Span, texture: &Texture<'_>) -> u32 {
    let (mut rest, mut bit, mut covered) = (shown, 1u32, 0u32);
    while rest != 0 {
        if rest & 1 != 0 && texture.mask.covers(span.from) {
            covered |= bit;
        }
        (rest, bit) = (rest >> 1, bit.wrapping_shl(1));
        span.next();
    }
    covered
}

/// Those of the pixels that `shown` names, of the first row of `forms`, `pixels` wide, at which it lies inside `chart`.
#[inline(always)]
#[must_use]
pub fn inside(chart: &Chart, mut shown: u32, pixels: u32, forms: &[Form; 2], texture: &Texture<'_>) -> u32 {
    let span = Span::new(forms);
    let bounds = span.bounds(pixels);
    if chart.misses(&bounds) {
        return 0;
    }
    if chart.fills(&bounds, texture) {
        return shown;
    }
    let [u, v] = forms;
    chart.crossed([u, v], &bounds, |form, edge| {
        let near = Form { at: form.at.wrapping_sub(edge.at), ..*form }.negative(pixels);
        shown &= if edge.upper { near } else { !near };
    });
    if chart.masked() { covered(shown, span, texture) } else { shown }
}

#[cfg(test)]
mod tests {
    use super::inside;
    use crate::atlas::Texture;
    use crate::coverage::Chart;
    use crate::fixed::PlayUv;
    use crate::format::LabelRecord;
    use crate::patch::{Axis, Patch};

    #[test]
    fn pixels_inside_a_chart_are_those_whose_positions_are() {
        let mut seed = 9u32;
        let mut next = |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(seed) * u64::from(below)) >> 32) as i32
        };
        let texture = Texture { width_log2: 9, height: 512, ..Texture::default() };
        let chart = Chart::new(&LabelRecord { left: 20, top: 30, right: 24, bottom: 33, ..LabelRecord::default() });
        let (mut some, mut none) = (0, 0);
        for round in 0..20_000u32 {
            let reach = if round % 2 == 0 { 1 << 17 } else { 1 << 20 };
            let mut around = |u: i32, v: i32| PlayUv { u: (u << 16) + next(reach) - next(reach), v: (v << 16) + next(reach) - next(reach) };
            let ([a, b, c, d], across, down) = ([(); 4].map(|()| around(20, 31)), around(0, 0), around(0, 0));
            let u = Axis::new([a.u, b.u, c.u, d.u], [across.u, down.u]);
            let patch = Patch { u, v: Axis::new([a.v, b.v, c.v, d.v], [across.v, down.v]) };
            for log2 in [2, 3] {
                let pixels = 1u32 << log2;
                let mut forms = patch.forms(log2);
                for row in 0..pixels {
                    let told = inside(&chart, u32::MAX >> (32 - pixels), pixels, &forms, &texture);
                    let exact = (0..pixels).fold(0, |bits, x| {
                        let [u, v] = patch.forms(log2).map(|form| form.at([x, row]));
                        bits | u32::from(chart.covers(PlayUv { u, v }, &texture)) << x
                    });
                    assert_eq!(told, exact, "{patch:?}, row {row}");
                    (some, none) = (some + u32::from(exact != 0), none + u32::from(exact == 0));
                    forms.iter_mut().for_each(crate::form::Form::next_row);
                }
            }
        }
        assert!(some > 10_000 && none > 10_000, "{some} {none}");
    }
}
