//! Footprints: the texels that each chart shows something in, at a given scale. No two charts may share one.
//! Charts and samples come from the charting and the G-buffer; the masks go to the packing.

use super::grid::Grid;
use super::mask::Mask;
use super::place::Place;
use crate::chart::{Charting, Projection};
use crate::gbuffer::{BACKGROUND, Hits};
use crate::scene::Scene;
use crate::shade::is_hole;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// How far beyond an edge, as a barycentric weight, a texel's colour sample still is the face's: more than rounding makes of a turned chart.
const EDGE: f64 = 1e-7;
/// How close to a texel's edge, texels, a sample may come to lie on the other side when its chart lies elsewhere.
const CLOSE: f64 = 1.0 / 1024.0;
/// Faces of a chart that a thread draws at a time.
const FACES: usize = 1 << 12;

/// What footprints are made of.
pub(super) struct Footprints<'a> {
    pub scene: &'a Scene,
    pub hits: &'a Hits,
    pub charting: &'a Charting,
    members: Vec<Vec<u32>>,
}

/// Colour samples a texel of a chart has in each direction: one where texels are copied.
pub(super) fn fine(projection: &Projection, scale: f64) -> u32 {
    if matches!(projection, Projection::Texture) && scale >= 1.0 { 1 } else { 2 }
}

impl<'a> Footprints<'a> {
    pub fn new(scene: &'a Scene, hits: &'a Hits, charting: &'a Charting) -> Self {
        Self { scene, hits, charting, members: charting.members() }
    }

    /// The place of a chart on its own.
    fn place(&self, chart: usize, [width, height]: [u32; 2]) -> Place {
        let c = &self.charting.charts[chart];
        Place::new([0, 0, width, height], c.lo, c.hi, 0)
    }

    /// The texels whose colour samples the charts' faces cover, for charts of `sizes`.
    pub fn drawn(&self, sizes: &[[u32; 2]], scale: f64) -> Vec<Mask> {
        let of = |(chart, faces): (usize, &Vec<u32>)| {
            let (size, place) = (sizes[chart], self.place(chart, sizes[chart]));
            let fine = fine(&self.charting.charts[chart].projection, scale);
            let grid = Grid::new(self.charting, chart, place, fine);
            let drawn = |faces: &[u32]| {
                let mut mask = Mask::new(size[0], size[1]);
                for &face in faces {
                    let surface = self.charting.faces.list[face as usize].surface;
                    grid.each_sample(self.charting, face as usize, EDGE, |x, y, shares| {
                        let (x, y) = (x / fine, y / fine);
                        if !mask.has(x, y) && !is_hole(self.scene, surface / 2, self.charting.weights(face as usize, shares)) {
                            mask.set(x, y);
                        }
                    });
                }
                mask
            };
            faces.par_chunks(FACES).map(drawn).reduce_with(Mask::join).unwrap_or_else(|| Mask::new(size[0], size[1]))
        };
        self.members.par_iter().enumerate().map(of).collect()
    }

    /// Adds the texels that pixels see, to the charts' masks of each of some sizes: faces may be too thin for a colour sample.
    pub fn add_seen(&self, levels: &mut [Vec<Mask>]) {
        // The places of each chart alone, where its bits start there, and where they do at every level: many charts are the same size at several.
        let mut bits = 0;
        let mut alone: Vec<Vec<(Place, usize)>> = vec![Vec::new(); self.charting.charts.len()];
        let mut start = |chart: usize, mask: &Mask| {
            let size = [mask.width, mask.height];
            match alone[chart].last() {
                Some((last, start)) if last.size() == size => *start,
                _ => {
                    let start = bits;
                    alone[chart].push((self.place(chart, size), start));
                    bits += size[0] as usize * size[1] as usize;
                    start
                }
            }
        };
        let starts: Vec<Vec<usize>> =
            levels.iter().map(|masks| masks.iter().enumerate().map(|(chart, mask)| start(chart, mask)).collect()).collect();
        let seen: Vec<AtomicU64> = (0..bits.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        self.hits.samples.par_chunks(1 << 16).for_each(|samples| {
            for s in samples.iter().filter(|s| s.surface != BACKGROUND) {
                let face = self.charting.faces.of[s.surface as usize] as usize;
                let chart = self.charting.chart_of[face] as usize;
                let flat = self.charting.flat(face, f64::from(s.b), f64::from(s.c));
                for (place, start) in &alone[chart] {
                    mark(&seen, *start, place, flat);
                }
            }
        });
        for (masks, starts) in levels.iter_mut().zip(&starts) {
            masks.par_iter_mut().zip(starts).for_each(|(mask, &start)| {
                for i in 0..mask.width * mask.height {
                    let at = start + i as usize;
                    if seen[at / 64].load(Ordering::Relaxed) >> (at % 64) & 1 == 1 {
                        mask.set(i % mask.width, i / mask.width);
                    }
                }
            });
        }
    }
}

/// Sets the bits, from `start` on, of the texels that flattened coordinates may fall into in a chart that lies alone.
fn mark(seen: &[AtomicU64], start: usize, place: &Place, flat: [f64; 3]) {
    let (at, [_, _, w, h]) = (place.at(flat), place.rect);
    let texels = |k: usize, size: u32| {
        let texel = |v: f64| v.clamp(0.0, f64::from(size - 1)) as usize;
        texel(at[k] - CLOSE)..=texel(at[k] + CLOSE)
    };
    for y in texels(1, h) {
        for x in texels(0, w) {
            let i = start + y * w as usize + x;
            let (word, bit) = (&seen[i / 64], 1 << (i % 64));
            // Most texels are seen again and again: looking is cheaper than writing.
            if word.load(Ordering::Relaxed) & bit == 0 {
                word.fetch_or(bit, Ordering::Relaxed);
            }
        }
    }
}
