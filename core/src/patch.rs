//! Patches: one sheet of a cell, or of a part of one, at one moment. Its positions follow from those at its corners and from how these bend; along a row
//! of pixels, and down a column, they go by a first and a second difference. Layers come from `row`; `span`, `window` and `torn` ask for rows of
//! pixels, tiles and bounds.

use crate::coverage::Bounds;
use crate::fixed::PlayUv;
use crate::row::{Layer, Node};
use crate::sheet::{Rows, Sheet};

/// The positions at the corners of a patch: above left and right, below left and right.
pub type Corners = [PlayUv; 4];

/// A sheet of a cell, or of a part of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Patch {
    /// At its corners.
    pub corners: Corners,
    /// Sums of second differences at the corners, from corner to corner: across
    pub across: PlayUv,
    /// and down.
    pub down: PlayUv,
}

impl Patch {
    /// `sheet` in its cell between these rows of nodes.
    #[must_use]
    #[inline(always)]
    pub fn new([top, bottom]: Rows<'_, '_>, sheet: &Sheet) -> Self {
        let [above, below] = sheet.nodes();
        let ([a, b], [c, d]) = (top.ends(above), bottom.ends(below));
        let sum = |of: fn(&Node) -> Layer| of(a).uv().plus(of(b).uv()).plus(of(c).uv().plus(of(d).uv()));
        Self { corners: [a, b, c, d].map(|node| node.layer.uv()), across: sum(|node| node.across), down: sum(|node| node.down) }
    }

    /// How far it goes beyond what lies around its corners, at most, Q16 texels: each way by an eighth of the mean second difference.
    #[must_use]
    #[inline(always)]
    pub fn bulge(&self) -> PlayUv {
        let of = |across: i32, down: i32| (across.saturating_abs() >> 5).wrapping_add(down.saturating_abs() >> 5).wrapping_add(1);
        PlayUv { u: of(self.across.u, self.down.u), v: of(self.across.v, self.down.v) }
    }

    /// What lies around it.
    #[must_use]
    #[inline(always)]
    pub fn bounds(&self) -> Bounds {
        Bounds::around(&self.corners).wider(self.bulge())
    }

    /// How u and v go from pixel to pixel, where it is 2^`log2` pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub fn forms(&self, log2: u32) -> [Form; 2] {
        self.axes().map(|(corners, sums)| Form::new(corners, sums, log2))
    }

    /// For u and for v, the number at its corners, and the sums of second differences, across and down.
    #[must_use]
    #[inline(always)]
    pub fn axes(&self) -> [([i32; 4], [i32; 2]); 2] {
        let &Self { corners, across, down } = self;
        [(corners.map(|corner| corner.u), [across.u, down.u]), (corners.map(|corner| corner.v), [across.v, down.v])]
    }

    /// Of its parts of 2^`part` pixels that whose first pixel is `from` pixels to the right and down; it is 2^`log2` pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub fn part(&self, [x, y]: [u32; 2], part: u32, log2: u32) -> Self {
        let mut patch = *self;
        for bit in (part..log2).rev() {
            patch = patch.quarter([x, y].map(|pixels| pixels.wrapping_shr(bit) & 1 == 1));
        }
        patch
    }

    /// Its quarter to the left or to the right, above or below.
    #[inline(never)]
    fn quarter(&self, [right, low]: [bool; 2]) -> Self {
        let [(u, sums_u), (v, sums_v)] = self.axes();
        // How far the middles of edges are off the means of their ends, both ways.
        let halves = |[a, b, c, d]: [i32; 4], [across, down]: [i32; 2]| {
            let middle = |x: i32, y: i32, sum: i32| (x.wrapping_add(y) >> 1).wrapping_sub(sum >> 5);
            let (left, end) = (middle(a, c, down), middle(b, d, down));
            let centre = middle(left, end, across);
            let (top, bottom) = (middle(a, b, across), middle(c, d, across));
            match (right, low) {
                (false, false) => [a, top, left, centre],
                (true, false) => [top, b, centre, end],
                (false, true) => [left, centre, c, bottom],
                (true, true) => [centre, end, bottom, d],
            }
        };
        let ([a, b, c, d], [e, f, g, h]) = (halves(u, sums_u), halves(v, sums_v));
        let corners = [PlayUv { u: a, v: e }, PlayUv { u: b, v: f }, PlayUv { u: c, v: g }, PlayUv { u: d, v: h }];
        let less = |sum: PlayUv| PlayUv { u: sum.u >> 2, v: sum.v >> 2 };
        Self { corners, across: less(self.across), down: less(self.down) }
    }
}

