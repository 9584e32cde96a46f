//! The curved path: Catmull-Rom through given points, looking at a second such curve.
//! Points come from scene files and built-in scenes; poses go to the G-buffer.

use super::{Path, Pose};
use glam::DVec3;
use std::ops::{Add, Mul, Sub};

/// The point at `s` in 0..=1 (clamped) of the uniform Catmull-Rom spline through `points`: point i of n lies at i / (n - 1).
/// Beyond its ends the curve continues by reflection; where the first and the last point are the same it is closed
/// and runs through them smoothly. One point is a curve that stands still; no point is the origin.
pub fn catmull_rom(points: &[DVec3], s: f64) -> DVec3 {
    let (Some(&first), Some(&last)) = (points.first(), points.last()) else { return DVec3::ZERO };
    let n = points.len();
    if n == 1 {
        return first;
    }
    let x = s.clamp(0.0, 1.0) * (n - 1) as f64;
    let i = (x as usize).min(n - 2);
    let t = x - i as f64;
    let closed = n > 2 && first == last;
    let (b, c) = (points[i], points[i + 1]);
    let a = match i {
        0 if closed => points[n - 2],
        0 => 2.0 * b - c,
        _ => points[i - 1],
    };
    let d = match points.get(i + 2) {
        Some(&d) => d,
        None if closed => points[1],
        None => 2.0 * c - b,
    };
    segment([a, b, c, d], t)
}

/// The point at `t` in 0..=1 between the inner two of four points (E. Catmull and R. Rom, "A class of local interpolating splines", 1974).
#[inline]
pub(crate) fn segment<V>([a, b, c, d]: [V; 4], t: f64) -> V
where
    V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V>,
{
    b + ((c - a) + ((a * 2.0 - b * 5.0 + c * 4.0 - d) + ((b - c) * 3.0 + d - a) * t) * t) * (0.5 * t)
}

/// Through points, looking at points.
#[derive(Clone, Debug)]
pub struct Spline {
    /// The eyes, world space; at least two.
    pub points: Vec<DVec3>,
    /// What the camera looks at, world space, spread over the same 0..=1; at least one, as many as there are eyes or not.
    pub look_at: Vec<DVec3>,
    /// The direction that points to the top of the picture; need not be a unit vector.
    pub up: DVec3,
    /// Vertical field of view, degrees.
    pub fov: f64,
}

impl Path for Spline {
    fn pose(&self, s: f64) -> Pose {
        Pose::look_at(catmull_rom(&self.points, s), catmull_rom(&self.look_at, s), self.up, self.fov)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_passes_its_points() {
        let points = [[0.0, 0.0, 0.0], [1.0, 3.0, 0.0], [4.0, -2.0, 1.0], [5.0, 5.0, 5.0]].map(DVec3::from_array);
        for (i, p) in points.iter().enumerate() {
            assert!((catmull_rom(&points, i as f64 / 3.0) - *p).length() < 1e-12);
        }
        // Uniform: the tangent at an inner point is half the chord of its neighbours.
        let h = 1e-6;
        let slope = (catmull_rom(&points, 1.0 / 3.0 + h) - catmull_rom(&points, 1.0 / 3.0 - h)) / (6.0 * h);
        assert!((slope - (points[2] - points[0]) / 2.0).length() < 1e-5, "{slope}");
    }

    #[test]
    fn two_points_are_a_line_and_one_stands_still() {
        let line = [DVec3::ZERO, DVec3::new(2.0, 4.0, 6.0)];
        assert!((catmull_rom(&line, 0.25) - DVec3::new(0.5, 1.0, 1.5)).length() < 1e-12);
        assert_eq!(catmull_rom(&line[1..], 0.3), line[1]);
    }

    #[test]
    fn a_closed_curve_has_no_corner_at_its_seam() {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]].map(DVec3::from_array);
        let h = 1e-7;
        let leaving = (catmull_rom(&p, h) - p[0]) / h;
        let arriving = (p[0] - catmull_rom(&p, 1.0 - h)) / h;
        assert!((leaving - arriving).length() < 1e-4, "{leaving} {arriving}");
    }
}
