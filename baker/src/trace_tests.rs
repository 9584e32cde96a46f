//! Tests of `trace`: no leaks, ties, masks, the same hits on any number of threads.

use super::*;
use crate::camera::{Path, Pose};
use crate::gbuffer::{Hits, Lens};
use crate::scene::{Background, Material, Playback, Texture, Triangle, Wrap};
use glam::{Vec2, Vec3};
use std::sync::Arc;

struct Still(Pose);

impl Path for Still {
    fn pose(&self, _: f64) -> Pose {
        self.0
    }
}

fn triangle(position: [DVec3; 3]) -> Triangle {
    Triangle { position, normal: [Vec3::ZERO; 3], uv: [Vec2::ZERO, Vec2::X, Vec2::Y], colour: [Vec3::ONE; 3], material: 0, island: None }
}

fn scene(triangles: Vec<Triangle>, pose: Pose) -> Scene {
    Scene {
        name: "test".into(),
        triangles,
        materials: vec![Material::default()],
        textures: [].into(),
        background: Background::Colour([0; 3]),
        lights: Vec::new(),
        camera: Arc::new(Still(pose)),
        playback: Playback { width: 64, height: 48, frames: 2, fps: 30, looping: false },
        warnings: Vec::new(),
    }
}

/// Quads of a grid of points, two triangles each.
fn quads(points: &[Vec<DVec3>]) -> Vec<Triangle> {
    let mut out = Vec::new();
    for (a, b) in points.iter().zip(&points[1..]) {
        for i in 0..a.len() - 1 {
            out.push(triangle([a[i], b[i], b[i + 1]]));
            out.push(triangle([a[i], b[i + 1], a[i + 1]]));
        }
    }
    out.retain(|t| (t.position[1] - t.position[0]).cross(t.position[2] - t.position[0]).length() > 0.0);
    out
}

fn sphere(centre: DVec3, radius: f64) -> Vec<Triangle> {
    let (rings, sectors) = (60, 90);
    let point = |i: usize, j: usize| {
        let (polar, azimuth) =
            (core::f64::consts::PI * i as f64 / rings as f64, core::f64::consts::TAU * (j % sectors) as f64 / sectors as f64);
        let sine = if i == 0 || i == rings { 0.0 } else { libm::sin(polar) };
        centre + radius * DVec3::new(sine * libm::cos(azimuth), libm::cos(polar), sine * libm::sin(azimuth))
    };
    quads(&(0..=rings).map(|i| (0..=sectors).map(|j| point(i, j)).collect()).collect::<Vec<_>>())
}

fn terrain(centre: DVec3, size: f64) -> Vec<Triangle> {
    let height = |x: f64, z: f64| 0.05 * size * libm::sin(x * 7.0) * libm::cos(z * 5.0);
    let point = |i: usize, j: usize| {
        let (x, z) = (i as f64 / 100.0 - 0.5, j as f64 / 100.0 - 0.5);
        centre + DVec3::new(size * x, height(x, z), size * z)
    };
    quads(&(0..=100).map(|i| (0..=100).map(|j| point(i, j)).collect()).collect::<Vec<_>>())
}

/// What a ray hits, which has to be the same alone and among others.
fn hit(tracer: &Tracer<'_>, origin: DVec3, direction: DVec3) -> Option<Hit> {
    let directions = std::array::from_fn(|at| direction.lerp(DVec3::new(0.1, -0.9, 0.3), 0.01 * (at as f64 - 3.0)));
    assert_eq!(directions[3], direction);
    let (alone, among) = (tracer.hit(origin, direction), tracer.hits(origin, &directions)[3]);
    assert_eq!(alone, among, "{origin} {direction}");
    alone
}

/// Rays at corners and at points of edges; returns (rays, leaks). A hit farther than the target is a leak as well.
fn aim(scene: &Scene, eye: DVec3, keep: impl Fn(DVec3) -> bool) -> (usize, usize) {
    let tracer = Tracer::new(scene);
    let targets: Vec<DVec3> = scene
        .triangles
        .iter()
        .flat_map(|t| {
            let [a, b, c] = t.position;
            [a, b, c].into_iter().chain([(a, b), (b, c), (c, a)].into_iter().flat_map(|(p, q)| [0.5, 0.137, 0.9].map(|s| p.lerp(q, s))))
        })
        .filter(|p| keep(*p))
        .collect();
    // Neighbours together, each alone besides.
    let leaks = targets.par_chunks(PACKET).map(|targets| {
        let direction = |at: &DVec3| (*at - eye) / at.distance(eye);
        let directions = std::array::from_fn(|at| direction(&targets[at.min(targets.len() - 1)]));
        let among = tracer.hits(eye, &directions);
        let leaks = |hit: Option<Hit>, target: &DVec3| hit.is_none_or(|hit| hit.t > target.distance(eye) * (1.0 + 1e-6));
        let leaking = |(target, among): &(&DVec3, Option<Hit>)| leaks(*among, target) || leaks(tracer.hit(eye, direction(target)), target);
        targets.iter().zip(among).filter(leaking).count()
    });
    (targets.len(), leaks.sum())
}

