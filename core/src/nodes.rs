//! The layers of a key, row by row: which labels each node carries follows from the sheet lists around it, and with it which
//! chains a row has; positions are coded by `predict`, fields by `field`. Described once, for decoder and encoder alike: bits come from
//! (or go to) `coder`, layers go to the caller's memory as a `key`.
//!
//! A node carries one layer for every label in the lists of the cells that touch it, in the interval before its key and
//! in the one after. The backdrop's have no positions, which would always be the same: only fields, where a cell tests them.

use crate::coder::{Bits, Probability};
use crate::field;
use crate::format::{LabelRecord, MAX_NODE_LAYERS, MAX_SHEETS};
use crate::key::{BACKDROP, Chain, Key, NONE, Setting, Source};
use crate::lists::{CHART, Cursor, Lists, SheetsRef};
use crate::predict;
pub use crate::predict::Trace;
use heapless::Vec;

/// Contexts a key is coded with: for positions, then for fields.
pub const CONTEXTS: usize = predict::CONTEXTS + field::CONTEXTS;

/// What a row of nodes is laid out with, in caller's memory.
#[derive(Debug, Default)]
pub struct Layout<'m> {
    /// Room for the layers of two rows of nodes, half of it each: what their coding leaves behind.
    pub traces: &'m mut [Trace],
    /// Room for as many as a row has layers.
    pub marks: &'m mut [Mark],
    /// Room for one a chain of a row.
    pub order: &'m mut [u16],
}

/// Layers of a chain that are alike, in the order in which they are found.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Mark {
    /// The chain, counted as they begin.
    chain: u16,
    nodes: u16,
    /// Some cell tests their fields: 1.
    tested: u16,
}

/// Codes the layers of one `row` of a key's nodes into `target`, which holds those of the rows above, in `contexts` ([`CONTEXTS`] of
/// them).
pub fn code_row<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    target: &mut Key<'_>,
    layout: &mut Layout<'_>,
    row: usize,
    source: &mut S,
) {
    let Some((positions, fields)) = contexts.split_at_mut_checked(predict::CONTEXTS) else { return };
    let backdrop = setting.backdrop();
    let start = if row == 0 { 0 } else { target.used[0] };
    lay_out(setting, target, layout, row);
    let chains = target.chains(row).len();
    let first = target.row.get(row).map_or(0, |&at| usize::from(at));
    // The backdrop's traces come after the others'.
    let mut last = target.used[0].wrapping_sub(start);
    for index in first..first.wrapping_add(chains) {
        let Some(&chain) = target.chain.get(index) else { break };
        let place = if backdrop && chain.label == BACKDROP {
            let place = last;
            last = place.wrapping_add(chain.nodes().into());
            place
        } else {
            predict::code(bits, positions, setting, target, layout.traces, row, chain, source);
            usize::from(chain.at).wrapping_sub(start)
        };
        if chain.field != NONE {
            field::code(bits, fields, setting, target, layout.traces, (row, place), chain, source);
        }
    }
}

/// Finds the chains of `row`, and marks its layers' traces with what the lists say about them. What breaks the key's bounds is left out.
#[inline(never)]
fn lay_out<L: Fn(u8) -> LabelRecord>(setting: &Setting<'_, '_, L>, target: &mut Key<'_>, layout: &mut Layout<'_>, row: usize) {
    if row == 0 {
        target.used = [0; 2];
        target.row.fill(0);
    }
    let first = target.row.get(row).map_or(0, |&at| usize::from(at));
    let [layers, fields] = target.used;
    let half = layout.traces.len() / 2;
    let room = [target.uv.len().saturating_sub(layers), half];
    let free = target.chain.get_mut(first..).unwrap_or(&mut []);
    let most = free.len().min(layout.order.len());
    let chains = free.get_mut(..most).unwrap_or(&mut []);
    let backdrop = setting.backdrop();
    let mut found = Finding { chains, count: 0, marks: &mut *layout.marks, marked: 0, room, backdrop };
    found.walk(setting, row);
    let Finding { count, marked, .. } = found;
    let Some(chains) = free.get_mut(..count) else { return };
    // By label: then rows are gone through side by side. Where each stands, by the order in which they begin, is what marks want.
    for (place, chain) in (0..).zip(&mut *chains) {
        chain.at = place;
    }
    sort(chains);
    let (mut layer, mut field, mut traced) = (layers, fields, 0usize);
    let behind = if backdrop { chains.partition_point(|chain| chain.label == BACKDROP) } else { 0 };
    let (behind, before) = chains.split_at_mut_checked(behind).unwrap_or_default();
    for chain in before.iter_mut().chain(behind) {
        let nodes = usize::from(chain.nodes());
        if let Some(place) = layout.order.get_mut(usize::from(chain.at)) {
            *place = traced as u16;
        }
        traced = traced.wrapping_add(nodes);
        chain.at = layers as u16;
        if !(backdrop && chain.label == BACKDROP) {
            chain.at = layer as u16;
            layer = layer.wrapping_add(nodes);
        }
        if chain.field != NONE {
            let end = field.wrapping_add(nodes);
            let fits = target.fields.first().is_some_and(|codes| end <= codes.len());
            (chain.field, field) = if fits { (field as u16, end) } else { (NONE, field) };
        }
    }
    target.used = [layer, field];
    if let Some(next) = target.row.get_mut(row.wrapping_add(1)) {
        *next = first.wrapping_add(count) as u16;
    }
    let (even, odd) = layout.traces.split_at_mut(half);
    let traces = if row & 1 == 0 { even } else { odd };
    for mark in layout.marks.get(..marked).unwrap_or(&[]) {
        let Some(place) = layout.order.get_mut(usize::from(mark.chain)) else { break };
        let end = place.wrapping_add(mark.nodes);
        for trace in traces.get_mut(usize::from(*place)..usize::from(end)).unwrap_or(&mut []) {
            *trace = Trace::of(mark.tested != 0);
        }
        *place = end;
    }
}

