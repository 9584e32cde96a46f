//! Items: what lies in the source image, masks in all their turns, and the images that they fit into.
//! `pack` says which masks, and how large an image may be; `strip` lays them down.

use super::mask::Mask;
use super::search::Search;
use super::strip::{Shape, Spot};
use cubist_core::Window;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::ops::Range;

/// Texels that an image may be larger by for windows: without them the player draws pixel by pixel, which takes two to four times as long.
const WINDOWED: u32 = 4096;
/// Rows that an image may be given for that.
const ROWS: [u32; 3] = [16, 64, 128];
/// Orders for searching a scale; all are tried at the scale found.
pub(super) const QUICK: usize = 3;
/// Shuffled orders, fewer where there are many charts to lay down in each.
const SHUFFLED: usize = 40;
const CHARTS: usize = 8192;
/// Steps of a search for an order, fewer where there are many charts, or many texels to find room among.
const STEPS: usize = 400;
const TEXELS: usize = 1 << 22;

/// Masks in all their turns: the background's, then the charts'.
pub(super) struct Items {
    pub shapes: Vec<Vec<Shape>>,
    /// Their sizes, straight.
    pub sizes: Vec<[u32; 2]>,
    /// Orders to lay them down in.
    pub orders: Vec<Vec<usize>>,
}

impl Items {
    pub fn new(backdrop: [u32; 2], charts: &[Mask]) -> Self {
        let first = Mask::full(backdrop[0], backdrop[1]);
        let masks: Vec<&Mask> = std::iter::once(&first).chain(charts).collect();
        // The background is fixed to the screen, which does not turn.
        let shapes = masks.par_iter().enumerate().map(|(i, mask)| Shape::turns(mask, i > 0)).collect();
        let keys: [fn(&Mask) -> u32; 3] = [|m| m.area(), |m| m.width.max(m.height), |m| m.width + m.height];
        let order = |key: fn(&Mask) -> u32| {
            let mut order: Vec<usize> = (0..masks.len()).collect();
            order.sort_by_cached_key(|&i| (Reverse((key(masks[i]), masks[i].area())), i));
            order
        };
        let mut orders = Vec::from(keys.map(order));
        for seed in 0..(CHARTS / masks.len()).min(SHUFFLED) as u32 {
            // By area, but each multiplied by something between 0.5 and 1.5.
            let chance = |i: usize| {
                let mixed = (i as u32 ^ seed << 16).wrapping_mul(2_654_435_761);
                (mixed ^ mixed >> 15).wrapping_mul(2_246_822_519) >> 16
            };
            let mut order: Vec<usize> = (0..masks.len()).collect();
            order.sort_by_cached_key(|&i| (Reverse(u64::from(masks[i].area()) * u64::from((1 << 15) + chance(i))), i));
            orders.push(order);
        }
        Self { shapes, sizes: masks.iter().map(|m| [m.width, m.height]).collect(), orders }
    }

    /// Steps that a search for an order is worth in an image of this size.
    pub fn steps(&self, [width, height]: [u32; 2]) -> usize {
        (2 * CHARTS / self.shapes.len()).min(TEXELS / (width * height) as usize).min(STEPS)
    }

    /// The search for an order in which everything fits an image of this size.
    pub fn search(&self, size: [u32; 2], apart: [u32; 2]) -> Search<'_> {
        Search { shapes: self.shapes.iter().map(Vec::as_slice).collect(), size, apart }
    }

    /// The spots in an image of this size, in the first of so many orders in which everything fits.
    pub fn in_any_order(&self, orders: usize, size: [u32; 2], apart: [u32; 2]) -> Option<Vec<Spot>> {
        let search = self.search(size, apart);
        self.orders.par_iter().take(orders).find_map_first(|order| search.all(order)).map(|laid| laid.spots)
    }

    /// The smallest image that one of the orders makes: its size, and the spots.
    pub fn smallest(&self, side: u32, most: u32, gutter: u32) -> Option<([u32; 2], Vec<Spot>)> {
        let best = self.smaller(0..QUICK, side, gutter, |_| most)?;
        // The others need not be laid down to the end where they come to no less.
        let texels = worth(best.0) - 1;
        let less = |wide: u32| {
            let texels = if windowed([wide, u32::MAX]) { texels } else { texels.saturating_sub(WINDOWED) };
            (texels / wide / 4 * 4).min(most)
        };
        let other = self.smaller(QUICK..self.orders.len(), side, gutter, less);
        other.filter(|(size, _)| worth(*size) <= texels).or(Some(best))
    }

    /// The smallest image that some of the orders make, of at most `most` rows for its width.
    fn smaller(&self, orders: Range<usize>, side: u32, gutter: u32, most: impl Fn(u32) -> u32 + Sync) -> Option<([u32; 2], Vec<Spot>)> {
        let widths = (6..=side.ilog2()).rev().map(|log2| 1 << log2);
        let tries: Vec<(u32, usize)> = widths.flat_map(|width| orders.clone().map(move |order| (width, order))).collect();
        let of = |(i, &(width, order)): (usize, &(u32, usize))| {
            let laid = self.search([width, most(width)], [gutter, 0]).all(&self.orders[order])?;
            let height = laid.height.next_multiple_of(4);
            let taller = ROWS.into_iter().filter(|&rows| rows > height && rows <= most(width));
            let size = std::iter::once(height).chain(taller).map(|height| [width, height]).min_by_key(|&size| worth(size))?;
            Some((worth(size), i, size, laid.spots))
        };
        let best = tries.par_iter().enumerate().filter_map(of).min_by_key(|&(worth, i, ..)| (worth, i));
        best.map(|(_, _, size, spots)| (size, spots))
    }
}

/// The player has windows in images of this size.
fn windowed([width, height]: [u32; 2]) -> bool {
    Window::new(width.ilog2(), height).is_some()
}

/// What an image of this size takes, texels, windows among them.
pub(super) fn worth([width, height]: [u32; 2]) -> u32 {
    width * height + if windowed([width, height]) { 0 } else { WINDOWED }
}
