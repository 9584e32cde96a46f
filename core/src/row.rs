//! A row of nodes at one moment: its layers interpolated in time, or halfway between two such rows.
//! Keys come from the caller's memory, rows go to `sheet`.

use crate::fixed::{KEY_MIN, KeyUv, ONE, PLAY_BITS, PlayUv, WEIGHT_BITS, middle};
use crate::grid::Grid;
use crate::key::Key;
use crate::timeline::{Moment, Weights};

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
            (Some(b), Some(a)) => Self { u: middle(Some(b.u), from.u, to.u, Some(a.u)), v: middle(Some(b.v), from.v, to.v, Some(a.v)) },
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
    /// Positions, where the nodes are a key's.
    uv: &'w [u32],
    from: usize,
    to: usize,
    /// Where `seek` goes on.
    next: usize,
}

impl<'w> Walk<'w> {
    /// A walk over nodes whose layers start at `starts`, with one entry more than there are nodes; before the first of them.
    fn new(starts: &'w [u16], labels: &'w [u8], uv: &'w [u32]) -> Self {
        let mut ends = starts.iter();
        let to = ends.next().map_or(0, |&at| usize::from(at));
        Self { ends, labels, uv, from: to, to, next: to }
    }

    /// On to the next node; past the last there is one without layers.
    #[inline]
    pub fn step(&mut self) {
        self.from = self.to;
        if let Some(&end) = self.ends.next() {
            self.to = usize::from(end);
        }
        self.next = self.from;
    }

    /// Like `find`, for labels that are asked for in ascending order, as nodes have them.
    #[inline(always)]
    fn seek(&mut self, label: u8) -> Option<usize> {
        while self.next < self.to {
            match self.labels.get(self.next) {
                Some(&other) if other < label => self.next = self.next.wrapping_add(1),
                Some(&other) if other == label => return Some(self.next),
                _ => break,
            }
        }
        None
    }

    /// Whether the next node has one layer.
    #[inline(always)]
    fn single(&self) -> bool {
        self.ends.as_slice().first().is_some_and(|&end| usize::from(end) == self.to.wrapping_add(1))
    }

    /// Where the layers of the next `most` nodes end.
    fn ends(&self, most: usize) -> &'w [u16] {
        self.ends.as_slice().get(..most).unwrap_or(&[])
    }

    /// The positions from the next node's on.
    fn coming(&self) -> &'w [u32] {
        self.uv.get(self.to..).unwrap_or(&[])
    }

    /// On to the `nodes`-th node from here, all of which have one layer.
    fn jump(&mut self, nodes: usize) {
        self.ends = self.ends.as_slice().get(nodes..).unwrap_or(&[]).iter();
        self.to = self.to.wrapping_add(nodes);
        self.from = self.to.wrapping_sub(1);
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
    /// Fraction bits of coordinates in keys.
    pub key_bits: u32,
}

