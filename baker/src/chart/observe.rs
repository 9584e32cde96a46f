//! What is seen: faces, how often, from which side, and which lie next to each other on the screen.
//! Samples come from the G-buffer; faces and links go to the growing of charts.

use crate::gbuffer::{BACKGROUND, Hits, Lens, Sample};
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};

/// Not a face, not a chart.
pub(crate) const NONE: u32 = u32::MAX;

/// A surface that at least one pixel sees.
#[derive(Clone)]
pub(crate) struct Face {
    /// Twice the triangle, plus one for its back.
    pub surface: u32,
    /// Pixels, over all frames, that see it.
    pub hits: u32,
    /// Unit normal towards the side it is mostly seen from; zero for a degenerate face.
    pub normal: DVec3,
    /// Unit vector to where it is seen from, the mean over its pixels.
    pub view: DVec3,
    /// Corners, world space.
    pub position: [DVec3; 3],
}

impl Face {
    /// Its centroid.
    pub fn middle(&self) -> DVec3 {
        (self.position[0] + self.position[1] + self.position[2]) / 3.0
    }

    pub fn point(&self, sample: &Sample) -> DVec3 {
        let (b, c) = (f64::from(sample.b), f64::from(sample.c));
        self.position[0] * (1.0 - b - c) + self.position[1] * b + self.position[2] * c
    }
}

/// All seen faces.
#[derive(Clone)]
pub(crate) struct Faces {
    /// In the order of their surfaces.
    pub list: Vec<Face>,
    /// The face of each surface; [`NONE`] if it is never seen.
    pub of: Vec<u32>,
}

/// Which faces continue each other across neighbouring pixels.
pub(crate) struct Links {
    start: Vec<u32>,
    to: Vec<(u32, u32)>,
}

impl Links {
    /// The neighbours of a face: (face, pairs of pixels).
    pub fn of(&self, face: u32) -> &[(u32, u32)] {
        &self.to[self.start[face as usize] as usize..self.start[face as usize + 1] as usize]
    }

