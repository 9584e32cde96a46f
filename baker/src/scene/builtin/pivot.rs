//! `pivot`: a pan of 90 degrees from a fixed focal point over boxes and columns at many depths.
//! The eye does not move, so nothing ever comes out from behind anything, however deep the scene;
//! ground and sky are unrolled around the eye, which is the frustum warp the paper asks for.

use super::builder::{Builder, FOCAL, Island, Rect, Shelf, look};
use super::noise::fractal;
use super::sky::Sky;
use super::textures::{Texel, brick, checker, house_front, lettering, masonry, mix, rgb, shade};
use crate::camera::Pose;
use crate::scene::Scene;
use glam::{DVec2, DVec3};

const EYE: DVec3 = DVec3::new(0.0, 1.7, 0.0);
/// Half the angle that the ground covers around the eye, radians.
const HALF_TURN: f64 = 1.32;
/// Angles below the horizon of the ground's far and near edges, radians.
const DEPRESSION: [f64; 2] = [0.015, 0.435];
/// Texels per unit at distance 1: most of what the screen shows.
const DENSITY: f64 = 215.0;

/// A box: middle of its foot, size, painter and seed.
struct Block {
    foot: [f64; 2],
    size: [f64; 3],
    paint: fn(f64, f64, [f64; 2], u32) -> Texel,
    seed: u32,
}

/// A round column: foot, radius, height.
struct Column {
    foot: [f64; 2],
    radius: f64,
    height: f64,
}

/// From tall to low on the screen, which is how shelves fill best.
const BLOCKS: [Block; 8] = [
    Block { foot: [3.4, -15.0], size: [5.0, 7.0, 4.0], paint: house, seed: 7 },
    Block { foot: [-6.0, -24.0], size: [7.0, 9.5, 5.0], paint: house, seed: 14 },
    Block { foot: [-11.0, -10.5], size: [4.4, 5.2, 4.0], paint: house, seed: 12 },
    Block { foot: [-3.4, -9.0], size: [2.2, 3.4, 2.2], paint: bricks, seed: 3 },
    Block { foot: [14.5, -8.2], size: [4.4, 4.6, 5.0], paint: house, seed: 16 },
    Block { foot: [6.6, -8.0], size: [2.2, 2.6, 2.2], paint: poster, seed: 8 },
    Block { foot: [0.9, -5.4], size: [1.3, 1.0, 1.3], paint: crate_side, seed: 5 },
    Block { foot: [-6.6, -4.6], size: [2.0, 1.2, 2.0], paint: crate_side, seed: 1 },
];

const COLUMNS: [Column; 6] = [
    Column { foot: [-3.9, -4.6], radius: 0.16, height: 3.2 },
    Column { foot: [-1.3, -6.6], radius: 0.24, height: 3.6 },
    Column { foot: [1.5, -8.8], radius: 0.3, height: 4.0 },
    Column { foot: [4.1, -6.2], radius: 0.22, height: 3.4 },
    Column { foot: [5.2, -3.4], radius: 0.14, height: 2.6 },
    Column { foot: [10.2, -5.4], radius: 0.3, height: 4.2 },
];

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 528);
    let sky = Rect::new(3, 3, 506, 112);
    Sky { rect: sky, azimuth: HALF_TURN, elevation: [0.48, -0.08], centre: EYE, radius: 3000.0 }.hang(&mut builder);
    ground(&mut builder);
    let mut shelf = Shelf::new(512, 228);
    for column in &COLUMNS {
        round(&mut builder, &mut shelf, column);
    }
    for block in &BLOCKS {
        boxed(&mut builder, &mut shelf, block);
    }
    builder.finish("pivot", path)
}

fn path(s: f64) -> Pose {
    let (sin, cos) = libm::sincos((90.0 * s - 45.0).to_radians());
    look(EYE, EYE + DVec3::new(sin, 0.0, -cos), FOCAL)
}

/// The ground, linear in azimuth and in the angle below the horizon.
fn ground(builder: &mut Builder) {
    let rect = Rect::new(3, 121, 506, 104);
    let at = |s: f64, t: f64| {
        let (sin, cos) = libm::sincos((2.0 * s - 1.0) * HALF_TURN);
        let distance = EYE.y / libm::tan(DEPRESSION[0] + (DEPRESSION[1] - DEPRESSION[0]) * t);
        DVec3::new(distance * sin, 0.0, -distance * cos)
    };
    let island = builder.island(rect, |x, y| {
        // A texel far out covers metres: average what lies under it.
        let mut sum = DVec3::ZERO;
        for (dx, dy) in SAMPLES {
            let point = at((x + dx) / f64::from(rect.w), (y + dy) / f64::from(rect.h));
            sum += DVec3::from(paving(point.x, point.z).map(f64::from));
        }
        shade(sum, 1.0 / SAMPLES.len() as f64)
    });
    builder.surface(island, 66, 52, at);
}

/// Offsets within a texel, a rotated grid.
const SAMPLES: [(f64, f64); 8] =
    [(-0.44, -0.06), (-0.31, 0.31), (-0.19, -0.31), (-0.06, 0.06), (0.06, 0.44), (0.19, -0.44), (0.31, -0.19), (0.44, 0.19)];

