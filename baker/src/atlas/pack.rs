//! Packing: a rectangle for every chart, in the smallest image that holds them.
//! Charts come measured from the charting; places go to the G-buffer and the colouring.

use super::Place;
use crate::chart::Charting;
use guillotiere::{AllocatorOptions, AtlasAllocator, size2};

/// Texels between charts where there is room, where there is not, and where nothing else fits.
const GUTTERS: [u32; 3] = [6, 2, 0];
/// How much denser the narrow gutter has to make the image to be preferred.
const WORTH: f64 = 1.15;

/// Where everything lies.
pub(crate) struct Layout {
    pub width: u32,
    pub height: u32,
    /// What all densities were multiplied by.
    pub scale: f64,
    /// Texels between charts.
    pub gutter: u32,
    /// The background's rectangle.
    pub backdrop: [u32; 4],
    /// One for each chart.
    pub places: Vec<Place>,
}

/// Sizes in texels at a scale: the background's, then the charts'.
fn sizes(charting: &Charting, backdrop: [u32; 2], scale: f64, most: u32) -> Vec<[u32; 2]> {
    let texels = |length: f64| (length * scale - 1e-6).ceil().clamp(1.0, f64::from(most)) as u32;
    let small = backdrop.iter().all(|&v| v <= 4);
    let first = if small { backdrop } else { backdrop.map(|v| texels(f64::from(v))) };
    let charts = charting.charts.iter().map(|c| [0, 1].map(|k| texels((c.hi[k] - c.lo[k]) * c.density)));
    std::iter::once(first).chain(charts).collect()
}

/// Tries to place rectangles; returns their top left corners.
fn place(sizes: &[[u32; 2]], width: u32, height: u32, gutter: u32) -> Option<Vec<[u32; 2]>> {
    let area: u64 = sizes.iter().map(|[w, h]| u64::from(w + gutter) * u64::from(h + gutter)).sum();
    if area > u64::from(width) * u64::from(height) {
        return None;
    }
    let keys: [fn(&[u32; 2]) -> u32; 3] = [|s| s[0].max(s[1]), |s| s[1], |s| s[0] * s[1]];
    keys.iter().find_map(|key| {
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_by_key(|&i| (std::cmp::Reverse((key(&sizes[i]), sizes[i][0])), i));
        let options = AllocatorOptions { small_size_threshold: 16, large_size_threshold: 128, ..Default::default() };
        let mut allocator = AtlasAllocator::with_options(size2(width as i32, height as i32), &options);
        let mut corners = vec![[0; 2]; sizes.len()];
        for i in order {
            let [w, h] = sizes[i].map(|v| (v + gutter) as i32);
            let at = allocator.allocate(size2(w, h))?.rectangle.min;
            corners[i] = [at.x as u32 + gutter / 2, at.y as u32 + gutter / 2];
        }
        Some(corners)
    })
}

/// The largest scale, at most 1, at which everything fits.
fn fit(charting: &Charting, backdrop: [u32; 2], side: u32, gutter: u32) -> Option<f64> {
    let fits = |scale: f64| place(&sizes(charting, backdrop, scale, side - gutter), side, side, gutter).is_some();
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
pub(super) fn pack(charting: &Charting, backdrop: [u32; 2], max_side: u32) -> Option<Layout> {
    // The width is a power of two: a side in between limits the height only.
    let (side, max_side) = (1 << max_side.ilog2(), max_side / 4 * 4);
    let (wide, narrow) = (fit(charting, backdrop, side, GUTTERS[0]), || fit(charting, backdrop, side, GUTTERS[1]));
    let (scale, gutter) = match wide {
        Some(scale) if scale >= 1.0 => (scale, GUTTERS[0]),
        Some(scale) => narrow().filter(|n| *n > scale * WORTH).map_or((scale, GUTTERS[0]), |n| (n, GUTTERS[1])),
        None => match narrow() {
            Some(scale) => (scale, GUTTERS[1]),
            None => (fit(charting, backdrop, side, GUTTERS[2])?, GUTTERS[2]),
        },
    };
    let mut width = 64;
    while width <= side {
        let sizes = sizes(charting, backdrop, scale, side - gutter);
        if let Some(corners) = place(&sizes, width, max_side, gutter) {
            let (height, corners) = lower(&sizes, width, max_side, gutter, corners);
            return Some(finish(charting, &sizes, &corners, [width, height], scale, gutter));
        }
        width *= 2;
    }
    None
}

/// The least height, a multiple of 4, that bisection finds.
fn lower(sizes: &[[u32; 2]], width: u32, most: u32, gutter: u32, mut corners: Vec<[u32; 2]>) -> (u32, Vec<[u32; 2]>) {
    let (mut low, mut high) = (0, most.div_ceil(4));
    while high - low > 1 {
        let middle = (low + high) / 2;
        match place(sizes, width, middle * 4, gutter) {
            Some(found) => (high, corners) = (middle, found),
            None => low = middle,
        }
    }
    (high * 4, corners)
}

fn finish(charting: &Charting, sizes: &[[u32; 2]], corners: &[[u32; 2]], [width, height]: [u32; 2], scale: f64, gutter: u32) -> Layout {
    let rects: Vec<[u32; 4]> = sizes.iter().zip(corners).map(|([w, h], [x, y])| [*x, *y, x + w, y + h]).collect();
    let places = charting.charts.iter().zip(&rects[1..]).map(|(c, &rect)| {
        // Each direction is stretched to whole texels: the outline of a rectangle is then the chart's own.
        let step = [0, 1].map(|k| f64::from(rect[k + 2] - rect[k]) / (c.hi[k] - c.lo[k]).max(1e-12 * c.hi[k].abs()).max(f64::MIN_POSITIVE));
        Place { rect, origin: [0, 1].map(|k| f64::from(rect[k]) - c.lo[k] * step[k]), step }
    });
    Layout { width, height, scale, gutter, backdrop: rects[0], places: places.collect() }
}
