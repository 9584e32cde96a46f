//! `arch`: past a gateway with a house behind it: an object with a loop.
//! The front wall is one island with a hole; the vault is a strip unrolled along the opening.

use super::builder::{Builder, FOCAL, Island, Rect, look};
use super::sky::{ELEVATION, Sky};
use super::textures::{brick, checker, grass, house_front, lettering, rgb};
use crate::camera::Pose;
use crate::scene::Scene;
use core::f64::consts::PI;
use glam::{DVec2, DVec3};

/// The wall's half width, height and half thickness.
const HALF_WIDTH: f64 = 2.5;
const HEIGHT: f64 = 3.6;
const HALF_DEPTH: f64 = 0.3;
/// The opening is two units wide; above this height it closes in a half circle.
const SPRING: f64 = 1.4;
/// Segments of the half circle.
const SEGMENTS: u32 = 64;

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 512);
    let centre = DVec3::new(0.0, 1.7, 5.5);
    Sky { rect: Rect::new(181, 375, 320, 128), azimuth: 1.1, elevation: ELEVATION, centre, radius: 1800.0 }.hang(&mut builder);

    let ground = builder.island(Rect::new(3, 3, 250, 250), |x, y| {
        let (x, y) = (x * 256.0 / 250.0, y * 256.0 / 250.0);
        if (x - 128.0).abs() < 40.0 { checker(x, y, 9.0, [rgb(190, 180, 150), rgb(140, 130, 110)], 4) } else { grass(x, y, 6) }
    });
    builder.quad(ground, DVec3::new(-9.0, 0.0, -10.0), DVec3::X * 18.0, DVec3::Z * 18.0);
    front(&mut builder);
    vault(&mut builder);

    let side = |builder: &mut Builder, x: u32, seed: u32| builder.island(Rect::new(x, 289, 32, 184), |x, y| brick(x, y, 14.0, 8.0, seed));
    let (left, right) = (side(&mut builder, 3, 5), side(&mut builder, 41, 6));
    let (depth, down) = (DVec3::Z * 2.0 * HALF_DEPTH, DVec3::NEG_Y * HEIGHT);
    builder.quad(left, DVec3::new(-HALF_WIDTH, HEIGHT, -HALF_DEPTH), depth, down);
    builder.quad(right, DVec3::new(HALF_WIDTH, HEIGHT, HALF_DEPTH), -depth, down);

    let faces = [(79, 289, 3), (181, 289, 4), (283, 289, 5), (385, 289, 6), (79, 375, 7)]
        .map(|(x, y, seed)| Some(builder.island(Rect::new(x, y, 96, 80), |x, y| house_front(x, y, 96.0, 80.0, seed))));
    builder.cuboid(DVec3::new(-0.6, 0.0, -4.5), DVec3::new(0.8, 1.6, -3.1), faces);
    builder.finish("arch", path)
}

fn path(s: f64) -> Pose {
    let x = -2.5 + 5.0 * s;
    look(DVec3::new(x, 1.7, 6.5 - 2.0 * s), DVec3::new(x * 0.3, 1.5, 0.0), FOCAL)
}

/// The opening's outline at `i` of [`SEGMENTS`] steps over the half circle, from the left.
fn rim(i: u32) -> DVec2 {
    let (sin, cos) = libm::sincos(PI - PI * f64::from(i) / f64::from(SEGMENTS));
    DVec2::new(cos, SPRING + sin)
}

/// The wall that faces +Z, around the opening.
fn front(builder: &mut Builder) {
    let rect = Rect::new(259, 3, 250, 180);
    let scale = DVec2::new(f64::from(rect.w) / (2.0 * HALF_WIDTH), f64::from(rect.h) / HEIGHT);
    let island = builder.outlined(rect, |x, y| {
        let (wx, wy) = (x / scale.x - HALF_WIDTH, HEIGHT - y / scale.y);
        let open = wx.abs() < 1.0 && (wy < SPRING || wx * wx + (wy - SPRING) * (wy - SPRING) < 1.0);
        let (x, y) = (x * 256.0 / 250.0, y * 184.0 / 180.0);
        let inscription = (2.75..3.15).contains(&wy);
        (!open).then(|| if inscription { lettering(x, y, 3, rgb(60, 30, 20), rgb(215, 200, 170)) } else { brick(x, y, 16.0, 8.0, 4) })
    });
    let corner = |p: DVec2| (p.extend(HALF_DEPTH), DVec2::new(p.x + HALF_WIDTH, HEIGHT - p.y) * scale);
    // Quads between a lower edge, left to right, and the wall's top.
    let mut upright = |left: DVec2, right: DVec2| {
        let [left, right, above_left, above_right] = [left, right, DVec2::new(left.x, HEIGHT), DVec2::new(right.x, HEIGHT)].map(corner);
        builder.triangle(island, [left, right, above_right]);
        builder.triangle(island, [left, above_right, above_left]);
    };
    upright(DVec2::new(-HALF_WIDTH, 0.0), DVec2::new(-1.0, 0.0));
    upright(DVec2::new(1.0, 0.0), DVec2::new(HALF_WIDTH, 0.0));
    for i in 0..SEGMENTS {
        upright(rim(i), rim(i + 1));
    }
}

/// The inside of the opening, unrolled: from the left foot over the vault to the right foot.
fn vault(builder: &mut Builder) {
    let rect = Rect::new(3, 259, 304, 24);
    let island: Island = builder.island(rect, |x, y| brick(x, y, 10.0, 6.0, 7));
    let length = 2.0 * SPRING + PI;
    let along = |i: u32| match i {
        0 => (DVec2::new(-1.0, 0.0), 0.0),
        i if i <= SEGMENTS + 1 => (rim(i - 1), SPRING + PI * f64::from(i - 1) / f64::from(SEGMENTS)),
        _ => (DVec2::new(1.0, 0.0), length),
    };
    builder.patch(island, SEGMENTS + 2, 1, |i, j| {
        let (point, travelled) = along(i);
        let row = f64::from(j);
        (point.extend(HALF_DEPTH * (1.0 - 2.0 * row)), DVec2::new(travelled / length * f64::from(rect.w), row * f64::from(rect.h)))
    });
}
