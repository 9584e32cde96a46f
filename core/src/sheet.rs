//! The sheets of a row of cells at one moment: where each one's corners and middles are.
//! Rows of nodes come from `row`, sheet lists from the caller's memory; spans go to `span`.

use crate::fixed::PlayUv;
use crate::grid::Grid;
use crate::lists::Lists;
use crate::row::{Layer, NodeRow};

/// One sheet of a cell, in caller's memory: its label, its test, and where its layer at the cell's left edge stands in the rows
/// above, halfway down and below; that at the right edge is the next. Halfway there is only where space is cubic.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sheet {
    /// Above, halfway down, below.
    nodes: [u16; 3],
    label: u8,
    test: u8,
}

impl Sheet {
    /// The sheet's label.
    #[must_use]
    pub const fn label(&self) -> u8 {
        self.label
    }

    /// Its layers at the cell's left edge: above, halfway down, below.
    #[must_use]
    pub const fn nodes(&self) -> [u16; 3] {
        self.nodes
    }

    /// The sheet's coverage test: one of [`crate::lists`]'s.
    #[must_use]
    pub const fn test(&self) -> u16 {
        self.test as u16
    }

    /// The same sheet in the `cells`-th cell to the right.
    #[must_use]
    #[inline(always)]
    pub fn further(&self, cells: u16) -> Self {
        Self { nodes: self.nodes.map(|node| node.wrapping_add(cells)), ..*self }
    }
}

/// Neighbouring cells that show the same sheet, or one cell that shows any number of them, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Stretch {
    /// How many cells.
    pub cells: u16,
    /// The first sheet, of the first cell.
    pub sheet: u16,
    /// How many sheets.
    pub sheets: u16,
}

/// The sheets of a row of cells, in caller's memory.
#[derive(Debug, Default)]
pub struct RowSheets<'m> {
    /// The cells, from left to right: as much room as there are cells.
    pub stretch: &'m mut [Stretch],
    /// How many stretches there are.
    pub stretches: usize,
    /// Front to back.
    pub sheet: &'m mut [Sheet],
    /// Where each label's layers were found last.
    pub found: &'m mut [Found],
}

/// Where the layers of a label stand, in neighbouring cells, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Found {
    /// The first of these cells,
    column: u16,
    /// and the one after the last.
    end: u16,
    /// In the first: see [`Sheet`].
    nodes: [u16; 3],
}

/// The rows of nodes that bound a row of cells: above, halfway down, below. Where space is linear, the middle one is not looked at.
pub type Rows<'r, 'm> = [&'r NodeRow<'m>; 3];

/// Where the layers of `label` stand in the cell in `column`, and in all those after it that have the same chains.
#[inline(never)]
fn look_up([top, halfway, bottom]: Rows<'_, '_>, cubic: bool, label: u8, column: usize) -> Option<Found> {
    let ([above, high], [below, low]) = (top.find(label, column)?, bottom.find(label, column)?);
    // Halfway down there is a layer wherever there is one above and below.
    let [between, _] = if cubic { halfway.find(label, column)? } else { [0; 2] };
    let column = column as u16;
    Some(Found { column, end: column.wrapping_add(high.min(low)), nodes: [above, between, below] })
}

