//! Sheets: which labels each cell of the key-ray grid shows, interval by interval.
//! From the G-buffer; `fit` gives every sheet's corners their positions, `order` sorts them front to back.

use crate::gbuffer::GBuffer;
use cubist_core::format::{MAX_SHEETS, TIME_CUBIC, TIME_LINEAR};
use cubist_core::grid::Grid;
use cubist_core::timeline::weights;
use rayon::prelude::*;

/// The key-ray grid in space and time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyGrid {
    /// The grid over the screen.
    pub grid: Grid,
    /// Screen width and height, pixels.
    pub size: [usize; 2],
    /// The frames at which keys stand, ascending, the first 0.
    pub keys: Vec<u32>,
    /// Frames of the path.
    pub frames: u32,
    /// The last interval leads back to the first key.
    pub looping: bool,
    /// How layers are interpolated between keys: one of the format's `TIME_` numbers.
    pub time: u8,
    /// How they are interpolated between nodes: one of the format's `SPACE_` numbers.
    pub space: u8,
}

impl KeyGrid {
    /// Cells of 2^`cell_log2` pixels, keys every `interval` frames, closer on loops that are no longer than that; without a loop the last key stands at
    /// the last frame.
    #[must_use]
    pub fn new(gbuffer: &GBuffer, cell_log2: u8, interval: u32, looping: bool, [time, space]: [u8; 2]) -> Self {
        let last = gbuffer.frames.saturating_sub(1);
        // With a single key a loop would stand still.
        let interval = if looping && interval >= gbuffer.frames { gbuffer.frames.div_ceil(3) } else { interval };
        let mut keys: Vec<u32> = (0..gbuffer.frames).step_by(interval.max(1) as usize).collect();
        if !looping && keys.last() != Some(&last) {
            // A last interval of a frame or two costs a whole key: the one before it is made longer instead.
            if keys.len() > 1 && last - keys[keys.len() - 1] <= interval / 4 {
                keys.pop();
            }
            keys.push(last);
        }
        let size = [gbuffer.width as usize, gbuffer.height as usize];
        let grid = Grid::new(gbuffer.width as u16, gbuffer.height as u16, cell_log2);
        Self { grid, size, keys, frames: gbuffer.frames, looping, time, space }
    }

    /// The same grid with keys at other frames: ascending, the first 0, without a loop the last one the last frame.
    #[must_use]
    pub fn with_keys(&self, keys: Vec<u32>) -> Self {
        Self { keys, ..self.clone() }
    }

    /// Key intervals: between each two keys, on a looping path also back to the first; a single key has one.
    #[must_use]
    pub fn intervals(&self) -> usize {
        if self.looping { self.keys.len() } else { (self.keys.len() - 1).max(1) }
    }

    /// Frames from key to key, on the mean, rounded up.
    #[must_use]
    pub fn spacing(&self) -> u32 {
        self.end(self.intervals() - 1).div_ceil(self.intervals() as u32).max(1)
    }

    /// The frame where interval `interval` ends (that of its second key).
    #[must_use]
    pub fn end(&self, interval: usize) -> u32 {
        self.keys.get(interval + 1).copied().unwrap_or(if self.looping { self.frames } else { self.frames - 1 })
    }

    /// The frames that interval `interval` shows: the last of a path that does not loop shows its second key too.
    #[must_use]
    pub fn frames_of(&self, interval: usize) -> std::ops::Range<u32> {
        let last = !self.looping && interval + 1 == self.intervals();
        self.keys[interval]..if last { self.frames } else { self.end(interval) }
    }

    /// Frames of interval `interval`, counted around a loop; 0 where there is none.
    #[must_use]
    pub fn length(&self, interval: isize) -> u32 {
        let count = self.intervals() as isize;
        let index = if self.looping { interval.rem_euclid(count) } else { interval };
        if (0..count).contains(&index) { self.end(index as usize) - self.keys[index as usize] } else { 0 }
    }

