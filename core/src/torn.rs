//! Torn cells: which of a cell's sheets each of its blocks can show, and which pixels of a block show which, worked out once for all rows of a strip.
//! Sheets come from `site`, tests from `coverage` and `span`; `plan` asks, `draw` paints what comes out.

use crate::coverage::{Bounds, Cover, Edge};
use crate::format::MAX_SHEETS;
use crate::lists::{CHART, FIELD};
use crate::sheet::{Corners, Sheet};
use crate::site::Site;
use crate::span::{self, Field, Span};
use crate::window::{Room, Tile};

/// A block that shows several sheets, or whose positions fit no window, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Mixed {
    /// The block, from the left.
    pub block: u16,
    /// Its stretch of cells' first sheet,
    pub sheet: u16,
    /// and which of those cells it is in.
    pub along: u16,
    /// Which of the cell's sheets it can show, a bit each; the last of them covers what is left.
    pub sheets: u16,
    /// How many sides say all about it; none: it is drawn pixel by pixel.
    pub sides: u16,
}

/// What a mixed block shows of one sheet, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Side {
    /// Where the sheet is, all over the block.
    pub tile: Tile,
    /// The pixels that show it.
    pub shown: Shown,
    /// The block, from the left.
    pub block: u16,
    /// The window's first row.
    pub row: u16,
    /// The label.
    pub label: u32,
}

/// Pixels of a block of four or eight pixels: a byte a row, the leftmost pixel lowest, the first row's byte lowest of the first word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Shown([u32; 2]);

impl Shown {
    const NONE: Self = Self([0; 2]);

    /// All pixels of a block of 2^`log2`.
    const fn all(log2: u32) -> Self {
        if log2 == 2 { Self([0x0f0f_0f0f, 0]) } else { Self([u32::MAX; 2]) }
    }

    /// Those that `row` has in each row of a block of 2^`log2`.
    #[inline(always)]
    fn rows(log2: u32, mut row: impl FnMut(u32) -> u32) -> Self {
        let mut words = [0; 2];
        for next in 0..1u32.wrapping_shl(log2) {
            // The first row is the last of a word's to be shifted in.
            let [upper, lower] = &mut words;
            let word = if next < 4 { upper } else { lower };
            *word = (*word >> 8) | row(next) << 24;
        }
        Self(words)
    }

    /// The pixels of row `row`, a bit each.
    #[must_use]
    #[inline(always)]
    pub const fn row(self, row: u32) -> u32 {
        let [upper, lower] = self.0;
        (if row < 4 { upper } else { lower }).wrapping_shr(row.wrapping_mul(8)) & 0xff
    }

    const fn and(self, other: Self) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([a & c, b & d])
    }

    const fn and_not(self, other: Self) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([a & !c, b & !d])
    }

    /// What lies around all positions at these pixels of a block of 2^`log2` with such `corners`.
    #[inline(never)]
    fn bounds(self, corners: Corners, log2: u32) -> Bounds {
        let mut bounds = Bounds::NOTHING;
        for row in 0..1u32.wrapping_shl(log2) {
            let shown = self.row(row);
            let Some(last) = shown.checked_ilog2() else { continue };
            let span = Span::new(corners, row, log2);
            // A span is straight.
            bounds = bounds.join(Bounds::of(span.at(shown.trailing_zeros() as usize), span.at(last as usize)));
        }
        bounds
    }
}

/// Blocks of 2^2 or 2^this pixels have sides.
pub const SIDES_LOG2: u32 = 3;

impl Mixed {
    /// Works out the block's sides in strip `strip`, for positions that `room` has; how many of the `slots` they take.
    /// `None` where positions fit no window, there is no room, or blocks of such a size have no sides. The frontmost sheet that covers a pixel shows.
    #[inline(never)]
    pub fn share(&self, site: &Site<'_, '_, '_>, strip: u32, room: &Room, slots: &mut [Side]) -> Option<usize> {
        let log2 = site.log2();
        if log2 != 2 && log2 != SIDES_LOG2 {
            return None;
        }
        let block = site.block(self.block.into(), strip);
        let mut left = Shown::all(log2);
        let (mut sheets, mut sides) = (self.sheets, 0usize);
        while sheets != 0 && left != Shown::NONE {
            let place = usize::from(self.sheet).wrapping_add(sheets.trailing_zeros() as usize);
            sheets &= sheets.wrapping_sub(1);
            let sheet = &site.sheets.sheet.get(place)?.further(self.along);
            let corners = block.corners(sheet);
            let bounds = Bounds::around(&corners);
            let mut shown = left;
            // The last one covers what is left.
            if sheets != 0 {
                let chart = site.chart(sheet);
                if sheet.test() != CHART {
                    for which in 0..if chart.strip() { 2 } else { 1 } {
                        let (place, corners) = ((strip, self.block.into()), block.field(sheet, which));
                        let rows = if log2 == 2 { field_rows::<2> } else { field_rows::<3> };
                        shown = shown.and(rows(site, place, corners));
                    }
                }
                if sheet.test() != FIELD {
                    chart.crossed(&corners, &bounds, |Edge { beyond: [a, b, c, d], upper }| {
                        let near = if log2 == 2 { near_rows::<2>(a, b, c, d) } else { near_rows::<3>(a, b, c, d) };
                        let near = Shown(near.into());
                        shown = if upper { shown.and(near) } else { shown.and_not(near) };
                    });
                    if chart.masked() && shown != Shown::NONE {
                        shown = Shown::rows(log2, |row| match shown.row(row) {
                            0 => 0,
                            shown => span::covered(shown, Span::new(corners, row, log2), &site.texture),
                        });
                    }
                }
                if shown == Shown::NONE {
                    continue;
                }
            }
            left = left.and_not(shown);
            // What does not show may lie anywhere.
            let row = room.row(&bounds).or_else(|| room.row(&shown.bounds(corners, log2)))?;
            *slots.get_mut(sides)? =
                Side { tile: room.window.tile(corners, row, log2), shown, block: self.block, row, label: sheet.label().into() };
            sides = sides.wrapping_add(1);
        }
        Some(sides)
    }
}

