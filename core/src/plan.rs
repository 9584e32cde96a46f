//! What a strip of the screen shows, block by block, worked out once for all of its rows: where one sheet covers a block, and where
//! several take turns. A strip is as many rows as a block is high. Sheets come from `sheet`; rows of pixels are drawn from it by `span`.
//!
//! Blocks that show one sheet stand in **runs** of **tiles**, neighbours of one label, each of which is stepped once a row. A run's
//! positions lie in a **window** of the source image, so many rows of it that a position there is one 32-bit number.

use crate::Bundle;
use crate::atlas::Texture;
use crate::coverage::{Chart, Cover};
use crate::fixed::PlayUv;
use crate::format::{MAX_SHEETS, SPACE_CUBIC};
use crate::lists::{CHART, FIELD};
use crate::row::Layer;
use crate::sheet::{Block, Corners, RowSheets, Rows, Sheet, Stretch};

/// A tile of a run, in caller's memory: 2^[`TILE_LOG2`] pixels of a row, or a block's where that is smaller. All are positions in the run's
/// window, or differences of such, as [`crate::span::Packed`] holds them.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tile {
    /// Where its first pixel is at the strip's current row.
    at: u32,
    /// How far it is from pixel to pixel there.
    step: u32,
    /// How far it is from row to row,
    down: u32,
    /// and how the step changes.
    turn: u32,
}

impl Tile {
    /// Steps to the next row; returns where it was, and its step there.
    #[inline(always)]
    pub const fn advance(&mut self) -> [u32; 2] {
        let was = [self.at, self.step];
        (self.at, self.step) = (self.at.wrapping_add(self.down), self.step.wrapping_add(self.turn));
        was
    }
}

/// Tiles are at most 2^this pixels wide and high: over more of them rounding would add up to something.
pub const TILE_LOG2: u32 = 3;

/// Neighbouring tiles that show one sheet of one label, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Run {
    /// The first tile, from the left of the screen.
    pub place: u16,
    /// How many there are.
    pub count: u16,
    /// The first of them in memory.
    pub tile: u16,
    /// The window's first row.
    pub row: u16,
    /// The label.
    pub label: u16,
}

/// A block that is drawn pixel by pixel, in caller's memory.
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

/// How positions are held in a window, where the picture's width allows for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The picture's width is 2^this.
    pub width_log2: u32,
    /// The window has 2^this rows.
    pub rows_log2: u32,
}

impl Window {
    /// The window for pictures 2^`width_log2` texels wide and `height` high: the fraction bits are shared out so that a texel
    /// has at least 256 steps.
    const fn new(width_log2: u32, height: u32) -> Option<Self> {
        let rows_log2 = if width_log2 == 10 { 4 } else { 5 };
        let known = matches!(width_log2, 8..=10);
        if known && height >= 1 << rows_log2 { Some(Self { width_log2, rows_log2 }) } else { None }
    }

    /// A difference of u and v in Q16 texels, or a position with v from the window's first row on, as [`crate::span::Packed`] holds it,
    /// divided by 2^`log2`, each to the nearest.
    #[inline(always)]
    fn pack(self, u: i32, v: i32, log2: u32) -> u32 {
        let bits = self.width_log2.wrapping_add(self.rows_log2);
        // u has what v and whole texels leave of 32 bits for its fraction, v as many as the picture's width.
        let across = 16u32.wrapping_add(bits).wrapping_add(self.width_log2).wrapping_sub(32).wrapping_add(log2);
        let down = 16u32.wrapping_sub(self.width_log2).wrapping_add(log2);
        let rounded = |x: i32, drop: u32| x.wrapping_add(1i32.wrapping_shl(drop) >> 1).wrapping_shr(drop);
        (rounded(u, across) as u32).wrapping_shl(bits).wrapping_add(rounded(v, down) as u32)
    }

