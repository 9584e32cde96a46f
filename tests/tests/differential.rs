//! The integer player against the f64 player: the same label, position and colour at every pixel, within stated bounds.
//! Bundles come from the baker; the oracle is `cubist_tests::reference`.
//!
//! The bound on a position, in texels, follows from where the integer player rounds:
//! - a layer in time to nearest: 1 / 2^17;
//! - the left and the right end of a span downwards: 1 / 2^16;
//! - the step along it to nearest: (cell - 1) / 2^17 at its last pixel;
//! - the weights of four keys, each by at most [`WEIGHT`]: three of them times how far their keys are from the fourth. This is the
//!   largest by far for what passes near the camera; it moves whole sheets, and only in time.
//!
//! Wherever label or colour differ, a position that was looked at must be within that bound of an edge between texels.

use cubist_baker::bake::Settings;
use cubist_core::Bundle;
use cubist_core::fixed::ONE;
use cubist_core::format::{TIME_CUBIC, TIME_HOLD, TIME_LINEAR};
use cubist_core::timeline;
use cubist_tests::reference::{Pixel, Reference, Weights};
use cubist_tests::{play, reference, scenes};

/// Pixels whose colour may differ from what the player's own weights ask for, percent.
const DIFFERING: f64 = 0.03;
/// How far a weight of the player may be from the exact one.
const WEIGHT: f64 = 3.0 / ONE as f64;
/// The same for exact weights.
const DIFFERING_IN_TIME: f64 = 0.15;

/// What a comparison found.
#[derive(Debug, Default)]
struct Found {
    pixels: usize,
    /// Pixels whose colour differs.
    colours: usize,
    /// Pixels whose label differs.
    labels: usize,
    /// The farthest that positions of the same label are apart, texels.
    apart: f64,
    /// The largest bound that applied, texels.
    bound: f64,
}

impl Found {
    fn percent(&self) -> f64 {
        100.0 * self.colours as f64 / self.pixels as f64
    }
}

/// The bound of one pixel, texels.
fn bound(pixel: &Pixel, cell: u32, weights: Weights) -> f64 {
    let rounding = f64::from(cell + 2) / f64::from(1u32 << 17);
    let motion = if weights == Weights::Exact { 3.0 * WEIGHT * pixel.motion } else { 0.0 };
    // The slack is what f64 itself rounds.
    rounding + motion + 1e-9
}

fn compare(bytes: &[u8], frames: impl IntoIterator<Item = u32>, weights: Weights) -> Found {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    let reference = Reference::new(&bundle);
    let (width, cell) = (bundle.size().0 as usize, 1 << bundle.path().cell_log2);
    let mut found = Found::default();
    play::visit(bytes, frames, |frame, player| {
        let colours = play::pixels(player);
        let probes = play::probes(player);
        for (index, (exact, (colour, probe))) in reference.frame(frame, weights).iter().zip(colours.into_iter().zip(probes)).enumerate() {
            let place = || format!("frame {frame}, pixel ({}, {})", index % width, index / width);
            let exact = exact.unwrap_or_else(|| panic!("{}: no sheet shows", place()));
            let bound = bound(&exact, cell, weights);
            let at = [probe.at.u, probe.at.v].map(|x| f64::from(x) / 65_536.0);
            if probe.label == exact.label {
                let apart = (at[0] - exact.at[0]).abs().max((at[1] - exact.at[1]).abs());
                assert!(apart <= bound, "{}: {apart:.2e} texels apart, bound {bound:.2e}: {at:?}, {exact:?}", place());
                found.apart = found.apart.max(apart);
            } else {
                found.labels += 1;
            }
            found.colours += usize::from(colour != exact.colour);
            let same = colour == exact.colour && probe.label == exact.label;
            assert!(same || exact.margin <= bound, "{}: differs though no rounding explains it: {at:?}, {exact:?}", place());
            found.bound = found.bound.max(bound);
            found.pixels += 1;
        }
    })
    .expect("the baker's bytes play");
    found
}

/// Compares `frames` with both oracles, prints what was found (seen with `--nocapture`), and asserts the shares that may differ.
fn check(name: &str, bytes: &[u8], frames: impl IntoIterator<Item = u32> + Clone) -> Found {
    let exact = compare(bytes, frames.clone(), Weights::Exact);
    let rounded = compare(bytes, frames, Weights::Player);
    for (weights, found) in [("exact", &exact), ("the player's", &rounded)] {
        println!(
            "{name}, {weights} weights: {:.4} % differ, {} labels, {:.1e} texels apart (bound {:.1e})",
            found.percent(),
            found.labels,
            found.apart,
            found.bound
        );
    }
    // A handful of pixels is no share: three may differ anywhere.
    assert!(rounded.colours <= 3 || rounded.percent() <= DIFFERING, "{name}: {rounded:?}");
    assert!(exact.colours <= 3 || exact.percent() <= DIFFERING_IN_TIME, "{name}: {exact:?}");
    exact
}

