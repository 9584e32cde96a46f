//! Measuring of charts: how dense they have to be, which way they lie best, how far they reach.
//! Samples come from the G-buffer; the figures go to `fold` and to the packing.

use super::blur::{Loss, Seen};
use super::charting::{COARSER, Chart, Charting, Density, Projection};
use crate::gbuffer::{BACKGROUND, Hits, Lens, Sample};
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// The share of a chart's pixels that is shown at the density asked for, at most: one close-up must not blow up the rest.
const SHARE: f64 = 0.9;
/// The share of a source image that charts fill.
const FILL: f64 = 0.7;
/// Directions tried over half a turn for the chart's smallest rectangle.
const TURNS: usize = 32;
/// Charts in all tables together, at most, while there are two tables: 3 kB each.
const TABLES: usize = 100_000;
/// As many chunks keep two dozen threads busy.
const MOST_CHUNKS: usize = 24;
/// Histogram bins: [`OCTAVE`] an octave of single-precision numbers from 2^-40 to 2^40.
const BINS: usize = 640;
const OCTAVE: usize = 8;
const FIRST_BIN: u32 = (127 - 40) << 3;

fn bin(density: f64) -> usize {
    ((density as f32).to_bits() >> 20).saturating_sub(FIRST_BIN).min(BINS as u32 - 1) as usize
}

fn bin_value(bin: usize) -> f64 {
    f64::from(f32::from_bits(((bin as u32 + FIRST_BIN) << 20) | (1 << 19)))
}

/// Axes of the plane with unit normal `n`: right, down and the normal as depth; level where the plane is not.
pub(super) fn axes(n: DVec3) -> [DVec3; 3] {
    let up = if n.y.abs() > 0.9 { DVec3::NEG_Z } else { DVec3::Y };
    let right = up.cross(n).try_normalize().unwrap_or(DVec3::X);
    [right, right.cross(n), n]
}

/// What the samples of one chart say.
#[derive(Clone)]
struct Figures {
    densities: Vec<u32>,
    reach: [f64; 2 * TURNS],
    hits: u64,
}

impl Figures {
    fn new() -> Self {
        Self { densities: vec![0; BINS], reach: [f64::NEG_INFINITY; 2 * TURNS], hits: 0 }
    }

    fn merge(&mut self, other: &Self) {
        self.hits += other.hits;
        self.densities.iter_mut().zip(&other.densities).for_each(|(a, b)| *a += b);
        self.reach.iter_mut().zip(other.reach).for_each(|(a, b)| *a = a.max(b));
    }

    /// Texels a unit that most of the chart's pixels ask for.
    fn closest(&self) -> f64 {
        let mut left = (SHARE * self.hits as f64) as u64;
        let of = |(i, &n): (usize, &u32)| {
            let here = u64::from(n);
            if here > left || (here == left && here > 0) {
                return Some(bin_value(i));
            }
            left -= here;
            None
        };
        self.densities.iter().enumerate().find_map(of).unwrap_or(1.0)
    }

    /// Texels a unit that are worth their bytes in a chart whose faces cover `area` square units: no more than most pixels ask for.
    fn density(&self, area: f64, wanted: &Density, loss: &Loss) -> f64 {
        let closest = self.closest();
        // Each step's cost to a pixel.
        let blurred: Vec<f64> = (0..BINS).map(|steps| loss.of(steps as f64 / OCTAVE as f64)).collect();
        let cost = |density: f64| {
            let lost = self.densities.iter().skip(bin(density)).zip(&blurred).map(|(&n, blurred)| f64::from(n) * blurred);
            area / FILL * density * density * wanted.texel + wanted.detail * lost.sum::<f64>()
        };
        let coarser = (0..=COARSER * OCTAVE).map(|steps| closest * libm::exp2(-(steps as f64) / OCTAVE as f64));
        coarser.min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(closest)
    }
}

/// Sets every chart's axes, density and bounds. Without what is `seen`, all charts have the density that most of their pixels ask for.
pub(super) fn measure(scene: &Scene, hits: &Hits, seen: Option<&Seen>, charting: &mut Charting, density: &Density, max_side: u32) {
    charting.flatten(scene);
    let turns: [[f64; 2]; TURNS] = std::array::from_fn(|k| {
        let angle = k as f64 * core::f64::consts::PI / TURNS as f64;
        [libm::cos(angle), libm::sin(angle)]
    });
    let frame_size = (hits.width * hits.height) as usize;
    // Few enough chunks to hold a table of charts each. Whatever they are, the sums are the same.
    let chunks = (TABLES / charting.charts.len().max(1)).clamp(2, MOST_CHUNKS);
    let chunk = (hits.frames as usize).div_ceil(chunks).max(1) * frame_size;
    let tables: Vec<Vec<Option<Box<Figures>>>> = hits
        .samples
        .par_chunks(chunk.max(1))
        .enumerate()
        .map(|(part, samples)| table(scene, charting, &turns, part * chunk / frame_size.max(1), samples.chunks(frame_size.max(1))))
        .collect();
    let areas = areas(charting);
    let merged = |chart: usize| {
        let mut figures = Figures::new();
        tables.iter().filter_map(|t| t[chart].as_ref()).for_each(|f| figures.merge(f));
        figures
    };
    let figures: Vec<Figures> = (0..charting.charts.len()).map(merged).collect();
    let closest: Vec<f64> = figures.iter().map(Figures::closest).collect();
    let losses = seen.map(|seen| seen.losses(charting, &closest));
    for (i, (chart, figures)) in charting.charts.iter_mut().zip(&figures).enumerate() {
        let loss = losses.as_ref().map(|losses| &losses[i]);
        let worth = loss.map_or(closest[i], |loss| figures.density(areas[i], density, loss));
        chart.loss = loss.map_or(1.0, |loss| loss.of(1.0));
        settle(chart, figures, &turns, [worth, closest[i]].map(|of| density.most * of), max_side);
    }
    charting.flatten(scene);
    snap(charting);
}

