//! The program from outside, without a window: files, figures, messages and exit codes.
//! A bundle from `common` goes in through the built program; what it writes and prints is checked.

mod common;

use common::{SIZE, bundle, bundle_of};
use cubist_core::format::TexelKind;
use cubist_core::{Direct565, Frame, Indexed4, Player, Texels};
use image::AnimationDecoder;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A folder that holds `film.cubist`.
fn folder() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("film.cubist"), bundle()).unwrap();
    dir
}

/// Runs the program in `dir`, with no display.
fn run(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cubist-player"));
    command.current_dir(dir).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").args(arguments).output().unwrap()
}

fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn pixels(path: &Path) -> image::RgbImage {
    image::open(path).unwrap().into_rgb8()
}

/// The colours of frame 4 of `bytes`, as a player of `T` draws it.
fn colours<T: Texels>(bytes: &[u8]) -> Vec<[u8; 3]> {
    let parsed = cubist_core::Bundle::parse(bytes).unwrap();
    let mut memory = vec![0; parsed.memory_needed()];
    let mut player = Player::<T>::with_texels(&parsed, &mut memory).unwrap();
    player.seek(Frame(4));
    let mut out = Vec::new();
    for y in 0..SIZE.1 {
        let mut row = vec![0u16; SIZE.0 as usize];
        player.row(y, &mut row);
        let widen = |value: u16, top: f64| (f64::from(value) * 255.0 / top).round() as u8;
        out.extend(row.iter().map(|&pixel| [widen(pixel >> 11, 31.0), widen(pixel >> 5 & 63, 63.0), widen(pixel & 31, 31.0)]));
    }
    out
}

#[test]
fn texels_of_every_kind_are_shown() {
    let dir = tempfile::tempdir().unwrap();
    let kinds = [(TexelKind::Indexed4, colours::<Indexed4> as fn(&[u8]) -> _), (TexelKind::Direct565, colours::<Direct565>)];
    for (kind, colours) in kinds {
        std::fs::write(dir.path().join("film.cubist"), bundle_of(kind)).unwrap();
        done(&run(dir.path(), &["render", "film.cubist", "--out", "frames", "--frames", "4..=4"]));
        let written = pixels(&dir.path().join("frames/frame-0004.png"));
        let apart = |(a, b): (&image::Rgb<u8>, &[u8; 3])| a.0.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 1);
        let wanted = colours(&bundle_of(kind));
        assert!(written.pixels().len() == wanted.len() && !written.pixels().zip(&wanted).any(apart), "{kind:?}");
        assert!(done(&run(dir.path(), &["measure", "film.cubist", "--json"])).contains("frames_per_second"));
    }
}

#[test]
fn render_writes_the_pixels_the_core_plays() {
    let dir = folder();
    done(&run(dir.path(), &["render", "film.cubist", "--out", "new/frames", "--frames", "1..=7", "--every", "3", "--scale", "2"]));
    let out = dir.path().join("new/frames");
    assert_eq!(names(&out), ["frame-0001.png", "frame-0004.png", "frame-0007.png"]);

    let bytes = bundle();
    let parsed = cubist_core::Bundle::parse(&bytes).unwrap();
    let mut memory = vec![0; parsed.memory_needed()];
    let mut player = cubist_core::Player::new(&parsed, &mut memory).unwrap();
    player.seek(cubist_core::Frame(4));
    let written = pixels(&out.join("frame-0004.png"));
    assert_eq!(written.dimensions(), (SIZE.0 * 2, SIZE.1 * 2));
    let mut row = vec![0u16; SIZE.0 as usize];
    let mut colours = std::collections::BTreeSet::new();
    for y in 0..SIZE.1 {
        player.row(y, &mut row);
        for (x, &pixel) in (0..).zip(&row) {
            let widen = |value: u16, top: f64| (f64::from(value) * 255.0 / top).round() as u8;
            let expected = [widen(pixel >> 11, 31.0), widen(pixel >> 5 & 63, 63.0), widen(pixel & 31, 31.0)];
            for corner in [(0, 0), (1, 1)] {
                let found = written.get_pixel(2 * x + corner.0, 2 * y + corner.1).0;
                // Repeating the high bits is within one step of exact scaling.
                assert!(expected.iter().zip(found).all(|(&e, f)| e.abs_diff(f) <= 1), "{x}, {y}: {found:?} for {expected:?}");
            }
            colours.insert(pixel);
        }
    }
    assert!(colours.len() > 10, "the test's picture is flat");
    assert_ne!(pixels(&out.join("frame-0001.png")), pixels(&out.join("frame-0007.png")));
}

#[test]
fn a_gif_lasts_as_long_as_the_film() {
    let dir = folder();
    done(&run(dir.path(), &["render", "film.cubist", "--gif", "film.gif"]));
    let file = std::io::BufReader::new(std::fs::File::open(dir.path().join("film.gif")).unwrap());
    let frames = image::codecs::gif::GifDecoder::new(file).unwrap().into_frames().collect_frames().unwrap();
    assert_eq!(frames.len() as u32, SIZE.2);
    let milliseconds: u32 = frames.iter().map(|f| f.delay().numer_denom_ms()).map(|(n, d)| n / d).sum();
    assert_eq!(milliseconds, 1000 * SIZE.2 / SIZE.3);
}

