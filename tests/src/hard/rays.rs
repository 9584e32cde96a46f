//! Scenes that are hard on rays: where a ray meets an edge, a corner, two faces at once, none quite, or numbers far from one.
//! Made by `build`; listed, with the reasons, in `super`.

use super::build::{Build, look, moved, orbit, town, town_path};
use cubist_baker::scene::Scene;
use glam::DVec3;

/// The paint of what stands behind a closed surface and must not be seen through it.
pub const BEHIND: u32 = 7;

/// A closed wall whose corners lie exactly under pixel centres in every frame, in front of one that must not show.
pub fn shared_edges() -> Scene {
    let mut build = Build::default();
    let at = |i: i32, j: i32| DVec3::new(f64::from(4 * i) + 0.5, f64::from(4 * j) + 0.5, 0.0);
    for (i, j) in (-12..16).flat_map(|i| (-8..8).map(move |j| (i, j))) {
        let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        let uv = corners.map(|corner| [corner.x / 64.0, corner.y / 64.0]);
        // Diagonals both ways: 4 to 8 triangles meet in a corner.
        let turn = ((i + j).rem_euclid(2)) as usize;
        for order in [[0, 1, 2], [0, 2, 3]].map(|order| order.map(|corner| (corner + turn) % 4)) {
            build.triangle(0, order.map(|corner| corners[corner]), order.map(|corner| uv[corner]));
        }
    }
    build.board(BEHIND, DVec3::new(0.0, 0.0, -4.0), [400.0, 400.0]);
    build.finish("shared-edges", |s| {
        let eye = DVec3::new(libm::round(19.0 * s), 0.0, 48.0);
        look(eye, eye + DVec3::NEG_Z)
    })
}

/// A floor whose own plane the eye moves in: on a screen of odd height the middle row of rays runs along it.
pub fn along_a_face() -> Scene {
    let mut build = Build::default();
    build.quad(3, DVec3::new(-40.0, 0.0, -60.0), DVec3::X * 80.0, DVec3::Z * 120.0);
    build.cuboid(0, DVec3::new(-8.0, -6.0, -12.0), DVec3::new(2.0, 7.0, -2.0));
    build.board(5, DVec3::new(0.0, 0.0, -58.0), [150.0, 110.0]);
    let mut scene = build.finish("along-a-face", |s| {
        let eye = DVec3::new(16.0 * s - 8.0, 0.0, 30.0);
        look(eye, eye + DVec3::NEG_Z)
    });
    scene.playback.height = 49;
    scene
}

/// A box seen from within, near one of its corners.
pub fn inside_a_solid() -> Scene {
    let mut build = Build::default();
    build.cuboid(0, DVec3::splat(-1.0), DVec3::splat(1.0));
    build.finish("inside-a-solid", |s| {
        let eye = DVec3::new(0.6, -0.5, 0.7);
        look(eye, eye + orbit(DVec3::ZERO, 180.0 + 100.0 * s, 1.0, 0.2 - 0.4 * s).forward)
    })
}

/// An eye that starts exactly on a slanting floor and rises from it.
pub fn on_a_surface() -> Scene {
    let mut build = Build::default();
    let slant = |x: f64, z: f64| DVec3::new(x, 0.3 * x - 0.1 * z, z);
    build.surface(3, [4, 4], |s, t| slant(20.0 * s - 10.0, 20.0 * t - 10.0));
    build.cuboid(1, DVec3::new(-2.0, -1.0, -5.0), DVec3::new(0.0, 2.5, -3.0));
    build.finish("on-a-surface", move |s| {
        let ground = slant(1.0, 3.0);
        look(ground + DVec3::Y * (1.5 * s), slant(0.0, -4.0) + DVec3::Y * 0.4)
    })
}

/// Two boards that overlap in one slanting plane, of triangles that share no corner.
pub fn coplanar_faces() -> Scene {
    let mut build = Build::default();
    let (right, up) = (DVec3::new(0.9, 0.1, 0.3), DVec3::new(-0.07, 1.1, 0.2));
    let corner = |x: f64, y: f64| right * x + up * y;
    build.quad(0, corner(-1.5, 1.0), right * 2.0, up * -2.0);
    build.quad(1, corner(-0.4, 0.7), right * 1.9 + up * 0.3, up * -1.3 - right * 0.1);
    build.finish("coplanar-faces", |s| orbit(DVec3::ZERO, -20.0 + 40.0 * s, 4.0, 1.0 - 1.5 * s))
}

/// A wall of slivers a ten-thousandth as wide as high, with triangles of no area at all lying on it, before one that must not show.
pub fn slivers() -> Scene {
    let mut build = Build::default();
    let (mut x, mut thin) = (-3.0f64, true);
    while x < 3.0 {
        let next = if thin { x + 4e-4 } else { (x + 0.37).min(3.0) };
        let corners = [DVec3::new(x, -2.0, 0.0), DVec3::new(next, -2.0, 0.0), DVec3::new(next, 2.0, 0.0), DVec3::new(x, 2.0, 0.0)];
        let uv = corners.map(|corner| [corner.x / 6.0, corner.y / 6.0]);
        for order in [[0, 1, 2], [0, 2, 3]] {
            build.triangle(0, order.map(|corner| corners[corner]), order.map(|corner| uv[corner]));
        }
        // On a line, on a point, and on a line with the middle corner last.
        build.triangle(4, [corners[0], corners[3], (corners[0] + corners[3]) * 0.5], [[0.0; 2]; 3]);
        build.triangle(4, [corners[0]; 3], [[0.0; 2]; 3]);
        (x, thin) = (next, !thin);
    }
    build.board(BEHIND, DVec3::new(0.0, 0.0, -1.0), [40.0, 40.0]);
    build.finish("slivers", |s| orbit(DVec3::ZERO, -15.0 + 30.0 * s, 2.6, 0.3))
}

/// The town as it is: what the next two are held against.
pub fn town_at_home() -> Scene {
    town().finish("town", town_path)
}

/// The town 10 km from the origin.
pub fn far_from_the_origin() -> Scene {
    Scene { name: "far-from-the-origin".into(), ..moved(&town_at_home(), 1.0, DVec3::new(10_000.0, 500.0, -10_000.0)) }
}

/// The town a millionth as large.
pub fn a_millionth() -> Scene {
    Scene { name: "a-millionth".into(), ..moved(&town_at_home(), 1e-6 / 12.0, DVec3::ZERO) }
}

/// A ring two centimetres wide on a mountain two kilometres high, both in the picture.
pub fn a_ring_on_a_mountain() -> Scene {
    let mut build = Build::default();
    build.surface(3, [16, 16], |s, t| {
        let (x, z) = (6000.0 * (s - 0.5), 6000.0 * (t - 0.5));
        DVec3::new(x, 2000.0 - 0.9 * x.hypot(z) * 0.75, z)
    });
    let ring = DVec3::new(0.0, 2000.006, 0.0);
    build.ring(2, ring, [0.008, 0.002]);
    build.finish("a-ring-on-a-mountain", move |s| orbit(ring, -20.0 + 40.0 * s, 0.05, 0.02 + 0.01 * s))
}
