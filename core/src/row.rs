//! A row of nodes at one moment: its layers interpolated in time, and how they bend from node to node.
//! Keys come from the caller's memory, rows go to `sheet`.

use crate::fixed::{KEY_MIDDLE, KeyUv, ONE, PLAY_BITS, PlayUv, WEIGHT_BITS, field_distance};
use crate::format::LabelRecord;
use crate::grid::Grid;
use crate::key::{self, BACKDROP, Chain, Key, NONE};
use crate::timeline::{Moment, WeightSet, Weights};

/// A layer at one moment: a [`PlayUv`] in caller's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Layer {
    u: i32,
    v: i32,
}

impl Layer {
    const ZERO: Self = Self { u: 0, v: 0 };

    /// The position.
    #[must_use]
    #[inline(always)]
    pub const fn uv(self) -> PlayUv {
        PlayUv { u: self.u, v: self.v }
    }

    /// How much less than this `other` is.
    #[inline(always)]
    const fn less(self, other: Self) -> Self {
        Self { u: self.u.wrapping_sub(other.u), v: self.v.wrapping_sub(other.v) }
    }

    /// How far it is to the `next` one. What that changes by from one to the next is the second difference of the three.
    #[inline(always)]
    const fn step(self, next: Self) -> Self {
        next.less(self)
    }
}

/// A layer at its node and how it bends there, in caller's memory. Second differences of positions, Q15.16 texels: where it has no neighbour on one
/// side, those of the one on the other.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Node {
    /// Where it is.
    pub layer: Layer,
    /// The second difference of those to the left and to the right.
    pub across: Layer,
    /// Of those above and below.
    pub down: Layer,
}

/// What a row holds of a layer: where it is, and, if space is cubic, how it bends.
pub trait Place: Copy {
    /// Where it is.
    fn layer(&self) -> Layer;

    /// Its second differences, across and down.
    fn bends(&self) -> [Layer; 2];

    /// A layer that bends nowhere.
    fn flat(layer: Layer) -> Self;

    /// Puts it there; how it bends is still to be told.
    fn put(&mut self, layer: Layer);
}

impl Place for Layer {
    #[inline(always)]
    fn layer(&self) -> Layer {
        *self
    }

    #[inline(always)]
    fn bends(&self) -> [Layer; 2] {
        [Self::ZERO; 2]
    }

    #[inline(always)]
    fn flat(layer: Layer) -> Self {
        layer
    }

    #[inline(always)]
    fn put(&mut self, layer: Layer) {
        *self = layer;
    }
}

impl Place for Node {
    #[inline(always)]
    fn layer(&self) -> Layer {
        self.layer
    }

    #[inline(always)]
    fn bends(&self) -> [Layer; 2] {
        [self.across, self.down]
    }

    #[inline(always)]
    fn flat(layer: Layer) -> Self {
        Self { layer, across: Layer::ZERO, down: Layer::ZERO }
    }

    #[inline(always)]
    fn put(&mut self, layer: Layer) {
        self.layer = layer;
    }
}

/// [`Node::down`] where there is no row above: the next row tells.
const UNTOLD: Layer = Layer { u: i32::MIN, v: i32::MIN };
/// What a row's chain with such nodes has instead of a place for fields: a row's fields stand where its layers do.
const UNTOLD_HERE: u16 = 0;

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

/// The sum of `four` positions times `weights`, in Q15.16, rounded to nearest, ties up; exact where one weight is one. Coordinates of
/// `key_bits` fraction bits are stored from [`KEY_MIDDLE`] on, and as the weights sum to one, so is the sum.
#[inline(always)]
fn blend(four: [KeyUv; 4], weights: Weights, key_bits: u32) -> Layer {
    let drop = key_bits.wrapping_add(WEIGHT_BITS).wrapping_sub(PLAY_BITS);
    let start = (KEY_MIDDLE << WEIGHT_BITS).wrapping_add(1i32.wrapping_shl(drop) >> 1);
    // Magnitudes of weights sum to at most 1.6, what is stored is at most 2^15: weights fit 16 bits, and the sums fit. Half a word times half a word, and
    // the sum so far, are one instruction of larger processors.
    let sum = |half: fn(u32) -> i16| {
        let products = weights.into_iter().zip(four).map(|(weight, uv)| i32::from(weight as i16).wrapping_mul(half(uv.0).into()));
        products.fold(start, i32::wrapping_add).wrapping_shr(drop)
    };
    Layer { u: sum(|both| both as i16), v: sum(|both| (both >> 16) as i16) }
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

    /// Where the layers of `label` from node `column` on stand, and the node where that ends: that they do, or that there are none.
    #[inline(always)]
    fn part(&mut self, label: u16, column: u16) -> (Option<usize>, u16) {
        match self.from(label, column) {
            Some(chain) if chain.first <= column => (Some(chain.along(column)), chain.end),
            Some(chain) => (None, chain.first),
            None => (None, NONE),
        }
    }
}

