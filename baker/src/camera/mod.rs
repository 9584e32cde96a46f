//! Camera paths: where the camera is at path parameter s, and the rays it casts.
//! Paths come from scene files, models and built-in scenes; rays go to the G-buffer.

mod animated;
mod line;
mod orbit;
mod spline;

pub use animated::{Animated, Channel, Interpolation, Link, Property};
pub use line::{Aim, Line};
pub use orbit::{Orbit, Pivot, bearing};
pub(crate) use spline::segment;
pub use spline::{Spline, catmull_rom};

use glam::DVec3;

/// A pinhole camera at one moment. `right`, `up` and `forward` are orthonormal and right-handed
/// (`right x up = -forward`), world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The focal point.
    pub eye: DVec3,
    /// Towards the right edge of the picture.
    pub right: DVec3,
    /// Towards the top edge of the picture.
    pub up: DVec3,
    /// Into the scene.
    pub forward: DVec3,
    /// Vertical field of view, degrees.
    pub fov: f64,
}

impl Pose {
    /// A pose at `eye` that looks at `target`; `up` need only not be parallel to the view.
    /// Where it is parallel (straight up or down), -Z or +X serves instead.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3, fov: f64) -> Self {
        let forward = (target - eye).try_normalize().unwrap_or(DVec3::NEG_Z);
        let right = [up, DVec3::NEG_Z, DVec3::X]
            .iter()
            .find_map(|u| {
                forward.cross(u.normalize_or_zero()).try_normalize().filter(|_| forward.cross(u.normalize_or_zero()).length() > 1e-6)
            })
            .unwrap_or(DVec3::X);
        Self { eye, right, up: right.cross(forward), forward, fov }
    }

    /// The unit direction of the ray through the continuous screen position (`x`, `y`) of a
    /// `width` x `height` screen: pixel (i, j) has its centre at (i + 0.5, j + 0.5), row 0 on top.
    pub fn direction(&self, width: u32, height: u32, x: f64, y: f64) -> DVec3 {
        let focal = 0.5 * f64::from(height) / libm::tan(0.5 * self.fov * core::f64::consts::PI / 180.0);
        (self.forward * focal + self.right * (x - 0.5 * f64::from(width)) + self.up * (0.5 * f64::from(height) - y)).normalize()
    }
}

/// A camera path: a pose for every s in 0..=1.
pub trait Path: Send + Sync {
    /// The pose at `s`; outside 0..=1 the path may clamp or continue.
    fn pose(&self, s: f64) -> Pose;
}
