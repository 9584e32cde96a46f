//! A key record: the sheet lists of the interval that starts at the key, then the key's layers.
//! Described once: the player decodes records into the caller's memory, the baker's encoder makes them.

use crate::coder::{Bits, Probability};
use crate::format::LabelRecord;
use crate::grid::Grid;
use crate::key::{self, Key, Setting, Source, Trace};
use crate::lists::{self, Lists};

/// Keys held at a time: two to play between, and the one that the next is also told from.
pub const KEYS: usize = 3;

/// Everything records are coded with and into.
#[derive(Debug)]
pub struct Stream<'m> {
    /// [`lists::CONTEXTS`] of them.
    pub list_contexts: &'m mut [Probability],
    /// [`key::CONTEXTS`] of them.
    pub key_contexts: &'m mut [Probability],
    /// Room for the layers of two rows of nodes.
    pub traces: &'m mut [Trace],
    /// The last keys; the key at place p of the timeline is in slot p modulo [`KEYS`].
    pub keys: [Key<'m>; KEYS],
    /// The lists of the intervals that start at them.
    pub lists: [Lists<'m>; KEYS],
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
    /// Coordinates are coded in steps of 2^this / 64 texel.
    pub step_log2: u32,
}

/// A record's place on the timeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The key's place: its index; on a looping path, the number of keys stands for key 0 again.
    pub position: usize,
    /// The record uses no earlier one.
    pub independent: bool,
    /// Records decoded since the last independent one.
    pub run: u32,
    /// An interval ends at the key.
    pub has_before: bool,
    /// An interval starts at the key.
    pub has_after: bool,
    /// Frames of the interval that ends here, and of the one before it.
    pub lengths: [u32; 2],
}

impl Stream<'_> {
    /// Codes the record at `place`.
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
        let [before_that, before, now] = by_age(&mut self.keys, place.position);
        let [_, lists_before, lists_after] = by_age(&mut self.lists, place.position);
        let mut code = |known: Option<&Lists<'_>>, target: &mut Lists<'_>, ahead: bool| {
            lists::code(bits, self.list_contexts, shape.grid, shape.labels, known, target, &mut |cell| source.sheets(ahead, cell));
        };
        if place.has_after {
            code((!place.independent).then_some(&*lists_before), lists_after, true);
        }
        if place.independent && place.has_before {
            // Who starts here has not seen the interval before, which the key's layers depend on too.
            code(place.has_after.then_some(&*lists_after), lists_before, false);
        }
        let [length, length_before] = place.lengths;
        let setting = Setting {
            grid: shape.grid,
            label: shape.label,
            step_log2: shape.step_log2,
            before: (place.run >= 1).then_some(&*before),
            before_that: (place.run >= 2).then(|| (&*before_that, ratio(length, length_before))),
            lists: [place.has_before.then_some(&*lists_before), place.has_after.then_some(&*lists_after)],
        };
        key::code(bits, self.key_contexts, &setting, now, self.traces, source);
    }
}

/// The length of an interval over that of the one before, Q8, as the temporal extrapolation wants it.
fn ratio(length: u32, before: u32) -> i32 {
    let ratio = length.wrapping_shl(8).checked_div(before).unwrap_or(256);
    i32::try_from(ratio.min(1 << 12)).unwrap_or(256)
}

/// The three slots in order of age, the one for `position` last.
fn by_age<T>(slots: &mut [T; KEYS], position: usize) -> [&mut T; KEYS] {
    let [a, b, c] = slots;
    match position % KEYS {
        0 => [b, c, a],
        1 => [c, a, b],
        _ => [a, b, c],
    }
}
