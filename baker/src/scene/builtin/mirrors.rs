//! `mirrors`: a checkered room with a mirror in each of two walls that meet.
//!
//! The mirrors are virtual geometry: an opening in the wall, and behind it the room again, every point mirrored in the
//! wall's plane. Two mirrors at a right angle need three such rooms: one behind each, and one behind both, mirrored
//! twice, which closes the group; so what the openings show is what the mirrors would. A mirrored room shows the same
//! pictures as the room, but every point of it is a surface point of its own with texels of its own. True reflections,
//! by bouncing rays at playback's surfaces, are not there yet.

use super::builder::{Builder, FOCAL, Island, Rect, Shelf, look};
use super::noise::fractal;
use super::textures::{Texel, checker, lettering, masonry, mix, rgb, shade};
use crate::camera::Pose;
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// The room reaches from -HALF to HALF in x and z; the mirrors are in the walls at -HALF.
const HALF: f64 = 3.0;
const SIDE: f64 = 2.0 * HALF;
const HEIGHT: f64 = 2.8;
/// The openings, along the wall and in height; the same in both walls.
const OPENING: [[f64; 2]; 2] = [[-2.3, 0.5], [0.45, 2.25]];
const FRAME: f64 = 0.12;

/// Middle of the foot of what stands in the room, and sizes.
const PEDESTAL: (DVec2, f64, f64) = (DVec2::new(-0.9, -0.9), 0.42, 0.8);
const BALL_RADIUS: f64 = 0.46;
const CHEST: (DVec2, f64, f64) = (DVec2::new(-1.9, 0.75), 0.36, 0.55);
const DRUM: (DVec2, f64, f64) = (DVec2::new(0.75, -1.9), 0.34, 1.15);
/// What faces the camera of anything round: azimuths around 45 degrees, up to this far, radians.
const ROUND: f64 = 2.2;

/// The room, or one of its mirrored copies.
#[derive(Clone, Copy)]
struct Room {
    /// Mirrored in the plane x = -HALF.
    flip_x: bool,
    /// Mirrored in the plane z = -HALF.
    flip_z: bool,
    /// Texels per unit: the further the room, the fewer.
    density: f64,
}

const ROOMS: [Room; 4] = [
    Room { flip_x: false, flip_z: false, density: 36.0 },
    Room { flip_x: false, flip_z: true, density: 26.0 },
    Room { flip_x: true, flip_z: true, density: 20.0 },
    Room { flip_x: true, flip_z: false, density: 26.0 },
];

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 912);
    let mut shelf = Shelf::new(512, 0);
    // Kind by kind rather than room by room: shelves fill best with what is of one height.
    for part in [Room::floor, Room::walls, Room::furniture, Room::ceiling] {
        for room in ROOMS {
            part(room, &mut builder, &mut shelf);
        }
    }
    builder.finish("mirrors", path)
}

fn path(s: f64) -> Pose {
    let (sin, cos) = libm::sincos((22.0 + 46.0 * s).to_radians());
    look(DVec3::new(3.5 * sin - 0.8, 1.62, 3.5 * cos - 0.8), DVec3::new(-1.0, 1.16, -1.0), FOCAL)
}

impl Room {
    /// Between a point of the room and its mirror image; its own inverse.
    fn mirror(self, p: DVec3) -> DVec3 {
        let flip = |on: bool, value: f64| if on { -2.0 * HALF - value } else { value };
        DVec3::new(flip(self.flip_x, p.x), p.y, flip(self.flip_z, p.z))
    }

    /// What a mirror leaves of `colour`.
    fn seen(self, colour: Texel) -> Texel {
        let bounces = i32::from(self.flip_x) + i32::from(self.flip_z);
        let colour = DVec3::from(colour.map(f64::from));
        shade((0..bounces).fold(colour, |c, _| c * DVec3::new(0.9, 0.95, 0.93)), 1.0)
    }

    /// Paints an island for a parallelogram; `paint` gets the point of the real room that is seen there.
    fn panel(self, builder: &mut Builder, rect: Rect, [corner, right, down]: [DVec3; 3], paint: impl Fn(DVec3) -> Texel) -> Island {
        builder.island(rect, |x, y| {
            let point = corner + right * (x / f64::from(rect.w)) + down * (y / f64::from(rect.h));
            self.seen(paint(self.mirror(point)))
        })
    }

    /// The room's corner with the smallest x and z, on the floor.
    fn low(self) -> DVec3 {
        self.mirror(DVec3::new(-HALF, 0.0, -HALF)).min(self.mirror(DVec3::new(HALF, 0.0, HALF)))
    }

