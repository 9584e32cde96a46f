//! Unusual but right: displays of other shapes, paths of one frame and of ten thousand, looping or not. Each is baked, played and compared
//! with exact rays; bounds are on the mean PSNR and on pixels of a wrong surface.

use cubist_baker::bake::Settings;
use cubist_baker::camera::{Path, Pose};
use cubist_baker::scene::Scene;
use cubist_core::{Bundle, Frame, Player};
use cubist_tests::figures::{self, Quality};
use cubist_tests::{play, scenes};
use std::sync::Arc;

/// A part of another camera's path, as slow as its own 128 frames are; around, if that says so.
struct Part {
    path: Arc<dyn Path>,
    share: f64,
    back: bool,
}

impl Path for Part {
    fn pose(&self, s: f64) -> Pose {
        // There and back again: the end is the beginning.
        let s = if self.back { 1.0 - (2.0 * s - 1.0).abs() } else { s };
        self.path.pose(s * self.share)
    }
}

/// The scene `name` on a screen of `size`, `frames` of its own 128.
fn part(name: &str, size: [u32; 2], frames: u32, looping: bool) -> Scene {
    let mut scene = scenes::reduced(name, size, frames).expect("there is such a scene");
    scene.camera = Arc::new(Part { path: scene.camera, share: (f64::from(frames) / 128.0).min(1.0), back: looping });
    scene.playback.looping = looping;
    scene
}

/// Bakes and plays `scene`, and holds it to a mean PSNR and a share of wrong pixels.
fn check(scene: &Scene, settings: &Settings, psnr: f64, wrong: f64) -> Vec<u8> {
    let (flat, encoded) = scenes::bake(scene, settings).expect("it bakes");
    let bundle = Bundle::parse(&encoded.bundle).expect("the baker's bytes parse");
    let of = scene.playback;
    let (size, frames, looping) = (bundle.size(), bundle.frames(), bundle.looping());
    assert_eq!((size, frames, looping), ((of.width, of.height), of.frames, of.looping));
    let quality: Quality = figures::quality(&encoded.bundle, &flat.atlas).expect("it plays");
    println!("{} {size:?}, {frames} frames, looping {looping}: {} bytes, {quality:?}", scene.name, encoded.bundle.len());
    assert!(quality.psnr_mean >= psnr && quality.wrong_surface_percent <= wrong, "{} {size:?}, {frames} frames: {quality:?}", scene.name);
    encoded.bundle.clone()
}

#[test]
fn displays_of_every_usual_size_play() {
    // Round watches, banners, portrait and landscape panels.
    for (size, psnr, wrong) in
        [([240, 240], 23.7, 0.4), ([128, 64], 22.6, 0.8), ([135, 240], 24.7, 0.4), ([240, 320], 24.6, 0.4), ([480, 320], 24.6, 0.4)]
    {
        check(&part("street", size, 4, false), &Settings::default(), psnr, wrong);
    }
}

#[test]
fn the_largest_usual_display_plays() {
    let mut settings = Settings { cell: 16, ..Settings::default() };
    settings.atlas.max_side = 1024;
    check(&part("cone-orbit", [800, 480], 2, false), &settings, 32.3, 0.1);
}

#[test]
fn pictures_play() {
    for (name, psnr, wrong) in [("street", 25.6, 1.0), ("torus", 26.1, 1.2), ("mirrors", 25.3, 1.9)] {
        for looping in [false, true] {
            let bytes = check(&part(name, [160, 120], 1, looping), &Settings::default(), psnr, wrong);
            let frames = play::frames(&bytes, [0, 0, 1, u32::MAX]).expect("it plays");
            assert!(frames.iter().all(|picture| *picture == frames[0]), "{name}: whatever frame is asked for");
        }
    }
}

#[test]
fn loops_play_around() {
    for (frames, psnr, wrong) in [(31, 17.4, 2.1), (48, 19.0, 1.8)] {
        let bytes = check(&part("street", [96, 72], frames, true), &Settings::default(), psnr, wrong);
        let shown = play::frames(&bytes, [0, 1, frames - 1, frames, frames + 1, 7 * frames - 1]).expect("it plays");
        assert!(shown[..3] == shown[3..], "the frame after the last is the first");
    }
}

#[test]
fn ten_thousand_frames_play() {
    for looping in [false, true] {
        let mut scene = part("pyramid", [12, 8], 10_000, looping);
        scene.name = format!("{} looping {looping}", scene.name);
        let bytes = check(&scene, &Settings::default(), 17.7, 6.2);
        let bundle = Bundle::parse(&bytes).expect("it parses");
        let mut memory = vec![0; bundle.memory_needed()];
        let mut player = Player::new(&bundle, &mut memory).expect("the memory it asked for");
        // A frame is as near at the end as at the beginning.
        for frame in [9_999, 0, 5_000, 9_998, 1, 7_777] {
            player.seek(Frame(frame));
            assert!(player.work().keys <= u32::from(bundle.limits().seek_keys), "frame {frame}: {:?}", player.work());
        }
    }
}
