//! Draws rows of pixels: plans a strip when its first row is asked for, then draws tiles, and over them sides, of one row after the other.
//! The plan is in the caller's memory; pixels go to the caller's row, as `player` asks. What fits no plan is drawn pixel by pixel.

use crate::Bundle;
use crate::fixed::PlayUv;
use crate::form::Form;
use crate::key::BACKDROP;
use crate::lists::{CHART, FIELD};
use crate::memory::Workspace;
use crate::plan::Plan;
use crate::site::{BLOCK_LOG2, Site};
use crate::span::{self, Packed, Straight, Tiles};
use crate::torn::{Mixed, Side};
use crate::window::Line;
use crate::work::{Probe, Work};

/// What pixels are made of positions.
pub trait Paint {
    /// A pixel.
    type Pixel: Copy + Default;

    /// How far around a position pixels are told from, Q16 texels.
    const REACH: i32;

    /// Its code is so short that loops over a few pixels are written out.
    const SHORT: bool;

    /// Pixels are means of what is around them already: one whose samples all show one sheet is made once, at its centre.
    const ONCE: bool;

    /// The pixel at `uv`, which is inside the picture; `x`: whether it is an odd one of its row.
    fn at(&self, uv: PlayUv, label: u8, x: usize) -> Self::Pixel;

    /// A row of tiles, in windows of 2^ROWS rows of 2^WIDTH texels, `TEXELS` in all; with what is beside the last of them, `MORE`.
    fn tiles<const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(&self, tiles: &Tiles<'_>, out: &mut [Self::Pixel]);

    /// What a row of a mixed block shows of one of its sides, in such a window: the pixels that `shown` names, a bit each. `place`: which row, and the
    /// logarithm of how many there are.
    fn side<const WIDTH: u32, const ROWS: u32>(&self, side: &Side, place: [u32; 2], shown: u32, out: &mut [Self::Pixel]);
}

/// Where pixels come from.
#[derive(Debug)]
pub struct Probes;

impl Paint for Probes {
    type Pixel = Probe;
    const REACH: i32 = 0;
    const SHORT: bool = false;
    const ONCE: bool = false;

    fn at(&self, uv: PlayUv, label: u8, _: usize) -> Probe {
        Probe { label, at: uv }
    }

    fn tiles<const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(&self, tiles: &Tiles<'_>, out: &mut [Probe]) {
        match tiles.log2 {
            3 => probe::<WIDTH, ROWS, 8>(tiles, out),
            _ => probe::<WIDTH, ROWS, 4>(tiles, out),
        }
    }

    #[inline(always)]
    fn side<const WIDTH: u32, const ROWS: u32>(&self, side: &Side, place: [u32; 2], shown: u32, out: &mut [Probe]) {
        let label = side.tile.head.label();
        span::part(&side.tile, place, shown, out, [0; 2], |at: Packed<WIDTH, ROWS>| Probe { label, at: at.at(side.tile.head.row()) });
    }
}

/// Where the pixels of `tiles` come from, `PIXELS` pixels each: for every tile by itself, since their labels differ.
#[inline(always)]
fn probe<const WIDTH: u32, const ROWS: u32, const PIXELS: usize>(tiles: &Tiles<'_>, out: &mut [Probe]) {
    let backdrop = |uv, _| [Probe { label: BACKDROP as u8, at: uv }; 2];
    for (tile, pixels) in tiles.tiles.iter().zip(out.as_chunks_mut::<PIXELS>().0) {
        let window = |row: u16| Some(row).filter(|_| tile.in_window());
        let along = |row: u16, pixels: &mut [Probe; PIXELS], line: Line<'_>| {
            span::along(pixels, line, |at: Packed<WIDTH, ROWS>| Probe { label: tile.head.label(), at: at.at(row) });
        };
        let one = Tiles { tiles: core::slice::from_ref(tile), ..*tiles };
        one.paint::<_, _, PIXELS>(pixels, false, window, along, backdrop);
    }
}

/// A loaded row of cells, ready to be drawn.
#[derive(Debug)]
pub struct Drawing<'d, 'a> {
    site: Site<'d, 'a, 'd>,
    plan: &'d mut Plan<'a>,
}

impl<'d, 'a> Drawing<'d, 'a> {
    /// The row of cells that `space` holds, the palette, and what is spread of it.
    pub fn new(bundle: &'d Bundle<'a>, space: &'d mut Workspace<'a>) -> (Self, (&'d [u16], &'d [u32]))
    where
        'a: 'd,
    {
        let Workspace { texture, rows: [top, bottom, _], sheets, charts, plan, palette, spread, backdrop, .. } = space;
        let site = Site { bundle, texture, rows: [top, bottom], sheets, charts, backdrop: backdrop.as_ref() };
        (Self { site, plan }, (palette, spread))
    }

