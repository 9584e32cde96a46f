//! Puts hard scenes together: painted pieces of surface, and a camera path said by a function.
//! The files beside this one say where the pieces stand; finished scenes go to the baker.

use cubist_baker::camera::{Path, Pose};
use cubist_baker::scene::{Background, Material, Playback, Scene, Texture, Triangle, Wrap};
use glam::{DVec3, Vec2, Vec3};
use libm::sincos;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// The screen of most hard scenes, pixels.
pub const SIZE: [u32; 2] = [64, 48];
/// The frames of most: two key intervals and a half.
pub const FRAMES: u32 = 20;
/// The vertical field of view of most, degrees: on a screen of [`SIZE`] a plane 48 away has one unit a pixel.
pub const FOV: f64 = 53.130_102_354_155_98;

/// Colours far enough apart to tell surfaces by.
pub const PAINTS: [[f32; 3]; 8] = [
    [0.9, 0.35, 0.3],
    [0.3, 0.6, 0.95],
    [0.95, 0.85, 0.4],
    [0.4, 0.8, 0.45],
    [0.8, 0.5, 0.9],
    [0.9, 0.6, 0.2],
    [0.5, 0.9, 0.9],
    [0.75, 0.75, 0.75],
];

/// A camera path given by a function of s.
struct Along<F>(F);

impl<F: Fn(f64) -> Pose + Send + Sync> Path for Along<F> {
    fn pose(&self, s: f64) -> Pose {
        (self.0)(s)
    }
}

/// Triangles, each of one of [`PAINTS`].
#[derive(Clone, Debug, Default)]
pub struct Build {
    triangles: Vec<Triangle>,
}

impl Build {
    /// Adds a triangle; `uv` are places in the texture, which repeats.
    pub fn triangle(&mut self, paint: u32, position: [DVec3; 3], uv: [[f64; 2]; 3]) -> &mut Self {
        let uv = uv.map(|[u, v]| Vec2::new(u as f32, v as f32));
        self.triangles.push(Triangle { position, normal: [Vec3::ZERO; 3], uv, colour: [Vec3::ONE; 3], material: paint, island: None });
        self
    }

    /// Adds a surface: `point` gets 0..=1 along its columns and rows. Triangles without area are left out.
    pub fn surface(&mut self, paint: u32, [columns, rows]: [u32; 2], point: impl Fn(f64, f64) -> DVec3) -> &mut Self {
        let at = |i: u32, j: u32| {
            let uv = [f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows)];
            (point(uv[0], uv[1]), uv)
        };
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            for corners in [[a, b, c], [a, c, d]] {
                let [p, q, r] = corners.map(|corner| corner.0);
                if (q - p).cross(r - p).length() > 1e-12 * (q - p).length() * (r - p).length() {
                    self.triangle(paint, [p, q, r], corners.map(|corner| corner.1));
                }
            }
        }
        self
    }

    /// Adds a parallelogram: its top left corner, and its edges to the right and down.
    pub fn quad(&mut self, paint: u32, corner: DVec3, right: DVec3, down: DVec3) -> &mut Self {
        self.surface(paint, [1, 1], |s, t| corner + right * s + down * t)
    }

    /// Adds an upright rectangle that faces +Z, around `centre`.
    pub fn board(&mut self, paint: u32, centre: DVec3, [width, height]: [f64; 2]) -> &mut Self {
        let corner = centre + DVec3::new(-0.5 * width, 0.5 * height, 0.0);
        self.quad(paint, corner, DVec3::X * width, DVec3::NEG_Y * height)
    }

    /// Adds the six faces of a box, of paints from `paint` on.
    pub fn cuboid(&mut self, paint: u32, low: DVec3, high: DVec3) -> &mut Self {
        let size = high - low;
        let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
        let faces = [
            (DVec3::new(low.x, high.y, high.z), x, -y),
            (DVec3::new(high.x, high.y, low.z), -x, -y),
            (high, -z, -y),
            (DVec3::new(low.x, high.y, low.z), z, -y),
            (DVec3::new(low.x, high.y, low.z), x, z),
            (DVec3::new(low.x, low.y, high.z), x, -z),
        ];
        for (face, (corner, right, down)) in (0..).zip(faces) {
            self.quad((paint + face) % PAINTS.len() as u32, corner, right, down);
        }
        self
    }

    /// Adds a ball.
    pub fn ball(&mut self, paint: u32, centre: DVec3, radius: f64) -> &mut Self {
        self.surface(paint, [24, 12], |s, t| centre + radius * sphere(s, t))
    }

    /// Adds a ring around the Y axis of `centre`.
    pub fn ring(&mut self, paint: u32, centre: DVec3, [radius, thickness]: [f64; 2]) -> &mut Self {
        self.surface(paint, [24, 12], |s, t| {
            let (sin, cos) = sincos(TAU * t);
            let (side, front) = sincos(TAU * s);
            let reach = radius + thickness * cos;
            centre + DVec3::new(reach * side, thickness * sin, reach * front)
        })
    }

    /// The finished scene along `path`.
    pub fn finish(&self, name: &str, path: impl Fn(f64) -> Pose + Send + Sync + 'static) -> Scene {
        let material = |colour: [f32; 3]| Material { colour: Vec3::from(colour), texture: Some(0), unlit: true, ..Material::default() };
        Scene {
            name: name.to_owned(),
            triangles: self.triangles.clone(),
            materials: PAINTS.map(material).to_vec(),
            textures: [paint()].into(),
            background: Background::Colour([40, 48, 64]),
            lights: Vec::new(),
            camera: Arc::new(Along(path)),
            playback: Playback { width: SIZE[0], height: SIZE[1], frames: FRAMES, fps: 30, looping: false },
            warnings: Vec::new(),
        }
    }
}

