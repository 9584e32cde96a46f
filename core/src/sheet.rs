//! The sheets of a row of cells at one moment: where each one's corners are, and how it bends between them.
//! Rows of nodes come from `row`, sheet lists from the caller's memory; `site` and those above it draw by them.

use crate::grid::Grid;
use crate::lists::Lists;
use crate::row::NodeRow;

/// One sheet of a cell, in caller's memory: its label, its test, and where its layer at the cell's left edge stands in the rows
/// above and below; that at the right edge is the next.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sheet {
    /// Above, below.
    nodes: [u16; 2],
    label: u8,
    test: u8,
}

impl Sheet {
    /// The sheet's label.
    #[must_use]
    pub const fn label(&self) -> u8 {
        self.label
    }

    /// Its layers at the cell's left edge: above, below.
    #[must_use]
    pub const fn nodes(&self) -> [u16; 2] {
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
    nodes: [u16; 2],
}

/// The rows of nodes that bound a row of cells: above, below.
pub type Rows<'r, 'm> = [&'r NodeRow<'m>; 2];

/// Where the layers of `label` stand in the cell in `column`, and in all those after it that have the same chains.
#[inline(never)]
fn look_up([top, bottom]: Rows<'_, '_>, label: u8, column: usize) -> Option<Found> {
    let ([above, high], [below, low]) = (top.find(label, column)?, bottom.find(label, column)?);
    let column = column as u16;
    Some(Found { column, end: column.wrapping_add(high.min(low)), nodes: [above, below] })
}

impl RowSheets<'_> {
    /// Looks up the corners of every sheet that `lists` names in `row`. A sheet without a layer at a corner is left out:
    /// only broken bundles have such.
    #[inline(never)]
    pub fn fill(&mut self, grid: Grid, row: usize, lists: &Lists<'_>, rows: Rows<'_, '_>) {
        let mut cursor = lists.row(row);
        let (mut count, mut column, mut stretches) = (0usize, 0usize, 0usize);
        // Nothing is known of any column.
        self.found.iter_mut().for_each(|found| found.end = 0);
        for stretch in self.stretch.iter_mut() {
            let Some(left) = grid.columns.checked_sub(column).filter(|&left| left > 0) else { break };
            let (listed, next) = lists.take(cursor);
            let (first, mut end) = (count, 0);
            for (label, test) in listed.each() {
                let Some((known, slot)) = self.found.get_mut(usize::from(label)).zip(self.sheet.get_mut(count)) else { continue };
                // Columns ascend: what was found for one to the left holds up to where one of its chains ends.
                if column >= usize::from(known.end) {
                    let Some(found) = look_up(rows, label, column) else { continue };
                    *known = found;
                }
                end = known.end;
                *slot = Sheet { nodes: known.nodes, label, test: test as u8 }.further((column as u16).wrapping_sub(known.column));
                count = count.wrapping_add(1);
            }
            cursor = next;
            let mut cells = 1usize;
            if let &[label] = listed.labels
                && count != first
            {
                let most = usize::from(end.wrapping_sub(column as u16));
                (cells, cursor) = lists.alike(cursor, label, most.min(left).saturating_sub(1));
                cells = cells.wrapping_add(1);
            }
            *stretch = Stretch { cells: cells as u16, sheet: first as u16, sheets: count.wrapping_sub(first) as u16 };
            stretches = stretches.wrapping_add(1);
            column = column.wrapping_add(cells);
        }
        self.stretches = stretches;
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