    fn new(faces: usize, pairs: &[(u64, u32)]) -> Self {
        let ends = |key: u64| ((key >> 32) as u32, key as u32);
        let mut start = vec![0u32; faces + 1];
        for (key, _) in pairs {
            let (a, b) = ends(*key);
            start[a as usize + 1] += 1;
            start[b as usize + 1] += 1;
        }
        for i in 0..faces {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut to = vec![(0, 0); pairs.len() * 2];
        for &(key, weight) in pairs {
            let (a, b) = ends(key);
            for (from, other) in [(a, b), (b, a)] {
                to[next[from as usize] as usize] = (other, weight);
                next[from as usize] += 1;
            }
        }
        Self { start, to }
    }
}

/// Whether the surface goes on between two neighbouring pixels: a gap under 3 pixel footprints, or a
/// step out of either plane under 0.7.
fn continuous(lens: &Lens, faces: [&Face; 2], points: [DVec3; 2]) -> bool {
    let step = points[1] - points[0];
    let (gap, footprint) = (step.length(), points[0].distance(lens.eye) / lens.focal);
    if gap < 3.0 * footprint {
        return true;
    }
    let off = faces.map(|f| step.dot(f.normal).abs());
    let off = off[0].min(off[1]);
    gap < 40.0 * footprint && (off < 0.7 * footprint || off < 0.05 * gap)
}

/// Adds up the weights of equal keys of a sorted list.
fn merge(pairs: Vec<(u64, u32)>) -> Vec<(u64, u32)> {
    let mut out: Vec<(u64, u32)> = Vec::new();
    for (key, weight) in pairs {
        match out.last_mut() {
            Some(last) if last.0 == key => last.1 = last.1.saturating_add(weight),
            _ => out.push((key, weight)),
        }
    }
    out
}

/// Collects the faces, and with `linked` their links.
pub(crate) fn observe(scene: &Scene, hits: &Hits, linked: bool) -> (Faces, Links) {
    let counts: Vec<AtomicU32> = (0..scene.triangles.len() * 2).map(|_| AtomicU32::new(0)).collect();
    let frame_size = (hits.width * hits.height) as usize;
    hits.samples.par_chunks(frame_size.max(1)).for_each(|frame| {
        for s in frame.iter().filter(|s| s.surface != BACKGROUND) {
            counts[s.surface as usize].fetch_add(1, Ordering::Relaxed);
        }
    });
    let mut of = vec![NONE; counts.len()];
    let mut list = Vec::new();
    for (surface, count) in counts.iter().enumerate() {
        let hits = count.load(Ordering::Relaxed);
        if hits > 0 {
            of[surface] = list.len() as u32;
            let position = scene.triangles[surface / 2].position;
            let normal = (position[1] - position[0]).cross(position[2] - position[0]).normalize_or_zero();
            list.push(Face { surface: surface as u32, hits, normal, view: DVec3::ZERO, position });
        }
    }
    let faces = Faces { list, of };
    let views: Vec<Views> = faces.list.iter().map(|_| Views::default()).collect();
    let pairs: Vec<Vec<(u64, u32)>> = hits
        .samples
        .par_chunks(frame_size.max(1))
        .enumerate()
        .map(|(f, frame)| look(&Lens::new(scene, f as u32), hits.width as usize, frame, &faces, &views, linked))
        .collect();
    let mut pairs: Vec<(u64, u32)> = pairs.concat();
    pairs.par_sort_unstable();
    let links = Links::new(faces.list.len(), &merge(pairs));
    let Faces { mut list, of } = faces;
    for (face, views) in list.iter_mut().zip(views) {
        if views.side.into_inner() < 0 {
            face.normal = -face.normal;
        }
        face.view = DVec3::from_array(views.sum.map(|v| v.into_inner() as f64)).normalize_or(face.normal);
    }
    (Faces { list, of }, links)
}

/// Where a face is seen from. Whole numbers: sums do not depend on the order.
#[derive(Default)]
struct Views {
    /// Pixels that see its front less those that see its back.
    side: AtomicI64,
    /// The sum of unit vectors to the eye, 2^20ths.
    sum: [AtomicI64; 3],
}

impl Views {
    fn add(&self, to_eye: DVec3, normal: DVec3) {
        self.side.fetch_add(if to_eye.dot(normal) > 0.0 { 1 } else { -1 }, Ordering::Relaxed);
        for (sum, v) in self.sum.iter().zip(to_eye.normalize_or_zero().to_array()) {
            sum.fetch_add((v * f64::from(1 << 20)) as i64, Ordering::Relaxed);
        }
    }
}

/// One frame: votes for each face's side, and the pairs of faces that continue each other.
fn look(lens: &Lens, width: usize, frame: &[Sample], faces: &Faces, views: &[Views], linked: bool) -> Vec<(u64, u32)> {
    let mut pairs = Vec::new();
    let mut above: Vec<(u32, DVec3)> = vec![(NONE, DVec3::ZERO); width];
    for row in frame.chunks(width.max(1)) {
        let mut left = (NONE, DVec3::ZERO);
        for (sample, above) in row.iter().zip(&mut above) {
            if sample.surface == BACKGROUND {
                left = (NONE, DVec3::ZERO);
                *above = left;
                continue;
            }
            let id = faces.of[sample.surface as usize];
            let face = &faces.list[id as usize];
            let point = face.point(sample);
            views[id as usize].add(lens.eye - point, face.normal);
            if linked {
                for (other, at) in [left, *above] {
                    if other != NONE && other != id && continuous(lens, [face, &faces.list[other as usize]], [point, at]) {
                        pairs.push(((u64::from(id.min(other)) << 32) | u64::from(id.max(other)), 1));
                    }
                }
            }
            left = (id, point);
            *above = left;
        }
    }
    pairs.sort_unstable();
    merge(pairs)
}
