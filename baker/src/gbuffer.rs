//! The G-buffer: what every pixel of every frame sees.
//! Rays come from the camera path, hits from [`Tracer`]; hits go to charting, and come back as labels and
//! source-image coordinates for the sheets and the fit.

use crate::scene::Scene;
use crate::trace::{PACKET, Tracer};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The surface number of a ray that leaves the scene.
pub const BACKGROUND: u32 = u32::MAX;

/// What moves farther than this from one frame to the next, texels, is another place.
pub(crate) const ANOTHER: f32 = 32.0;

/// From one place in the source image to another.
pub(crate) fn difference([a, b]: [f32; 2], [c, d]: [f32; 2]) -> [f32; 2] {
    [c - a, d - b]
}

/// How far a difference leads, texels.
pub(crate) fn size([u, v]: [f32; 2]) -> f32 {
    u.abs().max(v.abs())
}

/// The rays of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    /// The focal point.
    pub eye: DVec3,
    /// Unit vector into the scene.
    pub forward: DVec3,
    /// Distance of the screen in pixels.
    pub focal: f64,
    right: DVec3,
    up: DVec3,
    half: [f64; 2],
}

impl Lens {
    /// The lens of frame `frame`; its rays equal those of [`crate::camera::Pose::direction`].
    pub fn new(scene: &Scene, frame: u32) -> Self {
        Self::at(scene, f64::from(frame))
    }

    /// The lens at a moment between frames.
    pub fn at(scene: &Scene, frame: f64) -> Self {
        let play = &scene.playback;
        let pose = scene.camera.pose(play.parameter(frame));
        let focal = 0.5 * f64::from(play.height) / libm::tan(0.5 * pose.fov * core::f64::consts::PI / 180.0);
        let half = [0.5 * f64::from(play.width), 0.5 * f64::from(play.height)];
        Self { eye: pose.eye, forward: pose.forward, focal, right: pose.right, up: pose.up, half }
    }

    /// The direction through the continuous screen position (`x`, `y`), not normalised: its depth is `focal`.
    #[inline]
    pub fn ray(&self, x: f64, y: f64) -> DVec3 {
        self.forward * self.focal + self.right * (x - self.half[0]) + self.up * (self.half[1] - y)
    }

    /// The unit direction through the continuous screen position (`x`, `y`).
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        self.ray(x, y).normalize()
    }

    /// The screen rectangle x0, y0, x1, y1 outside which no ray meets the box `lo`..`hi`.
    fn reach(&self, [lo, hi]: [DVec3; 2]) -> [f64; 4] {
        let mut rect = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for i in 0..8 {
            let pick = |bit: i32, lo: f64, hi: f64| if i & bit == 0 { lo } else { hi };
            let d = DVec3::new(pick(1, lo.x, hi.x), pick(2, lo.y, hi.y), pick(4, lo.z, hi.z)) - self.eye;
            let z = d.dot(self.forward);
            if z < 1e-3 * d.length() {
                return [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
            }
            let (x, y) = (self.half[0] + self.focal * d.dot(self.right) / z, self.half[1] - self.focal * d.dot(self.up) / z);
            rect = [rect[0].min(x - 1.0), rect[1].min(y - 1.0), rect[2].max(x + 1.0), rect[3].max(y + 1.0)];
        }
        rect
    }
}

/// What one ray hits: 12 bytes, since a bake holds one for every pixel of every frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Twice the triangle, plus one for the back side where the side matters; [`BACKGROUND`] for none.
    pub surface: u32,
    /// Barycentric weight of the second corner.
    pub b: f32,
    /// Barycentric weight of the third corner.
    pub c: f32,
}

impl Sample {
    /// The point that is hit; the sample is not [`BACKGROUND`].
    #[must_use]
    pub fn point(&self, scene: &Scene) -> DVec3 {
        let [a, b, c] = scene.triangles[(self.surface / 2) as usize].position;
        a + (b - a) * f64::from(self.b) + (c - a) * f64::from(self.c)
    }

