//! A key record: the sheet lists of the interval that starts at the key (an independent key repeats those of the one that
//! ends there), then the key's layers.
//! Described once: the player decodes records into the caller's memory, whole or slice by slice, the baker's encoder makes them.

use crate::coder::{Bits, Probability};
use crate::format::LabelRecord;
use crate::grid::Grid;
use crate::key::{BACKDROP, Key, Setting, Source};
use crate::lists::{self, Lists};
use crate::nodes::{self, Layout};
use crate::plane::{Camera, PLANE_BYTES, Plane, View};
use core::ops::Range;

/// Keys held at a time, at most: four to play a cubic interval, and the one that is being coded.
pub const MAX_KEYS: usize = 5;
/// Sheet lists held at a time, at most: those of the intervals from the one that plays to the one after the key being coded.
pub const LISTS: usize = 4;

/// Everything records are coded with and into.
#[derive(Debug, Default)]
pub struct Stream<'m> {
    /// [`lists::CONTEXTS`] of them.
    pub list_contexts: &'m mut [Probability],
    /// [`nodes::CONTEXTS`] of them.
    pub key_contexts: &'m mut [Probability],
    /// What rows of nodes are laid out with.
    pub layout: Layout<'m>,
    /// Room for as many views as there are planes: how the key being coded sees them.
    pub views: &'m mut [View],
    /// The last keys and the one being coded, in a ring of the first `slots`.
    pub keys: [Key<'m>; MAX_KEYS],
    /// The lists of the intervals that start at them, in a ring of the first `slots` too, or of as many as there are.
    pub lists: [Lists<'m>; LISTS],
    /// Keys in use: at least 3, the last two and the one that they tell; at most [`MAX_KEYS`].
    pub slots: usize,
    /// Where the newest record's stand: its key, and its lists.
    pub newest: [usize; 2],
}

/// What does not change from record to record.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'p, L> {
    /// The grid.
    pub grid: Grid,
    /// Number of labels.
    pub labels: usize,
    /// The record of a label.
    pub label: L,
    /// Fraction bits of coordinates.
    pub key_bits: u32,
    /// Coordinates are coded in steps of 2^this of their units.
    pub step_log2: u32,
    /// The planes that positions are told from, labels ascending.
    pub planes: &'p [[u8; PLANE_BYTES]],
}

/// A record's place on the timeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The record uses no earlier one.
    pub independent: bool,
    /// Records since the last independent one: 0 at that one itself.
    pub run: u32,
    /// An interval ends at the key.
    pub has_before: bool,
    /// An interval starts at the key.
    pub has_after: bool,
    /// Frames of the interval that ends here, and of the one before it.
    pub lengths: [u32; 2],
    /// From where the key looks.
    pub camera: Camera,
}

/// Rows of cells whose lists make a slice: about as much work as one row of nodes.
const LIST_ROWS: usize = 4;
/// What a byte, a layer of a row of nodes and a slice of lists cost to code, in parts of equal time, a part being what a byte of the lists of the cells
/// around costs beside: fitted to counted instructions, of which that misses a twelfth.
pub const BYTE_COST: u32 = 5;
const LAYER_COST: u32 = 5;
const LIST_COST: u32 = 200;

impl Place {
    /// Slices of a record at this place: a few rows of cells or one row of nodes each, about the same work.
    #[must_use]
    pub const fn slices(self, grid: Grid) -> usize {
        let [after, before] = self.list_slices(grid);
        after.saturating_add(before).saturating_add(grid.node_rows())
    }

    /// Slices of the lists of the interval after the key, and of the one before it.
    const fn list_slices(self, grid: Grid) -> [usize; 2] {
        let slices = grid.rows.div_ceil(LIST_ROWS);
        // Who starts here has not seen the interval before, which the key's layers depend on too.
        [if self.has_after { slices } else { 0 }, if self.independent && self.has_before { slices } else { 0 }]
    }
}

impl<'m> Stream<'m> {
    /// Codes the whole record at `place`, as the newest.
    pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord + Copy>(
        &mut self,
        bits: &mut B,
        shape: Shape<'_, L>,
        place: Place,
        source: &mut S,
    ) {
        for slice in 0..place.slices(shape.grid) {
            self.slice(bits, shape, place, slice, source);
        }
        self.finish();
    }

