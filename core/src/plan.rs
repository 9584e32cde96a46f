//! What a strip of the screen shows, block by block, worked out once for all of its rows: where one sheet covers a block, and where
//! several take turns. A strip is as many rows as a block is high. Sheets come from `sheet`; rows of pixels are drawn from it by `span`.
//!
//! Blocks that show one sheet stand in **runs**: neighbours of one label, whose common edges are stepped once a row. A run's
//! positions lie in a **window** of the source image, so many rows of it that a position there is one 32-bit number.

use crate::Bundle;
use crate::atlas::Texture;
use crate::coverage::{Chart, Cover};
use crate::fixed::PlayUv;
use crate::format::{MAX_SHEETS, SPACE_CUBIC};
use crate::lists::{CHART, FIELD};
use crate::row::Layer;
use crate::sheet::{Block, Corners, RowSheets, Rows, Sheet, Stretch};

/// A side of a block in a run, in caller's memory: where it stands at the strip's current row, and how far that is from row to row.
/// u counts the picture's width as 2^32, v its window's rows as 2^31.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Edge {
    /// Across.
    pub u: u32,
    /// Down.
    pub v: u32,
    /// A row further: across.
    pub down_u: u32,
    /// A row further: down.
    pub down_v: u32,
}

impl Edge {
    /// Steps to the next row; returns where it was.
    #[inline(always)]
    pub const fn advance(&mut self) -> [u32; 2] {
        let was = [self.u, self.v];
        (self.u, self.v) = (self.u.wrapping_add(self.down_u), self.v.wrapping_add(self.down_v));
        was
    }
}

/// Neighbouring blocks that show one sheet of one label, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Run {
    /// The first block, from the left.
    pub block: u16,
    /// How many there are. They have one edge more.
    pub blocks: u16,
    /// The first edge.
    pub edge: u16,
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

    /// How far u is shifted up from Q16 texels.
    const fn shift_u(self) -> u32 {
        16u32.wrapping_sub(self.width_log2)
    }

    /// How far v is shifted up from Q16 texels.
    const fn shift_v(self) -> u32 {
        15u32.wrapping_sub(self.rows_log2)
    }

    /// The edge between `above` and `below`, 2^`log2` rows apart, in a window from `row` on.
    #[inline(always)]
    const fn edge(self, above: PlayUv, below: PlayUv, row: u32, log2: u32) -> Edge {
        let (shift_u, shift_v) = (self.shift_u(), self.shift_v());
        let [half_u, half_v] = halves(self.width_log2, self.rows_log2);
        // Both shifts are at least 5: the steps lose nothing.
        Edge {
            u: (above.u as u32).wrapping_shl(shift_u).wrapping_add(half_u),
            v: (above.v as u32).wrapping_sub(row.wrapping_shl(16)).wrapping_shl(shift_v).wrapping_add(half_v),
            down_u: (below.u.wrapping_sub(above.u) as u32).wrapping_shl(shift_u.wrapping_sub(log2)),
            down_v: (below.v.wrapping_sub(above.v) as u32).wrapping_shl(shift_v.wrapping_sub(log2)),
        }
    }
}

/// Half a step of u and of v, as edges count them: an edge's position has it added, so that cutting bits off rounds to nearest.
#[must_use]
pub const fn halves(width_log2: u32, rows_log2: u32) -> [u32; 2] {
    let bits = width_log2.wrapping_add(rows_log2);
    [1u32.wrapping_shl(bits.wrapping_sub(1)), 1u32.wrapping_shl(30u32.wrapping_sub(bits))]
}

/// Positions in runs keep this far from the edges of picture and window, Q16 texels, beside what pixels reach to: more than rounding moves them.
const MARGIN: i32 = 1 << 10;

