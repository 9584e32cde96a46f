//! What a strip of the screen shows, block by block, worked out once for all of its rows: where one sheet covers a block, and where
//! several take turns. A strip is as many rows as a block is high. Sheets come from `sheet`, what torn cells show from `torn`; `draw` draws rows
//! of pixels from it.
//!
//! Blocks that show one sheet stand in **runs** of **tiles**, neighbours of one label whose positions lie in one window of the source image. Those
//! that show more have a tile for each, and the pixels that show it.

use crate::coverage::Bounds;
use crate::fixed::PlayUv;
use crate::key::BACKDROP;
use crate::row::Layer;
use crate::sheet::{Block, Corners, Sheet, Stretch};
use crate::site::Site;
use crate::torn::{self, Mixed, Side};
use crate::window::{self, Room, Tile, Window};

/// Neighbouring tiles that show one sheet of one label, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Run {
    /// The first tile, from the left of the screen.
    pub place: u16,
    /// How many there are.
    pub count: u16,
    /// The first of them in memory; [`PLAIN`]: they have none.
    pub tile: u16,
    /// The window's first row.
    pub row: u16,
    /// The label.
    pub label: u16,
}

/// [`Run::tile`]: it is all of the backdrop's one colour.
pub const PLAIN: u16 = u16::MAX;

/// A strip's blocks, in caller's memory.
#[derive(Debug, Default)]
pub struct Plan<'m> {
    /// The runs' tiles, from left to right.
    pub tile: &'m mut [Tile],
    /// The runs.
    pub run: &'m mut [Run],
    /// The other blocks.
    pub mixed: &'m mut [Mixed],
    /// What they show of each sheet.
    pub side: &'m mut [Side],
    /// How many of each there are.
    pub tiles: usize,
    /// Runs.
    pub runs: usize,
    /// Mixed blocks.
    pub mixes: usize,
    /// Sides.
    pub sides: usize,
    /// Mixed blocks that are drawn pixel by pixel.
    pub plain: usize,
    /// The row of tiles it is about, from the top of the screen; none: nothing yet.
    pub strip: Option<u32>,
    /// How far around a position pixels are told from, Q16 texels.
    pub reach: i32,
    /// Mixed blocks are not asked for their sides.
    pub sideless: bool,
    /// Pixels of a row in cells of one sheet.
    pub smooth: u32,
    /// Pixels of a row in cells of more.
    pub torn: u32,
    /// Coverage tests of a row.
    pub tests: u32,
}

