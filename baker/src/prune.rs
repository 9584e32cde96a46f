//! Pruning: sheets that take more than what they show is worth are left out of their cells.
//! Lists come from `sheets` and stay there, shorter; what pixels would show instead comes from the source image.

use crate::atlas::SourceImage;
use crate::gbuffer::GBuffer;
use crate::metrics::mean_squared_error;
use crate::sheets::{KeyGrid, Sheets};
use crate::spare::DOUBLE;
use rayon::prelude::*;

/// What a layer has to save: this times its share of all error. As sparing counts it, twice the bytes of keys have to bring [`DOUBLE`] dB, which are
/// `DOUBLE` / 10 log2(10) halvings of the error: of an error E in L layers a layer has to save `DOUBLE` / 10 log2(10) E / L.
const SHARE: f64 = DOUBLE / 10.0 * core::f64::consts::LOG2_10;
/// What a sheet takes in its cell's list, in layers.
const LISTED: f32 = 0.25;
/// What a layer of the backdrop takes, in others: its positions are not coded.
const BACKDROP: f32 = 0.25;
/// Squared error of a pixel where nothing says what it would show instead.
const LOST: f32 = 5000.0;
/// Squared error of a pixel from which on another colour is seen for another: eight levels.
const SEEN: f32 = 64.0;
/// The least squared error of a pixel that is seen to be another: a sheet ends at its cell's border where it is left out, and a straight cut through an
/// outline is seen however little the colours differ, as those of a dark thing before a dark background do.
const CUT: f32 = 1500.0;
/// The least squared error of a pixel where several sheets are left: their outlines are fitted to where these are seen, and do not tell which shows here.
const UNTOLD: f32 = 500.0;
/// Rounds in which the price of a layer rises to the whole of it: what is worth least goes first.
const ROUNDS: u16 = 8;

/// Leaves those of `sheets` out that save less error than their layers' share of what there is anyway: `error`, the mean squared error of pixels, mean
/// of the components 0..=255. Neighbouring cells' sheets of one label share layers: each counts its part.
pub fn prune(sheets: &mut Sheets, gbuffer: &GBuffer, image: &SourceImage, grid: &KeyGrid, error: f64) {
    let mut users = Users::new(grid, sheets);
    let price = (SHARE * error * gbuffer.label.len() as f64 / users.layers().max(1.0)) as f32;
    let mut losses: Vec<Vec<Loss>> = vec![Vec::new(); sheets.lists.len()];
    for round in 1..=ROUNDS {
        let torn =
            sheets.lists.par_iter().zip(&mut losses).enumerate().filter(|(_, (list, losses))| list.len() > 1 && list.len() != losses.len());
        torn.for_each(|(index, (list, losses))| *losses = self::losses(gbuffer, image, grid, index, list));
        let price = price * f32::from(round) / f32::from(ROUNDS);
        for (index, (list, losses)) in sheets.lists.iter_mut().zip(&mut losses).enumerate() {
            // The last one is what most pixels show.
            let Some(others) = list.len().checked_sub(1) else { continue };
            let saved = |at: usize| price * users.layers_of(grid, index, list[at]) - losses[at].error;
            let Some(at) = (0..others).max_by(|&a, &b| saved(a).total_cmp(&saved(b))).filter(|&at| saved(at) > 0.0) else { continue };
            users.leave(grid, index, list.remove(at));
            sheets.dropped += u64::from(losses[at].pixels);
        }
    }
}

/// What leaving a sheet out loses.
#[derive(Clone, Copy, Default)]
struct Loss {
    /// Pixels of all frames that show it.
    pixels: u32,
    /// Sum of their squared errors without it.
    error: f32,
}

/// The pixels of a cell in one frame, row by row.
struct Block {
    wide: usize,
    high: usize,
    /// Places in the cell's list; [`NONE`] for what it does not list.
    sheet: Vec<usize>,
    uv: Vec<[f32; 2]>,
    /// What would be seen instead: how far away that is, pixels, and the positions there and one pixel further on.
    instead: Vec<Option<(u16, [[f32; 2]; 2])>>,
}