fn bake(name: &str, size: [u32; 2], frames: u32, settings: &Settings) -> Vec<u8> {
    scenes::bundle(name, size, frames, settings).expect("a built-in scene bakes")
}

fn settings(cell: u32, key_interval: u32) -> Settings {
    Settings { cell, key_interval, ..Settings::default() }
}

#[test]
fn weights_are_near_the_exact_ones() {
    for time in [TIME_HOLD, TIME_LINEAR, TIME_CUBIC] {
        let mut worst = 0.0f64;
        for length in 1..=64 {
            for (before, after) in [(length, length), (1, 9), (200, 3), (7, 256), (8, 8)] {
                let lengths = [before, length, after];
                for passed in 0..=length {
                    let found = timeline::weights(time, lengths, passed);
                    for (set, missing) in found.iter().zip([[false, false], [true, false], [false, true], [true, true]]) {
                        let exact = reference::weights(time, lengths, f64::from(passed) / f64::from(length), missing);
                        let apart = set.iter().zip(exact).map(|(&weight, exact)| (f64::from(weight) / f64::from(ONE) - exact).abs());
                        worst = apart.fold(worst, f64::max);
                    }
                }
            }
        }
        println!("time {time}: weights are at most {:.2} / {ONE} off", worst * f64::from(ONE));
        assert!(worst <= if time == TIME_CUBIC { WEIGHT } else { 0.5 / f64::from(ONE) }, "time {time}: {worst}");
    }
}

#[test]
fn cells_and_straight_intervals_of_eight_are_exact() {
    // 6 bits of a stored coordinate, 3 of time, 3 down, 3 across: 15 of the 16 there are. Only the 11 bits of a position clamped to
    // the edge of the source image, 3 down, 3 across leave half a unit a step.
    let bytes = bake("street", scenes::SIZE, 33, &Settings { time: TIME_LINEAR, ..settings(8, 8) });
    let found = check("street, 8 and 8", &bytes, [0, 1, 7, 8, 15, 20, 31, 32]);
    assert_eq!((found.colours, found.labels), (0, 0));
    assert!(found.apart <= 3.5 / 65_536.0, "{found:?}");
}

#[test]
fn small_and_large_cells_agree() {
    for (name, cell, interval) in [("columns", 4, 16), ("torus", 16, 8), ("street", 32, 8)] {
        let bytes = bake(name, scenes::SIZE, 32, &settings(cell, interval));
        check(&format!("{name}, cell {cell}"), &bytes, (0..32).step_by(3));
    }
}

#[test]
fn intervals_that_are_no_power_of_two_agree() {
    for (name, interval) in [("arch", 5), ("mirrors", 12), ("terrain", 7)] {
        let bytes = bake(name, scenes::SIZE, 32, &settings(8, interval));
        check(&format!("{name}, keys every {interval}"), &bytes, (0..32).step_by(3));
    }
}

#[test]
fn held_and_straight_time_agree() {
    for (name, time, interval) in [("street", TIME_LINEAR, 7), ("columns", TIME_HOLD, 4)] {
        let bytes = bake(name, scenes::SIZE, 32, &Settings { time, ..settings(8, interval) });
        check(&format!("{name}, time {time}"), &bytes, (0..32).step_by(3));
    }
}

#[test]
fn screens_that_are_no_multiple_of_the_cell_agree() {
    for (name, size, cell, interval) in [("round-columns", [157, 83], 8, 6), ("pyramid", [33, 95], 32, 9), ("wing", [5, 3], 8, 9)] {
        let bytes = bake(name, size, 20, &settings(cell, interval));
        check(&format!("{name}, {size:?}"), &bytes, (0..20).step_by(3));
    }
}

#[test]
fn looping_paths_agree() {
    for (frames, interval) in [(30, 7), (24, 8), (5, 8)] {
        let mut scene = scenes::reduced("cone-orbit", scenes::SIZE, frames).expect("there is such a scene");
        scene.playback.looping = true;
        let (_, encoded) = scenes::bake(&scene, &settings(8, interval)).expect("it bakes");
        check(&format!("cone-orbit looping, {frames} frames, keys every {interval}"), &encoded.bundle, 0..frames);
    }
}

#[test]
fn single_frames_agree() {
    for looping in [false, true] {
        let mut scene = scenes::reduced("pivot", scenes::SIZE, 1).expect("there is such a scene");
        scene.playback.looping = looping;
        let (_, encoded) = scenes::bake(&scene, &Settings::default()).expect("it bakes");
        let found = check("pivot, one frame", &encoded.bundle, [0]);
        assert_eq!((found.colours, found.labels), (0, 0), "looping {looping}");
    }
}

#[test]
fn the_street_agrees_at_full_size() {
    let bytes = bake("street", [320, 240], 12, &Settings::default());
    check("street, full size", &bytes, [0, 5, 9, 11]);
}