    /// The frame `by` frames from `frame`, around a loop; `None` where the path has none.
    #[must_use]
    pub fn beside(&self, frame: u32, by: i64) -> Option<usize> {
        let (at, frames) = (i64::from(frame) + by, i64::from(self.frames));
        let at = if self.looping { at.rem_euclid(frames) } else { at };
        usize::try_from(at).ok().filter(|_| at < frames)
    }

    /// Pixels that a label needs in a cell of interval `interval` to count, where it needs `least` in one of mean length. Intervals at most a quarter as long
    /// ask for their share: else a surface that shows all along would be missing there.
    #[must_use]
    pub fn least(&self, interval: usize, least: u32) -> u32 {
        let (length, mean) = (self.frames_of(interval).len() as u32, self.spacing());
        if 4 * length <= mean { ((u64::from(least) * u64::from(length) / u64::from(mean)) as u32).max(1) } else { least }
    }

    /// The key at the end of interval `interval`.
    #[must_use]
    pub fn second_key(&self, interval: usize) -> usize {
        if self.keys.len() == 1 { 0 } else { (interval + 1) % self.keys.len() }
    }

    /// The keys around interval `interval`: before it, its two ends, after it; those that playback in `time` uses.
    #[must_use]
    pub fn keys_around(&self, interval: usize, time: u8) -> [Option<usize>; 4] {
        let keys = self.keys.len() as isize;
        let at = |offset: isize| {
            let key = interval as isize + offset;
            if self.looping { Some(key.rem_euclid(keys) as usize) } else { (0..keys).contains(&key).then_some(key as usize) }
        };
        let outer = |offset| if time == TIME_CUBIC { at(offset) } else { None };
        [outer(-1), Some(interval), Some(self.second_key(interval)), outer(2)]
    }

    /// The weights of the keys around `frame` of interval `interval`, by which of the outer two are missing, as the player has them.
    #[must_use]
    pub fn weights(&self, interval: usize, frame: u32, time: u8) -> [[f32; 4]; 4] {
        let at = interval as isize;
        let lengths = [self.length(at - 1), self.length(at), self.length(at + 1)];
        let one = cubist_core::fixed::ONE as f32;
        weights(time, lengths, frame - self.keys[interval]).map(|set| set.map(|weight| weight as f32 / one))
    }

    /// How fields go from key to key: straight, or held like positions.
    #[must_use]
    pub fn field_time(&self) -> u8 {
        self.time.min(TIME_LINEAR)
    }

    /// Columns and rows of pixels of a cell, cut off at the screen's edge.
    #[must_use]
    pub fn pixels(&self, cell: usize) -> [std::ops::Range<usize>; 2] {
        let size = 1 << self.grid.log2;
        let (column, row) = (cell % self.grid.columns, cell / self.grid.columns);
        [column * size..((column + 1) * size).min(self.size[0]), row * size..((row + 1) * size).min(self.size[1])]
    }

    /// The nodes at a cell's corners: top left, top right, bottom left, bottom right.
    #[must_use]
    pub fn corners(&self, cell: usize) -> [usize; 4] {
        let width = self.grid.node_columns();
        let node = cell / self.grid.columns * width + cell % self.grid.columns;
        [node, node + 1, node + width, node + width + 1]
    }

    /// The nodes around cell and interval `index` (the interval times the cells of the grid, plus the cell) at both of its keys: the key times the nodes
    /// of the grid, plus the node.
    pub(crate) fn carriers(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let (interval, cell) = (index / self.grid.cells(), index % self.grid.cells());
        let (corners, nodes) = (self.corners(cell), self.grid.nodes());
        [interval, self.second_key(interval)].into_iter().flat_map(move |key| corners.map(|node| key * nodes + node))
    }

    /// Calls `f` with the index into the G-buffer and the position in the cell (across and down, 0..1) of every pixel
    /// that a cell shows in `frame`.
    #[inline]
    pub fn each_pixel(&self, frame: u32, cell: usize, mut f: impl FnMut(usize, [f32; 2])) {
        let [columns, rows] = self.pixels(cell);
        let scale = 1.0 / (1u32 << self.grid.log2) as f32;
        for y in rows.clone() {
            let row = (frame as usize * self.size[1] + y) * self.size[0];
            for x in columns.clone() {
                f(row + x, [(x - columns.start) as f32 * scale, (y - rows.start) as f32 * scale]);
            }
        }
    }
}

