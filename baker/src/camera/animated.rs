//! The path of an animated camera: a chain of nodes, each with keyed translation, rotation and scale.
//! The chain comes from a model's loader; poses go to the G-buffer.

use super::{Path, Pose};
use glam::{DMat4, DQuat, DVec3, DVec4};

/// How values between two keys come about, as in glTF 2.0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The earlier key's value.
    Step,
    /// A straight mix; rotations turn at constant speed.
    Linear,
    /// Cubic Hermite; every key has an in-tangent, a value and an out-tangent, in this order.
    Cubic,
}

/// What a channel drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// Translation, x y z.
    Translation,
    /// Rotation, a quaternion x y z w.
    Rotation,
    /// Scale, x y z.
    Scale,
}

/// Keys of one property of one node.
#[derive(Clone, Debug)]
pub struct Channel {
    /// What it drives.
    pub property: Property,
    /// Between the keys.
    pub interpolation: Interpolation,
    /// Seconds, strictly increasing, at least one.
    pub times: Vec<f64>,
    /// One value a key, three with [`Interpolation::Cubic`].
    pub values: Vec<DVec4>,
}

impl Channel {
    /// The value at time `t`, seconds; before the first and after the last key theirs. Rotations are unit quaternions.
    pub fn sample(&self, t: f64) -> DVec4 {
        let cubic = self.interpolation == Interpolation::Cubic;
        let value = |key: usize| self.values.get(if cubic { 3 * key + 1 } else { key }).copied().unwrap_or(DVec4::W);
        let tangent = |key: usize, side: usize| self.values.get(3 * key + side).copied().unwrap_or(DVec4::ZERO);
        let next = self.times.partition_point(|&k| k <= t);
        let mixed = if next == 0 {
            value(0)
        } else if next >= self.times.len() {
            value(self.times.len().saturating_sub(1))
        } else {
            let (a, b) = (value(next - 1), value(next));
            let length = self.times[next] - self.times[next - 1];
            let u = (t - self.times[next - 1]) / length;
            match self.interpolation {
                Interpolation::Step => a,
                Interpolation::Linear if self.property == Property::Rotation => slerp(a, b, u),
                Interpolation::Linear => a + (b - a) * u,
                Interpolation::Cubic => {
                    let (u2, u3) = (u * u, u * u * u);
                    a * (2.0 * u3 - 3.0 * u2 + 1.0)
                        + tangent(next - 1, 2) * length * (u3 - 2.0 * u2 + u)
                        + b * (3.0 * u2 - 2.0 * u3)
                        + tangent(next, 0) * length * (u3 - u2)
                }
            }
        };
        if self.property == Property::Rotation { mixed.try_normalize().unwrap_or(DVec4::W) } else { mixed }
    }
}

/// Quaternions `u` of the way along the shorter arc.
fn slerp(a: DVec4, b: DVec4, u: f64) -> DVec4 {
    let dot = a.dot(b);
    let (b, dot) = if dot < 0.0 { (-b, -dot) } else { (b, dot) };
    // Closer than this the sine loses its digits, and a chord is as good as the arc.
    if dot > 1.0 - 1e-9 {
        return a + (b - a) * u;
    }
    let angle = libm::acos(dot);
    (a * libm::sin((1.0 - u) * angle) + b * libm::sin(u * angle)) / libm::sin(angle)
}

/// One node of the chain.
#[derive(Clone, Debug)]
pub struct Link {
    /// Its transform at rest.
    pub rest: DMat4,
    /// Translation, rotation and scale at rest, what channels leave alone; not used without channels.
    pub parts: (DVec3, DQuat, DVec3),
    /// What moves it; at most one for each property.
    pub channels: Vec<Channel>,
}

impl Link {
    /// The local transform at time `t`, seconds.
    pub fn at(&self, t: f64) -> DMat4 {
        if self.channels.is_empty() {
            return self.rest;
        }
        let (mut translation, mut rotation, mut scale) = self.parts;
        for channel in &self.channels {
            let v = channel.sample(t);
            match channel.property {
                Property::Translation => translation = v.truncate(),
                Property::Rotation => rotation = DQuat::from_vec4(v),
                Property::Scale => scale = v.truncate(),
            }
        }
        DMat4::from_scale_rotation_translation(scale, rotation, translation)
    }
}