    /// A rectangle for a panel, by its edges in world units.
    fn place(self, shelf: &mut Shelf, right: f64, down: f64) -> Rect {
        shelf.place((right * self.density) as u32, (down * self.density) as u32)
    }

    fn floor(self, builder: &mut Builder, shelf: &mut Shelf) {
        let edges = [self.low(), DVec3::X * SIDE, DVec3::Z * SIDE];
        let island = self.panel(builder, self.place(shelf, SIDE, SIDE), edges, floor);
        builder.quad(island, edges[0], edges[1], edges[2]);
    }

    /// The two walls that the camera looks towards.
    fn walls(self, builder: &mut Builder, shelf: &mut Shelf) {
        let top = self.low() + DVec3::Y * HEIGHT;
        for (origin, right) in [(top, DVec3::X * SIDE), (top + DVec3::Z * SIDE, DVec3::NEG_Z * SIDE)] {
            let along_x = right.x != 0.0;
            let edges = [origin, right, DVec3::NEG_Y * HEIGHT];
            let island = self.panel(builder, self.place(shelf, SIDE, HEIGHT), edges, |p| wall(p, along_x));
            let real = self.mirror(top);
            let depth = if along_x { real.z } else { real.x };
            if depth < 0.0 { self.holed(builder, island, edges) } else { builder.quad(island, edges[0], edges[1], edges[2]) }
        }
    }

    /// The ceiling: seen at a flat angle, plain, so that few texels do.
    fn ceiling(self, builder: &mut Builder, shelf: &mut Shelf) {
        let edges = [self.low() + DVec3::new(0.0, HEIGHT, SIDE), DVec3::X * SIDE, DVec3::NEG_Z * SIDE];
        let island = self.panel(builder, self.place(shelf, 0.4 * SIDE, 0.4 * SIDE), edges, ceiling);
        builder.quad(island, edges[0], edges[1], edges[2]);
    }

    /// Adds a wall around its opening: below, above, left and right of it.
    fn holed(self, builder: &mut Builder, island: Island, [origin, right, down]: [DVec3; 3]) {
        let [across, up] = OPENING;
        // Fractions of the wall; a mirrored room, and the wall along z, run the other way.
        let place = |value: f64| {
            let point = self.mirror(DVec3::new(value, 0.0, value));
            (point - origin).dot(right) / right.length_squared()
        };
        let (a, b) = (place(across[0]), place(across[1]));
        let (left, far) = (a.min(b), a.max(b));
        let (head, sill) = (1.0 - up[1] / HEIGHT, 1.0 - up[0] / HEIGHT);
        let size = DVec2::new(f64::from(island.rect.w), f64::from(island.rect.h));
        for [s0, t0, s1, t1] in [[0.0, 0.0, 1.0, head], [0.0, sill, 1.0, 1.0], [0.0, head, left, sill], [far, head, 1.0, sill]] {
            builder.patch(island, 1, 1, |i, j| {
                let (s, t) = (if i == 0 { s0 } else { s1 }, if j == 0 { t0 } else { t1 });
                (origin + right * s + down * t, DVec2::new(s, t) * size)
            });
        }
    }

    /// A pedestal with a ball, a chest, a drum: the sides that face the camera.
    fn furniture(self, builder: &mut Builder, shelf: &mut Shelf) {
        self.block(builder, shelf, PEDESTAL, |p, face| {
            let (x, y) = if face == 2 { (p.x, p.z) } else { (p.x + p.z, p.y) };
            masonry(x * 40.0 + 400.0, y * 40.0 + 400.0, [12.0, 8.0], MARBLE, 71)
        });
        self.block(builder, shelf, CHEST, |p, face| match face {
            0 => lettering(p.x * 40.0 + 100.0, 22.0 - p.y * 40.0 + 40.0, 72, rgb(250, 240, 200), rgb(36, 66, 132)),
            1 => checker(p.z * 40.0, p.y * 40.0, 7.0, [rgb(36, 66, 132), rgb(214, 180, 70)], 73),
            _ => checker(p.x * 40.0, p.z * 40.0, 7.0, [rgb(36, 66, 132), rgb(214, 180, 70)], 73),
        });
        let (foot, _, height) = PEDESTAL;
        let middle = DVec3::new(foot.x, height + BALL_RADIUS, foot.y);
        self.round(builder, shelf, [middle, DVec3::splat(BALL_RADIUS)], 24, |azimuth, t| {
            let (up, out) = libm::sincos(core::f64::consts::FRAC_PI_2 * (1.0 - 2.0 * t));
            (DVec3::new(out, up, out), ball(azimuth, t))
        });
        let (foot, radius, height) = DRUM;
        self.round(builder, shelf, [DVec3::new(foot.x, 0.0, foot.y), DVec3::new(radius, height, radius)], 1, |azimuth, t| {
            (DVec3::new(1.0, 1.0 - t, 1.0), drum(azimuth, t))
        });
        self.lid(builder, shelf);
    }

