//! What a strip of the screen shows, block by block, worked out once for all of its rows: where one sheet covers a block, and where
//! several take turns. A strip is as many rows as a block is high. Sheets come from `sheet`, what torn cells show from `torn`; `draw` draws rows
//! of pixels from it.
//!
//! A block is a **tile**: how its positions go, in a window of the source image. One that shows more than one sheet has a tile of the one that most of
//! its pixels show; each other is a **side**: a tile, and the pixels that show it, drawn over that.

use crate::fixed::PlayUv;
use crate::row::{Layer, Place};
use crate::sheet::{Sheet, Stretch};
use crate::site::{BLOCK_LOG2, Site};
use crate::torn::{self, Mixed, Shown, Side};
use crate::window::{Head, Middle, Room, Tile, Window};
use core::slice;

/// A strip's blocks, in caller's memory.
#[derive(Debug, Default)]
pub struct Plan<'m> {
    /// A tile for every block, from left to right.
    pub tile: &'m mut [Tile],
    /// What torn blocks show beside that.
    pub side: &'m mut [Side],
    /// The blocks that have neither.
    pub mixed: &'m mut [Mixed],
    /// How many of each there are: tiles,
    pub tiles: usize,
    /// sides,
    pub sides: usize,
    /// mixed blocks.
    pub mixes: usize,
    /// The window of the last tile: its first row.
    pub near: u16,
    /// The row of blocks it is about, from the top of the screen; none: nothing yet.
    pub strip: Option<u32>,
    /// How far around a position pixels are told from, Q16 texels.
    pub reach: i32,
    /// Where the backdrop is, if it is of one colour.
    pub backdrop: PlayUv,
    /// Torn blocks are not asked for their sides.
    pub sideless: bool,
    /// Pixels of a row in cells of one sheet.
    pub smooth: u32,
    /// Pixels of a row in cells of more.
    pub torn: u32,
    /// Coverage tests of a row.
    pub tests: u32,
}

/// Cells that are laid out in a row bulge by at most this, Q16 texels: others are looked at one by one.
const BULGE: i32 = 1 << 18;

