//! Scenes that are hard on sheets: many of them in a cell, some for a moment only, surfaces that are no surface of a solid.
//! Made by `build`; listed, with the reasons, in `super`.

use super::build::{Build, look, orbit};
use cubist_baker::scene::Scene;
use glam::DVec3;
use libm::sincos;
use std::f64::consts::{PI, TAU};

/// Edges that end on other edges on the screen: the outline of one surface stops at that of another, before a third.
pub fn t_junctions() -> Scene {
    let mut build = Build::default();
    build.board(1, DVec3::new(0.0, 0.0, -3.0), [16.0, 12.0]);
    for i in 0..3 {
        let x = 1.3 * f64::from(i) - 1.4;
        build.board(2 + i as u32, DVec3::new(x, 0.5, -1.0), [0.8, 2.2]);
    }
    build.board(0, DVec3::new(0.0, -0.9, 0.0), [3.6, 1.3]);
    build.finish("t-junctions", |s| orbit(DVec3::ZERO, -18.0 + 36.0 * s, 4.0, 0.6))
}

/// Four boards one behind the other whose corners meet on the screen, so that one cell has a sheet of each and the wall's.
pub fn four_sheets_in_a_cell() -> Scene {
    let mut build = Build::default();
    build.board(7, DVec3::new(0.0, 0.0, -2.5), [16.0, 12.0]);
    for (paint, (x, y)) in (0..).zip([(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]) {
        let z = 0.5 * f64::from(paint);
        // Each a little short of the middle, by more the farther it is in front.
        let (width, gap) = (1.1, 0.03 * z);
        build.board(paint, DVec3::new(x * (0.5 * width + gap), y * (0.5 * width + gap), z - 1.0), [width; 2]);
    }
    build.finish("four-sheets-in-a-cell", |s| orbit(DVec3::ZERO, -12.0 + 24.0 * s, 4.5, 0.5 - s))
}

/// A board that shows through a slit for three frames between two keys.
pub fn a_sheet_between_two_keys() -> Scene {
    let mut build = Build::default();
    build.board(0, DVec3::new(-3.06, 0.0, 0.0), [6.0, 6.0]);
    build.board(0, DVec3::new(3.06, 0.0, 0.0), [6.0, 6.0]);
    build.board(1, DVec3::new(0.0, 0.0, -12.0), [60.0, 60.0]);
    // Seen through the slit from three of the places along the path only.
    build.board(2, DVec3::new(-0.4, 0.0, -3.0), [0.25, 3.0]);
    build.finish("a-sheet-between-two-keys", |s| {
        let eye = DVec3::new(2.4 * s - 0.9, 0.0, 3.0);
        look(eye, eye + DVec3::NEG_Z)
    })
}

/// A strip with one side.
pub fn a_moebius_strip() -> Scene {
    let mut build = Build::default();
    build.surface(4, [60, 4], |s, t| {
        let (side, front) = sincos(TAU * s);
        let (lean, out) = sincos(PI * s);
        let across = 0.9 * (t - 0.5);
        let reach = 1.2 + across * out;
        DVec3::new(reach * side, across * lean, reach * front)
    });
    build.finish("a-moebius-strip", |s| orbit(DVec3::ZERO, 50.0 * s, 3.2, 1.6))
}

/// A soup: five leaves on one edge, two boards through each other, a triangle there twice, once the other way round.
pub fn a_soup() -> Scene {
    let mut build = Build::default();
    for leaf in 0..5 {
        let (side, front) = sincos(TAU * f64::from(leaf) / 5.0 + 0.3);
        build.quad(leaf, DVec3::new(-1.0, 1.0, 0.0), DVec3::new(side, 0.0, front) * 0.9, DVec3::NEG_Y * 2.0);
    }
    build.quad(5, DVec3::new(0.2, 0.9, -0.5), DVec3::new(1.3, 0.0, 0.9), DVec3::NEG_Y * 1.6);
    build.quad(6, DVec3::new(0.2, 0.7, 0.5), DVec3::new(1.3, 0.2, -0.9), DVec3::NEG_Y * 1.6);
    let [a, b, c] = [DVec3::new(-0.5, -1.3, 0.8), DVec3::new(1.2, -1.2, 0.7), DVec3::new(0.3, -0.4, 0.9)];
    build.triangle(7, [a, b, c], [[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]]);
    build.triangle(2, [c, b, a], [[0.5, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    build.finish("a-soup", |s| orbit(DVec3::ZERO, -30.0 + 45.0 * s, 3.6, 0.7))
}