    /// Draws pixel row `y`, which lies in the row of cells.
    #[inline(always)]
    pub fn row<P: Paint>(&mut self, y: u32, out: &mut [P::Pixel], work: &mut Work, paint: &P) {
        let out = self.tiles(y, out, work, paint, false);
        let log2 = self.site.block_log2();
        self.sides_by_width(y, 0, out, paint);
        // The others' loops know where it ends.
        if P::SHORT && self.site.texture.width_log2 < 10 && out.len() & (1usize << log2).wrapping_sub(1) != 0 {
            self.cut_sides(y, out, paint);
        }
        for mixed in self.mixed() {
            let Some(pixels) = pixels(mixed.block.into(), out, log2) else { break };
            block(&self.site, *mixed, y, [pixels], paint, [None], &mut []);
        }
    }

    /// Draws the sides of pixel row `y` in blocks from `first` on, of which `out` are the pixels, by the width of the picture.
    #[inline(always)]
    fn sides_by_width<P: Paint>(&self, y: u32, first: u32, out: &mut [P::Pixel], paint: &P) {
        match self.site.texture.width_log2 {
            7 => self.mix::<P, 7, 7>(y, first, out, paint),
            8 => self.mix::<P, 8, 6>(y, first, out, paint),
            9 => self.mix::<P, 9, 6>(y, first, out, paint),
            _ => self.mix::<P, 10, 4>(y, first, out, paint),
        }
    }

    /// Draws those of a last block of which `out` has some pixels.
    #[inline(never)]
    fn cut_sides<P: Paint>(&self, y: u32, out: &mut [P::Pixel], paint: &P) {
        let log2 = self.site.block_log2();
        let whole = out.len() >> log2;
        let Some(out) = out.get_mut(whole << log2..) else { return };
        let mut made = [P::Pixel::default(); 1 << BLOCK_LOG2];
        made.iter_mut().zip(&*out).for_each(|(made, &pixel)| *made = pixel);
        self.sides_by_width(y, whole as u32, made.get_mut(..1 << log2).unwrap_or(&mut []), paint);
        out.iter_mut().zip(made).for_each(|(pixel, made)| *pixel = made);
    }