    /// The tile of 2^`log2` by 2^`log2` pixels between corners `a` and `b` above, `c` and `d` below, in a window from `row` on.
    #[inline(always)]
    fn tile(self, [a, b, c, d]: Corners, row: u32, log2: u32) -> Tile {
        let (above_u, above_v) = (b.u.wrapping_sub(a.u), b.v.wrapping_sub(a.v));
        let (below_u, below_v) = (d.u.wrapping_sub(c.u), d.v.wrapping_sub(c.v));
        Tile {
            at: self.pack(a.u, a.v.wrapping_sub((row as i32).wrapping_shl(16)), 0),
            step: self.pack(above_u, above_v, log2),
            down: self.pack(c.u.wrapping_sub(a.u), c.v.wrapping_sub(a.v), log2),
            turn: self.pack(below_u.wrapping_sub(above_u), below_v.wrapping_sub(above_v), log2.wrapping_mul(2)),
        }
    }
}

/// Positions in runs keep this far from the edges of picture and window, Q16 texels, beside what pixels reach to: more than rounding moves them.
const MARGIN: i32 = 1 << 13;

/// A strip's blocks, in caller's memory.
#[derive(Debug, Default)]
pub struct Plan<'m> {
    /// The runs' tiles, from left to right.
    pub tile: &'m mut [Tile],
    /// The runs.
    pub run: &'m mut [Run],
    /// The other blocks.
    pub mixed: &'m mut [Mixed],
    /// How many of each there are.
    pub tiles: usize,
    /// Runs.
    pub runs: usize,
    /// Mixed blocks.
    pub mixes: usize,
    /// The row of tiles it is about, from the top of the screen; none: nothing yet.
    pub strip: Option<u32>,
    /// How far around a position pixels are told from, Q16 texels.
    pub reach: i32,
    /// The row of pixels of it at which the tiles stand.
    pub row: u32,
    /// Pixels of a row in cells of one sheet.
    pub smooth: u32,
    /// Pixels of a row in cells of more.
    pub torn: u32,
    /// Coverage tests of a row.
    pub tests: u32,
}

/// What a plan is made of.
#[derive(Clone, Copy, Debug)]
pub struct Site<'s, 'a, 'm> {
    /// Labels, screen, the source image's size.
    pub bundle: &'s Bundle<'a>,
    /// The source image.
    pub texture: Texture<'m>,
    /// The rows of nodes around the row of cells.
    pub rows: Rows<'s, 'm>,
    /// Its sheets.
    pub sheets: &'s RowSheets<'m>,
    /// Every label's chart.
    pub charts: &'s [Chart],
}

impl Site<'_, '_, '_> {
    /// The chart of a sheet's label.
    #[must_use]
    #[inline(always)]
    pub fn chart(&self, sheet: &Sheet) -> Chart {
        self.charts.get(usize::from(sheet.label())).copied().unwrap_or_default()
    }

    /// A block is 2^this pixels wide and high.
    #[must_use]
    pub fn log2(&self) -> u32 {
        let cell = self.bundle.grid().log2;
        if self.cubic() { cell.wrapping_sub(1) } else { cell }
    }

    /// A tile is 2^this pixels wide and high.
    #[must_use]
    pub fn tile_log2(&self) -> u32 {
        self.log2().min(TILE_LOG2)
    }

    /// Block `block` of strip `strip`, where space is cubic.
    #[must_use]
    #[inline(always)]
    pub const fn quarter(&self, block: u32, strip: u32) -> Block<'_, '_> {
        Block { rows: self.rows, quarter: Some([block & 1 == 1, strip & 1 == 1]) }
    }

    /// The block of any place where space is linear: it is the cell.
    #[must_use]
    #[inline(always)]
    pub const fn whole(&self) -> Block<'_, '_> {
        Block { rows: self.rows, quarter: None }
    }

    /// What is above and below strip `strip`, from the left corners of `sheet` on: nodes, and halfway to the next.
    fn lines(&self, strip: u32, sheet: &Sheet) -> [&[Layer]; 2] {
        let ([top, halfway, bottom], [a, b, c]) = (self.rows, sheet.nodes());
        let lines = match (self.cubic(), strip & 1) {
            (false, _) => [(top, a), (bottom, c)],
            (true, 0) => [(top, a), (halfway, b)],
            (true, _) => [(halfway, b), (bottom, c)],
        };
        lines.map(|(row, from)| row.point.get(usize::from(from)..).and_then(|points| bytemuck::try_cast_slice(points).ok()).unwrap_or(&[]))
    }

    fn cubic(&self) -> bool {
        self.bundle.path().space == SPACE_CUBIC
    }

    /// Block `block` of strip `strip`.
    #[must_use]
    pub fn block(&self, block: u32, strip: u32) -> Block<'_, '_> {
        if self.cubic() { self.quarter(block, strip) } else { self.whole() }
    }
}

