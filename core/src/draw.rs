//! Draws rows of pixels: plans a strip when its first row is asked for, then runs and mixed blocks of one row after the other.
//! The plan is in the caller's memory; pixels go to the caller's row, as `player` asks.

use crate::Bundle;
use crate::fixed::PlayUv;
use crate::lists::{CHART, FIELD};
use crate::memory::Workspace;
use crate::plan::{Mixed, Plan, Run, Site, TILE_LOG2, Tile};
use crate::span::{self, Field, Packed, Span};
use crate::work::{Probe, Work};

/// What pixels are made of positions.
pub trait Paint {
    /// A pixel.
    type Pixel: Copy + Default;
    /// Drawn for every frame, so that loops for the usual sizes of blocks are worth their code.
    const OFTEN: bool;

    /// How far around a position pixels are told from, Q16 texels.
    const REACH: i32;

    /// The pixel at `uv`, which is inside the picture; `x`: whether it is an odd one of its row.
    fn at(&self, uv: PlayUv, label: u8, x: usize) -> Self::Pixel;

    /// A run's pixels, in windows of 2^ROWS rows of 2^WIDTH texels, `TEXELS` in all; `log2`: of a tile's pixels.
    fn run<const WIDTH: u32, const ROWS: u32, const TEXELS: usize>(&self, run: Run, tiles: &mut [Tile], out: &mut [Self::Pixel], log2: u32);
}

/// Where pixels come from.
#[derive(Debug)]
pub struct Probes;

impl Paint for Probes {
    type Pixel = Probe;
    const OFTEN: bool = false;
    const REACH: i32 = 0;

    fn at(&self, uv: PlayUv, label: u8, _: usize) -> Probe {
        Probe { label, at: uv }
    }

    fn run<const WIDTH: u32, const ROWS: u32, const TEXELS: usize>(&self, run: Run, tiles: &mut [Tile], out: &mut [Probe], log2: u32) {
        let label = run.label as u8;
        span::any_run(tiles, out, log2, [0; 2], |at: Packed<WIDTH, ROWS>| Probe { label, at: at.at(run.row) });
    }
}

/// A loaded row of cells, ready to be drawn.
#[derive(Debug)]
pub struct Drawing<'d, 'a> {
    site: Site<'d, 'a, 'd>,
    plan: &'d mut Plan<'a>,
}