impl Plan<'_> {
    /// Plans row `strip` of the screen's tiles, for pixels that are told from as far as `reach` around a position; `sideless`: all mixed blocks are
    /// drawn pixel by pixel.
    #[inline(never)]
    pub fn make(&mut self, site: &Site<'_, '_, '_>, strip: u32, reach: i32, sideless: bool) {
        (self.tiles, self.runs, self.mixes, self.sides, self.plain) = (0, 0, 0, 0, 0);
        (self.smooth, self.torn, self.tests) = (0, 0, 0);
        (self.strip, self.reach, self.sideless) = (Some(strip), reach, sideless);
        let texture = site.bundle.texture();
        let room = Room::new(texture.width_log2, texture.height, window::margin(site.tile_log2()).wrapping_add(reach));
        let (log2, width) = (site.log2(), site.bundle.size().0);
        let parts_log2 = log2.wrapping_sub(site.tile_log2());
        let (strip, part) = (strip.wrapping_shr(parts_log2), strip & 1u32.wrapping_shl(parts_log2).wrapping_sub(1));
        let mut across = Across { site, room, strip, part, parts_log2, log2, width, left: 0, block: 0 };
        for &stretch in site.sheets.stretches() {
            match site.sheets.of(stretch) {
                [sheet] => self.smooth(&mut across, stretch, sheet),
                sheets => self.cell(&mut across, stretch, sheets),
            }
        }
    }

    /// Plans a stretch of cells that show one sheet.
    fn smooth(&mut self, across: &mut Across<'_, '_, '_>, stretch: Stretch, sheet: &Sheet) {
        let before = across.left;
        self.cells(across, Mixed { sheet: stretch.sheet, sheets: 1, ..Mixed::default() }, sheet, stretch.cells);
        self.smooth = self.smooth.wrapping_add(across.left.min(across.width).saturating_sub(before));
    }

    /// Plans so many `cells` that show `sheet` in this strip, and nothing else of what they have; `mixed` names it for the first of them.
    fn cells(&mut self, across: &mut Across<'_, '_, '_>, mixed: Mixed, sheet: &Sheet, cells: u16) {
        let Across { site, room, strip, width, .. } = *across;
        let lines = site.lines(strip, sheet);
        let mut along = 0u16;
        if site.plain(sheet) {
            self.plain(across, across.blocks().wrapping_mul(cells.into()));
            across.step(across.blocks().wrapping_mul(cells.into()));
            return;
        }
        while along < cells && across.left < width {
            // In pictures 512 wide, as most are, and cells of eight pixels; others go by `append` alone. Likewise the cell that the screen's edge cuts.
            let most = (width.saturating_sub(across.left) >> 3).min(cells.wrapping_sub(along).into());
            if most > 0
                && let Some(room) = &room
                && (room.window == Window::USUAL || room.window == Window::NARROW)
                && site.bundle.grid().log2 == 3
            {
                let rest = lines.map(|line| line.get(usize::from(along).wrapping_mul(across.blocks() as usize)..).unwrap_or(&[]));
                let (block, label) = (across.block, sheet.label());
                let extend = |plan: &mut Self| match (site.cubic(), room.window == Window::USUAL) {
                    (true, true) => plan.extend::<9, 2, 2>(most as usize, room.margin, rest),
                    (true, false) => plan.extend::<8, 2, 2>(most as usize, room.margin, rest),
                    (false, true) => plan.extend::<9, 1, 3>(most as usize, room.margin, rest),
                    (false, false) => plan.extend::<8, 1, 3>(most as usize, room.margin, rest),
                };
                let mut more = if self.follows(label, block) { extend(self) } else { 0 };
                if more == 0
                    && let [[a, b, ..], [c, d, ..]] = rest
                    && self.begin(room, label, block, &[a.uv(), b.uv(), c.uv(), d.uv()])
                {
                    more = extend(self);
                }
                along = along.wrapping_add(more);
                across.step(across.blocks().wrapping_mul(more.into()));
                if more > 0 {
                    continue;
                }
            }
            let here = sheet.further(along);
            for _ in 0..across.blocks() {
                let place = across.place();
                if !self.append(across, &here, place.corners(&here)) {
                    self.mix(across, Mixed { block: across.block as u16, along, ..mixed });
                }
                across.step(1);
            }
            along = along.wrapping_add(1);
        }
    }

    /// Plans a cell that shows several sheets, or none.
    fn cell(&mut self, across: &mut Across<'_, '_, '_>, stretch: Stretch, sheets: &[Sheet]) {
        let before = across.left;
        let [first, second] = torn::candidates(across.site, across.strip, sheets);
        let mixed = |sheets: u16| Mixed { sheet: stretch.sheet, sheets, ..Mixed::default() };
        let single = |shown: u16| sheets.get(shown.trailing_zeros() as usize).filter(|_| shown.is_power_of_two());
        match single(first).filter(|_| first == second) {
            Some(sheet) => self.cells(across, mixed(first), sheet, 1),
            None => {
                for shown in [first, second].into_iter().take(across.blocks() as usize) {
                    let place = across.place();
                    if !single(shown).is_some_and(|sheet| self.append(across, sheet, place.corners(sheet))) {
                        self.mix(across, Mixed { block: across.block as u16, ..mixed(shown) });
                        let pixels = across.width.saturating_sub(across.left).min(1 << across.log2);
                        self.tests = self.tests.wrapping_add(pixels.wrapping_mul(shown.count_ones().saturating_sub(1)));
                    }
                    across.step(1);
                }
            }
        }
        let pixels = across.left.min(across.width).saturating_sub(before);
        let kind = if sheets.is_empty() { &mut self.smooth } else { &mut self.torn };
        *kind = kind.wrapping_add(pixels);
    }

    /// Whether tile `place` of `label` comes right after the last run.
    #[inline(always)]
    fn follows(&self, label: u8, place: u32) -> bool {
        let run = self.run.get(self.runs.wrapping_sub(1));
        run.is_some_and(|run| run.label == u16::from(label) && u32::from(run.place).wrapping_add(u32::from(run.count)) == place)
    }

    /// Begins a run of no tiles yet, in a window that holds the tile of these corners; false where there is none.
    #[inline(never)]
    fn begin(&mut self, room: &Room, label: u8, place: u32, corners: &Corners) -> bool {
        let Some(row) = room.onwards(corners) else { return false };
        let Some(run) = self.run.get_mut(self.runs) else { return false };
        *run = Run { place: place as u16, count: 0, tile: self.tiles as u16, row, label: label.into() };
        self.runs = self.runs.wrapping_add(1);
        true
    }

    /// Appends smooth cells to the last run, which they follow, as long as they fit into its window, `most` at most; returns how many. `above` and
    /// `below` start at their left corners: between each two of these is a tile of 2^LOG2 pixels, TILES a cell.
    #[inline(never)]
    fn extend<const WIDTH: u32, const TILES: usize, const LOG2: u32>(
        &mut self,
        most: usize,
        margin: i32,
        [above, below]: [&[Layer]; 2],
    ) -> u16 {
        let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1)) else { return 0 };
        let Some(slots) = self.tile.get_mut(self.tiles..) else { return 0 };
        let Some(slots) = slots.get_mut(..most.wrapping_mul(TILES)) else { return 0 };
        let window = Window { width_log2: WIDTH, ..Window::USUAL };
        // From the window's corner, and the margin on from there: inside is what is not negative and below the room, one comparison for both.
        let corner = PlayUv { u: margin, v: margin.wrapping_add(i32::from(run.row).wrapping_shl(16)) };
        let room = |log2: u32| 1u32.wrapping_shl(log2.wrapping_add(16)).wrapping_sub((margin as u32).wrapping_mul(2));
        let (across, down) = (room(window.width_log2), room(window.rows_log2));
        let margins = window.pack(margin, margin, 0);
        let mut ends = above.iter().zip(below).map(|(above, below)| [above.uv(), below.uv()].map(|uv| uv.less(corner)));
        let Some([mut a, mut c]) = ends.next() else { return 0 };
        let mut done = 0usize;
        for (slot, [b, d]) in slots.iter_mut().zip(ends) {
            if b.u as u32 >= across || d.u as u32 >= across || b.v as u32 >= down || d.v as u32 >= down {
                break;
            }
            let (right, left, below) = (b.less(a), c.less(a), d.less(c));
            let turn = below.less(right);
            *slot = Tile {
                // The margin is a multiple of what positions are rounded to.
                at: window.pack(a.u, a.v, 0).wrapping_add(margins),
                step: window.pack(right.u, right.v, LOG2),
                down: window.pack(left.u, left.v, LOG2),
                turn: window.pack(turn.u, turn.v, LOG2.wrapping_mul(2)),
            };
            (a, c) = (b, d);
            done = done.wrapping_add(1);
        }
        // Half a cell is for `append`, which finds the same.
        let cells = if TILES == 1 { done } else { done >> 1 };
        let done = cells.wrapping_mul(TILES);
        run.count = run.count.wrapping_add(done as u16);
        self.tiles = self.tiles.wrapping_add(done);
        cells as u16
    }

    /// Adds a block that no run has, with its sides where it has such.
    fn mix(&mut self, across: &Across<'_, '_, '_>, mixed: Mixed) {
        let free = self.side.get_mut(self.sides..).unwrap_or(&mut []);
        let room = across.room.as_ref().filter(|_| !self.sideless);
        let sides = room.and_then(|room| mixed.share(across.site, across.strip, room, free)).unwrap_or(0);
        if let Some(slot) = self.mixed.get_mut(self.mixes) {
            *slot = Mixed { sides: sides as u16, ..mixed };
            (self.mixes, self.sides) = (self.mixes.wrapping_add(1), self.sides.wrapping_add(sides));
            self.plain = self.plain.wrapping_add(usize::from(sides == 0));
        }
    }

    /// Appends the block at `across`, which shows one sheet, to the last run, or begins others; false where its positions fit no window. What was
    /// appended then is drawn over.
    #[inline(never)]
    fn append(&mut self, across: &Across<'_, '_, '_>, sheet: &Sheet, [a, b, c, d]: Corners) -> bool {
        if across.site.plain(sheet) {
            return self.plain(across, 1);
        }
        let Some(room) = &across.room else { return false };
        let label = sheet.label();
        let log2 = across.parts_log2;
        if log2 == 0 {
            return self.tile(across, room, label, across.block, [a, b, c, d]);
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
            self.tile(across, room, label, across.block.wrapping_shl(log2).wrapping_add(part), corners)
        })
    }

    /// Appends so many `blocks` of the backdrop's one colour to the last run, or begins another.
    fn plain(&mut self, across: &Across<'_, '_, '_>, blocks: u32) -> bool {
        let [place, count] = [across.block, blocks].map(|blocks| blocks.wrapping_shl(across.parts_log2) as u16);
        if let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1))
            && run.tile == PLAIN
            && run.place.wrapping_add(run.count) == place
        {
            run.count = run.count.wrapping_add(count);
            return true;
        }
        let Some(run) = self.run.get_mut(self.runs) else { return false };
        *run = Run { place, count, tile: PLAIN, row: 0, label: BACKDROP };
        self.runs = self.runs.wrapping_add(1);
        true
    }

    /// Appends the tile at `place` to the last run, or begins another; false where its positions fit no window.
    fn tile(&mut self, across: &Across<'_, '_, '_>, room: &Room, label: u8, place: u32, corners: Corners) -> bool {
        let log2 = across.log2.wrapping_sub(across.parts_log2);
        if self.tiles >= self.tile.len() {
            return false;
        }
        let inside = |run: &Run| room.holds(&Bounds::around(&corners), run.row);
        let stays = self.follows(label, place) && self.run.get(self.runs.wrapping_sub(1)).is_some_and(inside);
        if !(stays || self.begin(room, label, place, &corners)) {
            return false;
        }
        let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1)) else { return false };
        let Some(slot) = self.tile.get_mut(self.tiles) else { return false };
        *slot = room.window.tile(corners, run.row, log2);
        run.count = run.count.wrapping_add(1);
        self.tiles = self.tiles.wrapping_add(1);
        true
    }
}

/// How far a strip is planned.
#[derive(Clone, Copy, Debug)]
struct Across<'s, 'a, 'm> {
    site: &'s Site<'s, 'a, 'm>,
    room: Option<Room>,
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

    /// On by so many blocks.
    fn step(&mut self, blocks: u32) {
        self.block = self.block.wrapping_add(blocks);
        self.left = self.block.wrapping_shl(self.log2);
    }
}
