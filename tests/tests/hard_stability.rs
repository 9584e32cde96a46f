//! Stability: what changes by next to nothing plays next to the same. The scene or the camera moved by a millionth, a frame more or less:
//! quality moves by less than 0.2 dB, and no large area changes its surface.
//! (The same bytes on any number of threads: `determinism.rs`. From debug and release builds: the goldens, which both are held against.)

use cubist_baker::bake::{Encoded, Flat, Settings};
use cubist_baker::camera::{Path, Pose};
use cubist_baker::scene::Scene;
use cubist_core::Bundle;
use cubist_tests::hard::{Baked, CASES};
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

/// What is better than this has next to no error: by how much says nothing, dB.
const PERFECT: f64 = 50.0;

/// Hard scenes that may move by more, where what is moved: dB and percent of a frame, and why. Five of them are at a place where what is
/// seen jumps.
const SHAKY: [(&str, &str, [f64; 2], &str); 16] = [
    ("along_a_face", "scene", [8.0, 55.0], "an eye in the plane of a floor sees none of it, a millionth above it half a screen of it"),
    ("along_a_face", "camera", [5.0, 55.0], "likewise"),
    ("coplanar_faces", "scene", [MOST, 7.0], "of two faces in one plane, another is in front where they part"),
    ("edge_on", "camera", [1.0, 2.0], "a card that was seen edge-on shows a side"),
    ("edge_on", "scene", [MOST, 2.0], "likewise"),
    ("far_from_the_origin", "scene", [0.5, FLIPPED], "pieces of surface are joined otherwise"),
    ("t_junctions", "scene", [0.3, FLIPPED], "likewise"),
    ("a_ring_on_a_mountain", "scene", [0.3, FLIPPED], "likewise"),
    ("a_soup", "scene", [MOST, 0.8], "likewise"),
    ("around_a_ring", "camera", [MOST, 0.8], "a chart's ends are joined otherwise"),
    ("around_a_ring_and_back", "camera", [MOST, 1.0], "likewise"),
    ("a_standing_camera", "scene", [0.5, FLIPPED], "keys that hardly differ are stored as coarsely as pays, or not"),
    ("the_horizon", "camera", [0.7, FLIPPED], "at 50 dB single pixels at the horizon tell, which see the next texel"),
    ("on_a_surface", "scene", [1.0, FLIPPED], "in the first frame, a cut, the eye sees the surface that it is on, or is behind it"),
    ("on_a_surface", "camera", [1.0, FLIPPED], "likewise"),
    ("half_a_turn_between_two_keys", "scene", [MOST, 1.0], "what two keys do not both see is extrapolated"),
];

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
    labels: usize,
    bundle: Vec<u8>,
}

impl Played {
    fn new(flat: &Flat, encoded: &Encoded) -> Self {
        let psnr = figures::quality(&encoded.bundle, &flat.atlas).expect("it plays").psnr_mean;
        Self { psnr, labels: flat.atlas.image.labels.len(), bundle: encoded.bundle.clone() }
    }
}

fn played(scene: &Scene) -> Played {
    played_as(scene, &Settings::default())
}

fn played_as(scene: &Scene, settings: &Settings) -> Played {
    let (flat, encoded) = scenes::bake(scene, settings).expect("it bakes");
    Played::new(&flat, &encoded)
}

/// The pixels of `frame` whose colour differs by more than neighbouring texels do, percent. (Labels of two bundles have nothing in common.)
fn flipped(a: &Played, b: &Played, frame: u32) -> f64 {
    let pictures = [a, b].map(|of| play::frames(&of.bundle, [frame]).expect("it plays").remove(0));
    let far = |(a, b): (&u16, &u16)| figures::widen(*a).into_iter().zip(figures::widen(*b)).any(|(a, b)| a.abs_diff(b) > 48);
    let count = pictures[0].iter().zip(&pictures[1]).filter(|&pair| far(pair)).count();
    100.0 * count as f64 / pictures[0].len() as f64
}

