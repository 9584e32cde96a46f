//! `wing`: an orbit around a flying wing coloured by the pressure on it: data on a surface.
//! Top and bottom are an island each; the colour map has bands, so that the field can be read off the picture.

use super::builder::{Builder, FOCAL, Rect, look};
use super::sky::Sky;
use super::textures::{Texel, mix, rgb, shade};
use crate::camera::Pose;
use crate::scene::Scene;
use core::f64::consts::PI;
use glam::{DVec2, DVec3};

/// Half the span, world units; every other length is a fraction of it.
const HALF_SPAN: f64 = 3.0;
/// How much the leading edge sweeps back.
const SWEEP: f64 = 0.65;
/// The trailing edge's saw: distances from the middle line and where the edge is there.
const TRAILING: [(f64, f64); 6] = [(0.0, 0.82), (0.14, 0.73), (0.38, 0.885), (0.62, 0.73), (0.94, 0.935), (1.0, 0.66)];
/// Where the middle of the planform is, from the nose.
const MIDDLE: f64 = 0.46;
/// Bands of the colour map.
const BANDS: f64 = 14.0;
/// Texels: the span, and from the nose to the hindmost tip.
const SIZE: [u32; 2] = [360, 170];

/// Elevations that the path sees, radians.
const SKY: [f64; 2] = [1.0, -1.26];

pub(super) fn build() -> Scene {
    let mut builder = Builder::new(512, 512);
    let rect = Rect::new(3, 355, 400, 150);
    let azimuth = 2.5;
    Sky { rect, azimuth, elevation: SKY, centre: DVec3::ZERO, radius: 1000.0 }
        .hang_painted(&mut builder, |_, y| haze(SKY[0] + (SKY[1] - SKY[0]) * y / 150.0));
    side(&mut builder, true);
    side(&mut builder, false);
    builder.finish("wing", path)
}

/// From above and the left around the nose, and down to the underside: fast past the moment when the wing is edge-on.
fn path(s: f64) -> Pose {
    let (sin, cos) = libm::sincos((-46.0 + 92.0 * s).to_radians());
    let (up, out) = libm::sincos((46.0 - 76.0 * s * s).to_radians());
    look(DVec3::new(out * sin, up, out * cos) * 6.7, DVec3::ZERO, FOCAL)
}

/// A clear sky by `elevation`, radians: blue above, bright at the horizon, hazy blue-grey below.
fn haze(elevation: f64) -> Texel {
    let horizon = rgb(226, 234, 242);
    if elevation > 0.0 {
        shade(mix(horizon, rgb(86, 132, 196), (elevation * 1.5).min(1.0)), 1.0)
    } else {
        shade(mix(horizon, rgb(140, 160, 184), (elevation * -1.4).min(1.0)), 1.0)
    }
}

/// The trailing edge at `x`, -1..=1.
fn trailing(x: f64) -> f64 {
    let x = x.abs();
    let piece = TRAILING.windows(2).find(|pair| x <= pair[1].0).unwrap_or(&TRAILING[4..]);
    let ((x0, z0), (x1, z1)) = (piece[0], piece[1]);
    z0 + (z1 - z0) * (x - x0) / (x1 - x0)
}

/// Where along the chord, 0..=1, the fraction `t` of the island's rows is: finer towards the leading edge, where the surface turns.
fn chord_at(t: f64) -> f64 {
    0.3 * t + 0.7 * t * t
}

/// Half the thickness at `x` and `c` of the chord: a symmetric four-digit airfoil, and the cockpit's hump.
fn thickness(x: f64, c: f64) -> f64 {
    let airfoil = 5.0 * (0.2969 * c.sqrt() - 0.126 * c - 0.3516 * c * c + 0.2843 * c * c * c - 0.1036 * c * c * c * c);
    let hump = 1.0 + 1.5 * libm::exp(-x * x / 0.022);
    // The tip closes.
    let tip = (1.0 - libm::pow(x.abs(), 8.0)).max(0.0);
    airfoil * 0.085 * hump * tip * (trailing(x) - SWEEP * x.abs())
}

