//! What a strip of the screen shows, block by block, worked out once for all of its rows: where one sheet covers a block, and where
//! several take turns. A strip is as many rows as a block is high. Sheets come from `sheet`, what torn cells show from `torn`; `draw` draws rows
//! of pixels from it.
//!
//! Blocks that show one sheet stand in **runs** of **tiles**, neighbours of one label whose positions lie in one window of the source image. Those
//! that show more have a tile for each, and the pixels that show it.

use crate::key::BACKDROP;
use crate::patch::Patch;
use crate::row::{Layer, Place};
use crate::sheet::{Sheet, Stretch};
use crate::site::Site;
use crate::torn::{self, Mixed, Side};
use crate::window::{self, Middle, Room, Tile, Window};

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
    pub label: u8,
    /// Its tiles bend nowhere across: 1.
    pub straight: u8,
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
    /// The row of blocks it is about, from the top of the screen; none: nothing yet.
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

/// Curves of runs that are extended cell by cell bulge by at most this, Q16 texels: others are looked at one by one.
const BULGE: i32 = 1 << 18;

impl Plan<'_> {
    /// Plans row `strip` of the screen's blocks, for pixels that are told from as far as `reach` around a position; `sideless`: all mixed blocks are
    /// drawn pixel by pixel.
    #[inline(never)]
    pub fn make(&mut self, site: &Site<'_, '_, '_>, strip: u32, reach: i32, sideless: bool) {
        (self.tiles, self.runs, self.mixes, self.sides, self.plain) = (0, 0, 0, 0, 0);
        (self.smooth, self.torn, self.tests) = (0, 0, 0);
        (self.strip, self.reach, self.sideless) = (Some(strip), reach, sideless);
        let (texture, log2) = (site.bundle.texture(), site.block_log2());
        let room = Room::new(texture.width_log2, texture.height, window::margin(log2).wrapping_add(reach));
        let blocks = 1u32.wrapping_shl(site.log2().wrapping_sub(log2));
        let mut across = Across { site, room, strip, log2, blocks, width: site.bundle.size().0, left: 0, block: 0 };
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
        let mut along = 0u16;
        if across.site.plain(sheet) {
            let blocks = across.blocks.wrapping_mul(stretch.cells.into());
            self.plain(across, blocks);
            across.step(blocks);
            along = stretch.cells;
        }
        while along < stretch.cells && across.left < across.width {
            // In pictures 512 and 256 wide, as most are, and cells of eight or sixteen pixels; others go by `append` alone. Likewise the cell that the
            // screen's edge cuts.
            let most =
                across.width.saturating_sub(across.left).wrapping_shr(across.site.log2()).min(stretch.cells.wrapping_sub(along).into());
            let more = if most > 0 { self.extend(across, sheet, along, most as usize) } else { 0 };
            if more > 0 {
                along = along.wrapping_add(more);
                across.step(across.blocks.wrapping_mul(more.into()));
                continue;
            }
            let here = sheet.further(along);
            for _ in 0..across.blocks {
                if !self.append(across, &here) {
                    let mixed = Mixed { sheet: stretch.sheet, sheets: 1, ..Mixed::default() };
                    self.mix(across, Mixed { block: across.block as u16, along, ..mixed });
                }
                across.step(1);
            }
            along = along.wrapping_add(1);
        }
        self.smooth = self.smooth.wrapping_add(across.left.min(across.width).saturating_sub(before));
    }

    /// Plans a cell that shows several sheets, or none.
    fn cell(&mut self, across: &mut Across<'_, '_, '_>, stretch: Stretch, sheets: &[Sheet]) {
        let before = across.left;
        for _ in 0..across.blocks {
            let shown = torn::candidates(across.site, across.offset(), sheets);
            let single = sheets.get(shown.trailing_zeros() as usize).filter(|_| shown.is_power_of_two());
            if !single.is_some_and(|sheet| self.append(across, sheet)) {
                self.mix(across, Mixed { block: across.block as u16, sheet: stretch.sheet, sheets: shown, ..Mixed::default() });
                let pixels = across.width.saturating_sub(across.left).min(1 << across.log2);
                self.tests = self.tests.wrapping_add(pixels.wrapping_mul(shown.count_ones().saturating_sub(1)));
            }
            across.step(1);
        }
        let pixels = across.left.min(across.width).saturating_sub(before);
        let kind = if sheets.is_empty() { &mut self.smooth } else { &mut self.torn };
        *kind = kind.wrapping_add(pixels);
    }

    /// Whether tile `place` of `label` comes right after the last run.
    #[inline(always)]
    fn follows(&self, label: u8, place: u32) -> bool {
        let run = self.run.get(self.runs.wrapping_sub(1));
        run.is_some_and(|run| run.label == label && u32::from(run.place).wrapping_add(u32::from(run.count)) == place)
    }

    /// Begins a run of no tiles yet, in a window that holds `patch`, and `more` than that where it can; false where there is none.
    #[inline(never)]
    fn begin(&mut self, across: &Across<'_, '_, '_>, room: &Room, label: u8, patch: &Patch, more: i32) -> bool {
        let Some(row) = room.onwards(patch, more) else { return false };
        let Some(run) = self.run.get_mut(self.runs) else { return false };
        let straight = u8::from(across.site.straight());
        *run = Run { place: across.block as u16, count: 0, tile: self.tiles as u16, row, label, straight };
        self.runs = self.runs.wrapping_add(1);
        true
    }

    /// Appends smooth cells of `sheet`, from the `along`-th of its stretch on, to a run, `most` at most; returns how many.
    fn extend(&mut self, across: &Across<'_, '_, '_>, sheet: &Sheet, along: u16, most: usize) -> u16 {
        let Some(room) = &across.room else { return 0 };
        let ([top, bottom], [above, below]) = (across.site.rows, sheet.further(along).nodes().map(usize::from));
        let low = across.offset()[1] > 0;
        let bends = [top.node.get(above..).unwrap_or(&[]), bottom.node.get(below..).unwrap_or(&[])];
        let flat = [top.layer.get(above..).unwrap_or(&[]), bottom.layer.get(below..).unwrap_or(&[])];
        // What most bundles are made of has code of its own.
        let grow = |plan: &mut Self| match (room.window, across.site.log2(), across.site.straight()) {
            (Window::USUAL, 3, false) => plan.grow::<9, 1, _>(most, room.margin, low, bends),
            (Window::NARROW, 3, false) => plan.grow::<8, 1, _>(most, room.margin, low, bends),
            (Window::USUAL, 4, false) => plan.grow::<9, 2, _>(most, room.margin, low, bends),
            (Window::USUAL, 3, true) => plan.grow::<9, 1, _>(most, room.margin, low, flat),
            (Window::USUAL, 4, true) => plan.grow::<9, 2, _>(most, room.margin, low, flat),
            _ => 0,
        };
        let mut more = if self.follows(sheet.label(), across.block) { grow(self) } else { 0 };
        if more == 0 && self.begin(across, room, sheet.label(), &across.site.cell(&sheet.further(along)), BULGE) {
            more = grow(self);
        }
        more
    }

    /// Appends cells of so many `TILES` a row of blocks to the last run, which they follow, as long as they fit into its window, `most` at most; returns
    /// how many. The `lines` above and below start at their left corners; `low`: of cells of two rows of blocks it is the lower one.
    #[inline(never)]
    fn grow<const WIDTH: u32, const TILES: usize, T: Place>(&mut self, most: usize, margin: i32, low: bool, lines: [&[T]; 2]) -> u16 {
        let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1)) else { return 0 };
        let Some(slots) = self.tile.get_mut(self.tiles..).map(|slots| slots.as_chunks_mut::<TILES>().0) else { return 0 };
        let Some(slots) = slots.get_mut(..most) else { return 0 };
        let window = Window { width_log2: WIDTH, ..Window::USUAL };
        let margin = margin.wrapping_add(BULGE);
        // An axis after the other: what is known of both at a time would not fit a small processor's registers.
        let done = lay::<true, TILES, T>(slots, lines, i32::from(run.row).wrapping_shl(16), margin, low, window);
        let done = lay::<false, TILES, T>(slots.get_mut(..done).unwrap_or(&mut []), lines, 0, margin, low, window);
        let tiles = done.wrapping_mul(TILES);
        run.count = run.count.wrapping_add(tiles as u16);
        self.tiles = self.tiles.wrapping_add(tiles);
        done as u16
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

    /// Appends the block at `across`, which shows one sheet, to the last run, or begins another; false where its positions fit no window.
    #[inline(never)]
    fn append(&mut self, across: &Across<'_, '_, '_>, sheet: &Sheet) -> bool {
        if across.site.plain(sheet) {
            return self.plain(across, 1);
        }
        let Some(room) = &across.room else { return false };
        if self.tiles >= self.tile.len() {
            return false;
        }
        let (label, patch) = (sheet.label(), across.site.block(&across.site.cell(sheet), across.offset()));
        let inside = |run: &Run| room.holds(&patch.bounds(), run.row);
        let stays = self.follows(label, across.block) && self.run.get(self.runs.wrapping_sub(1)).is_some_and(inside);
        if !(stays || self.begin(across, room, label, &patch, 0)) {
            return false;
        }
        let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1)) else { return false };
        let Some(slot) = self.tile.get_mut(self.tiles) else { return false };
        *slot = room.window.tile(&patch, run.row, across.log2);
        run.count = run.count.wrapping_add(1);
        self.tiles = self.tiles.wrapping_add(1);
        true
    }

    /// Appends so many `blocks` of the backdrop's one colour to the last run, or begins another.
    fn plain(&mut self, across: &Across<'_, '_, '_>, blocks: u32) -> bool {
        let [place, count] = [across.block, blocks].map(|blocks| blocks as u16);
        if let Some(run) = self.run.get_mut(self.runs.wrapping_sub(1))
            && run.tile == PLAIN
            && run.place.wrapping_add(run.count) == place
        {
            run.count = run.count.wrapping_add(count);
            return true;
        }
        let Some(run) = self.run.get_mut(self.runs) else { return false };
        *run = Run { place, count, tile: PLAIN, row: 0, label: BACKDROP as u8, straight: 1 };
        self.runs = self.runs.wrapping_add(1);
        true
    }
}

