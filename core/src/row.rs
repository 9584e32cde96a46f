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

/// No layer, no chain.
const NONE: u16 = u16::MAX;

/// A layer of a row of nodes, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Point {
    /// The layer.
    pub at: Layer,
    /// Where space is cubic, what is halfway to the next one of its chain.
    pub middle: Layer,
}

/// Steps through the nodes of a key's row, from left to right.
#[derive(Clone, Copy, Debug)]
struct Walk<'w> {
    /// Where the layers of the nodes to come end.
    ends: &'w [u16],
    labels: &'w [u8],
    /// The first layer of the node that `seek` has not passed, and where the node's end.
    next: u16,
    to: u16,
}

impl<'w> Walk<'w> {
    /// Over the `columns` nodes of `key` from node `first` on, before the first of them; over none without a key.
    fn new(key: Option<&'w Key<'_>>, first: usize, columns: usize) -> Self {
        let starts = key.and_then(|key| key.start.get(first..=first.wrapping_add(columns))?.split_first());
        let (to, ends) = starts.map_or((0, &[][..]), |(&at, ends)| (at, ends));
        Self { ends, labels: key.map_or(&[], |key| &*key.label), next: to, to }
    }

    /// On to the next node; past the last there is one without layers.
    #[inline(always)]
    fn step(&mut self) {
        self.next = self.to;
        if let Some((&end, ends)) = self.ends.split_first() {
            (self.to, self.ends) = (end, ends);
        }
    }

    /// The label that `seek` has come to.
    #[inline(always)]
    fn label(&self) -> Option<u8> {
        if self.next < self.to { self.labels.get(usize::from(self.next)).copied() } else { None }
    }

    /// The index of the node's layer of `label`, or [`NONE`]; labels are asked for in ascending order, as nodes have them.
    #[inline(always)]
    fn seek(&mut self, label: u8) -> u16 {
        while let Some(other) = self.label() {
            if other >= label {
                return if other == label { self.next } else { NONE };
            }
            self.next = self.next.wrapping_add(1);
        }
        NONE
    }

    /// How many of the next `most` nodes carry a layer of `label` and nothing else, up to the first that does not.
    #[inline(never)]
    fn alone(&self, label: u8, most: usize) -> usize {
        let labels = self.labels.get(usize::from(self.to)..).unwrap_or(&[]);
        let mut count = 0usize;
        let mut to = self.to;
        for (&end, &other) in self.ends.iter().zip(labels).take(most) {
            to = to.wrapping_add(1);
            if other != label || end != to {
                break;
            }
            count = count.wrapping_add(1);
        }
        count
    }

    /// Past the next `nodes` nodes, which have a layer each.
    #[inline(always)]
    fn jump(&mut self, nodes: usize) {
        self.ends = self.ends.get(nodes..).unwrap_or(&[]);
        self.to = self.to.wrapping_add(nodes as u16);
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
    fn of<'l>(&self, points: &'l [Point]) -> &'l [Point] {
        points.get(usize::from(self.at)..).and_then(|points| points.get(..self.nodes())).unwrap_or(&[])
    }

    fn nodes(&self) -> usize {
        usize::from(self.end.wrapping_sub(self.first))
    }
}

/// One row of nodes at one moment, in caller's memory: label by label, in chains.
#[derive(Debug)]
pub struct NodeRow<'m> {
    /// The chains.
    pub chain: &'m mut [Chain],
    /// How many there are.
    pub chains: usize,
    /// The first chain of every label, from the left; [`NONE`]: there is none.
    pub head: &'m mut [u16],
    /// Positions, Q15.16 texels, chain by chain.
    pub point: &'m mut [Point],
    /// Space is cubic: what is halfway between points is wanted.
    pub cubic: bool,
    /// Fields, Q8 pixels; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
}

/// Layers of one label at neighbouring nodes, in caller's memory, one at each, which stand side by side in every key that carries them.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Piece {
    /// Where in each key that there is; [`NONE`]: nowhere, which only outer keys may say.
    at: [u16; 4],
    /// How many.
    nodes: u16,
    /// The chain that they are part of.
    chain: u16,
}

/// A row of nodes that is being filled, from left to right.
struct Filling<'f, 'm> {
    row: &'f mut NodeRow<'m>,
    pieces: &'f mut [Piece],
    /// Pieces so far.
    count: usize,
    /// Layers that there is room for.
    room: usize,
}

impl Filling<'_, '_> {
    /// Puts layers of `label`, one at each of `nodes` nodes from `column` on.
    #[inline(always)]
    fn put(&mut self, label: u8, column: u16, nodes: u16, at: [u16; 4]) {
        let Some(left) = self.room.checked_sub(nodes.into()) else { return };
        let Some(last) = self.row.head.get_mut(usize::from(label)) else { return };
        let Some(piece) = self.pieces.get_mut(self.count) else { return };
        let end = column.wrapping_add(nodes);
        match self.row.chain.get_mut(usize::from(*last)) {
            Some(chain) if chain.end == column => chain.end = end,
            _ => {
                let Some(slot) = self.row.chain.get_mut(self.row.chains) else { return };
                *slot = Chain { first: column, end, at: 0, next: NONE, label: label.into() };
                *last = self.row.chains as u16;
                self.row.chains = self.row.chains.wrapping_add(1);
            }
        }
        *piece = Piece { at, nodes, chain: *last };
        (self.count, self.room) = (self.count.wrapping_add(1), left);
    }