impl Plan<'_> {
    /// Plans row `strip` of the screen's tiles, for pixels that are told from as far as `reach` around a position.
    #[inline(never)]
    pub fn make(&mut self, site: &Site<'_, '_, '_>, strip: u32, reach: i32) {
        (self.tiles, self.runs, self.mixes) = (0, 0, 0);
        (self.smooth, self.torn, self.tests) = (0, 0, 0);
        (self.strip, self.row, self.reach) = (Some(strip), 0, reach);
        let texture = site.bundle.texture();
        let window = Window::new(texture.width_log2, texture.height);
        let (log2, width) = (site.log2(), site.bundle.size().0);
        let parts_log2 = log2.wrapping_sub(site.tile_log2());
        let (strip, part) = (strip.wrapping_shr(parts_log2), strip & 1u32.wrapping_shl(parts_log2).wrapping_sub(1));
        let mut across = Across { site, window, strip, part, parts_log2, log2, width, left: 0, block: 0 };
        for &stretch in site.sheets.stretches() {
            match site.sheets.of(stretch) {
                [sheet] => self.smooth(&mut across, stretch, sheet),
                sheets => self.cell(&mut across, stretch, sheets),
            }
        }
    }

    /// Plans a stretch of cells that show one sheet.
    fn smooth(&mut self, across: &mut Across<'_, '_, '_>, stretch: Stretch, sheet: &Sheet) {
        let Across { site, window, strip, log2, width, .. } = *across;
        let lines = site.lines(strip, sheet);
        let before = across.left;
        let mut along = 0u16;
        while along < stretch.cells && across.left < width {
            // In pictures 512 wide, as most are, and cells of eight pixels; others go by `append` alone. Likewise the cell that the screen's edge cuts.
            if let Some(Window { width_log2: 9, .. }) = window
                && site.bundle.grid().log2 == 3
            {
                let most = (width.saturating_sub(across.left) >> 3).min(stretch.cells.wrapping_sub(along).into());
                let rest = lines.map(|line| line.get(usize::from(along).wrapping_mul(2)..).unwrap_or(&[]));
                let cells = if site.cubic() {
                    self.extend::<1, 2>(across.block, most as usize, sheet.label(), rest)
                } else {
                    self.extend::<2, 3>(across.block, most as usize, sheet.label(), rest)
                };
                along = along.wrapping_add(cells);
                across.block = across.block.wrapping_add(u32::from(cells).wrapping_mul(across.blocks()));
                across.left = across.block.wrapping_shl(log2);
                if along == stretch.cells {
                    break;
                }
            }
            let here = sheet.further(along);
            for _ in 0..across.blocks() {
                let place = across.place();
                if !self.append(across, &here, place.corners(&here)) {
                    self.mix(Mixed { block: across.block as u16, sheet: stretch.sheet, along, sheets: 1 });
                }
                across.step();
            }
            along = along.wrapping_add(1);
        }
        self.smooth = self.smooth.wrapping_add(across.left.min(width).saturating_sub(before));
    }

    /// Plans a cell that shows several sheets, or none.
    fn cell(&mut self, across: &mut Across<'_, '_, '_>, stretch: Stretch, sheets: &[Sheet]) {
        let before = across.left;
        for shown in candidates(across.site, across.strip, sheets).into_iter().take(across.blocks() as usize) {
            let place = across.place();
            let single = sheets.get(shown.trailing_zeros() as usize).filter(|_| shown.is_power_of_two());
            if !single.is_some_and(|sheet| self.append(across, sheet, place.corners(sheet))) {
                self.mix(Mixed { block: across.block as u16, sheet: stretch.sheet, along: 0, sheets: shown });
                let pixels = across.width.saturating_sub(across.left).min(1 << across.log2);
                self.tests = self.tests.wrapping_add(pixels.wrapping_mul(shown.count_ones().saturating_sub(1)));
            }
            across.step();
        }
        let pixels = across.left.min(across.width).saturating_sub(before);
        let kind = if sheets.is_empty() { &mut self.smooth } else { &mut self.torn };
        *kind = kind.wrapping_add(pixels);
    }

    /// Appends smooth cells, the first of which begins with tile `place`, to the last run, as long as they follow it and fit into its window, `most`
    /// at most; returns how many. `above` and `below` start at their left corners: nodes, and halfway to the next. Tiles of 2^LOG2 pixels are between
    /// every EVERY-th of these: two a cell, or one, where what is halfway is skipped.
    #[inline(never)]
    fn extend<const EVERY: usize, const LOG2: u32>(&mut self, place: u32, most: usize, label: u8, [above, below]: [&[Layer]; 2]) -> u16 {
        let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1)) else { return 0 };
        if run.label != u16::from(label) || u32::from(run.place).wrapping_add(u32::from(run.count)) != place {
            return 0;
        }
        let Some(slots) = self.tile.get_mut(self.tiles..) else { return 0 };
        let tiles = 3usize.wrapping_sub(EVERY);
        let Some(slots) = slots.get_mut(..most.wrapping_mul(tiles)) else { return 0 };
        let window = Window { width_log2: 9, rows_log2: 5 };
        let first = i32::from(run.row).wrapping_shl(16);
        // Inside as far as the margin from either side: sums of both are below a power of two.
        let margin = MARGIN.wrapping_add(self.reach);
        let inside = |x: i32, y: i32, log2: u32| {
            let [less, more] = [x, y].map(|x| (x.wrapping_sub(margin) | x.wrapping_add(margin)) as u32);
            (less | more) >> log2.wrapping_add(16) == 0
        };
        let mut ends = above.as_chunks::<EVERY>().0.iter().zip(below.as_chunks::<EVERY>().0).filter_map(|(b, d)| b.first().zip(d.first()));
        let Some((a, c)) = ends.next().map(|(a, c)| (a.uv(), c.uv())) else { return 0 };
        let (mut u, mut v) = (a.u, a.v.wrapping_sub(first));
        let (mut down_u, mut down_v) = (c.u.wrapping_sub(a.u), c.v.wrapping_sub(a.v));
        let mut done = 0usize;
        for (slot, (b, d)) in slots.iter_mut().zip(ends) {
            let (b, d) = (b.uv(), d.uv());
            let (right_u, right_v) = (b.u, b.v.wrapping_sub(first));
            if !(inside(b.u, d.u, window.width_log2) && inside(right_v, d.v.wrapping_sub(first), window.rows_log2)) {
                break;
            }
            let (right_down_u, right_down_v) = (d.u.wrapping_sub(b.u), d.v.wrapping_sub(b.v));
            *slot = Tile {
                at: window.pack(u, v, 0),
                step: window.pack(right_u.wrapping_sub(u), right_v.wrapping_sub(v), LOG2),
                down: window.pack(down_u, down_v, LOG2),
                turn: window.pack(right_down_u.wrapping_sub(down_u), right_down_v.wrapping_sub(down_v), LOG2.wrapping_mul(2)),
            };
            (u, v, down_u, down_v) = (right_u, right_v, right_down_u, right_down_v);
            done = done.wrapping_add(1);
        }
        // Half a cell is for `append`, which finds the same.
        let cells = if tiles == 1 { done } else { done >> 1 };
        let done = cells.wrapping_mul(tiles);
        run.count = run.count.wrapping_add(done as u16);
        self.tiles = self.tiles.wrapping_add(done);
        cells as u16
    }

    fn mix(&mut self, mixed: Mixed) {
        if let Some(slot) = self.mixed.get_mut(self.mixes) {
            *slot = mixed;
            self.mixes = self.mixes.wrapping_add(1);
        }
    }

    /// Appends the block at `across`, which shows one sheet, to the last run, or begins others; false where its positions fit no window. What was
    /// appended then is drawn over.
    #[inline(never)]
    fn append(&mut self, across: &Across<'_, '_, '_>, sheet: &Sheet, [a, b, c, d]: Corners) -> bool {
        let Some(window) = across.window else { return false };
        let label = u16::from(sheet.label());
        let log2 = across.parts_log2;
        if log2 == 0 {
            return self.tile(across, window, label, across.block as u16, [a, b, c, d]);
        }
        // The row of the block's tiles, then one after the other.
        let between = |from: PlayUv, to: PlayUv, part: u32| {
            // Positions differ by less than 2^28.6, and a block has at most four tiles a side.
            let along = |from: i32, to: i32| from.wrapping_add(to.wrapping_sub(from).wrapping_mul(part as i32) >> log2);
            PlayUv { u: along(from.u, to.u), v: along(from.v, to.v) }
        };
        let next = across.part.wrapping_add(1);
        let [a, c] = [between(a, c, across.part), between(a, c, next)];
        let [b, d] = [between(b, d, across.part), between(b, d, next)];
        (0..1u32.wrapping_shl(log2)).all(|part| {
            let corners =
                [between(a, b, part), between(a, b, part.wrapping_add(1)), between(c, d, part), between(c, d, part.wrapping_add(1))];
            self.tile(across, window, label, across.block.wrapping_shl(log2).wrapping_add(part) as u16, corners)
        })
    }

    /// Appends the tile at `place` to the last run, or begins another; false where its positions fit no window.
    fn tile(&mut self, across: &Across<'_, '_, '_>, window: Window, label: u16, place: u16, corners: Corners) -> bool {
        let (log2, height) = (across.log2.wrapping_sub(across.parts_log2), across.site.texture.height);
        let [a, b, c, d] = corners;
        let margin = MARGIN.wrapping_add(self.reach);
        let inside = |x: i32, log2: u32| {
            (x.wrapping_sub(margin) as u32) < 1u32.wrapping_shl(log2.wrapping_add(16)).wrapping_sub(margin.wrapping_mul(2) as u32)
        };
        if !corners.iter().all(|uv| inside(uv.u, window.width_log2)) {
            return false;
        }
        let within = |row: u16| corners.iter().all(|uv| inside(uv.v.wrapping_sub(i32::from(row).wrapping_shl(16)), window.rows_log2));
        let Some(slot) = self.tile.get_mut(self.tiles) else { return false };
        let last = self.runs.wrapping_sub(1);
        if let Some(run) = self.run.get_mut(last)
            && run.label == label
            && run.place.wrapping_add(run.count) == place
            && within(run.row)
        {
            *slot = window.tile(corners, run.row.into(), log2);
            run.count = run.count.wrapping_add(1);
            self.tiles = self.tiles.wrapping_add(1);
            return true;
        }
        // The window begins or ends at the tile, so that it has room where the run is heading.
        let (low, high) = (a.v.min(b.v).min(c.v.min(d.v)), a.v.max(b.v).max(c.v.max(d.v)));
        let onwards = b.v.wrapping_add(d.v) >= a.v.wrapping_add(c.v);
        let row = if onwards {
            low.wrapping_sub(margin) >> 16
        } else {
            (high.wrapping_add(margin) >> 16).wrapping_add(1).wrapping_sub(1i32.wrapping_shl(window.rows_log2))
        };
        let row = row.min(height.wrapping_sub(1u32.wrapping_shl(window.rows_log2)) as i32).max(0) as u16;
        let Some(run) = self.run.get_mut(self.runs).filter(|_| within(row)) else { return false };
        *slot = window.tile(corners, row.into(), log2);
        *run = Run { place, count: 1, tile: self.tiles as u16, row, label };
        (self.tiles, self.runs) = (self.tiles.wrapping_add(1), self.runs.wrapping_add(1));
        true
    }

    /// Steps the tiles down to row `row`, which none of them is past.
    pub fn skip_to(&mut self, row: u32) {
        for _ in self.row..row {
            for tile in self.tile.get_mut(..self.tiles).unwrap_or(&mut []) {
                tile.advance();
            }
        }
        self.row = row;
    }
}