/// The point of the unit sphere at `s` around the Y axis and `t` from its top to its bottom.
#[must_use]
pub fn sphere(s: f64, t: f64) -> DVec3 {
    let (side, front) = sincos(TAU * s);
    let (sin, cos) = sincos(PI * t);
    DVec3::new(sin * side, cos, sin * front)
}

/// Slow waves: enough to see where a pixel looks, little enough that a neighbouring texel is no error to speak of.
fn paint() -> Texture {
    const SIDE: u32 = 64;
    let wave = |x: u32, turns: f64| sincos(TAU * turns * f64::from(x) / f64::from(SIDE)).0;
    let texel = |x: u32, y: u32| {
        let shade = |a: f64, b: f64| (175.0 + 45.0 * wave(x, a) + 35.0 * wave(y, b)) as u8;
        [shade(1.0, 2.0), shade(2.0, 1.0), shade(3.0, 2.0), 255]
    };
    let texels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| texel(x, y))).collect();
    Texture { width: SIDE, height: SIDE, texels, wrap: [Wrap::Repeat; 2] }
}

/// A pose of [`FOV`] at `eye` that looks at `target`, upright.
#[must_use]
pub fn look(eye: DVec3, target: DVec3) -> Pose {
    Pose::look_at(eye, target, DVec3::Y, FOV)
}

/// A pose `distance` from `target` at `azimuth` degrees (0: on +Z), `height` above it.
#[must_use]
pub fn orbit(target: DVec3, azimuth: f64, distance: f64, height: f64) -> Pose {
    let (side, front) = sincos(azimuth.to_radians());
    look(target + DVec3::new(distance * side, height, distance * front), target)
}

/// A few houses on a square, seen from a path that goes by: what is made large, small, far and jumpy.
#[must_use]
pub fn town() -> Build {
    let mut build = Build::default();
    build.surface(3, [4, 4], |s, t| DVec3::new(12.0 * s - 6.0, 0.0, 12.0 * t - 6.0));
    build.cuboid(0, DVec3::new(-2.5, 0.0, -1.5), DVec3::new(-1.0, 2.0, 0.0));
    build.cuboid(4, DVec3::new(0.5, 0.0, -2.5), DVec3::new(2.0, 1.2, -0.5));
    build.ball(6, DVec3::new(0.2, 0.7, 1.0), 0.7);
    build
}

/// Where the town is seen from, at `s` of its path.
#[must_use]
pub fn town_path(s: f64) -> Pose {
    orbit(DVec3::new(0.0, 0.6, 0.0), -25.0 + 30.0 * s, 6.5, 2.0)
}

/// `scene` made `scale` times as large and moved by `offset`, with its camera.
#[must_use]
pub fn moved(scene: &Scene, scale: f64, offset: DVec3) -> Scene {
    let mut scene = scene.clone();
    for triangle in &mut scene.triangles {
        triangle.position = triangle.position.map(|corner| corner * scale + offset);
    }
    let camera = scene.camera;
    scene.camera = Arc::new(Along(move |s: f64| {
        let pose = camera.pose(s);
        Pose { eye: pose.eye * scale + offset, ..pose }
    }));
    scene
}