impl Around<'_, '_> {
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

/// The sum of `four` positions times `weights`, in Q15.16, rounded to nearest, ties up; exact where one weight is one. Coordinates of
/// `key_bits` fraction bits start at [`KEY_MIN`], and as the weights sum to one, so does the sum.
#[inline(always)]
const fn blend(four: [KeyUv; 4], [a, b, c, d]: Weights, key_bits: u32) -> Layer {
    let drop = key_bits.wrapping_add(WEIGHT_BITS).wrapping_sub(PLAY_BITS);
    let start = (KEY_MIN << WEIGHT_BITS).wrapping_add(1i32.wrapping_shl(drop) >> 1);
    let [e, f, g, h] = four;
    // Magnitudes of weights sum to at most 1.6, stored coordinates are below 2^16: the sums fit.
    let u = start.wrapping_add(a.wrapping_mul((e.0 & 0xffff) as i32)).wrapping_add(b.wrapping_mul((f.0 & 0xffff) as i32));
    let u = u.wrapping_add(c.wrapping_mul((g.0 & 0xffff) as i32)).wrapping_add(d.wrapping_mul((h.0 & 0xffff) as i32));
    let v = start.wrapping_add(a.wrapping_mul((e.0 >> 16) as i32)).wrapping_add(b.wrapping_mul((f.0 >> 16) as i32));
    let v = v.wrapping_add(c.wrapping_mul((g.0 >> 16) as i32)).wrapping_add(d.wrapping_mul((h.0 >> 16) as i32));
    Layer { u: u.wrapping_shr(drop), v: v.wrapping_shr(drop) }
}

/// A walk over the `columns` nodes of `key` from node `first` on; over none without a key.
fn enter<'k>(key: Option<&'k Key<'_>>, first: usize, columns: usize) -> Walk<'k> {
    let slices = key.and_then(|key| Some((key.start.get(first..=first.wrapping_add(columns))?, &*key.label, &*key.uv)));
    let (starts, labels, uv) = slices.unwrap_or_default();
    Walk::new(starts, labels, uv)
}

/// No layer: see [`NodeRow::right`].
const NONE: u16 = 0x7fff;
/// A layer of the same label is at the node to the left.
const LEFT: u16 = 0x8000;

/// The partner that `link` names: the layer of the same label at the node to the right.
#[must_use]
#[inline]
pub const fn partner(link: u16) -> Option<u16> {
    let index = link & !LEFT;
    if index == NONE { None } else { Some(index) }
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
    /// Each layer's partner: which layer of the node to the right has the same label, [`NONE`] if none has; and [`LEFT`].
    pub right: &'m mut [u16],
    /// Where space is cubic, the positions halfway between each layer and its partner.
    pub middle: &'m mut [Layer],
    /// Fields, Q8 pixels; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
}

/// A row of nodes that is being filled, from left to right.
struct Filling<'f> {
    start: &'f mut [u16],
    label: &'f mut [u8],
    layer: &'f mut [Layer],
    right: &'f mut [u16],
    field: &'f mut [[i16; 2]],
    /// Layers so far; those of the node before the current one start at `before`, its own at `from`.
    count: usize,
    before: usize,
    from: usize,
}

impl<'f> Filling<'f> {
    fn new(row: &'f mut NodeRow<'_>) -> Self {
        // Links have 15 bits; all slices are as long as this one.
        let NodeRow { start, label, layer, right, field, .. } = row;
        Self { start, label, layer, right, field, count: 0, before: 0, from: 0 }
    }

    /// Begins the node in `column`.
    #[inline(always)]
    fn begin(&mut self, column: usize) {
        if let Some(start) = self.start.get_mut(column) {
            *start = self.count as u16;
        }
        (self.before, self.from) = (self.from, self.count);
    }

    /// Puts a layer, if there is room; its fields where the bundle has such; and links it with its partner at the node before.
    #[inline(always)]
    fn put(&mut self, label: u8, layer: Layer, field: impl FnOnce() -> [i16; 2]) {
        let count = self.count;
        if count >= usize::from(NONE) {
            return;
        }
        let (Some(label_slot), Some(layer_slot)) = (self.label.get_mut(count), self.layer.get_mut(count)) else { return };
        (*label_slot, *layer_slot) = (label, layer);
        if let Some(slot) = self.field.get_mut(count) {
            *slot = field();
        }
        if let Some(slot) = self.right.get_mut(count) {
            *slot = NONE;
        }
        self.join(count);
        self.count = count.wrapping_add(1);
    }

