//! `pyramid`: an orbit of 60 degrees around a four-sided pyramid: an object with a finite aspect graph.
//! From eye height the sides appear and disappear as wholes; each is an island of its own.

use super::builder::{Builder, Corner, Rect, orbit};
use super::noise::fractal;
use super::sky::{ELEVATION, Sky};
use super::textures::{Texel, lettering, masonry, mix, rgb, shade};
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// Half the base's side, and the height.
const HALF: f64 = 1.7;
const HEIGHT: f64 = 2.3;
/// Texels along a side's foot and from there to the apex.
const FOOT: f64 = 136.0;
const RISE: f64 = 114.0;

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 512);
    let centre = DVec3::new(0.0, 1.5, 5.2);
    Sky { rect: Rect::new(3, 345, 336, 128), azimuth: 1.2, elevation: ELEVATION, centre, radius: 1400.0 }.hang(&mut builder);
    let ground = builder.island(Rect::new(3, 3, 336, 336), desert);
    builder.quad(ground, DVec3::new(-7.0, 0.0, -9.0), DVec3::X * 14.0, DVec3::Z * 14.0);
    // The sun stands on the right: each side has its own light. In the order +Z, +X, -Z, -X.
    for (number, light) in [1.0, 1.14, 0.8, 0.68].into_iter().enumerate() {
        side(&mut builder, number as u32, light);
    }
    builder.finish("pyramid", |s| orbit(-30.0 + 60.0 * s, 5.4, 1.5, 0.85))
}

/// Side `number`, counted counter-clockwise from the one that faces +Z, as bright as `light`.
fn side(builder: &mut Builder, number: u32, light: f64) {
    let rect = Rect::new(345, 3 + 120 * number, FOOT as u32, RISE as u32);
    let island = builder.outlined(rect, |x, y| {
        let inside = (x - 0.5 * FOOT).abs() <= 0.5 * FOOT * y / RISE + 3.0;
        inside.then(|| shade(DVec3::from(stone(x, y, number).map(f64::from)), light))
    });
    let (sin, cos) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][number as usize];
    let turned = |x: f64, z: f64| DVec3::new(x * cos + z * sin, 0.0, z * cos - x * sin);
    let corners: [Corner; 3] = [
        (DVec3::new(0.0, HEIGHT, 0.0), DVec2::new(0.5 * FOOT, 0.0)),
        (turned(-HALF, HALF), DVec2::new(0.0, RISE)),
        (turned(HALF, HALF), DVec2::new(FOOT, RISE)),
    ];
    builder.triangle(island, corners);
}

/// Courses of sandstone with a pale cap, a frieze above the foot and, on the first side, a door.
fn stone(x: f64, y: f64, number: u32) -> Texel {
    let from_middle = (x - 0.5 * FOOT).abs();
    if number == 0 && from_middle < 9.0 && y > 90.0 {
        return if from_middle < 6.0 && y > 94.0 { [38, 28, 24] } else { [224, 196, 140] };
    }
    if (78.0..87.0).contains(&y) {
        return lettering(x, y - 79.0, 40 + number, rgb(96, 52, 34), rgb(222, 190, 132));
    }
    let cap = y < 26.0;
    let colours = if cap {
        [rgb(214, 206, 186), rgb(232, 222, 198), rgb(248, 242, 224)]
    } else {
        [rgb(132, 104, 66), rgb(196, 156, 98), rgb(228, 194, 134)]
    };
    masonry(x, y, [12.0, 6.0], colours, 50 + number)
}

/// Rippled sand with a paved way to the door, and the pyramid's shadow on the left.
fn desert(x: f64, y: f64) -> Texel {
    let (wx, wz) = (x / 24.0 - 7.0, y / 24.0 - 9.0);
    let shadow = wx > -3.9 && wx < -HALF && wz.abs() < HALF * (wx + 3.9) / (3.9 - HALF);
    let light = if shadow { 0.62 } else { 1.0 };
    if wx.abs() < 0.55 && wz > HALF {
        let slabs = [rgb(150, 124, 88), rgb(206, 184, 144), rgb(226, 208, 170)];
        return shade(DVec3::from(masonry(x, y, [13.0, 9.0], slabs, 61).map(f64::from)), light);
    }
    let bend = 14.0 * fractal(x * 0.02, y * 0.02, 3, 62);
    let ripple = 0.5 + 0.5 * libm::sin(y * 0.55 + x * 0.12 + bend);
    let sand = mix(rgb(206, 164, 104), rgb(240, 208, 150), 0.55 * ripple + 0.45 * fractal(x * 0.05, y * 0.05, 4, 63));
    shade(sand, light * (0.86 + 0.28 * fractal(x * 0.5, y * 0.5, 2, 64)))
}
