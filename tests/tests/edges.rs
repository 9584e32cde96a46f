//! Scenes and settings at the edge of what is allowed: tiny and tall screens, a frame or two, a camera that stands still,
//! nothing to see. Each is baked, parsed, played and compared with the rays that were cast.

use cubist_baker::bake::Settings;
use cubist_baker::camera::{Path, Pose};
use cubist_baker::scene::{Background, Scene, Texture, Wrap};
use cubist_core::{Bundle, ByteOrder, Player};
use cubist_tests::figures::{self, Quality};
use cubist_tests::{play, scenes};
use glam::DVec3;
use std::sync::Arc;

/// The beginning of another camera's path, as slow as its own 128 frames are.
struct Beginning(Arc<dyn Path>, f64);

impl Path for Beginning {
    fn pose(&self, s: f64) -> Pose {
        self.0.pose(s * self.1)
    }
}

fn street(size: [u32; 2], frames: u32) -> Scene {
    let mut scene = scenes::reduced("street", size, frames).expect("there is such a scene");
    scene.camera = Arc::new(Beginning(scene.camera, f64::from(frames) / 128.0));
    scene
}

/// Bakes and plays `scene`: its bytes, and how well they play.
fn check(scene: &Scene, settings: &Settings) -> (Vec<u8>, Quality) {
    let (flat, encoded) = scenes::bake(scene, settings).expect("it bakes");
    let quality = figures::quality(&encoded.bundle, &flat.atlas).expect("it plays");
    let bundle = Bundle::parse(&encoded.bundle).expect("the baker's bytes parse");
    let play = scene.playback;
    assert_eq!(
        (bundle.size(), bundle.frames(), bundle.fps(), bundle.looping()),
        ((play.width, play.height), play.frames, play.fps, play.looping)
    );
    println!("{} {}x{}, {} frames: {} bytes, {quality:?}", scene.name, play.width, play.height, play.frames, encoded.bundle.len());
    (encoded.bundle.clone(), quality)
}

/// A key a frame, every sheet and every residual kept: what is left is what cells of 8 pixels cannot follow.
fn dense() -> Settings {
    let mut settings = Settings { key_interval: 1, least_pixels: 1, ..Settings::default() };
    settings.coding.lambda = 0.0;
    settings
}

#[test]
fn screens_of_any_shape_play() {
    // The field of view is that of the height: a screen 300 pixels wide and 1 high looks to all sides at once.
    for (size, least) in [([1, 1], 90.0), ([2, 300], 32.0), ([300, 1], 24.0), ([128, 64], 21.3), ([240, 240], 27.2), ([120, 200], 25.8)] {
        let (_, quality) = check(&street(size, 5), &dense());
        assert!(quality.psnr_mean > least, "{size:?}: {quality:?}");
        assert!(quality.wrong_surface_percent < if size[1] == 1 { 5.0 } else { 1.0 }, "{size:?}: {quality:?}");
    }
}

#[test]
fn paths_of_one_to_three_frames_play_nearly_as_they_were_cast() {
    for (frames, looping) in [(1, false), (2, false), (3, false), (1, true), (2, true), (3, true)] {
        let mut scene = street(scenes::SIZE, frames);
        scene.playback.looping = looping;
        let (_, quality) = check(&scene, &dense());
        assert!(quality.psnr_mean > 23.8 && quality.wrong_surface_percent < 0.7, "{frames} frames, looping {looping}: {quality:?}");
    }
}

#[test]
fn every_cell_and_key_interval_plays() {
    let scene = street([70, 50], 12);
    for (cell, key_interval, least) in [(4, 1, 21.8), (8, 256, 18.7), (16, 3, 17.8), (32, 11, 16.0), (32, 12, 16.0)] {
        let (_, quality) = check(&scene, &Settings { cell, key_interval, least_pixels: 1, ..Settings::default() });
        assert!(quality.psnr_mean > least && quality.wrong_surface_percent < 7.0, "cell {cell}, keys every {key_interval}: {quality:?}");
    }
}

/// A camera that stands at one moment of another's path.
struct Still(Pose);

impl Path for Still {
    fn pose(&self, _: f64) -> Pose {
        self.0
    }
}

#[test]
fn a_camera_that_stands_still_shows_one_picture() {
    let mut scene = street(scenes::SIZE, 20);
    scene.camera = Arc::new(Still(scene.camera.pose(0.3)));
    let (still, quality) = check(&scene, &Settings::default());
    assert!(quality.psnr_mean > 23.8 && quality.wrong_surface_percent < 0.5, "{quality:?}");
    // What is left is perspective within a cell: cells half as large have a quarter of the error.
    let (_, finer) = check(&scene, &Settings { cell: 4, ..Settings::default() });
    assert!(finer.psnr_mean > quality.psnr_mean + 2.0, "{finer:?}");
    let frames = play::frames(&still, 0..20).expect("it plays");
    let different = |picture: &[u16]| picture.iter().zip(&frames[0]).filter(|(a, b)| a != b).count();
    let most = frames.iter().map(|picture| different(picture)).max().unwrap_or(0);
    // Nothing moves: at most a few pixels between texels where residuals were weighed against bits differently from key to key.
    assert!(most * 100 <= frames[0].len(), "{most} of {} pixels change", frames[0].len());
    // And what comes after the first key costs next to nothing.
    let bundle = Bundle::parse(&still).expect("the baker's bytes parse");
    let (first, second) = (bundle.record(0).len(), bundle.record(1).len());
    assert!(second * 4 < first, "{first} bytes, then {second}");
}

