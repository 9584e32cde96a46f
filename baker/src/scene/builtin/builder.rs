//! What the built-in scenes are made with: a sheet of painted islands, and triangles that lie on it.
//! Each scene's file places rectangles, paints them and hangs geometry on them; `finish` hands over the `Scene`.
//!
//! Every island keeps [`GUTTER`] texels of its own around its rectangle, filled with its nearest
//! colours: neither bilinear lookup nor a slightly extrapolated ray sees a neighbour.

use super::textures::Texel;
use crate::camera::{Path, Pose};
use crate::scene::{Background, Material, Playback, Scene, Texture, Triangle, Wrap};
use glam::{DVec2, DVec3, Vec3};
use std::sync::Arc;

/// Texels around each island's rectangle that belong to it alone.
pub(super) const GUTTER: u32 = 3;

/// Focal length of the built-in cameras, pixels on a screen of 320 x 240.
pub(super) const FOCAL: f64 = 300.0;

/// A rectangle of the sheet, texels; `x`, `y`: its top left corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rect {
    pub x: u32,
    pub y: u32,
    pub w: u32,
    pub h: u32,
}

impl Rect {
    pub(super) const fn new(x: u32, y: u32, w: u32, h: u32) -> Self {
        Self { x, y, w, h }
    }
}

/// Places rectangles row by row, left to right, gutters included.
pub(super) struct Shelf {
    width: u32,
    x: u32,
    y: u32,
    height: u32,
}

impl Shelf {
    /// A shelf on a sheet of `width` texels, from row `y` down.
    pub(super) fn new(width: u32, y: u32) -> Self {
        Self { width, x: 0, y, height: 0 }
    }

    /// The next `w` x `h` rectangle; a new row starts where the current one is full.
    pub(super) fn place(&mut self, w: u32, h: u32) -> Rect {
        if self.x + w + 2 * GUTTER > self.width {
            (self.x, self.y, self.height) = (0, self.y + self.height, 0);
        }
        let rect = Rect::new(self.x + GUTTER, self.y + GUTTER, w, h);
        self.x += w + 2 * GUTTER;
        self.height = self.height.max(h + 2 * GUTTER);
        rect
    }
}

/// A painted rectangle that triangles can lie on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Island {
    pub rect: Rect,
    id: u16,
}

/// A corner of a triangle: its place in the world, and in its island's rectangle (texels from the top left corner).
pub(super) type Corner = (DVec3, DVec2);

/// A scene in the making.
pub(super) struct Builder {
    width: u32,
    height: u32,
    texels: Vec<Option<Texel>>,
    triangles: Vec<Triangle>,
    islands: u16,
}

impl Builder {
    /// An empty sheet of `width` x `height` texels.
    pub(super) fn new(width: u32, height: u32) -> Self {
        Self { width, height, texels: vec![None; (width * height) as usize], triangles: Vec::new(), islands: 0 }
    }

    /// Paints an island: `paint` gets texel centres, counted from the rectangle's top left corner, and may leave texels out.
    pub(super) fn outlined(&mut self, rect: Rect, paint: impl Fn(f64, f64) -> Option<Texel>) -> Island {
        let fits = rect.x + rect.w + GUTTER <= self.width && rect.y + rect.h + GUTTER <= self.height;
        debug_assert!(fits, "{rect:?} does not fit on a sheet of {} x {}", self.width, self.height);
        for row in 0..rect.h {
            for column in 0..rect.w {
                let place = (rect.y + row) * self.width + rect.x + column;
                self.texels[place as usize] = paint(f64::from(column) + 0.5, f64::from(row) + 0.5);
            }
        }
        self.islands += 1;
        Island { rect, id: self.islands - 1 }
    }

    /// Paints an island that fills its rectangle.
    pub(super) fn island(&mut self, rect: Rect, paint: impl Fn(f64, f64) -> Texel) -> Island {
        self.outlined(rect, |x, y| Some(paint(x, y)))
    }

    /// Adds a triangle, counter-clockwise as seen from outside.
    pub(super) fn triangle(&mut self, island: Island, corners: [Corner; 3]) {
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        let origin = DVec2::new(f64::from(island.rect.x), f64::from(island.rect.y));
        self.triangles.push(Triangle {
            position: corners.map(|(position, _)| position),
            normal: [Vec3::ZERO; 3],
            uv: corners.map(|(_, texel)| ((origin + texel) / size).as_vec2()),
            colour: [Vec3::ONE; 3],
            material: 0,
            island: Some(island.id),
        });
    }