impl Plan<'_> {
    /// Plans row `strip` of the screen's blocks, for pixels that are told from as far as `reach` around a position; `sideless`: all torn blocks are
    /// drawn pixel by pixel.
    #[inline(never)]
    pub fn make(&mut self, site: &Site<'_, '_, '_>, strip: u32, reach: i32, sideless: bool) {
        (self.tiles, self.sides, self.mixes) = (0, 0, 0);
        (self.smooth, self.torn, self.tests) = (0, 0, 0);
        (self.strip, self.reach, self.sideless) = (Some(strip), reach, sideless);
        self.backdrop = site.backdrop();
        let (texture, log2) = (site.texture, site.block_log2());
        let room = Room::new(texture.width_log2, texture.height, log2, reach);
        // The last strip may have been planned for pixels that are told from fewer texels.
        self.near = room.map_or(0, |room| room.known(self.near));
        let blocks = 1u32.wrapping_shl(site.log2().wrapping_sub(log2));
        let [_, down] = site.offset(0, strip);
        let mut across = Across { site, room, down, log2, blocks, width: site.bundle.size().0, left: 0, block: 0 };
        for &stretch in site.sheets.stretches() {
            match site.sheets.of(stretch) {
                [sheet] => self.smooth(&mut across, stretch, sheet),
                sheets => self.cell(&mut across, stretch, sheets),
            }
        }
        self.count();
    }

    /// Counts, from every tile on, its neighbours in one window, whatever they show.
    fn count(&mut self) {
        let (mut row, mut more) = (u16::MAX, u8::MAX);
        let mut tiles = self.tile.get_mut(..self.tiles).unwrap_or(&mut []);
        // From the right, by a length: of pointers it would be a division, which small processors have none of.
        while let Some((tile, others)) = tiles.split_last_mut() {
            more = if tile.head.row() == row { more.saturating_add(1) } else { 0 };
            row = tile.head.row();
            tile.head = tile.head.before(more);
            tiles = others;
        }
    }

    /// Plans a stretch of cells that show one sheet.
    fn smooth(&mut self, across: &mut Across<'_, '_, '_>, stretch: Stretch, sheet: &Sheet) {
        let before = across.left;
        let mut along = 0u16;
        if across.site.plain(sheet.label()) {
            let blocks = across.blocks.wrapping_mul(stretch.cells.into());
            self.plain(blocks);
            across.step(blocks);
            along = stretch.cells;
        }
        while along < stretch.cells && across.left < across.width {
            // Cells of eight or sixteen pixels; others go by `append` alone. Likewise the cell that the screen's edge cuts.
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
                    self.block(across, slice::from_ref(&here), Mixed { sheet: stretch.sheet, along, ..Mixed::default() });
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
            self.block(across, sheets, Mixed { sheet: stretch.sheet, ..Mixed::default() });
            across.step(1);
        }
        let pixels = across.left.min(across.width).saturating_sub(before);
        let kind = if sheets.is_empty() { &mut self.smooth } else { &mut self.torn };
        *kind = kind.wrapping_add(pixels);
    }

    /// Appends tiles of smooth cells of `sheet`, from the `along`-th of its stretch on, `most` at most; returns of how many cells.
    fn extend(&mut self, across: &Across<'_, '_, '_>, sheet: &Sheet, along: u16, most: usize) -> u16 {
        // Smaller blocks have no code of their own.
        let Some(room) = across.room.as_ref().filter(|_| across.log2 == BLOCK_LOG2) else { return 0 };
        let ([top, bottom], [above, below]) = (across.site.rows, sheet.further(along).nodes().map(usize::from));
        let cells = Cells { room, label: sheet.label(), low: across.down > 0, most, near: self.near };
        if across.site.straight() {
            let flat = [top.layer.get(above..).unwrap_or(&[]), bottom.layer.get(below..).unwrap_or(&[])];
            return match across.blocks {
                1 => self.grow::<1, false, _>(&cells, flat),
                2 => self.grow::<2, false, _>(&cells, flat),
                _ => 0,
            };
        }
        let bends = [top.node.get(above..).unwrap_or(&[]), bottom.node.get(below..).unwrap_or(&[])];
        match across.blocks {
            // What most bundles are made of has code of its own.
            1 if room.window == Window::USUAL => self.grow::<1, true, _>(&cells, bends),
            1 => self.grow::<1, false, _>(&cells, bends),
            2 => self.grow::<2, false, _>(&cells, bends),
            _ => 0,
        }
    }

    /// Appends tiles of `cells` of so many `TILES` a row of blocks, as long as each fits a window; returns of how many. The `lines` above and below start
    /// at their left corners.
    // Windows other than the usual one have no code of their own: a kilobyte or more each.
    #[inline(never)]
    fn grow<const TILES: usize, const USUAL: bool, T: Place>(&mut self, cells: &Cells<'_>, lines: [&[T]; 2]) -> u16 {
        let Some(slots) = self.tile.get_mut(self.tiles..).map(|slots| slots.as_chunks_mut::<TILES>().0) else { return 0 };
        let Some(slots) = slots.get_mut(..cells.most) else { return 0 };
        let done = lay::<TILES, USUAL, T>(slots, lines, cells);
        self.near = slots.get(done.wrapping_sub(1)).and_then(|tiles| tiles.last()).map_or(self.near, |last| last.head.row());
        self.tiles = self.tiles.wrapping_add(done.wrapping_mul(TILES));
        done as u16
    }

    /// Plans the block at `across`, of a cell of `sheets`: by sides, or else by a tile alone, or pixel by pixel, as `mixed` says.
    #[inline(always)]
    fn block(&mut self, across: &Across<'_, '_, '_>, sheets: &[Sheet], mixed: Mixed) {
        if !self.share(across, sheets) {
            self.other(across, sheets, mixed);
        }
    }

    /// Plans the block by sides, of which the one that most pixels show becomes its tile; false where it has none.
    #[inline(never)]
    fn share(&mut self, across: &Across<'_, '_, '_>, sheets: &[Sheet]) -> bool {
        let Some(room) = across.room.as_ref().filter(|_| !self.sideless) else { return false };
        let (site, first) = (across.site, self.sides);
        let free = self.side.get_mut(first..).unwrap_or(&mut []);
        let Some(share) = torn::share(site, across.block, across.offset(), sheets, (room, self.near), free) else { return false };
        self.tests = self.tests.wrapping_add(across.tests(share.sheets));
        self.sides = first.wrapping_add(share.sides);
        self.base(site, share.most.map(|most| first.wrapping_add(most)));
        true
    }

    /// Plans the block without sides.
    #[inline(never)]
    fn other(&mut self, across: &Across<'_, '_, '_>, sheets: &[Sheet], mixed: Mixed) {
        let shown = torn::candidates(across.site, across.offset(), sheets);
        let single = sheets.get(shown.trailing_zeros() as usize).filter(|_| shown.is_power_of_two());
        if single.is_some_and(|sheet| self.append(across, sheet)) {
            return;
        }
        self.tests = self.tests.wrapping_add(across.tests(shown.count_ones()));
        self.put(Tile::NONE);
        if let Some(slot) = self.mixed.get_mut(self.mixes) {
            *slot = Mixed { block: across.block as u16, sheets: shown, ..mixed };
            self.mixes = self.mixes.wrapping_add(1);
        }
    }

    /// Makes side `side` the tile of its block, drawn all over it before the other sides are drawn over that; none: it has only sides.
    #[inline(always)]
    fn base(&mut self, site: &Site<'_, '_, '_>, side: Option<usize>) {
        let Some((most, slot)) = side.and_then(|side| self.side.get_mut(side)).zip(self.tile.get_mut(self.tiles)) else {
            return self.put(Tile::NONE);
        };
        most.shown = Shown::NONE;
        // Seldom it is none of the last ones: to move others would take longer than to pass it by.
        if side == Some(self.sides.wrapping_sub(1)) {
            self.sides = self.sides.wrapping_sub(1);
        }
        let head = most.tile.head;
        if site.plain(head.label()) {
            self.plain(1);
        } else {
            // Number by number: it would be moved by a call.
            *slot = most.tile.of(head);
            self.near = head.row();
            self.tiles = self.tiles.wrapping_add(1);
        }
    }

    /// Appends the block at `across`, which shows one sheet; false where its positions fit no window.
    #[inline(never)]
    fn append(&mut self, across: &Across<'_, '_, '_>, sheet: &Sheet) -> bool {
        if across.site.plain(sheet.label()) {
            self.plain(1);
            return true;
        }
        let Some(room) = &across.room else { return false };
        let patch = across.site.block(sheet, across.offset());
        let Some(row) = room.row(&patch.bounds(), self.near) else { return false };
        if let Some(slot) = self.tile.get_mut(self.tiles) {
            room.window.put(slot, &patch, sheet.label(), row, across.log2);
            self.near = row;
            self.tiles = self.tiles.wrapping_add(1);
        }
        true
    }

    /// Appends so many `blocks` of the backdrop's one colour.
    fn plain(&mut self, blocks: u32) {
        (0..blocks).for_each(|_| self.put(Tile::PLAIN));
    }

    /// Appends a tile that is in no window.
    #[inline(always)]
    fn put(&mut self, tile: Tile) {
        if let Some(slot) = self.tile.get_mut(self.tiles) {
            *slot = tile;
            self.tiles = self.tiles.wrapping_add(1);
        }
    }
}

