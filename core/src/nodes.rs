//! The layers of a key, row by row: which labels each node carries follows from the sheet lists around it, and with it which
//! chains a row has; positions are coded by `predict`, fields by `field`. Described once, for decoder and encoder alike: bits come from
//! (or go to) `coder`, layers go to the caller's memory as a `key`.
//!
//! A node carries one layer for every label in the lists of the cells that touch it, in the interval before its key and
//! in the one after. The backdrop's have no positions, which would always be the same: only fields, where a cell tests them.

use crate::coder::{Bits, Probability};
use crate::field;
use crate::format::LabelRecord;
use crate::key::{BACKDROP, Chain, Key, NONE, Setting, Source};
use crate::lists::{CHART, Cursor, Lists, SheetsRef};
use crate::predict;
pub use crate::predict::Trace;
use core::ops::Range;

/// Contexts a key is coded with: for positions, then for fields.
pub const CONTEXTS: usize = predict::CONTEXTS + field::CONTEXTS;

/// What a row of nodes is laid out with, in caller's memory.
#[derive(Debug, Default)]
pub struct Layout<'m> {
    /// Room for the layers of two rows of nodes, half of it each: what their coding leaves behind.
    pub traces: &'m mut [Trace],
    /// Room for one a label: which of a row's chains is its last one.
    pub open: &'m mut [u16],
    /// Room for one a chain of a row: where its traces are.
    pub place: &'m mut [u16],
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
    let Layout { traces, open, place } = layout;
    let half = traces.len() / 2;
    let room = [target.uv.len().saturating_sub(layers), half];
    let free = target.chain.get_mut(first..).unwrap_or(&mut []);
    let most = free.len().min(place.len());
    let backdrop = setting.backdrop();
    open.fill(NONE);
    let mut finding = Finding { chains: free.get_mut(..most).unwrap_or(&mut []), count: 0, open, room, backdrop, tested: false };
    Cells::new(setting.lists, row).walk(setting.grid.columns, |cells, sheets| finding.take(cells, sheets));
    let Finding { count, tested, .. } = finding;
    let Some(chains) = free.get_mut(..count) else { return };
    // By label: then rows are gone through side by side.
    sort(chains);
    let (mut layer, mut field, mut traced) = (layers, fields, 0usize);
    let behind = if backdrop { chains.partition_point(|chain| chain.label == BACKDROP) } else { 0 };
    let (behind, before) = chains.split_at_mut_checked(behind).unwrap_or_default();
    let (behind_place, before_place) = place.split_at_mut_checked(behind.len()).unwrap_or_default();
    for (chain, place) in before.iter_mut().zip(before_place).chain(behind.iter_mut().zip(behind_place)) {
        let nodes = usize::from(chain.nodes());
        *place = traced as u16;
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
    let (even, odd) = traces.split_at_mut(half);
    let traces = if row & 1 == 0 { even } else { odd };
    traces.iter_mut().take(traced).for_each(|trace| *trace = Trace::NONE);
    if tested {
        for (index, chain) in (0..count as u16).rev().zip(chains.iter().rev()) {
            if let Some(open) = open.get_mut(usize::from(chain.label)) {
                *open = index;
            }
        }
        Cells::new(setting.lists, row).walk(setting.grid.columns, |cells, sheets| mark(chains, open, place, traces, cells.start, sheets));
    }
}

/// Marks the traces of the layers that a cell in `column` tests. Its `sheets` are in `chains`, which are sorted; of each label the one `open` is that
/// of the cells to the left or before it, and `place` tells where each one's traces are.
fn mark(chains: &[Chain], open: &mut [u16], place: &[u16], traces: &mut [Trace], column: u16, sheets: SheetsRef<'_>) {
    if sheets.tests == 0 {
        return;
    }
    for (label, _) in sheets.each().filter(|&(_, test)| test != CHART) {
        let Some(open) = open.get_mut(usize::from(label)) else { continue };
        while let Some(chain) = chains.get(usize::from(*open))
            && chain.label == u16::from(label)
        {
            if column >= chain.end {
                *open = open.wrapping_add(1);
                continue;
            }
            // What there was no room for is in no chain.
            if let Some((along, &place)) = column.checked_sub(chain.first).zip(place.get(usize::from(*open))) {
                let first = usize::from(place.wrapping_add(along));
                traces.iter_mut().skip(first).take(2).for_each(Trace::test);
            }
            break;
        }
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
        // A third of less than 2^16: small processors do not divide.
        step = step.wrapping_mul(0x5556) >> 16;
    }
}

/// The chains of a row as they are found, from left to right.
struct Finding<'f> {
    chains: &'f mut [Chain],
    count: usize,
    /// The last chain of each label.
    open: &'f mut [u16],
    /// Positions and traces that there is room for.
    room: [usize; 2],
    /// The least label has traces alone.
    backdrop: bool,
    /// Some cell tests some layer's fields.
    tested: bool,
}

