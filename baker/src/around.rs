//! Around a cell: how far its pixels are from where a sheet ends or begins, along their rows and columns.
//! Labels come from the G-buffer; distances go to `fields`.

use crate::gbuffer::GBuffer;
use crate::sheets::KeyGrid;

/// The place of a pixel that shows none of the labels.
pub(crate) const NONE: u8 = u8::MAX;

/// Steps to the nearest pixel beyond an outline, on the left, right, up and down; [`distance`] makes distances of them.
pub(crate) type Steps = [u8; 4];

/// Lines that are walked along at a time.
const ABREAST: usize = 8;

/// What the pixels of a cell and those next to it on its rows and columns show in a frame: places in a list of labels, or [`NONE`].
pub(crate) struct Around {
    /// Its rows, from left to right.
    across: Lines,
    /// Its columns, downwards.
    down: Lines,
}

/// The rows through a cell, or the columns, abreast: what the first pixels of all of them show, then the second ones, and so on. A few that show nothing
/// make their number a multiple of [`ABREAST`].
struct Lines {
    shown: Vec<[u8; ABREAST]>,
    /// So many times [`ABREAST`] lines there are.
    packs: usize,
    /// The first of their pixels that is the cell's.
    first: usize,
    /// How many are.
    own: usize,
}

impl Lines {
    /// Lines of the `own` pixels of a cell and those at most `reach` away, which end at the screen's `end`: `lines` of them, which show nothing so far.
    fn new(own: &std::ops::Range<usize>, reach: usize, end: usize, lines: usize) -> Self {
        let start = own.start.saturating_sub(reach);
        let (length, packs) = ((own.end + reach).min(end) - start, lines.div_ceil(ABREAST));
        Self { shown: vec![[NONE; ABREAST]; length * packs], packs, first: own.start - start, own: own.len() }
    }

    fn length(&self) -> usize {
        self.shown.len() / self.packs
    }

    /// Where the pixel of a line is.
    fn place(&self, line: usize, pixel: usize) -> [usize; 2] {
        [pixel * self.packs + line / ABREAST, line % ABREAST]
    }

    /// Goes along the lines, or back, and writes how many steps back the sheet ends, where it shows, or begins: for the cell's pixels, as [`Lines::place`]
    /// has them without what comes before.
    fn sweep(&self, sheet: u8, back: bool) -> Vec<[u8; ABREAST]> {
        let (packs, from) = (self.packs, if back { self.length() - self.first - self.own } else { self.first });
        let mut out = vec![[NONE; ABREAST]; self.own * packs];
        for pack in 0..packs {
            // Steps from the last pixels that show the sheet, and from the last ones that show neither it nor what hides it.
            let [mut own, mut other] = [[NONE; ABREAST]; 2];
            for step in 0..from + self.own {
                let pixel = if back { self.length() - 1 - step } else { step };
                let shown = self.shown[pixel * packs + pack];
                let mut steps = [0; ABREAST];
                for line in 0..ABREAST {
                    let [since_own, since_other] = [own[line].saturating_add(1), other[line].saturating_add(1)];
                    let inside = shown[line] == sheet;
                    steps[line] = if inside { since_other } else { since_own };
                    own[line] = if inside { 0 } else { since_own };
                    other[line] = if shown[line] > sheet { 0 } else { since_other };
                }
                if step >= from {
                    out[(pixel - self.first) * packs + pack] = steps;
                }
            }
        }
        out
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
        let mut across = Lines::new(&columns, reach, width, rows.len());
        let mut down = Lines::new(&rows, reach, height, columns.len());
        let (left, top) = (columns.start - across.first, rows.start - down.first);
        for y in top..top + down.length() {
            // Of the rows above and below, what the cell's columns go through.
            let (x, length) = if rows.contains(&y) { (left, across.length()) } else { (columns.start, columns.len()) };
            let at = (frame as usize * height + y) * width + x;
            for (x, &label) in (x..).zip(&gbuffer.label[at..at + length]) {
                let shown = places.get(usize::from(label)).copied().unwrap_or(NONE);
                if rows.contains(&y) {
                    let [place, line] = across.place(y - rows.start, x - left);
                    across.shown[place][line] = shown;
                }
                if columns.contains(&x) {
                    let [place, line] = down.place(x - columns.start, y - top);
                    down.shown[place][line] = shown;
                }
            }
        }
        Self { across, down }
    }