    /// Puts what `layer` says for as many nodes from the one in `column` on as have a single layer of one label in all four `walks`, `most` at most;
    /// the walks step along. Returns how many nodes that were. Most nodes of most pictures are of this kind.
    #[inline(always)]
    fn stretch(&mut self, column: usize, most: usize, walks: [&mut Walk<'_>; 4], layer: impl Fn(usize) -> Option<Layer>) -> usize {
        let [a, b, c, d] = walks;
        let count = self.count;
        // In front of nodes stands where their layers end.
        let upcoming = |walk: &Walk<'_>| walk.ends.as_slice().len().min(walk.labels.len().saturating_sub(walk.to));
        let room = self.label.len().min(self.layer.len()).min(self.right.len()).min(usize::from(NONE)).saturating_sub(count);
        let most = most.min(room).min(self.start.len().saturating_sub(column));
        let most = most.min(upcoming(a)).min(upcoming(b)).min(upcoming(c)).min(upcoming(d));
        let (ends_a, ends_b, ends_c, ends_d) = (a.ends(most), b.ends(most), c.ends(most), d.ends(most));
        let Some(labels_a) = a.labels.get(a.to..a.to.wrapping_add(most)) else { return 0 };
        let Some(labels_b) = b.labels.get(b.to..b.to.wrapping_add(most)) else { return 0 };
        let Some(labels_c) = c.labels.get(c.to..c.to.wrapping_add(most)) else { return 0 };
        let Some(labels_d) = d.labels.get(d.to..d.to.wrapping_add(most)) else { return 0 };
        let (before, from) = (self.from, self.count);
        let until = count.wrapping_add(most);
        let Some(starts) = self.start.get_mut(column..column.wrapping_add(most)) else { return 0 };
        let (Some(label_slots), Some(layer_slots)) = (self.label.get_mut(count..until), self.layer.get_mut(count..until)) else { return 0 };
        let Some(links) = self.right.get_mut(count..until) else { return 0 };
        // The first one's partner may be any layer of the node before.
        let (mut label_before, mut link) = (None, NONE);
        let mut done = 0usize;
        while done < most {
            let passed = done.wrapping_add(1);
            let one = |ends: &[u16], to: usize| ends.get(done).is_some_and(|&end| usize::from(end).wrapping_sub(to) == passed);
            if !(one(ends_a, a.to) && one(ends_b, b.to) && one(ends_c, c.to) && one(ends_d, d.to)) {
                break;
            }
            let Some(&label) = labels_b.get(done) else { break };
            let same = |labels: &[u8]| labels.get(done) == Some(&label);
            if !(same(labels_a) && same(labels_c) && same(labels_d)) {
                break;
            }
            let Some(layer) = layer(done) else { break };
            let index = count.wrapping_add(done) as u16;
            let (Some(start), Some(label_slot), Some(layer_slot)) =
                (starts.get_mut(done), label_slots.get_mut(done), layer_slots.get_mut(done))
            else {
                break;
            };
            (*start, *label_slot, *layer_slot) = (index, label, layer);
            let partner = label_before == Some(label);
            if let Some(left) = links.get_mut(done.wrapping_sub(1)) {
                *left = if partner { link & LEFT | index } else { link };
            }
            link = if partner { LEFT | NONE } else { NONE };
            label_before = Some(label);
            done = passed;
        }
        if done == 0 {
            return 0;
        }
        if let Some(last) = links.get_mut(done.wrapping_sub(1)) {
            *last = link;
        }
        for walk in [a, b, c, d] {
            walk.jump(done);
        }
        self.count = count.wrapping_add(done);
        (self.before, self.from) = (before, from);
        self.join(count);
        self.from = self.count.wrapping_sub(1);
        done
    }

    /// Links layer `index` with its partner at the node before.
    #[inline(always)]
    fn join(&mut self, index: usize) {
        let Some(&label) = self.label.get(index) else { return };
        let mut partner = self.before;
        // Most often the first one is it.
        while partner < self.from {
            if self.label.get(partner) == Some(&label) {
                if let Some(left) = self.right.get_mut(partner) {
                    *left = *left & LEFT | index as u16;
                }
                if let Some(slot) = self.right.get_mut(index) {
                    *slot |= LEFT;
                }
                return;
            }
            partner = partner.wrapping_add(1);
        }
    }

    /// Ends the row after `columns` nodes; returns how many layers it has.
    fn end(mut self, columns: usize) -> usize {
        self.begin(columns);
        self.count
    }
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
        let (linear, key_bits) = (moment.linear, keys.key_bits);
        let columns = grid.node_columns();
        let first = row.wrapping_mul(columns);
        let (mut from, mut to) = (enter(Some(keys.from), first, columns), enter(Some(keys.to), first, columns));
        let (mut before, mut after) = (enter(keys.before, first, columns), enter(keys.after, first, columns));
        let [both, no_first, no_last, neither] = &moment.weights;
        // Where there is no outer key, its weight is none: any other does in its place.
        let whole = match (keys.before, keys.after) {
            (Some(_), Some(_)) => both,
            (None, Some(_)) => no_first,
            (Some(_), None) => no_last,
            (None, None) => neither,
        };
        let mut row = Filling::new(self);
        let mut column = 0usize;
        while column < columns {
            if from.single() && to.single() {
                let (mut instead_before, mut instead_after) = (from.clone(), to.clone());
                let first = if keys.before.is_some() { &mut before } else { &mut instead_before };
                let last = if keys.after.is_some() { &mut after } else { &mut instead_after };
                let most = columns.wrapping_sub(column);
                let (leave, arrive, filled) = (from.to, to.to, row.count);
                let uv = [&*first, &from, &to, &*last].map(|walk| walk.coming());
                let [a, b, c, d] = uv;
                let layer = |index: usize| {
                    let at = |uv: &[u32]| uv.get(index).map(|&uv| KeyUv(uv));
                    Some(blend([at(a)?, at(b)?, at(c)?, at(d)?], *whole, key_bits))
                };
                let done = row.stretch(column, most, [first, &mut from, &mut to, last], layer);
                for index in 0..done {
                    let Some(slot) = row.field.get_mut(filled.wrapping_add(index)) else { break };
                    *slot = keys.field([leave.wrapping_add(index), arrive.wrapping_add(index)], linear);
                }
                column = column.wrapping_add(done);
                if done > 0 {
                    continue;
                }
            }
            row.begin(column);
            from.step();
            to.step();
            before.step();
            after.step();
            for index in from.from..from.to {
                let Some(&label) = from.labels.get(index) else { break };
                let Some(other) = to.seek(label) else { continue };
                let at = |key: &Walk<'_>, index: usize| KeyUv(key.uv.get(index).copied().unwrap_or(0));
                let (leave, arrive) = (before.seek(label), after.seek(label));
                let [middle, next] = [at(&from, index), at(&to, other)];
                let layer = match (leave, arrive) {
                    (Some(a), Some(b)) => blend([at(&before, a), middle, next, at(&after, b)], *both, key_bits),
                    (None, Some(b)) => blend([KeyUv(0), middle, next, at(&after, b)], *no_first, key_bits),
                    (Some(a), None) => blend([at(&before, a), middle, next, KeyUv(0)], *no_last, key_bits),
                    (None, None) => blend([KeyUv(0), middle, next, KeyUv(0)], *neither, key_bits),
                };
                row.put(label, layer, || keys.field([index, other], linear));
            }
            column = column.wrapping_add(1);
        }
        let count = row.end(columns);
        self.halve(count);
        count as u32
    }