/// Bilinear weights of a cell's corners at a position in it, 0..=1.
#[must_use]
pub fn bilinear([x, y]: [f32; 2]) -> [f32; 4] {
    [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y]
}

/// The sheets of every cell and interval, interval-major; labels, most seen last.
#[derive(Clone, Debug)]
pub struct Sheets {
    /// Labels of the cell `interval * cells + cell`, at least one each.
    pub lists: Vec<Vec<u8>>,
    /// The coverage tests of all but the last, two bits each, the first one's lowest.
    pub tests: Vec<u16>,
    /// Pixels whose sheet was left out, and those that `folds` had given up.
    pub dropped: u64,
}

/// Finds the sheets. A label seen in fewer than `least` pixels of a cell and interval is left out, unless it is all there is.
#[must_use]
pub fn find(gbuffer: &GBuffer, grid: &KeyGrid, least: u32) -> Sheets {
    let cells = grid.grid.cells();
    let (found, dropped): (Vec<Vec<(u8, u32)>>, Vec<u64>) = (0..grid.intervals() * cells)
        .into_par_iter()
        .map(|index| {
            let mut counts: Vec<(u8, u32)> = Vec::new();
            // Pixels that `folds` gave up have no label.
            let mut without = 0u64;
            for frame in grid.frames_of(index / cells) {
                grid.each_pixel(frame, index % cells, |pixel, _| {
                    let Ok(label) = u8::try_from(gbuffer.label[pixel]) else {
                        without += 1;
                        return;
                    };
                    match counts.iter_mut().find(|(l, _)| *l == label) {
                        Some((_, count)) => *count += 1,
                        None => counts.push((label, 1)),
                    }
                });
            }
            // Most seen first, ties by label: what is cut off is the least.
            counts.sort_by_key(|&(label, count)| (std::cmp::Reverse(count), label));
            let least = grid.least(index / cells, least);
            let kept = counts.iter().take(MAX_SHEETS).take_while(|&&(_, count)| count >= least).count().max(1);
            let dropped: u64 = counts[kept..].iter().map(|&(_, count)| u64::from(count)).sum();
            counts.truncate(kept);
            counts.reverse();
            (counts, dropped + without)
        })
        .unzip();
    let dropped = dropped.into_iter().sum();
    let tests = vec![0; found.len()];
    Sheets { lists: found.into_iter().map(|list| list.into_iter().map(|(label, _)| label).collect()).collect(), tests, dropped }
}

impl Sheets {
    /// The coverage test of the sheet at a place in the list of a cell and interval; `None` for the last, which passes without: there are no bits for
    /// the ninth.
    #[must_use]
    pub fn test(&self, index: usize, sheet: usize) -> Option<u16> {
        (sheet + 1 < self.lists[index].len()).then(|| self.tests[index] >> (2 * sheet) & 3)
    }
}

/// The layers that nodes carry: for every key and node the labels of the cells around it, in the intervals that end
/// and start at the key; ascending, as the player derives them.
#[derive(Clone, Debug)]
pub struct Layers {
    /// Where the layers of `key * nodes + node` start in `label`; one entry more.
    pub start: Vec<u32>,
    /// Labels.
    pub label: Vec<u8>,
}

impl Layers {
    /// The layers that `sheets` ask for.
    #[must_use]
    pub fn of(grid: &KeyGrid, sheets: &Sheets) -> Self {
        let mut sets: Vec<Vec<u8>> = vec![Vec::new(); grid.keys.len() * grid.grid.nodes()];
        for (index, list) in sheets.lists.iter().enumerate() {
            for at in grid.carriers(index) {
                let set = &mut sets[at];
                for &label in list {
                    if let Err(at) = set.binary_search(&label) {
                        set.insert(at, label);
                    }
                }
            }
        }
        let mut layers = Self { start: vec![0], label: Vec::new() };
        for set in sets {
            layers.label.extend(set);
            layers.start.push(layers.label.len() as u32);
        }
        layers
    }

