//! A row of nodes at one moment: its layers interpolated in time, or halfway between two such rows.
//! Keys come from the caller's memory, rows go to `sheet`.

use crate::fixed::{KEY_MIN, KeyUv, ONE, PLAY_BITS, PlayUv, WEIGHT_BITS, field_distance, middle};
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

/// Steps through the nodes of a key's row, from left to right.
#[derive(Clone, Debug)]
struct Walk<'w> {
    /// Where the layers of the nodes to come end.
    ends: &'w [u16],
    labels: &'w [u8],
    uv: &'w [u32],
    from: usize,
    to: usize,
    /// Where `seek` goes on.
    next: usize,
}

impl<'w> Walk<'w> {
    /// Over the `columns` nodes of `key` from node `first` on, before the first of them; over none without a key.
    fn new(key: Option<&'w Key<'_>>, first: usize, columns: usize) -> Self {
        let starts = key.and_then(|key| key.start.get(first..=first.wrapping_add(columns))?.split_first());
        let (to, ends) = starts.map_or((0, &[][..]), |(&at, ends)| (usize::from(at), ends));
        let (labels, uv) = key.map_or((&[][..], &[][..]), |key| (&*key.label, &*key.uv));
        Self { ends, labels, uv, from: to, to, next: to }
    }

    /// On to the next node; past the last there is one without layers.
    #[inline(always)]
    fn step(&mut self) {
        self.from = self.to;
        if let Some((&end, ends)) = self.ends.split_first() {
            (self.to, self.ends) = (usize::from(end), ends);
        }
        self.next = self.from;
    }

    /// The index of the node's layer of `label`; labels are asked for in ascending order, as nodes have them.
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

    /// How many of the next `most` nodes carry a layer of `label` and nothing else, up to the first that does not.
    #[inline(always)]
    fn alone(&self, label: u8, most: usize) -> usize {
        let labels = self.labels.get(self.to..).unwrap_or(&[]);
        let mut count = 0usize;
        for (&end, &other) in self.ends.iter().zip(labels).take(most) {
            let next = count.wrapping_add(1);
            if other != label || usize::from(end) != self.to.wrapping_add(next) {
                break;
            }
            count = next;
        }
        count
    }

    /// The positions of the next `nodes` nodes, which have one each.
    #[inline(always)]
    fn coming(&self, nodes: usize) -> &'w [u32] {
        self.uv.get(self.to..self.to.wrapping_add(nodes)).unwrap_or(&[])
    }

    /// Past the next `nodes` nodes, which have a layer each.
    #[inline(always)]
    fn jump(&mut self, nodes: usize) {
        self.ends = self.ends.get(nodes..).unwrap_or(&[]);
        self.to = self.to.wrapping_add(nodes);
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
    #[inline(always)]
    fn field(&self, [from, to]: [usize; 2], linear: i32) -> [i16; 2] {
        let [a, b] = &self.from.fields;
        let [c, d] = &self.to.fields;
        let code = |codes: &[i8], index: usize| codes.get(index).copied().unwrap_or(0);
        let [a, b, c, d] = [code(a, from), code(b, from), code(c, to), code(d, to)];
        // Most layers are never tested, and have none.
        if a | b | c | d == 0 { [0; 2] } else { [mix(a, c, linear), mix(b, d, linear)] }
    }
}

/// The field between those that two codes stand for, Q8 pixels.
#[inline(never)]
fn mix(from: i8, to: i8, linear: i32) -> i16 {
    // Distances are at most 2^15 and weights 2^14: the sums fit.
    let (from, to) = (field_distance(from), field_distance(to));
    let sum = from.wrapping_mul(ONE.wrapping_sub(linear)).wrapping_add(to.wrapping_mul(linear));
    // The largest distance, 2^15, is one more than 16 bits hold.
    (sum >> WEIGHT_BITS).clamp(-32_767, 32_767) as i16
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

/// No chain.
const NONE: u16 = u16::MAX;

/// Layers of one label at neighbouring nodes of a row, one at each, which stand side by side in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Chain {
    /// The first node, and the one after the last.
    first: u16,
    end: u16,
    /// The first layer.
    at: u16,
    /// The next chain of the label to the right; [`NONE`]: this is the last.
    next: u16,
    label: u16,
}

impl Chain {
    /// The first layer and those after it.
    #[inline(always)]
    fn of<'l, T>(&self, layers: &'l [T]) -> &'l [T] {
        layers.get(usize::from(self.at)..).and_then(|layers| layers.get(..self.nodes())).unwrap_or(&[])
    }

    fn nodes(&self) -> usize {
        usize::from(self.end.wrapping_sub(self.first))
    }
}