    /// A box's faces towards +X, +Z and up; `paint` gets the real point and the face: 0 along x, 1 along z, 2 the top.
    fn block(self, builder: &mut Builder, shelf: &mut Shelf, shape: (DVec2, f64, f64), paint: impl Fn(DVec3, u32) -> Texel) {
        let (foot, half, height) = shape;
        let middle = self.mirror(DVec3::new(foot.x, 0.0, foot.y));
        let (low, high) = (middle - DVec3::new(half, 0.0, half), middle + DVec3::new(half, height, half));
        let (x, z, down) = (DVec3::X * 2.0 * half, DVec3::Z * 2.0 * half, DVec3::NEG_Y * height);
        let texels = |length: f64| (length * self.density * 1.4) as u32;
        let mut face = |number: u32, edges: [DVec3; 3], light: f64| {
            let rect = shelf.place(texels(edges[1].length()), texels(edges[2].length()));
            let lit = |p| shade(DVec3::from(paint(p, number).map(f64::from)), light);
            Some(self.panel(builder, rect, edges, lit))
        };
        // The lamp is in the middle of the ceiling; a mirrored room shows the faces of the other side, in their own light.
        let light = |flipped: bool, place: f64| if (place < 0.0) != flipped { 1.0 } else { 0.76 };
        let front = face(0, [DVec3::new(low.x, high.y, high.z), x, down], light(self.flip_z, foot.y));
        let right = face(1, [high, -z, down], 0.92 * light(self.flip_x, foot.x));
        let top = face(2, [DVec3::new(low.x, high.y, low.z), x, z], 1.1);
        builder.cuboid(low, high, [front, None, right, None, top]);
    }

    /// A surface of revolution around the vertical through `middle`, as far around as the camera sees it: `shape` gets
    /// the real room's azimuth and 0..=1 from top to bottom, and gives offsets in units of `size`, and the colour.
    fn round(
        self,
        builder: &mut Builder,
        shelf: &mut Shelf,
        [middle, size]: [DVec3; 2],
        rows: u32,
        shape: impl Fn(f64, f64) -> (DVec3, Texel),
    ) {
        let middle = self.mirror(middle);
        let tall = if rows == 1 { size.y } else { 2.6 * size.y };
        let [w, h] = [2.0 * ROUND * size.x, tall].map(|length| (length * self.density * 1.2) as u32);
        let azimuth = |s: f64| core::f64::consts::FRAC_PI_4 + (2.0 * s - 1.0) * ROUND;
        let island = builder.island(shelf.place(w, h), |x, y| {
            let seen = azimuth(x / f64::from(w));
            let seen = if self.flip_z { core::f64::consts::PI - seen } else { seen };
            self.seen(shape(if self.flip_x { -seen } else { seen }, y / f64::from(h)).1)
        });
        builder.surface(island, 64, rows, |s, t| {
            let (sin, cos) = libm::sincos(azimuth(s));
            middle + shape(0.0, t).0 * DVec3::new(sin, 1.0, cos) * size
        });
    }

    /// The drum's top, a disc.
    fn lid(self, builder: &mut Builder, shelf: &mut Shelf) {
        let (foot, radius, height) = DRUM;
        let middle = self.mirror(DVec3::new(foot.x, height, foot.y));
        let side = (2.0 * radius * self.density) as u32;
        let half = 0.5 * f64::from(side);
        let island = builder.island(shelf.place(side, side), |x, y| {
            let r = DVec2::new(x - half, y - half).length() / half;
            self.seen(shade(if r > 0.85 { rgb(120, 40, 40) } else { rgb(240, 230, 210) }, 1.0 - 0.1 * fractal(x * 0.4, y * 0.4, 2, 74)))
        });
        builder.patch(island, 48, 1, |i, j| {
            let (sin, cos) = libm::sincos(f64::from(i) / 48.0 * core::f64::consts::TAU);
            let offset = DVec2::new(sin, cos) * f64::from(j);
            (middle + DVec3::new(offset.x * radius, 0.0, offset.y * radius), (offset + 1.0) * half)
        });
    }
}

