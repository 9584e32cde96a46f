//! The layers of a key, node by node: which labels each node carries follows from the sheet lists around it; positions are
//! coded by `predict`, fields by `field`. Described once, for decoder and encoder alike: bits come from (or go to)
//! `coder`, layers go to the caller's memory as a `key`.
//!
//! A node carries one layer for every label in the lists of the cells that touch it, in the interval before its key and
//! in the one after.

use crate::coder::{Bits, Probability};
use crate::field;
use crate::format::{LabelRecord, MAX_NODE_LAYERS};
use crate::key::{Key, Setting, Source, Spot};
use crate::lists::{CHART, Cursor, Lists, SheetsRef};
use crate::predict;
pub use crate::predict::Trace;
use heapless::Vec;

/// Contexts a key is coded with: for positions, then for fields.
pub const CONTEXTS: usize = predict::CONTEXTS + field::CONTEXTS;

/// Codes the layers of one `row` of a key's nodes into `target`, which holds those of the rows above, in `contexts` ([`CONTEXTS`] of
/// them). `traces` holds two rows of nodes' worth of [`Trace`]s, half of it each.
pub fn code_row<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    target: &mut Key<'_>,
    traces: &mut [Trace],
    row: usize,
    source: &mut S,
) {
    let grid = setting.grid;
    let Some((positions, fields)) = contexts.split_at_mut_checked(predict::CONTEXTS) else { return };
    let mut node = row.wrapping_mul(grid.node_columns());
    // The row above has left where it ends: what is coded needs no memory of its own from row to row.
    let mut layer = if row == 0 { 0 } else { target.start.get(node).map_or(0, |&at| usize::from(at)) };
    let mut around = Corner::new(setting.lists, row);
    let row_start = layer;
    for column in 0..grid.node_columns() {
        if let Some(start) = target.start.get_mut(node) {
            *start = layer as u16;
        }
        let mut labels: Vec<Found, MAX_NODE_LAYERS> = Vec::new();
        around.labels(column < grid.columns, &mut labels);
        let end = layer.wrapping_add(labels.len());
        // A node that breaks the key's bound carries nothing.
        let fits = end <= target.label.len() && end.wrapping_sub(row_start) <= traces.len() / 2;
        if !fits {
            labels.clear();
        }
        for (index, found) in (layer..).zip(&labels) {
            if let Some(slot) = target.label.get_mut(index) {
                *slot = found.label;
            }
        }
        if let Some(start) = target.start.get_mut(node.wrapping_add(1)) {
            *start = layer.wrapping_add(labels.len()) as u16;
        }
        for found in &labels {
            let spot = Spot { node, row, column, label: found.label, layer };
            let coded = predict::code(bits, positions, setting, target, traces, &spot, found.support, source);
            if let Some(slot) = target.uv.get_mut(layer) {
                *slot = coded.0;
            }
            field::code(bits, fields, setting, target, &spot, found.tested, source);
            layer = layer.wrapping_add(1);
        }
        node = node.wrapping_add(1);
    }
}

/// A label in the cells around a node.
struct Found {
    label: u8,
    /// How many of the cells show it.
    support: u8,
    /// Some cell tests its fields.
    tested: bool,
}

/// The cells around a node as a row of nodes is walked: above and below, in the interval before and after.
struct Corner<'l, 'm> {
    /// The cells to the left of the node, and those to the right with their lists.
    left: [SheetsRef<'l>; 4],
    right: [Option<(&'l Lists<'m>, Cursor)>; 4],
}

impl<'l, 'm> Corner<'l, 'm> {
    fn new([before, after]: [Option<&'l Lists<'m>>; 2], row: usize) -> Self {
        let at = |list: Option<&'l Lists<'m>>, row: Option<usize>| list.zip(row).map(|(list, row)| (list, list.row(row)));
        let above = row.checked_sub(1);
        Self { left: [SheetsRef::default(); 4], right: [at(before, above), at(before, Some(row)), at(after, above), at(after, Some(row))] }
    }

    /// Collects the labels of the cells around the node, ascending; then moves on.
    fn labels(&mut self, inside: bool, found: &mut Vec<Found, MAX_NODE_LAYERS>) {
        for (left, right) in self.left.iter_mut().zip(&mut self.right) {
            let mut sheets = SheetsRef::default();
            if let Some((list, cursor)) = right.as_mut().filter(|_| inside) {
                sheets = list.sheets(*cursor);
                *cursor = cursor.past(sheets);
            }
            collect(*left, found);
            collect(sheets, found);
            *left = sheets;
        }
    }
}

/// Adds what a cell's `sheets` say about its nodes.
fn collect(sheets: SheetsRef<'_>, found: &mut Vec<Found, MAX_NODE_LAYERS>) {
    for (index, &label) in sheets.labels.iter().enumerate() {
        let tested = sheets.test(index) != CHART;
        // A few at most: a walk finds the place as fast as any search.
        let at = found.iter().take_while(|other| other.label < label).count();
        let full = found.is_full();
        match found.get_mut(at) {
            Some(other) if other.label == label => {
                other.support = other.support.saturating_add(1);
                other.tested |= tested;
            }
            // Labels past the bound of a node are left out; its cells do without them.
            _ if full => {}
            _ => {
                // Each makes room for the one before it.
                let mut moved = Found { label, support: 1, tested };
                for slot in found.iter_mut().skip(at) {
                    core::mem::swap(slot, &mut moved);
                }
                let _ = found.push(moved);
            }
        }
    }
}