    /// Draws the tiles of pixel row `y`. What there is of `out` on the screen comes back: the rest of it is still to be drawn; `sideless`: all torn
    /// blocks pixel by pixel.
    #[inline(always)]
    fn tiles<'o, P: Paint>(&mut self, y: u32, out: &'o mut [P::Pixel], work: &mut Work, paint: &P, sideless: bool) -> &'o mut [P::Pixel] {
        let log2 = self.site.block_log2();
        let (strip, row) = (y >> log2, y & (1u32 << log2).wrapping_sub(1));
        let plan = &*self.plan;
        if plan.strip != Some(strip) || plan.reach != P::REACH || plan.sideless != sideless {
            self.plan.make(&self.site, strip, P::REACH, sideless);
        }
        let width = self.site.bundle.size().0 as usize;
        let drawn = out.len().min(width);
        let out = out.get_mut(..drawn).unwrap_or(&mut []);
        let tiles = self.plan.tile.get(..self.plan.tiles).unwrap_or(&[]);
        let tiles = Tiles { tiles, row, log2, backdrop: self.plan.backdrop };
        let width_log2 = self.site.texture.width_log2;
        by_width(paint, &tiles, out, width_log2);
        if out.len() & (1usize << log2).wrapping_sub(1) != 0 {
            cut(paint, &tiles, out, width_log2);
        }
        work.smooth_pixels = work.smooth_pixels.wrapping_add(self.plan.smooth);
        work.torn_pixels = work.torn_pixels.wrapping_add(self.plan.torn);
        work.coverage_tests = work.coverage_tests.wrapping_add(self.plan.tests);
        out
    }

    /// Draws the sides of pixel row `y` in blocks from `first` on, of which `out` are the pixels.
    #[inline(never)]
    fn mix<P: Paint, const WIDTH: u32, const ROWS: u32>(&self, y: u32, first: u32, out: &mut [P::Pixel], paint: &P) {
        let log2 = self.site.block_log2();
        let row = y & (1u32 << log2).wrapping_sub(1);
        // Pictures wider than 512 texels are rare.
        match (P::SHORT && WIDTH <= 9, log2) {
            (true, 2) => self.sides::<P, WIDTH, ROWS, 4>(row, first, out, paint),
            // No others have sides.
            (true, _) => self.sides::<P, WIDTH, ROWS, 8>(row, first, out, paint),
            (false, _) => self.any_sides::<P, WIDTH, ROWS>(row, out, paint),
        }
    }

    /// Draws row `row` of the sides in whole blocks of `PIXELS` pixels each: of a known size, a loop over pixels is none.
    #[inline(always)]
    fn sides<P: Paint, const WIDTH: u32, const ROWS: u32, const PIXELS: usize>(
        &self,
        row: u32,
        first: u32,
        out: &mut [P::Pixel],
        paint: &P,
    ) {
        let blocks = out.as_chunks_mut::<PIXELS>().0;
        for side in self.plan.side.get(..self.plan.sides).unwrap_or(&[]) {
            let shown = side.shown.row(row);
            if shown != 0
                && let Some(pixels) = blocks.get_mut(side.block.wrapping_sub(first) as usize)
            {
                paint.side::<WIDTH, ROWS>(side, [row, PIXELS.trailing_zeros()], shown, pixels);
            }
        }
    }

    /// Likewise, of however many pixels a block has.
    #[inline(always)]
    fn any_sides<P: Paint, const WIDTH: u32, const ROWS: u32>(&self, row: u32, out: &mut [P::Pixel], paint: &P) {
        let log2 = self.site.block_log2();
        for side in self.plan.side.get(..self.plan.sides).unwrap_or(&[]) {
            let shown = side.shown.row(row);
            if shown != 0
                && let Some(pixels) = pixels(side.block, out, log2)
            {
                paint.side::<WIDTH, ROWS>(side, [row, log2], shown, pixels);
            }
        }
    }

    /// The strip's blocks that are drawn pixel by pixel.
    fn mixed(&self) -> &[Mixed] {
        self.plan.mixed.get(..self.plan.mixes).unwrap_or(&[])
    }

    /// Draws pixel row `y` like [`Drawing::row`], but every pixel of a mixed block as `mean` has it of four, a quarter of a pixel off its
    /// centre both ways; or, as [`Paint::ONCE`] has it, those alone of which the four show more than one sheet.
    pub fn smooth<P: Paint>(&mut self, y: u32, out: &mut [P::Pixel], work: &mut Work, paint: &P, mean: impl Fn([P::Pixel; 4]) -> P::Pixel) {
        let log2 = self.site.block_log2();
        let out = self.tiles(y, out, work, paint, true);
        for mixed in self.mixed() {
            let Some(pixels) = pixels(mixed.block.into(), out, log2) else { break };
            // One sheet has no outlines here: it is only that its positions fit no window.
            if mixed.sheets.is_power_of_two() {
                block(&self.site, *mixed, y, [pixels], paint, [None], &mut []);
                continue;
            }
            let mut samples = [[P::Pixel::default(); 1 << BLOCK_LOG2]; 4];
            let each = samples.each_mut().map(|samples| samples.get_mut(..pixels.len()).unwrap_or(&mut []));
            let made = block(&self.site, *mixed, y, each, paint, [[-1, -1], [1, -1], [-1, 1], [1, 1]].map(Some), pixels);
            let [a, b, c, d] = &samples;
            let samples = a.iter().zip(b).zip(c.iter().zip(d));
            for (x, (pixel, ((&a, &b), (&c, &d)))) in pixels.iter_mut().zip(samples).enumerate() {
                if !P::ONCE || made.wrapping_shr(x as u32) & 1 == 0 {
                    *pixel = mean([a, b, c, d]);
                }
            }
            work.smoothed_pixels = work.smoothed_pixels.wrapping_add(pixels.len() as u32);
        }
    }
}

/// The pixels of block `block` in a row of them; `None` past its end.
#[inline(always)]
fn pixels<T>(block: u32, row: &mut [T], log2: u32) -> Option<&mut [T]> {
    let first = (block as usize).wrapping_shl(log2);
    let last = first.wrapping_add(1 << log2).min(row.len());
    row.get_mut(first..last)
}

/// A row of tiles by the width of the picture: those that `window` knows.
#[inline(always)]
fn by_width<P: Paint>(paint: &P, tiles: &Tiles<'_>, out: &mut [P::Pixel], width_log2: u32) {
    match width_log2 {
        7 => paint.tiles::<7, 7, 0x4000, 0x4081>(tiles, out),
        8 => paint.tiles::<8, 6, 0x4000, 0x4101>(tiles, out),
        9 => paint.tiles::<9, 6, 0x8000, 0x8201>(tiles, out),
        _ => paint.tiles::<10, 4, 0x4000, 0x4401>(tiles, out),
    }
}