/// Fills `slots` with the layers of the backdrop, which stands still, from node `column` of row `row` on.
#[inline(never)]
fn stand<T: Place>(slots: &mut [T], record: &LabelRecord, [column, row]: [u16; 2], log2: u32, key_bits: u32) {
    let layer = |column: u16| {
        let PlayUv { u, v } = key::backdrop(record, [column, row], log2, key_bits);
        T::flat(Layer { u, v })
    };
    if record.plain() {
        slots.fill(layer(0));
        return;
    }
    for (slot, column) in slots.iter_mut().zip(column..) {
        *slot = layer(column);
    }
}

/// An outer key's row, gone through beside the interval's: its chains, and the positions they are about.
#[derive(Clone, Copy)]
struct Outer<'k> {
    beside: Beside<'k>,
    uv: &'k [u32],
}

impl<'k> Outer<'k> {
    fn of(key: Option<&'k Key<'_>>, row: usize) -> Self {
        Self { beside: Beside::of(key, row), uv: key.map_or(&[], |key| key.uv) }
    }

    /// The positions of `label` from node `column` on, and the node where that ends: that they are, or that there are none.
    #[inline(always)]
    fn part(&mut self, label: u16, column: u16) -> (Option<&'k [u32]>, u16) {
        let (at, end) = self.beside.part(label, column);
        (at.and_then(|at| self.uv.get(at..)), end)
    }
}

/// Fills `slots` with the layers of `chain`, which stand from `ends` on in both ends of the interval; outer keys that lack one weigh nothing.
#[inline(never)]
fn weigh<'k, T: Place>(
    mut slots: &mut [T],
    chain: &Chain,
    ends: [usize; 2],
    keys: &Around<'k, '_>,
    weights: &WeightSet,
    [before, after]: &mut [Outer<'k>; 2],
) {
    let layers = |key: &'k Key<'_>, at: usize| key.uv.get(at..).unwrap_or(&[]);
    let ([from, to], mut column) = (ends, chain.first);
    let (mut from, mut to) = (layers(keys.from, from), layers(keys.to, to));
    while !slots.is_empty() {
        let (first, high) = before.part(chain.label, column);
        let (last, low) = after.part(chain.label, column);
        let stop = chain.end.min(high).min(low);
        let (some, others) = slots.split_at_mut(usize::from(stop.wrapping_sub(column)).min(slots.len()));
        let missing = usize::from(first.is_none()) | usize::from(last.is_none()) << 1;
        let Some(weights) = weights.get(missing) else { break };
        let (first, last, nodes) = (first.unwrap_or(from), last.unwrap_or(to), some.len());
        for (slot, ((&a, &b), (&c, &d))) in some.iter_mut().zip(first.iter().zip(from).zip(to.iter().zip(last))) {
            slot.put(blend([KeyUv(a), KeyUv(b), KeyUv(c), KeyUv(d)], *weights, keys.key_bits));
        }
        (slots, column) = (others, stop);
        (from, to) = (from.get(nodes..).unwrap_or(&[]), to.get(nodes..).unwrap_or(&[]));
        // A chain of no nodes, which only a broken bundle has, ends the row.
        if nodes == 0 {
            break;
        }
    }
}

/// Works out how the nodes `here` bend down, between those above and below them.
#[inline(always)]
fn bend_between(here: &mut [Node], upper: &[Node], lower: &[Node]) {
    for ((here, upper), lower) in here.iter_mut().zip(upper).zip(lower) {
        here.down = here.layer.step(lower.layer).less(upper.layer.step(here.layer));
    }
}

