//! How the fields of a chain are coded: each is told from the key before and the nodes west and north of it.
//! Chains come from `nodes`, traces say which layers a cell tests; codes go into the key.

use crate::coder::{self, Bits, NUMBER_CONTEXTS, Probability};
use crate::fixed::{MAX_FIELD, field_code, field_distance};
use crate::format::{LabelRecord, STRIP};
use crate::key::{self, Chain, Key, Line, Setting, Source};
use crate::predict::Trace;

/// Ways a field can be told: from time and neighbours, from time, from neighbours, from nothing.
const CLASSES: usize = 4;
/// Contexts fields are coded with.
pub const CONTEXTS: usize = CLASSES * NUMBER_CONTEXTS;

/// Codes the fields of the layers of `chain`, in row `row` of `key`, in `contexts` ([`CONTEXTS`] of them), and clears those that no cell
/// tests, as their `traces` from `place` on say: the first field of all layers, then, where the label has two, the second.
#[expect(clippy::too_many_arguments, reason = "the key's state, its memory and the chain's place are three different owners")]
#[inline(never)]
pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &mut Key<'_>,
    traces: &[Trace],
    (row, place): (usize, usize),
    chain: Chain,
    source: &mut S,
) {
    let label = chain.label as u8;
    let strip = (setting.label)(label).flags & STRIP != 0;
    let Key { row: rows, chain: chains, fields, .. } = key;
    let line = |row: usize| key::of_row(rows, chains, row);
    let (even, odd) = traces.split_at(traces.len() / 2);
    let traces = if row & 1 == 0 { even } else { odd }.get(place..).unwrap_or(&[]);
    let columns = chain.first..chain.end;
    for (which, codes) in fields.iter_mut().enumerate() {
        let above = row.checked_sub(1);
        let past = |row: Option<usize>| {
            let key = setting.before?;
            Some((Line::new(key.chains(row?), label), &**key.fields.get(which)?))
        };
        let north = Line::new(above.map_or(&[], line), label);
        let mut known = Known { held: past(Some(row)), held_above: past(above), north, last: None };
        for ((column, trace), index) in columns.clone().zip(traces).zip(usize::from(chain.field)..) {
            let code = if trace.tested() && (which == 0 || strip) {
                let told = known.told(codes, column);
                let (predicted, class) = told.prediction();
                let predicted = i32::from(field_code(predicted));
                let node = row.wrapping_mul(setting.grid.node_columns()).wrapping_add(column.into());
                let wanted = i32::from(source.field(node, label, which));
                let Some(contexts) = contexts.get_mut(class.wrapping_mul(NUMBER_CONTEXTS)..) else { return };
                let code = predicted.wrapping_add(coder::number(bits, contexts, wanted.wrapping_sub(predicted)));
                let code = code.clamp(-MAX_FIELD, MAX_FIELD) as i8;
                known.last = Some(Last { column, now: known_distance(code), held: told.held, north: told.north });
                code
            } else {
                0
            };
            if let Some(slot) = codes.get_mut(index) {
                *slot = code;
            }
        }
    }
}

/// A field of zero is one that nothing is known about: its layer was not tested.
fn known_distance(code: i8) -> Option<i32> {
    let distance = field_distance(code);
    (distance != 0).then_some(distance)
}

fn known_at(codes: &[i8], index: Option<usize>) -> Option<i32> {
    known_distance(*codes.get(index?)?)
}

/// What is known of a field as a chain is walked.
struct Known<'k> {
    /// The row at the key before, and the one above it, with that key's codes.
    held: Option<(Line<'k>, &'k [i8])>,
    held_above: Option<(Line<'k>, &'k [i8])>,
    /// The row above at this key.
    north: Line<'k>,
    /// The last node with a field.
    last: Option<Last>,
}

/// What a field was, and what it was told from.
#[derive(Clone, Copy)]
struct Last {
    column: u16,
    now: Option<i32>,
    held: Option<i32>,
    north: Option<i32>,
}

/// What a field is told from: distances at the key before, there and to the west and north, and at this key around it.
struct Told {
    held: Option<i32>,
    held_west: Option<i32>,
    held_north: Option<i32>,
    west: Option<i32>,
    north: Option<i32>,
    north_west: Option<i32>,
}

impl Known<'_> {
    /// What is known at node `column`, which is to the right of the last one, given the key's `codes`.
    fn told(&mut self, codes: &[i8], column: u16) -> Told {
        let before = column.checked_sub(1);
        let last = self.last.filter(|last| Some(last.column) == before);
        let north_west = last.and_then(|last| last.north);
        let past = |line: &mut Option<(Line<'_>, &[i8])>| line.as_mut().and_then(|(line, codes)| known_at(codes, line.field(column)));
        Told {
            held: past(&mut self.held),
            held_west: last.and_then(|last| last.held),
            held_north: past(&mut self.held_above),
            west: last.and_then(|last| last.now),
            north: known_at(codes, self.north.field(column)),
            north_west,
        }
    }
}

impl Told {
    /// The distance, from the key before and how the same field changed at the nodes west and north of it, and the class of that.
    fn prediction(&self) -> (i32, usize) {
        let average = |a: Option<i32>, b: Option<i32>| match (a, b) {
            (Some(a), Some(b)) => Some(a.wrapping_add(b) >> 1),
            (one, other) => one.or(other),
        };
        let change = |now: Option<i32>, then: Option<i32>| now.zip(then).map(|(now, then)| now.wrapping_sub(then));
        let moved = average(change(self.west, self.held_west), change(self.north, self.held_north));
        let beside = match (self.west, self.north, self.north_west) {
            (Some(w), Some(n), Some(nw)) => Some(w.wrapping_add(n).wrapping_sub(nw)),
            (w, n, _) => average(w, n),
        };
        match (self.held, moved, beside) {
            (Some(held), Some(moved), _) => (held.wrapping_add(moved), 0),
            (Some(held), None, _) => (held, 1),
            (None, _, Some(beside)) => (beside, 2),
            (None, _, None) => (0, 3),
        }
    }
}