#[test]
fn without_a_display_the_pictures_go_to_files() {
    let dir = folder();
    let output = run(dir.path(), &["film.cubist", "--frames", "3"]);
    assert!(done(&output).contains("12 of 96 x 64, 30 frames/s"));
    assert!(String::from_utf8_lossy(&output.stderr).contains("No display (neither DISPLAY nor WAYLAND_DISPLAY is set)"));
    assert_eq!(names(&dir.path().join("cubist-demo")), ["demo.gif", "frame-0000.png", "frame-0001.png", "frame-0002.png"]);
}

#[test]
fn a_headless_shot_shows_the_window() {
    let dir = folder();
    done(&run(dir.path(), &["--headless", "--shot", "out.png", "--frames", "10", "film.cubist", "--scale", "4"]));
    done(&run(dir.path(), &["render", "film.cubist", "--out", ".", "--frames", "9..10", "--scale", "4"]));
    let (shot, frame) = (pixels(&dir.path().join("out.png")), pixels(&dir.path().join("frame-0009.png")));
    assert!(shot.height() > frame.height(), "there is a strip below the picture");
    let top = image::imageops::crop_imm(&shot, (shot.width() - frame.width()) / 2, 0, frame.width(), frame.height()).to_image();
    assert_eq!(top, frame);
    assert_eq!(names(dir.path()), ["film.cubist", "frame-0009.png", "out.png"]);
}

#[test]
fn measure_prints_one_json_document() {
    let dir = folder();
    let figures: serde_json::Value = serde_json::from_str(&done(&run(dir.path(), &["measure", "film.cubist", "--json"]))).unwrap();
    assert_eq!(figures["bytes"]["bundle"], bundle().len());
    assert_eq!(figures["memory"]["row"], SIZE.0 * 2);
    assert_eq!(figures["sections"].as_array().unwrap().len(), 3);
    let mean = |name: &str| figures["work"][name]["mean"].as_f64().unwrap();
    assert_eq!(mean("smooth_pixels") + mean("torn_pixels"), f64::from(SIZE.0 * SIZE.1));
    assert!(figures["work"]["keys"]["max"].as_u64().unwrap() >= 1);
    assert!(done(&run(dir.path(), &["measure", "film.cubist"])).contains("section ATLS"));
}

#[test]
fn messages_name_the_file_and_the_exit_code_tells_whose_fault_it_is() {
    let dir = folder();
    std::fs::write(dir.path().join("text.cubist"), "hello").unwrap();
    let mut damaged = bundle();
    damaged[100] ^= 1;
    std::fs::write(dir.path().join("damaged.cubist"), damaged).unwrap();
    for (arguments, code, message) in [
        (vec!["measure", "gone.cubist"], 1, "gone.cubist: no such file"),
        (vec!["measure", "text.cubist"], 1, "text.cubist: not a Cubist bundle"),
        (vec!["damaged.cubist"], 1, "damaged.cubist: damaged: checksum"),
        (vec!["render", "film.cubist", "--out", "film.cubist"], 1, "film.cubist: the folder cannot be made"),
        (vec!["render", "film.cubist", "--out", "o", "--frames", "5..13"], 2, "the bundle, which has frames 0..12"),
        (vec!["render", "film.cubist", "--out", "o", "--frames", "5"], 2, "write A..B"),
        (vec!["render", "film.cubist"], 2, "--out"),
        (vec!["render", "film.cubist", "--gif", "film.png"], 2, "expected FILE.gif"),
        (vec!["film.cubist", "other.cubist"], 2, "expected one input, found \"other.cubist\" too"),
    ] {
        let output = run(dir.path(), &arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(message), "{arguments:?}: {error}");
    }
    assert_eq!(names(dir.path()), ["damaged.cubist", "film.cubist", "text.cubist"], "a failed run leaves nothing");
}

#[test]
fn the_bundle_is_not_written_over() {
    let dir = folder();
    // However it is called.
    std::fs::rename(dir.path().join("film.cubist"), dir.path().join("film.gif")).unwrap();
    let output = run(dir.path(), &["render", "film.gif", "--gif", "./film.gif"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && !said.contains("expected FILE.gif"), "{said}");
    assert_eq!(std::fs::read(dir.path().join("film.gif")).unwrap(), bundle());
}

#[cfg(unix)]
#[test]
fn an_interrupted_render_leaves_no_half_file() {
    let dir = folder();
    // A scale that takes seconds, so that the signal comes in the middle.
    let mut child = Command::new(env!("CARGO_BIN_EXE_cubist-player"))
        .current_dir(dir.path())
        .args(["render", "film.cubist", "--gif", "new/film.gif", "--scale", "16"])
        .spawn()
        .unwrap();
    let begun = || std::fs::read_dir(dir.path().join("new")).is_ok_and(|mut files| files.next().is_some());
    while !begun() {
        assert!(child.try_wait().unwrap().is_none(), "done before it was interrupted");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!dir.path().join("new").exists());
}

#[cfg(unix)]
#[test]
fn a_device_is_no_bundle() {
    let dir = folder();
    let output = run(dir.path(), &["measure", "/dev/zero"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("/dev/zero: is a device or a pipe"));
}
