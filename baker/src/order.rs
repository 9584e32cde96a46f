//! Order: the sheets of every torn cell, front to back, and the coverage test of each, such that the player shows the
//! right sheet at as many pixels as can be. Positions come from `fit`, fields from `fields`; the ordered lists go
//! to `encode`.

use crate::atlas::SourceImage;
use crate::bake::Coverage;
use crate::fields::Fields;
use crate::fit::Fit;
use crate::gbuffer::GBuffer;
use crate::patch::{self, AtPoints, Patch};
use crate::sheets::{KeyGrid, Layers, Sheets};
use cubist_core::format::{MAX_SHEETS, SPACE_LINEAR, TIME_LINEAR};
use cubist_core::lists::{BOTH, CHART, FIELD};
use rayon::prelude::*;

/// Up to this many sheets every order is tried; more are ordered greedily, front to back.
const EXHAUSTIVE: usize = 5;

/// What the sheets are ordered by.
pub struct Evidence<'a> {
    /// What is really seen.
    pub gbuffer: &'a GBuffer,
    /// The grid.
    pub grid: &'a KeyGrid,
    /// Where the charts lie.
    pub image: &'a SourceImage,
    /// The layers.
    pub layers: &'a Layers,
    /// Their positions.
    pub fit: &'a Fit,
    /// Their fields, once they are known.
    pub fields: Option<&'a Fields>,
    /// A field has to save this many pixels in a cell and interval to be worth its bytes.
    pub field_price: u32,
    /// The tests to choose from.
    pub coverage: Coverage,
}

/// A test that a sheet may have, and what it costs, pixels.
type Candidate = (u16, u32);

impl Evidence<'_> {
    /// The tests to choose from: before the fields are known only the chart's.
    fn candidates(&self) -> Vec<Candidate> {
        let price = self.field_price;
        match (self.fields, self.coverage) {
            (None, _) | (_, Coverage::Chart) => vec![(CHART, 0)],
            (_, Coverage::Field) => vec![(FIELD, price)],
            (_, Coverage::All) => vec![(CHART, 0), (FIELD, price), (BOTH, price)],
        }
    }
}

/// Pixels of a torn cell that see the same.
struct Group {
    /// The sheet that should show.
    sheet: usize,
    /// The sheets whose chart covers the pixel, one bit each, and from bit 16 on those whose fields do.
    covering: u32,
    pixels: u32,
}

impl Group {
    fn covers(&self, sheet: usize, test: u16) -> bool {
        let (chart, field) = (self.covering >> sheet & 1 == 1, self.covering >> (16 + sheet) & 1 == 1);
        match test {
            CHART => chart,
            FIELD => field,
            _ => chart && field,
        }
    }
}

/// An order with its tests, and the pixels it gets wrong.
struct Choice {
    order: Vec<usize>,
    tests: u16,
    wrong: u32,
    /// Wrong pixels plus what the fields cost.
    cost: u32,
}

/// Sorts the sheets of every cell front to back and chooses their tests. Returns the pixels at which
/// another sheet than the right one will show.
pub fn sort(evidence: &Evidence<'_>, sheets: &mut Sheets) -> u64 {
    let candidates = &evidence.candidates();
    let wrong: Vec<u64> = sheets
        .lists
        .par_iter_mut()
        .zip(&mut sheets.tests)
        .enumerate()
        .map(|(index, (list, tests))| {
            if list.len() < 2 {
                return 0;
            }
            let groups = observe(evidence, index, list);
            let choose = if list.len() <= EXHAUSTIVE { best } else { greedy };
            let choice = choose(&groups, list.len(), candidates);
            *list = choice.order.iter().map(|&sheet| list[sheet]).collect();
            *tests = choice.tests;
            u64::from(choice.wrong)
        })
        .collect();
    wrong.iter().sum()
}

/// Counts the pixels of a cell and interval by what they see and what would cover them.
fn observe(evidence: &Evidence<'_>, index: usize, list: &[u8]) -> Vec<Group> {
    let &Evidence { gbuffer, grid, image, layers, fit, fields, .. } = evidence;
    let cells = grid.grid.cells();
    let (interval, cell) = (index / cells, index % cells);
    let patches = |ways| -> Vec<Patch> { list.iter().map(|&label| Patch::new(grid, layers, [interval, cell], label, ways)).collect() };
    let (position_patches, field_patches) = (patches([grid.time, grid.space]), patches([TIME_LINEAR, SPACE_LINEAR]));
    let mut seen: Vec<u64> = Vec::new();
    for frame in grid.frames_of(interval) {
        let weights = grid.weights(interval, frame, grid.time);
        let linear = grid.weights(interval, frame, TIME_LINEAR);
        let points = |patches: &[Patch], values: &[[f32; 2]], weights: &[[f32; 4]; 4]| -> Vec<AtPoints> {
            patches.iter().map(|patch| patch.points(values, weights)).collect()
        };
        let positions = points(&position_patches, &fit.uv, &weights);
        let distances = fields.map(|fields| points(&field_patches, &fields.distance, &linear));
        grid.each_pixel(frame, cell, |pixel, at| {
            let Some(sheet) = list.iter().position(|&label| u16::from(label) == gbuffer.label[pixel]) else { return };
            let around = patch::around(at);
            let mix = |points: &AtPoints| patch::value(points, around);
            let mut covering = 0u32;
            for (place, &label) in list.iter().enumerate() {
                covering |= u32::from(covers(image, label, mix(&positions[place]))) << place;
                if let Some((fields, distances)) = fields.zip(distances.as_ref()) {
                    let [a, b]: [f32; 2] = mix(&distances[place]);
                    let inside = a > 0.0 && (!fields.strip(label) || b > 0.0);
                    covering |= u32::from(inside) << (16 + place);
                }
            }
            seen.push((sheet as u64) << 32 | u64::from(covering));
        });
    }
    seen.sort_unstable();
    seen.chunk_by(|a, b| a == b)
        .map(|run| Group { sheet: (run[0] >> 32) as usize, covering: run[0] as u32, pixels: run.len() as u32 })
        .collect()
}

