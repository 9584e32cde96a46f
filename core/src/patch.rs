//! Patches: one sheet of a cell, or of a part of one, at one moment. Its positions follow from those at its corners and from how these bend; along a row
//! of pixels, and down a column, they go by a first and a second difference. Layers come from `row`; `span`, `window` and `torn` ask for rows of
//! pixels, tiles and bounds.

use crate::bounds::Bounds;
use crate::fixed::PlayUv;
use crate::form::Form;
use crate::sheet::{Rows, Sheet};

/// One coordinate, u or v, of a sheet of a cell, or of a part of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Axis {
    /// At its corners: above left and right, below left and right.
    pub corners: [i32; 4],
    /// Sums of second differences at the corners, from corner to corner: across and down.
    pub sums: [i32; 2],
    /// What it lies between.
    ends: [i32; 2],
}

impl Axis {
    /// Given its corners and sums.
    #[must_use]
    #[inline(always)]
    pub fn new(corners: [i32; 4], sums: [i32; 2]) -> Self {
        let ([a, b, c, d], [across, down]) = (corners, sums.map(|sum| sum.saturating_abs() >> 5));
        // It goes beyond what lies around its corners by an eighth of the mean second difference each way, at most; and where it is drawn straight, by
        // an eighth of that more.
        let bulge = across.wrapping_add(down);
        let bulge = bulge.wrapping_add(bulge >> 3).wrapping_add(2);
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        Self { corners, sums, ends: [low.wrapping_sub(bulge), high.wrapping_add(bulge)] }
    }

    /// Between layers above, left and right, and below: their numbers from one coordinate to its last, which come by turns with the other's.
    // A coordinate after the other, since a small processor has no registers for both.
    #[inline(never)]
    fn straight(&[a, _, b]: &[i32; 3], &[c, _, d]: &[i32; 3]) -> Self {
        Self::new([a, b, c, d], [0; 2])
    }

    /// Likewise between nodes: in a function of its own, and where it stands.
    #[inline(never)]
    fn bent(above: &[i32; 11], below: &[i32; 11]) -> Self {
        Self::bent_here(above, below)
    }

    #[inline(always)]
    fn bent_here(&[a, _, e, _, g, _, b, _, f, _, h]: &[i32; 11], &[c, _, i, _, k, _, d, _, j, _, l]: &[i32; 11]) -> Self {
        let sum = |a: i32, b: i32, c: i32, d: i32| a.wrapping_add(b).wrapping_add(c.wrapping_add(d));
        Self::new([a, b, c, d], [sum(e, f, i, j), sum(g, h, k, l)])
    }

    /// How it goes from pixel to pixel, where it is 2^`log2` pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub const fn form(&self, log2: u32) -> Form {
        Form::new(self.corners, self.sums, log2)
    }

    /// Its quarter to the left or to the right, above or below.
    #[inline(never)]
    fn quarter(&self, right: bool, low: bool) -> Self {
        let &Self { corners: [a, b, c, d], sums: [across, down], .. } = self;
        // How far the middles of edges are off the means of their ends, both ways.
        let middle = |x: i32, y: i32, sum: i32| (x.wrapping_add(y) >> 1).wrapping_sub(sum >> 5);
        let (left, end) = (middle(a, c, down), middle(b, d, down));
        let centre = middle(left, end, across);
        let (top, bottom) = (middle(a, b, across), middle(c, d, across));
        let corners = match (right, low) {
            (false, false) => [a, top, left, centre],
            (true, false) => [top, b, centre, end],
            (false, true) => [left, centre, c, bottom],
            (true, true) => [centre, end, bottom, d],
        };
        Self::new(corners, [across >> 2, down >> 2])
    }
}

/// A sheet of a cell, or of a part of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Patch {
    /// Across the source image,
    pub u: Axis,
    /// and down.
    pub v: Axis,
}

impl Patch {
    /// `sheet` in its cell between these rows of nodes; nowhere if they lack it, which does not happen.
    #[must_use]
    #[inline(always)]
    pub fn new(rows: Rows<'_, '_>, sheet: &Sheet) -> Self {
        Self::made(rows, sheet, Axis::bent)
    }

    /// The same with all code where it stands, for callers that do not ask for what lies around it.
    #[must_use]
    #[inline(always)]
    pub fn new_here(rows: Rows<'_, '_>, sheet: &Sheet) -> Self {
        Self::made(rows, sheet, Axis::bent_here)
    }

    /// The same, of coordinates that `bent` makes of nodes.
    #[inline(always)]
    fn made([top, bottom]: Rows<'_, '_>, sheet: &Sheet, bent: impl Fn(&[i32; 11], &[i32; 11]) -> Axis) -> Self {
        let [above, below] = sheet.nodes();
        if let Some((above, below)) = top.nodes(above).zip(bottom.nodes(below)) {
            let ([u @ .., _], [u_below @ .., _], [_, v @ ..], [_, v_below @ ..]) = (above, below, above, below);
            return Self { u: bent(u, u_below), v: bent(v, v_below) };
        }
        let Some((above, below)) = top.layers(above).zip(bottom.layers(below)) else { return Self::default() };
        let ([u @ .., _], [u_below @ .., _], [_, v @ ..], [_, v_below @ ..]) = (above, below, above, below);
        Self { u: Axis::straight(u, u_below), v: Axis::straight(v, v_below) }
    }

    /// What lies around it.
    #[must_use]
    #[inline(always)]
    pub fn bounds(&self) -> Bounds {
        let ([left, right], [top, bottom]) = (self.u.ends, self.v.ends);
        Bounds { low: PlayUv { u: left, v: top }, high: PlayUv { u: right, v: bottom } }
    }

    /// How u and v go from pixel to pixel, where it is 2^`log2` pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub fn forms(&self, log2: u32) -> [Form; 2] {
        [self.u.form(log2), self.v.form(log2)]
    }

    /// Of its parts of 2^`part` pixels that whose first pixel is `from` pixels to the right and down; it is 2^`log2` pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub fn part(mut self, [x, y]: [u32; 2], part: u32, log2: u32) -> Self {
        for bit in (part..log2).rev() {
            let [right, low] = [x, y].map(|pixels| pixels.wrapping_shr(bit) & 1 == 1);
            self = Self { u: self.u.quarter(right, low), v: self.v.quarter(right, low) };
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_parts() {
        let axis = |corners: [i32; 4], sums| Axis::new(corners.map(|corner| corner << 8), sums);
        let patch = Patch { u: axis([100, 4100, -700, 8000], [70_000, -9000]), v: axis([900, 300, 5000, 8000], [-20_000, 120_000]) };
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