/// Adds the top or the bottom.
fn side(builder: &mut Builder, top: bool) {
    let [w, h] = SIZE.map(f64::from);
    let scale = h / 0.94;
    // Seen from its own side with the nose up, the span runs the other way on the bottom.
    let hand = if top { -1.0 } else { 1.0 };
    let island = builder.outlined(Rect::new(3, if top { 3 } else { 179 }, SIZE[0], SIZE[1]), |u, v| {
        let x = (2.0 * u / w - 1.0) * hand;
        let (nose, tail) = (SWEEP * x.abs(), trailing(x));
        let row = v / scale;
        (row > nose - 0.03 && row < tail + 0.03).then(|| coloured(x, ((row - nose) / (tail - nose)).clamp(0.0, 1.0), top))
    });
    // Columns at the saw's teeth, with eight to sixteen between.
    let mut stations = Vec::new();
    for pair in TRAILING.windows(2) {
        let steps = 8 + (20.0 * (pair[1].0 - pair[0].0)) as u32;
        stations.extend((0..steps).map(|k| pair[0].0 + (pair[1].0 - pair[0].0) * f64::from(k) / f64::from(steps)));
    }
    stations.push(1.0);
    let mirrored: Vec<f64> = stations.iter().skip(1).rev().map(|x| -x).chain(stations.iter().copied()).collect();
    let rows = 40;
    builder.patch(island, mirrored.len() as u32 - 1, rows, |i, j| {
        let u = mirrored[i as usize];
        let x = u * hand;
        let t = f64::from(j) / f64::from(rows);
        let c = chord_at(t);
        let (nose, tail) = (SWEEP * x.abs(), trailing(x));
        let y = thickness(x, c) * if top { 1.15 } else { -0.7 };
        let point = DVec3::new(x, y, MIDDLE - (nose + (tail - nose) * c)) * HALF_SPAN;
        (point, DVec2::new((u + 1.0) * 0.5 * w, (nose + (tail - nose) * t) * scale))
    });
}

/// The pressure field at `x`, -1..=1, and `c` of the chord, about 0..1: a made-up one, smooth, with what a wing shows:
/// suction behind the leading edge, less towards the tips, recovery towards the tail, two intakes.
fn pressure(x: f64, c: f64, top: bool) -> f64 {
    let spot = |x0: f64, c0: f64, wide: f64, long: f64| {
        let (dx, dc) = ((x.abs() - x0) / wide, (c - c0) / long);
        libm::exp(-dx * dx - dc * dc)
    };
    let load = 1.0 - 0.6 * x * x;
    if top {
        0.16 + 0.85 * (1.0 - libm::exp(-2.6 * c)) * (1.1 - 0.35 * load) + 0.3 * libm::exp(-16.0 * c)
            - 0.26 * load * spot(0.0, 0.3, 0.9, 0.3)
            - 0.16 * spot(0.2, 0.34, 0.1, 0.2)
    } else {
        0.36 + 0.5 * libm::exp(-4.0 * c) * load + 0.16 * libm::sin(PI * c) * spot(0.34, 0.6, 0.3, 0.4) - 0.2 * spot(0.0, 0.55, 0.14, 0.35)
    }
}

/// The banded colour map, with a dark line where bands meet.
fn coloured(x: f64, t: f64, top: bool) -> Texel {
    const STOPS: [DVec3; 7] =
        [rgb(52, 36, 132), rgb(38, 110, 214), rgb(40, 188, 196), rgb(110, 206, 88), rgb(244, 216, 64), rgb(240, 128, 40), rgb(186, 30, 46)];
    let band = |x: f64, t: f64| (pressure(x, chord_at(t.clamp(0.0, 1.0)), top).clamp(0.0, 0.9999) * BANDS).floor();
    let here = band(x, t);
    let (dx, dt) = (2.0 / f64::from(SIZE[0]), 1.0 / 80.0);
    let line = here != band(x + dx, t) || here != band(x, t + dt);
    let place = (here + 0.5) / BANDS * (STOPS.len() - 1) as f64;
    let low = (place as usize).min(STOPS.len() - 2);
    shade(mix(STOPS[low], STOPS[low + 1], place - low as f64), if line { 0.62 } else { 1.0 })
}