/// A strip's blocks, in caller's memory.
#[derive(Debug)]
pub struct Plan<'m> {
    /// The runs' edges, from left to right.
    pub edge: &'m mut [Edge],
    /// The runs.
    pub run: &'m mut [Run],
    /// The other blocks.
    pub mixed: &'m mut [Mixed],
    /// How many of each there are.
    pub edges: usize,
    /// Runs.
    pub runs: usize,
    /// Mixed blocks.
    pub mixes: usize,
    /// Where the last edge's ends are across, Q16 texels: above, below.
    pub last: [i32; 2],
    /// The strip it is about; none: nothing yet.
    pub strip: Option<u32>,
    /// How far around a position pixels are told from, Q16 texels.
    pub reach: i32,
    /// The row of the strip at which the edges stand.
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

    /// Block `block` of strip `strip`, where space is cubic.
    #[must_use]
    #[inline(always)]
    pub const fn quarter(&self, block: u32, strip: u32) -> Block<'_, '_> {
        Block { rows: self.rows, quarter: Some([block & 1 == 1, strip & 1 == 1]) }
    }

    /// What is above and below strip `strip` where space is cubic, from the left corners of `sheet` on: nodes, and halfway to the next.
    fn lines(&self, strip: u32, sheet: &Sheet) -> [&[Layer]; 2] {
        let ([top, halfway, bottom], [a, b, c]) = (self.rows, sheet.nodes());
        let lines = if strip & 1 == 0 { [(top, a), (halfway, b)] } else { [(halfway, b), (bottom, c)] };
        lines.map(|(row, from)| row.point.get(usize::from(from)..).and_then(|points| bytemuck::try_cast_slice(points).ok()).unwrap_or(&[]))
    }

    fn cubic(&self) -> bool {
        self.bundle.path().space == SPACE_CUBIC
    }

    /// Block `block` of strip `strip`.
    #[must_use]
    pub fn block(&self, block: u32, strip: u32) -> Block<'_, '_> {
        if self.cubic() { self.quarter(block, strip) } else { Block { rows: self.rows, quarter: None } }
    }
}