/// Smooth cells of one label, from left to right, that tiles are wanted of.
struct Cells<'r> {
    room: &'r Room,
    label: u8,
    /// Of cells of two rows of blocks it is the lower one.
    low: bool,
    /// How many, at most.
    most: usize,
    /// The window to their left: its first row.
    near: u16,
}

impl Cells<'_> {
    /// How far nodes keep from the edges of a window, Q16 texels.
    const fn margin(&self) -> i32 {
        // Drawn straight, they bulge by an eighth more.
        self.room.margin.wrapping_add(BULGE + BULGE / 8)
    }

    /// How much of 2^`log2` texels of a window is further than that from its edges, Q16. Counted from the margin on, what is inside is not negative and below
    /// this, one comparison for both.
    #[inline(always)]
    const fn within(&self, log2: u32) -> u32 {
        1u32.wrapping_shl(log2.wrapping_add(16)).wrapping_sub((self.margin() as u32).wrapping_mul(2))
    }

    /// The kind of window, which may be known to be the `USUAL` one.
    #[inline(always)]
    const fn window_of<const USUAL: bool>(&self) -> Window {
        if USUAL { Window::USUAL } else { self.room.window }
    }

    /// The first row of a window for the cell whose v are these at its corners, one that has room where they are heading; `None` where none holds it.
    #[inline(never)]
    fn window(&self, [a, b, c, d]: [i32; 4]) -> Option<i32> {
        let (low, high) = (a.min(c).min(b.min(d)), a.max(c).max(b.max(d)));
        let margin = self.margin();
        let rising = b.wrapping_add(d) >= a.wrapping_add(c);
        let row = if rising { self.room.first(low, margin) } else { self.room.first_to(high, margin) };
        Some(row).filter(|&row| self.room.holds(low, high, row, margin))
    }

    /// The tiles of the cell between these edges, which bends by these sums of second differences, `more` all over; `lane`: theirs.
    #[inline(always)]
    fn tiles<const TILES: usize>(
        &self,
        left: Edge,
        right: Edge,
        sums: [i32; 2],
        more: i32,
        lane: impl Fn(i32, u32) -> u32,
    ) -> [Tile; TILES] {
        let cell = Middle::between([left.at, right.at], [left.down, right.down], sums).plus(more);
        let tile = |right: bool| if TILES == 1 { cell } else { cell.quarter(right, self.low) }.lanes(3, &lane);
        core::array::from_fn(|right| tile(right > 0))
    }
}

