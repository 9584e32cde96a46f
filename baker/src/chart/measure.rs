//! Measuring of charts: how dense they have to be, which way they lie best, how far they reach.
//! Samples come from the G-buffer; the figures go to `fold` and to the packing.

use super::{Chart, Charting, Projection};
use crate::gbuffer::{BACKGROUND, Hits, Lens};
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// The share of a chart's pixels that is shown at the density asked for: one close-up must not blow up the rest.
const SHARE: f64 = 0.9;
/// Directions tried over half a turn for the chart's smallest rectangle.
const TURNS: usize = 32;
/// Charts in all tables together, at most, while there are two tables: 3 kB each.
const TABLES: usize = 100_000;
/// Histogram bins: 8 an octave of single-precision numbers from 2^-40 to 2^40.
const BINS: usize = 640;
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

    fn density(&self) -> f64 {
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
}

/// Sets every chart's axes, density (at most `density` texels a pixel) and bounds.
pub(super) fn measure(scene: &Scene, hits: &Hits, charting: &mut Charting, density: f64, max_side: u32) {
    charting.flatten(scene);
    let turns: [[f64; 2]; TURNS] = std::array::from_fn(|k| {
        let angle = k as f64 * core::f64::consts::PI / TURNS as f64;
        [libm::cos(angle), libm::sin(angle)]
    });
    let frame_size = (hits.width * hits.height) as usize;
    // As many chunks as keep two dozen threads busy, few enough to hold a table of charts each. Whatever they are, the sums are the same.
    let chunks = (TABLES / charting.charts.len().max(1)).clamp(2, 24);
    let chunk = (hits.frames as usize).div_ceil(chunks).max(1) * frame_size;
    let tables: Vec<Vec<Option<Box<Figures>>>> = hits
        .samples
        .par_chunks(chunk.max(1))
        .enumerate()
        .map(|(part, samples)| {
            let mut table: Vec<Option<Box<Figures>>> = vec![None; charting.charts.len()];
            for (i, frame) in samples.chunks(frame_size.max(1)).enumerate() {
                let lens = Lens::new(scene, (part * chunk / frame_size.max(1) + i) as u32);
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
        })
        .collect();
    for (i, chart) in charting.charts.iter_mut().enumerate() {
        let mut figures = Figures::new();
        tables.iter().filter_map(|t| t[i].as_ref()).for_each(|f| figures.merge(f));
        settle(chart, &figures, &turns, density, max_side);
    }
    charting.flatten(scene);
    snap(charting);
}

/// Turns the chart into its smallest rectangle and sets its density.
fn settle(chart: &mut Chart, figures: &Figures, turns: &[[f64; 2]; TURNS], density: f64, max_side: u32) {
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
    // A plane that runs from the camera to the horizon would fill any image.
    chart.density = (figures.density() * density).min(f64::from(max_side) / longest).max(1e-9);
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
    for chart in &mut charting.charts {
        (chart.lo, chart.hi, chart.hits) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0);
    }
    for s in hits.samples.iter().filter(|s| s.surface != BACKGROUND) {
        let id = charting.faces.of[s.surface as usize] as usize;
        let flat = charting.flat(id, f64::from(s.b), f64::from(s.c));
        let chart = &mut charting.charts[charting.chart_of[id] as usize];
        for ((lo, hi), v) in chart.lo.iter_mut().zip(&mut chart.hi).zip(flat) {
            *lo = lo.min(v);
            *hi = hi.max(v);
        }
        chart.hits += 1;
    }
    snap(charting);
}
