//! Folds: the torn parts of a chart that one cell sees get labels of their own, so that each is a sheet.
//! Tears come from `tears`; the G-buffer with the finer labels goes to `sheets` and on. An *alias* label has the
//! same chart as the label it stands for; the player knows nothing of it.

use crate::atlas::Label;
use crate::gbuffer::GBuffer;
use crate::joins::root;
use crate::sheets::KeyGrid;
use crate::tears::{DOWN, NEXT, RIGHT};
use rayon::prelude::*;
use std::cmp::Reverse;

/// The label of a pixel that belongs to no sheet: a part too small to keep.
pub const NONE: u16 = u16::MAX;
/// The part of a pixel whose part was too small to keep. A cell and interval has up to 32 x 32 x 320 pixels: parts need 32 bits.
const GIVEN_UP: u32 = u32::MAX;
/// Parts of one chart that are told apart where they meet.
const PARTS: usize = 4;
/// The most labels there are.
const MOST_LABELS: usize = 256;

/// The G-buffer with aliases, and all labels.
pub struct Folded {
    /// Positions as before, labels finer.
    pub gbuffer: GBuffer,
    /// The labels, aliases after the others.
    pub labels: Vec<Label>,
    /// The label that each stands for: itself, but for aliases.
    pub stands_for: Vec<u16>,
}

/// Tells the torn parts apart. Parts of fewer than `least` pixels in a cell and interval are given up.
#[must_use]
pub fn unfold(gbuffer: &GBuffer, tears: &[u8], grid: &KeyGrid, labels: &[Label], least: u32) -> Folded {
    let parts = Parts::find(gbuffer, tears, grid, least);
    let mut folded = Folded { gbuffer: gbuffer.clone(), labels: labels.to_vec(), stands_for: (0..labels.len() as u16).collect() };
    let Some(part) = parts.assign(gbuffer, tears, grid) else { return folded };
    // The largest parts get a label first.
    let mut sizes = vec![[0u64; PARTS]; labels.len()];
    for (&label, &part) in gbuffer.label.iter().zip(&part) {
        if usize::from(part) < PARTS {
            sizes[usize::from(label)][usize::from(part)] += 1;
        }
    }
    let mut wanted: Vec<(u64, usize, usize)> = Vec::new();
    for (label, sizes) in sizes.iter().enumerate() {
        wanted.extend((1..PARTS).filter(|&part| sizes[part] > 0).map(|part| (sizes[part], label, part)));
    }
    wanted.sort_by_key(|&(size, label, part)| (Reverse(size), label, part));
    let mut alias: Vec<[u16; PARTS]> = (0..labels.len()).map(|label| [label as u16; PARTS]).collect();
    for &(_, label, part) in wanted.iter().take(MOST_LABELS.saturating_sub(labels.len())) {
        alias[label][part] = folded.labels.len() as u16;
        folded.labels.push(labels[label].clone());
        folded.stands_for.push(label as u16);
    }
    folded.gbuffer.label.par_iter_mut().zip(part).for_each(|(label, part)| {
        *label = if usize::from(part) < PARTS { alias[usize::from(*label)][usize::from(part)] } else { NONE };
    });
    folded
}

/// The torn cells' pixels, by the part they belong to.
struct Parts {
    /// Cells (interval times cells plus cell) with tears, ascending, and for each pixel of theirs, frame by frame and row by row,
    /// its part: a number within the cell, [`GIVEN_UP`] where it was too small.
    torn: Vec<(usize, Vec<u32>)>,
}

impl Parts {
    fn find(gbuffer: &GBuffer, tears: &[u8], grid: &KeyGrid, least: u32) -> Self {
        let find = |index: usize| {
            let block = Block::new(grid, index);
            let any = block.torn(tears, grid).next().is_some();
            any.then(|| (index, block.parts(gbuffer, tears, grid, grid.least(index / grid.grid.cells(), least))))
        };
        Self { torn: (0..grid.intervals() * grid.grid.cells()).into_par_iter().filter_map(find).collect() }
    }

    /// A part number for every pixel, the same across cells as far as they agree; `None` where nothing is torn.
    fn assign(&self, gbuffer: &GBuffer, tears: &[u8], grid: &KeyGrid) -> Option<Vec<u8>> {
        if self.torn.is_empty() {
            return None;
        }
        let torn = self.torn.par_iter().flat_map_iter(|&(index, _)| {
            let mut labels: Vec<u16> = Block::new(grid, index).torn(tears, grid).map(|pixel| gbuffer.label[pixel]).collect();
            labels.dedup();
            labels
        });
        let mut folding = vec![false; 1 << 16];
        torn.collect::<Vec<u16>>().into_iter().for_each(|label| folding[usize::from(label)] = true);
        let (cells, mut part) = (grid.grid.cells(), vec![0u8; gbuffer.label.len()]);
        // What every cell has can be told at once, but not which numbers its parts get: those go by what cells before it have.
        for interval in 0..grid.intervals() {
            let has = (interval * cells..(interval + 1) * cells).into_par_iter().filter_map(|index| {
                let own = self.torn.binary_search_by_key(&index, |&(at, _)| at).ok().map(|at| self.torn[at].1.as_slice());
                Block::new(grid, index).has(gbuffer, tears, grid, &folding, own)
            });
            has.collect::<Vec<_>>().iter().for_each(|has| has.adopt(gbuffer, &folding, &mut part));
        }
        Some(part)
    }
}

