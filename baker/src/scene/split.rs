//! Splitting of large triangles. A floor in two triangles is near the camera at one end and far from it at the other: a chart that takes whole ones has texels of
//! one size for both ends. In smaller ones it lies in several charts, or in one that is seen from a point.
//! A scene comes in; the same surface, in more triangles, goes to the rays.

use super::{Scene, Triangle};
use glam::{DVec3, Vec2, Vec3};

/// An edge is cut in half where it is longer than so many times its distance from where the camera is at some moment.
const LONG: f64 = 1.0;
/// Moments that count, at most.
const MOMENTS: u32 = 64;
/// Triangles that are added, at most.
const MOST: usize = 20_000;
/// Times that an edge is cut in half, at most.
const ROUNDS: usize = 32;

/// `scene` with large triangles split; `None` where there are none, or too many. Triangles that share an edge are cut at the same point of it. Textures and
/// the camera are those of `scene`, not copies.
pub(crate) fn split(scene: &Scene) -> Option<Scene> {
    let eyes = Eyes::new(scene);
    let most = scene.triangles.len() + MOST;
    let parts = |triangles: &[Triangle]| -> Option<Vec<Triangle>> {
        let first = triangles.iter().position(|t| eyes.cuts(t) != [false; 3])?;
        let mut out = triangles[..first].to_vec();
        for (t, left) in triangles[first..].iter().zip((0..triangles.len() - first).rev()) {
            cut(t, eyes.cuts(t), &mut out);
            if out.len() + left > most {
                return None;
            }
        }
        Some(out)
    };
    let mut triangles = parts(&scene.triangles)?;
    for _ in 1..ROUNDS {
        let Some(smaller) = parts(&triangles) else { break };
        triangles = smaller;
    }
    Some(Scene {
        name: scene.name.clone(),
        triangles,
        materials: scene.materials.clone(),
        textures: scene.textures.clone(),
        background: scene.background.clone(),
        lights: scene.lights.clone(),
        camera: scene.camera.clone(),
        playback: scene.playback,
        warnings: scene.warnings.clone(),
    })
}

/// Where the camera is, and the box around that.
struct Eyes {
    all: Vec<DVec3>,
    lo: DVec3,
    hi: DVec3,
}