impl RowSheets<'_> {
    /// Looks up the corners of every sheet that `lists` names in `row`. A sheet without a layer at a corner is left out:
    /// only broken bundles have such.
    #[inline(never)]
    pub fn fill(&mut self, grid: Grid, row: usize, lists: &Lists<'_>, rows: Rows<'_, '_>, cubic: bool) {
        let mut cursor = lists.row(row);
        let mut count = 0usize;
        let mut column = 0usize;
        self.stretches = 0;
        // Nothing is known of any column.
        self.found.iter_mut().for_each(|found| found.end = 0);
        for stretch in self.stretch.iter_mut() {
            let Some(left) = grid.columns.checked_sub(column).filter(|&left| left > 0) else { break };
            let listed = lists.sheets(cursor);
            let first = count;
            let mut cells = 1usize;
            cursor = cursor.next(lists);
            for (index, &label) in listed.labels.iter().enumerate() {
                // Columns ascend: what was found for one to the left holds up to where one of its chains ends.
                let Some((known, slot)) = self.found.get_mut(usize::from(label)).zip(self.sheet.get_mut(count)) else { continue };
                if column >= usize::from(known.end) {
                    let Some(found) = look_up(rows, cubic, label, column) else { continue };
                    *known = found;
                }
                let (along, most) = ((column as u16).wrapping_sub(known.column), known.end.wrapping_sub(column as u16));
                *slot = Sheet { nodes: known.nodes, label, test: listed.test(index) as u8 }.further(along);
                count = count.wrapping_add(1);
                if listed.labels.len() == 1 {
                    let more = usize::from(most).min(left).saturating_sub(1);
                    (cells, cursor) = lists.alike(cursor, label, more);
                    cells = cells.wrapping_add(1);
                }
            }
            *stretch = Stretch { cells: cells as u16, sheet: first as u16, sheets: count.wrapping_sub(first) as u16 };
            self.stretches = self.stretches.wrapping_add(1);
            column = column.wrapping_add(cells);
        }
    }

    /// The stretches, from left to right.
    #[must_use]
    pub fn stretches(&self) -> &[Stretch] {
        self.stretch.get(..self.stretches).unwrap_or(&[])
    }

    /// The sheets of a stretch's first cell, front to back.
    #[must_use]
    pub fn of(&self, stretch: Stretch) -> &[Sheet] {
        let from = usize::from(stretch.sheet);
        self.sheet.get(from..from.wrapping_add(stretch.sheets.into())).unwrap_or(&[])
    }
}

/// A block of a cell: all of it, or a quarter where space is cubic; with straight lines in between.
#[derive(Clone, Copy, Debug)]
pub struct Block<'p, 'm> {
    /// The rows of nodes at the upper and the lower edge of the row of cells, and halfway down where space is cubic.
    pub rows: Rows<'p, 'm>,
    /// Cells are quartered: which quarter this is, rightwards and downwards.
    pub quarter: Option<[bool; 2]>,
}

/// The positions at the corners of a block: above left and right, below left and right.
pub type Corners = [PlayUv; 4];

impl Block<'_, '_> {
    /// Where `sheet` has the block's corners.
    #[must_use]
    #[inline(always)]
    pub fn corners(&self, sheet: &Sheet) -> Corners {
        let [top, halfway, bottom] = self.rows;
        let [a, b, c] = sheet.nodes;
        let Some([right, lower]) = self.quarter else {
            let ([a, b], [c, d]) = (top.ends(a), bottom.ends(c));
            return [a, b, c, d].map(|layer| layer.uv());
        };
        let (above, below) = if lower { ((halfway, b), (bottom, c)) } else { ((top, a), (halfway, b)) };
        let edge = |(row, left): (&NodeRow<'_>, u16)| {
            let &[from, middle, to] = row.thirds(left);
            if right { [middle, to] } else { [from, middle] }
        };
        let ([a, b], [c, d]) = (edge(above), edge(below));
        [a, b, c, d].map(|layer| layer.uv())
    }

    /// The ends, above and below, of the left edges of `sheet` in the block and in the one to the right of it, and of the right edge of that one; if
    /// cells are not quartered, there is no other block: of the cell's edges.
    #[must_use]
    #[inline(always)]
    pub fn verticals(&self, sheet: &Sheet) -> [[PlayUv; 2]; 3] {
        let [top, halfway, bottom] = self.rows;
        let [a, b, c] = sheet.nodes;
        let between = |(above, below): (&Layer, &Layer)| [above.uv(), below.uv()];
        let (above, below) = match self.quarter {
            None => {
                let ([a, b], [c, d]) = (top.ends(a), bottom.ends(c));
                let right = between((b, d));
                return [between((a, c)), right, right];
            }
            Some([_, false]) => (top.thirds(a), halfway.thirds(b)),
            Some([_, true]) => (halfway.thirds(b), bottom.thirds(c)),
        };
        let ([a, b, c], [d, e, f]) = (above, below);
        [(a, d), (b, e), (c, f)].map(between)
    }

    /// Field `which` of `sheet` at the cell's corners, Q16 pixels: straight from edge to edge of the cell, whatever space is.
    #[must_use]
    #[inline(always)]
    pub fn field(&self, sheet: &Sheet, which: usize) -> [i32; 4] {
        let [top, _, bottom] = self.rows;
        let [a, _, c] = sheet.nodes;
        let wide = |fields: [i16; 2]| i32::from(if which == 0 { fields[0] } else { fields[1] }).wrapping_shl(8);
        let ([a, b], [c, d]) = (top.fields(a), bottom.fields(c));
        [a, b, c, d].map(wide)
    }
}