/// A part of a label in a cell and interval.
#[derive(Clone, Copy)]
struct Part {
    label: u16,
    part: u32,
    pixels: u32,
}

/// The parts of a cell and interval.
struct Has {
    parts: Vec<Part>,
    /// The G-buffer's pixels, frame by frame and row by row, and which part each is of: `None` where that was too small.
    of: Vec<(usize, Option<u32>)>,
    /// Pixels to the left, above and before from which a part goes on, and which.
    from: Vec<(usize, u32)>,
}

impl Has {
    /// Gives every part the number that most of its neighbours already have; parts of one label get different ones.
    fn adopt(&self, gbuffer: &GBuffer, folding: &[bool], part: &mut [u8]) {
        let mut votes = vec![[0u32; PARTS]; self.parts.len()];
        for &(other, of) in &self.from {
            if let Some(votes) = votes[of as usize].get_mut(usize::from(part[other])) {
                *votes += 1;
            }
        }
        // Those who are surest choose first; then the larger ones.
        let mut order: Vec<usize> = (0..self.parts.len()).collect();
        order.sort_by_key(|&at| {
            let Part { label, part, pixels } = self.parts[at];
            (Reverse(votes[at].iter().copied().max()), Reverse(pixels), label, part)
        });
        let mut chosen = vec![u8::MAX; self.parts.len()];
        for (turn, &at) in order.iter().enumerate() {
            let before = order[..turn].iter().filter(|&&other| self.parts[other].label == self.parts[at].label);
            let taken = |number: usize| before.clone().any(|&other| usize::from(chosen[other]) == number);
            let number = (0..PARTS).filter(|&number| !taken(number)).max_by_key(|&number| (votes[at][number], Reverse(number)));
            chosen[at] = number.map_or(u8::MAX, |number| number as u8);
        }
        for &(pixel, of) in &self.of {
            let number = of.map_or(u8::MAX, |of| chosen[of as usize]);
            part[pixel] = if folding[usize::from(gbuffer.label[pixel])] { number } else { 0 };
        }
    }
}

/// The pixels of one cell and interval.
struct Block {
    interval: usize,
    cell: usize,
    /// Pixels across, down, and frames.
    size: [usize; 3],
    /// G-buffer pixels to the next row and frame.
    stride: [usize; 2],
}

impl Block {
    /// That of `index`: interval times cells plus cell.
    fn new(grid: &KeyGrid, index: usize) -> Self {
        let (interval, cell) = (index / grid.grid.cells(), index % grid.grid.cells());
        let [columns, rows] = grid.pixels(cell);
        let size = [columns.len(), rows.len(), grid.frames_of(interval).len()];
        Self { interval, cell, size, stride: [grid.size[0], grid.size[0] * grid.size[1]] }
    }

    /// The G-buffer's pixels, frame by frame, row by row.
    fn pixels(&self, grid: &KeyGrid) -> impl Iterator<Item = usize> + use<> {
        let [columns, rows] = grid.pixels(self.cell);
        let [row, frame] = self.stride;
        grid.frames_of(self.interval)
            .flat_map(move |f| rows.clone().map(move |y| f as usize * frame + y * row))
            .flat_map(move |start| columns.clone().map(move |x| start + x))
    }

    /// The steps from the pixel at `place` that stay inside: the tear that would stand in the way, and how far it is here and in the G-buffer.
    fn steps(&self, place: usize) -> impl Iterator<Item = (u8, usize, usize)> {
        let [width, height, frames] = self.size;
        let (x, y, f) = (place % width, place / width % height, place / (width * height));
        let right = (x + 1 < width).then_some((RIGHT, 1, 1));
        let down = (y + 1 < height).then_some((DOWN, width, self.stride[0]));
        let next = (f + 1 < frames).then_some((NEXT, width * height, self.stride[1]));
        right.into_iter().chain(down).chain(next)
    }

    /// The G-buffer's pixels here that are torn from one further on.
    fn torn(&self, tears: &[u8], grid: &KeyGrid) -> impl Iterator<Item = usize> {
        let torn = |&(place, pixel): &(usize, usize)| tears[pixel] != 0 && self.steps(place).any(|(bit, _, _)| tears[pixel] & bit != 0);
        self.pixels(grid).enumerate().filter(torn).map(|(_, pixel)| pixel)
    }

