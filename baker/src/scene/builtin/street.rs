//! `street`: a drive down a street between twelve houses; the demo.
//! Many planar surfaces that hide each other, each with an island of its own.

use super::builder::{Builder, FOCAL, Rect, Shelf, look};
use super::noise::{fractal, hash};
use super::sky::{ELEVATION, Sky};
use super::textures::{checker, grass, house_front, rgb, shade};
use crate::camera::Pose;
use crate::scene::Scene;
use glam::DVec3;

/// Texels across and down a house front.
const FRONT: [u32; 2] = [64, 40];

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 640);
    let centre = DVec3::new(0.0, 2.8, 4.0);
    // On the last shelf, beside the last four fronts.
    let sky = Rect::new(283, 569, 226, 63);
    Sky { rect: sky, azimuth: 1.2, elevation: ELEVATION, centre, radius: 7200.0 }.hang(&mut builder);
    ground(&mut builder);
    let mut shelf = Shelf::new(512, 198);
    for side in 0..2 {
        for row in 0..6 {
            house(&mut builder, &mut shelf, side, row);
        }
    }
    builder.finish("street", path)
}

fn path(s: f64) -> Pose {
    let z = 26.0 - 44.0 * s;
    let x = 0.8 * libm::sin(s * 5.0);
    let yaw = 0.25 * libm::sin(s * 4.5);
    look(DVec3::new(x, 2.2 + 1.2 * s, z), DVec3::new(x + yaw * 10.0, 2.6 + 1.2 * s, z - 10.0), FOCAL * 0.85)
}

/// Road, pavements and grass: -Z runs along the island's columns, X along its rows.
fn ground(builder: &mut Builder) {
    let [width, height] = [506.0, 192.0];
    let island = builder.island(Rect::new(3, 3, 506, 192), |x, y| {
        let x = x * 512.0 / width;
        let from_middle = (y - 0.5 * height).abs();
        if from_middle < 20.0 {
            let dash = from_middle < 1.5 && (x as i32 / 10) % 2 == 0;
            let tar = if dash { rgb(230, 230, 220) } else { rgb(80, 80, 85) };
            shade(tar, 0.8 + 0.4 * fractal(x * 0.3, y * 0.3, 3, 8))
        } else if from_middle < 30.0 {
            checker(x, y, 5.0, [rgb(170, 165, 160), rgb(140, 135, 130)], 4)
        } else {
            grass(x * 1.5, y * 1.5, 5)
        }
    });
    builder.quad(island, DVec3::new(-24.0, 0.0, 32.0), DVec3::Z * -72.0, DVec3::X * 48.0);
}

/// House number `row` on the right (`side` 0) or left (1): four fronts and a flat roof.
fn house(builder: &mut Builder, shelf: &mut Shelf, side: u32, row: u32) {
    let random = |seed: u32| hash(row as i32, side as i32, seed);
    let (width, depth) = (4.0 + 3.0 * random(11), 5.0 + 2.5 * random(12));
    let (height, distance) = (4.5 + 8.0 * random(13), 3.6 + 2.0 * random(14));
    let z = 24.0 - 9.5 * f64::from(row);
    let x = if side == 0 { distance } else { -distance - width };
    let number = side * 6 + row;
    let faces = [0, 100, 200, 300, 400].map(|face| {
        let [w, h] = FRONT;
        let seed = number + face;
        Some(builder.island(shelf.place(w, h), |x, y| {
            if face == 400 {
                checker(x, y, 8.0, [rgb(120, 110, 110), rgb(100, 95, 95)], seed)
            } else {
                house_front(x, y, f64::from(w), f64::from(h), seed)
            }
        }))
    });
    builder.cuboid(DVec3::new(x, 0.0, z - depth), DVec3::new(x + width, height, z), faces);
}