const MARBLE: [DVec3; 3] = [rgb(150, 146, 140), rgb(206, 202, 196), rgb(236, 234, 230)];

/// Checkered, darker towards the walls and under what stands on it.
fn floor(p: DVec3) -> Texel {
    let mut light = 1.08 - 0.02 * (p.x * p.x + p.z * p.z);
    for (foot, half, _) in [PEDESTAL, CHEST, DRUM] {
        let reach = (DVec2::new(p.x, p.z) - foot).length() - half;
        light = light.min(0.5 + 1.1 * reach.max(0.0));
    }
    let tile = checker(p.x * 40.0 + 400.0, p.z * 40.0 + 400.0, 30.0, [rgb(226, 214, 190), rgb(92, 52, 48)], 75);
    shade(DVec3::from(tile.map(f64::from)), light)
}

fn ceiling(p: DVec3) -> Texel {
    let lamp = p.x.abs() < 0.9 && p.z.abs() < 0.9;
    shade(if lamp { rgb(255, 250, 228) } else { rgb(214, 208, 196) }, 1.0 - 0.012 * (p.x * p.x + p.z * p.z))
}

/// A wall along x (at either end of the room) or along z: panelling below, plaster above, a gilt frame around a mirror's
/// opening; a door and a poster on the walls that only the mirrors show.
fn wall(p: DVec3, along_x: bool) -> Texel {
    let (along, depth) = if along_x { (p.x, p.z) } else { (p.z, p.x) };
    let grain = 0.93 + 0.14 * fractal(along * 6.0, p.y * 6.0, 3, 76);
    let corner = 1.04 - 0.015 * along * along - 0.1 * (1.0 - p.y / HEIGHT);
    if depth < 0.0 {
        let [across, up] = OPENING;
        let inside = |margin: f64| along > across[0] - margin && along < across[1] + margin && p.y > up[0] - margin && p.y < up[1] + margin;
        if inside(FRAME) {
            return shade(if inside(0.35 * FRAME) { rgb(140, 98, 34) } else { rgb(222, 176, 74) }, grain);
        }
    } else if along_x && (-1.9..-0.7).contains(&along) && p.y < 2.1 {
        let inset = (-1.78..-0.82).contains(&along) && p.y < 1.98 && (p.y + 0.06) % 0.7 > 0.14;
        return shade(if inset { rgb(126, 78, 42) } else { rgb(96, 58, 30) }, grain);
    } else if (if along_x { 0.0..1.7 } else { -1.5..0.9 }).contains(&along) && (0.95..2.2).contains(&p.y) {
        let seed = if along_x { 77 } else { 78 };
        let paper = if along_x { rgb(244, 236, 206) } else { rgb(206, 74, 58) };
        let ink = if along_x { rgb(150, 40, 36) } else { rgb(252, 240, 214) };
        return lettering(along * 28.0 + 100.0, (2.17 - p.y) * 28.0, seed, ink, paper);
    }
    let plaster = mix(rgb(118, 148, 150), rgb(164, 188, 184), p.y / HEIGHT);
    let panelling = if (along + 10.0) % 0.5 < 0.04 { rgb(150, 138, 118) } else { rgb(226, 216, 194) };
    let colour = if p.y < 0.34 { panelling } else { plaster };
    shade(colour, grain * corner)
}

/// Eight gores, each of another colour.
fn ball(azimuth: f64, t: f64) -> Texel {
    const GORES: [DVec3; 8] = [
        rgb(222, 58, 50),
        rgb(246, 240, 226),
        rgb(250, 196, 46),
        rgb(246, 240, 226),
        rgb(52, 150, 84),
        rgb(246, 240, 226),
        rgb(48, 104, 196),
        rgb(246, 240, 226),
    ];
    let turn = (azimuth / core::f64::consts::TAU).rem_euclid(1.0);
    let button = !(0.07..0.93).contains(&t);
    shade(if button { rgb(70, 60, 80) } else { GORES[(turn * 8.0) as usize % 8] }, 1.12 - 0.5 * t)
}

/// Diagonal stripes between two hoops.
fn drum(azimuth: f64, t: f64) -> Texel {
    let hoop = !(0.1..0.9).contains(&t);
    let stripe = (azimuth * 12.0 / core::f64::consts::TAU + t * 3.0).rem_euclid(2.0) < 1.0;
    let colour = match (hoop, stripe) {
        (true, _) => rgb(120, 40, 40),
        (false, true) => rgb(208, 66, 54),
        (false, false) => rgb(240, 226, 196),
    };
    shade(colour, 1.06 - 0.3 * t)
}
