//! Patches: one sheet of a cell, or of a part of one, at one moment. Its positions follow from those at its corners and from how these bend; along a row
//! of pixels, and down a column, they go by a first and a second difference. Layers come from `row`; `span`, `window` and `torn` ask for rows of
//! pixels, tiles and bounds.

use crate::bounds::Bounds;
use crate::fixed::PlayUv;
use crate::form::Form;
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
        let ([a, b, above_across, above_down], [c, d, below_across, below_down]) = (top.ends(above), bottom.ends(below));
        Self { corners: [a, b, c, d], across: above_across.plus(below_across), down: above_down.plus(below_down) }
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

    /// How u, or `down` the picture v, goes from pixel to pixel, where it is 2^`log2` pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub fn form(&self, down: bool, log2: u32) -> Form {
        let [u, v] = self.axes();
        let (corners, sums) = if down { v } else { u };
        Form::new(corners, sums, log2)
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

#[cfg(test)]
mod tests {
    use super::*;

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
