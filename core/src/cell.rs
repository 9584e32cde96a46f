//! A row of cells at one moment: every node's layers interpolated in time, every cell's sheets with
//! their four corners. Keys and lists come from the caller's memory, spans go to `span`.

use crate::fixed::{KeyUv, ONE, PlayUv, WEIGHT_BITS, blend, part};
use crate::grid::Grid;
use crate::key::Key;
use crate::lists::Lists;
use crate::span::{Fields, Span};
use crate::timeline::{Moment, WeightSet};

/// A layer at one moment: a [`PlayUv`] in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Layer {
    u: i32,
    v: i32,
}

/// The keys around a moment.
#[derive(Clone, Copy, Debug)]
pub struct Around<'k, 'm> {
    /// The key before the interval, where its time is cubic and there is one.
    pub before: Option<&'k Key<'m>>,
    /// The key at its start.
    pub from: &'k Key<'m>,
    /// The key at its end.
    pub to: &'k Key<'m>,
    /// The key after it.
    pub after: Option<&'k Key<'m>>,
}

impl Around<'_, '_> {
    /// The layer of `label` at `node`, whose indices in the interval's two keys are known.
    fn blend(&self, node: usize, label: u8, [from, to]: [usize; 2], weights: &WeightSet) -> PlayUv {
        let outer = |key: Option<&Key<'_>>| key.and_then(|key| Some(key.uv(key.find(node, label)?)));
        let (before, after) = (outer(self.before), outer(self.after));
        let [both, no_first, no_last, neither] = weights;
        let weights = match (before, after) {
            (Some(_), Some(_)) => both,
            (None, Some(_)) => no_first,
            (Some(_), None) => no_last,
            (None, None) => neither,
        };
        let four = [before.unwrap_or_default(), self.from.uv(from), self.to.uv(to), after.unwrap_or_default()];
        PlayUv { u: blend(four.map(KeyUv::u), *weights), v: blend(four.map(KeyUv::v), *weights) }
    }

    /// The fields of a layer, straight between the interval's keys, Q16 pixels.
    fn field(&self, [from, to]: [usize; 2], linear: i32) -> [i32; 2] {
        let ([a, b], [c, d]) = (self.from.field(from), self.to.field(to));
        // Distances are at most 2^15 and weights 2^14: the sums fit.
        let mix = |from: i32, to: i32| {
            let sum = from.wrapping_mul(ONE.wrapping_sub(linear)).wrapping_add(to.wrapping_mul(linear));
            sum >> (WEIGHT_BITS - 8)
        };
        [mix(a, c), mix(b, d)]
    }
}

/// One row of nodes at one moment, in caller's memory.
#[derive(Debug)]
pub struct NodeRow<'m> {
    /// Where each node's layers start; one entry more than nodes in the row.
    pub start: &'m mut [u16],
    /// Labels, ascending at each node.
    pub label: &'m mut [u8],
    /// Positions, Q15.16 texels.
    pub layer: &'m mut [Layer],
    /// Fields, Q16 pixels; empty where the bundle has none.
    pub field: &'m mut [[i32; 2]],
}

impl NodeRow<'_> {
    /// Fills the row with the layers that both ends of the interval carry, weighted. Returns how many there are.
    pub fn fill(&mut self, grid: Grid, row: usize, keys: &Around<'_, '_>, moment: &Moment) -> u32 {
        let (weights, linear) = (&moment.weights, moment.linear);
        let first = row.wrapping_mul(grid.node_columns());
        let mut count = 0usize;
        for column in 0..grid.node_columns() {
            if let Some(start) = self.start.get_mut(column) {
                *start = count as u16;
            }
            let node = first.wrapping_add(column);
            let (mut index, labels) = keys.from.node(node);
            for &label in labels {
                if let Some(other) = keys.to.find(node, label)
                    && let Some((slot, layer)) = self.label.get_mut(count).zip(self.layer.get_mut(count))
                {
                    let uv = keys.blend(node, label, [index, other], weights);
                    *slot = label;
                    *layer = Layer { u: uv.u, v: uv.v };
                    if let Some(field) = self.field.get_mut(count) {
                        *field = keys.field([index, other], linear);
                    }
                    count = count.wrapping_add(1);
                }
                index = index.wrapping_add(1);
            }
        }
        if let Some(start) = self.start.get_mut(grid.node_columns()) {
            *start = count as u16;
        }
        count as u32
    }

    fn find(&self, column: usize, label: u8) -> Option<u16> {
        let at = |column: usize| self.start.get(column).map_or(0, |&at| usize::from(at));
        let (from, to) = (at(column), at(column.wrapping_add(1)));
        let place = self.label.get(from..to)?.iter().position(|&l| l == label)?;
        Some(from.wrapping_add(place) as u16)
    }

    fn field(&self, layer: u16) -> [i32; 2] {
        self.field.get(usize::from(layer)).copied().unwrap_or([1, 1])
    }

    fn uv(&self, layer: u16) -> PlayUv {
        self.layer.get(usize::from(layer)).map_or_else(PlayUv::default, |l| PlayUv { u: l.u, v: l.v })
    }
}

