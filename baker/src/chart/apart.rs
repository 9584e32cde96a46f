//! Apart: a chart of which two thin parts are seen close beside each other, with something farther away between them, is cut in two between them: where
//! a cell shows two rods of a lattice, the outline of one label cannot be that of both.
//! Charts come flattened and without folds; more of them go on to be measured.

use super::charting::Charting;
use super::observe::{Links, NONE};
use crate::gbuffer::{BACKGROUND, Hits, Lens, Sample};
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// Pixels between two parts, at most.
const REACH: usize = 6;
/// Such pairs of pixels that a chart has at least to be cut: in parts of its pixels, and of all: 300 in 128 frames of 320x240.
const SHARE: f64 = 0.03;
const FEW: f64 = 300.0 / 9.8e6;
/// The share of them that a cut has to tell apart, beyond what it costs,
const TOLD: f64 = 0.3;
/// which is this much for each pair of neighbouring pixels that it runs between.
const SEAM: f64 = 1.0;
/// Cuts of a chart, at most, one after the other.
const CUTS: usize = 6;
/// Turns of the power iteration that finds the way across.
const TURNS: usize = 32;

/// Two pixels that show parts of one chart beside each other.
#[derive(Clone, Copy)]
struct Pair {
    faces: [u32; 2],
    points: [DVec3; 2],
}

/// A chart, or a part of one, that may have to be cut.
struct Piece {
    chart: u32,
    faces: Vec<u32>,
    pairs: Vec<Pair>,
    /// How often it still may be.
    cuts: usize,
}

/// Cuts charts; returns whether there were any to cut.
pub(super) fn split(scene: &Scene, hits: &Hits, charting: &mut Charting, links: &Links) -> bool {
    let before = charting.charts.len();
    let piece = |(chart, faces)| Piece { chart, faces, pairs: Vec::new(), cuts: CUTS };
    let mut pieces: Vec<Piece> = (0u32..).zip(charting.members()).map(piece).collect();
    for (chart, pair) in pairs(scene, hits, charting) {
        pieces[chart as usize].pairs.push(pair);
    }
    let few = FEW * hits.samples.len() as f64;
    while let Some(Piece { chart, faces, pairs, cuts }) = pieces.pop() {
        if cuts == 0 || (pairs.len() as f64) < few.max(SHARE * charting.seen(&faces) as f64) {
            continue;
        }
        let Some((axis, value)) = between(charting, links, &faces, &pairs) else { continue };
        let beyond = |face: u32| along(charting, face, axis) > value;
        let of = |side: bool| -> (Vec<u32>, Vec<Pair>) {
            let faces = faces.iter().copied().filter(|&face| beyond(face) == side);
            let pairs = pairs.iter().copied().filter(|pair| pair.faces.map(beyond) == [side; 2]);
            (faces.collect(), pairs.collect())
        };
        let [near, far] = [of(false), of(true)];
        let other = charting.take_out(chart, &far.0);
        for (chart, (faces, pairs)) in [(chart, near), (other, far)] {
            pieces.push(Piece { chart, faces, pairs, cuts: cuts - 1 });
        }
    }
    charting.charts.len() > before
}

/// Where a face lies along a way.
fn along(charting: &Charting, face: u32, axis: DVec3) -> f64 {
    charting.faces.list[face as usize].middle().dot(axis)
}

/// Where to cut a piece of these `faces`: a way across, and how far along it; `None` where no cut tells enough of the `pairs` apart.
fn between(charting: &Charting, links: &Links, faces: &[u32], pairs: &[Pair]) -> Option<(DVec3, f64)> {
    // The way that most of them lie apart: the first principal axis of their differences.
    let mut axis = DVec3::new(0.48, 0.64, 0.6);
    for _ in 0..TURNS {
        let ways = pairs.iter().map(|pair| (pair.points[1] - pair.points[0]).normalize_or_zero());
        axis = ways.map(|way| way * way.dot(axis)).sum::<DVec3>().normalize_or(axis);
    }
    // Where what a cut gains and costs begins and ends along it.
    let mut events: Vec<(f64, f64)> = Vec::new();
    let mut span = |[a, b]: [u32; 2], worth: f64| {
        let [a, b] = [a, b].map(|face| along(charting, face, axis));
        events.extend([(a.min(b), worth), (a.max(b), -worth)]);
    };
    pairs.iter().for_each(|pair| span(pair.faces, 1.0));
    for &face in faces {
        let chart = charting.chart_of[face as usize];
        let others = links.of(face).iter().filter(|(other, _)| *other > face && charting.chart_of[*other as usize] == chart);
        others.for_each(|&(other, pixels)| span([face, other], -SEAM * f64::from(pixels)));
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let (mut sum, mut best) = (0.0, (0.0, 0.0));
    for two in events.windows(2) {
        sum += two[0].1;
        if sum > best.0 && two[0].0 < two[1].0 {
            best = (sum, 0.5 * (two[0].0 + two[1].0));
        }
    }
    (best.0 > TOLD * pairs.len() as f64).then_some((axis, best.1))
}

/// All pairs of pixels, with their charts: what lies between two is of no chart or another one, and farther away.
fn pairs(scene: &Scene, hits: &Hits, charting: &Charting) -> Vec<(u32, Pair)> {
    let (width, height) = (hits.width as usize, hits.height as usize);
    let frames: Vec<Vec<(u32, Pair)>> = hits
        .samples
        .par_chunks((width * height).max(1))
        .enumerate()
        .map(|(frame, samples)| {
            let look = Look { charting, eye: Lens::new(scene, frame as u32).eye, samples };
            let rows = (0..height).map(|y| (0..width).map(|x| y * width + x).collect::<Vec<_>>());
            let columns = (0..width).map(|x| (0..height).map(|y| y * width + x).collect());
            rows.chain(columns).flat_map(|line| look.pairs(&line)).collect()
        })
        .collect();
    frames.concat()
}

/// Looks along the lines of pixels of a frame.
struct Look<'a> {
    charting: &'a Charting,
    eye: DVec3,
    samples: &'a [Sample],
}