impl<'d, 'a> Drawing<'d, 'a> {
    /// The row of cells that `space` holds, and the palette.
    pub fn new(bundle: &'d Bundle<'a>, space: &'d mut Workspace<'a>) -> (Self, &'d [u16])
    where
        'a: 'd,
    {
        let Workspace { texture, rows: [_, top, bottom, _], halfway, sheets, charts, plan, palette, .. } = space;
        let site = Site { bundle, texture: *texture, rows: [top, halfway, bottom], sheets, charts };
        (Self { site, plan }, palette)
    }

    /// Draws pixel row `y`, which lies in the row of cells.
    #[inline(always)]
    pub fn row<P: Paint>(&mut self, y: u32, out: &mut [P::Pixel], work: &mut Work, paint: &P) {
        let out = self.runs(y, out, work, paint);
        // Cells of eight pixels, whole or by quarters, are the rule; with numbers that are known the code is a third shorter to run.
        match (self.site.log2(), self.site.bundle.grid().log2) {
            (2, 3) if P::OFTEN => mix::<P, 2>(&self.site, self.mixed(), y, out, paint),
            (3, 3) if P::OFTEN => mix::<P, 3>(&self.site, self.mixed(), y, out, paint),
            _ => mix::<P, ANY>(&self.site, self.mixed(), y, out, paint),
        }
    }

    /// Draws the runs of pixel row `y`. What there is of `out` on the screen comes back: its mixed blocks are still to be drawn.
    #[inline(always)]
    fn runs<'o, P: Paint>(&mut self, y: u32, out: &'o mut [P::Pixel], work: &mut Work, paint: &P) -> &'o mut [P::Pixel] {
        let log2 = self.site.tile_log2();
        let (strip, row) = (y >> log2, y & (1u32 << log2).wrapping_sub(1));
        if self.plan.strip != Some(strip) || self.plan.row > row || self.plan.reach != P::REACH {
            self.plan.make(&self.site, strip, P::REACH);
        }
        self.plan.skip_to(row);
        let width = self.site.bundle.size().0 as usize;
        let drawn = out.len().min(width);
        let out = out.get_mut(..drawn).unwrap_or(&mut []);
        let Plan { tile, run: runs, runs: count, .. } = &mut *self.plan;
        for &run in runs.get(..*count).unwrap_or(&[]) {
            let first = usize::from(run.tile);
            let Some(tiles) = tile.get_mut(first..first.wrapping_add(run.count.into())) else { continue };
            let from = usize::from(run.place).wrapping_shl(log2);
            let to = usize::from(run.place).wrapping_add(run.count.into()).wrapping_shl(log2);
            match out.get_mut(from..to) {
                Some(pixels) => by_width(paint, run, tiles, pixels, log2, self.site.bundle.texture().width_log2),
                None => cut(paint, run, tiles, out, log2, self.site.bundle.texture().width_log2),
            }
        }
        self.plan.row = row.wrapping_add(1);
        work.smooth_pixels = work.smooth_pixels.wrapping_add(self.plan.smooth);
        work.torn_pixels = work.torn_pixels.wrapping_add(self.plan.torn);
        work.coverage_tests = work.coverage_tests.wrapping_add(self.plan.tests);
        out
    }

    /// The strip's mixed blocks.
    fn mixed(&self) -> &[Mixed] {
        self.plan.mixed.get(..self.plan.mixes).unwrap_or(&[])
    }

    /// Draws pixel row `y` like [`Drawing::row`], but every pixel of a mixed block as `mean` has it of four, a quarter of a pixel off its
    /// centre both ways.
    pub fn smooth<P: Paint>(&mut self, y: u32, out: &mut [P::Pixel], work: &mut Work, paint: &P, mean: impl Fn([P::Pixel; 4]) -> P::Pixel) {
        let log2 = self.site.log2();
        let out = self.runs(y, out, work, paint);
        for mixed in self.mixed() {
            let Some(pixels) = mixed.pixels(out, log2) else { break };
            // One sheet has no outlines here: it is only that its positions fit no window.
            if mixed.sheets.is_power_of_two() {
                any_block(&self.site, *mixed, y, pixels, paint);
                continue;
            }
            let mut samples = [[P::Pixel::default(); 32]; 4];
            for (samples, beside) in samples.iter_mut().zip([[-1, -1], [1, -1], [-1, 1], [1, 1]]) {
                if let Some(samples) = samples.get_mut(..pixels.len()) {
                    block::<P, ANY>(&self.site, *mixed, y, samples, paint, Some(beside));
                }
            }
            let [a, b, c, d] = &samples;
            let samples = a.iter().zip(b).zip(c.iter().zip(d));
            for (pixel, ((&a, &b), (&c, &d))) in pixels.iter_mut().zip(samples) {
                *pixel = mean([a, b, c, d]);
            }
            work.smoothed_pixels = work.smoothed_pixels.wrapping_add(pixels.len() as u32);
        }
    }
}

impl Mixed {
    /// The block's pixels in a row of them; `None` past its end.
    #[inline(always)]
    fn pixels<'o, T>(&self, row: &'o mut [T], log2: u32) -> Option<&'o mut [T]> {
        let first = usize::from(self.block).wrapping_shl(log2);
        let last = first.wrapping_add(1 << log2).min(row.len());
        row.get_mut(first..last)
    }
}

/// A run's pixels by the width of the picture: those that `plan` has windows for.
#[inline(never)]
fn by_width<P: Paint>(paint: &P, run: Run, tiles: &mut [Tile], out: &mut [P::Pixel], log2: u32, width_log2: u32) {
    match width_log2 {
        8 => paint.run::<8, 5, 0x2000>(run, tiles, out, log2),
        9 => paint.run::<9, 5, 0x4000>(run, tiles, out, log2),
        _ => paint.run::<10, 4, 0x4000>(run, tiles, out, log2),
    }
}

/// A run that reaches past the end of `out`: tile by tile, and of the last only what there is.
#[inline(never)]
fn cut<P: Paint>(paint: &P, run: Run, tiles: &mut [Tile], out: &mut [P::Pixel], log2: u32, width_log2: u32) {
    let from = usize::from(run.place).wrapping_shl(log2);
    let mut out = out.get_mut(from..).unwrap_or(&mut []);
    for tile in tiles {
        let (pixels, rest) = out.split_at_mut(out.len().min(1 << log2));
        out = rest;
        let mut whole = [P::Pixel::default(); 1 << TILE_LOG2];
        if let Some(made) = whole.get_mut(..1 << log2) {
            by_width(paint, run, core::slice::from_mut(tile), made, log2, width_log2);
        }
        for (pixel, made) in pixels.iter_mut().zip(whole) {
            *pixel = made;
        }
    }
}