impl Plan<'_> {
    /// Plans strip `strip` of the screen, for pixels that are told from as far as `reach` around a position.
    #[inline(never)]
    pub fn make(&mut self, site: &Site<'_, '_, '_>, strip: u32, reach: i32) {
        (self.edges, self.runs, self.mixes) = (0, 0, 0);
        (self.smooth, self.torn, self.tests) = (0, 0, 0);
        (self.strip, self.row, self.reach) = (Some(strip), 0, reach);
        let texture = site.bundle.texture();
        let window = Window::new(texture.width_log2, texture.height);
        let (log2, width) = (site.log2(), site.bundle.size().0);
        let mut across = Across { site, window, strip, log2, width, left: 0, block: 0 };
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
            // In pictures 512 wide, as most are; others go by `append` alone. Likewise the cell that the screen's edge cuts.
            if let Some(Window { width_log2: 9, .. }) = window
                && site.cubic()
            {
                let most = (width.saturating_sub(across.left) >> log2 >> 1).min(stretch.cells.wrapping_sub(along).into());
                let rest = lines.map(|line| line.get(usize::from(along).wrapping_mul(2)..).unwrap_or(&[]));
                let cells = self.extend(across.block, most as usize, sheet.label(), rest, log2);
                along = along.wrapping_add(cells);
                across.block = across.block.wrapping_add(u32::from(cells).wrapping_mul(2));
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

    /// Appends smooth cells, the first of which begins with block `block`, to the last run, both blocks of each, as long as they follow it and fit
    /// into its window, `most` at most; returns how many. `above` and `below` start at their left corners.
    #[inline(never)]
    fn extend(&mut self, block: u32, most: usize, label: u8, [above, below]: [&[Layer]; 2], log2: u32) -> u16 {
        let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1)) else { return 0 };
        if run.label != u16::from(label) || u32::from(run.block).wrapping_add(u32::from(run.blocks)) != block {
            return 0;
        }
        let (Some((_, above)), Some((_, below))) = (above.split_first(), below.split_first()) else { return 0 };
        let Some(edges) = self.edge.get_mut(self.edges..) else { return 0 };
        let window = Window { width_log2: 9, rows_log2: 5 };
        let row = u32::from(run.row);
        let margin = MARGIN.wrapping_add(self.reach);
        let least = (row as i32).wrapping_shl(16).wrapping_add(margin);
        let [across, down] = [window.width_log2, window.rows_log2].map(|log2| 1u32.wrapping_shl(log2.wrapping_add(16)));
        let [wide, high] = [across, down].map(|size| size.wrapping_sub(margin.wrapping_mul(2) as u32));
        let [mut from, mut to] = self.last;
        let mut done = 0usize;
        for ((edge, a), b) in edges.iter_mut().zip(above).zip(below).take(most.wrapping_mul(2)) {
            let (a, b) = (a.uv(), b.uv());
            // As in `append`: steps across of less than half the width, which is a power of two.
            let [near, far] = [a.u.wrapping_sub(from), b.u.wrapping_sub(to)].map(|step| step.wrapping_add((across >> 1) as i32) as u32);
            let inside = (a.u.wrapping_sub(margin) as u32) < wide && (b.u.wrapping_sub(margin) as u32) < wide && (near | far) < across;
            if !(inside && (a.v.wrapping_sub(least) as u32) < high && (b.v.wrapping_sub(least) as u32) < high) {
                break;
            }
            *edge = window.edge(a, b, row, log2);
            (from, to) = (a.u, b.u);
            done = done.wrapping_add(1);
        }
        if done & 1 == 1 {
            // Half a cell is for `append`, which finds the same.
            done = done.wrapping_sub(1);
            let before =
                |line: &[Layer], known: i32| done.checked_sub(1).and_then(|last| line.get(last)).map_or(known, |layer| layer.uv().u);
            let [a, b] = self.last;
            (from, to) = (before(above, a), before(below, b));
        }
        run.blocks = run.blocks.wrapping_add(done as u16);
        self.edges = self.edges.wrapping_add(done);
        self.last = [from, to];
        (done >> 1) as u16
    }

    fn mix(&mut self, mixed: Mixed) {
        if let Some(slot) = self.mixed.get_mut(self.mixes) {
            *slot = mixed;
            self.mixes = self.mixes.wrapping_add(1);
        }
    }

    /// Appends the block at `across`, which shows one sheet, to the last run, or begins another; false where its positions fit no window.
    #[inline(never)]
    fn append(&mut self, across: &Across<'_, '_, '_>, sheet: &Sheet, corners: Corners) -> bool {
        let Some(window) = across.window else { return false };
        let (block, log2, height) = (across.block as u16, across.log2, across.site.texture.height);
        let [a, b, c, d] = corners;
        let width = 1i32.wrapping_shl(window.width_log2.wrapping_add(16));
        let margin = MARGIN.wrapping_add(self.reach);
        let inside = |x: i32, limit: i32| (x.wrapping_sub(margin) as u32) < limit.wrapping_sub(margin.wrapping_mul(2)) as u32;
        // Steps across are told from differences of less than half the width.
        let near = |from: i32, to: i32| (to.wrapping_sub(from).wrapping_add(width >> 1) as u32) < width as u32;
        if !(inside(b.u, width) && inside(d.u, width) && near(a.u, b.u) && near(c.u, d.u)) {
            return false;
        }
        let rows = 1i32.wrapping_shl(window.rows_log2.wrapping_add(16));
        let label = u16::from(sheet.label());
        let within = |row: u16, uv: PlayUv| inside(uv.v.wrapping_sub(i32::from(row).wrapping_shl(16)), rows);
        let last = self.runs.wrapping_sub(1);
        if let (Some(run), Some(slot)) = (self.run.get_mut(last), self.edge.get_mut(self.edges))
            && run.label == label
            && run.block.wrapping_add(run.blocks) == block
            && within(run.row, b)
            && within(run.row, d)
        {
            *slot = window.edge(b, d, run.row.into(), log2);
            run.blocks = run.blocks.wrapping_add(1);
            self.edges = self.edges.wrapping_add(1);
            self.last = [b.u, d.u];
            return true;
        }
        if !(inside(a.u, width) && inside(c.u, width)) {
            return false;
        }
        // The window begins or ends at the block, so that it has room where the run is heading.
        let (low, high) = (a.v.min(b.v).min(c.v.min(d.v)), a.v.max(b.v).max(c.v.max(d.v)));
        let onwards = b.v.wrapping_add(d.v) >= a.v.wrapping_add(c.v);
        let row = if onwards {
            low.wrapping_sub(margin) >> 16
        } else {
            (high.wrapping_add(margin) >> 16).wrapping_add(1).wrapping_sub(1i32.wrapping_shl(window.rows_log2))
        };
        let row = row.min(height.wrapping_sub(1u32.wrapping_shl(window.rows_log2)) as i32).max(0) as u16;
        if ![a, b, c, d].into_iter().all(|uv| within(row, uv)) {
            return false;
        }
        let after = self.edges.wrapping_add(2);
        let (Some(slot), Some([left, right])) = (self.run.get_mut(self.runs), self.edge.get_mut(self.edges..after)) else { return false };
        *left = window.edge(a, c, row.into(), log2);
        *right = window.edge(b, d, row.into(), log2);
        *slot = Run { block, blocks: 1, edge: self.edges as u16, row, label };
        (self.edges, self.runs) = (after, self.runs.wrapping_add(1));
        self.last = [b.u, d.u];
        true
    }

    /// Steps the edges down to row `row` of the strip, which none of them is past.
    pub fn skip_to(&mut self, row: u32) {
        for _ in self.row..row {
            for edge in self.edge.get_mut(..self.edges).unwrap_or(&mut []) {
                edge.advance();
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