/// Sorts chains by label, those of one label from left to right. Mostly there are a few, nearly in order; a broken bundle may have tens of thousands,
/// which Shell's method (1959), by steps a third as long each time, sorts in some millions of comparisons.
fn sort(chains: &mut [Chain]) {
    let mut step = 1usize;
    while step.wrapping_mul(3) < chains.len() {
        step = step.wrapping_mul(3).wrapping_add(1);
    }
    while step > 0 {
        for end in step..chains.len() {
            let mut at = end;
            while let Some(before) = at.checked_sub(step) {
                let Some([left, .., right]) = chains.get_mut(before..=at) else { break };
                if (left.label, left.first) <= (right.label, right.first) {
                    break;
                }
                core::mem::swap(left, right);
                at = before;
            }
        }
        step /= 3;
    }
}

/// The chains of a row as they are found, from left to right.
struct Finding<'f> {
    chains: &'f mut [Chain],
    count: usize,
    marks: &'f mut [Mark],
    marked: usize,
    /// Positions and traces that there is room for.
    room: [usize; 2],
    /// The least label has traces alone.
    backdrop: bool,
}

impl Finding<'_> {
    /// Goes through the nodes of `row`.
    fn walk<L>(&mut self, setting: &Setting<'_, '_, L>, row: usize) {
        let grid = setting.grid;
        let mut around = Corner::new(setting.lists, row);
        // The chains that the last node is part of, by label.
        let mut open: Vec<u16, MAX_NODE_LAYERS> = Vec::new();
        let mut column = 0usize;
        while column < grid.node_columns() {
            if let Some((label, alike)) = around.alike(grid.columns.saturating_sub(column)) {
                let found = Found { label, tested: false };
                let chain = self.put(&open, found, column as u16, alike);
                open.clear();
                if let Some(chain) = chain {
                    let _ = open.push(chain);
                }
                column = column.wrapping_add(usize::from(alike));
                continue;
            }
            let mut next: Vec<u16, MAX_NODE_LAYERS> = Vec::new();
            around.labels(column < grid.columns, |found| {
                if let Some(chain) = self.put(&open, found, column as u16, 1) {
                    let _ = next.push(chain);
                }
            });
            open = next;
            column = column.wrapping_add(1);
        }
    }

    /// Puts layers at `nodes` nodes from `column` on: into one of the chains that are `open`, or into a new one. Returns which.
    fn put(&mut self, open: &[u16], found: Found, column: u16, nodes: u16) -> Option<u16> {
        let [positions, traces] = self.room;
        let wanted = if self.backdrop && found.label == 0 { 0 } else { usize::from(nodes) };
        let left = [positions.checked_sub(wanted)?, traces.checked_sub(nodes.into())?];
        let mark = self.marks.get_mut(self.marked)?;
        let label = u16::from(found.label);
        let known = open.iter().copied().find(|&chain| self.chains.get(usize::from(chain)).is_some_and(|chain| chain.label == label));
        let index = known.unwrap_or(self.count as u16);
        let chain = self.chains.get_mut(usize::from(index))?;
        if known.is_none() {
            *chain = Chain { first: column, end: column, at: 0, field: NONE, label };
            self.count = self.count.wrapping_add(1);
        }
        chain.end = column.wrapping_add(nodes);
        if found.tested {
            chain.field = 0;
        }
        *mark = Mark { chain: index, nodes, tested: found.tested.into() };
        (self.marked, self.room) = (self.marked.wrapping_add(1), left);
        Some(index)
    }
}

