//! Torn cells: which of a cell's sheets each of its blocks can show, and which pixels of a block show which, worked out once for all rows of a strip.
//! Sheets come from `site`, tests from `coverage` and `span`; `plan` asks, `draw` paints what comes out.

use crate::atlas::Texture;
use crate::coverage::{Bounds, Cover, Edge};
use crate::form::Form;
use crate::format::MAX_SHEETS;
use crate::lists::{CHART, FIELD};
use crate::sheet::Sheet;
use crate::site::Site;
use crate::span::{self, Span};
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

    /// What lies around all positions of `forms` at these pixels.
    #[inline(never)]
    fn bounds(self, mut forms: [Form; 2], log2: u32) -> Bounds {
        let mut bounds = Bounds::NOTHING;
        for row in 0..1u32.wrapping_shl(log2) {
            let shown = self.row(row);
            if let Some(last) = shown.checked_ilog2() {
                let first = shown.trailing_zeros();
                let [u, v] = &forms;
                let from = [u.from([first, 0]), v.from([first, 0])];
                bounds = bounds.join(Span::new(&from).bounds(last.wrapping_sub(first).wrapping_add(1)));
            }
            forms.iter_mut().for_each(Form::next_row);
        }
        bounds
    }
}

impl Mixed {
    /// Works out the block's sides in strip `strip`, for positions that `room` has; how many of the `slots` they take.
    /// `None` where positions fit no window, or there is no room. The frontmost sheet that covers a pixel shows.
    #[inline(never)]
    pub fn share(&self, site: &Site<'_, '_, '_>, strip: u32, room: &Room, slots: &mut [Side]) -> Option<usize> {
        let log2 = site.block_log2();
        let offset = site.offset(self.block.into(), strip);
        let mut left = Shown::all(log2);
        let (mut sheets, mut sides) = (self.sheets, 0usize);
        while sheets != 0 && left != Shown::NONE {
            let place = usize::from(self.sheet).wrapping_add(sheets.trailing_zeros() as usize);
            sheets &= sheets.wrapping_sub(1);
            let sheet = &site.sheets.sheet.get(place)?.further(self.along);
            let cell = site.cell(sheet);
            let patch = site.block(&cell, offset);
            let bounds = patch.bounds();
            let mut shown = left;
            // The last one covers what is left.
            if sheets != 0 {
                let chart = site.chart(sheet);
                if sheet.test() != CHART {
                    for which in 0..if chart.strip() { 2 } else { 1 } {
                        // What is below zero where the field is above.
                        shown = shown.and(negative(site.field(sheet, which, offset).negated(), log2));
                    }
                }
                if sheet.test() != FIELD && shown != Shown::NONE {
                    let forms = site.forms(&cell, offset);
                    chart.crossed(&forms, &bounds, |Edge { beyond, upper }| {
                        let near = negative(beyond, log2);
                        shown = if upper { shown.and(near) } else { shown.and_not(near) };
                    });
                    if chart.masked() && shown != Shown::NONE {
                        shown = masked(shown, forms, log2, &site.texture);
                    }
                }
                if shown == Shown::NONE {
                    continue;
                }
            }
            left = left.and_not(shown);
            // What does not show may lie anywhere.
            let row = room.row(&bounds).or_else(|| room.row(&shown.bounds(site.forms(&cell, offset), log2)))?;
            *slots.get_mut(sides)? =
                Side { tile: room.window.tile(&patch, row, log2), shown, block: self.block, row, label: sheet.label().into() };
            sides = sides.wrapping_add(1);
        }
        Some(sides)
    }
}

/// At which pixels of a block `form` is below zero.
// Called from several places, and long.
#[inline(never)]
fn negative(mut form: Form, log2: u32) -> Shown {
    Shown::rows(log2, |_| {
        let row = form.negative(1u32.wrapping_shl(log2));
        form.next_row();
        row
    })
}

/// Those of the pixels that `shown` names whose texels the mask has.
#[inline(always)]
fn masked(shown: Shown, mut forms: [Form; 2], log2: u32, texture: &Texture<'_>) -> Shown {
    Shown::rows(log2, |row| {
        let shown = shown.row(row);
        let covered = if shown == 0 { 0 } else { span::covered(shown, Span::new(&forms), texture) };
        forms.iter_mut().for_each(Form::next_row);
        covered
    })
}

/// Which of a torn cell's `sheets` its block that is so far from its left upper corner can show, a bit each: those that cover part of it, in front of
/// the first that covers all of it.
#[must_use]
#[inline(never)]
pub fn candidates(site: &Site<'_, '_, '_>, offset: [u32; 2], sheets: &[Sheet]) -> u16 {
    let mut shown = 0u16;
    let mut bit = 1u16;
    let Some((_, before)) = sheets.split_last() else { return 0 };
    for sheet in before.iter().take(MAX_SHEETS - 1) {
        let Some(chart) = site.charts.get(usize::from(sheet.label())) else { break };
        let mut cover = Cover::All;
        if sheet.test() != CHART {
            for which in 0..if chart.strip() { 2 } else { 1 } {
                cover = cover.and(field_cover(site.field_corners(sheet, which, offset)));
            }
        }
        if sheet.test() != FIELD && cover != Cover::Nothing {
            cover = cover.and(chart.cover(&site.block(&site.cell(sheet), offset).bounds(), &site.texture));
        }
        if cover != Cover::Nothing {
            shown |= bit;
        }
        if cover == Cover::All {
            return shown;
        }
        bit = bit.wrapping_shl(1);
    }
    // The last one covers what is left.
    shown | bit
}

/// How much of a block a field of these values at its corners covers.
#[inline(always)]
fn field_cover([a, b, c, d]: [i32; 4]) -> Cover {
    // Rounding moves a field by less than this, Q16 pixels.
    const SLACK: i32 = 1024;
    if a > SLACK && b > SLACK && c > SLACK && d > SLACK {
        Cover::All
    } else if a < -SLACK && b < -SLACK && c < -SLACK && d < -SLACK {
        Cover::Nothing
    } else {
        Cover::Part
    }
}