/// How a number goes from pixel to pixel of a patch: x pixels to the right and y down it is
/// `at + y down + y (y - 1) / 2 fall + x (step + y turn) + x (x - 1) / 2 bend`, modulo 2^32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// At the first pixel.
    pub at: i32,
    /// From the first row to the second, in the first column;
    pub down: i32,
    /// how that changes from row to row.
    pub fall: i32,
    /// From the first column to the second, in the first row;
    pub step: i32,
    /// how that changes from row to row,
    pub turn: i32,
    /// and from column to column.
    pub bend: i32,
}

/// y (y - 1) / 2.
#[inline(always)]
const fn triangle(y: u32) -> i32 {
    (y.wrapping_mul(y.wrapping_sub(1)) as i32) >> 1
}

/// What is added so many `quarters` of a pixel on, by a first step and by what changes from step to step: q (q - 4) / 32 of that.
const fn moved(step: i32, change: i32, quarters: i32) -> i32 {
    (step.wrapping_mul(quarters) >> 2).wrapping_add(change.wrapping_mul(quarters.wrapping_mul(quarters.wrapping_sub(4))) >> 5)
}

/// `x` / 2^`log2`, to the nearest, ties up.
#[inline(always)]
pub const fn rounded(x: i32, log2: u32) -> i32 {
    x.wrapping_add(1i32.wrapping_shl(log2) >> 1).wrapping_shr(log2)
}

impl Form {
    /// In a patch of 2^`log2` pixels, given the number at its corners and the sums of its second differences there, across and down.
    #[must_use]
    #[inline(always)]
    pub const fn new([a, b, c, d]: [i32; 4], [across, down]: [i32; 2], log2: u32) -> Self {
        // Mean second differences from pixel to pixel; the first step of a curve is half of them, times its other steps, from the mean one.
        let (bend, fall) = (rounded(across, log2.wrapping_mul(2).wrapping_add(2)), rounded(down, log2.wrapping_mul(2).wrapping_add(2)));
        let others = 1i32.wrapping_shl(log2).wrapping_sub(1);
        let (left, right, above) = (rounded(c.wrapping_sub(a), log2), rounded(d.wrapping_sub(b), log2), rounded(b.wrapping_sub(a), log2));
        Self {
            at: a,
            down: left.wrapping_sub(fall.wrapping_mul(others) >> 1),
            fall,
            step: above.wrapping_sub(bend.wrapping_mul(others) >> 1),
            turn: rounded(right.wrapping_sub(left), log2),
            bend,
        }
    }

    /// The number `x` pixels to the right and `y` down.
    #[must_use]
    #[inline(always)]
    pub const fn at(&self, [x, y]: [u32; 2]) -> i32 {
        self.from([x, y]).at
    }

    /// The same numbers, counted from the pixel `x` to the right and `y` down.
    #[must_use]
    #[inline(always)]
    pub const fn from(&self, [x, y]: [u32; 2]) -> Self {
        let Self { at, down, fall, step, turn, bend } = *self;
        let (right, low) = (x as i32, y as i32);
        let step = step.wrapping_add(turn.wrapping_mul(low));
        let at = at.wrapping_add(down.wrapping_mul(low)).wrapping_add(fall.wrapping_mul(triangle(y)));
        Self {
            at: at.wrapping_add(step.wrapping_mul(right)).wrapping_add(bend.wrapping_mul(triangle(x))),
            down: down.wrapping_add(fall.wrapping_mul(low)).wrapping_add(turn.wrapping_mul(right)),
            step: step.wrapping_add(bend.wrapping_mul(right)),
            ..*self
        }
    }

    /// The numbers with the other sign.
    #[must_use]
    #[inline(always)]
    pub const fn negated(&self) -> Self {
        let Self { at, down, fall, step, turn, bend } = *self;
        Self {
            at: at.wrapping_neg(),
            down: down.wrapping_neg(),
            fall: fall.wrapping_neg(),
            step: step.wrapping_neg(),
            turn: turn.wrapping_neg(),
            bend: bend.wrapping_neg(),
        }
    }

    /// Moved by parts of a pixel: `across` and `down` quarters of one.
    #[must_use]
    pub const fn beside(&self, [across, down]: [i32; 2]) -> Self {
        let Self { at, down: below, fall, step, turn, bend } = *self;
        let step = step.wrapping_add(turn.wrapping_mul(down) >> 2);
        Self {
            at: at.wrapping_add(moved(below, fall, down)).wrapping_add(moved(step, bend, across)),
            down: below.wrapping_add(fall.wrapping_mul(down) >> 2).wrapping_add(turn.wrapping_mul(across) >> 2),
            step: step.wrapping_add(bend.wrapping_mul(across) >> 2),
            ..*self
        }
    }