    /// Connected parts of each label; those of fewer than `least` pixels are given up, but never all of them: a cell has to show something.
    fn parts(&self, gbuffer: &GBuffer, tears: &[u8], grid: &KeyGrid, least: u32) -> Vec<u32> {
        let pixels: Vec<usize> = self.pixels(grid).collect();
        let mut parent: Vec<u32> = (0..pixels.len() as u32).collect();
        for (place, &pixel) in pixels.iter().enumerate() {
            for (bit, near, far) in self.steps(place) {
                if tears[pixel] & bit == 0 && gbuffer.label[pixel] == gbuffer.label[pixel + far] {
                    let (a, b) = (root(&mut parent, place as u32), root(&mut parent, (place + near) as u32));
                    parent[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let roots: Vec<u32> = (0..pixels.len() as u32).map(|place| root(&mut parent, place)).collect();
        let mut count = vec![0u32; pixels.len()];
        for &root in &roots {
            count[root as usize] += 1;
        }
        let least = least.min(count.iter().copied().max().unwrap_or(0));
        roots.iter().map(|&root| if count[root as usize] >= least { root } else { GIVEN_UP }).collect()
    }

    /// The parts of each label here, if any label folds; `own`: the part of each pixel.
    fn has(&self, gbuffer: &GBuffer, tears: &[u8], grid: &KeyGrid, folding: &[bool], own: Option<&[u32]>) -> Option<Has> {
        if !self.pixels(grid).any(|pixel| folding[usize::from(gbuffer.label[pixel])]) {
            return None;
        }
        let [width, height, _] = self.size;
        let mut has = Has { parts: Vec::new(), of: Vec::with_capacity(self.size.iter().product()), from: Vec::new() };
        for (place, pixel) in self.pixels(grid).enumerate() {
            let (label, part) = (gbuffer.label[pixel], own.map_or(0, |own| own[place]));
            if part == GIVEN_UP {
                has.of.push((pixel, None));
                continue;
            }
            let at = has.parts.iter().position(|known| (known.label, known.part) == (label, part)).unwrap_or_else(|| {
                has.parts.push(Part { label, part, pixels: 0 });
                has.parts.len() - 1
            });
            has.parts[at].pixels += 1;
            has.of.push((pixel, Some(at as u32)));
            let (x, y, f) = (place % width, place / width % height, place / (width * height));
            let mut ask = |edge: bool, back: usize, bit: u8| {
                if let Some(other) = pixel.checked_sub(back).filter(|_| edge)
                    && gbuffer.label[other] == label
                    && tears[other] & bit == 0
                {
                    has.from.push((other, at as u32));
                }
            };
            let column = pixel % self.stride[0];
            ask(x == 0 && column > 0, 1, RIGHT);
            ask(y == 0 && pixel % self.stride[1] >= self.stride[0], self.stride[0], DOWN);
            ask(f == 0, self.stride[1], NEXT);
        }
        Some(has)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sheets;
    use cubist_core::format::{SPACE_LINEAR, TIME_LINEAR};

    /// One label everywhere, torn where `tear` says, in cells of 2^`cell_log2` pixels and one interval; folded and looked through.
    fn folded(size: [u32; 2], frames: u32, cell_log2: u8, tear: impl Fn(usize) -> u8) -> (Folded, sheets::Sheets) {
        let pixels = (size[0] * size[1] * frames) as usize;
        let uv = vec![[8.0f32; 2]; pixels];
        let gbuffer = GBuffer { width: size[0], height: size[1], frames, label: vec![1; pixels], uv: uv.into() };
        let labels = vec![Label { rect: [0, 0, 16, 16], masked: false, fixed: None }; 2];
        let grid = KeyGrid::new(&gbuffer, cell_log2, frames, true, [TIME_LINEAR, SPACE_LINEAR]);
        let tears: Vec<u8> = (0..pixels).map(tear).collect();
        let folded = unfold(&gbuffer, &tears, &grid, &labels, 16);
        let sheets = sheets::find(&folded.gbuffer, &grid, 8);
        (folded, sheets)
    }

    #[test]
    fn the_largest_cell_and_longest_interval_keep_their_parts_apart() {
        // 32 x 32 x 256 pixels, torn down the middle.
        let (folded, sheets) = folded([32, 32], 256, 5, |pixel| if pixel % 32 == 15 { RIGHT } else { 0 });
        assert_eq!(folded.labels.len(), 3);
        assert!(folded.gbuffer.label.iter().enumerate().all(|(pixel, &label)| (label == folded.gbuffer.label[0]) == (pixel % 32 < 16)));
        assert_eq!((sheets.lists[0].len(), sheets.dropped), (2, 0));
    }

    #[test]
    fn a_cell_torn_to_shreds_still_shows_something() {
        // Screens end anywhere: the second cell is a column of four pixels, each torn from the next.
        let (folded, sheets) = folded([5, 4], 1, 2, |pixel| if pixel % 5 == 4 { DOWN } else { 0 });
        assert!(sheets.lists.iter().all(|list| !list.is_empty()), "{:?} {:?}", sheets.lists, folded.gbuffer.label);
    }

    #[test]
    fn shreds_that_are_given_up_count_as_dropped() {
        let (folded, sheets) = folded([8, 8], 1, 3, |pixel| match pixel {
            0 => RIGHT | DOWN,
            _ => 0,
        });
        assert_eq!((folded.gbuffer.label[0], sheets.dropped), (NONE, 1));
    }
}