/// A label in the cells around a node.
#[derive(Clone, Copy)]
struct Found {
    label: u8,
    /// Some cell tests its fields.
    tested: bool,
}

/// The labels of the four cells on one side of a node, ascending.
type Side = Vec<Found, { 4 * MAX_SHEETS }>;

/// The cells around a node as a row of nodes is walked: above and below, in the interval before and after.
struct Corner<'l, 'm> {
    /// The cells to the left of the node, and those to the right with their lists.
    left: [SheetsRef<'l>; 4],
    right: [Option<(&'l Lists<'m>, Cursor)>; 4],
    /// What those to the left show.
    seen: Side,
}

impl<'l, 'm> Corner<'l, 'm> {
    fn new([before, after]: [Option<&'l Lists<'m>>; 2], row: usize) -> Self {
        let at = |list: Option<&'l Lists<'m>>, row: Option<usize>| list.zip(row).map(|(list, row)| (list, list.row(row)));
        let above = row.checked_sub(1);
        let right = [at(before, above), at(before, Some(row)), at(after, above), at(after, Some(row))];
        Self { left: [SheetsRef::default(); 4], right, seen: Side::new() }
    }

    /// Passes the labels of the cells around the node on, ascending, as many as a node may have; then moves on.
    fn labels(&mut self, inside: bool, mut pass: impl FnMut(Found)) {
        let mut ahead = Side::new();
        for (left, right) in self.left.iter_mut().zip(&mut self.right) {
            let mut sheets = SheetsRef::default();
            if let Some((list, cursor)) = right.as_mut().filter(|_| inside) {
                sheets = list.sheets(*cursor);
                *cursor = cursor.next(list);
            }
            collect(sheets, &mut ahead);
            *left = sheets;
        }
        let (mut left, mut right) = (self.seen.iter().copied().peekable(), ahead.iter().copied().peekable());
        for _ in 0..MAX_NODE_LAYERS {
            let found = match (left.peek(), right.peek()) {
                (Some(a), Some(b)) if a.label == b.label => {
                    let tested = a.tested | b.tested;
                    right.next();
                    left.next().map(|found| Found { tested, ..found })
                }
                (Some(a), Some(b)) if a.label > b.label => right.next(),
                (Some(_), _) => left.next(),
                (None, _) => right.next(),
            };
            let Some(found) = found else { break };
            pass(found);
        }
        self.seen = ahead;
    }

    /// The one label that all cells around each of the next nodes show, and how many nodes these are, `most` at most; moves past them. `None` where the
    /// next one has others.
    fn alike(&mut self, most: usize) -> Option<(u8, u16)> {
        let &[label] = self.left.iter().find_map(|left| left.labels.first_chunk())?;
        let (mut alike, mut any) = (most, false);
        for (left, right) in self.left.iter().zip(&self.right) {
            let Some((list, cursor)) = right.filter(|(list, cursor)| !list.sheets(*cursor).labels.is_empty()) else {
                // Beyond the grid's edge, as to the left of it.
                if left.labels.is_empty() {
                    continue;
                }
                return None;
            };
            if left.labels != [label] {
                return None;
            }
            (alike, _) = list.alike(cursor, label, alike);
            any = true;
        }
        if alike == 0 || !any {
            return None;
        }
        for right in self.right.iter_mut().flatten() {
            (_, right.1) = right.0.alike(right.1, label, alike);
        }
        Some((label, alike as u16))
    }
}

/// Adds what a cell's `sheets` say about its nodes.
fn collect(sheets: SheetsRef<'_>, found: &mut Side) {
    for (index, &label) in sheets.labels.iter().enumerate() {
        let tested = sheets.test(index) != CHART;
        // A few at most: a walk finds the place as fast as any search.
        let at = found.iter().take_while(|other| other.label < label).count();
        let full = found.is_full();
        match found.get_mut(at) {
            Some(other) if other.label == label => other.tested |= tested,
            // There is room for all that four cells can have.
            _ if full => {}
            _ => {
                // Each makes room for the one before it.
                let mut moved = Found { label, tested };
                for slot in found.iter_mut().skip(at) {
                    core::mem::swap(slot, &mut moved);
                }
                let _ = found.push(moved);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Chain, sort};

    #[test]
    fn chains_are_sorted_by_label_and_from_left_to_right() {
        let mut seed = 5u32;
        for count in [0usize, 1, 2, 3, 7, 40, 3000] {
            let mut chains: [Chain; 3000] = core::array::from_fn(|at| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                Chain { first: at as u16, label: (seed >> 24) as u16 % 9, ..Chain::default() }
            });
            let chains = chains.get_mut(..count).unwrap_or(&mut []);
            sort(chains);
            assert!(chains.is_sorted_by_key(|chain| (chain.label, chain.first)), "{count}");
        }
    }
}
