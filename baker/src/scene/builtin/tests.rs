//! What every built-in scene promises: finite geometry, islands that are disjoint and injective with gutters of
//! their own, a surface behind every ray of the path that is seen from its front, and the same scene every time.

use super::builder::GUTTER;
use super::sky::ELEVATION;
use super::{NAMES, build};
use crate::scene::{Scene, Triangle};
use crate::trace::Tracer;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

fn scenes() -> impl Iterator<Item = Scene> {
    NAMES.iter().map(|name| build(name).expect("a listed name builds"))
}

/// A triangle's corners in texels.
fn texels(scene: &Scene, triangle: &Triangle) -> [DVec2; 3] {
    let sheet = &scene.textures[0];
    triangle.uv.map(|uv| uv.as_dvec2() * DVec2::new(f64::from(sheet.width), f64::from(sheet.height)))
}

fn by_island(scene: &Scene) -> BTreeMap<u16, Vec<&Triangle>> {
    let mut islands = BTreeMap::<u16, Vec<&Triangle>>::new();
    for triangle in &scene.triangles {
        islands.entry(triangle.island.expect("every triangle has an island")).or_default().push(triangle);
    }
    islands
}

fn bounds(scene: &Scene, triangles: &[&Triangle]) -> (DVec2, DVec2) {
    triangles.iter().flat_map(|t| texels(scene, t)).fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

#[test]
fn names_build_and_others_do_not() {
    for (name, scene) in NAMES.iter().zip(scenes()) {
        assert_eq!(*name, scene.name);
        assert_eq!((scene.playback.width, scene.playback.height, scene.playback.frames), (320, 240, 128));
        assert!((100..200_000).contains(&scene.triangles.len()), "{name}: {} triangles", scene.triangles.len());
    }
    assert!(build("terrain").expect("terrain builds").triangles.len() >= 131_072);
    assert!(build("city").is_none());
}

#[test]
fn everything_is_finite_and_on_the_sheet() {
    for scene in scenes() {
        assert_eq!(scene.textures[0].texels.len(), (scene.textures[0].width * scene.textures[0].height) as usize);
        assert!(scene.textures[0].width <= 512 && scene.textures[0].height <= 1024);
        for triangle in &scene.triangles {
            assert!(triangle.position.iter().all(|p| p.is_finite()), "{}", scene.name);
            assert!(triangle.uv.iter().all(|uv| uv.cmpge(glam::Vec2::ZERO).all() && uv.cmple(glam::Vec2::ONE).all()), "{}", scene.name);
            assert_eq!(triangle.material, 0);
        }
    }
}

#[test]
fn islands_are_numbered_apart_and_have_gutters() {
    let gutter = f64::from(GUTTER) - 1e-3;
    for scene in scenes() {
        let islands = by_island(&scene);
        assert!(islands.keys().copied().eq(0..islands.len() as u16), "{}: islands are not numbered without gaps", scene.name);
        let sheet = DVec2::new(f64::from(scene.textures[0].width), f64::from(scene.textures[0].height));
        let boxes: Vec<_> = islands.values().map(|triangles| bounds(&scene, triangles)).collect();
        for (i, (low, high)) in boxes.iter().enumerate() {
            assert!(
                low.min_element() >= gutter && (sheet - *high).min_element() >= gutter,
                "{}: island {i} at the sheet's edge",
                scene.name
            );
            for (j, (other_low, other_high)) in boxes.iter().enumerate().skip(i + 1) {
                let gap = (*other_low - *high).max(*low - *other_high).max_element();
                assert!(gap >= 2.0 * gutter, "{}: islands {i} and {j} are {gap} texels apart", scene.name);
            }
        }
    }
}

#[test]
fn islands_are_injective() {
    for scene in scenes() {
        let sheet = &scene.textures[0];
        for (id, triangles) in by_island(&scene) {
            // Four points a texel, away from the corners that neighbours share.
            let scale = 2;
            let (columns, rows) = (sheet.width as usize * scale, sheet.height as usize * scale);
            let mut owner = BTreeMap::<usize, usize>::new();
            for (number, triangle) in triangles.iter().enumerate() {
                let [a, b, c] = texels(&scene, triangle).map(|p| p * scale as f64 - DVec2::new(0.4871, 0.4613));
                let area = (b - a).perp_dot(c - a);
                if area.abs() < 1e-3 {
                    continue;
                }
                let (low, high) = (a.min(b).min(c).ceil().max(DVec2::ZERO), a.max(b).max(c).floor());
                for y in low.y as usize..=(high.y.max(-1.0) as usize).min(rows - 1) {
                    for x in low.x as usize..=(high.x.max(-1.0) as usize).min(columns - 1) {
                        let p = DVec2::new(x as f64, y as f64);
                        let (u, v) = ((b - p).perp_dot(c - p) / area, (c - p).perp_dot(a - p) / area);
                        // Coordinates are stored in 32 bits: leave a hair at the edges.
                        if u > 1e-3 && v > 1e-3 && u + v < 1.0 - 1e-3 {
                            let before = owner.insert(y * columns + x, number);
                            assert!(before.is_none(), "{}: island {id} folds over itself at texel {}", scene.name, p / scale as f64);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn every_ray_of_the_path_meets_the_front_of_a_surface() {
    for scene in scenes() {
        let tracer = Tracer::new(&scene);
        let steps = (80, 120);
        let mut missed = Vec::new();
        let mut behind = Vec::new();
        for frame in [0, 21, 43, 64, 85, 106, 127] {
            let pose = scene.camera.pose(scene.playback.parameter(f64::from(frame)));
            for j in 0..=steps.1 {
                for i in 0..=steps.0 {
                    // All along the border, where the picture reaches furthest; sparsely inside.
                    let border = i == 0 || j == 0 || i == steps.0 || j == steps.1;
                    if !border && (i % 4 != 0 || j % 4 != 0) {
                        continue;
                    }
                    let (x, y) = (f64::from(i) / f64::from(steps.0) * 320.0, f64::from(j) / f64::from(steps.1) * 240.0);
                    let direction = pose.direction(320, 240, x, y);
                    let Some(hit) = tracer.hit(pose.eye, direction) else {
                        missed.push((frame, x, y, libm::atan2(direction.x, -direction.z), libm::asin(direction.y)));
                        continue;
                    };
                    if hit.back {
                        behind.push((frame, x, y, scene.triangles[hit.triangle as usize].island));
                    }
                }
            }
        }
        assert!(missed.is_empty(), "{}: {} rays miss everything: {:?}", scene.name, missed.len(), &missed[..missed.len().min(12)]);
        assert!(behind.is_empty(), "{}: {} rays see a back: {:?}", scene.name, behind.len(), &behind[..behind.len().min(12)]);
    }
}

#[test]
fn the_sky_is_linear_in_azimuth_and_elevation() {
    let skies = [("cone-orbit", 1.3), ("street", 1.2), ("terrain", 1.2), ("arch", 1.1), ("columns", 1.1)];
    for (name, half_azimuth) in skies {
        let scene = build(name).expect("a listed name builds");
        let sky: Vec<_> = scene.triangles.iter().filter(|triangle| triangle.island == Some(0)).collect();
        let (low, high) = bounds(&scene, &sky);
        let eye = scene.camera.pose(0.5).eye;
        for triangle in sky {
            let centre = triangle.position.iter().sum::<DVec3>() / 3.0;
            let direction = (centre - eye).normalize();
            let turn = 0.5 + 0.5 * libm::atan2(direction.x, -direction.z) / half_azimuth;
            let fall = (ELEVATION[0] - libm::asin(direction.y)) / (ELEVATION[0] - ELEVATION[1]);
            let found = texels(&scene, triangle).iter().sum::<DVec2>() / 3.0;
            let error = (found - (low + (high - low) * DVec2::new(turn, fall))).abs().max_element();
            assert!(error < 0.5, "{name}: {error} texels off");
        }
    }
}

#[test]
fn scenes_are_the_same_every_time() {
    for (first, second) in scenes().zip(scenes()) {
        assert_eq!(first.textures[0].texels, second.textures[0].texels, "{}", first.name);
        let same = |a: &Triangle, b: &Triangle| a.position == b.position && a.uv == b.uv && a.island == b.island;
        assert!(first.triangles.iter().zip(&second.triangles).all(|(a, b)| same(a, b)), "{}", first.name);
    }
}