/// `scene` with every corner moved by as much as `little`, all that lie in one place alike: surfaces stay closed.
fn shaken(scene: &Scene, little: f64) -> Scene {
    let (mut shaken, mut random) = (scene.clone(), Random(1));
    let mut places = std::collections::BTreeMap::new();
    let mut jitter = || [(); 3].map(|()| (random.below(2001) as f64 / 1000.0 - 1.0) * little);
    for corner in shaken.triangles.iter_mut().flat_map(|triangle| &mut triangle.position) {
        let by = *places.entry(corner.to_array().map(f64::to_bits)).or_insert_with(&mut jitter);
        *corner += DVec3::from(by);
    }
    shaken
}

/// `scene` with its camera moved by about `little`.
fn aside(scene: &Scene, little: f64) -> Scene {
    Scene { camera: Arc::new(Moved(scene.camera.clone(), DVec3::new(0.6, -0.5, 0.6) * little, 1.0)), ..scene.clone() }
}

#[test]
fn hard_scenes_are_no_less_stable() {
    for case in &CASES {
        let Baked { scene, flat, encoded } = case.baked().expect("it bakes");
        let corners = || scene.triangles.iter().flat_map(|triangle| triangle.position);
        let [low, high] = corners().fold([DVec3::MAX, DVec3::MIN], |[low, high], corner| [low.min(corner), high.max(corner)]);
        // A millionth of a scene that is no larger than that would be another scene.
        let little = LITTLE * (high - low).length().min(1.0);
        let settings = case.settings();
        let still = Played::new(flat, encoded);
        for (what, changed) in [("scene", shaken(scene, little)), ("camera", aside(scene, little))] {
            let moved = played_as(&changed, &settings);
            let change = moved.psnr.min(PERFECT) - still.psnr.min(PERFECT);
            let most = (0..scene.playback.frames).step_by(4).map(|frame| flipped(&still, &moved, frame)).fold(0.0, f64::max);
            let name = case.name;
            println!("{name}, the {what} moved: {change:+.3} dB, {most:.3} % of a frame changed");
            let allowed = SHAKY.iter().find(|shaky| (shaky.0, shaky.1) == (name, what)).map_or([MOST, FLIPPED], |shaky| shaky.2);
            assert!(change.abs() < allowed[0], "{name}, the {what} moved: {change:+.3} dB");
            assert!(most < allowed[1], "{name}, the {what} moved: {most:.3} % of a frame changed");
        }
    }
}

#[test]
fn a_millionth_changes_next_to_nothing() {
    for name in ["street", "round-columns", "cone-orbit"] {
        let scene = scene(name);
        let still = played(&scene);
        for (what, changed) in [("scene", shaken(&scene, LITTLE)), ("camera", aside(&scene, LITTLE))] {
            let moved = played(&changed);
            let change = moved.psnr - still.psnr;
            let most = [0, 5, 12, 23].map(|frame| flipped(&still, &moved, frame)).into_iter().fold(0.0, f64::max);
            let labels = [&still, &moved].map(|of| of.labels);
            println!("{name}, the {what} moved: {change:+.3} dB, {most:.3} % of a frame changed, {labels:?} labels");
            assert!(change.abs() < MOST, "{name}, the {what} moved: {change:+.3} dB");
            assert!(most < FLIPPED, "{name}, the {what} moved: {most:.3} % of a frame changed");
        }
    }
}

#[test]
fn a_frame_more_or_less_changes_next_to_nothing() {
    // The last frame is a key: with one frame more every interval but the first few is another, and positions bend between other frames. On shorter
    // ways and smaller screens that shows more, on rough land up to a decibel: there is no moment like another. So it does here, more than at full size.
    for name in ["street", "terrain"] {
        let psnr = [128, 129].map(|frames| played(&scenes::reduced(name, [96, 72], frames).expect("there is such a scene")).psnr);
        println!("{name}, a frame more: {psnr:?}");
        assert!((psnr[1] - psnr[0]).abs() < 1.5 * MOST, "{name}, a frame more: {psnr:?}");
    }
}

#[test]
fn the_frame_rate_changes_nothing_that_is_stored() {
    let mut scene = scene("street");
    let slow = played(&scene);
    scene.playback.fps += 1;
    let fast = played(&scene);
    let [a, b] = [&slow, &fast].map(|of| Bundle::parse(&of.bundle).expect("it parses").path().records.to_vec());
    assert!(a == b);
}
