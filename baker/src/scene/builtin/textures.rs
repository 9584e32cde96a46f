//! The painted materials of the built-in scenes: brick, checker, grass, lettering, house fronts, sky.
//! A texel position comes in, a colour goes to the sheet that `builder` paints. Each is a plain
//! function of the position: no state, no table, the same bytes on every host.

use super::noise::{fractal, hash};
use glam::DVec3;

/// A texel as it is stored, R G B.
pub(super) type Texel = [u8; 3];

/// A colour with channels 0..=255.
pub(super) const fn rgb(r: u8, g: u8, b: u8) -> DVec3 {
    DVec3::new(r as f64, g as f64, b as f64)
}

/// `colour` times `factor`, clamped to what a texel holds.
pub(super) fn shade(colour: DVec3, factor: f64) -> Texel {
    (colour * factor).clamp(DVec3::ZERO, DVec3::splat(255.0)).to_array().map(|channel| channel as u8)
}

/// The colour `t` of the way from `a` to `b`.
pub(super) fn mix(a: DVec3, b: DVec3, t: f64) -> DVec3 {
    a + (b - a) * t
}

/// Bricks of `width` x `height` texels, every other row shifted by half a brick.
pub(super) fn brick(x: f64, y: f64, width: f64, height: f64, seed: u32) -> Texel {
    masonry(x, y, [width, height], [rgb(170, 165, 150), rgb(150, 70, 50), rgb(190, 110, 80)], seed)
}

/// Like [`brick`] with `colours` of one's own: the mortar, and the two ends of the stones' range.
pub(super) fn masonry(x: f64, y: f64, size: [f64; 2], colours: [DVec3; 3], seed: u32) -> Texel {
    let [width, height] = size;
    let row = (y / height).floor();
    let shifted = if row as i64 & 1 == 1 { x + width * 0.5 } else { x };
    let column = (shifted / width).floor();
    let grain = 0.75 + 0.5 * fractal(x * 0.15, y * 0.15, 4, seed);
    if shifted - column * width < 1.0 || y - row * height < 1.0 {
        return shade(colours[0], grain);
    }
    shade(mix(colours[1], colours[2], hash(column as i32, row as i32, seed)), grain)
}

/// Squares of `size` texels in two worn colours.
pub(super) fn checker(x: f64, y: f64, size: f64, colours: [DVec3; 2], seed: u32) -> Texel {
    let square = ((x / size).floor() + (y / size).floor()) as i64;
    let grain = 0.7 + 0.6 * fractal(x * 0.12, y * 0.12, 5, seed);
    shade(colours[(square & 1) as usize], grain)
}

/// Meadow: green to dry, in patches.
pub(super) fn grass(x: f64, y: f64, seed: u32) -> Texel {
    let patch = fractal(x * 0.03, y * 0.03, 4, seed);
    let blade = fractal(x * 0.25, y * 0.25, 3, seed + 9);
    shade(mix(rgb(60, 110, 40), rgb(150, 130, 80), patch), 0.6 + 0.8 * blade)
}

/// Rows of invented letters, 5 x 7 texels in cells of 7 x 10, in `ink` on `paper`.
pub(super) fn lettering(x: f64, y: f64, seed: u32, ink: DVec3, paper: DVec3) -> Texel {
    let (column, row) = ((x / 7.0).floor(), (y / 10.0).floor());
    let (gx, gy) = ((x - column * 7.0).floor() as i32, (y - row * 10.0).floor() as i32);
    let (column, row) = (column as i32, row as i32);
    let grain = 0.85 + 0.3 * fractal(x * 0.1, y * 0.1, 3, seed);
    let inside = gx < 5 && gy < 7;
    // A fifth of the cells are spaces; the rest are mirrored left to right, which is what makes them look like letters.
    let inked = inside && hash(column, row, seed) > 0.2 && hash(column * 7 + gx.min(4 - gx), row * 11 + gy, seed + 3) > 0.45;
    shade(if inked { ink } else { paper }, grain)
}

/// A house front of `width` x `height` texels: windows of 4 x 5 in cells of 8 x 8, a quarter of them lit,
/// and a shop sign at the foot of every third one.
pub(super) fn house_front(x: f64, y: f64, width: f64, height: f64, seed: u32) -> Texel {
    let tone = |k: u32, range: f64, low: f64| low + range * hash(k as i32, seed as i32, k);
    let wall = mix(DVec3::new(tone(1, 100.0, 120.0), tone(2, 90.0, 100.0), tone(3, 90.0, 90.0)), DVec3::splat(130.0), 0.3);
    let grain = 0.75 + 0.5 * fractal(x * 0.2, y * 0.2, 3, seed);
    if y > height - 8.0 && y < height - 1.0 && seed.is_multiple_of(3) {
        return lettering(x, y - (height - 8.0), seed, rgb(240, 230, 90), rgb(40, 40, 80));
    }
    let (px, py) = (x % 8.0, y % 8.0);
    if (2.0..6.0).contains(&px) && (2.0..7.0).contains(&py) && x < width - 1.0 {
        let lit = hash((x / 8.0) as i32, (y / 8.0) as i32, seed + 5) > 0.75;
        let pane = if lit { rgb(240, 220, 130) } else { rgb(40, 50, 70) };
        shade(mix(pane, DVec3::splat(90.0), 0.15 * hash(px as i32, py as i32, seed)), 1.0)
    } else {
        shade(wall, grain)
    }
}

/// Sky of `width` x `height` texels: deep blue above, pale at the foot, clouds.
pub(super) fn sky(x: f64, y: f64, width: f64, height: f64) -> Texel {
    let clouds = fractal(x * 6.0 / width, y * 8.0 / height, 5, 77);
    let air = mix(rgb(110, 150, 210), rgb(190, 210, 235), (y / height).min(1.0));
    shade(mix(air, DVec3::splat(250.0), ((clouds - 0.5) * 3.0).clamp(0.0, 0.9)), 1.0)
}
