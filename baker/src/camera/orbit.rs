//! Paths in azimuth and elevation: round a target, or about a fixed focal point.
//! Angles come from scene files and built-in scenes, in degrees; poses go to the G-buffer.

use super::{Path, Pose};
use core::f64::consts::PI;
use glam::DVec3;

/// The unit vector with the given azimuth (from +Z towards +X) and elevation (towards +Y), degrees:
/// `(cos el sin az, sin el, cos el cos az)`.
pub fn bearing(azimuth: f64, elevation: f64) -> DVec3 {
    let (a, e) = (azimuth * PI / 180.0, elevation * PI / 180.0);
    DVec3::new(libm::cos(e) * libm::sin(a), libm::sin(e), libm::cos(e) * libm::cos(a))
}

/// The horizontal unit vector 90 degrees of azimuth further: the derivative of the bearing, defined at the poles too.
fn quarter(azimuth: f64) -> DVec3 {
    let a = azimuth * PI / 180.0;
    DVec3::new(libm::cos(a), 0.0, -libm::sin(a))
}

fn mix(range: [f64; 2], s: f64) -> f64 {
    range[0] + (range[1] - range[0]) * s
}

/// Round a target: `eye = target + radius * bearing(azimuth, elevation)`, looking at the target.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// What the camera looks at, world space.
    pub target: DVec3,
    /// Distance from the target, world units, above zero.
    pub radius: f64,
    /// Azimuth at s = 0 and at s = 1, degrees.
    pub azimuth: [f64; 2],
    /// Elevation at s = 0 and at s = 1, degrees, -90..=90.
    pub elevation: [f64; 2],
    /// The direction that points to the top of the picture; need not be a unit vector.
    pub up: DVec3,
    /// Vertical field of view, degrees.
    pub fov: f64,
}

impl Path for Orbit {
    fn pose(&self, s: f64) -> Pose {
        let azimuth = mix(self.azimuth, s);
        let out = bearing(azimuth, mix(self.elevation, s));
        let eye = self.target + out * self.radius;
        if self.up.normalize_or_zero() != DVec3::Y {
            return Pose::look_at(eye, self.target, self.up, self.fov);
        }
        // Taken from the angles, not from a cross product with +Y: straight overhead the picture must not spin.
        let right = quarter(azimuth);
        Pose { eye, right, up: right.cross(-out), forward: -out, fov: self.fov }
    }
}

/// About a fixed focal point: the view direction is `bearing(azimuth, elevation)`.
#[derive(Clone, Debug)]
pub struct Pivot {
    /// The focal point, world space.
    pub eye: DVec3,
    /// Azimuth of the view direction at s = 0 and at s = 1, degrees; 0 looks along +Z.
    pub azimuth: [f64; 2],
    /// Elevation of the view direction at s = 0 and at s = 1, degrees, -90..=90; above zero looks up.
    pub elevation: [f64; 2],
    /// The direction that points to the top of the picture; need not be a unit vector.
    pub up: DVec3,
    /// Vertical field of view, degrees.
    pub fov: f64,
}

impl Path for Pivot {
    fn pose(&self, s: f64) -> Pose {
        let azimuth = mix(self.azimuth, s);
        let forward = bearing(azimuth, mix(self.elevation, s));
        if self.up.normalize_or_zero() != DVec3::Y {
            return Pose::look_at(self.eye, self.eye + forward, self.up, self.fov);
        }
        let right = -quarter(azimuth);
        Pose { eye: self.eye, right, up: right.cross(forward), forward, fov: self.fov }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(a: DVec3, b: DVec3) {
        assert!((a - b).length() < 1e-12, "{a} is not {b}");
    }

    #[test]
    fn orbit_follows_its_formula_and_keeps_the_target_in_the_middle() {
        let orbit = Orbit {
            target: DVec3::new(1.0, 2.0, 3.0),
            radius: 4.0,
            azimuth: [0.0, 360.0],
            elevation: [20.0, 50.0],
            up: DVec3::Y,
            fov: 45.0,
        };
        for s in [0.0, 0.1, 0.25, 0.7, 1.0] {
            let (a, e): (f64, f64) = ((360.0 * s * PI / 180.0), ((20.0 + 30.0 * s) * PI / 180.0));
            let pose = orbit.pose(s);
            assert_near(pose.eye, orbit.target + 4.0 * DVec3::new(e.cos() * a.sin(), e.sin(), e.cos() * a.cos()));
            assert_near(pose.direction(320, 240, 160.0, 120.0), (orbit.target - pose.eye).normalize());
            let other = Pose::look_at(pose.eye, orbit.target, DVec3::Y, 45.0);
            assert_near(pose.right, other.right);
            assert_near(pose.up, other.up);
            assert_near(pose.right.cross(pose.up), -pose.forward);
        }
    }

    #[test]
    fn the_top_row_looks_up_and_the_right_column_right() {
        let pose = Orbit { target: DVec3::ZERO, radius: 5.0, azimuth: [0.0; 2], elevation: [0.0; 2], up: DVec3::Y, fov: 90.0 }.pose(0.0);
        assert_near(pose.eye, DVec3::new(0.0, 0.0, 5.0));
        assert!(pose.direction(100, 100, 50.0, 0.5).y > 0.7);
        assert!(pose.direction(100, 100, 50.0, 99.5).y < -0.7);
        assert!(pose.direction(100, 100, 99.5, 50.0).x > 0.7);
        // A vertical field of 90 degrees: the top edge is 45 degrees up, whatever the width.
        assert_near(pose.direction(300, 100, 150.0, 0.0), DVec3::new(0.0, 1.0, -1.0).normalize());
    }

    #[test]
    fn overhead_the_picture_follows_the_azimuth() {
        for sign in [1.0, -1.0] {
            let orbit = Orbit {
                target: DVec3::ZERO,
                radius: 1.0,
                azimuth: [30.0; 2],
                elevation: [89.999_9 * sign, 90.0 * sign],
                up: DVec3::Y,
                fov: 45.0,
            };
            let (before, at) = (orbit.pose(0.0), orbit.pose(1.0));
            assert!((before.up - at.up).length() < 1e-4, "{} {}", before.up, at.up);
            assert!((before.right - at.right).length() < 1e-4);
        }
    }

    #[test]
    fn pivot_stands_still_and_turns_about_up() {
        let pivot = Pivot { eye: DVec3::new(0.0, 2.0, 0.0), azimuth: [0.0, 90.0], elevation: [0.0, 90.0], up: DVec3::Y, fov: 60.0 };
        assert_near(pivot.pose(0.0).forward, DVec3::Z);
        assert_near(pivot.pose(0.0).right, DVec3::NEG_X);
        assert_near(pivot.pose(0.0).up, DVec3::Y);
        assert_near(pivot.pose(1.0).forward, DVec3::Y);
        assert_near(pivot.pose(0.4).eye, pivot.eye);
        let leaning = Pivot { up: DVec3::X, elevation: [0.0; 2], ..pivot };
        assert_near(leaning.pose(0.0).up, DVec3::X);
    }
}
