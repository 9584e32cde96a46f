//! `columns` and `round-columns`: past nine thin columns in front of a wall, square or round.
//! Occluders thinner than a cell of the key grid, with outlines that are straight creases or curved silhouettes.

use super::builder::{Builder, FOCAL, Rect, Shelf, look};
use super::sky::{ELEVATION, Sky};
use super::textures::{brick, checker, lettering, rgb};
use crate::camera::Pose;
use crate::scene::Scene;
use glam::DVec3;

const COUNT: u32 = 9;
/// Height of the columns, world units and texels.
const HEIGHT: f64 = 2.6;
const HEIGHT_TEXELS: u32 = 180;
/// First row of the columns' islands.
const SHELF: u32 = 420;
/// Texels around the part of a round column that faces the path, and half the angle they span, degrees:
/// wide enough that no frame sees where the column is open.
const ROUND_TEXELS: u32 = 28;
const ROUND_HALF_ANGLE: f64 = 110.0 * ROUND_TEXELS as f64 / 24.0;

/// The scene with square columns.
pub(super) fn square() -> Scene {
    let mut builder = stage();
    let mut shelf = Shelf::new(512, SHELF);
    for k in 0..COUNT {
        let (foot, half) = column(k);
        // +Z, +X and -X; the path sees neither the back nor the top.
        let mut face = |f: u32| {
            let second = rgb(170 - 20 * f as u8, 90, 60);
            Some(
                builder
                    .island(shelf.place(8, HEIGHT_TEXELS), |x, y| checker(x + 4.0, y, squares(k), [rgb(235, 225, 200), second], k * 4 + f)),
            )
        };
        let faces = [face(0), None, face(2), face(3), None];
        let half = DVec3::new(half, 0.0, half);
        builder.cuboid(foot - half, foot + half + DVec3::Y * HEIGHT, faces);
    }
    builder.finish("columns", path)
}

/// The scene with round columns.
pub(super) fn round() -> Scene {
    let mut builder = stage();
    let mut shelf = Shelf::new(512, SHELF);
    for k in 0..COUNT {
        let (foot, radius) = column(k);
        let island = builder.island(shelf.place(ROUND_TEXELS, HEIGHT_TEXELS), |x, y| {
            checker(x + 2.0, y, squares(k), [rgb(235, 225, 200), rgb(170, 90, 60)], k)
        });
        builder.surface(island, 72, 1, |s, t| {
            let (sin, cos) = libm::sincos(((2.0 * s - 1.0) * ROUND_HALF_ANGLE).to_radians());
            foot + DVec3::new(radius * sin, HEIGHT * (1.0 - t), radius * cos)
        });
    }
    builder.finish("round-columns", path)
}

fn path(s: f64) -> Pose {
    let x = -1.8 + 3.6 * s;
    look(DVec3::new(x, 1.6, 5.0), DVec3::new(x * 0.8, 1.4, 0.0), FOCAL)
}

/// Foot and half width of column `k`: left to right, thicker and thicker, staggered in depth.
fn column(k: u32) -> (DVec3, f64) {
    let depth = 1.0 + 0.35 * (f64::from(k * 5 % 7) - 3.0) * 0.5;
    (DVec3::new(-2.8 + 0.7 * f64::from(k), 0.0, depth), 0.05 + 0.008 * f64::from(k))
}

/// Size of the squares painted on column `k`.
fn squares(k: u32) -> f64 {
    if k.is_multiple_of(2) { 6.0 } else { 16.0 }
}

/// Sky, ground and the wall behind.
fn stage() -> Builder {
    let mut builder = Builder::new(512, 640);
    let centre = DVec3::new(0.0, 1.6, 5.0);
    Sky { rect: Rect::new(265, 3, 244, 90), azimuth: 1.1, elevation: ELEVATION, centre, radius: 1200.0 }.hang(&mut builder);
    let ground = builder.island(Rect::new(3, 3, 256, 256), |x, y| checker(x, y, 9.0, [rgb(190, 180, 150), rgb(140, 130, 110)], 4));
    builder.quad(ground, DVec3::new(-6.0, 0.0, -3.0), DVec3::X * 12.0, DVec3::Z * 9.0);
    let wall = builder.island(Rect::new(3, 265, 506, 152), |x, y| {
        let x = x * 512.0 / 506.0;
        if y > 50.0 && y < 90.0 && (x / 100.0) as i32 % 2 == 1 {
            lettering(x, y, 9, rgb(240, 230, 200), rgb(60, 40, 90))
        } else {
            brick(x, y, 16.0, 8.0, 4)
        }
    });
    builder.quad(wall, DVec3::new(-6.0, HEIGHT + 1.0, -3.0), DVec3::X * 12.0, DVec3::Y * -3.6);
    builder
}
