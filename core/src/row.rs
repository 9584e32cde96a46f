//! A row of nodes at one moment: its layers interpolated in time, or halfway between two such rows.
//! Keys come from the caller's memory, rows go to `sheet`.

use crate::fixed::{KeyUv, ONE, PlayUv, WEIGHT_BITS, blend, middle};
use crate::grid::Grid;
use crate::key::Key;
use crate::timeline::{Moment, WeightSet};

/// A layer at one moment: a [`PlayUv`] in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Layer {
    u: i32,
    v: i32,
}

impl Layer {
    /// The position.
    #[must_use]
    pub const fn uv(self) -> PlayUv {
        PlayUv { u: self.u, v: self.v }
    }

    /// Halfway between `from` and `to`, given what comes before and after on the same line (see [`middle`]).
    #[must_use]
    pub fn middle(before: Option<Self>, from: Self, to: Self, after: Option<Self>) -> Self {
        let axis = |get: fn(Self) -> i32| middle(before.map(get), get(from), get(to), after.map(get));
        Self { u: axis(|layer| layer.u), v: axis(|layer| layer.v) }
    }
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
    /// Fraction bits of coordinates in keys.
    pub key_bits: u32,
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
        PlayUv { u: blend(four.map(KeyUv::u), *weights, self.key_bits), v: blend(four.map(KeyUv::v), *weights, self.key_bits) }
    }

    /// The fields of a layer, straight between the interval's keys, Q8 pixels.
    fn field(&self, [from, to]: [usize; 2], linear: i32) -> [i16; 2] {
        let ([a, b], [c, d]) = (self.from.field(from), self.to.field(to));
        // Distances are at most 2^15 and weights 2^14: the sums fit.
        let mix = |from: i32, to: i32| {
            let sum = from.wrapping_mul(ONE.wrapping_sub(linear)).wrapping_add(to.wrapping_mul(linear));
            // The largest distance, 2^15, is one more than 16 bits hold.
            (sum >> WEIGHT_BITS).clamp(-32_767, 32_767) as i16
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
    /// Fields, Q8 pixels; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
}

impl NodeRow<'_> {
    /// Fills the row with the layers that both ends of the interval carry in row `row` of the grid's nodes, weighted; with none
    /// outside the grid. Returns how many there are.
    pub fn fill(&mut self, grid: Grid, row: Option<usize>, keys: &Around<'_, '_>, moment: &Moment) -> u32 {
        let Some(row) = row.filter(|&row| row < grid.node_rows()) else {
            self.start.fill(0);
            return 0;
        };
        let (weights, linear) = (&moment.weights, moment.linear);
        let first = row.wrapping_mul(grid.node_columns());
        let mut count = 0usize;
        for column in 0..grid.node_columns() {
            self.begin(column, count);
            let node = first.wrapping_add(column);
            let (mut index, labels) = keys.from.node(node);
            for &label in labels {
                if let Some(other) = keys.to.find(node, label) {
                    let uv = keys.blend(node, label, [index, other], weights);
                    count = self.put(count, label, Layer { u: uv.u, v: uv.v }, || keys.field([index, other], linear));
                }
                index = index.wrapping_add(1);
            }
        }
        self.begin(grid.node_columns(), count);
        count as u32
    }

    /// Fills the row with what lies halfway between rows `from` and `to`, where both carry it; `before` and `after` are the rows
    /// around these. Returns how many layers there are.
    pub fn between(&mut self, columns: usize, [before, from, to, after]: [&NodeRow<'_>; 4]) -> u32 {
        let mut count = 0usize;
        for column in 0..columns {
            self.begin(column, count);
            let (mut index, labels) = from.node(column);
            for &label in labels {
                if let Some(below) = to.find(column, label) {
                    let (first, last) = (before.find(column, label), after.find(column, label));
                    let layer =
                        Layer::middle(first.map(|at| before.layer(at)), from.layer(index), to.layer(below), last.map(|at| after.layer(at)));
                    // Fields are straight from node to node: nothing asks for them here.
                    count = self.put(count, label, layer, || [0; 2]);
                }
                index = index.wrapping_add(1);
            }
        }
        self.begin(columns, count);
        count as u32
    }

    fn begin(&mut self, column: usize, count: usize) {
        if let Some(start) = self.start.get_mut(column) {
            *start = count as u16;
        }
    }

    /// Puts a layer at `count`, if there is room; its fields where the bundle has such. Returns where the next one goes.
    fn put(&mut self, count: usize, label: u8, layer: Layer, field: impl FnOnce() -> [i16; 2]) -> usize {
        let Some((label_slot, layer_slot)) = self.label.get_mut(count).zip(self.layer.get_mut(count)) else { return count };
        (*label_slot, *layer_slot) = (label, layer);
        if let Some(slot) = self.field.get_mut(count) {
            *slot = field();
        }
        count.wrapping_add(1)
    }

    /// The index of the first layer of the node in `column` and the labels of its layers.
    fn node(&self, column: usize) -> (u16, &[u8]) {
        let at = |column: usize| self.start.get(column).copied().unwrap_or(0);
        let (from, to) = (at(column), at(column.wrapping_add(1)));
        (from, self.label.get(usize::from(from)..usize::from(to)).unwrap_or(&[]))
    }

    /// The index of the layer of `label` at the node in `column`.
    #[must_use]
    pub fn find(&self, column: usize, label: u8) -> Option<u16> {
        let (from, labels) = self.node(column);
        labels.iter().position(|&l| l == label).map(|place| from.wrapping_add(place as u16))
    }

    /// The fields of layer `index`; those of one that shows everywhere where the bundle has none.
    #[must_use]
    pub fn field(&self, index: u16) -> [i16; 2] {
        self.field.get(usize::from(index)).copied().unwrap_or([1, 1])
    }

    /// Layer `index`.
    #[must_use]
    pub fn layer(&self, index: u16) -> Layer {
        self.layer.get(usize::from(index)).copied().unwrap_or_default()
    }
}
