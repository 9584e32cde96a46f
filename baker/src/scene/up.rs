//! Models that stand another way up than the world: which of their axes points up, and turning them until it does.
//! Called by `loader` once a model is read.

use crate::camera::{Path, Pose};
use glam::{DVec3, Vec3};
use std::str::FromStr;

/// The axis of a model that points up. The world's is +Y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// +X.
    X,
    /// -X.
    MinusX,
    /// +Y, as in glTF.
    #[default]
    Y,
    /// -Y.
    MinusY,
    /// +Z, as in most files of CAD programs, scanners and printers. What looks along +Y in the file then looks along -Z.
    Z,
    /// -Z.
    MinusZ,
}

impl FromStr for Up {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.to_ascii_lowercase().as_str() {
            "x" | "+x" => Ok(Self::X),
            "-x" => Ok(Self::MinusX),
            "y" | "+y" => Ok(Self::Y),
            "-y" => Ok(Self::MinusY),
            "z" | "+z" => Ok(Self::Z),
            "-z" => Ok(Self::MinusZ),
            _ => Err(format!("found \"{text}\"; expected the model's axis that points up: x, y, z, -x, -y or -z")),
        }
    }
}

impl Up {
    /// What `v` of the model is in the world: a turn by quarters, so exact.
    pub fn turn(self, v: DVec3) -> DVec3 {
        match self {
            Self::X => DVec3::new(-v.y, v.x, v.z),
            Self::MinusX => DVec3::new(v.y, -v.x, v.z),
            Self::Y => v,
            Self::MinusY => DVec3::new(-v.x, -v.y, v.z),
            Self::Z => DVec3::new(v.x, v.z, -v.y),
            Self::MinusZ => DVec3::new(v.x, -v.z, v.y),
        }
    }

    /// The same for shading normals.
    pub(super) fn turn_normal(self, v: Vec3) -> Vec3 {
        self.turn(v.as_dvec3()).as_vec3()
    }
}

/// A path of a model's own camera, turned with the model.
pub(super) struct Along<P> {
    /// The path as the model has it.
    pub path: P,
    /// The model's axis that points up.
    pub up: Up,
}

impl<P: Path> Path for Along<P> {
    fn pose(&self, s: f64) -> Pose {
        let Pose { eye, right, up, forward, fov } = self.path.pose(s);
        let turn = |v| self.up.turn(v);
        Pose { eye: turn(eye), right: turn(right), up: turn(up), forward: turn(forward), fov }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_comes_to_point_up_and_nothing_is_mirrored() {
        let axes = [("x", DVec3::X), ("-x", DVec3::NEG_X), ("y", DVec3::Y), ("-Y", DVec3::NEG_Y), ("+z", DVec3::Z), ("-z", DVec3::NEG_Z)];
        for (name, axis) in axes {
            let up: Up = name.parse().unwrap();
            assert_eq!(up.turn(axis), DVec3::Y, "{name}");
            assert_eq!(up.turn(DVec3::X).cross(up.turn(DVec3::Y)), up.turn(DVec3::Z), "{name}");
        }
        assert!("w".parse::<Up>().unwrap_err().contains("expected the model's axis"));
    }
}
