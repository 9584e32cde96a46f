//! Packing: a place for every chart, in the smallest image that holds them.
//! Charts come measured from the charting, their masks from `footprint`; places go to the G-buffer and the colouring.

use super::footprint::Footprints;
use super::mask::Mask;
use super::place::Place;
use super::strip::{Shape, Spot, Strip};
use crate::chart::{Chart, Charting};
use cubist_core::window::Window;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::ops::Range;

/// Texels between charts: one, so that what lies just beyond an edge is not another chart, and none where nothing else fits.
const NARROW: [u32; 2] = [1, 0];
/// Texels between charts where they make the image no larger. Two are as many as bilinear lookup needs to meet no neighbour.
const WIDE: [u32; 4] = [6, 4, 3, 2];
/// A narrow gutter has to make the image this much denser than a wide one does to be preferred, where not all the density fits.
const WORTH: f64 = 1.07;
/// Scales tried beyond what bisection finds, a hundredth apart: what fits at one scale may not fit at a smaller one.
const STEPS: i32 = 12;
const STEP: f64 = 1.01;
/// Ever longer steps back from what bisection finds, until what is seen but not drawn fits too.
const BACK: i32 = 40;
/// Texels that an image may be larger by for windows: without them the player draws pixel by pixel, which takes two to four times as long.
const WINDOWED: u32 = 4096;
/// Rows that an image may be given for that.
const ROWS: [u32; 3] = [16, 64, 128];
/// Rows that an image may be taller by for a texel between its edges and all charts.
const RIM_ROWS: u32 = 4;
/// Images of fewer rows than this are not: it would be too much of them.
const SMALL: u32 = 128;
/// Scales tried where everything fits and the image has room left, the largest first: texels that cost nothing.
const FREE: [f64; 9] = [1.4, 1.32, 1.25, 1.19, 1.14, 1.1, 1.06, 1.03, 1.01];
/// Orders for searching a scale; all are tried at the scale found.
const QUICK: usize = 3;
/// Shuffled orders, fewer where there are many charts to lay down in each.
const SHUFFLED: usize = 40;
const CHARTS: usize = 8192;
/// Times that a chart is laid down earlier because there was no room for it, at most.
const PROMOTIONS: usize = 200;

/// Where everything lies.
pub(crate) struct Layout {
    pub width: u32,
    pub height: u32,
    /// What all densities were multiplied by.
    pub scale: f64,
    /// Texels between charts.
    pub gutter: u32,
    /// Texels between charts and the image's edges.
    rim: u32,
    /// The background's rectangle.
    pub backdrop: [u32; 4],
    /// One for each chart.
    pub places: Vec<Place>,
}

impl Layout {
    /// What it takes, texels; more by what windows are worth where it has none.
    pub fn worth(&self) -> u32 {
        worth([self.width, self.height])
    }
}

/// Masks in all their turns: the background's, then the charts'.
struct Items {
    shapes: Vec<Vec<Shape>>,
    /// Their sizes, straight.
    sizes: Vec<[u32; 2]>,
    area: u64,
    /// Orders to lay them down in.
    orders: Vec<Vec<usize>>,
}

impl Items {
    fn new(backdrop: [u32; 2], charts: &[Mask]) -> Self {
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
        let area = masks.iter().map(|m| u64::from(m.area())).sum();
        Self { shapes, sizes: masks.iter().map(|m| [m.width, m.height]).collect(), area, orders }
    }

    /// Lays everything down in order `order`, so many texels between charts and around them all; the height, and the spots.
    fn lay(&self, order: usize, size: [u32; 2], apart: [u32; 2]) -> Option<(u32, Vec<Spot>)> {
        self.lay_in(&self.orders[order], size, apart).ok()
    }

    /// The same in any order; or the place in it of the first that there is no room for.
    fn lay_in(&self, order: &[usize], [width, height]: [u32; 2], [gutter, rim]: [u32; 2]) -> Result<(u32, Vec<Spot>), usize> {
        if self.area > u64::from(width) * u64::from(height) {
            return Err(0);
        }
        let mut strip = Strip::new(width, height, gutter, rim);
        let mut spots = vec![Spot { x: 0, y: 0, turns: 0 }; self.shapes.len()];
        for (at, &i) in order.iter().enumerate() {
            spots[i] = strip.place(&self.shapes[i]).ok_or(at)?;
        }
        Ok((strip.height, spots))
    }

    /// The spots in an image of this size, in the first of a few orders in which everything fits: of all orders there are, or of such that come about
    /// when what finds no room is laid down earlier, again and again (D. Joslin and D. Clements, "Squeaky wheel optimization", 1999).
    fn at_all(&self, size: [u32; 2], apart: [u32; 2]) -> Option<Vec<Spot>> {
        let eager = |order: usize| {
            let mut order = self.orders[order].clone();
            for _ in 0..(CHARTS / order.len()).min(PROMOTIONS) {
                match self.lay_in(&order, size, apart) {
                    Ok((_, spots)) => return Some(spots),
                    Err(0) => return None,
                    Err(at) => order[at / 2..=at].rotate_right(1),
                }
            }
            None
        };
        self.in_any_order(usize::MAX, size, apart).or_else(|| (0..QUICK).into_par_iter().find_map_first(eager))
    }