    /// Column and row of every pixel of the cell, row by row.
    fn pixels(&self) -> impl Iterator<Item = [usize; 2]> {
        let [columns, rows] = [self.across.own, self.down.own];
        (0..rows).flat_map(move |row| (0..columns).map(move |column| [column, row]))
    }

    /// What the cell's pixels show, row by row.
    pub fn shown(&self) -> impl Iterator<Item = u8> {
        self.pixels().map(|[column, row]| {
            let [place, line] = self.down.place(column, self.down.first + row);
            self.down.shown[place][line]
        })
    }

    /// For every pixel of the cell, row by row, the steps after which the sheet at a place in the list ends, where it shows, or begins. Sheets before it
    /// hide it: behind them it may go on.
    pub fn steps(&self, sheet: u8) -> impl Iterator<Item = Steps> {
        let across = [false, true].map(|back| self.across.sweep(sheet, back));
        let down = [false, true].map(|back| self.down.sweep(sheet, back));
        self.pixels().map(move |[column, row]| {
            let ([x, line_x], [y, line_y]) = (self.across.place(row, column), self.down.place(column, row));
            [across[0][x][line_x], across[1][x][line_x], down[0][y][line_y], down[1][y][line_y]]
        })
    }
}

/// How far an outline is that a pixel beyond it is so many steps from, pixels: it runs between two pixels' centres. `None`: out of reach.
pub(crate) fn distance(steps: u8, reach: usize) -> Option<f32> {
    (usize::from(steps) <= reach).then(|| f32::from(steps) - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same by looking at every pixel on the way.
    fn looked(gbuffer: &GBuffer, list: &[u8], reach: usize, sheet: usize, [x, y]: [usize; 2]) -> Steps {
        let place = |x: usize, y: usize| {
            let label = gbuffer.label[y * gbuffer.width as usize + x];
            list.iter().position(|&own| u16::from(own) == label).unwrap_or(usize::MAX)
        };
        let inside = place(x, y) == sheet;
        let ends = |at: usize| if inside { at > sheet } else { at == sheet };
        let walk = |on_the_way: Vec<usize>| {
            let found = on_the_way.into_iter().position(ends).map_or(usize::MAX, |at| at + 1);
            if found <= reach { found as u8 } else { NONE }
        };
        [
            walk((0..x).rev().map(|x| place(x, y)).collect()),
            walk((x + 1..gbuffer.width as usize).map(|x| place(x, y)).collect()),
            walk((0..y).rev().map(|y| place(x, y)).collect()),
            walk((y + 1..gbuffer.height as usize).map(|y| place(x, y)).collect()),
        ]
    }

    #[test]
    fn steps_lead_to_the_nearest_pixel_beyond_an_outline() {
        // Cells of 4, 8 and 16 pixels, some cut off at the screen's edge; labels that are of no list among them.
        let (width, height) = (52, 44);
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u16 % 7
        };
        let (mut label, mut labels) = (0, Vec::new());
        for _ in 0..width * height {
            label = if random() < 4 { label } else { [3, 7, 250, 9, 300][usize::from(random().min(4))] };
            labels.push(label);
        }
        let gbuffer = GBuffer { width, height, frames: 1, uv: vec![[0.0; 2]; labels.len()].into(), label: labels };
        let (list, mut found) = ([7, 3, 250], [0; 2]);
        for log2 in [2, 3, 4] {
            let grid = KeyGrid::new(&gbuffer, log2, 1, false, [0; 2]);
            for cell in 0..grid.grid.cells() {
                let reach = 3 << log2 >> 1;
                let around = Around::new(&gbuffer, &grid, &list, reach, 0, cell);
                let [columns, rows] = grid.pixels(cell);
                for sheet in 0..list.len() {
                    let pixels = rows.clone().flat_map(|y| columns.clone().map(move |x| [x, y]));
                    for ((at, steps), shown) in pixels.zip(around.steps(sheet as u8)).zip(around.shown()) {
                        let within = steps.map(|steps| if distance(steps, reach).is_some() { steps } else { NONE });
                        assert_eq!(within, looked(&gbuffer, &list, reach, sheet, at), "{at:?}, sheet {sheet}");
                        let label = gbuffer.label[at[1] * width as usize + at[0]];
                        assert_eq!(list.iter().position(|&own| u16::from(own) == label), (shown != NONE).then_some(usize::from(shown)));
                        found[usize::from(within.contains(&NONE))] += 1;
                    }
                }
            }
        }
        assert!(found.into_iter().all(|pixels| pixels > 1000), "near and far outlines belong to the test: {found:?}");
    }
}