/// One row of nodes at one moment, in caller's memory: label by label, in chains.
#[derive(Debug)]
pub struct NodeRow<'m> {
    /// The chains, and how many there are.
    pub chain: &'m mut [Chain],
    /// How many there are.
    pub chains: usize,
    /// The first chain of every label, from the left; [`NONE`]: there is none.
    pub head: &'m mut [u16],
    /// Positions, Q15.16 texels, chain by chain.
    pub layer: &'m mut [Layer],
    /// Where space is cubic, the positions halfway between each layer and the next one of its chain.
    pub middle: &'m mut [Layer],
    /// Fields, Q8 pixels; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
}

/// Where a row's layers are collected node by node, in caller's memory: as much room as a row has.
#[derive(Debug)]
pub struct Collected<'m> {
    /// How many layers follow on each other in one chain, and in which.
    pub piece: &'m mut [[u16; 2]],
    /// Positions.
    pub layer: &'m mut [Layer],
    /// Fields; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
}

/// A row of nodes that is being filled, from left to right.
struct Filling<'f, 'm> {
    row: &'f mut NodeRow<'m>,
    collected: &'f mut Collected<'m>,
    pieces: usize,
    /// Layers so far.
    count: usize,
}

impl Filling<'_, '_> {
    /// Layers that there is room for.
    fn room(&self) -> usize {
        self.collected.layer.len().min(self.row.layer.len()).saturating_sub(self.count)
    }

    /// The next `nodes` layers collected are of `label`, one at each node from `column` on; false where there is no room for a chain.
    #[inline(always)]
    fn put(&mut self, label: u8, column: usize, nodes: usize) -> bool {
        let Some(last) = self.row.head.get_mut(usize::from(label)) else { return false };
        let end = column.wrapping_add(nodes) as u16;
        let chain = match self.row.chain.get_mut(usize::from(*last)) {
            Some(chain) if chain.end == column as u16 => {
                chain.end = end;
                *last
            }
            _ => {
                let new = self.row.chains as u16;
                let Some(slot) = self.row.chain.get_mut(self.row.chains) else { return false };
                *slot = Chain { first: column as u16, end, at: 0, next: NONE, label: label.into() };
                self.row.chains = self.row.chains.wrapping_add(1);
                *last = new;
                new
            }
        };
        self.count = self.count.wrapping_add(nodes);
        if let Some([length, other]) = self.collected.piece.get_mut(self.pieces.wrapping_sub(1))
            && *other == chain
        {
            *length = length.wrapping_add(nodes as u16);
        } else if let Some(slot) = self.collected.piece.get_mut(self.pieces) {
            *slot = [nodes as u16, chain];
            self.pieces = self.pieces.wrapping_add(1);
        }
        true
    }

    /// Puts what was collected into chains.
    fn end(self) {
        let Self { row, collected, pieces, .. } = self;
        let chains = row.chain.get_mut(..row.chains).unwrap_or(&mut []);
        let mut at = 0u16;
        for chain in &mut *chains {
            // Until chains are linked, `next` is where the chain's next layer goes.
            (chain.at, chain.next) = (at, at);
            at = at.wrapping_add(chain.nodes() as u16);
        }
        let mut from = 0usize;
        for &[length, chain] in collected.piece.get(..pieces).unwrap_or(&[]) {
            let Some(chain) = chains.get_mut(usize::from(chain)) else { break };
            let (to, length) = (usize::from(chain.next), usize::from(length));
            chain.next = chain.next.wrapping_add(length as u16);
            let next = from.wrapping_add(length);
            copy(&mut *row.layer, to, collected.layer.get(from..next));
            copy(&mut *row.field, to, collected.field.get(from..next));
            from = next;
        }
        row.link();
    }
}

/// Copies `from` to `target`, from its element `to` on.
#[inline(always)]
fn copy<T: Copy>(target: &mut [T], to: usize, from: Option<&[T]>) {
    // Most are a few: a loop takes less than a call.
    for (slot, &value) in target.get_mut(to..).unwrap_or(&mut []).iter_mut().zip(from.unwrap_or(&[])) {
        *slot = value;
    }
}

