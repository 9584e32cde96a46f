//! The straight path: rigid translation with a fixed view direction, or towards a fixed point.
//! Points come from scene files and built-in scenes; poses go to the G-buffer.

use super::{Path, Pose};
use glam::DVec3;

/// Where a camera on a line looks.
#[derive(Clone, Copy, Debug)]
pub enum Aim {
    /// Always along this direction; need not be a unit vector.
    Direction(DVec3),
    /// Always at this point, world space.
    Point(DVec3),
}

/// From one point to another at constant speed.
#[derive(Clone, Debug)]
pub struct Line {
    /// The eye at s = 0, world space.
    pub from: DVec3,
    /// The eye at s = 1, world space.
    pub to: DVec3,
    /// Where it looks.
    pub aim: Aim,
    /// The direction that points to the top of the picture; need not be a unit vector.
    pub up: DVec3,
    /// Vertical field of view, degrees.
    pub fov: f64,
}

impl Path for Line {
    fn pose(&self, s: f64) -> Pose {
        let eye = self.from + (self.to - self.from) * s;
        let target = match self.aim {
            Aim::Direction(d) => eye + d,
            Aim::Point(p) => p,
        };
        Pose::look_at(eye, target, self.up, self.fov)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_line_never_turns() {
        let line = Line {
            from: DVec3::new(0.0, 2.0, 9.0),
            to: DVec3::new(4.0, 2.0, -9.0),
            aim: Aim::Direction(DVec3::new(0.0, 0.0, -2.0)),
            up: DVec3::Y,
            fov: 45.0,
        };
        assert_eq!(line.pose(0.5).eye, DVec3::new(2.0, 2.0, 0.0));
        assert_eq!(line.pose(0.0).forward, line.pose(1.0).forward);
        assert_eq!(line.pose(0.3).right, DVec3::X);
    }

    #[test]
    fn a_line_straight_down_still_has_a_frame() {
        let line = Line { from: DVec3::Y, to: DVec3::Y * 2.0, aim: Aim::Point(DVec3::ZERO), up: DVec3::Y, fov: 45.0 };
        let pose = line.pose(1.0);
        assert_eq!(pose.forward, DVec3::NEG_Y);
        assert!((pose.right.length() - 1.0).abs() < 1e-12 && (pose.up.length() - 1.0).abs() < 1e-12);
        assert_eq!(pose.up, DVec3::NEG_Z);
    }
}