    /// Codes one slice of the record at `place`, which follows the newest and replaces the oldest key held. All slices that
    /// [`Place::slices`] counts have to be coded in order, from `bits` that go on where they stopped; then [`Stream::finish`] makes the
    /// record the newest. Meanwhile the other keys held are there to be played.
    pub fn slice<B: Bits, S: Source, L: Fn(u8) -> LabelRecord + Copy>(
        &mut self,
        bits: &mut B,
        shape: Shape<'_, L>,
        place: Place,
        slice: usize,
        source: &mut S,
    ) {
        if slice == 0 && place.independent {
            self.list_contexts.fill(Probability::NEW);
            self.key_contexts.fill(Probability::NEW);
        }
        if slice == 0 {
            for (view, plane) in self.views.iter_mut().zip(shape.planes) {
                *view = View::new(&Plane::from_bytes(plane), &place.camera, shape.key_bits);
            }
        }
        let ([now_slot, list_slot], [_, list_before_slot]) = (self.next(), self.newest);
        let mut now = self.keys.get_mut(now_slot).map(core::mem::take).unwrap_or_default();
        let mut lists_after = self.lists.get_mut(list_slot).map(core::mem::take).unwrap_or_default();
        let mut lists_before = self.lists.get_mut(list_before_slot).map(core::mem::take).unwrap_or_default();
        let mut code = |known: Option<&Lists<'_>>, target: &mut Lists<'_>, slice: usize, ahead: bool| {
            let from = slice.wrapping_mul(LIST_ROWS);
            let wanted = &mut |cell| source.sheets(ahead, cell);
            for row in (from..shape.grid.rows).take(LIST_ROWS) {
                lists::code_row(bits, self.list_contexts, shape.grid, shape.labels, known, target, row, wanted);
            }
        };
        let [after, before] = place.list_slices(shape.grid);
        if slice < after {
            code((!place.independent).then_some(&lists_before), &mut lists_after, slice, true);
        } else if let slice = slice.wrapping_sub(after)
            && slice < before
        {
            code(place.has_after.then_some(&lists_after), &mut lists_before, slice, false);
        } else {
            let key_contexts = core::mem::take(&mut self.key_contexts);
            let mut layout = core::mem::take(&mut self.layout);
            let [length, length_before] = place.lengths;
            let setting = Setting {
                grid: shape.grid,
                label: shape.label,
                key_bits: shape.key_bits,
                step_log2: shape.step_log2,
                before: self.key(0).filter(|_| place.run >= 1),
                before_that: self.key(1).filter(|_| place.run >= 2).map(|key| (key, ratio(length, length_before))),
                lists: [place.has_before.then_some(&lists_before), place.has_after.then_some(&lists_after)],
                planes: shape.planes,
                views: self.views,
            };
            let row = slice.wrapping_sub(after).wrapping_sub(before);
            nodes::code_row(bits, key_contexts, &setting, &mut now, &mut layout, row, source);
            (self.key_contexts, self.layout) = (key_contexts, layout);
        }
        self.put(now_slot, now, [(list_slot, lists_after), (list_before_slot, lists_before)]);
    }

    /// What slice `slice` of the record at `place`, which follows the newest, costs to code beside its bytes: its row of nodes has about as many layers
    /// as the newest record's, and the cells around as many sheets. `backdrop`: the least label has no positions.
    #[must_use]
    pub fn cost(&self, grid: Grid, place: Place, slice: usize, backdrop: bool) -> u32 {
        let [after, before] = place.list_slices(grid);
        let around = |rows: Range<usize>| self.lists.get(self.newest[1]).map_or(0, |lists| lists.held(rows));
        let Some(row) = slice.checked_sub(after.wrapping_add(before)) else {
            let first = slice.checked_sub(after).unwrap_or(slice).wrapping_mul(LIST_ROWS);
            return around(first..first.wrapping_add(LIST_ROWS)).wrapping_add(LIST_COST);
        };
        let known = self.key(0).filter(|_| !place.independent).map_or(&[][..], |key| key.chains(row));
        let chains = known.iter().filter(|chain| !(backdrop && chain.label == BACKDROP));
        let layers = chains.map(|chain| u32::from(chain.nodes())).fold(0, u32::wrapping_add);
        let layers = if known.is_empty() { grid.columns as u32 } else { layers };
        let around = around(row.saturating_sub(1)..row.wrapping_add(1));
        layers.wrapping_mul(LAYER_COST).wrapping_add(around).wrapping_add(1)
    }

    /// The record that was coded slice by slice is the newest from now on.
    pub fn finish(&mut self) {
        self.newest = self.next();
    }

    fn put(&mut self, slot: usize, key: Key<'m>, lists: [(usize, Lists<'m>); 2]) {
        if let Some(place) = self.keys.get_mut(slot) {
            *place = key;
        }
        for (slot, list) in lists {
            if let Some(place) = self.lists.get_mut(slot) {
                *place = list;
            }
        }
    }

    /// Places in either ring.
    fn places(&self) -> [usize; 2] {
        [self.slots, self.slots.min(LISTS)]
    }

    /// Where the next record's key and lists stand.
    fn next(&self) -> [usize; 2] {
        let ([key, lists], [keys, held]) = (self.newest, self.places());
        let on = |slot: usize, places: usize| Some(slot.wrapping_add(1)).filter(|&slot| slot < places).unwrap_or(0);
        [on(key, keys), on(lists, held)]
    }

    /// Where that stands in a ring of so many `places` which was coded `age` records before what stands at `newest`; `None` where it is not held any
    /// more, or the next one may stand there.
    // Without a division: small processors have none.
    #[inline(always)]
    fn ago(newest: usize, age: usize, places: usize) -> Option<usize> {
        let back = newest.checked_sub(age).unwrap_or_else(|| newest.wrapping_add(places).wrapping_sub(age));
        Some(back).filter(|_| age.wrapping_add(1) < places)
    }

    /// The key coded `age` records before the newest; `None` where it is not held any more, or the next one may stand there.
    #[must_use]
    pub fn key(&self, age: usize) -> Option<&Key<'m>> {
        self.keys.get(Self::ago(self.newest[0], age, self.places()[0])?)
    }

    /// The lists of the interval that starts at that key.
    #[must_use]
    pub fn lists(&self, age: usize) -> Option<&Lists<'m>> {
        self.lists.get(Self::ago(self.newest[1], age, self.places()[1])?)
    }
}

/// The length of an interval over that of the one before, Q8, as the temporal extrapolation wants it.
fn ratio(length: u32, before: u32) -> i32 {
    let ratio = length.wrapping_shl(8).checked_div(before).unwrap_or(256);
    i32::try_from(ratio.min(1 << 12)).unwrap_or(256)
}