impl<'m> NodeRow<'m> {
    /// Fills the row with the layers that both ends of the interval carry in row `row` of the grid's nodes, weighted; with none
    /// outside the grid. Returns how many there are.
    #[inline(never)]
    pub fn fill(&mut self, collected: &mut Collected<'m>, grid: Grid, row: Option<usize>, keys: &Around<'_, '_>, moment: &Moment) -> u32 {
        self.head.fill(NONE);
        self.chains = 0;
        let Some(row) = row.filter(|&row| row < grid.node_rows()) else { return 0 };
        let (linear, key_bits) = (moment.linear, keys.key_bits);
        let columns = grid.node_columns();
        let first = row.wrapping_mul(columns);
        let [mut before, mut from, mut to, mut after] =
            [keys.before, Some(keys.from), Some(keys.to), keys.after].map(|key| Walk::new(key, first, columns));
        let [both, no_first, no_last, neither] = &moment.weights;
        // Where there is no outer key, its weight is none: any other does in its place.
        let whole = match (keys.before, keys.after) {
            (Some(_), Some(_)) => both,
            (None, Some(_)) => no_first,
            (Some(_), None) => no_last,
            (None, None) => neither,
        };
        let mut row = Filling { row: self, collected, pieces: 0, count: 0 };
        let mut column = 0usize;
        while column < columns {
            // Most nodes of most pictures carry one layer, of the same label as the node before.
            if let Some(&label) = from.labels.get(from.to) {
                let most = columns.wrapping_sub(column).min(row.room());
                let most = to.alone(label, from.alone(label, most));
                let most = if keys.before.is_some() { before.alone(label, most) } else { most };
                let most = if keys.after.is_some() { after.alone(label, most) } else { most };
                if most > 0 {
                    let [b, c] = [from.coming(most), to.coming(most)];
                    let a = if keys.before.is_some() { before.coming(most) } else { b };
                    let d = if keys.after.is_some() { after.coming(most) } else { c };
                    let start = row.count;
                    let slots = row.collected.layer.get_mut(start..).unwrap_or(&mut []);
                    for (slot, ((&a, &b), (&c, &d))) in slots.iter_mut().zip(a.iter().zip(b).zip(c.iter().zip(d))) {
                        *slot = blend([a, b, c, d].map(KeyUv), *whole, key_bits);
                    }
                    let slots = row.collected.field.get_mut(start..).unwrap_or(&mut []);
                    for (index, slot) in slots.iter_mut().take(most).enumerate() {
                        *slot = keys.field([from.to.wrapping_add(index), to.to.wrapping_add(index)], linear);
                    }
                    if !row.put(label, column, most) {
                        break;
                    }
                    for walk in [&mut before, &mut from, &mut to, &mut after] {
                        walk.jump(most);
                    }
                    column = column.wrapping_add(most);
                    continue;
                }
            }
            for walk in [&mut before, &mut from, &mut to, &mut after] {
                walk.step();
            }
            for index in from.from..from.to {
                let Some(&label) = from.labels.get(index) else { break };
                let Some(other) = to.seek(label) else { continue };
                let at = |key: &Walk<'_>, index: usize| KeyUv(key.uv.get(index).copied().unwrap_or(0));
                let (leave, arrive) = (before.seek(label), after.seek(label));
                let [middle, next] = [at(&from, index), at(&to, other)];
                // An outer key that has none weighs nothing.
                let (first, last) = (leave.map_or(middle, |a| at(&before, a)), arrive.map_or(next, |b| at(&after, b)));
                let weights = match (leave.is_some(), arrive.is_some()) {
                    (true, true) => both,
                    (false, true) => no_first,
                    (true, false) => no_last,
                    (false, false) => neither,
                };
                let count = row.count;
                if row.room() == 0 || !row.put(label, column, 1) {
                    break;
                }
                if let Some(slot) = row.collected.layer.get_mut(count) {
                    *slot = blend([first, middle, next, last], *weights, key_bits);
                }
                if let Some(slot) = row.collected.field.get_mut(count) {
                    *slot = keys.field([index, other], linear);
                }
            }
            column = column.wrapping_add(1);
        }
        let count = row.count;
        row.end();
        self.halve();
        count as u32
    }

