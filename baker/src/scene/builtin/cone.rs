//! `cone-orbit` and `cone-translate`: a brick cone on a plane, once orbited and once passed in a straight line.
//! The paper's pair for an object with an infinite aspect graph: the same scene, easy on one path and hard on the other.

use super::builder::{Builder, Corner, FOCAL, Rect, look, orbit};
use super::sky::{ELEVATION, Sky};
use super::textures::{brick, checker, grass, lettering, rgb};
use crate::camera::Pose;
use crate::scene::Scene;
use core::f64::consts::PI;
use glam::{DVec2, DVec3};

const HEIGHT: f64 = 2.2;
/// Texels from the apex to the rim of the unrolled side.
const SLANT_TEXELS: f64 = 100.0;
const SEGMENTS: u32 = 256;

/// The scene with the orbit of 60 degrees.
pub(super) fn orbiting() -> Scene {
    geometry().finish("cone-orbit", |s| orbit(-30.0 + 60.0 * s, 5.0, 2.6, 0.7))
}

/// The scene with the rigid translation past it.
pub(super) fn translating() -> Scene {
    geometry().finish("cone-translate", translation)
}

fn translation(s: f64) -> Pose {
    let x = -2.2 + 4.4 * s;
    look(DVec3::new(x, 2.2, 5.0), DVec3::new(x, 0.8, 0.0), FOCAL)
}

fn geometry() -> Builder {
    let mut builder = Builder::new(512, 512);
    let centre = DVec3::new(0.0, 2.4, 4.8);
    Sky { rect: Rect::new(3, 345, 384, 128), azimuth: 1.3, elevation: ELEVATION, centre, radius: 1400.0 }.hang(&mut builder);

    let ground = builder.island(Rect::new(3, 3, 336, 336), |x, y| {
        let (gx, gy) = (x / 336.0, y / 336.0);
        if (gx - 0.3).abs() < 0.1 && (gy - 0.75).abs() < 0.06 {
            lettering(x, y, 5, rgb(20, 20, 20), rgb(220, 215, 200))
        } else if gx > 0.5 {
            checker(x, y, 12.0, [rgb(200, 190, 160), rgb(90, 80, 110)], 3)
        } else {
            grass(x, y, 4)
        }
    });
    builder.quad(ground, DVec3::new(-7.0, 0.0, -9.0), DVec3::X * 14.0, DVec3::Z * 14.0);
    side(&mut builder);
    builder
}

/// The cone's side, unrolled into a sector whose apex is at the left edge of the island.
fn side(builder: &mut Builder) {
    let slant = (1.0 + HEIGHT * HEIGHT).sqrt();
    let half_angle = PI / slant;
    let apex = DVec2::new(0.0, 100.0);
    let island = builder.outlined(Rect::new(345, 3, 104, 200), |x, y| {
        let offset = DVec2::new(x, y) - apex;
        let (r, angle) = (offset.length(), libm::atan2(offset.y, offset.x));
        (r < SLANT_TEXELS + 4.0 && angle.abs() < half_angle + 0.05).then(|| {
            if r > 60.0 {
                brick(angle * 110.0, r, 14.0, 7.0, 2)
            } else {
                checker(angle * 60.0 + 300.0, r, 8.0, [rgb(230, 80, 60), rgb(240, 230, 210)], 6)
            }
        })
    });
    // The cut is on the far side, at -Z.
    let rim = |i: u32| -> Corner {
        let angle = (f64::from(i) / f64::from(SEGMENTS) - 0.5) * 2.0 * PI;
        let (sin, cos) = libm::sincos(angle);
        let (v, u) = libm::sincos(angle / slant);
        (DVec3::new(sin, 0.0, cos), apex + DVec2::new(u, v) * SLANT_TEXELS)
    };
    for i in 0..SEGMENTS {
        builder.triangle(island, [(DVec3::new(0.0, HEIGHT, 0.0), apex), rim(i), rim(i + 1)]);
    }
}