/// How far a strip is planned.
#[derive(Clone, Copy, Debug)]
struct Across<'s, 'a, 'm> {
    site: &'s Site<'s, 'a, 'm>,
    window: Option<Window>,
    strip: u32,
    /// The row of tiles in the strip, and how many the strip has: 2^`parts_log2`.
    part: u32,
    parts_log2: u32,
    log2: u32,
    /// The screen's width, and pixels to the left of the next block.
    width: u32,
    left: u32,
    /// The next block.
    block: u32,
}

impl Across<'_, '_, '_> {
    /// Blocks of a cell, from left to right.
    fn blocks(&self) -> u32 {
        if self.site.cubic() { 2 } else { 1 }
    }

    fn place(&self) -> Block<'_, '_> {
        self.site.block(self.block, self.strip)
    }

    /// On to the next block.
    fn step(&mut self) {
        self.block = self.block.wrapping_add(1);
        self.left = self.block.wrapping_shl(self.log2);
    }
}

/// Which of a torn cell's `sheets` each of its blocks in strip `strip` can show, a bit each: those that cover part of it, in front of the
/// first that covers all of it. Where a cell is one block, the second is none.
#[inline(never)]
fn candidates(site: &Site<'_, '_, '_>, strip: u32, sheets: &[Sheet]) -> [u16; 2] {
    let (cubic, lower) = (site.cubic(), strip & 1 == 1);
    let blocks = [0, 1].map(|right| site.block(right, strip));
    let mut shown = [0u16; 2];
    let mut open = [true, cubic];
    let last = sheets.len().wrapping_sub(1);
    for (place, sheet) in sheets.iter().enumerate().take(MAX_SHEETS) {
        let bit = 1u16.wrapping_shl(place as u32);
        let mut covers = [Cover::All; 2];
        if place != last {
            let chart = site.chart(sheet);
            if sheet.test() != CHART {
                let [first, ..] = &blocks;
                covers = field_covers(first.field(sheet, 0), cubic, lower);
                if chart.strip() {
                    let [left, right] = field_covers(first.field(sheet, 1), cubic, lower);
                    covers = [covers[0].and(left), covers[1].and(right)];
                }
            }
            if sheet.test() != FIELD {
                for ((cover, block), open) in covers.iter_mut().zip(&blocks).zip(open) {
                    if open && *cover != Cover::Nothing {
                        *cover = cover.and(chart.cover(&block.corners(sheet)));
                    }
                }
            }
        }
        for ((shown, cover), open) in shown.iter_mut().zip(covers).zip(&mut open) {
            if *open && cover != Cover::Nothing {
                *shown |= bit;
                *open = cover != Cover::All;
            }
        }
        if open == [false; 2] {
            break;
        }
    }
    shown
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