const NONE: usize = usize::MAX;

/// Pixels of one sheet side by side: where the last one is, its position and that of the one before it, which is its own where that is of none.
#[derive(Clone, Copy)]
struct Run {
    sheet: usize,
    end: usize,
    uv: [[f32; 2]; 2],
}

impl Block {
    /// Walks `count` pixels from `start` on, by `step`, and notes for each the last one of another sheet where none is nearer.
    fn sweep(&mut self, start: usize, step: isize, count: usize) {
        let (mut run, mut last): (Option<Run>, Option<Run>) = (None, None);
        for at in 0..count {
            let here = start.wrapping_add_signed(step * at as isize);
            let (sheet, uv) = (self.sheet[here], self.uv[here]);
            if sheet == NONE {
                continue;
            }
            last = run.filter(|run| run.sheet != sheet).or(last);
            let before = run.filter(|run| run.sheet == sheet && run.end + 1 == at).map_or(uv, |run| run.uv[0]);
            run = Some(Run { sheet, end: at, uv: [uv, before] });
            if let Some(last) = last
                && let far = (at - last.end) as u16
                && self.instead[here].is_none_or(|(nearest, _)| far < nearest)
            {
                self.instead[here] = Some((far, last.uv));
            }
        }
    }

    /// Walks all rows and columns, both ways.
    fn sweeps(&mut self) {
        self.instead.fill(None);
        let (wide, high) = (self.wide, self.high);
        for row in 0..high {
            self.sweep(row * wide, 1, wide);
            self.sweep(row * wide + wide - 1, -1, wide);
        }
        for column in 0..wide {
            self.sweep(column, wide as isize, high);
            self.sweep((high - 1) * wide + column, -(wide as isize), high);
        }
    }
}

/// What leaving each label of `list` out of cell and interval `index` loses: its pixels show the nearest other sheet instead, as that goes on.
fn losses(gbuffer: &GBuffer, image: &SourceImage, grid: &KeyGrid, index: usize, list: &[u8]) -> Vec<Loss> {
    let (interval, cell) = (index / grid.grid.cells(), index % grid.grid.cells());
    let [wide, high] = grid.pixels(cell).map(|range| range.len());
    let mut block = Block { wide, high, sheet: vec![NONE; wide * high], uv: vec![[0.0; 2]; wide * high], instead: vec![None; wide * high] };
    let mut losses = vec![Loss::default(); list.len()];
    for frame in grid.frames_of(interval) {
        let mut place = 0;
        grid.each_pixel(frame, cell, |pixel, _| {
            block.sheet[place] = list.iter().position(|&label| u16::from(label) == gbuffer.label[pixel]).unwrap_or(NONE);
            block.uv[place] = gbuffer.uv[pixel];
            place += 1;
        });
        block.sweeps();
        for ((&sheet, &uv), &instead) in block.sheet.iter().zip(&block.uv).zip(&block.instead) {
            let Some(loss) = losses.get_mut(sheet) else { continue };
            loss.pixels += 1;
            loss.error += instead.map_or(LOST, |(far, [edge, further])| {
                let on = [0, 1].map(|k| edge[k] + (edge[k] - further[k]) * f32::from(far));
                let error = mean_squared_error(&image.colour_at(uv), &image.colour_at(on)) as f32;
                let error = if error > SEEN { error.max(CUT) } else { error };
                match list.len() {
                    ..=2 => error,
                    _ if image.covered_at(on) => error.max(UNTOLD),
                    // Beyond its chart it shows only where nothing else is left to be seen.
                    _ => error.max(LOST),
                }
            });
        }
    }
    losses
}

/// What a layer of `label` takes, in layers: label 0 is the backdrop.
fn takes(label: u8) -> f32 {
    if label == 0 { BACKDROP } else { 1.0 }
}

/// The labels that every node carries at every key, and how many sheets ask for each.
struct Users(Vec<Vec<(u8, u32)>>);