/// What some frames, from number `first` on, say about each chart; `None` about those that they do not see.
fn table<'s>(
    scene: &Scene,
    charting: &Charting,
    turns: &[[f64; 2]; TURNS],
    first: usize,
    frames: impl Iterator<Item = &'s [Sample]>,
) -> Vec<Option<Box<Figures>>> {
    let mut table: Vec<Option<Box<Figures>>> = vec![None; charting.charts.len()];
    for (number, frame) in (first..).zip(frames) {
        let lens = Lens::new(scene, number as u32);
        for s in frame.iter().filter(|s| s.surface != BACKGROUND) {
            let id = charting.faces.of[s.surface as usize] as usize;
            let face = &charting.faces.list[id];
            let figures = table[charting.chart_of[id] as usize].get_or_insert_with(|| Box::new(Figures::new()));
            let ray = face.point(s) - lens.eye;
            let (z, slant) = (ray.dot(lens.forward).max(1e-12), ray.dot(face.normal).abs());
            // Square root of the pixels a unit of area covers: f^2 cos / (z^3 / l).
            let chart = &charting.charts[charting.chart_of[id] as usize];
            let unit = match chart.projection {
                // Flattened lengths shrink with the distance from the view's eye.
                Projection::Point(eye, [_, _, back], near) => ((eye - face.point(s)).dot(back) / near).max(1e-3),
                _ => charting.stretch(id),
            };
            figures.densities[bin(unit * lens.focal * (slant / (z * z * z)).sqrt())] += 1;
            figures.hits += 1;
            let [u, v, _] = charting.flat(id, f64::from(s.b), f64::from(s.c));
            for (k, [x, y]) in turns.iter().enumerate() {
                let along = u * x + v * y;
                figures.reach[k] = figures.reach[k].max(along);
                figures.reach[TURNS + k] = figures.reach[TURNS + k].max(-along);
            }
        }
    }
    table
}

/// What the faces of each chart cover, flattened, square units.
fn areas(charting: &Charting) -> Vec<f64> {
    let mut areas = vec![0.0; charting.charts.len()];
    for (face, &chart) in charting.chart_of.iter().enumerate() {
        let [a, b, c] = charting.outline(face).map(|[x, y, _]| [x, y]);
        areas[chart as usize] += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs();
    }
    areas
}

/// Turns the chart into its smallest rectangle and sets its densities, what is worth its bytes and the finest, or as much as fits.
fn settle(chart: &mut Chart, figures: &Figures, turns: &[[f64; 2]; TURNS], densities: [f64; 2], max_side: u32) {
    let side = |k: usize| figures.reach[k] + figures.reach[TURNS + k];
    let area = |k: usize| side(k) * side(k + TURNS / 2);
    // Level charts give straight spans: another direction has to earn it.
    let best = (1..TURNS / 2).fold(0, |best, k| if area(k) < area(best) * if best == 0 { 0.92 } else { 1.0 } { k } else { best });
    if let Projection::Plane(axes) | Projection::Point(_, axes, _) = &mut chart.projection {
        let [x, y] = turns[best];
        let [u, v, n] = *axes;
        *axes = [u * x + v * y, v * x - u * y, n];
    }
    if let Projection::Unwrapped(map) = &mut chart.projection {
        let ([x, y], [u, v]) = (turns[best], *map);
        *map = [[0, 1].map(|k| u[k] * x + v[k] * y), [0, 1].map(|k| v[k] * x - u[k] * y)];
    }
    chart.hits = figures.hits;
    let (k, l) = (best, best + TURNS / 2);
    chart.lo = [-figures.reach[TURNS + k], -figures.reach[TURNS + l]];
    chart.hi = [figures.reach[k], figures.reach[l]];
    let longest = side(k).max(side(l)).max(f64::MIN_POSITIVE);
    chart.wanted = densities[0] * longest / f64::from(max_side);
    // A plane that runs from the camera to the horizon would fill any image.
    [chart.density, chart.finest] = densities.map(|density| density.min(f64::from(max_side) / longest).max(1e-9));
}