/// A round place paved in two stones, grass around it, and soft shade at the foot of everything that stands there.
fn paving(x: f64, z: f64) -> Texel {
    let grain = 0.85 + 0.3 * fractal(x * 2.0, z * 2.0, 4, 21);
    let stones = (x.floor() + z.floor()) as i64 & 1 == 0;
    let paved = DVec2::new(x, z + 7.0).length() < 8.6;
    let colour = match (paved, stones) {
        (true, true) => rgb(196, 184, 160),
        (true, false) => rgb(150, 136, 122),
        (false, _) => mix(rgb(74, 118, 50), rgb(146, 142, 84), fractal(x * 0.25, z * 0.25, 4, 22)),
    };
    let mut light = 1.0_f64;
    for block in &BLOCKS {
        let reach = DVec2::new((x - block.foot[0]).abs() - 0.5 * block.size[0], (z - block.foot[1]).abs() - 0.5 * block.size[2]);
        light = light.min(0.55 + 0.9 * reach.max(DVec2::ZERO).length());
    }
    for column in &COLUMNS {
        let reach = DVec2::new(x - column.foot[0], z - column.foot[1]).length() - column.radius;
        light = light.min(0.55 + 1.5 * reach.max(0.0));
    }
    shade(colour, grain * light)
}

/// Adds the faces of a box that the eye sees.
fn boxed(builder: &mut Builder, shelf: &mut Shelf, block: &Block) {
    let [width, height, depth] = block.size;
    let foot = DVec3::new(block.foot[0], 0.0, block.foot[1]);
    let (low, high) = (foot - DVec3::new(0.5 * width, 0.0, 0.5 * depth), foot + DVec3::new(0.5 * width, height, 0.5 * depth));
    let nearest = EYE.clamp(low, high).distance(EYE);
    let mut face = |seen: bool, [across, down]: [f64; 2], light: f64| -> Option<Island> {
        // Painted at a fixed number of texels per unit, so that one brick is as large on every box.
        let [w, h] = [across, down].map(|length| (length * DENSITY / nearest).round().max(4.0));
        let (scale, paint) = (PAINTED / (w / across), block.paint);
        seen.then(|| {
            builder.island(shelf.place(w as u32, h as u32), |x, y| {
                let size = [across, down].map(|length| length * PAINTED);
                shade(DVec3::from(paint(x * scale, y * scale, size, block.seed).map(f64::from)), light)
            })
        })
    };
    let faces = [
        face(true, [width, height], 1.0),
        None,
        face(high.x < EYE.x, [depth, height], 0.78),
        face(low.x > EYE.x, [depth, height], 0.78),
        face(height < EYE.y, [width, depth], 1.12),
    ];
    builder.cuboid(low, high, faces);
}

/// Texels per unit in which the boxes' painters think.
const PAINTED: f64 = 24.0;

fn crate_side(x: f64, y: f64, size: [f64; 2], seed: u32) -> Texel {
    let [width, height] = size;
    let edge = x.min(width - x).min(y.min(height - y));
    let brace = (x / width - y / height).abs() < 0.1;
    let plank = if edge < 3.0 || brace { rgb(150, 104, 56) } else { rgb(202, 152, 92) };
    let gap = edge >= 3.0 && !brace && y % 5.0 < 0.8;
    shade(plank, if gap { 0.55 } else { 0.75 + 0.5 * fractal(x * 0.08, y * 0.6, 3, seed) })
}

fn bricks(x: f64, y: f64, _: [f64; 2], seed: u32) -> Texel {
    brick(x, y, 12.0, 6.0, seed)
}

fn house(x: f64, y: f64, size: [f64; 2], seed: u32) -> Texel {
    house_front(x * 0.5, y * 0.5, size[0] * 0.5, size[1] * 0.5, seed)
}

fn poster(x: f64, y: f64, size: [f64; 2], seed: u32) -> Texel {
    let [width, height] = size;
    if x > 6.0 && x < width - 6.0 && y > 6.0 && y < 0.6 * height {
        lettering(x - 6.0, y - 6.0, seed, rgb(40, 50, 110), rgb(240, 224, 170))
    } else {
        checker(x, y, 6.0, [rgb(196, 72, 60), rgb(228, 206, 178)], seed)
    }
}

/// Adds the part of a round column that the eye sees.
fn round(builder: &mut Builder, shelf: &mut Shelf, column: &Column) {
    let foot = DVec3::new(column.foot[0], 0.0, column.foot[1]);
    let distance = (foot.x * foot.x + foot.z * foot.z).sqrt();
    let [w, h] = [3.3 * column.radius, column.height].map(|length| (length * DENSITY / distance).round().max(6.0));
    let scale = DVec2::new(36.0 / w, column.height * 24.0 / h);
    let island = builder.island(shelf.place(w as u32, h as u32), |x, y| {
        let (x, y) = (x * scale.x, y * scale.y);
        let end = y.min(column.height * 24.0 - y) < 5.0;
        let colours = if end {
            [rgb(120, 108, 96), rgb(176, 160, 138), rgb(190, 174, 150)]
        } else {
            [rgb(150, 138, 124), rgb(222, 212, 194), rgb(244, 238, 224)]
        };
        // Light from the left.
        shade(DVec3::from(masonry(x, y, [12.0, 14.0], colours, 31).map(f64::from)), 1.1 - 0.014 * x)
    });
    let towards_eye = libm::atan2(-foot.x, -foot.z);
    builder.surface(island, 24, 1, |s, t| {
        // A little more than half the way around.
        let (sin, cos) = libm::sincos(towards_eye + (2.0 * s - 1.0) * 1.62);
        foot + DVec3::new(column.radius * sin, column.height * (1.0 - t), column.radius * cos)
    });
}
