//! A row of nodes at one moment: its layers interpolated in time, or halfway between two such rows.
//! Keys come from the caller's memory, rows go to `sheet`.

use crate::fixed::{KEY_MIN, KeyUv, ONE, PLAY_BITS, PlayUv, WEIGHT_BITS, field_distance, middle};
use crate::format::LabelRecord;
use crate::grid::Grid;
use crate::key::{self, BACKDROP, Chain, Key, NONE};
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

/// Where space is cubic, a layer and what is halfway to the next one of its chain.
type Pair = [Layer; 2];

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
    /// The backdrop, where there is one: keys have no positions of it.
    pub backdrop: Option<&'k LabelRecord>,
}

/// The field between those that two codes stand for, Q8 pixels.
#[inline(always)]
fn mix(from: i8, to: i8, linear: i32) -> i16 {
    // Distances are at most 2^15 and weights 2^14: the sums fit.
    let (from, to) = (field_distance(from), field_distance(to));
    let sum = from.wrapping_mul(ONE.wrapping_sub(linear)).wrapping_add(to.wrapping_mul(linear));
    // The largest distance, 2^15, is one more than 16 bits hold.
    (sum >> WEIGHT_BITS).clamp(-32_767, 32_767) as i16
}

/// Fills `slots`, which are zero, with the fields between those that the codes `from` and `to` stand for, where there are such; no codes: zeros.
#[inline(always)]
fn straight<'s>(slots: impl Iterator<Item = &'s mut i16>, from: &[i8], to: &[i8], linear: i32) {
    let put = |slot: &mut i16, from: i8, to: i8| {
        if from | to != 0 {
            *slot = mix(from, to, linear);
        }
    };
    match (from, to) {
        ([], _) => slots.zip(to).for_each(|(slot, &to)| put(slot, 0, to)),
        (_, []) => slots.zip(from).for_each(|(slot, &from)| put(slot, from, 0)),
        _ => slots.zip(from.iter().zip(to)).for_each(|(slot, (&from, &to))| put(slot, from, to)),
    }
}

/// Fills every EVERY-th of `slots`, from the first on, with what `four` keys' positions make with these `weights`.
#[inline(never)]
fn blend_all<const EVERY: usize>(slots: &mut [Layer], [a, b, c, d]: [&[u32]; 4], weights: Weights, key_bits: u32) {
    let slots = slots.as_chunks_mut::<EVERY>().0.iter_mut().filter_map(|slots| slots.first_mut());
    let keys = a.iter().zip(b).zip(c.iter().zip(d));
    for (slot, ((&a, &b), (&c, &d))) in slots.zip(keys) {
        *slot = blend([KeyUv(a), KeyUv(b), KeyUv(c), KeyUv(d)], weights, key_bits);
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

/// A row's chains, gone through by label and from left to right, beside those of another.
#[derive(Clone, Copy)]
struct Beside<'k> {
    chains: &'k [Chain],
}

impl<'k> Beside<'k> {
    fn of(key: Option<&'k Key<'_>>, row: usize) -> Self {
        Self { chains: key.map_or(&[], |key| key.chains(row)) }
    }

    /// The chain of `label` at node `column` or the first to the right of it. Labels, and columns of one label, are asked for in ascending order.
    #[inline(always)]
    fn from(&mut self, label: u16, column: u16) -> Option<&'k Chain> {
        while let Some((chain, rest)) = self.chains.split_first() {
            if chain.label > label {
                break;
            }
            if chain.label == label && chain.end > column {
                return Some(chain);
            }
            self.chains = rest;
        }
        None
    }

    /// Where in `of` the layers of `label` from node `column` on stand, and the node where that ends: that they do, or that there are none.
    #[inline(always)]
    fn part<T>(&mut self, of: &'k [T], label: u16, column: u16) -> (Option<&'k [T]>, u16) {
        match self.from(label, column) {
            Some(chain) if chain.first <= column => {
                let from = usize::from(chain.at.wrapping_add(column.wrapping_sub(chain.first)));
                (of.get(from..), chain.end)
            }
            Some(chain) => (None, chain.first),
            None => (None, NONE),
        }
    }
}

/// One row of nodes at one moment, in caller's memory: label by label, in chains.
#[derive(Debug, Default)]
pub struct NodeRow<'m> {
    /// The chains.
    pub chain: &'m mut [Chain],
    /// How many there are.
    pub chains: usize,
    /// The first chain of every label; [`NONE`]: there is none. The others follow it, from left to right.
    pub head: &'m mut [u16],
    /// Positions, Q15.16 texels, chain by chain; where space is cubic, each followed by what is halfway to the next one of its chain.
    pub layer: &'m mut [Layer],
    /// Space is cubic.
    pub cubic: bool,
    /// The backdrop is one position: nothing has to be worked out halfway.
    pub plain: bool,
    /// Fields, Q8 pixels; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
}

