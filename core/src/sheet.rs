//! The sheets of a row of cells at one moment: where each one's corners and middles are.
//! Rows of nodes come from `row`, sheet lists from the caller's memory; spans go to `span`.

use crate::fixed::PlayUv;
use crate::grid::Grid;
use crate::lists::Lists;
use crate::row::{Layer, NodeRow, Walk, partner};

/// One sheet of a cell, in caller's memory: its label, its test, and where its layers at the cell's left and right edge stand in the rows
/// above, halfway down and below. Halfway there is only where space is cubic.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sheet {
    /// Above, halfway down, below: left and right.
    nodes: [[u16; 2]; 3],
    label: u8,
    test: u8,
}

impl Sheet {
    /// The sheet's label.
    #[must_use]
    pub const fn label(&self) -> u8 {
        self.label
    }

    /// Its layers at the cell's left and right edge in row `place` of the three.
    #[must_use]
    #[inline(always)]
    pub fn nodes(&self, place: usize) -> Option<[u16; 2]> {
        self.nodes.get(place).copied()
    }

    /// The sheet's coverage test: one of [`crate::lists`]'s.
    #[must_use]
    pub const fn test(&self) -> u16 {
        self.test as u16
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

/// The rows of nodes that bound a row of cells: above, halfway down, below. Where space is linear, the middle one is not looked at.
pub type Rows<'r, 'm> = [&'r NodeRow<'m>; 3];

impl RowSheets<'_> {
    /// Looks up the corners of every sheet that `lists` names in `row`. A sheet without a layer at a corner is left out:
    /// only broken bundles have such.
    #[inline(never)]
    pub fn fill(&mut self, grid: Grid, row: usize, lists: &Lists<'_>, rows: Rows<'_, '_>, cubic: bool) {
        let mut cursor = lists.row(row);
        let mut count = 0usize;
        let [mut above, mut between, mut below] = rows.map(NodeRow::walk);
        let [top, middle, bottom] = rows.map(NodeRow::links);
        for start in self.start.iter_mut().take(grid.columns) {
            *start = count as u16;
            above.step();
            between.step();
            below.step();
            let listed = lists.sheets(cursor);
            for (index, &label) in listed.labels.iter().enumerate() {
                // Halfway down there is a layer wherever there is one above and below.
                let halfway = if cubic { corner(&between, middle, label) } else { Some([0, 0]) };
                if let (Some(above), Some(halfway), Some(below)) = (corner(&above, top, label), halfway, corner(&below, bottom, label))
                    && let Some(sheet) = self.sheet.get_mut(count)
                {
                    *sheet = Sheet { nodes: [above, halfway, below], label, test: listed.test(index) as u8 };
                    count = count.wrapping_add(1);
                }
            }
            cursor = cursor.next(lists);
        }
        if let Some(start) = self.start.get_mut(grid.columns) {
            *start = count as u16;
        }
    }

    /// The sheets of the cell in `column`, front to back, and the index of the first.
    #[must_use]
    pub fn cell(&self, column: usize) -> (usize, &[Sheet]) {
        let at = |column: usize| self.start.get(column).map_or(0, |&at| usize::from(at));
        let from = at(column);
        (from, self.sheet.get(from..at(column.wrapping_add(1))).unwrap_or(&[]))
    }
}

/// The layers of `label` at a node of a row and at the one to the right of it.
#[inline(always)]
fn corner(walk: &Walk<'_>, links: &[u16], label: u8) -> Option<[u16; 2]> {
    let left = walk.find(label)?;
    Some([left as u16, partner(*links.get(left)?)?])
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
        let [[a, d], [b, e], [c, f]] = sheet.nodes;
        let Some([right, lower]) = self.quarter else {
            return [top.layer(a), top.layer(d), bottom.layer(c), bottom.layer(f)].map(Layer::uv);
        };
        let (above, below) = if lower { ((halfway, b, e), (bottom, c, f)) } else { ((top, a, d), (halfway, b, e)) };
        let edge = |(row, left, partner): (&NodeRow<'_>, u16, u16)| {
            if right { [row.halfway(left), row.layer(partner)] } else { [row.layer(left), row.halfway(left)] }
        };
        let ([a, b], [c, d]) = (edge(above), edge(below));
        [a, b, c, d].map(Layer::uv)
    }

    /// Field `which` of `sheet` at the cell's corners, Q16 pixels: straight from edge to edge of the cell, whatever space is.
    #[must_use]
    #[inline(always)]
    pub fn field(&self, sheet: &Sheet, which: usize) -> [i32; 4] {
        let [top, _, bottom] = self.rows;
        let [[a, d], _, [c, f]] = sheet.nodes;
        let wide = |fields: [i16; 2]| i32::from(if which == 0 { fields[0] } else { fields[1] }).wrapping_shl(8);
        [top.field(a), top.field(d), bottom.field(c), bottom.field(f)].map(wide)
    }
}