/// Fills `slots` with v (`DOWN`), or adds u, of the tiles of cells between nodes above and below, as long as these lie a `margin` inside the window,
/// which begins at `first`; returns how many do. Of cells of two tiles a row, `low` says which row it is.
#[inline(always)]
fn lay<const DOWN: bool, const TILES: usize, T: Place>(
    slots: &mut [[Tile; TILES]],
    [above, below]: [&[T]; 2],
    first: i32,
    margin: i32,
    low: bool,
    window: Window,
) -> usize {
    let one = |layer: Layer| if DOWN { layer.uv().v } else { layer.uv().u };
    let log2 = if DOWN { window.rows_log2 } else { window.width_log2 };
    // From the margin on: inside is what is not negative and below the room, one comparison for both.
    let room = 1u32.wrapping_shl(log2.wrapping_add(16)).wrapping_sub((margin as u32).wrapping_mul(2));
    let corner = first.wrapping_add(margin);
    let mut edges = above.iter().zip(below);
    let at = |node: &T| one(node.layer()).wrapping_sub(corner);
    let sums = |above: &T, below: &T| {
        let ([a, b], [c, d]) = (above.bends().map(one), below.bends().map(one));
        [a.wrapping_add(c), b.wrapping_add(d)]
    };
    let Some((above, below)) = edges.next() else { return 0 };
    let ([mut a, mut c], mut left) = ([at(above), at(below)], sums(above, below));
    let mut done = 0usize;
    for (slots, (above, below)) in slots.iter_mut().zip(edges) {
        let ([b, d], right) = ([at(above), at(below)], sums(above, below));
        let bends = [left[0].wrapping_add(right[0]), left[1].wrapping_add(right[1])];
        // It bulges by a 32nd of each.
        const MOST: u32 = (BULGE as u32) << 4;
        let bulges = (bends[0] as u32).wrapping_add(MOST) | (bends[1] as u32).wrapping_add(MOST);
        if b as u32 >= room || d as u32 >= room || bulges >= 2 * MOST {
            break;
        }
        let log2 = if TILES == 1 { 3 } else { 4 };
        let cell = Middle::new([a, b, c, d], bends, log2).plus(margin);
        for (slot, right) in slots.iter_mut().zip([false, true]) {
            let block = if TILES == 1 { cell } else { cell.quarter(right, low, log2) };
            let tile = block.lanes(3, |x, log2| window.lane::<DOWN>(x, log2));
            *slot = if DOWN { tile } else { slot.plus(&tile).from_middle(3) };
        }
        (a, c, left) = (b, d, right);
        done = done.wrapping_add(1);
    }
    done
}

/// How far a strip is planned.
#[derive(Clone, Copy, Debug)]
struct Across<'s, 'a, 'm> {
    site: &'s Site<'s, 'a, 'm>,
    room: Option<Room>,
    strip: u32,
    /// A block is 2^this pixels wide.
    log2: u32,
    /// Blocks of a cell, from left to right.
    blocks: u32,
    /// The screen's width, and pixels to the left of the next block.
    width: u32,
    left: u32,
    /// The next block.
    block: u32,
}

impl Across<'_, '_, '_> {
    /// How far the next block is from its cell's left upper corner, pixels.
    fn offset(&self) -> [u32; 2] {
        self.site.offset(self.block, self.strip)
    }

    /// On by so many blocks.
    fn step(&mut self, blocks: u32) {
        self.block = self.block.wrapping_add(blocks);
        self.left = self.block.wrapping_shl(self.log2);
    }
}
