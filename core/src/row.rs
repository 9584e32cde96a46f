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
    #[inline]
    pub const fn middle(before: Option<Self>, from: Self, to: Self, after: Option<Self>) -> Self {
        // One decision for both axes.
        match (before, after) {
            (Some(b), Some(a)) => {
                Self { u: middle(Some(b.u), from.u, to.u, Some(a.u)), v: middle(Some(b.v), from.v, to.v, Some(a.v)) }
            }
            (Some(b), None) => Self { u: middle(Some(b.u), from.u, to.u, None), v: middle(Some(b.v), from.v, to.v, None) },
            (None, Some(a)) => Self { u: middle(None, from.u, to.u, Some(a.u)), v: middle(None, from.v, to.v, Some(a.v)) },
            (None, None) => Self { u: middle(None, from.u, to.u, None), v: middle(None, from.v, to.v, None) },
        }
    }
}

/// Looks up labels in one row of nodes, node by node from left to right.
#[derive(Clone, Debug)]
pub struct Walk<'w> {
    ends: core::slice::Iter<'w, u16>,
    labels: &'w [u8],
    from: usize,
    to: usize,
}

impl<'w> Walk<'w> {
    /// A walk over nodes whose layers start at `starts`, with one entry more than there are nodes; before the first of them.
    fn new(starts: &'w [u16], labels: &'w [u8]) -> Self {
        let mut ends = starts.iter();
        let to = ends.next().map_or(0, |&at| usize::from(at));
        Self { ends, labels, from: to, to }
    }

    /// On to the next node; past the last there is one without layers.
    #[inline]
    pub fn step(&mut self) {
        self.from = self.to;
        if let Some(&end) = self.ends.next() {
            self.to = usize::from(end);
        }
    }

    /// The index of the node's layer of `label`.
    #[must_use]
    #[inline(always)]
    pub fn find(&self, label: u8) -> Option<usize> {
        if self.from < self.to && self.labels.get(self.from) == Some(&label) {
            return Some(self.from);
        }
        self.search(label)
    }

    /// As `find`, where the label is not the first.
    #[inline(never)]
    fn search(&self, label: u8) -> Option<usize> {
        let labels = self.labels.get(self.from..self.to)?;
        labels.iter().position(|&other| other == label).map(|place| self.from.wrapping_add(place))
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
}

impl Around<'_, '_> {
    /// The position at a moment of a layer that the interval's two keys have as `from` and `to`, those around it as `before` and `after`.
    #[inline(always)]
    fn blend(&self, [before, after]: [Option<usize>; 2], [from, to]: [usize; 2], weights: &WeightSet) -> PlayUv {
        let outer = |key: Option<&Key<'_>>, index: Option<usize>| key.zip(index).map(|(key, index)| key.uv(index));
        let (before, after) = (outer(self.before, before), outer(self.after, after));
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

/// A walk over the `columns` nodes of `key` from node `first` on; over none without a key.
fn enter<'k>(key: Option<&'k Key<'_>>, first: usize, columns: usize) -> Walk<'k> {
    let starts = key.and_then(|key| Some((key.start.get(first..=first.wrapping_add(columns))?, &*key.label)));
    let (starts, labels) = starts.unwrap_or((&[], &[]));
    Walk::new(starts, labels)
}

/// No layer: see [`NodeRow::right`].
const NONE: u16 = 0x7fff;
/// A layer of the same label is at the node to the left.
const LEFT: u16 = 0x8000;

/// One row of nodes at one moment, in caller's memory.
#[derive(Debug)]
pub struct NodeRow<'m> {
    /// Where each node's layers start; one entry more than nodes in the row.
    pub start: &'m mut [u16],
    /// Labels, ascending at each node.
    pub label: &'m mut [u8],
    /// Positions, Q15.16 texels.
    pub layer: &'m mut [Layer],
    /// Each layer's partner: which layer of the node to the right has the same label, [`NONE`] if none has; and [`LEFT`].
    pub right: &'m mut [u16],
    /// Where space is cubic, the positions halfway between each layer and its partner.
    pub middle: &'m mut [Layer],
    /// Fields, Q8 pixels; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
}

impl NodeRow<'_> {
    /// Fills the row with the layers that both ends of the interval carry in row `row` of the grid's nodes, weighted; with none
    /// outside the grid. Returns how many there are.
    #[inline(never)]
    pub fn fill(&mut self, grid: Grid, row: Option<usize>, keys: &Around<'_, '_>, moment: &Moment) -> u32 {
        let Some(row) = row.filter(|&row| row < grid.node_rows()) else {
            self.start.fill(0);
            return 0;
        };
        let (weights, linear) = (&moment.weights, moment.linear);
        let columns = grid.node_columns();
        let first = row.wrapping_mul(columns);
        let (mut from, mut to) = (enter(Some(keys.from), first, columns), enter(Some(keys.to), first, columns));
        let (mut before, mut after) = (enter(keys.before, first, columns), enter(keys.after, first, columns));
        let mut count = 0usize;
        for column in 0..columns {
            self.begin(column, count);
            for walk in [&mut from, &mut to, &mut before, &mut after] {
                walk.step();
            }
            for index in from.from..from.to {
                let Some(&label) = keys.from.label.get(index) else { break };
                if let Some(other) = to.find(label) {
                    let both = [index, other];
                    let uv = keys.blend([before.find(label), after.find(label)], both, weights);
                    count = self.put(count, label, Layer { u: uv.u, v: uv.v }, || keys.field(both, linear));
                }
            }
        }
        self.begin(columns, count);
        self.link(columns);
        count as u32
    }