impl Eyes {
    fn new(scene: &Scene) -> Self {
        let play = scene.playback;
        let moments = play.frames.clamp(1, MOMENTS);
        let step = f64::from(play.frames.saturating_sub(1)) / f64::from((moments - 1).max(1));
        let all: Vec<DVec3> = (0..moments).map(|i| scene.camera.pose(play.parameter(f64::from(i) * step)).eye).collect();
        let (lo, hi) = all.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &eye| (lo.min(eye), hi.max(eye)));
        Self { all, lo, hi }
    }

    /// Which edges of `t` are cut, that from its first corner to its second first.
    fn cuts(&self, t: &Triangle) -> [bool; 3] {
        [0, 1, 2].map(|k| self.cut(t.position[k], t.position[next(k)]))
    }

    /// Whether the edge between `a` and `b` is cut, whichever of them comes first.
    fn cut(&self, a: DVec3, b: DVec3) -> bool {
        let (a, b) = if b.to_array() < a.to_array() { (b, a) } else { (a, b) };
        let (along, middle) = (b - a, 0.5 * (a + b));
        let length = along.length();
        // Most edges are far from the whole path.
        let off = middle.distance(middle.clamp(self.lo, self.hi)) - 0.5 * length;
        let near = |eye: &DVec3| {
            let t = ((*eye - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            length > LONG * eye.distance(a + along * t)
        };
        length > LONG * off && self.all.iter().any(near)
    }
}

const fn next(k: usize) -> usize {
    (k + 1) % 3
}

/// Adds the parts of `t` where these of its edges are cut in half.
fn cut(t: &Triangle, cuts: [bool; 3], out: &mut Vec<Triangle>) {
    let corner = |k: usize| std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
    let middle = |k: usize| std::array::from_fn(|i| if i == k || i == next(k) { 0.5 } else { 0.0 });
    let mut add = |corners: [[f32; 3]; 3]| out.push(part(t, corners));
    match cuts.map(usize::from).iter().sum() {
        0 => out.push(*t),
        1 => {
            let a = cuts.iter().position(|&cut| cut).unwrap_or(0);
            let (b, c) = (next(a), next(next(a)));
            add([corner(a), middle(a), corner(c)]);
            add([middle(a), corner(b), corner(c)]);
        }
        2 => {
            let a = cuts.iter().position(|&cut| !cut).unwrap_or(0);
            let (b, c) = (next(a), next(next(a)));
            add([corner(a), corner(b), middle(b)]);
            add([corner(a), middle(b), middle(c)]);
            add([middle(b), corner(c), middle(c)]);
        }
        _ => {
            (0..3).for_each(|k| add([corner(k), middle(k), middle(next(next(k)))]));
            add([middle(0), middle(1), middle(2)]);
        }
    }
}

/// The part of `t` between these points, weights of its corners each. Normals stay straight from corner to corner: shading makes them unit vectors.
fn part(t: &Triangle, corners: [[f32; 3]; 3]) -> Triangle {
    let position = |[a, b, c]: [f32; 3]| t.position[0] * f64::from(a) + t.position[1] * f64::from(b) + t.position[2] * f64::from(c);
    let vector = |v: &[Vec3; 3]| corners.map(|[a, b, c]| v[0] * a + v[1] * b + v[2] * c);
    let uv = |[a, b, c]: [f32; 3]| -> Vec2 { t.uv[0] * a + t.uv[1] * b + t.uv[2] * c };
    Triangle { position: corners.map(position), normal: vector(&t.normal), uv: corners.map(uv), colour: vector(&t.colour), ..*t }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aim, Line};
    use crate::scene::{Background, Material, Playback};
    use std::collections::HashMap;
    use std::sync::Arc;

    /// A floor of two triangles, 64 on a side, over which the camera flies at this height.
    fn floor(height: f64) -> Scene {
        wide(64.0, height)
    }

    /// Likewise of another size.
    fn wide(side: f64, height: f64) -> Scene {
        let corner = |x: f64, z: f64| 0.5 * side * DVec3::new(x, 0.0, z);
        let triangle = |position: [DVec3; 3]| Triangle {
            position,
            normal: [Vec3::Y; 3],
            uv: position.map(|p| Vec2::new(p.x as f32, p.z as f32)),
            colour: [Vec3::ONE; 3],
            material: 0,
            island: None,
        };
        let (a, b, c, d) = (corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0));
        let aim = Aim::Direction(DVec3::NEG_Z);
        Scene {
            name: "floor".to_owned(),
            triangles: vec![triangle([a, d, c]), triangle([a, c, b])],
            materials: vec![Material::default()],
            textures: [].into(),
            background: Background::Colour([0; 3]),
            lights: Vec::new(),
            camera: Arc::new(Line { from: DVec3::new(1.0, height, 8.0), to: DVec3::new(1.0, height, -8.0), aim, up: DVec3::Y, fov: 60.0 }),
            playback: Playback { width: 16, height: 16, frames: 9, fps: 30, looping: false },
            warnings: Vec::new(),
        }
    }

    #[test]
    fn what_is_near_at_one_end_is_split_and_stays_the_same_surface() {
        let scene = floor(2.0);
        let parts = split(&scene).expect("it is large").triangles;
        let eyes = Eyes::new(&scene);
        assert!(parts.iter().all(|t| eyes.cuts(t) == [false; 3]), "none is large");
        assert!((100..2000).contains(&parts.len()), "{}", parts.len());
        let area: f64 = parts.iter().map(|t| 0.5 * (t.position[1] - t.position[0]).cross(t.position[2] - t.position[0]).y).sum();
        assert!((area - 64.0 * 64.0).abs() < 1e-6, "{area}: the same area, all of it facing up");
        assert!(parts.iter().all(|t| t.normal == [Vec3::Y; 3]));
        assert!(parts.iter().all(|t| t.position.iter().zip(t.uv).all(|(p, uv)| [p.x as f32, p.z as f32] == uv.to_array())));
        // An edge inside the floor has a triangle on either side: no corner lies in the middle of another triangle's edge.
        let mut sides: HashMap<[[u64; 3]; 2], u32> = HashMap::new();
        for (from, to) in parts.iter().flat_map(|t| [0, 1, 2].map(|k| (t.position[k], t.position[next(k)]))) {
            let mut ends = [from, to].map(|p| p.to_array().map(f64::to_bits));
            ends.sort_unstable();
            *sides.entry(ends).or_default() += 1;
        }
        let outer = |ends: &[[u64; 3]; 2]| [0, 2].iter().any(|&k| ends.iter().all(|p| f64::from_bits(p[k]).abs() == 32.0));
        assert!(sides.iter().all(|(ends, &count)| count == if outer(ends) { 1 } else { 2 }));
    }

    #[test]
    fn what_is_far_off_stays_whole_and_what_is_very_near_adds_so_many() {
        assert!(split(&floor(200.0)).is_none());
        let parts = split(&floor(1e-9)).expect("it is large").triangles;
        assert!((1000..=2 + MOST).contains(&parts.len()), "{}", parts.len());
    }

    #[test]
    fn floors_a_million_times_as_wide_as_the_camera_is_high_are_cut_on() {
        let scene = wide(2e6, 2.0);
        let parts = split(&scene).expect("it is large").triangles;
        let eyes = Eyes::new(&scene);
        assert!(parts.iter().all(|t| eyes.cuts(t) == [false; 3]), "none is large");
    }
}