    /// The spots in an image of this size, in the first of so many orders in which everything fits.
    fn in_any_order(&self, orders: usize, size: [u32; 2], apart: [u32; 2]) -> Option<Vec<Spot>> {
        (0..orders.min(self.orders.len())).into_par_iter().find_map_first(|order| self.lay(order, size, apart)).map(|(_, spots)| spots)
    }

    /// The smallest image that one of the orders makes: its size, and the spots.
    fn smallest(&self, side: u32, most: u32, gutter: u32) -> Option<([u32; 2], Vec<Spot>)> {
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
            let (height, spots) = self.lay(order, [width, most(width)], [gutter, 0])?;
            let height = height.next_multiple_of(4);
            let taller = ROWS.into_iter().filter(|&rows| rows > height && rows <= most(width));
            let size = std::iter::once(height).chain(taller).map(|height| [width, height]).min_by_key(|&size| worth(size))?;
            Some((worth(size), i, size, spots))
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
fn worth([width, height]: [u32; 2]) -> u32 {
    width * height + if windowed([width, height]) { 0 } else { WINDOWED }
}

/// The sides of a chart, texels.
fn sides(chart: &Chart) -> [f64; 2] {
    [0, 1].map(|k| (chart.hi[k] - chart.lo[k]) * chart.density)
}

/// Sizes of the charts in texels at a scale.
fn sizes(charting: &Charting, scale: f64, most: u32) -> Vec<[u32; 2]> {
    charting.charts.iter().map(|chart| sides(chart).map(|side| texels(side, scale, most))).collect()
}

/// The same at a scale of at least 1, but no chart gets finer than it can be made use of, nor larger than a room.
fn sizes_within(charting: &Charting, scale: f64, room: [u32; 2]) -> Vec<[u32; 2]> {
    let (short, long) = (f64::from(room[0].min(room[1])), f64::from(room[0].max(room[1])));
    let of = |chart: &Chart| {
        let [a, b] = sides(chart);
        let most = (long / a.max(b)).min(short / a.min(b)).min(chart.finest / chart.density).max(1.0);
        [a, b].map(|side| texels(side, scale.min(most), room[0].max(room[1])))
    };
    charting.charts.iter().map(of).collect()
}

fn texels(length: f64, scale: f64, most: u32) -> u32 {
    (length * scale - 1e-6).ceil().clamp(1.0, f64::from(most)) as u32
}

/// The background's size at a scale: little of one colour stays as it is.
fn scaled(backdrop: [u32; 2], scale: f64, most: u32) -> [u32; 2] {
    if backdrop.iter().all(|&v| v <= 4) { backdrop } else { backdrop.map(|v| texels(f64::from(v), scale, most)) }
}

/// The largest scale, at most 1, at which everything fits.
fn fit(fits: impl Fn(f64) -> bool) -> Option<f64> {
    if fits(1.0) {
        return Some(1.0);
    }
    // Bisection on octaves: charts of one texel each are the least.
    let (mut low, mut high) = (-16.0f64, 0.0f64);
    if !fits(libm::exp2(low)) {
        return None;
    }
    for _ in 0..11 {
        let middle = 0.5 * (low + high);
        *if fits(libm::exp2(middle)) { &mut low } else { &mut high } = middle;
    }
    Some(libm::exp2(low))
}

/// Packs everything into sides of at most `max_side`; `None` if not even charts of one texel fit.
pub(super) fn pack(footprints: &Footprints<'_>, backdrop: [u32; 2], max_side: u32) -> Option<Layout> {
    NARROW.into_iter().find_map(|gutter| Packing { footprints, backdrop, max_side }.with(gutter))
}

/// Everything once more, as much finer as there is room for in the image that `layout` takes anyhow; it has all the density that is worth its bytes. Charts
/// that have all that can be seen, and those as wide or high as the image, stay as they are.
pub(super) fn filled(footprints: &Footprints<'_>, backdrop: [u32; 2], max_side: u32, layout: Layout) -> Layout {
    let spares = footprints.charting.charts.iter().any(|chart| chart.finest > chart.density);
    if !spares || layout.scale < 1.0 {
        return layout;
    }
    let packing = Packing { footprints, backdrop, max_side };
    let finer = FREE.into_iter().find_map(|scale| packing.finer(&layout, scale));
    finer.unwrap_or(layout)
}

/// What there is to pack, and the room for it.
struct Packing<'a> {
    footprints: &'a Footprints<'a>,
    backdrop: [u32; 2],
    max_side: u32,
}

impl Packing<'_> {
    /// The largest width and height. The width is a power of two: a side in between limits the height only.
    fn room(&self) -> [u32; 2] {
        [1 << self.max_side.ilog2(), self.max_side / 4 * 4]
    }