    /// Fills the row with what lies halfway between rows `from` and `to`, where both carry it; `before` and `after` are the rows
    /// around these. Returns how many layers there are.
    #[inline(never)]
    pub fn between(&mut self, columns: usize, [before, from, to, after]: [&NodeRow<'_>; 4]) -> u32 {
        let mut count = 0usize;
        let [mut first, mut upper, mut lower, mut last] = [before, from, to, after].map(NodeRow::walk);
        for column in 0..columns {
            self.begin(column, count);
            for walk in [&mut first, &mut upper, &mut lower, &mut last] {
                walk.step();
            }
            for index in upper.from..upper.to {
                let Some(&label) = from.label.get(index) else { break };
                if let Some(below) = lower.find(label) {
                    let outer = |row: &NodeRow<'_>, at: Option<usize>| at.and_then(|at| row.layer.get(at).copied());
                    let (above, under) = (outer(before, first.find(label)), outer(after, last.find(label)));
                    let (Some(&here), Some(&there)) = (from.layer.get(index), to.layer.get(below)) else { break };
                    // Fields are straight from node to node: nothing asks for them here.
                    count = self.put(count, label, Layer::middle(above, here, there, under), || [0; 2]);
                }
            }
        }
        self.begin(columns, count);
        self.link(columns);
        count as u32
    }

    /// A walk over the row's nodes.
    #[must_use]
    pub fn walk(&self) -> Walk<'_> {
        Walk::new(self.start, self.label)
    }

    /// Finds every layer's partner and, where there is room for them, what lies halfway to it.
    #[inline(never)]
    fn link(&mut self, columns: usize) {
        let at = |column: usize, start: &[u16]| start.get(column).map_or(0, |&at| usize::from(at));
        let (mut from, mut next) = (at(0, self.start), at(1, self.start));
        let mut nodes = Walk::new(self.start, self.label);
        nodes.step();
        for column in 0..columns {
            let end = next;
            nodes.step();
            for index in from..end {
                let Some(&label) = self.label.get(index) else { break };
                // Indices that do not fit are no partners.
                let partner = if column.wrapping_add(1) < columns { nodes.find(label).filter(|&at| at < usize::from(NONE)) } else { None };
                if let Some(partner) = partner {
                    if let Some(link) = self.right.get_mut(index) {
                        *link = *link & LEFT | partner as u16;
                    }
                    if let Some(link) = self.right.get_mut(partner) {
                        *link |= LEFT;
                    }
                }
            }
            (from, next) = (end, nodes.to);
        }
        if !self.middle.is_empty() {
            for index in 0..from {
                if self.right.get(index).is_some_and(|link| link & LEFT == 0) {
                    self.halve(index);
                }
            }
        }
    }

    /// Works out the middles along the chain of partners that starts at layer `index`.
    fn halve(&mut self, mut index: usize) {
        let (mut before, mut from) = (None, self.layer(index as u16));
        let mut partner = self.right(index);
        let mut to = partner.map(|at| self.layer(at as u16));
        while let (Some(next), Some(there)) = (partner, to) {
            let beyond = self.right(next);
            let after = beyond.map(|at| self.layer(at as u16));
            if let Some(slot) = self.middle.get_mut(index) {
                *slot = Layer::middle(before, from, there, after);
            }
            (before, from, to) = (Some(from), there, after);
            (index, partner) = (next, beyond);
        }
    }

    /// The partner of layer `index`: the layer of the same label at the node to the right.
    #[must_use]
    #[inline]
    pub fn right(&self, index: usize) -> Option<usize> {
        let link = self.right.get(index).copied().unwrap_or(NONE) & !LEFT;
        (link != NONE).then_some(usize::from(link))
    }

    #[inline]
    fn begin(&mut self, column: usize, count: usize) {
        if let Some(start) = self.start.get_mut(column) {
            *start = count as u16;
        }
    }

    /// Puts a layer at `count`, if there is room; its fields where the bundle has such. Returns where the next one goes.
    #[inline]
    fn put(&mut self, count: usize, label: u8, layer: Layer, field: impl FnOnce() -> [i16; 2]) -> usize {
        let (Some(label_slot), Some(layer_slot), Some(link)) =
            (self.label.get_mut(count), self.layer.get_mut(count), self.right.get_mut(count))
        else {
            return count;
        };
        (*label_slot, *layer_slot, *link) = (label, layer, NONE);
        if let Some(slot) = self.field.get_mut(count) {
            *slot = field();
        }
        count.wrapping_add(1)
    }

    /// The fields of layer `index`; those of one that shows everywhere where the bundle has none.
    #[must_use]
    #[inline]
    pub fn field(&self, index: u16) -> [i16; 2] {
        self.field.get(usize::from(index)).copied().unwrap_or([1, 1])
    }

    /// Layer `index`.
    #[must_use]
    #[inline]
    pub fn layer(&self, index: u16) -> Layer {
        self.layer.get(usize::from(index)).copied().unwrap_or_default()
    }

    /// What lies halfway from layer `index` to its partner.
    #[must_use]
    #[inline]
    pub fn halfway(&self, index: u16) -> Layer {
        self.middle.get(usize::from(index)).copied().unwrap_or_default()
    }
}
