//! Stability: what changes by next to nothing plays next to the same. The scene or the camera moved by a millionth, a frame more or less:
//! quality moves by less than 0.2 dB, and no large area changes its surface.
//! (The same bytes on any number of threads: `determinism.rs`. From debug and release builds: the goldens, which both are held against.)

use cubist_baker::bake::{Encoded, Flat, Settings};
use cubist_baker::camera::{Path, Pose};
use cubist_baker::scene::Scene;
use cubist_core::Bundle;
use cubist_tests::random::Random;
use cubist_tests::{figures, play, scenes};
use glam::DVec3;
use std::sync::Arc;

/// By how much things move, in the scene's units, which are metres.
const LITTLE: f64 = 1e-6;
/// By how much quality may move, dB.
const MOST: f64 = 0.2;
/// Pixels that may change their surface, percent.
const FLIPPED: f64 = 0.5;

const FRAMES: u32 = 24;

fn scene(name: &str) -> Scene {
    let mut scene = scenes::reduced(name, [80, 60], FRAMES).expect("there is such a scene");
    scene.camera = Arc::new(Moved(scene.camera, DVec3::ZERO, f64::from(FRAMES) / 128.0));
    scene
}

/// Another path beside itself, and only the beginning of it.
struct Moved(Arc<dyn Path>, DVec3, f64);

impl Path for Moved {
    fn pose(&self, s: f64) -> Pose {
        let pose = self.0.pose(s * self.2);
        Pose { eye: pose.eye + self.1, ..pose }
    }
}

struct Played {
    psnr: f64,
    flat: Flat,
    encoded: Encoded,
}

fn played(scene: &Scene) -> Played {
    let (flat, encoded) = scenes::bake(scene, &Settings::default()).expect("it bakes");
    let psnr = figures::quality(&encoded.bundle, &flat.atlas).expect("it plays").psnr_mean;
    Played { psnr, flat, encoded }
}

/// The pixels of `frame` whose colour differs by more than neighbouring texels do, percent. (Labels of two bundles have nothing in common.)
fn flipped(a: &Played, b: &Played, frame: u32) -> f64 {
    let pictures = [a, b].map(|of| play::frames(&of.encoded.bundle, [frame]).expect("it plays").remove(0));
    let far = |(a, b): (&u16, &u16)| figures::widen(*a).into_iter().zip(figures::widen(*b)).any(|(a, b)| a.abs_diff(b) > 48);
    let count = pictures[0].iter().zip(&pictures[1]).filter(|&pair| far(pair)).count();
    100.0 * count as f64 / pictures[0].len() as f64
}

#[test]
fn a_millionth_changes_next_to_nothing() {
    for name in ["street", "round-columns", "cone-orbit"] {
        let scene = scene(name);
        let still = played(&scene);
        let mut random = Random(1);
        let mut jitter = || [(); 3].map(|()| (random.below(2001) as f64 / 1000.0 - 1.0) * LITTLE);
        let mut shaken = scene.clone();
        // Every corner by as much as it lies in the same place: surfaces stay closed.
        let mut places = std::collections::BTreeMap::new();
        for corner in shaken.triangles.iter_mut().flat_map(|triangle| &mut triangle.position) {
            let by = *places.entry(corner.to_array().map(f64::to_bits)).or_insert_with(&mut jitter);
            *corner += DVec3::from(by);
        }
        let mut aside = scene.clone();
        aside.camera = Arc::new(Moved(aside.camera, DVec3::new(0.6, -0.5, 0.6) * LITTLE, 1.0));
        for (what, changed) in [("scene", shaken), ("camera", aside)] {
            let moved = played(&changed);
            let change = moved.psnr - still.psnr;
            let most = [0, 5, 12, 23].map(|frame| flipped(&still, &moved, frame)).into_iter().fold(0.0, f64::max);
            let labels = [&still, &moved].map(|of| of.flat.atlas.image.labels.len());
            println!("{name}, the {what} moved: {change:+.3} dB, {most:.3} % of a frame changed, {labels:?} labels");
            assert!(change.abs() < MOST, "{name}, the {what} moved: {change:+.3} dB");
            assert!(most < FLIPPED, "{name}, the {what} moved: {most:.3} % of a frame changed");
        }
    }
}

#[test]
fn a_frame_more_or_less_changes_next_to_nothing() {
    // The last frame is a key: with one frame more every interval but the first few is another, and positions bend between other frames. Rough
    // land has no moment like another: there it is up to a decibel.
    for (name, most) in [("street", MOST), ("cone-orbit", MOST), ("terrain", 1.0)] {
        let psnr = [FRAMES, FRAMES + 1].map(|frames| {
            // The same way in a frame more or less; and at another rate, which is a number for the device and nothing else.
            let mut scene = scene(name);
            scene.playback.frames = frames;
            let slow = played(&scene);
            if frames > FRAMES {
                return slow.psnr;
            }
            scene.playback.fps += 1;
            let fast = played(&scene);
            let [a, b] = [&slow, &fast].map(|of| Bundle::parse(&of.encoded.bundle).expect("it parses").path().records.to_vec());
            assert!(a == b, "{name}: the rate changes what is stored");
            slow.psnr
        });
        println!("{name}, a frame more: {psnr:?}");
        assert!(psnr.iter().all(|of| (of - psnr[0]).abs() < most), "{name}, a frame more: {psnr:?}");
    }
}