#[test]
fn shared_edges_and_corners_do_not_leak() {
    let mut rays = 0;
    for offset in [DVec3::ZERO, DVec3::new(10_000.0, -10_000.0, 10_000.0)] {
        let pose = Pose::look_at(offset + DVec3::new(0.0, 5.0, 9.0), offset, DVec3::Y, 50.0);
        let ball = scene(sphere(offset, 2.0), pose);
        let inside = offset + DVec3::new(0.3, -0.2, 0.5);
        let found = aim(&ball, inside, |_| true);
        assert_eq!(found.1, 0, "sphere at {offset}: {} of {} leak", found.1, found.0);
        rays += found.0;
        let land = scene(terrain(offset, 40.0), pose);
        for eye in [DVec3::new(3.0, 30.0, 1.0), DVec3::new(0.4, 1e3, 0.2)].map(|e| e + offset) {
            let inner = |p: DVec3| (p - offset).x.abs() < 19.9 && (p - offset).z.abs() < 19.9;
            let found = aim(&land, eye, inner);
            assert_eq!(found.1, 0, "terrain at {offset}: {} of {} leak", found.1, found.0);
            rays += found.0;
        }
    }
    assert!(rays > 100_000, "only {rays} rays");
}

#[test]
fn equal_distances_go_to_the_lowest_triangle() {
    let same = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(2.0, -1.0, 0.0), DVec3::new(-1.0, 2.0, 0.0)];
    let turned = [same[1], same[2], same[0]];
    let pose = Pose::look_at(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, 50.0);
    let s = scene((0..40).map(|i| triangle(if i % 2 == 0 { same } else { turned })).collect(), pose);
    let tracer = Tracer::new(&s);
    for i in 0..50 {
        let at = DVec3::new(f64::from(i % 7) * 0.1 - 0.7, f64::from(i / 7) * 0.1 - 0.7, 0.0);
        let hit = hit(&tracer, pose.eye, (at - pose.eye).normalize()).expect("a hit");
        assert_eq!((hit.triangle, hit.back), (0, false));
        let [p, q, r] = same;
        assert!((p * (1.0 - hit.bary[0] - hit.bary[1]) + q * hit.bary[0] + r * hit.bary[1]).distance(at) < 1e-9);
    }
    assert!(hit(&tracer, -pose.eye, DVec3::Z).expect("the back").back);
}

#[test]
fn cut_out_texels_are_passed_through() {
    let front = [DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 1.0)];
    let pose = Pose::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, 50.0);
    let mut s = scene(vec![triangle(front), triangle(front.map(|p| p - DVec3::Z))], pose);
    let texels = vec![[255; 4], [255, 255, 255, 0], [255, 255, 255, 0], [255; 4]];
    s.textures = [Texture { width: 2, height: 2, texels, wrap: [Wrap::Repeat; 2] }].into();
    s.materials.push(Material { texture: Some(0), alpha_cutoff: Some(0.5), ..Default::default() });
    s.triangles[0].material = 1;
    let tracer = Tracer::new(&s);
    let at = |x: f64, y: f64| hit(&tracer, DVec3::new(x, y, 3.0), DVec3::NEG_Z).map(|h| h.triangle);
    assert_eq!([at(0.2, 0.2), at(0.7, 0.1), at(0.1, 0.7), at(0.9, 0.9)], [Some(0), Some(1), Some(1), None]);
}

#[test]
fn what_has_a_front_alone_is_passed_through_from_behind() {
    let corners = [DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 1.0)];
    let pose = Pose::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, 50.0);
    let mut s = scene(vec![triangle(corners), triangle(corners.map(|p| p - DVec3::Z))], pose);
    s.materials.push(Material { front: true, ..Default::default() });
    s.triangles[1].material = 1;
    let tracer = Tracer::new(&s);
    let seen = |z: f64| {
        let (origin, direction) = (DVec3::new(0.2, 0.2, z), DVec3::NEG_Z * z.signum());
        let alone = hit(&tracer, origin, direction).map(|hit| (hit.triangle, hit.back));
        let [first, ..] = tracer.hits(origin, &[direction; PACKET]);
        assert_eq!(first.map(|hit| (hit.triangle, hit.back)), alone);
        alone
    };
    // From the front the nearer one; from behind the one that has two sides; between them the front again.
    assert_eq!([seen(3.0), seen(-3.0), seen(0.5)], [Some((0, false)), Some((0, true)), Some((1, false))]);
}

#[test]
fn an_empty_scene_is_background() {
    let s = scene(Vec::new(), Pose::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 50.0));
    let hits = Hits::cast(&s, &Tracer::new(&s), &|_, _| {});
    assert!(hits.samples.iter().all(|h| h.surface == crate::gbuffer::BACKGROUND));
}

#[test]
fn pixels_outside_the_scenes_rectangle_are_background() {
    // The G-buffer skips rays that cannot meet the scene's box: it must skip no others.
    let s = scene(sphere(DVec3::new(1.5, 0.7, 0.0), 1.0), Pose::look_at(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO, DVec3::Y, 60.0));
    let tracer = Tracer::new(&s);
    let hits = Hits::cast(&s, &tracer, &|_, _| {});
    let lens = Lens::new(&s, 0);
    for (i, sample) in hits.samples.iter().take(64 * 48).enumerate() {
        let hit = hit(&tracer, lens.eye, lens.direction((i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5));
        assert_eq!(hit.is_some(), sample.surface != crate::gbuffer::BACKGROUND, "pixel {i}");
    }
}