    /// Fills the row with what lies halfway between rows `from` and `to`, where both carry it; `before` and `after` are the rows
    /// around these. Returns how many layers there are.
    #[inline(never)]
    pub fn between(&mut self, columns: usize, [before, from, to, after]: [&NodeRow<'_>; 4]) -> u32 {
        let [mut first, mut upper, mut lower, mut last] = [before, from, to, after].map(NodeRow::walk);
        let [first_layers, upper_layers, lower_layers, last_layers] = [before, from, to, after].map(|row| &*row.layer);
        let mut row = Filling::new(self);
        let mut column = 0usize;
        while column < columns {
            if upper.single() && lower.single() {
                let most = columns.wrapping_sub(column);
                let cut = [(first_layers, &first), (upper_layers, &upper), (lower_layers, &lower), (last_layers, &last)]
                    .map(|(layers, walk)| layers.get(walk.to..).unwrap_or(&[]));
                let [a, b, c, d] = cut;
                let layer = |index: usize| {
                    let at = |layers: &[Layer]| layers.get(index).copied();
                    Some(Layer::middle(Some(at(a)?), at(b)?, at(c)?, Some(at(d)?)))
                };
                let done = row.stretch(column, most, [&mut first, &mut upper, &mut lower, &mut last], layer);
                column = column.wrapping_add(done);
                if done > 0 {
                    continue;
                }
            }
            row.begin(column);
            first.step();
            upper.step();
            lower.step();
            last.step();
            for index in upper.from..upper.to {
                let Some(&label) = upper.labels.get(index) else { break };
                let Some(below) = lower.seek(label) else { continue };
                let above = first.seek(label).and_then(|at| first_layers.get(at));
                let under = last.seek(label).and_then(|at| last_layers.get(at));
                let (Some(&here), Some(&there)) = (upper_layers.get(index), lower_layers.get(below)) else { break };
                // Fields are straight from node to node: nothing asks for them here.
                row.put(label, Layer::middle(above.copied(), here, there, under.copied()), || [0; 2]);
            }
            column = column.wrapping_add(1);
        }
        let count = row.end(columns);
        self.halve(count);
        count as u32
    }

    /// A walk over the row's nodes.
    #[must_use]
    pub fn walk(&self) -> Walk<'_> {
        Walk::new(self.start, self.label, &[])
    }