impl Finding<'_> {
    /// Takes in the `sheets` that each of these `cells` lists: their labels have layers at all nodes around. What there is no room for is left out.
    #[inline(always)]
    fn take(&mut self, cells: Range<u16>, sheets: SheetsRef<'_>) {
        let end = cells.end.wrapping_add(1);
        for (label, test) in sheets.each() {
            let Some(open) = self.open.get_mut(usize::from(label)) else { continue };
            let (backdrop, room) = (self.backdrop, self.room);
            let less = |nodes: u16| less(room, nodes, !(backdrop && label == 0));
            let known = self.chains.get_mut(usize::from(*open)).filter(|chain| chain.end >= cells.start);
            let chain = if let Some(chain) = known {
                // Most cells list what others around them do.
                if chain.end < end {
                    let Some(left) = less(end.wrapping_sub(chain.end)) else { continue };
                    (self.room, chain.end) = (left, end);
                }
                chain
            } else {
                let left = less(end.wrapping_sub(cells.start));
                let Some((left, chain)) = left.zip(self.chains.get_mut(self.count)) else { continue };
                *chain = Chain { first: cells.start, end, at: 0, field: NONE, label: label.into() };
                (self.room, *open) = (left, self.count as u16);
                self.count = self.count.wrapping_add(1);
                chain
            };
            if test != CHART {
                chain.field = 0;
                self.tested = true;
            }
        }
    }
}

/// What `room` for positions and traces is left beside so many `nodes`, which may have no positions.
#[inline(always)]
fn less([positions, traces]: [usize; 2], nodes: u16, with_positions: bool) -> Option<[usize; 2]> {
    let nodes = usize::from(nodes);
    Some([positions.checked_sub(if with_positions { nodes } else { 0 })?, traces.checked_sub(nodes)?])
}

/// The cells above and below a row of nodes, in the interval before and after, as it is walked from left to right.
struct Cells<'l, 'm>([Option<(&'l Lists<'m>, Cursor)>; 4]);

impl<'l, 'm> Cells<'l, 'm> {
    fn new([before, after]: [Option<&'l Lists<'m>>; 2], row: usize) -> Self {
        let at = |list: Option<&'l Lists<'m>>, row: Option<usize>| list.zip(row).map(|(list, row)| (list, list.row(row)));
        let above = row.checked_sub(1);
        Self([at(before, above), at(before, Some(row)), at(after, above), at(after, Some(row))])
    }