/// What there is in `out` of a last tile that reaches past its end.
#[inline(never)]
fn cut<P: Paint>(paint: &P, tiles: &Tiles<'_>, out: &mut [P::Pixel], width_log2: u32) {
    let (whole, pixels) = (out.len() >> tiles.log2, 1usize << tiles.log2);
    let Some((tile, out)) = tiles.tiles.get(whole).zip(out.get_mut(whole << tiles.log2..)) else { return };
    let mut made = [P::Pixel::default(); 1 << BLOCK_LOG2];
    // What it leaves to others stays as it is.
    made.iter_mut().zip(&*out).for_each(|(made, &pixel)| *made = pixel);
    if let Some(made) = made.get_mut(..pixels) {
        by_width(paint, &Tiles { tiles: core::slice::from_ref(tile), ..*tiles }, made, width_log2);
    }
    out.iter_mut().zip(made).for_each(|(pixel, made)| *pixel = made);
}

/// One mixed block, front to back: the frontmost sheet that covers a pixel shows; for every line of `pixels` at their centres, or `beside` them, quarters
/// of a pixel across and down. What is the same for all lines is worked out once; pixels of which all lines show one sheet are drawn in `once` instead where
/// [`Paint::ONCE`] says so, and come back, a bit each.
#[inline(never)]
fn block<P: Paint, const LINES: usize>(
    site: &Site<'_, '_, '_>,
    mixed: Mixed,
    y: u32,
    mut pixels: [&mut [P::Pixel]; LINES],
    paint: &P,
    beside: [Option<[i32; 2]>; LINES],
    once: &mut [P::Pixel],
) -> u32 {
    let log2 = site.block_log2();
    let [left_of, above] = site.offset(mixed.block.into(), y >> log2);
    let row = y & (1u32 << log2).wrapping_sub(1);
    let offset = [left_of, above.wrapping_add(row)];
    let (texture, wide) = (site.texture, pixels.first().map_or(0, |line| line.len() as u32));
    let moved = |form: Form, beside: Option<[i32; 2]>| beside.map_or(form, |beside| form.beside(beside));
    let mut left = [u32::MAX.wrapping_shr(32u32.wrapping_sub(wide)); LINES];
    let (mut sheets, mut made) = (mixed.sheets, 0);
    while sheets != 0 && left != [0; LINES] {
        let place = usize::from(mixed.sheet).wrapping_add(sheets.trailing_zeros() as usize);
        sheets &= sheets.wrapping_sub(1);
        let Some(sheet) = site.sheets.sheet.get(place).map(|sheet| sheet.further(mixed.along)) else { break };
        let (sheet, chart) = (&sheet, site.chart(&sheet));
        let mut shown = left;
        // The last one covers what is left.
        let tested = sheets != 0;
        if tested && sheet.test() != CHART {
            for which in chart.fields() {
                let field = site.field(sheet, which, offset);
                // Below zero where the field is above.
                for (shown, beside) in shown.iter_mut().zip(beside) {
                    *shown &= moved(field, beside).negated().negative(wide);
                }
            }
        }
        if shown == [0; LINES] {
            continue;
        }
        let forms = site.forms(sheet, offset);
        let draw = |line: &mut [P::Pixel], shown: u32, forms: &[Form; 2]| {
            span::paint(line, shown, Straight::new(forms, row, log2), texture, |uv, x| paint.at(uv, sheet.label(), x));
        };
        let by_chart = tested && sheet.test() != FIELD;
        let apart = P::ONCE && LINES > 1;
        if apart {
            if by_chart {
                for (shown, beside) in shown.iter_mut().zip(beside).filter(|(shown, _)| **shown != 0) {
                    *shown = span::inside(&chart, *shown, wide, &forms.map(|form| moved(form, beside)), texture);
                }
            }
            let all = shown.iter().fold(u32::MAX, |all, shown| all & shown);
            if all != 0 {
                draw(once, all, &forms);
                made |= all;
                (left, shown) = (left.map(|left| left & !all), shown.map(|shown| shown & !all));
            }
        }
        for ((line, left), (mut shown, beside)) in pixels.iter_mut().zip(&mut left).zip(shown.into_iter().zip(beside)) {
            let forms = forms.map(|form| moved(form, beside));
            if by_chart && !apart && shown != 0 {
                shown = span::inside(&chart, shown, wide, &forms, texture);
            }
            if shown != 0 {
                draw(line, shown, &forms);
                *left &= !shown;
            }
        }
    }
    // Only a broken bundle has a cell without sheets.
    for (line, left) in pixels.into_iter().zip(left).filter(|&(_, left)| left != 0) {
        for (index, pixel) in line.iter_mut().enumerate() {
            if left.wrapping_shr(index as u32) & 1 != 0 {
                *pixel = P::Pixel::default();
            }
        }
    }
    made
}
