//! Scenes that are hard on time: motion that jumps, stops, turns about, or runs along the texels.
//! Made by `build`, but for those with a seam or a slit, which are built-in ones; listed, with the reasons, in `super`.

use super::build::{Build, FRAMES, SIZE, look, orbit, town, town_path};
use crate::scenes;
use cubist_baker::camera::{Path, Pose};
use cubist_baker::scene::Scene;
use glam::DVec3;
use std::sync::Arc;

/// The frame at which a camera stops.
pub const STOP: u32 = 12;

/// A cut: half-way the camera stands elsewhere.
pub fn a_cut() -> Scene {
    town().finish("a-cut", |s| if s < 0.5 { town_path(s) } else { orbit(DVec3::new(0.0, 0.6, 0.0), 130.0 + 20.0 * s, 5.0, 3.0) })
}

/// A camera that stands still.
pub fn a_standing_camera() -> Scene {
    town().finish("a-standing-camera", |_| town_path(0.4))
}

/// A camera that goes along, stops at once in the middle of a key interval, and stands.
pub fn a_camera_that_stops() -> Scene {
    town().finish("a-camera-that-stops", |s| town_path((s * f64::from(FRAMES - 1)).min(STOP.into()) / 6.0 - 1.0))
}

/// A camera that turns about within one key interval, and stands before and after.
pub fn half_a_turn_between_two_keys() -> Scene {
    let mut build = town();
    build.board(1, DVec3::new(0.0, 2.0, -8.0), [20.0, 12.0]);
    build.board(2, DVec3::new(0.0, 2.0, 8.0), [20.0, 12.0]);
    build.finish("half-a-turn-between-two-keys", |s| {
        let eye = DVec3::new(3.0, 1.5, 0.5);
        let turned = ((s * f64::from(FRAMES - 1) - 8.0) / 8.0).clamp(0.0, 1.0);
        look(eye, eye + orbit(DVec3::ZERO, 180.0 * turned, 1.0, 0.1).forward)
    })
}

/// A wall with a texel a pixel that moves by exactly a pixel a frame, along its rows of texels.
pub fn along_rows_of_texels() -> Scene {
    let mut build = Build::default();
    build.board(0, DVec3::ZERO, [128.0, 96.0]);
    build.board(1, DVec3::new(10.0, 3.0, 8.0), [20.0, 18.0]);
    build.finish("along-rows-of-texels", |s| {
        let eye = DVec3::new(libm::round(f64::from(FRAMES - 1) * s), 0.0, 48.0);
        look(eye, eye + DVec3::NEG_Z)
    })
}

/// A built-in scene at the size of the others.
fn builtin(name: &str) -> Scene {
    scenes::reduced(name, SIZE, FRAMES).unwrap_or_else(|_| Build::default().finish(name, town_path))
}

/// A ring whose flattening ends where it begins, the camera going round with it.
pub fn around_a_ring() -> Scene {
    Scene { name: "around-a-ring".into(), ..builtin("torus") }
}

/// Another path, from its end to its beginning.
struct Back(Arc<dyn Path>);

impl Path for Back {
    fn pose(&self, s: f64) -> Pose {
        self.0.pose(1.0 - s)
    }
}

/// The same the other way round.
pub fn around_a_ring_and_back() -> Scene {
    let scene = builtin("torus");
    Scene { name: "around-a-ring-and-back".into(), camera: Arc::new(Back(scene.camera.clone())), ..scene }
}

/// A gateway whose vault is flattened along a slit.
pub fn a_gateway() -> Scene {
    Scene { name: "a-gateway".into(), ..builtin("arch") }
}
