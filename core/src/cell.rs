//! A row of cells at one moment: every node's layers interpolated in time, every cell's sheets with
//! their four corners. Keys and lists come from the caller's memory, spans go to `span`.

use crate::atlas::Texture;
use crate::fixed::{KeyUv, PlayUv, blend, part};
use crate::grid::Grid;
use crate::key::Key;
use crate::lists::Lists;
use crate::span::Span;
use crate::timeline::WeightSet;

/// A layer at one moment.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Layer {
    u: i32,
    v: i32,
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
}

impl Around<'_, '_> {
    /// The layer of `label` at `node`, whose indices in the interval's two keys are known.
    fn blend(&self, node: usize, label: u8, [from, to]: [usize; 2], weights: &WeightSet) -> PlayUv {
        let outer = |key: Option<&Key<'_>>| key.and_then(|key| Some(key.uv(key.find(node, label)?)));
        let (before, after) = (outer(self.before), outer(self.after));
        let [both, no_first, no_last, neither] = weights;
        let weights = match (before, after) {
            (Some(_), Some(_)) => both,
            (None, Some(_)) => no_first,
            (Some(_), None) => no_last,
            (None, None) => neither,
        };
        let four = [before.unwrap_or_default(), self.from.uv(from), self.to.uv(to), after.unwrap_or_default()];
        PlayUv { u: blend(four.map(KeyUv::u), *weights), v: blend(four.map(KeyUv::v), *weights) }
    }
}

/// One row of nodes at one moment, in caller's memory.
#[derive(Debug)]
pub struct NodeRow<'m> {
    /// Where each node's layers start; one entry more than nodes in the row.
    pub start: &'m mut [u16],
    /// Labels, ascending at each node.
    pub label: &'m mut [u8],
    /// Positions.
    pub layer: &'m mut [Layer],
}

impl NodeRow<'_> {
    /// Fills the row with the layers that both ends of the interval carry, weighted. Returns how many there are.
    pub fn fill(&mut self, grid: Grid, row: usize, keys: &Around<'_, '_>, weights: &WeightSet, texture: &Texture<'_>) -> u32 {
        let first = row.wrapping_mul(grid.node_columns());
        let mut count = 0usize;
        for column in 0..grid.node_columns() {
            if let Some(start) = self.start.get_mut(column) {
                *start = count as u16;
            }
            let node = first.wrapping_add(column);
            let (mut index, labels) = keys.from.node(node);
            for &label in labels {
                if let Some(other) = keys.to.find(node, label)
                    && let Some((slot, layer)) = self.label.get_mut(count).zip(self.layer.get_mut(count))
                {
                    let uv = texture.clamp(keys.blend(node, label, [index, other], weights));
                    *slot = label;
                    *layer = Layer { u: uv.u, v: uv.v };
                    count = count.wrapping_add(1);
                }
                index = index.wrapping_add(1);
            }
        }
        if let Some(start) = self.start.get_mut(grid.node_columns()) {
            *start = count as u16;
        }
        count as u32
    }

    fn find(&self, column: usize, label: u8) -> Option<u16> {
        let at = |column: usize| self.start.get(column).map_or(0, |&at| usize::from(at));
        let (from, to) = (at(column), at(column.wrapping_add(1)));
        let place = self.label.get(from..to)?.iter().position(|&l| l == label)?;
        Some(from.wrapping_add(place) as u16)
    }

    fn uv(&self, layer: u16) -> PlayUv {
        self.layer.get(usize::from(layer)).map_or_else(PlayUv::default, |l| PlayUv { u: l.u, v: l.v })
    }
}

/// One sheet of a cell: its label and its layers at the cell's four corners.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sheet {
    top: [u16; 2],
    bottom: [u16; 2],
    label: u16,
}

impl Sheet {
    /// The sheet's label.
    #[must_use]
    pub const fn label(&self) -> u8 {
        self.label as u8
    }

    /// The sheet along pixel row `step` of the cell.
    #[must_use]
    pub fn span(&self, top: &NodeRow<'_>, bottom: &NodeRow<'_>, step: u32, log2: u32) -> Span {
        let edge = |above: u16, below: u16| {
            let (above, below) = (top.uv(above), bottom.uv(below));
            PlayUv { u: part(above.u, below.u, step, log2), v: part(above.v, below.v, step, log2) }
        };
        let ([a, b], [c, d]) = (self.top, self.bottom);
        Span::between(edge(a, c), edge(b, d), log2)
    }
}

/// The sheets of a row of cells, in caller's memory.
#[derive(Debug)]
pub struct RowSheets<'m> {
    /// Where each cell's sheets start; one entry more than cells in the row.
    pub start: &'m mut [u16],
    /// Front to back.
    pub sheet: &'m mut [Sheet],
}

impl RowSheets<'_> {
    /// Looks up the corners of every sheet that `lists` names in `row`. A sheet without a layer at a corner is left out:
    /// only broken bundles have such.
    pub fn fill(&mut self, grid: Grid, row: usize, lists: &Lists<'_>, top: &NodeRow<'_>, bottom: &NodeRow<'_>) {
        let mut cursor = lists.row(row);
        let mut count = 0usize;
        for column in 0..grid.columns {
            if let Some(start) = self.start.get_mut(column) {
                *start = count as u16;
            }
            let right = column.wrapping_add(1);
            for &label in lists.sheets(cursor) {
                let corners = (top.find(column, label), top.find(right, label), bottom.find(column, label), bottom.find(right, label));
                if let (Some(a), Some(b), Some(c), Some(d)) = corners
                    && let Some(sheet) = self.sheet.get_mut(count)
                {
                    *sheet = Sheet { top: [a, b], bottom: [c, d], label: u16::from(label) };
                    count = count.wrapping_add(1);
                }
            }
            cursor = cursor.next(lists);
        }
        if let Some(start) = self.start.get_mut(grid.columns) {
            *start = count as u16;
        }
    }

    /// The sheets of the cell in `column`, front to back.
    #[must_use]
    pub fn cell(&self, column: usize) -> &[Sheet] {
        let at = |column: usize| self.start.get(column).map_or(0, |&at| usize::from(at));
        self.sheet.get(at(column)..at(column.wrapping_add(1))).unwrap_or(&[])
    }
}
