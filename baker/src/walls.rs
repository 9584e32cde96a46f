//! Walls: where the camera goes through a surface on its way from frame to frame. Paths come with the scene, hits from the tracer; the report warns.

use crate::scene::Scene;
use crate::trace::Tracer;
use glam::DVec3;

/// Steps that a frame's way is cut into: paths bend.
const STEPS: u32 = 4;
/// A step longer than this many middling ones is a cut to another place, which may go through anything.
const CUT: f64 = 20.0;

/// The frames after which the camera goes through a surface before the next one is shown.
#[must_use]
pub fn crossed(scene: &Scene, tracer: &Tracer<'_>) -> Vec<u32> {
    let play = &scene.playback;
    let last = if play.looping { play.frames } else { play.frames.saturating_sub(1) };
    let pose = |frame: u32, step: u32| scene.camera.pose(play.parameter(f64::from(frame) + f64::from(step) / f64::from(STEPS)));
    let way = |frame: u32| pose(frame, 0).eye.distance(pose(frame, STEPS).eye);
    let mut ways: Vec<f64> = (0..last).map(way).collect();
    ways.sort_by(f64::total_cmp);
    let longest = CUT * ways.get(ways.len() / 2).copied().unwrap_or(0.0);
    let through = |frame: u32| {
        (0..STEPS).any(|step| {
            let [from, to] = [step, step + 1].map(|step| pose(frame, step).eye);
            let far = from.distance(to);
            let meets = |from: DVec3, to: DVec3| tracer.hit(from, (to - from) / far).is_some_and(|hit| hit.t < far);
            // A wall with one side, left through its back, is there all at once if the camera looks back at it.
            let back = || pose(frame, step + 1).forward.dot(from - to) > 0.0;
            far > 0.0 && (meets(from, to) || back() && meets(to, from))
        })
    };
    (0..last).filter(|&frame| way(frame) <= longest && through(frame)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Path, Pose};
    use crate::scene::builtin;
    use std::sync::Arc;

    /// Straight on along x, looking along x, or back.
    struct Straight([f64; 2], f64, f64);

    impl Path for Straight {
        fn pose(&self, s: f64) -> Pose {
            let eye = DVec3::new(self.0[0] + (self.0[1] - self.0[0]) * s, self.1, 0.03);
            Pose::look_at(eye, eye + self.2 * DVec3::X, DVec3::Y, 60.0)
        }
    }

    fn along(ends: [f64; 2], height: f64) -> Vec<u32> {
        let mut scene = builtin::build("pyramid").unwrap();
        (scene.playback.frames, scene.playback.looping) = (11, false);
        scene.camera = Arc::new(Straight(ends, height, 1.0));
        crossed(&scene, &Tracer::new(&scene))
    }

    #[test]
    fn a_wall_of_one_side_is_told_where_it_shows() {
        let mut scene = builtin::build("pyramid").unwrap();
        (scene.playback.frames, scene.playback.looping) = (11, false);
        scene.materials.iter_mut().for_each(|material| material.front = true);
        let through = [1.0, -1.0].map(|looks| {
            scene.camera = Arc::new(Straight([0.0, 4.0], 0.7, looks));
            crossed(&scene, &Tracer::new(&scene)).len()
        });
        assert_eq!(through, [0, 1], "out of it looking on, and looking back");
    }

    #[test]
    fn a_path_through_a_solid_is_told() {
        // In through one side, out through the opposite one: its foot is 1.7 from the middle, and it is 2.3 high.
        let through = along([-4.0, 4.0], 0.7);
        assert!(through.len() == 2 && through[0] < 5 && through[1] >= 5, "{through:?}");
        assert!(along([-4.0, 4.0], 2.5).is_empty(), "above it");
        assert!(along([2.0, 6.0], 0.7).is_empty(), "beside it");
    }
}
