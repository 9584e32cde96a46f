//! Torn cells: which of a cell's sheets each of its blocks can show, and which pixels of a block show which, worked out once for all rows of a strip.
//! Sheets come from `site`, tests from `coverage` and `span`; `plan` asks, `draw` paints what comes out.

use crate::atlas::Texture;
use crate::bounds::Bounds;
use crate::coverage::Cover;
use crate::form::Form;
use crate::format::MAX_SHEETS;
use crate::lists::{CHART, FIELD};
use crate::patch::{Axis, Patch};
use crate::sheet::Sheet;
use crate::site::Site;
use crate::span::{self, Span, Straight};
use crate::window::{Room, Tile};

/// A block that is drawn pixel by pixel: its positions fit no window, or its outlines are softened; in caller's memory.
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
}

/// What a torn block shows of one sheet, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Side {
    /// Where the sheet is, all over the block.
    pub tile: Tile,
    /// The pixels that show it.
    pub shown: Shown,
    /// The block, from the left.
    pub block: u32,
}

/// Pixels of a block of four or eight pixels: a byte a row, the leftmost pixel lowest, the first row's byte lowest of the first word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Shown([u32; 2]);

impl Shown {
    /// None.
    pub const NONE: Self = Self([0; 2]);

    /// All pixels of a block of 2^`log2`.
    const fn all(log2: u32) -> Self {
        if log2 == 2 { Self([0x0f0f_0f0f, 0]) } else { Self([u32::MAX; 2]) }
    }

    /// Those that `row` has in each row of a block of 2^`log2`.
    #[inline(always)]
    fn rows(log2: u32, mut row: impl FnMut(u32) -> u32) -> Self {
        let [mut upper, mut lower] = [0u32; 2];
        for next in 0..1u32.wrapping_shl(log2) {
            // The first row is shifted furthest.
            let made = row(next);
            (upper, lower) = ((upper >> 8) | lower << 24, (lower >> 8) | made << 24);
        }
        Self(if log2 == 2 { [lower, 0] } else { [upper, lower] })
    }

    /// The pixels of row `row`, a bit each.
    #[must_use]
    #[inline(always)]
    pub const fn row(self, row: u32) -> u32 {
        let [upper, lower] = self.0;
        (if row < 4 { upper } else { lower }).wrapping_shr(row.wrapping_mul(8)) & 0xff
    }

    /// Those of these bits, the first row's lowest: in two of a processor's registers.
    #[inline(always)]
    const fn from_bits(bits: u64) -> Self {
        Self([bits as u32, (bits >> 32) as u32])
    }

    /// Likewise as one number.
    #[inline(always)]
    const fn bits(self) -> u64 {
        let [low, high] = self.0;
        (high as u64) << 32 | low as u64
    }

    /// How many they are.
    #[inline(always)]
    const fn count(self) -> u32 {
        // Of each pair, then of each four, of which two sums fit into four bits.
        const fn fours(bits: u32) -> u32 {
            let pairs = bits.wrapping_sub(bits >> 1 & 0x5555_5555);
            (pairs & 0x3333_3333).wrapping_add(pairs >> 2 & 0x3333_3333)
        }
        let [upper, lower] = self.0;
        let sums = fours(upper).wrapping_add(fours(lower));
        (sums & 0x0f0f_0f0f).wrapping_add(sums >> 4 & 0x0f0f_0f0f).wrapping_mul(0x0101_0101) >> 24
    }

    /// All pixels of row `row`.
    const fn of(row: u32) -> Self {
        let bits = 0xffu32.wrapping_shl(row.wrapping_mul(8));
        if row < 4 { Self([bits, 0]) } else { Self([0, bits]) }
    }

    const fn or(self, other: Self) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([a | c, b | d])
    }

    const fn and(self, other: Self) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([a & c, b & d])
    }

    const fn and_not(self, other: Self) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([a & !c, b & !d])
    }

    /// Parts of these pixels of 2^`log2` rows, some rows each, whose positions by `forms` lie in one window each that `room` has, best from row `near` on:
    /// passed on with the window's first row. `None` where a row lies in no window, or `pass` has had enough.
    #[inline(never)]
    fn parts(
        self,
        mut forms: [Form; 2],
        log2: u32,
        (room, near): (&Room, u16),
        mut pass: impl FnMut(Self, u16) -> Option<()>,
    ) -> Option<()> {
        let (mut part, mut bounds, mut window) = (Self::NONE, Bounds::NOTHING, near);
        for row in 0..1u32.wrapping_shl(log2) {
            let shown = self.row(row);
            if let Some(last) = shown.checked_ilog2() {
                let here = Straight::new(&forms, row, log2).bounds(shown.trailing_zeros(), last);
                let all = bounds.join(here);
                (bounds, window) = match room.row(&all, window) {
                    Some(window) => (all, window),
                    None => {
                        pass(core::mem::take(&mut part), window)?;
                        (here, room.row(&here, window)?)
                    }
                };
                part = part.or(self.and(Self::of(row)));
            }
            forms.iter_mut().for_each(Form::next_row);
        }
        pass(part, window)
    }
}

/// What [`share`] made of a block.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// How many sides.
    pub sides: usize,
    /// How many sheets were looked at.
    pub sheets: u32,
    /// The side that most pixels show, of those whose sheets lie in its window all over the block.
    pub most: Option<usize>,
}