/// One sheet of a cell: its label, its test, and where its layers at the cell's four corners stand in the two [`NodeRow`]s.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sheet {
    top: [u16; 2],
    bottom: [u16; 2],
    label: u8,
    test: u8,
}

impl Sheet {
    /// The sheet's label.
    #[must_use]
    pub const fn label(&self) -> u8 {
        self.label
    }

    /// The sheet's coverage test: one of [`crate::lists`]'s.
    #[must_use]
    pub const fn test(&self) -> u16 {
        self.test as u16
    }

    /// The sheet's fields along pixel row `step` (0 at the top) of the cell, which is 2^`log2` pixels high.
    #[must_use]
    pub fn fields(&self, top: &NodeRow<'_>, bottom: &NodeRow<'_>, step: u32, log2: u32) -> Fields {
        let edge = |above: u16, below: u16| {
            let ([a, b], [c, d]) = (top.field(above), bottom.field(below));
            [part(a, c, step, log2), part(b, d, step, log2)]
        };
        let ([a, b], [c, d]) = (self.top, self.bottom);
        Fields::between(edge(a, c), edge(b, d), log2)
    }

    /// The sheet along pixel row `step` (0 at the top) of the cell, which is 2^`log2` pixels high.
    #[must_use]
    pub fn span(&self, top: &NodeRow<'_>, bottom: &NodeRow<'_>, step: u32, log2: u32) -> Span {
        let edge = |above: u16, below: u16| {
            let (above, below) = (top.uv(above), bottom.uv(below));
            PlayUv { u: part(above.u, below.u, step, log2), v: part(above.v, below.v, step, log2) }
        };
        let ([a, b], [c, d]) = (self.top, self.bottom);
        Span::between(edge(a, c), edge(b, d), log2)
    }
}

/// The sheets of a row of cells, in caller's memory.
#[derive(Debug)]
pub struct RowSheets<'m> {
    /// Where each cell's sheets start; one entry more than cells in the row.
    pub start: &'m mut [u16],
    /// Front to back.
    pub sheet: &'m mut [Sheet],
}

impl RowSheets<'_> {
    /// Looks up the corners of every sheet that `lists` names in `row`. A sheet without a layer at a corner is left out:
    /// only broken bundles have such.
    pub fn fill(&mut self, grid: Grid, row: usize, lists: &Lists<'_>, top: &NodeRow<'_>, bottom: &NodeRow<'_>) {
        let mut cursor = lists.row(row);
        let mut count = 0usize;
        for column in 0..grid.columns {
            if let Some(start) = self.start.get_mut(column) {
                *start = count as u16;
            }
            let right = column.wrapping_add(1);
            let listed = lists.sheets(cursor);
            for (index, &label) in listed.labels.iter().enumerate() {
                let corners = (top.find(column, label), top.find(right, label), bottom.find(column, label), bottom.find(right, label));
                if let (Some(a), Some(b), Some(c), Some(d)) = corners
                    && let Some(sheet) = self.sheet.get_mut(count)
                {
                    *sheet = Sheet { top: [a, b], bottom: [c, d], label, test: listed.test(index) as u8 };
                    count = count.wrapping_add(1);
                }
            }
            cursor = cursor.next(lists);
        }
        if let Some(start) = self.start.get_mut(grid.columns) {
            *start = count as u16;
        }
    }

    /// The sheets of the cell in `column`, front to back.
    #[must_use]
    pub fn cell(&self, column: usize) -> &[Sheet] {
        let at = |column: usize| self.start.get(column).map_or(0, |&at| usize::from(at));
        self.sheet.get(at(column)..at(column.wrapping_add(1))).unwrap_or(&[])
    }
}