    /// Finds the layers that both ends of the interval carry in the row of `columns` nodes from node `first` on; returns the pieces.
    #[inline(never)]
    fn gather(mut self, keys: &Around<'_, '_>, first: usize, columns: usize) -> usize {
        let [mut before, mut from, mut to, mut after] =
            [keys.before, Some(keys.from), Some(keys.to), keys.after].map(|key| Walk::new(key, first, columns));
        let mut column = 0usize;
        while column < columns {
            // Most nodes of most pictures carry one layer, of the same label as the node before.
            if let Some(&label) = from.labels.get(usize::from(from.to))
                && from.ends.first() == Some(&from.to.wrapping_add(1))
            {
                let mut most = columns.wrapping_sub(column);
                for (walk, wanted) in [(&from, true), (&to, true), (&before, keys.before.is_some()), (&after, keys.after.is_some())] {
                    most = if wanted && most > 0 { walk.alone(label, most) } else { most };
                }
                if most > 0 {
                    self.put(label, column as u16, most as u16, [before.to, from.to, to.to, after.to]);
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
            while let Some(label) = from.label() {
                let index = from.next;
                from.next = from.next.wrapping_add(1);
                let other = to.seek(label);
                if other != NONE {
                    self.put(label, column as u16, 1, [before.seek(label), index, other, after.seek(label)]);
                }
            }
            column = column.wrapping_add(1);
        }
        self.count
    }
}

impl<'m> NodeRow<'m> {
    /// Fills the row with the layers that both ends of the interval carry in row `row` of the grid's nodes, weighted; with none
    /// outside the grid. Returns how many there are. `pieces` is room for as many as there are layers.
    pub fn fill(&mut self, pieces: &mut [Piece], grid: Grid, row: Option<usize>, keys: &Around<'_, '_>, moment: &Moment) -> u32 {
        self.head.fill(NONE);
        self.chains = 0;
        let Some(row) = row.filter(|&row| row < grid.node_rows()) else { return 0 };
        let columns = grid.node_columns();
        let room = self.point.len().min(usize::from(NONE));
        let filling = Filling { row: self, pieces: &mut *pieces, count: 0, room };
        let count = filling.gather(keys, row.wrapping_mul(columns), columns);
        let mut at = 0u16;
        for chain in self.chain.get_mut(..self.chains).unwrap_or(&mut []) {
            // Until chains are linked, `next` is where the chain's next layer goes.
            (chain.at, chain.next) = (at, at);
            at = at.wrapping_add(chain.nodes() as u16);
        }
        self.weigh(pieces.get(..count).unwrap_or(&[]), keys, moment);
        self.link();
        self.halve();
        at.into()
    }

    /// Works out the layers of `pieces`.
    #[inline(never)]
    fn weigh(&mut self, pieces: &[Piece], keys: &Around<'_, '_>, moment: &Moment) {
        let [both, no_first, no_last, neither] = &moment.weights;
        let chains = self.chain.get_mut(..self.chains).unwrap_or(&mut []);
        let [start, end] = [keys.before, keys.after].map(|key| key.map_or(&[][..], |key| &*key.uv));
        let (from, to) = (&*keys.from.uv, &*keys.to.uv);
        for piece in pieces {
            let Some(chain) = chains.get_mut(usize::from(piece.chain)) else { break };
            let place = usize::from(chain.next);
            chain.next = chain.next.wrapping_add(piece.nodes);
            let [mut a, mut b, mut c, mut d] = piece.at.map(usize::from);
            let weights = match (a < start.len(), d < end.len()) {
                (true, true) => both,
                (false, true) => no_first,
                (true, false) => no_last,
                (false, false) => neither,
            };
            for slot in self.point.get_mut(place..).unwrap_or(&mut []).iter_mut().take(usize::from(piece.nodes)) {
                // An outer key that has none weighs nothing.
                let [first, last] = [(start, a), (end, d)].map(|(uv, at)| KeyUv(uv.get(at).copied().unwrap_or(0)));
                let (Some(&leave), Some(&arrive)) = (from.get(b), to.get(c)) else { break };
                slot.at = blend([first, KeyUv(leave), KeyUv(arrive), last], *weights, keys.key_bits);
                [a, b, c, d] = [a, b, c, d].map(|at| at.wrapping_add(1));
            }
        }
        if !self.field.is_empty() {
            self.distances(pieces, keys, moment.linear);
        }
    }

    /// Works out the fields of `pieces`.
    #[inline(never)]
    fn distances(&mut self, pieces: &[Piece], keys: &Around<'_, '_>, linear: i32) {
        let chains = self.chain.get_mut(..self.chains).unwrap_or(&mut []);
        for chain in &mut *chains {
            chain.next = chain.at;
        }
        for piece in pieces {
            let Some(chain) = chains.get_mut(usize::from(piece.chain)) else { break };
            let place = usize::from(chain.next);
            chain.next = chain.next.wrapping_add(piece.nodes);
            let [_, mut from, mut to, _] = piece.at.map(usize::from);
            for slot in self.field.get_mut(place..).unwrap_or(&mut []).iter_mut().take(usize::from(piece.nodes)) {
                *slot = keys.field([from, to], linear);
                (from, to) = (from.wrapping_add(1), to.wrapping_add(1));
            }
        }
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
                let Some(slots) = self.point.get_mut(count..).and_then(|points| points.get_mut(..slot.nodes())) else { break };
                count = count.wrapping_add(slots.len());
                let (mut slots, mut column) = (slots, first);
                let mut from = cut(upper, from.point, first);
                let mut to = cut(lower, to.point, first);
                while !slots.is_empty() {
                    let ((above, high), (below, low)) = (before.part(upper.label, column), after.part(upper.label, column));
                    let stop = end.min(high).min(low);
                    let length = usize::from(stop.wrapping_sub(column));
                    let (some, rest) = slots.split_at_mut(slots.len().min(length));
                    let Some(((here, from_rest), (there, to_rest))) = from.split_at_checked(length).zip(to.split_at_checked(length)) else {
                        break;
                    };
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
    fn part(&self, label: u16, column: u16) -> (&[Point], u16) {
        let mut next = self.head.get(usize::from(label)).copied().unwrap_or(NONE);
        while let Some(chain) = self.chain.get(usize::from(next)) {
            if column < chain.first {
                return (&[], chain.first);
            }
            if column < chain.end {
                return (cut(chain, self.point, column), chain.end);
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

    /// Works out what lies halfway between each layer and the next one of its chain, where that is wanted.
    #[inline(never)]
    fn halve(&mut self) {
        if !self.cubic {
            return;
        }
        let mut points = &mut *self.point;
        for chain in self.chain.get(..self.chains).unwrap_or(&[]) {
            let Some((mine, rest)) = points.split_at_mut_checked(chain.nodes()) else { break };
            points = rest;
            // Each point waits for two more.
            let mut mine = mine.iter_mut();
            let (Some(mut last), Some(mut here)) = (mine.next(), mine.next()) else { continue };
            let mut before = None;
            for next in mine {
                last.middle = Layer::middle(before, last.at, here.at, Some(next.at));
                before = Some(last.at);
                (last, here) = (here, next);
            }
            last.middle = Layer::middle(before, last.at, here.at, None);
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

    /// The fields of layer `index` and of the next one of its chain; those of layers that show everywhere where the bundle has none.
    #[must_use]
    #[inline(always)]
    pub fn fields(&self, index: u16) -> [[i16; 2]; 2] {
        self.field.get(usize::from(index)..).and_then(<[_]>::first_chunk).copied().unwrap_or([[1, 1]; 2])
    }

    /// Layer `index` and the next one of its chain.
    #[must_use]
    #[inline(always)]
    pub fn pair(&self, index: u16) -> &[Point; 2] {
        const NONE: &[Point; 2] = &[Point { at: Layer { u: 0, v: 0 }, middle: Layer { u: 0, v: 0 } }; 2];
        self.point.get(usize::from(index)..).and_then(<[_]>::first_chunk).unwrap_or(NONE)
    }
}

/// The layers of `chain` from node `column` on, which it has.
fn cut<'l>(chain: &Chain, points: &'l [Point], column: u16) -> &'l [Point] {
    chain.of(points).get(usize::from(column.wrapping_sub(chain.first))..).unwrap_or(&[])
}

/// Fills `slots` with what lies halfway between `from` and `to`; `before` and `after` are what comes before and after, or empty.
fn middles(slots: &mut [Point], from: &[Point], to: &[Point], before: &[Point], after: &[Point]) {
    let inner = slots.iter_mut().zip(from.iter().zip(to));
    match (before.is_empty(), after.is_empty()) {
        (false, false) => {
            for ((slot, (from, to)), (before, after)) in inner.zip(before.iter().zip(after)) {
                slot.at = Layer::middle(Some(before.at), from.at, to.at, Some(after.at));
            }
        }
        (false, true) => {
            for ((slot, (from, to)), before) in inner.zip(before) {
                slot.at = Layer::middle(Some(before.at), from.at, to.at, None);
            }
        }
        (true, false) => {
            for ((slot, (from, to)), after) in inner.zip(after) {
                slot.at = Layer::middle(None, from.at, to.at, Some(after.at));
            }
        }
        (true, true) => {
            for (slot, (from, to)) in inner {
                slot.at = Layer::middle(None, from.at, to.at, None);
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