/// Those of the nodes `upper` that had none above themselves bend as those `here`, below them, do.
#[inline(never)]
fn tell(upper: &mut [Node], here: &[Node]) {
    for (upper, here) in upper.iter_mut().zip(here).filter(|(upper, _)| upper.down.u == UNTOLD.u) {
        upper.down = here.down;
    }
}

/// Likewise where there are none below: they bend as those above do.
#[inline(always)]
fn bend_on(here: &mut [Node], upper: &mut [Node]) {
    for (here, upper) in here.iter_mut().zip(upper) {
        if upper.down.u == UNTOLD.u {
            upper.down = Layer::ZERO;
        }
        here.down = upper.down;
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
    /// The layers, chain by chain, where space is cubic,
    pub node: &'m mut [Node],
    /// and where it is linear: the other one is empty.
    pub layer: &'m mut [Layer],
    /// There is a backdrop, which bends nowhere.
    pub still: bool,
    /// Fields, Q8 pixels; empty where the bundle has none.
    pub field: &'m mut [[i16; 2]],
    /// How many of these may be other than zero.
    pub told: u16,
}

impl NodeRow<'_> {
    fn clear(&mut self) {
        self.head.fill(NONE);
        // All others are zero already.
        self.field.get_mut(..self.told.into()).unwrap_or_default().fill([0; 2]);
        (self.chains, self.told) = (0, 0);
    }

    /// Opens a chain of `label` at nodes `first` to `end`, whose layers stand from `at` on; `None` where there is no room.
    #[inline(always)]
    fn open(&mut self, label: u16, first: u16, end: u16, at: usize) -> Option<Chain> {
        let chain = Chain { first, end, at: at as u16, field: NONE, label };
        let room = at.wrapping_add(chain.nodes().into()) <= self.node.len().max(self.layer.len()).min(usize::from(NONE));
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
        let [from, mut to] = [keys.from, keys.to].map(|key| Beside::of(Some(key), row));
        // At a key no other one weighs anything.
        let mut outer = [keys.before, keys.after].map(|key| Outer::of(key.filter(|_| moment.passed > 0), row));
        let mut count = 0usize;
        for start in from.chains {
            let mut column = start.first;
            while let Some(end) = to.from(start.label, column).filter(|end| end.first < start.end) {
                let (first, stop) = (column.max(end.first), start.end.min(end.end));
                let Some(chain) = self.open(start.label, first, stop, count) else { return count as u32 };
                let range = count..count.wrapping_add(chain.nodes().into());
                match keys.backdrop.filter(|_| chain.label == BACKDROP) {
                    Some(record) => {
                        let (at, bits) = ([first, row as u16], keys.key_bits);
                        stand(self.layer.get_mut(range.clone()).unwrap_or_default(), record, at, grid.log2, bits);
                        stand(self.node.get_mut(range).unwrap_or_default(), record, at, grid.log2, bits);
                    }
                    None => {
                        let ends = [start.along(first), end.along(first)];
                        if let Some(slots) = self.node.get_mut(range.clone()) {
                            weigh(slots, &chain, ends, keys, &moment.weights, &mut outer);
                        } else if let Some(slots) = self.layer.get_mut(range) {
                            weigh(slots, &chain, ends, keys, &moment.weights, &mut outer);
                        }
                    }
                }
                self.distances(chain, [start, end], keys, moment.linear);
                count = count.wrapping_add(chain.nodes().into());
                column = stop;
                if column >= start.end {
                    break;
                }
            }
        }
        self.bend_across();
        count as u32
    }

    /// Works out the fields of `chain`, which is in both `ends` of the interval: straight between them, Q8 pixels.
    #[inline(always)]
    fn distances(&mut self, chain: Chain, ends: [&Chain; 2], keys: &Around<'_, '_>, linear: i32) {
        // Most chains are never tested, and have none.
        if ends.iter().all(|end| end.field == NONE) {
            return;
        }
        self.told = chain.at.wrapping_add(chain.nodes());
        let slots = self.field.get_mut(usize::from(chain.at)..).unwrap_or(&mut []);
        let slots = slots.get_mut(..chain.nodes().into()).unwrap_or(&mut []);
        let [from, to] = [(keys.from, ends[0]), (keys.to, ends[1])].map(|(key, end)| {
            let first = usize::from(end.field).wrapping_add(chain.first.wrapping_sub(end.first).into());
            let [a, b] = &key.fields;
            [a, b].map(|codes| codes.get(first..).filter(|_| end.field != NONE).unwrap_or(&[]))
        });
        let ([a, b], [c, d]) = (from, to);
        straight(slots.iter_mut().map(|[field, _]| field), a, c, linear);
        straight(slots.iter_mut().map(|[_, field]| field), b, d, linear);
    }

    fn beside(&self) -> Beside<'_> {
        Beside { chains: self.chain.get(..self.chains).unwrap_or(&[]) }
    }

    /// Works out how each layer bends across; how it bends down is left to [`NodeRow::bend_down`] or [`NodeRow::untell`].
    #[inline(never)]
    fn bend_across(&mut self) {
        let mut nodes = &mut *self.node;
        for chain in self.chain.get(..self.chains).unwrap_or(&[]) {
            let Some((mine, rest)) = core::mem::take(&mut nodes).split_at_mut_checked(chain.nodes().into()) else { break };
            nodes = rest;
            if self.still && chain.label == BACKDROP {
                continue;
            }
            let [first, second, rest @ ..] = mine else {
                mine.iter_mut().for_each(|node| node.across = Layer::ZERO);
                continue;
            };
            // Each waits for the next one; the first bends as the second does, the last as the one before it.
            let (mut step, mut here, mut bend) = (first.layer.step(second.layer), second, Layer::ZERO);
            for after in rest {
                let next = here.layer.step(after.layer);
                bend = next.less(step);
                (step, here.across) = (next, bend);
                here = after;
            }
            here.across = bend;
            if let [first, second, ..] = mine {
                first.across = second.across;
            }
        }
    }

    /// Says of no layer how it bends down: nothing is known of the row above.
    pub fn untell(&mut self) {
        let last = self.chain.get(..self.chains).unwrap_or(&[]).last();
        let end = last.map_or(0, |chain| usize::from(chain.at.wrapping_add(chain.nodes())));
        self.node.get_mut(..end).unwrap_or(&mut []).iter_mut().for_each(|node| node.down = UNTOLD);
    }

    /// Works out how each layer bends down, given the rows above and below it; where the one above had none above itself, it bends as this one does.
    #[inline(never)]
    pub fn bend_down(&mut self, above: &mut Self, below: &Self) {
        let (mut uppers, mut lowers) = (Beside { chains: above.chain.get(..above.chains).unwrap_or(&[]) }, below.beside());
        for chain in self.chain.get_mut(..self.chains).unwrap_or(&mut []) {
            if self.still && chain.label == BACKDROP {
                continue;
            }
            let mut column = chain.first;
            while column < chain.end {
                let (high, top) = uppers.part(chain.label, column);
                let (low, bottom) = lowers.part(chain.label, column);
                let stop = chain.end.min(top).min(bottom);
                let part = |at: usize| at..at.wrapping_add(stop.wrapping_sub(column).into());
                let here = self.node.get_mut(part(chain.along(column))).unwrap_or(&mut []);
                match (high.and_then(|high| above.node.get_mut(part(high))), low.and_then(|low| below.node.get(part(low)))) {
                    (Some(upper), Some(lower)) => {
                        bend_between(here, upper, lower);
                        if uppers.chains.first().is_some_and(|chain| chain.field == UNTOLD_HERE) {
                            tell(upper, here);
                        }
                    }
                    (Some(upper), None) => bend_on(here, upper),
                    // The next row tells.
                    (None, _) => {
                        here.iter_mut().for_each(|node| node.down = UNTOLD);
                        chain.field = UNTOLD_HERE;
                    }
                }
                // Only broken bundles have chains of no nodes.
                if stop <= column {
                    break;
                }
                column = stop;
            }
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

    /// The numbers of layer `index` and of the next one of its chain, as [`Node`] has them, where space is cubic,
    #[must_use]
    #[inline(always)]
    pub fn nodes(&self, index: u16) -> Option<&[i32; 12]> {
        self.node.get(usize::from(index)..)?.first_chunk::<2>().map(bytemuck::cast_ref)
    }

    /// and as [`Layer`] has them, where it is linear.
    #[must_use]
    #[inline(always)]
    pub fn layers(&self, index: u16) -> Option<&[i32; 4]> {
        self.layer.get(usize::from(index)..)?.first_chunk::<2>().map(bytemuck::cast_ref)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::{KEY_BITS, KEY_MAX, KEY_MIN};

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