    /// The masks at a scale. What is seen but not drawn is little, and asking all samples for it takes long.
    fn items(&self, scale: f64, seen: bool) -> Items {
        let [side, _] = self.room();
        let mut masks = self.footprints.drawn(&sizes(self.footprints.charting, scale, side), scale);
        if seen {
            self.footprints.add_seen(&mut masks);
        }
        Items::new(scaled(self.backdrop, scale, self.room()[0]), &masks)
    }

    /// Everything at least `gutter` texels apart.
    fn with(&self, mut gutter: u32) -> Option<Layout> {
        let [side, most] = self.room();
        let fits = |scale: f64, gutter: u32| self.items(scale, false).in_any_order(QUICK, [side, most], [gutter, 0]).is_some();
        let mut scale = fit(|scale| fits(scale, gutter))?;
        if scale < 1.0 {
            if let Some(wide) = WIDE.into_iter().find(|&wide| gutter > 0 && fits(scale / WORTH, wide)) {
                (gutter, scale) = (wide, scale / WORTH);
            }
            let larger = (1..=STEPS).rev().map(|step| (scale * STEP.powi(step)).min(1.0));
            scale = larger.into_iter().find(|&scale| fits(scale, gutter)).unwrap_or(scale);
        }
        for back in 1..=BACK {
            let items = self.items(scale, true);
            if let Some((size, spots)) = items.smallest(side, most, gutter) {
                return Some(self.settled(&items, size, spots, scale, gutter));
            }
            scale /= STEP.powi(back);
        }
        None
    }

    /// The layout at a larger scale, if that fits the same image.
    fn finer(&self, layout: &Layout, scale: f64) -> Option<Layout> {
        let size = [layout.width, layout.height];
        let sizes = sizes_within(self.footprints.charting, scale, size.map(|side| side - 2 * layout.rim));
        let mut masks = self.footprints.drawn(&sizes, scale);
        let spots = |items: &Items| items.at_all(size, [NARROW[0], layout.rim]);
        // What finds no room so finds none with what is seen but not drawn, which takes long to tell.
        spots(&Items::new(self.backdrop, &masks))?;
        self.footprints.add_seen(&mut masks);
        let items = Items::new(self.backdrop, &masks);
        let spots = spots(&items)?;
        Some(self.wider(&items, size, spots, scale, [NARROW[0], layout.rim]))
    }

    /// Takes more room around and between charts where it is free, or next to it: at the picture's edges players draw pixel by pixel, and what is thought to
    /// lie beyond a chart should not fall on another.
    fn settled(&self, items: &Items, size: [u32; 2], spots: Vec<Spot>, scale: f64, gutter: u32) -> Layout {
        let [width, height] = size;
        let taller = height + RIM_ROWS;
        let heights = [Some(height), Some(taller).filter(|_| height >= SMALL && taller <= self.room()[1])];
        let mut sizes = heights.into_iter().flatten().filter(|_| gutter > 0).map(|height| [width, height]);
        let rimmed = sizes.find_map(|size| Some((size, items.in_any_order(QUICK, size, [gutter, 1])?)));
        let (rim, (size, spots)) = rimmed.map_or((0, (size, spots)), |found| (1, found));
        self.wider(items, size, spots, scale, [gutter, rim])
    }

    /// The layout, with more room between charts where it is free.
    fn wider(&self, items: &Items, size: [u32; 2], spots: Vec<Spot>, scale: f64, [gutter, rim]: [u32; 2]) -> Layout {
        let mut wider = WIDE.into_iter().filter(|&wide| wide > gutter);
        let found = wider.find_map(|wide| Some((wide, items.in_any_order(usize::MAX, size, [wide, rim])?)));
        let (gutter, spots) = found.unwrap_or((gutter, spots));
        finish(self.footprints.charting, &items.sizes, &spots, size, scale, [gutter, rim])
    }
}

fn finish(
    charting: &Charting,
    sizes: &[[u32; 2]],
    spots: &[Spot],
    [width, height]: [u32; 2],
    scale: f64,
    [gutter, rim]: [u32; 2],
) -> Layout {
    let rect = |(&[w, h], &Spot { x, y, turns }): (&[u32; 2], &Spot)| {
        let [w, h] = if turns % 2 == 1 { [h, w] } else { [w, h] };
        [x, y, x + w, y + h]
    };
    let rects: Vec<[u32; 4]> = sizes.iter().zip(spots).map(rect).collect();
    // Each direction is stretched to whole texels: the outline of a rectangle is then the chart's own.
    let places =
        charting.charts.iter().zip(rects.iter().zip(spots).skip(1)).map(|(c, (&rect, spot))| Place::new(rect, c.lo, c.hi, spot.turns));
    Layout { width, height, scale, gutter, rim, backdrop: rects[0], places: places.collect() }
}