    /// One row further down.
    #[inline(always)]
    pub const fn next_row(&mut self) {
        self.at = self.at.wrapping_add(self.down);
        self.down = self.down.wrapping_add(self.fall);
        self.step = self.step.wrapping_add(self.turn);
    }

    /// Which of the next `pixels` pixels of the first row have a number below zero: a bit each.
    #[must_use]
    #[inline(always)]
    pub fn negative(&self, pixels: u32) -> u32 {
        let Self { at: mut value, mut step, bend, .. } = *self;
        // Most often all of a row are on one side: where its ends are, and farther from zero than it bulges in between.
        let last = pixels.wrapping_sub(1);
        let end = value.wrapping_add(step.wrapping_mul(last as i32)).wrapping_add(bend.wrapping_mul(triangle(last)));
        let bulge = bend.unsigned_abs().wrapping_mul(last.wrapping_mul(last)) >> 3;
        // Of four pixels, telling takes as long as they do.
        if pixels > 4 && value ^ end >= 0 && value.unsigned_abs() >= bulge && end.unsigned_abs() >= bulge {
            return if value < 0 { u32::MAX.wrapping_shr(32u32.wrapping_sub(pixels)) } else { 0 };
        }
        let mut below = 0u32;
        for pixel in 0..pixels {
            below |= (value as u32 >> 31).wrapping_shl(pixel);
            (value, step) = (value.wrapping_add(step), step.wrapping_add(bend));
        }
        below
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_go_through_their_corners_and_are_what_their_formula_says() {
        let mut seed = 5u32;
        let mut next = |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(seed) * u64::from(below)) >> 32) as i32 - (below / 2) as i32
        };
        for log2 in 2..=5 {
            let n = 1u32 << log2;
            for _ in 0..500 {
                let corners = [(); 4].map(|()| next(1 << 24));
                let (across, down) = (next(1 << 20), next(1 << 20));
                let form = Form::new(corners, [across, down], log2);
                // Rounded are a step for each pixel on either way, and how steps change, for each pixel.
                let off = i64::from(n * n / 2 + n * n / 4 + n);
                for (corner, at) in corners.into_iter().zip([[0, 0], [n, 0], [0, n], [n, n]]) {
                    assert!(i64::from(form.at(at)).abs_diff(corner.into()) as i64 <= off, "{form:?} {at:?} {corner}");
                }
                let exact = |x: f64, y: f64| {
                    let [a, b, c, d] = corners.map(f64::from);
                    let bilinear = (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y;
                    bilinear - f64::from(across) / 8.0 * x * (1.0 - x) - f64::from(down) / 8.0 * y * (1.0 - y)
                };
                let mut row = form;
                for y in 0..n {
                    for x in 0..n {
                        let value = exact(f64::from(x) / f64::from(n), f64::from(y) / f64::from(n));
                        assert!((f64::from(form.at([x, y])) - value).abs() <= off as f64);
                        assert_eq!(row.at([x, 0]), form.at([x, y]));
                        let from = form.from([x, y]);
                        assert_eq!((from.at([3, 2]), from.at([0, 1])), (form.at([x + 3, y + 2]), form.at([x, y + 1])));
                    }
                    let bits = (0..n).fold(0, |bits, x| bits | u32::from(form.at([x, y]) < 0) << x);
                    assert_eq!(row.negative(n), bits, "{form:?} {y}");
                    row.next_row();
                }
            }
        }
    }

    #[test]
    fn parts_are_parts() {
        let corners = [[100, 900], [4100, 300], [-700, 5000], [8000, 8000]].map(|[u, v]| PlayUv { u: u << 8, v: v << 8 });
        let patch = Patch { corners, across: PlayUv { u: 70_000, v: -20_000 }, down: PlayUv { u: -9000, v: 120_000 } };
        assert_eq!(patch.part([0, 0], 3, 3), patch);
        for log2 in [4, 5] {
            let [u, v] = patch.forms(log2);
            for [left, above] in [[0, 0], [8, 0], [0, 8], [8, 8]] {
                let [part_u, part_v] = patch.part([left, above], 3, log2).forms(3);
                for (x, y) in (0..8).flat_map(|y| (0..8).map(move |x| (x, y))) {
                    let [a, b] = [u, v].map(|form| form.at([left + x, above + y]));
                    assert!(part_u.at([x, y]).abs_diff(a) < 200 && part_v.at([x, y]).abs_diff(b) < 200, "{log2} {left} {above}");
                }
            }
        }
    }
}