    /// Goes over so many `columns`; `pass` hears of every list that is there, and of which columns. Where all lists name one label and no other, it hears
    /// of one of them.
    #[inline(always)]
    fn walk(mut self, columns: usize, mut pass: impl FnMut(Range<u16>, SheetsRef<'_>)) {
        // Below the grid, and past a broken list's end, there are none.
        for cell in &mut self.0 {
            *cell = cell.filter(|(lists, cursor)| !lists.sheets(*cursor).labels.is_empty());
        }
        let mut column = 0usize;
        while column < columns {
            let first = column as u16;
            if let Some((label, alike)) = self.alike(columns.wrapping_sub(column)) {
                column = column.wrapping_add(alike);
                pass(first..column as u16, SheetsRef { labels: &[label], tests: 0 });
                continue;
            }
            column = column.wrapping_add(1);
            for (lists, cursor) in self.0.iter_mut().flatten() {
                let (sheets, next) = lists.take(*cursor);
                pass(first..column as u16, sheets);
                *cursor = next;
            }
        }
    }

    /// The one label that all cells in each of the next columns list, and how many these are, `most` at most; moves past them. `None` where those in the
    /// next one list others.
    #[inline(never)]
    fn alike(&mut self, most: usize) -> Option<(u8, usize)> {
        let &(first, cursor) = self.0.iter().flatten().next()?;
        let label = first.single(cursor)?;
        let mut alike = most;
        for &(lists, cursor) in self.0.iter().flatten() {
            (alike, _) = lists.alike(cursor, label, alike);
        }
        if alike == 0 {
            return None;
        }
        for (lists, cursor) in self.0.iter_mut().flatten() {
            (_, *cursor) = lists.alike(*cursor, label, alike);
        }
        Some((label, alike))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::{Chain, Layout, Trace, lay_out, sort};
    use crate::coder::Probability;
    use crate::format::{LabelRecord, MAX_SHEETS};
    use crate::grid::Grid;
    use crate::key::{Key, NONE, Setting};
    use crate::lists::{self, CHART, FIELD, Lists, Sheets};
    use crate::predict::Trial;
    use std::vec;
    use std::vec::Vec;

    /// A number below `end`, by chance.
    fn chance(seed: &mut u32, end: u32) -> u32 {
        *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (u64::from(*seed).wrapping_mul(u64::from(end)) >> 32) as u32
    }

    #[test]
    fn nodes_carry_what_the_cells_around_list() {
        const LABELS: usize = 6;
        let (grid, mut seed) = (Grid::new(80, 48, 3), 11u32);
        let cells = grid.columns * grid.rows;
        for round in 0..200 {
            // Patches of one label, and here and there cells of several, of which some are tested by a field.
            let mut wanted = [const { Vec::new() }; 2];
            for list in &mut wanted {
                let base = chance(&mut seed, 3);
                *list = (0..cells)
                    .map(|cell| {
                        let torn = chance(&mut seed, 4) == 0;
                        let mut sheets = Sheets::default();
                        for _ in 0..if torn { 2 + chance(&mut seed, 2) } else { 1 } {
                            let label =
                                if torn { chance(&mut seed, LABELS as u32) } else { base + u32::from(cell % grid.columns > 5) } as u8;
                            if !sheets.labels.contains(&label) && sheets.labels.push(label).is_err() {
                                break;
                            }
                        }
                        let fields = sheets.labels.len() > 1 && chance(&mut seed, 2) == 0;
                        sheets.tests = if fields { FIELD } else { CHART };
                        sheets
                    })
                    .collect::<Vec<Sheets>>();
            }
            let mut memory = [const { (Vec::new(), Vec::new()) }; 2];
            let both = memory.each_mut().map(|(rows, data)| {
                (*rows, *data) = (vec![0u16; grid.rows + 1], vec![0u8; cells * (MAX_SHEETS + 3)]);
                Lists::new(rows, data)
            });
            let mut contexts = [Probability::NEW; lists::CONTEXTS];
            let mut both = both;
            for (list, wanted) in both.iter_mut().zip(&wanted) {
                for row in 0..grid.rows {
                    lists::code_row(&mut Trial, &mut contexts, grid, LABELS, None, list, row, &mut |cell| {
                        wanted.get(cell).cloned().unwrap_or_default()
                    });
                }
            }
            // What the cells around a node list, in both intervals.
            let around = |column: usize, row: usize| {
                let cells = [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().filter_map(move |(x, y)| {
                    let (x, y) = (column.checked_add(x)?.checked_sub(1)?, row.checked_add(y)?.checked_sub(1)?);
                    (x < grid.columns && y < grid.rows).then_some(y * grid.columns + x)
                });
                cells.flat_map(|cell| wanted.iter().filter_map(move |list| list.get(cell)))
            };
            let backdrop = round % 2 == 1;
            let label =
                |label: u8| LabelRecord { flags: if backdrop && label == 0 { crate::format::FIXED } else { 0 }, ..LabelRecord::default() };
            let [before, after] = &both;
            let setting = Setting {
                grid,
                label,
                key_bits: 6,
                step_log2: 0,
                before: None,
                before_that: None,
                lists: [Some(before), Some(after)],
                planes: &[],
                views: &[],
            };
            let most = grid.node_columns() * LABELS;
            let (mut rows, mut chains) = (vec![0u16; grid.node_rows() + 1], vec![Chain::default(); most * grid.node_rows()]);
            let (mut uv, mut codes) = (vec![0u32; most * grid.node_rows()], [(); 2].map(|()| vec![0i8; most * grid.node_rows()]));
            let mut key = Key::new(&mut rows, &mut chains, &mut uv, codes.each_mut().map(Vec::as_mut_slice));
            let (mut traces, mut open, mut place) = (vec![Trace::default(); 2 * most], vec![0u16; LABELS], vec![0u16; most]);
            for row in 0..grid.node_rows() {
                let mut layout = Layout { traces: &mut traces, open: &mut open, place: &mut place };
                lay_out(&setting, &mut key, &mut layout, row);
                let mut carried = 0;
                for (index, chain) in key.chains(row).iter().enumerate() {
                    let at = usize::from(place.get(index).copied().unwrap_or(NONE)) + if row % 2 == 0 { 0 } else { most };
                    carried += usize::from(chain.nodes());
                    for (along, column) in (chain.first..chain.end).enumerate() {
                        let (mut listed, mut tested) = (false, false);
                        for sheets in around(column.into(), row) {
                            let known = sheets.labels.iter().position(|&label| u16::from(label) == chain.label);
                            listed |= known.is_some();
                            tested |= known == Some(0) && sheets.tests == FIELD;
                        }
                        assert!(listed, "round {round}: {chain:?} at {column}, {row}");
                        assert_eq!(traces.get(at + along).map(Trace::tested), Some(tested), "round {round}: {chain:?} at {column}, {row}");
                        assert!(!tested || chain.field != NONE, "round {round}: {chain:?} at {column}, {row}");
                    }
                }
                let carries = |column: usize, label: u8| around(column, row).any(|sheets| sheets.labels.contains(&label));
                let all = (0..grid.node_columns()).flat_map(|column| (0..LABELS as u8).map(move |label| (column, label)));
                assert_eq!(carried, all.filter(|&(column, label)| carries(column, label)).count(), "round {round}, row {row}: each once");
            }
        }
    }

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