    /// Adds a patch of `columns` x `rows` quads with the given corners; seen from outside, columns run to the right
    /// and rows down. Quads that meet a pole are single triangles.
    pub(super) fn patch(&mut self, island: Island, columns: u32, rows: u32, corner: impl Fn(u32, u32) -> Corner) {
        for j in 0..rows {
            let mut left = (corner(0, j), corner(0, j + 1));
            for i in 0..columns {
                let right = (corner(i + 1, j), corner(i + 1, j + 1));
                if left.1.0.distance_squared(right.1.0) > 1e-18 {
                    self.triangle(island, [left.0, left.1, right.1]);
                }
                if left.0.0.distance_squared(right.0.0) > 1e-18 {
                    self.triangle(island, [left.0, right.1, right.0]);
                }
                left = right;
            }
        }
    }

    /// Adds a surface over the whole rectangle: `point` gets 0..=1 along its columns and rows.
    pub(super) fn surface(&mut self, island: Island, columns: u32, rows: u32, point: impl Fn(f64, f64) -> DVec3) {
        let size = DVec2::new(f64::from(island.rect.w), f64::from(island.rect.h));
        self.patch(island, columns, rows, |i, j| {
            let (s, t) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
            (point(s, t), DVec2::new(s, t) * size)
        });
    }

    /// Adds a parallelogram that shows the whole rectangle: its top left corner, and its edges to the right and down.
    pub(super) fn quad(&mut self, island: Island, corner: DVec3, right: DVec3, down: DVec3) {
        self.surface(island, 1, 1, |s, t| corner + right * s + down * t);
    }

    /// Adds the faces of an axis-aligned box that have an island, in the order +Z, -Z, +X, -X, +Y.
    pub(super) fn cuboid(&mut self, low: DVec3, high: DVec3, faces: [Option<Island>; 5]) {
        let size = high - low;
        let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
        let edges = [
            (DVec3::new(low.x, high.y, high.z), x, -y),
            (DVec3::new(high.x, high.y, low.z), -x, -y),
            (high, -z, -y),
            (DVec3::new(low.x, high.y, low.z), z, -y),
            (DVec3::new(low.x, high.y, low.z), x, z),
        ];
        for (face, (corner, right, down)) in faces.into_iter().zip(edges) {
            if let Some(island) = face {
                self.quad(island, corner, right, down);
            }
        }
    }

    /// The finished scene: 128 frames of 320 x 240 at 30 a second along `path`, one unlit material.
    pub(super) fn finish(mut self, name: &str, path: fn(f64) -> Pose) -> Scene {
        // One ring for bilinear lookup would do; the whole gutter costs nothing and shows the islands' colours in diagnostics.
        for _ in 0..=GUTTER {
            self.grow();
        }
        let texels = self.texels.iter().map(|texel| texel.unwrap_or([48; 3])).map(|[r, g, b]| [r, g, b, 255]).collect();
        Scene {
            name: name.to_owned(),
            triangles: self.triangles,
            materials: vec![Material { texture: Some(0), unlit: true, ..Material::default() }],
            textures: [Texture { width: self.width, height: self.height, texels, wrap: [Wrap::Clamp; 2] }].into(),
            background: Background::Colour([150, 180, 222]),
            lights: Vec::new(),
            camera: Arc::new(Along(path)),
            playback: Playback { width: 320, height: 240, frames: 128, fps: 30, looping: false },
            warnings: Vec::new(),
        }
    }

    /// Gives unpainted texels the colour of a painted neighbour.
    fn grow(&mut self) {
        let before = self.texels.clone();
        let (width, height) = (self.width as usize, self.height as usize);
        for y in 0..height {
            for x in 0..width {
                let place = y * width + x;
                if before[place].is_some() {
                    continue;
                }
                let right = if x + 1 < width { before[place + 1] } else { None };
                let left = if x > 0 { before[place - 1] } else { None };
                let below = if y + 1 < height { before[place + width] } else { None };
                let above = if y > 0 { before[place - width] } else { None };
                self.texels[place] = right.or(left).or(below).or(above);
            }
        }
    }
}

/// A camera path given by a function of s.
struct Along(fn(f64) -> Pose);

impl Path for Along {
    fn pose(&self, s: f64) -> Pose {
        (self.0)(s)
    }
}

/// The pose at `eye` that looks at `target`, upright, with a focal length of `focal` pixels on a screen 240 pixels high.
pub(super) fn look(eye: DVec3, target: DVec3, focal: f64) -> Pose {
    Pose::look_at(eye, target, DVec3::Y, 2.0 * libm::atan(120.0 / focal).to_degrees())
}

/// The pose `distance` from the Y axis at `azimuth` degrees (0: on +Z), `height` up, looking at `target` on the axis.
pub(super) fn orbit(azimuth: f64, distance: f64, height: f64, target: f64) -> Pose {
    let (sin, cos) = libm::sincos(azimuth.to_radians());
    look(DVec3::new(distance * sin, height, distance * cos), DVec3::new(0.0, target, 0.0), FOCAL)
}
