//! Order: the sheets of every torn cell, front to back, such that the player's chart test shows the right sheet at
//! as many pixels as can be. Positions come from `fit`; the ordered lists go to `encode`.

use crate::atlas::SourceImage;
use crate::fit::Fit;
use crate::gbuffer::GBuffer;
use crate::sheets::{Chain, KeyGrid, Layers, Sheets, bilinear};
use rayon::prelude::*;

/// Up to this many sheets every order is tried; more are ordered greedily, front to back.
const EXHAUSTIVE: usize = 6;

/// Pixels of a torn cell that see the same: the sheet that shows, and those whose chart covers the pixel.
struct Group {
    sheet: usize,
    covering: u32,
    pixels: u32,
}

/// Sorts the sheets of every cell front to back. Returns the pixels at which another sheet than the right one will show.
pub fn sort(gbuffer: &GBuffer, grid: &KeyGrid, image: &SourceImage, layers: &Layers, fit: &Fit, sheets: &mut Sheets) -> u64 {
    let cells = grid.grid.cells();
    let wrong: Vec<u64> = sheets
        .lists
        .par_iter_mut()
        .enumerate()
        .map(|(index, list)| {
            if list.len() < 2 {
                return 0;
            }
            let groups = observe(gbuffer, grid, image, layers, fit, index / cells, index % cells, list);
            let order = if list.len() <= EXHAUSTIVE { best(&groups, list.len()) } else { greedy(&groups, list.len()) };
            *list = order.iter().map(|&sheet| list[sheet]).collect();
            u64::from(mistakes(&groups, &order))
        })
        .collect();
    wrong.iter().sum()
}

#[expect(clippy::too_many_arguments, reason = "one place in the middle of the pipeline sees all of it")]
fn observe(
    gbuffer: &GBuffer,
    grid: &KeyGrid,
    image: &SourceImage,
    layers: &Layers,
    fit: &Fit,
    interval: usize,
    cell: usize,
    list: &[u8],
) -> Vec<Group> {
    let chains: Vec<[Chain; 4]> = list.iter().map(|&label| layers.chains(grid, interval, cell, label, grid.time)).collect();
    let mut groups: Vec<Group> = Vec::new();
    for frame in grid.frames_of(interval) {
        let weights = grid.weights(interval, frame, grid.time);
        let corners: Vec<[[f32; 2]; 4]> = chains.iter().map(|chains| chains.map(|chain| chain.value(&fit.uv, &weights))).collect();
        grid.each_pixel(frame, cell, |pixel, at| {
            let label = gbuffer.label[pixel] as u8;
            let Some(sheet) = list.iter().position(|&l| l == label) else { return };
            let corner = bilinear(at);
            let mut covering = 0;
            for (index, (&label, values)) in list.iter().zip(&corners).enumerate() {
                let uv = [0, 1].map(|axis| values.iter().zip(corner).map(|(value, weight)| value[axis] * weight).sum());
                covering |= u32::from(covers(image, label, uv)) << index;
            }
            match groups.iter_mut().find(|g| g.sheet == sheet && g.covering == covering) {
                Some(group) => group.pixels += 1,
                None => groups.push(Group { sheet, covering, pixels: 1 }),
            }
        });
    }
    groups
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

/// Pixels that show another sheet than theirs under `order`, front to back.
fn mistakes(groups: &[Group], order: &[usize]) -> u32 {
    let back = order[order.len() - 1];
    let shown = |covering: u32| order.iter().copied().find(|&sheet| covering >> sheet & 1 == 1).unwrap_or(back);
    groups.iter().filter(|g| shown(g.covering) != g.sheet).map(|g| g.pixels).sum()
}

/// The order with the fewest mistakes; of equal ones the first in lexical order.
fn best(groups: &[Group], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    let (mut least, mut found) = (mistakes(groups, &order), order.clone());
    while next_permutation(&mut order) {
        let wrong = mistakes(groups, &order);
        if wrong < least {
            (least, found) = (wrong, order.clone());
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

/// Front to back, always the sheet that hides the fewest pixels of the others still to come.
fn greedy(groups: &[Group], count: usize) -> Vec<usize> {
    let mut left: Vec<usize> = (0..count).collect();
    let mut order = Vec::with_capacity(count);
    let mut taken = 0u32;
    while !left.is_empty() {
        let hidden = |sheet: usize| -> u32 {
            let hides = |g: &&Group| g.sheet != sheet && g.covering >> sheet & 1 == 1 && g.covering & taken == 0;
            groups.iter().filter(hides).map(|g| g.pixels).sum()
        };
        let at = (0..left.len()).min_by_key(|&at| hidden(left[at])).unwrap_or(0);
        let sheet = left.remove(at);
        taken |= 1 << sheet;
        order.push(sheet);
    }
    order
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
        assert_eq!(best(&groups, 2), [1, 0]);
        assert_eq!(greedy(&groups, 2), [1, 0]);
        assert_eq!(mistakes(&groups, &[1, 0]), 0);
    }
}
