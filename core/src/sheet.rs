//! The sheets of a row of cells at one moment: where each one's corners and middles are.
//! Rows of nodes come from `row`, sheet lists from the caller's memory; spans go to `span`.

use crate::fixed::{PlayUv, part};
use crate::grid::Grid;
use crate::lists::Lists;
use crate::row::{Layer, NodeRow};
use crate::span::{Fields, Span};

/// One sheet of a cell, in caller's memory: its label, its test, and where its layers at the cell's left and right edge stand in the rows
/// above, halfway down and below. Halfway there is only where space is cubic.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sheet {
    left: [u16; 3],
    right: [u16; 3],
    label: u8,
    test: u8,
}

impl Sheet {
    /// The sheet's label.
    #[must_use]
    pub const fn label(&self) -> u8 {
        self.label
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
    /// Where space is cubic, every sheet's positions halfway across: above, halfway down, below.
    pub middle: &'m mut [[Layer; 3]],
}

/// The rows of nodes that bound a row of cells: above, halfway down, below. Where space is linear, the middle one is not looked at.
pub type Rows<'r, 'm> = [&'r NodeRow<'m>; 3];

impl RowSheets<'_> {
    /// Looks up the corners of every sheet that `lists` names in `row`. A sheet without a layer at a corner is left out:
    /// only broken bundles have such.
    pub fn fill(&mut self, grid: Grid, row: usize, lists: &Lists<'_>, rows: Rows<'_, '_>, cubic: bool) {
        let mut cursor = lists.row(row);
        let mut count = 0usize;
        for column in 0..grid.columns {
            if let Some(start) = self.start.get_mut(column) {
                *start = count as u16;
            }
            let right = column.wrapping_add(1);
            let listed = lists.sheets(cursor);
            for (index, &label) in listed.labels.iter().enumerate() {
                // Halfway down there is a layer wherever there is one above and below.
                let edge = |column: usize| {
                    let [top, middle, bottom] = rows;
                    let halfway = if cubic { middle.find(column, label)? } else { 0 };
                    Some([top.find(column, label)?, halfway, bottom.find(column, label)?])
                };
                if let (Some(left), Some(right)) = (edge(column), edge(right))
                    && let Some(sheet) = self.sheet.get_mut(count)
                {
                    *sheet = Sheet { left, right, label, test: listed.test(index) as u8 };
                    if cubic {
                        self.halve(count, column, rows);
                    }
                    count = count.wrapping_add(1);
                }
            }
            cursor = cursor.next(lists);
        }
        if let Some(start) = self.start.get_mut(grid.columns) {
            *start = count as u16;
        }
    }

    /// Works out the middles of sheet `index`, which lies in the cell in `column`.
    fn halve(&mut self, index: usize, column: usize, rows: Rows<'_, '_>) {
        let Some(&Sheet { left, right, label, .. }) = self.sheet.get(index) else { return };
        let points = rows.into_iter().zip(left.into_iter().zip(right));
        for (place, (row, (from, to))) in points.enumerate() {
            let before = column.checked_sub(1).and_then(|column| row.find(column, label));
            let after = row.find(column.wrapping_add(2), label);
            if let Some(slot) = self.middle.get_mut(index).and_then(|middles| middles.get_mut(place)) {
                *slot = Layer::middle(before.map(|at| row.layer(at)), row.layer(from), row.layer(to), after.map(|at| row.layer(at)));
            }
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

/// A part of a cell along one row of pixels: all of it, or a half where space is cubic.
#[derive(Clone, Copy, Debug)]
pub struct Part<'p, 'm> {
    /// The sheets.
    pub sheets: &'p RowSheets<'m>,
    /// The rows of nodes at the upper and the lower edge of the row of cells, and halfway down where space is cubic.
    pub rows: Rows<'p, 'm>,
    /// The side: `None`: all of the cell, false: its left half, true: its right half.
    pub half: Option<bool>,
    /// How far down the cell the pixels are.
    pub step: u32,
    /// The cell is 2^this pixels wide and high.
    pub log2: u32,
}

impl Part<'_, '_> {
    /// The sheet at `index` along the row.
    #[must_use]
    #[inline]
    pub fn span(&self, index: usize, sheet: &Sheet) -> Span {
        let [top, halfway, bottom] = self.rows;
        let Some(right) = self.half else {
            let edge = |[above, _, below]: [u16; 3]| down(top.layer(above), bottom.layer(below), self.step, self.log2);
            return Span::between(edge(sheet.left), edge(sheet.right), self.log2);
        };
        let log2 = self.log2.wrapping_sub(1);
        let (lower, step) = (self.step >> log2 != 0, self.step & (1u32 << log2).wrapping_sub(1));
        let outer = |[above, between, below]: [u16; 3]| {
            let (above, below) =
                if lower { (halfway.layer(between), bottom.layer(below)) } else { (top.layer(above), halfway.layer(between)) };
            down(above, below, step, log2)
        };
        let [above, between, below] = self.sheets.middle.get(index).copied().unwrap_or_default();
        let inner = if lower { down(between, below, step, log2) } else { down(above, between, step, log2) };
        if right { Span::between(inner, outer(sheet.right), log2) } else { Span::between(outer(sheet.left), inner, log2) }
    }

    /// The fields of a sheet along the row: straight from edge to edge of the cell, whatever space is.
    #[must_use]
    #[inline]
    pub fn fields(&self, sheet: &Sheet) -> Fields {
        let [top, _, bottom] = self.rows;
        let wide = |field: i16| i32::from(field).wrapping_shl(8);
        let edge = |[above, _, below]: [u16; 3]| {
            let ([a, b], [c, d]) = (top.field(above), bottom.field(below));
            [part(wide(a), wide(c), self.step, self.log2), part(wide(b), wide(d), self.step, self.log2)]
        };
        let fields = Fields::between(edge(sheet.left), edge(sheet.right), self.log2);
        if self.half == Some(true) { fields.after(1 << self.log2.wrapping_sub(1)) } else { fields }
    }
}

/// The position `step` pixels down the way from `top` to `bottom`, which are 2^`log2` pixels apart.
fn down(top: Layer, bottom: Layer, step: u32, log2: u32) -> PlayUv {
    let (top, bottom) = (top.uv(), bottom.uv());
    PlayUv { u: part(top.u, bottom.u, step, log2), v: part(top.v, bottom.v, step, log2) }
}