impl Look<'_> {
    fn face(&self, pixel: usize) -> Option<u32> {
        let surface = self.samples[pixel].surface;
        (surface != BACKGROUND).then(|| self.charting.faces.of[surface as usize])
    }

    fn chart(&self, pixel: usize) -> u32 {
        self.face(pixel).map_or(NONE, |face| self.charting.chart_of[face as usize])
    }

    fn point(&self, pixel: usize) -> Option<(u32, DVec3)> {
        self.face(pixel).map(|face| (face, self.charting.faces.list[face as usize].point(&self.samples[pixel])))
    }

    fn pairs(&self, line: &[usize]) -> Vec<(u32, Pair)> {
        let mut pairs = Vec::new();
        for (at, &from) in line.iter().enumerate() {
            let (chart, ahead) = (self.chart(from), &line[at + 1..]);
            // The end of a run of pixels of the chart, and the beginning of the next.
            let next = ahead.iter().take(REACH + 1).position(|&pixel| self.chart(pixel) == chart);
            let Some(gap) = next.filter(|&gap| chart != NONE && gap > 0) else { continue };
            let (Some((a, p)), Some((b, q))) = (self.point(from), self.point(ahead[gap])) else { continue };
            let far = p.distance(self.eye).max(q.distance(self.eye));
            if ahead[..gap].iter().all(|&pixel| self.point(pixel).is_none_or(|(_, point)| point.distance(self.eye) > far)) {
                pairs.push((chart, Pair { faces: [a, b], points: [p, q] }));
            }
        }
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Chart, Projection, observe};
    use super::*;
    use crate::camera::{Aim, Line};
    use crate::scene::{Background, Material, Playback, Triangle};
    use crate::trace::Tracer;
    use glam::{Vec2, Vec3};
    use std::sync::Arc;

    /// Upright rods two pixels wide, at these places from left to right and in depth.
    fn rods(places: &[[f64; 2]]) -> Scene {
        let triangle = |corners: [[f64; 2]; 3], [x, z]: [f64; 2]| Triangle {
            position: corners.map(|[across, y]| DVec3::new(x + across, y, z)),
            normal: [Vec3::ZERO; 3],
            uv: [Vec2::ZERO; 3],
            colour: [Vec3::ONE; 3],
            material: 0,
            island: None,
        };
        let (a, b, c, d) = ([-0.03, -0.9], [0.03, -0.9], [0.03, 0.9], [-0.03, 0.9]);
        let at = |x: f64| DVec3::new(x, 0.0, 4.0);
        Scene {
            name: "rods".into(),
            triangles: places.iter().flat_map(|&place| [[a, b, c], [a, c, d]].map(|corners| triangle(corners, place))).collect(),
            materials: vec![Material::default()],
            textures: [].into(),
            background: Background::Colour([32, 40, 48]),
            lights: Vec::new(),
            camera: Arc::new(Line { from: at(-0.2), to: at(0.2), aim: Aim::Direction(DVec3::NEG_Z), up: DVec3::Y, fov: 45.0 }),
            playback: Playback { width: 120, height: 90, frames: 9, fps: 30, looping: false },
            warnings: Vec::new(),
        }
    }

    /// The chart of each rod, where all were one.
    fn charts(places: &[[f64; 2]]) -> Vec<u32> {
        let scene = rods(places);
        let hits = Hits::cast(&scene, &Tracer::new(&scene), &|_, _| {});
        let (faces, links) = observe::observe(&scene, &hits, true);
        let projection = Projection::Plane([DVec3::X, DVec3::Y, DVec3::Z]);
        let charts = vec![Chart::new(projection, 1.0)];
        let chart_of = vec![0; faces.list.len()];
        let mut charting = Charting { faces, chart_of, corners: Vec::new(), charts, warps: Vec::new() };
        let cut = split(&scene, &hits, &mut charting, &links);
        assert_eq!(cut, charting.charts.len() > 1);
        let face = |rod: usize| [4 * rod, 4 * rod + 1].map(|surface| charting.faces.of[surface]).into_iter().find(|&face| face != NONE);
        (0..places.len()).map(|rod| charting.chart_of[face(rod).expect("it is seen") as usize]).collect()
    }

    #[test]
    fn rods_beside_each_other_are_told_apart() {
        let [front, back] = charts(&[[0.0, 0.2], [0.12, -0.2]])[..] else { panic!("two rods") };
        assert_ne!(front, back);
    }

    #[test]
    fn rods_far_apart_stay_together() {
        assert_eq!(charts(&[[-0.5, 0.0], [0.5, 0.0]]), [0, 0]);
    }
}