/// Extends bounds that end within two texels of the chart's faces to the faces' end: an outline that is seen is kept.
fn snap(charting: &mut Charting) {
    let mut boxes = vec![([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]); charting.charts.len()];
    for (corners, &chart) in charting.corners.iter().zip(&charting.chart_of) {
        let (lo, hi) = &mut boxes[chart as usize];
        for c in corners {
            for k in 0..2 {
                lo[k] = lo[k].min(c[k] / c[3]);
                hi[k] = hi[k].max(c[k] / c[3]);
            }
        }
    }
    for (chart, (lo, hi)) in charting.charts.iter_mut().zip(boxes) {
        let near = 2.0 / chart.density;
        for k in 0..2 {
            chart.lo[k] = if chart.lo[k] - lo[k] < near { lo[k] } else { chart.lo[k] - 0.25 * near };
            chart.hi[k] = if hi[k] - chart.hi[k] < near { hi[k] } else { chart.hi[k] + 0.25 * near };
        }
    }
}

/// Sets the bounds and hits of charts whose projection and density stand.
pub(super) fn bound(hits: &Hits, charting: &mut Charting) {
    let none = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0u64);
    let join = |(lo, hi, hits): &mut ([f64; 2], [f64; 2], u64), (other_lo, other_hi, other_hits): ([f64; 2], [f64; 2], u64)| {
        (*lo, *hi) = ([0, 1].map(|k| lo[k].min(other_lo[k])), [0, 1].map(|k| hi[k].max(other_hi[k])));
        *hits += other_hits;
    };
    let chunk = hits.samples.len().div_ceil(MOST_CHUNKS).max(1);
    let tables = hits.samples.par_chunks(chunk).map(|samples| {
        let mut table = vec![none; charting.charts.len()];
        for s in samples.iter().filter(|s| s.surface != BACKGROUND) {
            let id = charting.faces.of[s.surface as usize] as usize;
            let [u, v, _] = charting.flat(id, f64::from(s.b), f64::from(s.c));
            join(&mut table[charting.chart_of[id] as usize], ([u, v], [u, v], 1));
        }
        table
    });
    let mut bounds = vec![none; charting.charts.len()];
    tables.collect::<Vec<_>>().into_iter().for_each(|table| bounds.iter_mut().zip(table).for_each(|(all, part)| join(all, part)));
    for (chart, bounds) in charting.charts.iter_mut().zip(bounds) {
        (chart.lo, chart.hi, chart.hits) = bounds;
    }
    snap(charting);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many pixels that ask for so many texels a unit.
    fn seen(pixels: &[(u32, f64)]) -> Figures {
        let mut figures = Figures::new();
        for &(n, density) in pixels {
            figures.densities[bin(density)] += n;
            figures.hits += u64::from(n);
        }
        figures
    }

    #[test]
    fn texels_are_worth_what_they_show() {
        // Of one colour: a pixel's octaves count alone, squared.
        let plain = Loss::default();
        let of = |pixels: &[(u32, f64)], area: f64, detail: f64, texel: f64| {
            let wanted = Density { most: 1.0, detail: detail / plain.of(1.0), texel };
            libm::log2(seen(pixels).density(area, &wanted, &plain))
        };
        let about = |octaves: f64, expected: f64| assert!((octaves - expected).abs() <= 1.0 / OCTAVE as f64, "{octaves}, not {expected}");
        // All that was asked for, where detail is worth any bytes or is seen by many; no less than the coarsest, where nearly nobody does.
        about(of(&[(1000, 16.0)], 700.0, f64::INFINITY, 1.0), 4.0);
        about(of(&[(1_000_000_000, 16.0)], 700.0, 1.0, 1.0), 4.0);
        about(of(&[(10, 16.0)], 700.0, 1.0, 1.0), 4.0 - COARSER as f64);
        // One texel for each of a thousand pixels that see it: 1000/4^x + detail x^2 1000 is least at x where 4^x x = ln 4 / (2 detail).
        for octaves in [0.5, 1.0, 2.0] {
            let detail = libm::log(4.0) / (2.0 * octaves * libm::exp2(2.0 * octaves));
            about(of(&[(1000, 1.0)], 1000.0 * FILL, detail, 1.0), -octaves);
            // Texels of twice the bytes are worth it where detail is worth twice as much.
            about(of(&[(1000, 1.0)], 1000.0 * FILL, 2.0 * detail, 2.0), -octaves);
        }
        // Some that see it closer want more, but no more than if all did.
        let [far, mixed, close] =
            [[(1000, 1.0), (0, 4.0)], [(800, 1.0), (200, 4.0)], [(0, 1.0), (1000, 4.0)]].map(|p| of(&p, 1000.0, 1.0, 1.0));
        assert!(far < mixed && mixed < close, "{far} {mixed} {close}");
    }
}
