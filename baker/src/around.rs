//! Around a cell: how far its pixels are from where a sheet ends or begins, along their rows and columns.
//! Labels come from the G-buffer; distances go to `fields`.

use crate::gbuffer::GBuffer;
use crate::sheets::KeyGrid;

/// The place of a pixel that shows none of the labels.
pub(crate) const NONE: u8 = u8::MAX;

/// Steps to the nearest pixel beyond an outline, on the left, right, up and down; [`Around::distance`] makes distances of them.
pub(crate) type Steps = [u8; 4];

/// What the pixels of a cell and those next to it on its rows and columns show in a frame: places in a list of labels, or [`NONE`].
pub(crate) struct Around {
    across: Lines,
    down: Lines,
    reach: usize,
}

/// The rows through a cell, or the columns.
struct Lines {
    shown: Vec<u8>,
    /// Pixels of each.
    length: usize,
    /// The first of them that is the cell's.
    first: usize,
    /// How many are.
    own: usize,
}

impl Lines {
    fn new(own: &std::ops::Range<usize>, reach: usize, end: usize) -> Self {
        let start = own.start.saturating_sub(reach);
        Self { shown: Vec::new(), length: (own.end + reach).min(end) - start, first: own.start - start, own: own.len() }
    }
}

impl Around {
    /// What the pixels of `cell` and those at most `reach` away show of the labels in `list`, of which there are less than [`NONE`].
    pub fn new(gbuffer: &GBuffer, grid: &KeyGrid, list: &[u8], reach: usize, frame: u32, cell: usize) -> Self {
        let [width, height] = grid.size;
        let [columns, rows] = grid.pixels(cell);
        let mut places = [NONE; 256];
        for (&label, place) in list.iter().zip(0..NONE) {
            places[usize::from(label)] = place;
        }
        // A run of pixels on a row.
        let run = |x: usize, y: usize, length: usize| {
            let pixel = (frame as usize * height + y) * width + x;
            gbuffer.label[pixel..pixel + length].iter().map(|&label| places.get(usize::from(label)).copied().unwrap_or(NONE))
        };
        let [mut across, mut down] = [Lines::new(&columns, reach, width), Lines::new(&rows, reach, height)];
        across.shown = rows.clone().flat_map(|y| run(columns.start - across.first, y, across.length)).collect();
        down.shown = vec![NONE; columns.len() * down.length];
        for y in 0..down.length {
            for (column, shown) in run(columns.start, rows.start - down.first + y, columns.len()).enumerate() {
                down.shown[column * down.length + y] = shown;
            }
        }
        Self { across, down, reach }
    }

    /// What the cell's pixels show, row by row.
    pub fn shown(&self) -> impl Iterator<Item = u8> {
        let Lines { shown, length, first, own } = &self.across;
        shown.chunks_exact(*length).flat_map(move |line| line[*first..first + own].iter().copied())
    }

    /// For every pixel of the cell, row by row, the steps after which the sheet at a place in the list ends, where it shows, or begins. Sheets before it
    /// hide it: behind them it may go on.
    pub fn steps(&self, sheet: u8) -> Vec<Steps> {
        let [width, height] = [self.across.own, self.down.own];
        let mut steps = vec![[NONE; 4]; width * height];
        for (row, line) in self.across.shown.chunks_exact(self.across.length).enumerate() {
            let steps = &mut steps[row * width..(row + 1) * width];
            let [before, own] = [self.across.first, self.across.first + width];
            sweep(line[..own].iter(), before, sheet, steps.iter_mut().map(|steps| &mut steps[0]));
            sweep(line[before..].iter().rev(), line.len() - own, sheet, steps.iter_mut().rev().map(|steps| &mut steps[1]));
        }
        for (column, line) in self.down.shown.chunks_exact(self.down.length).enumerate() {
            let [before, own] = [self.down.first, self.down.first + height];
            sweep(line[..own].iter(), before, sheet, steps.chunks_exact_mut(width).map(|row| &mut row[column][2]));
            let back = steps.chunks_exact_mut(width).rev().map(|row| &mut row[column][3]);
            sweep(line[before..].iter().rev(), line.len() - own, sheet, back);
        }
        steps
    }

    /// How far an outline is that a pixel beyond it is so many steps from, pixels: it runs between two pixels' centres. `None`: out of reach.
    pub fn distance(&self, steps: u8) -> Option<f32> {
        (usize::from(steps) <= self.reach).then(|| f32::from(steps) - 0.5)
    }
}

/// Goes along what a line of pixels shows and writes how many steps back the sheet ends, where it shows, or begins: for all pixels but the first few.
fn sweep<'a>(mut line: impl Iterator<Item = &'a u8>, first: usize, sheet: u8, out: impl Iterator<Item = &'a mut u8>) {
    // Steps from the last pixel that shows the sheet, and from the last one that shows neither it nor what hides it.
    let [mut own, mut other] = [NONE; 2];
    let mut step = |shown: u8| {
        let steps = [own.saturating_add(1), other.saturating_add(1)];
        own = if shown == sheet { 0 } else { steps[0] };
        other = if shown > sheet { 0 } else { steps[1] };
        if shown == sheet { steps[1] } else { steps[0] }
    };
    for &shown in line.by_ref().take(first) {
        step(shown);
    }
    for (&shown, out) in line.zip(out) {
        *out = step(shown);
    }
}