    /// Fills the row with what lies halfway between rows `from` and `to`, where both carry it; `before` and `after` are the rows
    /// around these. Returns how many layers there are.
    #[inline(never)]
    pub fn between(&mut self, [before, from, to, after]: [&NodeRow<'_>; 4]) -> u32 {
        self.head.fill(NONE);
        self.chains = 0;
        let mut count = 0usize;
        for upper in from.chain.get(..from.chains).unwrap_or(&[]) {
            let mut next = to.head.get(usize::from(upper.label)).copied().unwrap_or(NONE);
            while let Some(lower) = to.chain.get(usize::from(next)) {
                next = lower.next;
                let (first, end) = (upper.first.max(lower.first), upper.end.min(lower.end));
                if first >= end {
                    continue;
                }
                let Some(slot) = self.chain.get_mut(self.chains) else { break };
                *slot = Chain { first, end, at: count as u16, next: NONE, label: upper.label };
                self.chains = self.chains.wrapping_add(1);
                let Some(slots) = self.layer.get_mut(count..).and_then(|layers| layers.get_mut(..slot.nodes())) else { break };
                count = count.wrapping_add(slots.len());
                let (mut slots, mut column) = (slots, first);
                let mut from = cut(upper, from.layer, first);
                let mut to = cut(lower, to.layer, first);
                while !slots.is_empty() {
                    let ((above, high), (below, low)) = (before.part(upper.label, column), after.part(upper.label, column));
                    let stop = end.min(high).min(low);
                    let length = usize::from(stop.wrapping_sub(column));
                    let (some, rest) = slots.split_at_mut(slots.len().min(length));
                    let Some(((here, from_rest), (there, to_rest))) = from.split_at_checked(length).zip(to.split_at_checked(length)) else { break };
                    middles(some, here, there, above, below);
                    (slots, from, to, column) = (rest, from_rest, to_rest, stop);
                }
            }
        }
        self.link();
        self.halve();
        count as u32
    }

    /// The layers of `label` from node `column` on, and the node where that ends: that they do, or that there are none. Where there are none,
    /// the slice is empty.
    fn part(&self, label: u16, column: u16) -> (&[Layer], u16) {
        let mut next = self.head.get(usize::from(label)).copied().unwrap_or(NONE);
        while let Some(chain) = self.chain.get(usize::from(next)) {
            if column < chain.first {
                return (&[], chain.first);
            }
            if column < chain.end {
                return (cut(chain, self.layer, column), chain.end);
            }
            next = chain.next;
        }
        (&[], u16::MAX)
    }

    /// Links the chains of each label, from left to right.
    fn link(&mut self) {
        let chains = self.chain.get_mut(..self.chains).unwrap_or(&mut []);
        for chain in &*chains {
            if let Some(head) = self.head.get_mut(usize::from(chain.label)) {
                *head = NONE;
            }
        }
        for (index, chain) in chains.iter_mut().enumerate().rev() {
            if let Some(head) = self.head.get_mut(usize::from(chain.label)) {
                (chain.next, *head) = (*head, index as u16);
            }
        }
    }

    /// Works out what lies halfway between each layer and the next one of its chain, where there is room for it.
    #[inline(never)]
    fn halve(&mut self) {
        let mut middles = &mut *self.middle;
        if middles.is_empty() {
            return;
        }
        for chain in self.chain.get(..self.chains).unwrap_or(&[]) {
            let layers = chain.of(self.layer);
            let Some((slots, rest)) = middles.split_at_mut_checked(layers.len()) else { break };
            middles = rest;
            let [first, second, layers @ ..] = layers else { continue };
            let (mut before, mut from, mut to) = (None, *first, *second);
            let mut slots = slots.iter_mut();
            for &after in layers {
                let Some(slot) = slots.next() else { break };
                *slot = Layer::middle(before, from, to, Some(after));
                (before, from, to) = (Some(from), to, after);
            }
            if let Some(slot) = slots.next() {
                *slot = Layer::middle(before, from, to, None);
            }
        }
    }

    /// Where the layers of `label` at node `column` and at the one to the right of it stand, and how many of its chain are to the right; `None` where there is none.
    #[must_use]
    pub fn find(&self, label: u8, column: usize) -> Option<[u16; 2]> {
        let column = column as u16;
        let mut next = *self.head.get(usize::from(label))?;
        while let Some(chain) = self.chain.get(usize::from(next)) {
            if column.wrapping_add(1) < chain.end {
                let along = column.checked_sub(chain.first)?;
                return Some([chain.at.wrapping_add(along), chain.end.wrapping_sub(column).wrapping_sub(1)]);
            }
            next = chain.next;
        }
        None
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

    /// What lies halfway from layer `index` to the next one of its chain.
    #[must_use]
    #[inline]
    pub fn halfway(&self, index: u16) -> Layer {
        self.middle.get(usize::from(index)).copied().unwrap_or_default()
    }
}

/// The layers of `chain` from node `column` on, which it has.
fn cut<'l>(chain: &Chain, layers: &'l [Layer], column: u16) -> &'l [Layer] {
    chain.of(layers).get(usize::from(column.wrapping_sub(chain.first))..).unwrap_or(&[])
}

/// Fills `slots` with what lies halfway between `from` and `to`; `before` and `after` are what comes before and after, or empty.
fn middles(slots: &mut [Layer], from: &[Layer], to: &[Layer], before: &[Layer], after: &[Layer]) {
    let inner = slots.iter_mut().zip(from.iter().zip(to));
    match (before.is_empty(), after.is_empty()) {
        (false, false) => {
            for ((slot, (&from, &to)), (&before, &after)) in inner.zip(before.iter().zip(after)) {
                *slot = Layer::middle(Some(before), from, to, Some(after));
            }
        }
        (false, true) => {
            for ((slot, (&from, &to)), &before) in inner.zip(before) {
                *slot = Layer::middle(Some(before), from, to, None);
            }
        }
        (true, false) => {
            for ((slot, (&from, &to)), &after) in inner.zip(after) {
                *slot = Layer::middle(None, from, to, Some(after));
            }
        }
        (true, true) => {
            for (slot, (&from, &to)) in inner {
                *slot = Layer::middle(None, from, to, None);
            }
        }
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