/// The player's chart test.
fn covers(image: &SourceImage, label: u8, [u, v]: [f32; 2]) -> bool {
    let label = &image.labels[usize::from(label)];
    let [left, top, right, bottom] = label.rect.map(f32::from);
    if !(u >= left && u < right && v >= top && v < bottom) {
        return false;
    }
    !label.masked || image.covered[v as usize * image.width as usize + u as usize]
}

/// The tests and the cost of an order: each sheet's test is chosen of `candidates` in turn, front to back.
fn weigh(groups: &[Group], order: &[usize], candidates: &[Candidate]) -> Choice {
    let mut choice = Choice { order: order.to_vec(), tests: 0, wrong: 0, cost: 0 };
    let mut left: Vec<&Group> = groups.iter().collect();
    for (place, &sheet) in order[..order.len() - 1].iter().enumerate() {
        let wrong = |test: u16| -> u32 { left.iter().filter(|g| g.covers(sheet, test) != (g.sheet == sheet)).map(|g| g.pixels).sum() };
        let tried = candidates.iter().map(|&(test, price)| (wrong(test) + price, wrong(test), test));
        let (cost, wrong, test) = tried.min_by_key(|&(cost, _, _)| cost).unwrap_or((0, 0, CHART));
        choice.tests |= test << (2 * place);
        choice.wrong += wrong;
        choice.cost += cost;
        // What it covers is settled, and so is what it should have.
        left.retain(|g| !g.covers(sheet, test) && g.sheet != sheet);
    }
    let back = order[order.len() - 1];
    let wrong: u32 = left.iter().filter(|g| g.sheet != back).map(|g| g.pixels).sum();
    choice.wrong += wrong;
    choice.cost += wrong;
    choice
}

/// The order with the least cost; of equal ones the first in lexical order.
fn best(groups: &[Group], count: usize, candidates: &[Candidate]) -> Choice {
    let mut order: Vec<usize> = (0..count).collect();
    let mut found = weigh(groups, &order, candidates);
    while next_permutation(&mut order) {
        let choice = weigh(groups, &order, candidates);
        if choice.cost < found.cost {
            found = choice;
        }
    }
    found
}

/// Steps to the next permutation in lexical order; false after the last.
fn next_permutation(order: &mut [usize]) -> bool {
    let Some(pivot) = (1..order.len()).rev().find(|&i| order[i - 1] < order[i]) else { return false };
    let Some(swap) = (pivot..order.len()).rev().find(|&i| order[i] > order[pivot - 1]) else { return false };
    order.swap(pivot - 1, swap);
    order[pivot..].reverse();
    true
}

/// Front to back, always the sheet that gets the fewest of the pixels still to come wrong.
fn greedy(groups: &[Group], count: usize, candidates: &[Candidate]) -> Choice {
    let mut rest: Vec<usize> = (0..count.min(MAX_SHEETS)).collect();
    let mut order = Vec::with_capacity(count);
    let mut left: Vec<&Group> = groups.iter().collect();
    while !rest.is_empty() {
        let wrong = |sheet: usize, test: u16| -> u32 {
            left.iter().filter(|g| g.covers(sheet, test) != (g.sheet == sheet)).map(|g| g.pixels).sum()
        };
        let tried = rest.iter().enumerate().flat_map(|(at, &sheet)| candidates.iter().map(move |&(test, _)| (at, sheet, test)));
        let Some((at, sheet, test)) = tried.min_by_key(|&(_, sheet, test)| wrong(sheet, test)) else { break };
        rest.remove(at);
        order.push(sheet);
        left.retain(|g| !g.covers(sheet, test) && g.sheet != sheet);
    }
    weigh(groups, &order, candidates)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_permutation_comes_once() {
        let mut order = vec![0, 1, 2, 3];
        let mut count = 1;
        while next_permutation(&mut order) {
            count += 1;
        }
        assert_eq!((count, order), (24, vec![3, 2, 1, 0]));
    }

    #[test]
    fn the_sheet_that_covers_everything_goes_to_the_back() {
        let groups = [Group { sheet: 0, covering: 0b01, pixels: 10 }, Group { sheet: 1, covering: 0b11, pixels: 5 }];
        for choice in [best(&groups, 2, &[(CHART, 0)]), greedy(&groups, 2, &[(CHART, 0)])] {
            assert_eq!((choice.order, choice.tests, choice.wrong), (vec![1, 0], CHART, 0));
        }
    }

    #[test]
    fn a_field_is_used_where_charts_cannot_tell() {
        // Both charts cover everything; the field of the first tells.
        let groups = [Group { sheet: 0, covering: 0x1_0003, pixels: 30 }, Group { sheet: 1, covering: 0b11, pixels: 20 }];
        let all = |price: u32| [(CHART, 0), (FIELD, price), (BOTH, price)];
        let choice = best(&groups, 2, &all(4));
        assert_eq!((choice.order, choice.tests, choice.wrong, choice.cost), (vec![0, 1], FIELD, 0, 4));
        // Not where it costs more than it saves.
        assert_eq!(best(&groups, 2, &all(50)).tests, CHART);
        // Unless there is nothing else to choose.
        assert_eq!(best(&groups, 2, &[(FIELD, 50)]).tests, FIELD);
    }
}
