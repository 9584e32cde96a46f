//! Packing: a place for every chart, in the smallest image that holds them.
//! Charts come measured from the charting, their masks from `footprint`; places go to the G-buffer and the colouring.

use super::footprint::Footprints;
use super::grow::Growing;
use super::items::{Items, QUICK, worth};
use super::mask::Mask;
use super::place::Place;
use super::search::Laid;
use super::strip::Spot;
use crate::chart::{Chart, Charting};

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
/// Rows that an image may be taller by for a texel between its edges and all charts.
const RIM_ROWS: u32 = 4;
/// Images of fewer rows than this are not: it would be too much of them.
const SMALL: u32 = 128;
/// How much finer charts get at a time where the image has room left, and how many times at most.
const FINER: f64 = 1.04;
const TIMES: i32 = 18;

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

/// Everything once more, in an image of fewer rows than `layout` where a search finds one, and with charts as much finer as there is room for: they have
/// all the density that is worth its bytes. Charts that have all that can be seen, and those as wide or high as the image, stay as they are.
pub(super) fn filled(footprints: &Footprints<'_>, backdrop: [u32; 2], max_side: u32, layout: Layout) -> Layout {
    if layout.scale < 1.0 || layout.gutter == 0 {
        return layout;
    }
    Packing { footprints, backdrop, max_side }.filled(&layout).unwrap_or(layout)
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
            self.footprints.add_seen(std::slice::from_mut(&mut masks));
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
            let larger = (1..=STEPS).rev().map(|step| (scale * libm::pow(STEP, f64::from(step))).min(1.0));
            scale = larger.into_iter().find(|&scale| fits(scale, gutter)).unwrap_or(scale);
        }
        for back in 1..=BACK {
            let items = self.items(scale, true);
            if let Some((size, spots)) = items.smallest(side, most, gutter) {
                return Some(self.settled(&items, size, spots, scale, gutter));
            }
            scale /= libm::pow(STEP, f64::from(back));
        }
        None
    }

    /// The layout in a smaller image, with finer charts, or both, if there is one.
    fn filled(&self, layout: &Layout) -> Option<Layout> {
        let charts = &self.footprints.charting.charts;
        let items = self.items(1.0, true);
        let (size, rim, laid) = shrunk(&items, layout)?;
        let spares = charts.iter().any(|chart| chart.finest > chart.density);
        if !spares && (size[1], rim) == (layout.height, layout.rim) {
            return None;
        }
        let room = size.map(|side| side - 2 * rim);
        let scales: Vec<f64> = (0..=if spares { TIMES } else { 0 }).map(|times| libm::pow(FINER, f64::from(times))).collect();
        let masks = scales.iter().map(|&scale| self.footprints.drawn(&sizes_within(self.footprints.charting, scale, room), scale));
        let mut masks: Vec<Vec<Mask>> = masks.collect();
        self.footprints.add_seen(&mut masks);
        let levels: Vec<Items> = masks.iter().map(|masks| Items::new(self.backdrop, masks)).collect();
        // A texel more is worth more where more pixels see the chart, and where they could see more of it: as the charting weighs them.
        let worth = |i: usize, level: usize| {
            let Chart { density, finest, loss, hits, .. } = &charts[i - 1];
            let missing = libm::log2(finest / (density * scales[level])).max(0.0);
            *hits as f64 * loss * missing / f64::from(levels[level].shapes[i][0].area.max(1))
        };
        let growing = Growing { levels: &levels, size, apart: [NARROW[0], rim], steps: items.steps(size) };
        let (of, laid) = growing.grown(laid, worth);
        let chosen: Vec<Mask> = of[1..].iter().enumerate().map(|(chart, &level)| masks[level][chart].clone()).collect();
        let area = |masks: &[Mask]| masks.iter().map(|mask| f64::from(mask.area())).sum::<f64>();
        let scale = (area(&chosen) / area(&masks[0]).max(1.0)).sqrt();
        Some(self.wider(&Items::new(self.backdrop, &chosen), size, laid.spots, scale, [NARROW[0], rim]))
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

/// The smallest image, no larger than that of `layout`, that a search fits everything into; the texels around it, and how it lies there.
fn shrunk(items: &Items, layout: &Layout) -> Option<([u32; 2], u32, Laid)> {
    let found = |size: [u32; 2], rim: u32| Some((size, rim, items.search(size, [NARROW[0], rim]).found(&items.orders, items.steps(size))?));
    let size = [layout.width, layout.height];
    let mut best = found(size, 1).or_else(|| found(size, layout.rim))?;
    loop {
        let [width, height] = best.0;
        let less = Some([width, height - 4]).filter(|&less| height > 4 && worth(less) < worth(best.0));
        let Some(found) = less.and_then(|less| found(less, best.1)) else { return Some(best) };
        best = found;
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
