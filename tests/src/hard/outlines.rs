//! Scenes that are hard on outlines: those that roll over curved surfaces, degenerate to a line or a point, or are as fine as the grid.
//! Made by `build`; listed, with the reasons, in `super`.

use super::build::{Build, FOV, look, orbit, sphere};
use cubist_baker::camera::Pose;
use cubist_baker::scene::Scene;
use glam::DVec3;
use libm::sincos;
use std::f64::consts::TAU;

/// A cone whose apex the camera passes straight over.
pub fn the_apex_of_a_cone() -> Scene {
    let mut build = Build::default();
    build.surface(0, [48, 6], |s, t| {
        let (side, front) = sincos(TAU * s);
        DVec3::new(t * side, 1.5 - 1.5 * t, t * front)
    });
    build.quad(3, DVec3::new(-4.0, 0.0, -4.0), DVec3::X * 8.0, DVec3::Z * 8.0);
    build.finish("the-apex-of-a-cone", |s| {
        let eye = DVec3::new(2.4 * (s - 0.5), 4.0, 0.9 * (s - 0.5));
        Pose::look_at(eye, DVec3::new(0.0, 0.8, 0.0), DVec3::NEG_Z, FOV)
    })
}

/// A lump whose silhouette moves over it and changes its shape all the time: its aspect graph has no end.
pub fn a_rolling_silhouette() -> Scene {
    let mut build = Build::default();
    build.surface(1, [64, 32], |s, t| {
        let lumps = 1.0 + 0.22 * sincos(3.0 * TAU * s).0 * sincos(TAU * t).0 + 0.12 * sincos(5.0 * TAU * s + 9.0 * t).0;
        let tip = sincos(TAU * 0.5 * t).0;
        sphere(s, t) * (1.0 + (lumps - 1.0) * tip)
    });
    build.finish("a-rolling-silhouette", |s| orbit(DVec3::ZERO, 60.0 * s, 3.2, 0.8))
}

/// A card that turns until it is exactly edge-on, stays so for some frames, and turns on.
pub fn edge_on() -> Scene {
    let mut build = Build::default();
    build.board(0, DVec3::ZERO, [2.0, 2.0]);
    build.board(1, DVec3::new(0.0, 0.0, -3.0), [14.0, 10.0]);
    build.board(2, DVec3::new(0.9, 0.0, 3.2), [14.0, 10.0]);
    build.finish("edge-on", |s| {
        let turn = (s - 0.5).abs() - 0.1;
        let eye =
            if turn <= 0.0 { DVec3::new(4.0, 0.0, 0.0) } else { orbit(DVec3::ZERO, 90.0 - 80.0 * turn * (0.5 - s).signum(), 4.0, 0.0).eye };
        look(eye, DVec3::ZERO)
    })
}

/// A plain of twenty kilometres from a man's height: the horizon.
pub fn the_horizon() -> Scene {
    let mut build = Build::default();
    build.surface(3, [40, 40], |s, t| DVec3::new(20_000.0 * (s - 0.5), 0.0, 20_000.0 * (t - 0.5)));
    build.cuboid(0, DVec3::new(-3.0, 0.0, -20.0), DVec3::new(1.0, 3.0, -16.0));
    build.finish("the-horizon", |s| {
        let eye = DVec3::new(2.0 * s, 1.7, 4.0 * (1.0 - s));
        look(eye, eye + DVec3::new(0.1 * s, 0.0, -1.0))
    })
}

/// A ball that fills the screen, and is thinner than a pixel in the end.
pub fn a_ball_from_all_to_nothing() -> Scene {
    let mut build = Build::default();
    build.ball(5, DVec3::ZERO, 1.0);
    build.finish("a-ball-from-all-to-nothing", |s| look(DVec3::new(0.01, 0.02, 1.2 * libm::exp(5.0 * s)), DVec3::ZERO))
}

/// A needle a third of a pixel wide at its thick end, before a wall.
pub fn a_needle() -> Scene {
    let mut build = Build::default();
    build.surface(0, [6, 1], |s, t| {
        let (side, front) = sincos(TAU * s);
        DVec3::new(0.012 * (1.0 - t) * side + 1.2 * t - 0.6, 2.4 * t - 1.2, 0.012 * (1.0 - t) * front)
    });
    build.board(1, DVec3::new(0.0, 0.0, -2.0), [12.0, 9.0]);
    build.finish("a-needle", |s| orbit(DVec3::ZERO, -20.0 + 40.0 * s, 3.0, 0.2))
}

/// A fence with a board and a gap in every eight pixels, as wide as a cell, that moves by a fraction of one from frame to frame.
pub fn a_fence_at_the_cells_frequency() -> Scene {
    let mut build = Build::default();
    for board in -10..14 {
        build.board(board as u32 % 2, DVec3::new(8.0 * f64::from(board) + 2.0, -4.0, 0.0), [4.0, 40.0]);
    }
    build.board(6, DVec3::new(0.0, 0.0, -30.0), [240.0, 160.0]);
    build.finish("a-fence-at-the-cells-frequency", |s| {
        let eye = DVec3::new(0.37 + 17.3 * s, 0.0, 48.0);
        look(eye, eye + DVec3::NEG_Z)
    })
}
