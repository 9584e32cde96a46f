//! Warps: inside a chart, texels move to where its detail is seen, along its two directions apart from each other.
//! Finished charts and samples come in; each chart gets an [`Axis`] for either direction.

use super::axis::{Axis, PIECES};
use super::charting::{Chart, Charting, FLAT, Projection};
use super::observe::NONE;
use crate::gbuffer::{BACKGROUND, Hits};
use rayon::prelude::*;

/// Histogram bins: 4 an octave of 2^-8 to 2^8.
const BINS: usize = 64;
const PER_OCTAVE: f64 = 4.0;
/// The share of a piece's pixels that is shown at the density asked for.
const SHARE: f64 = 0.9;
/// A piece seen by a smaller share of its chart's pixels asks for what the whole asks for.
const FEW: f64 = 1.0 / 64.0;
/// Pieces whose octaves deviate less than this from their mean are not worth a bend, which keys have to follow.
const UNEVEN: f64 = 1.0;
/// Charts seen by a smaller share of all pixels stay as they are: 1000 in 128 frames of 320x240.
const SMALL: f64 = 1000.0 / 9.8e6;
/// Octaves by which slopes differ from what they were, at most.
const MOST: f64 = 4.0;

/// What is seen of the pieces of both directions: how many pixels ask for how many texels a flattened length.
type Demand = [[[u32; BINS]; PIECES]; 2];

/// Moves texels inside charts to where their detail is seen. No chart takes more of them than before. Directions of flat charts, and those that
/// ask for about the same all along, are only stretched.
pub(crate) fn rewarp(hits: &Hits, charting: &mut Charting) {
    let demands = demands(hits, charting);
    let of = |chart: &mut Chart, demand: Option<&Demand>, deep: f64| {
        let copied = matches!(chart.projection, Projection::Texture);
        let demand = demand.filter(|_| !copied && (0..2).all(|k| chart.hi[k] - chart.lo[k] > 0.0))?;
        let flat = deep * chart.density < FLAT;
        let mut slopes = [0, 1].map(|k| slopes(&demand[k], flat));
        let mean = |s: &[f64; PIECES + 1]| (1..=PIECES).map(|i| 0.5 * (s[i - 1] + s[i])).sum::<f64>() / PIECES as f64;
        let less = 1.0 / (mean(&slopes[0]) * mean(&slopes[1])).max(1.0).sqrt();
        slopes.iter_mut().flatten().for_each(|slope| *slope *= less);
        let warp = [0, 1].map(|k| Axis::new([chart.lo[k], chart.hi[k]], slopes[k]));
        for (k, axis) in warp.iter().enumerate() {
            (chart.lo[k], chart.hi[k]) = (axis.of(chart.lo[k]), axis.of(chart.hi[k]));
        }
        Some(warp)
    };
    let deep = charting.deep();
    charting.warps =
        charting.charts.iter_mut().zip(&demands).zip(deep).map(|((chart, demand), deep)| of(chart, demand.as_deref(), deep)).collect();
}

/// The slopes at the knots of a direction: how many times as dense as the chart each piece has to be.
fn slopes(demand: &[[u32; BINS]; PIECES], flat: bool) -> [f64; PIECES + 1] {
    let pieces = demand.each_ref().map(|bins| {
        let total: u32 = bins.iter().sum();
        let mut left = SHARE * f64::from(total);
        let reached = |&n: &u32| {
            left -= f64::from(n);
            left < 0.0
        };
        let bin = bins.iter().position(reached).unwrap_or(BINS / 2);
        ((bin as f64 + 0.5 - 0.5 * BINS as f64) / PER_OCTAVE, f64::from(total))
    });
    let total = pieces.iter().map(|p| p.1).sum::<f64>().max(1.0);
    let mean = pieces.iter().map(|p| p.0 * p.1).sum::<f64>() / total;
    let variance = pieces.iter().map(|p| p.1 * (p.0 - mean) * (p.0 - mean)).sum::<f64>() / total;
    let even = flat || variance < UNEVEN * UNEVEN;
    let octaves = pieces.map(|(octaves, hits)| if even || hits < FEW * total { mean } else { octaves });
    let mut knots: [f64; PIECES + 1] = std::array::from_fn(|i| 0.5 * (octaves[i.saturating_sub(1)] + octaves[i.min(PIECES - 1)]));
    for _ in 0..2 {
        let old = knots;
        knots = std::array::from_fn(|i| 0.25 * (old[i.saturating_sub(1)] + 2.0 * old[i] + old[(i + 1).min(PIECES)]));
    }
    knots.map(|octaves| libm::exp2(octaves.clamp(-MOST, MOST)))
}

/// What the pixels of each chart ask for, from how far flattened coordinates run to the next pixel.
fn demands(hits: &Hits, charting: &Charting) -> Vec<Option<Box<Demand>>> {
    let (width, size) = (hits.width as usize, (hits.width * hits.height) as usize);
    let least = (SMALL * hits.samples.len() as f64) as u64;
    let chunk = (hits.frames as usize).div_ceil(8).max(1) * size;
    let tables: Vec<Vec<Option<Box<Demand>>>> = hits
        .samples
        .par_chunks(chunk.max(1))
        .map(|samples| {
            let mut table: Vec<Option<Box<Demand>>> = vec![None; charting.charts.len()];
            for frame in samples.chunks(size.max(1)) {
                let flats: Vec<(u32, [f64; 2])> = frame
                    .iter()
                    .map(|s| {
                        if s.surface == BACKGROUND {
                            return (NONE, [0.0; 2]);
                        }
                        let face = charting.faces.of[s.surface as usize] as usize;
                        let [u, v, _] = charting.flat(face, f64::from(s.b), f64::from(s.c));
                        (charting.chart_of[face], [u, v])
                    })
                    .collect();
                for (i, &(chart, here)) in flats.iter().enumerate() {
                    if chart == NONE || (i + 1) % width == 0 {
                        continue;
                    }
                    let (Some(right), Some(below)) = (flats.get(i + 1), flats.get(i + width)) else { continue };
                    let c = &charting.charts[chart as usize];
                    if right.0 != chart || below.0 != chart || c.hits < least {
                        continue;
                    }
                    let demand = table[chart as usize].get_or_insert_with(|| Box::new([[[0; BINS]; PIECES]; 2]));
                    for k in 0..2 {
                        let length = libm::hypot(right.1[k] - here[k], below.1[k] - here[k]) * c.density;
                        let piece = ((here[k] - c.lo[k]) / (c.hi[k] - c.lo[k]) * PIECES as f64).clamp(0.0, (PIECES - 1) as f64) as usize;
                        let bin = (0.5 * BINS as f64 - PER_OCTAVE * libm::log2(length.max(f64::MIN_POSITIVE))).clamp(0.0, (BINS - 1) as f64)
                            as usize;
                        demand[k][piece][bin] += 1;
                    }
                }
            }
            table
        })
        .collect();
    let mut sums: Vec<Option<Box<Demand>>> = vec![None; charting.charts.len()];
    for table in tables {
        for (sum, part) in sums.iter_mut().zip(table) {
            match (sum.as_mut(), part) {
                (Some(sum), Some(part)) => {
                    sum.iter_mut().flatten().flatten().zip(part.iter().flatten().flatten()).for_each(|(a, b)| *a += b)
                }
                (None, Some(part)) => *sum = Some(part),
                (_, None) => {}
            }
        }
    }
    sums
}