/// It bulges by a 32nd of each of these `sums` of second differences: by no more than rows of cells are made for.
#[inline(always)]
const fn even([across, down]: [i32; 2]) -> bool {
    const MOST: u32 = (BULGE as u32) << 4;
    (across as u32).wrapping_add(MOST) | (down as u32).wrapping_add(MOST) < 2 * MOST
}

/// The sums of second differences of two nodes, one above the other, of a number that is `one` of a layer's two.
#[inline(always)]
fn sums<T: Place>(above: &T, below: &T, one: impl Fn(Layer) -> i32) -> [i32; 2] {
    let ([a, b], [c, d]) = (above.bends().map(&one), below.bends().map(&one));
    [a.wrapping_add(c), b.wrapping_add(d)]
}

/// A number at two nodes, one above the other, and how it bends there.
#[derive(Clone, Copy)]
struct Edge {
    /// At the upper one, from where positions are counted.
    at: i32,
    /// How much more it is at the lower one.
    down: i32,
    /// The sums of its second differences, across and down.
    sums: [i32; 2],
}

impl Edge {
    /// Of a number that is `one` of a layer's two, counted from `start`; how it bends is still to be told.
    #[inline(always)]
    fn new<T: Place>(above: &T, below: &T, one: impl Fn(Layer) -> i32, start: i32) -> Self {
        let at = one(above.layer()).wrapping_sub(start);
        let down = one(below.layer()).wrapping_sub(start).wrapping_sub(at);
        Self { at, down, sums: [0; 2] }
    }

    /// The same with how it bends.
    #[inline(always)]
    fn bent<T: Place>(self, above: &T, below: &T, one: impl Fn(Layer) -> i32) -> Self {
        Self { sums: sums(above, below, one), ..self }
    }

    /// Whether both nodes are below `room`, and not below where positions are counted from.
    #[inline(always)]
    const fn inside(&self, room: u32) -> bool {
        (self.at as u32) < room && (self.at.wrapping_add(self.down) as u32) < room
    }

    /// The same, counted from so much further on.
    #[inline(always)]
    const fn from(self, more: i32) -> Self {
        Self { at: self.at.wrapping_sub(more), ..self }
    }

    /// The corners of the cell between this edge and the one to its `right`.
    #[inline(always)]
    const fn corners(&self, right: &Self) -> [i32; 4] {
        [self.at, right.at, self.at.wrapping_add(self.down), right.at.wrapping_add(right.down)]
    }