/// Which pixels of a block lie on the near side of an edge that its corners are so far beyond, as [`Shown`] has them.
// Numbers alone go in and out in registers.
#[inline(never)]
fn near_rows<const LOG2: u32>(a: i32, b: i32, c: i32, d: i32) -> (u32, u32) {
    let Shown([upper, lower]) = Shown::rows(LOG2, |row| span::near([a, b, c, d], row, LOG2));
    (upper, lower)
}

/// At which pixels of block `block` of strip `strip` a field is positive, given what it is at the cell's corners.
#[inline(never)]
fn field_rows<const LOG2: u32>(site: &Site<'_, '_, '_>, (strip, block): (u32, u32), corners: [i32; 4]) -> Shown {
    let cell = site.bundle.grid().log2;
    // Pixels of the cell above the block, and to the left of it.
    let [above, left] = [strip, block].map(|blocks| blocks.wrapping_shl(LOG2) & 1u32.wrapping_shl(cell).wrapping_sub(1));
    Shown::rows(LOG2, |row| Field::new(corners, above.wrapping_add(row), cell, left).positive(1 << LOG2))
}

/// Which of a torn cell's `sheets` each of its blocks in strip `strip` can show, a bit each: those that cover part of it, in front of the
/// first that covers all of it. Where a cell is one block, the second is none.
#[must_use]
#[inline(never)]
pub fn candidates(site: &Site<'_, '_, '_>, strip: u32, sheets: &[Sheet]) -> [u16; 2] {
    let (cubic, lower) = (site.cubic(), strip & 1 == 1);
    let block = site.block(0, strip);
    let (mut left, mut right) = (Seen { sheets: 0, open: true }, Seen { sheets: 0, open: cubic });
    let mut bit = 1u16;
    let Some((_, before)) = sheets.split_last() else { return [0; 2] };
    for sheet in before.iter().take(MAX_SHEETS - 1) {
        let Some(chart) = site.charts.get(usize::from(sheet.label())) else { break };
        let (mut on_left, mut on_right) = (Cover::All, Cover::All);
        if sheet.test() != CHART {
            [on_left, on_right] = field_covers(block.field(sheet, 0), cubic, lower);
            if chart.strip() {
                let [left, right] = field_covers(block.field(sheet, 1), cubic, lower);
                (on_left, on_right) = (on_left.and(left), on_right.and(right));
            }
        }
        let (asked, asked_right) = (left.open && on_left != Cover::Nothing, right.open && on_right != Cover::Nothing);
        if sheet.test() != FIELD && (asked || asked_right) {
            let [a, b, c] = block.verticals(sheet);
            if asked {
                on_left = on_left.and(chart.cover([a, b], &site.texture));
            }
            if asked_right {
                on_right = on_right.and(chart.cover([b, c], &site.texture));
            }
        }
        left.see(bit, on_left);
        right.see(bit, on_right);
        if !left.open && !right.open {
            break;
        }
        bit = bit.wrapping_shl(1);
    }
    // The last one covers what is left.
    left.see(bit, Cover::All);
    right.see(bit, Cover::All);
    [left.sheets, right.sheets]
}

/// What is seen of a block, from front to back.
struct Seen {
    /// The sheets, a bit each.
    sheets: u16,
    /// Those behind them may show.
    open: bool,
}

impl Seen {
    /// The sheet of `bit` covers so much of it.
    #[inline(always)]
    fn see(&mut self, bit: u16, cover: Cover) {
        if self.open && cover != Cover::Nothing {
            self.sheets |= bit;
            self.open = cover != Cover::All;
        }
    }
}

/// How much of a cell's blocks in one of its strips a field of `corners` at the cell's corners covers: of the left one and the right one where
/// they are `quarters`, of the cell where not.
#[inline(always)]
fn field_covers([mut a, mut b, mut c, mut d]: [i32; 4], quarters: bool, lower: bool) -> [Cover; 2] {
    if !quarters {
        return [field_cover([a, b, c, d]); 2];
    }
    let middle = |x: i32, y: i32| x.wrapping_add(y) >> 1;
    let (left, right) = (middle(a, c), middle(b, d));
    if lower {
        (a, b) = (left, right);
    } else {
        (c, d) = (left, right);
    }
    let (above, below) = (middle(a, b), middle(c, d));
    [field_cover([a, above, c, below]), field_cover([above, b, below, d])]
}

/// How much of a block a field of these values at its corners covers.
#[inline(always)]
fn field_cover([a, b, c, d]: [i32; 4]) -> Cover {
    // Rounding moves a field by less than this, Q16 pixels.
    const SLACK: i32 = 64;
    if a > SLACK && b > SLACK && c > SLACK && d > SLACK {
        Cover::All
    } else if a < -SLACK && b < -SLACK && c < -SLACK && d < -SLACK {
        Cover::Nothing
    } else {
        Cover::Part
    }
}