/// Works out the sides of block `block`, which is so far from the left upper corner of its torn cell of `sheets`, for positions that `room` has, best in the window
/// from row `near` on, into `slots`. `None` where positions fit no window, there is no room, or no sheet. The frontmost sheet that covers a pixel shows.
// Called from one place.
#[inline(always)]
pub fn share(
    site: &Site<'_, '_, '_>,
    block: u32,
    offset: [u32; 2],
    sheets: &[Sheet],
    (room, near): (&Room, u16),
    slots: &mut [Side],
) -> Option<Share> {
    let log2 = site.block_log2();
    let mut share = Share { sides: 0, sheets: 0, most: None };
    let (mut left, mut pixels, mut sheets) = (Shown::all(log2), 0, sheets);
    sheets.first()?;
    while let Some((sheet, behind)) = sheets.split_first() {
        sheets = behind;
        // The last one covers what is left.
        let tested = !behind.is_empty();
        let mut shown = left;
        if tested && sheet.test() != CHART {
            shown = shown.and(Shown::from_bits(above(site, sheet, offset)));
            if shown == Shown::NONE {
                share.sheets = share.sheets.wrapping_add(1);
                continue;
            }
        }
        let chart = if tested && sheet.test() != FIELD { site.charts.get(usize::from(sheet.label())) } else { None };
        let patch = site.block(sheet, offset);
        let bounds = patch.bounds();
        if let Some(chart) = chart {
            if chart.misses(&bounds) {
                continue;
            }
            chart.crossed([&patch.u, &patch.v], &bounds, |axis, edge| {
                let near = Shown::from_bits(negative(axis, edge.at, edge.reach(), log2));
                shown = if edge.upper { shown.and(near) } else { shown.and_not(near) };
            });
            if chart.masked() && shown != Shown::NONE && !chart.fills(&bounds, site.texture) {
                shown = Shown::from_bits(masked(shown, &patch, log2, site.texture));
            }
        }
        share.sheets = share.sheets.wrapping_add(1);
        if shown == Shown::NONE {
            continue;
        }
        left = left.and_not(shown);
        let mut add = |shown: Shown, row: u16| {
            let slot = slots.get_mut(share.sides)?;
            room.window.put(&mut slot.tile, &patch, sheet.label(), row, log2);
            (slot.shown, slot.block) = (shown, block);
            share.sides = share.sides.wrapping_add(1);
            Some(())
        };
        if let Some(row) = room.row(&bounds, near) {
            let count = shown.count();
            add(shown, row)?;
            if count > pixels {
                (share.most, pixels) = (Some(share.sides.wrapping_sub(1)), count);
            }
        } else {
            // What does not show may lie anywhere.
            shown.parts(patch.forms(log2), log2, (room, near), add)?;
        }
        if left == Shown::NONE {
            break;
        }
    }
    Some(share)
}

/// At which pixels of a block all fields of `sheet` are above zero.
// A function of its own: most sheets are tested by their charts, which has all registers then.
#[inline(never)]
fn above(site: &Site<'_, '_, '_>, sheet: &Sheet, offset: [u32; 2]) -> u64 {
    let log2 = site.block_log2();
    let mut shown = u64::MAX;
    for which in site.chart(sheet).fields() {
        let corners = site.field_corners(sheet, which, offset);
        match field_cover(corners) {
            Cover::Nothing => return 0,
            Cover::Part => {
                // What is below zero where the field is above. It bends nowhere: farthest from zero it is in a corner.
                let reach = corners.iter().fold(0, |reach, corner| corner.unsigned_abs().max(reach));
                shown &= negative(&Axis::new(corners.map(i32::wrapping_neg), [0; 2]), 0, reach, log2);
            }
            Cover::All => {}
        }
    }
    shown
}

/// At which pixels of a block `axis`, which is nowhere further from `edge` than `reach` there, is below it; whatever beside the block.
// Called from several places, and long.
#[inline(never)]
fn negative(axis: &Axis, edge: i32, reach: u32, log2: u32) -> u64 {
    let form = axis.form(log2);
    let mut pairs = Form { at: form.at.wrapping_sub(edge), ..form }.pairs(reach);
    let mut four = || (0..4).fold(0, |rows, _| rows >> 8 | pairs.next_negative());
    let upper = four();
    let lower = if log2 == 2 { 0 } else { four() };
    Shown([upper, lower]).bits()
}

/// Those of the pixels that `shown` names whose texels the mask has.
#[inline(never)]
fn masked(shown: Shown, patch: &Patch, log2: u32, texture: &Texture<'_>) -> u64 {
    let mut forms = patch.forms(log2);
    let covered = Shown::rows(log2, |row| {
        let shown = shown.row(row);
        let covered = if shown == 0 { 0 } else { span::covered(shown, Span::new(&forms), texture) };
        forms.iter_mut().for_each(Form::next_row);
        covered
    });
    covered.bits()
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
            for which in chart.fields() {
                cover = cover.and(field_cover(site.field_corners(sheet, which, offset)));
            }
        }
        if sheet.test() != FIELD && cover != Cover::Nothing {
            let bounds = site.block(sheet, offset).bounds();
            let chart = match chart.misses(&bounds) {
                true => Cover::Nothing,
                false if chart.fills(&bounds, site.texture) => Cover::All,
                false => Cover::Part,
            };
            cover = cover.and(chart);
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