/// No number of pixels in particular, as the logarithm of a block's side.
const ANY: u32 = u32::MAX;

/// Mixed blocks pixel by pixel. LOG2: they are 2^LOG2 pixels wide, cells of eight or their quarters; or [`ANY`].
#[inline(never)]
fn mix<P: Paint, const LOG2: u32>(site: &Site<'_, '_, '_>, mixed: &[Mixed], y: u32, out: &mut [P::Pixel], paint: &P) {
    let log2 = if LOG2 == ANY { site.log2() } else { LOG2 };
    for mixed in mixed {
        let Some(pixels) = mixed.pixels(out, log2) else { break };
        // The most frequent lengths have loops of their own.
        match LOG2 {
            2 if let Ok(four) = <&mut [P::Pixel; 4]>::try_from(&mut *pixels) => block::<P, LOG2>(site, *mixed, y, four, paint, None),
            3 if let Ok(eight) = <&mut [P::Pixel; 8]>::try_from(&mut *pixels) => block::<P, LOG2>(site, *mixed, y, eight, paint, None),
            _ => any_block(site, *mixed, y, pixels, paint),
        }
    }
}

/// A block of any length.
#[inline(never)]
fn any_block<P: Paint>(site: &Site<'_, '_, '_>, mixed: Mixed, y: u32, pixels: &mut [P::Pixel], paint: &P) {
    block::<P, ANY>(site, mixed, y, pixels, paint, None);
}

/// One mixed block, front to back: the frontmost sheet that covers a pixel shows; at pixels' centres, or `beside` them, quarters of a
/// pixel across and down.
#[inline(always)]
fn block<P: Paint, const LOG2: u32>(
    site: &Site<'_, '_, '_>,
    mixed: Mixed,
    y: u32,
    pixels: &mut [P::Pixel],
    paint: &P,
    beside: Option<[i32; 2]>,
) {
    let (log2, cell) = if LOG2 == ANY { (site.log2(), site.bundle.grid().log2) } else { (LOG2, 3) };
    let row = y & (1u32 << log2).wrapping_sub(1);
    let texture = site.texture;
    let block = match LOG2 {
        2 => site.quarter(mixed.block.into(), y >> log2),
        3 => site.whole(),
        _ => site.block(mixed.block.into(), y >> log2),
    };
    let mut left = u32::MAX.wrapping_shr(32u32.wrapping_sub(pixels.len() as u32));
    let mut sheets = mixed.sheets;
    while sheets != 0 && left != 0 {
        let place = usize::from(mixed.sheet).wrapping_add(sheets.trailing_zeros() as usize);
        sheets &= sheets.wrapping_sub(1);
        let Some(sheet) = site.sheets.sheet.get(place).map(|sheet| sheet.further(mixed.along)) else { break };
        let sheet = &sheet;
        let mut shown = left;
        // The last one covers what is left.
        let tested = sheets != 0;
        if tested && sheet.test() != CHART {
            let step = y & (1u32 << cell).wrapping_sub(1);
            let first = u32::from(mixed.block).wrapping_shl(log2) & (1u32 << cell).wrapping_sub(1);
            let positive = |which: usize| {
                let corners = block.field(sheet, which);
                match beside {
                    None => Field::new(corners, step, cell, first),
                    Some(beside) => Field::beside(corners, step, cell, first, beside),
                }
                .positive(pixels.len())
            };
            shown &= positive(0);
            if site.chart(sheet).strip() {
                shown &= positive(1);
            }
        }
        if shown == 0 {
            continue;
        }
        let span = match beside {
            None => Span::new(block.corners(sheet), row, log2),
            Some(beside) => Span::beside(block.corners(sheet), row, log2, beside),
        };
        if tested && sheet.test() != FIELD {
            shown = span::inside(&site.chart(sheet), shown, pixels.len(), span, &texture);
        }
        if shown != 0 {
            span::paint(pixels, shown, span, &texture, |uv, x| paint.at(uv, sheet.label(), x));
            left &= !shown;
        }
    }
    // Only a broken bundle has a cell without sheets.
    for (index, pixel) in pixels.iter_mut().enumerate().filter(|_| left != 0) {
        if left.wrapping_shr(index as u32) & 1 != 0 {
            *pixel = P::Pixel::default();
        }
    }
}