/// The current frame with outlines that are not antialiased and that are, how many pixels differ, and how many were smoothed.
fn smoothed(player: &mut Player<'_>) -> ([Vec<u16>; 2], usize, usize) {
    let plain = play::pixels(player);
    let before = player.work().smoothed_pixels;
    let smooth = play::whole(player, |player, y, out| player.smooth_row(y, out));
    let changed = plain.iter().zip(&smooth).filter(|(a, b)| a != b).count();
    ([plain, smooth], changed, (player.work().smoothed_pixels - before) as usize)
}

#[test]
fn blocks_of_one_sheet_have_no_outlines_even_where_they_are_drawn_pixel_by_pixel() {
    // In a picture 128 texels wide there are no runs.
    let mut settings = Settings::default();
    settings.atlas.max_side = 128;
    let bytes = scenes::bundle("street", [96, 64], 3, &settings).expect("a built-in scene bakes");
    play::visit(&bytes, [1], |_, player| {
        let before = player.work().torn_pixels;
        let ([plain, _], changed, smoothed) = smoothed(player);
        // Both pictures were counted.
        let torn = (player.work().torn_pixels - before) as usize / 2;
        assert!(
            0 < changed && changed <= smoothed && smoothed <= torn && torn < plain.len(),
            "{changed}, {smoothed}, {torn} of {}",
            plain.len()
        );
    })
    .expect("it plays");
}

#[test]
fn antialiased_outlines_are_means_and_nothing_else_changes() {
    let bytes = scenes::bundle("street", [96, 64], 3, &Settings::default()).expect("a built-in scene bakes");
    play::visit(&bytes, [1], |_, player| {
        let ([plain, smooth], changed, smoothed) = smoothed(player);
        assert!(changed > 50 && changed <= smoothed && smoothed * 3 < plain.len() * 2, "{changed} of {smoothed} of {}", plain.len());
        // In the other byte order the same colours are mixed.
        player.set_byte_order(if cfg!(target_endian = "big") { ByteOrder::LittleEndian } else { ByteOrder::BigEndian });
        let swapped = play::whole(player, |player, y, out| player.smooth_row(y, out));
        assert!(swapped.into_iter().map(u16::swap_bytes).eq(smooth));
    })
    .expect("it plays");
}

/// A camera that looks away from everything.
fn nothing(background: Background) -> Scene {
    let mut scene = scenes::reduced("pyramid", [100, 60], 10).expect("there is such a scene");
    scene.triangles.clear();
    scene.background = background;
    scene
}

#[test]
fn a_plain_background_is_its_colour_everywhere() {
    let (bytes, quality) = check(&nothing(Background::Colour([32, 64, 96])), &Settings::default());
    assert_eq!(quality.psnr_min, 99.0);
    let expected = 32 >> 3 << 11 | 64 >> 2 << 5 | 96 >> 3;
    assert!(play::frames(&bytes, 0..10).expect("it plays").iter().flatten().all(|&pixel| pixel == expected));
}

#[test]
fn a_picture_as_background_stands_still() {
    let texels = (0..50 * 30u32).map(|i| [(i % 50 * 5) as u8, (i / 50 * 8) as u8, (i % 7 * 30) as u8, 255]).collect();
    let picture = Texture { width: 50, height: 30, texels, wrap: [Wrap::Clamp; 2] };
    let (bytes, quality) = check(&nothing(Background::Image(picture)), &Settings::default());
    assert!(quality.psnr_min > 40.0, "{quality:?}");
    let frames = play::frames(&bytes, 0..10).expect("it plays");
    assert!(frames.iter().all(|picture| *picture == frames[0]));
}

#[test]
fn one_triangle_in_front_of_nothing_plays() {
    let mut scene = nothing(Background::Colour([0, 0, 0]));
    let pose = scene.camera.pose(0.0);
    let corner = |x: f64, y: f64| pose.eye + pose.forward * 4.0 + pose.right * x + pose.up * y;
    let mut triangle = scenes::reduced("pyramid", [8, 8], 1).expect("there is such a scene").triangles[0];
    triangle.position = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.0, 0.6)];
    scene.camera = Arc::new(Still(pose));
    scene.triangles.push(triangle);
    let (_, quality) = check(&scene, &Settings::default());
    assert!(quality.psnr_mean > 27.0 && quality.wrong_surface_percent < 0.5, "{quality:?}");
}

#[test]
fn an_eye_inside_a_surface_bakes() {
    let mut scene = street([64, 48], 6);
    let mut pose = scene.camera.pose(0.0);
    pose.eye = scene.triangles[0].position[0] + DVec3::splat(1e-9);
    scene.camera = Arc::new(Still(pose));
    check(&scene, &Settings::default());
}