impl NodeRow<'_> {
    fn clear(&mut self) {
        self.head.fill(NONE);
        self.chains = 0;
    }

    /// Opens a chain of `label` at nodes `first` to `end`, whose layers stand from `at` on; `None` where there is no room.
    #[inline(always)]
    fn open(&mut self, label: u16, first: u16, end: u16, at: usize) -> Option<Chain> {
        let chain = Chain { first, end, at: at as u16, field: NONE, label };
        let held = self.layer.len().wrapping_shr(self.cubic.into());
        let room = at.wrapping_add(chain.nodes().into()) <= held.min(usize::from(NONE));
        let slot = self.chain.get_mut(self.chains).filter(|_| room)?;
        let head = self.head.get_mut(usize::from(label))?;
        *slot = chain;
        if *head == NONE {
            *head = self.chains as u16;
        }
        self.chains = self.chains.wrapping_add(1);
        Some(chain)
    }

    /// Fills the row with the layers that both ends of the interval carry in row `row` of the grid's nodes, weighted; with none
    /// outside the grid. Returns how many there are.
    #[inline(never)]
    pub fn fill(&mut self, grid: Grid, row: Option<usize>, keys: &Around<'_, '_>, moment: &Moment) -> u32 {
        self.clear();
        let Some(row) = row.filter(|&row| row < grid.node_rows()) else { return 0 };
        let [mut before, from, mut to, mut after] =
            [keys.before, Some(keys.from), Some(keys.to), keys.after].map(|key| Beside::of(key, row));
        let mut count = 0usize;
        for start in from.chains {
            let mut column = start.first;
            while let Some(end) = to.from(start.label, column).filter(|end| end.first < start.end) {
                let (first, stop) = (column.max(end.first), start.end.min(end.end));
                let Some(chain) = self.open(start.label, first, stop, count) else { return count as u32 };
                match keys.backdrop {
                    Some(record) if chain.label == BACKDROP => self.stand(chain, record, grid, row, keys.key_bits),
                    _ => self.weigh(chain, [start, end], keys, moment, [&mut before, &mut after]),
                }
                self.distances(chain, [start, end], keys, moment.linear);
                count = count.wrapping_add(chain.nodes().into());
                column = stop;
                if column >= start.end {
                    break;
                }
            }
        }
        self.halve();
        count as u32
    }

    /// Fills in the layers of the backdrop's `chain`, which stands still.
    #[inline(never)]
    fn stand(&mut self, chain: Chain, record: &LabelRecord, grid: Grid, row: usize, key_bits: u32) {
        let (plain, every) = (self.plain, if self.cubic { 2 } else { 1 });
        let slots = self.of(&chain);
        let layer = |column: u16| {
            let PlayUv { u, v } = key::backdrop(record, [column, row as u16], grid.log2, key_bits);
            Layer { u, v }
        };
        if plain {
            slots.fill(layer(0));
            return;
        }
        for (slot, column) in slots.iter_mut().step_by(every).zip(chain.first..) {
            *slot = layer(column);
        }
    }

    /// Works out the layers of `chain`, which are in both `ends` of the interval; outer keys that lack one weigh nothing.
    #[inline(always)]
    fn weigh<'k>(
        &mut self,
        chain: Chain,
        [start, end]: [&Chain; 2],
        keys: &Around<'k, '_>,
        moment: &Moment,
        [before, after]: [&mut Beside<'k>; 2],
    ) {
        let [both, no_first, no_last, neither] = &moment.weights;
        let cubic = self.cubic;
        let mut slots = self.of(&chain);
        let layers = |key: &Key<'_>, of: &Chain| usize::from(of.at.wrapping_add(chain.first.wrapping_sub(of.first))).min(key.uv.len());
        let mut from = keys.from.uv.get(layers(keys.from, start)..).unwrap_or(&[]);
        let mut to = keys.to.uv.get(layers(keys.to, end)..).unwrap_or(&[]);
        let mut column = chain.first;
        while !slots.is_empty() {
            let (first, high) = before.part(keys.before.map_or(&[], |key| &*key.uv), chain.label, column);
            let (last, low) = after.part(keys.after.map_or(&[], |key| &*key.uv), chain.label, column);
            let stop = chain.end.min(high).min(low);
            let nodes = usize::from(stop.wrapping_sub(column)).min(slots.len().wrapping_shr(cubic.into()));
            let weights = match (first, last) {
                (Some(_), Some(_)) => both,
                (None, Some(_)) => no_first,
                (Some(_), None) => no_last,
                (None, None) => neither,
            };
            let (some, others) = slots.split_at_mut(nodes.wrapping_shl(cubic.into()).min(slots.len()));
            let four = [first.unwrap_or(from), from, to, last.unwrap_or(to)];
            if cubic {
                blend_all::<2>(some, four, *weights, keys.key_bits);
            } else {
                blend_all::<1>(some, four, *weights, keys.key_bits);
            }
            (slots, column) = (others, stop);
            (from, to) = (from.get(nodes..).unwrap_or(&[]), to.get(nodes..).unwrap_or(&[]));
            // A chain of no nodes, which only a broken bundle has, ends the row.
            if nodes == 0 {
                break;
            }
        }
    }

    /// Works out the fields of `chain`, which is in both `ends` of the interval: straight between them, Q8 pixels.
    #[inline(always)]
    fn distances(&mut self, chain: Chain, ends: [&Chain; 2], keys: &Around<'_, '_>, linear: i32) {
        let slots = self.field.get_mut(usize::from(chain.at)..).unwrap_or(&mut []);
        let slots = slots.get_mut(..chain.nodes().into()).unwrap_or(&mut []);
        slots.fill([0; 2]);
        // Most chains are never tested, and have none.
        if ends.iter().all(|end| end.field == NONE) {
            return;
        }
        let [from, to] = [(keys.from, ends[0]), (keys.to, ends[1])].map(|(key, end)| {
            let first = usize::from(end.field).wrapping_add(chain.first.wrapping_sub(end.first).into());
            let [a, b] = &key.fields;
            [a, b].map(|codes| codes.get(first..).filter(|_| end.field != NONE).unwrap_or(&[]))
        });
        let ([a, b], [c, d]) = (from, to);
        straight(slots.iter_mut().map(|[field, _]| field), a, c, linear);
        straight(slots.iter_mut().map(|[_, field]| field), b, d, linear);
    }

    /// Fills the row with what lies halfway between rows `from` and `to`, where both carry it; `before` and `after` are the rows
    /// around these. Space is cubic. Returns how many layers there are.
    #[inline(never)]
    pub fn between(&mut self, rows: [&NodeRow<'_>; 4]) -> u32 {
        self.clear();
        let [mut above, from, mut lower, mut below] = rows.map(NodeRow::chains);
        let [before, upper, bottom, after] = rows.map(NodeRow::pairs);
        let plain = self.plain;
        let mut count = 0usize;
        for start in from.chains {
            let mut column = start.first;
            while let Some(end) = lower.from(start.label, column).filter(|end| end.first < start.end) {
                let (first, stop) = (column.max(end.first), start.end.min(end.end));
                let Some(chain) = self.open(start.label, first, stop, count) else { return count as u32 };
                let mut slots = self.of(&chain).as_chunks_mut::<2>().0;
                count = count.wrapping_add(slots.len());
                column = first;
                if plain && chain.label == BACKDROP {
                    slots.fill(upper.get(usize::from(start.at)).copied().unwrap_or_default());
                    slots = &mut [];
                }
                let mut here = cut(start, upper, first);
                let mut there = cut(end, bottom, first);
                while !slots.is_empty() {
                    let (high, top) = above.part(before, chain.label, column);
                    let (low, end) = below.part(after, chain.label, column);
                    let next = stop.min(top).min(end);
                    let length = usize::from(next.wrapping_sub(column));
                    let (some, rest) = slots.split_at_mut(slots.len().min(length));
                    let Some(((a, here_rest), (b, there_rest))) = here.split_at_checked(length).zip(there.split_at_checked(length)) else {
                        break;
                    };
                    middles(some, a, b, high, low);
                    (slots, here, there, column) = (rest, here_rest, there_rest, next);
                    if length == 0 {
                        break;
                    }
                }
                column = stop;
                if column >= start.end {
                    break;
                }
            }
        }
        self.halve();
        count as u32
    }

    fn chains(&self) -> Beside<'_> {
        Beside { chains: self.chain.get(..self.chains).unwrap_or(&[]) }
    }

    /// Works out what lies halfway between each layer and the next one of its chain, where that is wanted.
    #[inline(never)]
    fn halve(&mut self) {
        if !self.cubic {
            return;
        }
        let mut points = self.layer.as_chunks_mut::<2>().0;
        for chain in self.chain.get(..self.chains).unwrap_or(&[]) {
            let Some((mine, rest)) = points.split_at_mut_checked(chain.nodes().into()) else { break };
            points = rest;
            if self.plain && chain.label == BACKDROP {
                continue;
            }
            // Each point waits for two more.
            let mut mine = mine.iter_mut();
            let (Some(mut last), Some(mut here)) = (mine.next(), mine.next()) else { continue };
            let mut before = None;
            for next in mine {
                last[1] = Layer::middle(before, last[0], here[0], Some(next[0]));
                before = Some(last[0]);
                (last, here) = (here, next);
            }
            last[1] = Layer::middle(before, last[0], here[0], None);
        }
    }

    /// Where the layers of `label` at node `column` and at the one to the right of it stand, and how many of its chain are to the right; `None` where there is none.
    #[must_use]
    pub fn find(&self, label: u8, column: usize) -> Option<[u16; 2]> {
        let (column, label) = (column as u16, u16::from(label));
        let chains = self.chain.get(..self.chains)?;
        let mut place = usize::from(*self.head.get(usize::from(label))?);
        loop {
            let chain = chains.get(place).filter(|chain| chain.label == label)?;
            if column.wrapping_add(1) < chain.end {
                let along = column.checked_sub(chain.first)?;
                return Some([chain.at.wrapping_add(along), chain.end.wrapping_sub(column).wrapping_sub(1)]);
            }
            place = place.wrapping_add(1);
        }
    }

    /// The fields of layer `index` and of the next one of its chain; those of layers that show everywhere where the bundle has none.
    #[must_use]
    #[inline(always)]
    pub fn fields(&self, index: u16) -> [[i16; 2]; 2] {
        self.field.get(usize::from(index)..).and_then(<[_]>::first_chunk).copied().unwrap_or([[1, 1]; 2])
    }

    /// Layer `index` and the next one of its chain, where space is linear.
    #[must_use]
    #[inline(always)]
    pub fn ends(&self, index: u16) -> &[Layer; 2] {
        const NONE: &[Layer; 2] = &[Layer { u: 0, v: 0 }; 2];
        self.layer.get(usize::from(index)..).and_then(<[_]>::first_chunk).unwrap_or(NONE)
    }

    /// Layer `index`, what is halfway to the next one of its chain, and that one, where space is cubic.
    #[must_use]
    #[inline(always)]
    pub fn thirds(&self, index: u16) -> &[Layer; 3] {
        const NONE: &[Layer; 3] = &[Layer { u: 0, v: 0 }; 3];
        self.layer.get(usize::from(index).wrapping_mul(2)..).and_then(<[_]>::first_chunk).unwrap_or(NONE)
    }

    /// Layer `index` and all that come after it, as they stand.
    #[must_use]
    pub fn from(&self, index: u16) -> &[Layer] {
        self.layer.get(usize::from(index).wrapping_shl(self.cubic.into())..).unwrap_or(&[])
    }

    /// The slots of `chain`.
    #[inline(always)]
    fn of(&mut self, chain: &Chain) -> &mut [Layer] {
        let log2 = u32::from(self.cubic);
        let slots = self.layer.get_mut(usize::from(chain.at).wrapping_shl(log2)..).unwrap_or(&mut []);
        slots.get_mut(..usize::from(chain.nodes()).wrapping_shl(log2)).unwrap_or(&mut [])
    }

    /// Where space is cubic, each layer and what is halfway to the next one.
    fn pairs(&self) -> &[Pair] {
        self.layer.as_chunks().0
    }
}