    /// Works out what lies halfway between each of `count` layers and its partner, where there is room for it.
    #[inline(never)]
    fn halve(&mut self, count: usize) {
        let (Some(links), Some(layers)) = (self.right.get(..count), self.layer.get(..count)) else { return };
        let Some(middles) = self.middle.get_mut(..count) else { return };
        for (start, link) in links.iter().enumerate() {
            // Chains of partners start where there is none to the left.
            if link & LEFT != 0 {
                continue;
            }
            let Some(&first) = layers.get(start) else { break };
            let mut index = start;
            let (mut before, mut from) = (None, first);
            let mut partner = usize::from(link & !LEFT);
            let mut next = layers.get(partner);
            while let Some(&to) = next {
                let beyond = links.get(partner).map_or(usize::MAX, |link| usize::from(link & !LEFT));
                next = layers.get(beyond);
                if let Some(slot) = middles.get_mut(index) {
                    *slot = Layer::middle(before, from, to, next.copied());
                }
                (before, from) = (Some(from), to);
                (index, partner) = (partner, beyond);
            }
        }
    }

    /// Every layer's link to its partner: see [`partner`].
    #[must_use]
    pub const fn links(&self) -> &[u16] {
        self.right
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::{KEY_BITS, KEY_MAX};

    #[test]
    fn blend_is_exact_at_the_keys_and_keeps_constants() {
        for bits in KEY_BITS.map(u32::from) {
            let at = |u: i32, v: i32| KeyUv::new(u, v);
            let (far, scale) = ([at(KEY_MIN, KEY_MAX), at(1, 2), at(KEY_MAX, KEY_MIN), at(-3, 4)], PLAY_BITS - bits);
            let alone = [[ONE, 0, 0, 0], [0, ONE, 0, 0], [0, 0, ONE, 0], [0, 0, 0, ONE]];
            for (weights, key) in alone.into_iter().zip(far) {
                let Layer { u, v } = blend(far, weights, bits);
                assert_eq!([u, v], [key.u() << scale, key.v() << scale]);
            }
            let Layer { u, v } = blend([at(1234, -77); 4], [-700, ONE - 300, 1700, -700], bits);
            assert_eq!([u, v], [1234 << scale, -(77 << scale)]);
        }
    }
}