/// A camera at the end of a chain of nodes; looks along its local -Z, as in glTF 2.0.
#[derive(Clone, Debug)]
pub struct Animated {
    /// From the root down to the camera's own node.
    pub chain: Vec<Link>,
    /// The seconds that s = 0 and s = 1 stand for.
    pub range: [f64; 2],
    /// Vertical field of view, degrees.
    pub fov: f64,
}

impl Path for Animated {
    fn pose(&self, s: f64) -> Pose {
        let t = self.range[0] + (self.range[1] - self.range[0]) * s;
        let world = self.chain.iter().fold(DMat4::IDENTITY, |m, link| m * link.at(t));
        let eye = world.w_axis.truncate();
        Pose::look_at(eye, eye - world.z_axis.truncate(), world.y_axis.truncate(), self.fov)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(property: Property, interpolation: Interpolation, times: &[f64], values: &[DVec4]) -> Channel {
        Channel { property, interpolation, times: times.to_vec(), values: values.to_vec() }
    }

    #[test]
    fn interpolations_agree_with_the_standard() {
        let (a, b) = (DVec4::ZERO, DVec4::new(2.0, 4.0, 0.0, 0.0));
        let linear = channel(Property::Translation, Interpolation::Linear, &[1.0, 3.0], &[a, b]);
        assert_eq!(linear.sample(0.0), a);
        assert_eq!(linear.sample(2.0), DVec4::new(1.0, 2.0, 0.0, 0.0));
        assert_eq!(linear.sample(9.0), b);
        let step = Channel { interpolation: Interpolation::Step, ..linear };
        assert_eq!((step.sample(2.999), step.sample(3.0)), (a, b));
        // Zero tangents: smoothstep. At a quarter: 3/16 - 2/64 = 0.15625.
        let cubic = channel(Property::Translation, Interpolation::Cubic, &[0.0, 1.0], &[a, a, a, a, b, a]);
        assert!((cubic.sample(0.25) - b * 0.15625).length() < 1e-12);
        // Tangents are scaled with the key's length: value 0 at both ends, slope 1 leaving over 2 s gives 0.125 * 2 at the middle.
        let bump = channel(Property::Scale, Interpolation::Cubic, &[0.0, 2.0], &[a, a, DVec4::X, a, a, a]);
        assert!((bump.sample(1.0).x - 0.25).abs() < 1e-12);
    }

    #[test]
    fn rotations_take_the_shorter_arc_at_constant_speed() {
        let half = core::f64::consts::FRAC_1_SQRT_2;
        let quarter_turn = DVec4::new(0.0, -half, 0.0, -half);
        let c = channel(Property::Rotation, Interpolation::Linear, &[0.0, 1.0], &[DVec4::W, quarter_turn]);
        let q = DQuat::from_vec4(c.sample(1.0 / 3.0));
        let (sin, cos) = (core::f64::consts::PI / 6.0).sin_cos();
        assert!((q * DVec3::X - DVec3::new(cos, 0.0, -sin)).length() < 1e-12);
    }

    #[test]
    fn a_camera_follows_its_parents() {
        let parent = Link {
            rest: DMat4::IDENTITY,
            parts: (DVec3::ZERO, DQuat::IDENTITY, DVec3::splat(2.0)),
            channels: vec![channel(Property::Translation, Interpolation::Linear, &[0.0, 4.0], &[DVec4::ZERO, DVec4::X * 8.0])],
        };
        let own = Link { rest: DMat4::from_translation(DVec3::Z), parts: (DVec3::Z, DQuat::IDENTITY, DVec3::ONE), channels: Vec::new() };
        let path = Animated { chain: vec![parent, own], range: [0.0, 4.0], fov: 40.0 };
        let pose = path.pose(0.5);
        assert_eq!((pose.eye, pose.forward, pose.up), (DVec3::new(4.0, 0.0, 2.0), DVec3::NEG_Z, DVec3::Y));
    }
}
