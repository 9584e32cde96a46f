//! The real window, where there is a display (`xvfb-run cargo test -p cubist-player` makes one).
//! A bundle from `common` goes in; the pixels that were presented come back as a PNG.

mod common;

use common::{SIZE, bundle};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The colours of the strip and of the timeline's played part.
const STRIP: [u8; 3] = [24, 27, 33];
const PLAYED: [u8; 3] = [96, 165, 250];

#[test]
fn the_window_presents_picture_and_overlay() {
    if std::env::var_os("DISPLAY").is_none_or(|d| d.is_empty()) {
        println!("skipped: no DISPLAY is set; run under xvfb-run");
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("film.cubist"), bundle()).unwrap();
    let program = env!("CARGO_BIN_EXE_cubist-player");
    let arguments = ["film.cubist", "--shot", "shot.png", "--frames", "10", "--scale", "4"];
    let mut command = Command::new(program);
    let mut child = command.current_dir(dir.path()).args(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("the window shows nothing after a minute");
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let output = child.wait_with_output().unwrap();
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(status.success(), "{messages}");
    assert!(!messages.contains("No display"), "the display was refused: {messages}");

    let shot = image::open(dir.path().join("shot.png")).unwrap().into_rgb8();
    assert!(shot.width() >= SIZE.0 * 4 && shot.height() > SIZE.1 * 4, "{:?}", shot.dimensions());
    let count = |colour: [u8; 3]| shot.pixels().filter(|p| p.0 == colour).count();
    assert!(count(STRIP) > 1000 && count(PLAYED) > 100, "the overlay is missing");

    // The picture itself, block by block, as `render` writes it.
    let rendered =
        Command::new(program).current_dir(dir.path()).args(["render", "film.cubist", "--out", ".", "--frames", "9..10"]).output().unwrap();
    assert!(rendered.status.success());
    let frame = image::open(dir.path().join("frame-0009.png")).unwrap().into_rgb8();
    let left = (shot.width() - SIZE.0 * 4) / 2;
    let top = (0..shot.height()).find(|&y| shot.get_pixel(left + 1, y) == frame.get_pixel(0, 0)).expect("the picture's corner shows");
    for (x, y, pixel) in frame.enumerate_pixels() {
        assert_eq!(shot.get_pixel(left + 4 * x + 2, top + 4 * y + 2), pixel, "{x}, {y}");
    }
}