impl Users {
    fn new(grid: &KeyGrid, sheets: &Sheets) -> Self {
        let mut users = Self(vec![Vec::new(); grid.keys.len() * grid.grid.nodes()]);
        for (index, list) in sheets.lists.iter().enumerate() {
            for at in grid.carriers(index) {
                for &label in list {
                    match users.0[at].iter_mut().find(|(known, _)| *known == label) {
                        Some((_, count)) => *count += 1,
                        None => users.0[at].push((label, 1)),
                    }
                }
            }
        }
        users
    }

    /// What all layers take.
    fn layers(&self) -> f64 {
        self.0.iter().flatten().map(|&(label, _)| f64::from(takes(label))).sum()
    }

    /// What the sheet of `label` in cell and interval `index` takes: its share of its layers, and its place in the list.
    fn layers_of(&self, grid: &KeyGrid, index: usize, label: u8) -> f32 {
        let share = |at: usize| self.0[at].iter().find(|(known, _)| *known == label).map_or(0.0, |&(_, count)| 1.0 / count as f32);
        LISTED + takes(label) * grid.carriers(index).map(share).sum::<f32>()
    }

    /// The sheet of `label` in cell and interval `index` is left out.
    fn leave(&mut self, grid: &KeyGrid, index: usize, label: u8) {
        for at in grid.carriers(index) {
            self.0[at].iter_mut().filter(|(known, _)| *known == label).for_each(|(_, count)| *count -= 1);
            self.0[at].retain(|&(_, count)| count > 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::{Label, Outline};
    use cubist_core::format::{SPACE_LINEAR, TIME_LINEAR, TexelKind};

    /// A screen of four cells of 8 x 8 pixels, two frames: chart 1 everywhere but in a line along the top of the first cell, which shows chart 2.
    fn scene(line: u32) -> (GBuffer, KeyGrid) {
        let pixels = |of: fn(bool, [u32; 2]) -> [f32; 2]| {
            (0..2 * 256u32).map(move |i| (i % 16, i / 16 % 16)).map(move |(x, y)| of(y < line && x < 8, [x, y]))
        };
        let uv = pixels(|top, [x, y]| [x as f32 + if top { 20.5 } else { 0.5 }, y as f32 + 0.5]).collect::<Vec<_>>();
        let label = uv.iter().map(|&[u, _]| if u < 20.0 { 1 } else { 2 }).collect();
        let gbuffer = GBuffer { width: 16, height: 16, frames: 2, label, uv: uv.into() };
        let grid = KeyGrid::new(&gbuffer, 3, 8, false, [TIME_LINEAR, SPACE_LINEAR]);
        (gbuffer, grid)
    }

    /// A source image of two charts beside each other, of a grey each.
    fn image(greys: [u8; 2]) -> SourceImage {
        let label = |rect| Label { rect, masked: false, fixed: None };
        SourceImage {
            width: 64,
            height: 16,
            kind: TexelKind::Indexed8,
            texels: (0..64 * 16).map(|at| u16::from(at % 64 >= 20)).collect(),
            palette: greys.map(|grey| [grey; 3]).to_vec(),
            covered: vec![true; 64 * 16].into(),
            outline: Outline { finer: 0, bits: vec![true; 64 * 16].into() },
            labels: vec![label([60, 0, 64, 4]), label([0, 0, 16, 16]), label([20, 0, 28, 8])],
        }
    }

    fn pruned((gbuffer, grid): &(GBuffer, KeyGrid), image: &SourceImage, error: f64) -> Sheets {
        let mut sheets = crate::sheets::find(gbuffer, grid, 1);
        prune(&mut sheets, gbuffer, image, grid, error);
        sheets
    }

    fn left(line: u32, greys: [u8; 2], error: f64) -> (Vec<u8>, u64) {
        let sheets = pruned(&scene(line), &image(greys), error);
        (sheets.lists[0].clone(), sheets.dropped)
    }

    #[test]
    fn what_shows_little_is_left_out() {
        // At both keys 9 nodes of chart 1 and 4 of chart 2: 26 layers. Chart 2 has 8 of them and its place in the list: 8.25. With an error of 6 a layer
        // is to save .515 * 6 * 512 / 26 = 60.8, the sheet 502. It shows in 16 pixels: 5 greys are 400, 6 are 576.
        assert_eq!(left(1, [100, 105], 6.0), (vec![1], 16));
        assert_eq!(left(1, [100, 106], 6.0), (vec![2, 1], 0));
        // Where pictures are better anyway it is missed.
        assert_eq!(left(1, [100, 105], 4.0), (vec![2, 1], 0));
        // Twice the pixels lose twice as much.
        assert_eq!(left(2, [100, 105], 6.0), (vec![2, 1], 0));
    }

    #[test]
    fn a_cut_outline_is_seen_however_dark() {
        // With an error of 100 the sheet is to save 8,367 in 16 pixels, which 23 greys do; but 9 are seen already, and 8 are not.
        for dark in [0, 100] {
            assert_eq!(left(1, [dark, dark + 8], 100.0), (vec![1], 16));
            assert_eq!(left(1, [dark, dark + 9], 100.0), (vec![2, 1], 0));
        }
        // Where pictures are far off it goes all the same: 16 pixels of 1,500 are 24,000, which an error of 287 asks for.
        assert_eq!(left(1, [100, 109], 290.0), (vec![1], 16));
    }

    #[test]
    fn where_others_are_left_the_right_one_may_not_show() {
        // A third chart along the bottom of the first cell, and all of one grey.
        let mut scene = scene(1);
        let gbuffer = &mut scene.0;
        for pixel in (0..2 * 256).filter(|pixel| pixel % 16 < 8 && pixel / 16 % 16 == 7) {
            gbuffer.label[pixel] = 3;
            std::sync::Arc::make_mut(&mut gbuffer.uv)[pixel] = [(pixel % 16) as f32 + 30.5, 0.5];
        }
        let mut image = image([100, 100]);
        image.labels.push(Label { rect: [30, 0, 38, 8], masked: false, fixed: None });
        let left = |error: f64| pruned(&scene, &image, error).lists[0].clone();
        // 34 layers, of which each line has 8: with an error of 120 a line is to save 7,659, and 16 pixels of 500 are 8,000.
        assert_eq!(left(120.0).len(), 3);
        // Where one goes, so does the other: what is left then is all there is to see.
        assert_eq!(left(150.0), [1]);
    }

    #[test]
    fn some_sheet_is_always_left() {
        assert_eq!(left(1, [0, 255], 1e9), (vec![1], 16));
        assert_eq!(left(8, [0, 255], 1e9), (vec![2], 0), "alone in its cell");
        // Half of the cell each: what is listed last stays.
        assert_eq!(left(4, [0, 255], 1e9).0.len(), 1);
    }

    #[test]
    fn what_goes_on_where_a_sheet_was_is_looked_up_there() {
        // Chart 1 is lighter along its top, as chart 2 is: without chart 2 it shows the same.
        let mut image = image([100, 255]);
        image.texels = image.texels.iter().enumerate().map(|(at, &texel)| if at < 20 { 1 } else { texel }).collect();
        assert_eq!(pruned(&scene(1), &image, 13.0).lists[0], [1]);
    }

    #[test]
    fn neighbours_share_their_layers() {
        let (gbuffer, grid) = scene(1);
        let sheets = crate::sheets::find(&gbuffer, &grid, 1);
        let mut users = Users::new(&grid, &sheets);
        assert!((users.layers() - 26.0).abs() < 1e-9);
        // Chart 1 is in all four cells: the corner in the middle is a quarter its own, two are half, one whole, at two keys.
        assert!((users.layers_of(&grid, 0, 1) - 2.0 * 2.25 - LISTED).abs() < 1e-6);
        assert!((users.layers_of(&grid, 0, 2) - 2.0 * 4.0 - LISTED).abs() < 1e-6);
        users.leave(&grid, 0, 1);
        assert!((users.layers() - 24.0).abs() < 1e-9, "two nodes have no other");
        assert!((users.layers_of(&grid, 3, 1) - 2.0 * (1.0 / 3.0 + 0.5 + 0.5 + 1.0) - LISTED).abs() < 1e-6);
    }
}