    /// How many layers each of `labels` labels has.
    #[must_use]
    pub fn by_label(&self, labels: usize) -> Vec<usize> {
        let mut counts = vec![0; labels];
        for &label in &self.label {
            counts[usize::from(label)] += 1;
        }
        counts
    }

    /// The index of the layer of `label` at `key_node`: the key times the nodes of the grid, plus the node.
    #[must_use]
    pub fn find(&self, key_node: usize, label: u8) -> Option<usize> {
        let (from, to) = (self.start[key_node] as usize, self.start[key_node + 1] as usize);
        self.label[from..to].binary_search(&label).ok().map(|at| from + at)
    }
}

/// One node of a sheet over time: its layers in the keys before the interval, at its two ends and after it.
#[derive(Clone, Copy, Debug)]
pub struct Chain {
    /// Indices of layers; the inner two are always there.
    pub layer: [Option<usize>; 4],
}

impl Chain {
    /// Which of the sets of weights that [`KeyGrid::weights`] gives is the chain's.
    #[must_use]
    pub fn set(&self) -> usize {
        usize::from(self.layer[0].is_none()) | usize::from(self.layer[3].is_none()) << 1
    }

    /// The weights of the chain's layers, out of those that [`KeyGrid::weights`] gives.
    #[must_use]
    pub fn weights(&self, set: &[[f32; 4]; 4]) -> [f32; 4] {
        set[self.set()]
    }

    /// The chain's value, given its layers' `values` and the weights.
    #[must_use]
    pub fn value(&self, values: &[[f32; 2]], set: &[[f32; 4]; 4]) -> [f32; 2] {
        let mut sum = [0.0; 2];
        for (layer, weight) in self.layer.iter().zip(self.weights(set)) {
            if let Some(layer) = layer {
                sum[0] += weight * values[*layer][0];
                sum[1] += weight * values[*layer][1];
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cubist_core::format::SPACE_CUBIC;

    #[test]
    fn a_short_loop_has_keys_to_move_between() {
        let keys = |frames: u32, looping: bool| {
            let gbuffer = GBuffer { width: 8, height: 8, frames, label: Vec::new(), uv: Vec::new().into() };
            KeyGrid::new(&gbuffer, 3, 8, looping, [TIME_CUBIC, SPACE_CUBIC]).keys
        };
        assert_eq!([1, 2, 3, 8, 9].map(|frames| keys(frames, true)), [vec![0], vec![0, 1], vec![0, 1, 2], vec![0, 3, 6], vec![0, 8]]);
        assert_eq!(keys(8, false), [0, 7]);
    }

    #[test]
    fn nodes_carry_the_labels_of_all_cells_around() {
        // Two by two cells of 8 pixels, two intervals of two frames: in each of the eight nine labels that no other has, of 4 pixels or more.
        let (width, height, frames) = (16, 16, 5);
        let label = |at: u32| {
            let (frame, x, y) = (at / (width * height), at % width, at / width % height);
            let cell = x / 8 + y / 8 * 2 + if frame < 2 { 0 } else { 4 };
            // Each label more often than the one before it: the first of a cell is the least seen.
            let within = x % 8 + y % 8 * 8;
            (1 + cell * 9 + (0..9).filter(|step| within >= 2 + step * (step + 1) / 2).count().min(8) as u32) as u16
        };
        let labels: Vec<u16> = (0..width * height * frames).map(label).collect();
        let gbuffer = GBuffer { width, height, frames, uv: vec![[0.0; 2]; labels.len()].into(), label: labels };
        let grid = KeyGrid::new(&gbuffer, 3, 2, false, [TIME_CUBIC, SPACE_CUBIC]);
        let sheets = find(&gbuffer, &grid, 1);
        let layers = Layers::of(&grid, &sheets);
        let most = layers.start.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert_eq!(most, Some(72), "nine of each of the eight, at the node that all of them surround");
        assert_eq!(sheets.dropped, 0);
        // What is most seen of a cell is the last of its list.
        for (cell, list) in sheets.lists.iter().enumerate() {
            assert_eq!((list.len(), list.last()), (9, Some(&(9 * cell as u8 + 9))), "{list:?}");
        }
    }
}