    /// The unit normal of the triangle that is hit, by the order of its corners; zero for a degenerate one. The sample is not [`BACKGROUND`].
    #[must_use]
    pub fn normal(&self, scene: &Scene) -> DVec3 {
        let [a, b, c] = scene.triangles[(self.surface / 2) as usize].position;
        (b - a).cross(c - a).normalize_or_zero()
    }
}

/// One [`Sample`] at the centre of every pixel of every frame.
pub struct Hits {
    /// Pixels a row.
    pub width: u32,
    /// Rows a frame.
    pub height: u32,
    /// Number of frames.
    pub frames: u32,
    /// Frame-major, row-major.
    pub samples: Vec<Sample>,
}

impl Hits {
    /// Casts all rays; the same samples on any number of threads. `progress` hears (rays done, rays in all).
    pub fn cast(scene: &Scene, tracer: &Tracer<'_>, progress: &(dyn Fn(u64, u64) + Sync)) -> Self {
        let (width, height, frames) = (scene.playback.width, scene.playback.height, scene.playback.frames);
        let row = width as usize;
        let total = u64::from(width) * u64::from(height) * u64::from(frames);
        let bounds = tracer.bounds();
        let lenses: Vec<(Lens, [f64; 4])> = (0..frames).map(|f| Lens::new(scene, f)).map(|lens| (lens, lens.reach(bounds))).collect();
        let sided: Vec<bool> = scene.materials.iter().map(|m| !scene.lights.is_empty() && !m.unlit).collect();
        let mut samples = vec![Sample { surface: BACKGROUND, b: 0.0, c: 0.0 }; total as usize];
        let done = AtomicU64::new(0);
        samples.par_chunks_mut(row.max(1)).enumerate().for_each(|(line, out)| {
            let (lens, [x0, y0, x1, y1]) = &lenses[line / height as usize];
            let y = (line % height as usize) as f64 + 0.5;
            let columns =
                if y < *y0 || y > *y1 { 0..0 } else { (x0.clamp(0.0, row as f64) as usize)..(x1.clamp(0.0, row as f64).ceil() as usize) };
            for first in columns.clone().step_by(PACKET) {
                // Past the end of the row the last ray is cast again.
                let column = |at: usize| (first + at).min(columns.end - 1);
                let hits = tracer.hits(lens.eye, &std::array::from_fn(|at| lens.ray(column(at) as f64 + 0.5, y)));
                for (sample, hit) in out[first..columns.end].iter_mut().zip(hits) {
                    let Some(hit) = hit else { continue };
                    let material = scene.triangles[hit.triangle as usize].material as usize;
                    let side = u32::from(hit.back && sided.get(material).copied().unwrap_or(false));
                    *sample = Sample { surface: hit.triangle * 2 + side, b: hit.bary[0] as f32, c: hit.bary[1] as f32 };
                }
            }
            let now = done.fetch_add(row as u64, Ordering::Relaxed) + row as u64;
            if line % 32 == 0 || now == total {
                progress(now, total);
            }
        });
        Self { width, height, frames, samples }
    }
}

/// Where every pixel of every frame falls in the source image. The coordinates are shared between a buffer and its copies.
#[derive(Clone)]
pub struct GBuffer {
    /// Pixels a row.
    pub width: u32,
    /// Rows a frame.
    pub height: u32,
    /// Number of frames.
    pub frames: u32,
    /// The label; 0 is the background. Frame-major, row-major.
    pub label: Vec<u16>,
    /// Coordinates in texels: texel (i, j) covers [i, i + 1) x [j, j + 1). Same order as the labels.
    pub uv: Arc<Vec<[f32; 2]>>,
}

impl GBuffer {
    /// A share of all pixels, `percent`, as a share of those that show more than the backdrop, at most 100 %.
    #[must_use]
    pub fn of_seen(&self, percent: f64) -> f64 {
        let seen = self.label.iter().filter(|&&label| label != 0).count();
        (percent * self.label.len() as f64 / seen.max(1) as f64).min(100.0)
    }
}
