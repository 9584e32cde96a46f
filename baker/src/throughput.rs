//! Throughput: how fast rays are cast, beside the ray library alone with the same rays.
//! A scene comes from the command line; figures go back there.

use crate::gbuffer::{Hits, Lens};
use crate::scene::Scene;
use crate::trace::{Bare, Tracer};
use std::time::{Duration, Instant};

/// Rays per second, in millions, wall clock, on the current number of threads.
#[derive(Clone, Copy, Debug)]
pub struct Throughput {
    /// Rays cast for one measurement.
    pub rays: u64,
    /// The G-buffer stage as it is.
    pub ours: f64,
    /// obvhs with its own single-precision triangle test on the same rays, made beforehand.
    pub obvhs_alone: f64,
}

/// Measures the G-buffer stage against obvhs alone on at most 8 frames of the scene; the best of three runs each.
#[must_use]
pub fn measured(scene: &Scene) -> Throughput {
    let mut part = scene.clone();
    part.playback.frames = part.playback.frames.min(8);
    let (width, height, frames) = (part.playback.width, part.playback.height, part.playback.frames);
    let tracer = Tracer::new(&part);
    let rays = (0..frames).flat_map(|frame| {
        let lens = Lens::new(&part, frame);
        (0..height).flat_map(move |y| (0..width).map(move |x| (lens.eye, lens.direction(f64::from(x) + 0.5, f64::from(y) + 0.5))))
    });
    let mut all = Throughput { rays: u64::from(width) * u64::from(height) * u64::from(frames), ours: 0.0, obvhs_alone: 0.0 };
    let Some(mut alone) = Bare::new(&part, rays) else { return all };
    let rate = |time: Duration| all.rays as f64 / time.as_secs_f64().max(1e-9) / 1e6;
    for _ in 0..3 {
        let start = Instant::now();
        let hits = Hits::cast(&part, &tracer, &|_, _| {});
        let ours = rate(start.elapsed());
        drop(hits);
        let start = Instant::now();
        alone.cast(width as usize);
        let bare = rate(start.elapsed());
        (all.ours, all.obvhs_alone) = (all.ours.max(ours), all.obvhs_alone.max(bare));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn both_are_measured() {
        let mut scene = builtin::build("pyramid").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (16, 12, 9);
        let found = measured(&scene);
        assert!(found.rays == 16 * 12 * 8 && found.ours > 0.0 && found.obvhs_alone > 0.0, "{found:?}");
        scene.triangles.clear();
        assert_eq!(measured(&scene).ours, 0.0, "nothing to hit");
    }
}