    /// The sums of second differences at these.
    #[inline(always)]
    const fn bends(&self, right: &Self) -> [i32; 2] {
        let ([a, b], [c, d]) = (self.sums, right.sums);
        [a.wrapping_add(c), b.wrapping_add(d)]
    }
}

/// Fills `slots` with the tiles of `cells` between nodes above and below, as long as each fits a window; returns of how many cells.
#[inline(always)]
fn lay<const TILES: usize, const USUAL: bool, T: Place>(
    slots: &mut [[Tile; TILES]],
    [above, below]: [&[T]; 2],
    cells: &Cells<'_>,
) -> usize {
    let window = cells.window_of::<USUAL>();
    let (u, v) = (|layer: Layer| layer.uv().u, |layer: Layer| layer.uv().v);
    let margin = cells.margin();
    let [wide, high] = [window.width_log2, window.rows_log2].map(|log2| cells.within(log2));
    let start_of = |row: i32| row.wrapping_shl(16).wrapping_add(margin);
    let mut edges = above.iter().zip(below);
    let Some((above, below)) = edges.next() else { return 0 };
    let mut start = start_of(cells.near.into());
    let mut head = Head::new(cells.label, cells.near).word();
    let mut left = Edge::new(above, below, u, margin).bent(above, below, u);
    let mut left_down = Edge::new(above, below, v, start).bent(above, below, v);
    if !left.inside(wide) {
        return 0;
    }
    if !left_down.inside(high) {
        // A window that holds nothing: the first cell finds its own.
        let more = start_of(1 << 14).wrapping_sub(start);
        (left_down, start) = (left_down.from(more), start.wrapping_add(more));
    }
    let mut done = 0usize;
    for (slots, (above, below)) in slots.iter_mut().zip(edges) {
        let (mut right_down, right) = (Edge::new(above, below, v, start), Edge::new(above, below, u, margin));
        if !right.inside(wide) {
            break;
        }
        if !right_down.inside(high) {
            let corners = left_down.corners(&right_down).map(|corner| corner.wrapping_add(start));
            let Some(row) = cells.window(corners) else { break };
            let more = start_of(row).wrapping_sub(start);
            (left_down, right_down, start) = (left_down.from(more), right_down.from(more), start.wrapping_add(more));
            head = Head::new(cells.label, row as u16).word();
        }
        // Told last: before, registers hold where they are.
        let (right, right_down) = (right.bent(above, below, u), right_down.bent(above, below, v));
        let (bends, falls) = (left.bends(&right), left_down.bends(&right_down));
        if !(even(bends) && even(falls)) {
            break;
        }
        let across = cells.tiles::<TILES>(left, right, bends, margin, |x, log2| window.lane::<false>(x, log2));
        let down = cells.tiles::<TILES>(left_down, right_down, falls, margin, |x, log2| window.lane::<true>(x, log2));
        for (slot, (across, down)) in slots.iter_mut().zip(across.iter().zip(down)) {
            *slot = down.plus(across).counted_from_first(3).of(Head::of(head));
        }
        (left, left_down) = (right, right_down);
        done = done.wrapping_add(1);
    }
    done
}

/// How far a strip is planned.
#[derive(Clone, Copy, Debug)]
struct Across<'s, 'a, 'm> {
    site: &'s Site<'s, 'a, 'm>,
    room: Option<Room>,
    /// How far the strip is from its cells' upper edge, pixels.
    down: u32,
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
        // As many blocks as a cell has are a power of two.
        [(self.block & self.blocks.wrapping_sub(1)).wrapping_shl(self.log2), self.down]
    }

    /// Coverage tests of a row of the next block, where so many of its sheets are looked at: the last is not tested.
    fn tests(&self, sheets: u32) -> u32 {
        let pixels = self.width.saturating_sub(self.left).min(1 << self.log2);
        pixels.wrapping_mul(sheets.saturating_sub(1))
    }

    /// On by so many blocks.
    fn step(&mut self, blocks: u32) {
        self.block = self.block.wrapping_add(blocks);
        self.left = self.block.wrapping_shl(self.log2);
    }
}
