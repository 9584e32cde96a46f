//! A key record: the sheet lists of the interval that starts at the key (an independent key repeats those of the one that
//! ends there), then the key's layers.
//! Described once: the player decodes records into the caller's memory, the baker's encoder makes them.

use crate::coder::{Bits, Probability};
use crate::format::LabelRecord;
use crate::grid::Grid;
use crate::key::{Key, Setting, Source};
use crate::lists::{self, Lists};
use crate::nodes::{self, Trace};

/// Keys held at a time, at most: four to play a cubic interval. Three are held always: the last two tell the next.
pub const MAX_KEYS: usize = 4;
/// Sheet lists held at a time: those of the intervals from the one that plays to the one after the last key.
pub const LISTS: usize = 3;

/// Everything records are coded with and into.
#[derive(Debug)]
pub struct Stream<'m> {
    /// [`lists::CONTEXTS`] of them.
    pub list_contexts: &'m mut [Probability],
    /// [`nodes::CONTEXTS`] of them.
    pub key_contexts: &'m mut [Probability],
    /// Room for the layers of two rows of nodes: one trace each.
    pub traces: &'m mut [Trace],
    /// The last keys, in a ring of the first `slots`.
    pub keys: [Key<'m>; MAX_KEYS],
    /// The lists of the intervals that start at the last of them, in a ring too.
    pub lists: [Lists<'m>; LISTS],
    /// Keys in use: at least 3, at most [`MAX_KEYS`].
    pub slots: usize,
    /// Records coded so far; it turns both rings.
    pub turn: usize,
}

/// What does not change from record to record.
#[derive(Clone, Copy, Debug)]
pub struct Shape<L> {
    /// The grid.
    pub grid: Grid,
    /// Number of labels.
    pub labels: usize,
    /// The record of a label.
    pub label: L,
    /// Coordinates are coded in steps of 2^this / 32 texel.
    pub step_log2: u32,
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
}

impl<'m> Stream<'m> {
    /// Codes the record at `place`, as the newest.
    pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord + Copy>(
        &mut self,
        bits: &mut B,
        shape: Shape<L>,
        place: Place,
        source: &mut S,
    ) {
        if place.independent {
            self.list_contexts.fill(Probability::NEW);
            self.key_contexts.fill(Probability::NEW);
        }
        self.turn = self.turn.wrapping_add(1);
        let (now_slot, list_slot, list_before_slot) = (self.key_slot(0), self.list_slot(0), self.list_slot(1));
        let mut now = self.keys.get_mut(now_slot).map(core::mem::take).unwrap_or_default();
        let mut lists_after = self.lists.get_mut(list_slot).map(core::mem::take).unwrap_or_default();
        let mut lists_before = self.lists.get_mut(list_before_slot).map(core::mem::take).unwrap_or_default();
        let mut code = |known: Option<&Lists<'_>>, target: &mut Lists<'_>, ahead: bool| {
            lists::code(bits, self.list_contexts, shape.grid, shape.labels, known, target, &mut |cell| source.sheets(ahead, cell));
        };
        if place.has_after {
            code((!place.independent).then_some(&lists_before), &mut lists_after, true);
        }
        if place.independent && place.has_before {
            // Who starts here has not seen the interval before, which the key's layers depend on too.
            code(place.has_after.then_some(&lists_after), &mut lists_before, false);
        }
        let key_contexts = core::mem::take(&mut self.key_contexts);
        let traces = core::mem::take(&mut self.traces);
        let [length, length_before] = place.lengths;
        let setting = Setting {
            grid: shape.grid,
            label: shape.label,
            step_log2: shape.step_log2,
            before: self.key(1).filter(|_| place.run >= 1),
            before_that: self.key(2).filter(|_| place.run >= 2).map(|key| (key, ratio(length, length_before))),
            lists: [place.has_before.then_some(&lists_before), place.has_after.then_some(&lists_after)],
        };
        nodes::code(bits, key_contexts, &setting, &mut now, traces, source);
        (self.key_contexts, self.traces) = (key_contexts, traces);
        self.put(now_slot, now, [(list_slot, lists_after), (list_before_slot, lists_before)]);
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

    fn key_slot(&self, age: usize) -> usize {
        self.turn.wrapping_sub(age).checked_rem(self.slots).unwrap_or(0)
    }

    fn list_slot(&self, age: usize) -> usize {
        self.turn.wrapping_sub(age) % LISTS
    }

    /// The key coded `age` records before the last; `None` where it is not held any more.
    #[must_use]
    pub fn key(&self, age: usize) -> Option<&Key<'m>> {
        self.keys.get(self.key_slot(age)).filter(|_| age < self.slots)
    }

    /// The lists of the interval that starts at that key.
    #[must_use]
    pub fn lists(&self, age: usize) -> Option<&Lists<'m>> {
        self.lists.get(self.list_slot(age)).filter(|_| age < LISTS)
    }
}

/// The length of an interval over that of the one before, Q8, as the temporal extrapolation wants it.
fn ratio(length: u32, before: u32) -> i32 {
    let ratio = length.wrapping_shl(8).checked_div(before).unwrap_or(256);
    i32::try_from(ratio.min(1 << 12)).unwrap_or(256)
}
