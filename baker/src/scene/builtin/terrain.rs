//! `terrain`: a flight over hills, 131,072 triangles, one island that hides itself.
//! The island is the view from straight above; the relief's shade is painted into it.

use super::builder::{Builder, FOCAL, Rect, look};
use super::noise::fractal;
use super::sky::{ELEVATION, Sky};
use super::textures::{Texel, rgb, shade};
use crate::camera::Pose;
use crate::scene::Scene;
use glam::DVec3;

/// Side of the square, world units.
const SIDE: f64 = 100.0;
/// Quads along each side.
const QUADS: u32 = 256;

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 512);
    let centre = DVec3::new(0.0, 10.0, 28.0);
    Sky { rect: Rect::new(3, 451, 506, 58), azimuth: 1.2, elevation: ELEVATION, centre, radius: 8000.0 }.hang(&mut builder);
    let rect = Rect::new(3, 3, 506, 442);
    let (columns, rows) = (f64::from(rect.w), f64::from(rect.h));
    let island = builder.island(rect, |x, y| paint(x / columns, y / rows));
    builder.surface(island, QUADS, QUADS, |s, t| {
        let (x, z) = ((s - 0.5) * SIDE, (t - 0.5) * SIDE);
        DVec3::new(x, height(x, z), z)
    });
    builder.finish("terrain", path)
}

/// The ground's height: fractal hills, and ridges where a broad noise crosses its middle.
fn height(x: f64, z: f64) -> f64 {
    let ridge = 1.0 - (2.0 * fractal(x * 0.045 + 3.0, z * 0.045 + 1.0, 1, 21) - 1.0).abs();
    let hills = fractal(x * 0.06, z * 0.06, 7, 33);
    (hills - 0.35) * 16.0 + ridge * 4.0
}

fn path(s: f64) -> Pose {
    let z = 46.0 - 36.0 * s;
    let x = 6.0 * libm::sin(s * 2.5);
    let y = height(x, z - 3.0).max(height(x, z)).max(4.0) * 0.15 + 9.0;
    look(DVec3::new(x, y, z), DVec3::new(x + 2.0 * libm::cos(s * 3.0), y - 3.6, z - 12.0), FOCAL)
}

/// Snow, rock, grass or sand by height, shaded by slope; `s`, `t`: 0..1 across the square.
fn paint(s: f64, t: f64) -> Texel {
    let (x, z) = ((s - 0.5) * SIDE, (t - 0.5) * SIDE);
    let here = height(x, z);
    let (east, south) = (height(x + 0.2, z) - here, height(x, z + 0.2) - here);
    let light = (0.9 + 1.2 * (east * 0.8 - south * 0.5)).clamp(0.35, 1.4);
    let grain = fractal(s * 512.0 * 0.2, t * 448.0 * 0.2, 4, 9);
    let cover = match here {
        h if h > 7.5 => rgb(235, 235, 240),
        h if h > 4.0 => rgb(130, 120, 105),
        h if h > 1.0 => rgb(95, 120, 60),
        _ => rgb(150, 140, 100),
    };
    shade(cover, light * (0.7 + 0.6 * grain))
}
