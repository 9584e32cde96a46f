//! `torus`: an orbit of 80 degrees around a ring above a checkered plane.
//! A surface of genus one, cut into eight islands that hide themselves and each other.

use super::builder::{Builder, Rect, orbit};
use super::sky::{ELEVATION, Sky};
use super::textures::{brick, checker, rgb};
use crate::scene::Scene;
use core::f64::consts::{FRAC_PI_2, PI};
use glam::DVec3;

/// Radii of the ring and of its tube.
const RING: f64 = 1.5;
const TUBE: f64 = 0.62;
/// Height of the ring's plane.
const LEVEL: f64 = 0.75;

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 512);
    let centre = DVec3::new(0.0, 2.7, 4.4);
    // From its height the path sees further down past the ground's corners than elsewhere.
    let elevation = [ELEVATION[0], ELEVATION[1] - 10.0 / 120.0];
    Sky { rect: Rect::new(3, 309, 384, 138), azimuth: 1.3, elevation, centre, radius: 1200.0 }.hang(&mut builder);
    let ground = builder.island(Rect::new(3, 3, 300, 300), |x, y| checker(x, y, 15.0, [rgb(200, 190, 160), rgb(90, 80, 110)], 3));
    builder.quad(ground, DVec3::new(-6.0, 0.0, -7.0), DVec3::X * 12.0, DVec3::Z * 12.0);

    for quadrant in 0..4 {
        // The outer half of the tube, then the inner half.
        for half in 0..2 {
            piece(&mut builder, quadrant, half);
        }
    }
    builder.finish("torus", |s| orbit(-40.0 + 80.0 * s, 4.8, 2.7, 0.5))
}

fn piece(builder: &mut Builder, quadrant: u32, half: u32) {
    let seed = quadrant * 2 + half;
    let rect = Rect::new(309 + 103 * half, 3 + 66 * quadrant, 97, 60);
    let island = builder.island(rect, |x, y| {
        let x = x * 100.0 / 97.0;
        if quadrant.is_multiple_of(2) {
            checker(x, y, 10.0, [rgb(220, 90, 60), rgb(240, 220, 120)], seed)
        } else {
            brick(x, y, 12.0, 6.0, seed)
        }
    });
    builder.surface(island, 48, 32, |s, t| {
        let (ring_sin, ring_cos) = libm::sincos((f64::from(quadrant) + s) * FRAC_PI_2);
        let (tube_sin, tube_cos) = libm::sincos((f64::from(half) + t) * PI - FRAC_PI_2);
        let distance = RING + TUBE * tube_cos;
        DVec3::new(distance * ring_cos, LEVEL + TUBE * tube_sin, distance * ring_sin)
    });
}