/// The layers of `chain` from node `column` on, which it has.
fn cut<'l>(chain: &Chain, points: &'l [Pair], column: u16) -> &'l [Pair] {
    let all = points.get(usize::from(chain.at)..).and_then(|points| points.get(..chain.nodes().into())).unwrap_or(&[]);
    all.get(usize::from(column.wrapping_sub(chain.first))..).unwrap_or(&[])
}

/// Fills `slots` with what lies halfway between `from` and `to`; `before` and `after` are what comes before and after, where there is such.
fn middles(slots: &mut [Pair], from: &[Pair], to: &[Pair], before: Option<&[Pair]>, after: Option<&[Pair]>) {
    let inner = slots.iter_mut().zip(from.iter().zip(to));
    match (before, after) {
        (Some(before), Some(after)) => {
            for ((slot, (from, to)), (before, after)) in inner.zip(before.iter().zip(after)) {
                slot[0] = Layer::middle(Some(before[0]), from[0], to[0], Some(after[0]));
            }
        }
        (Some(before), None) => {
            for ((slot, (from, to)), before) in inner.zip(before) {
                slot[0] = Layer::middle(Some(before[0]), from[0], to[0], None);
            }
        }
        (None, Some(after)) => {
            for ((slot, (from, to)), after) in inner.zip(after) {
                slot[0] = Layer::middle(None, from[0], to[0], Some(after[0]));
            }
        }
        (None, None) => {
            for (slot, (from, to)) in inner {
                slot[0] = Layer::middle(None, from[0], to[0], None);
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
