//! The integer player against the f64 player: the same label, position and colour at every pixel, within stated bounds.
//! Bundles come from the baker; the oracle is `cubist_tests::reference`.
//!
//! The bound on a position, in texels, follows from where the integer player rounds:
//! - a layer in time to nearest: 1 / 2^17;
//! - the left and the right end of a span downwards: 1 / 2^16;
//! - the step along it to nearest: (cell - 1) / 2^17 at its last pixel.
//! - for a look-up, positions are packed in tiles of up to 8 by 8 pixels, to the nearest of 256 steps a texel, and so are the step along a row,
//!   those from row to row and how the former changes (`reference::packed`): 12.5 steps in tiles of 8 by 8, 2 more where space is cubic.
//!
//! Where space is cubic, what the nodes around add to a cell makes its positions up to 3/2 as far off as its layers. Both second differences are
//! rounded to nearest, which adds up to cell^2 / 8 times 1 / 2^17 each; what they add to an edge and to the step across is rounded downwards:
//! 1 / 2^17 and (cell - 1) / 2^17 (`reference::rounded`).
//!
//! A field, in pixels, is rounded downwards to 1 / 2^8 in time.
//!
//! Time weights are exact at keys 1, 2, 4, 8 or 16 frames apart throughout. Elsewhere each is rounded to 1 / 2^14, once; that moves
//! whole sheets, in time only, and by as much as the keys are apart: half a unit for each of three of the keys, times how
//! far they are from the fourth. Such paths are compared twice: with the exact weights, where that bound applies, and with the player's,
//! where the same does as everywhere.
//!
//! Wherever label or colour differ, a position that was looked at must be within the bound of an edge between texels, or a field of zero.

use cubist_baker::atlas::{self, Storage};
use cubist_baker::bake::Settings;
use cubist_baker::patch;
use cubist_baker::scene::builtin;
use cubist_core::fixed::{MAX_FIELD, ONE, field_distance};
use cubist_core::format::{SPACE_CUBIC, SPACE_LINEAR, TIME_CUBIC, TIME_HOLD, TIME_LINEAR, TexelKind};
use cubist_core::timeline;
use cubist_core::{AnyTexels, Bundle, Direct565, Indexed4, Indexed8, Texels};
use cubist_tests::random::Random;
use cubist_tests::reference::{Pixel, Reference, Weights};
use cubist_tests::{play, reference, scenes};

/// Pixels whose colour may differ, percent, in tiles of four pixels and eight: nearly all there are, torn blocks too.
const DIFFERING: [f64; 2] = [0.5, 1.2];
/// How much more where weights are rounded and the oracle's are exact, percent.
const DIFFERING_IN_TIME: f64 = 0.05;
/// How far a weight of the player may be from the exact one: half a unit, and what Q28 leaves.
const WEIGHT: f64 = 0.5 / ONE as f64 + 8.0 / (1u32 << 28) as f64;

/// The screen of most comparisons, pixels.
const SIZE: [u32; 2] = [96, 72];

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
    /// Pixels that a field was asked for.
    fields: usize,
}

impl Found {
    fn percent(&self) -> f64 {
        100.0 * self.colours as f64 / self.pixels as f64
    }
}

/// The side of a bundle's tiles, pixels.
fn tile(bytes: &[u8]) -> u32 {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    reference::tile(1 << bundle.path().cell_log2)
}

/// The bounds of one pixel: on positions, texels, and on fields, pixels.
fn bounds(pixel: &Pixel, cell: u32, space: u8, width_log2: u32, weights: Weights) -> [f64; 2] {
    let unit = 1.0 / f64::from(1u32 << 17);
    let packed = reference::packed(cell, space, width_log2);
    let off = if weights == Weights::Exact { WEIGHT } else { 0.0 };
    let spread = if space == SPACE_CUBIC { reference::SPREAD } else { 1.0 };
    // The slack is what f64 itself rounds.
    [
        packed + reference::rounded(cell, space) * unit + spread * 3.0 * off * pixel.motion + 1e-9,
        1.0 / 256.0 + reference::rounded(cell, SPACE_LINEAR) * unit + off * pixel.shift + reference::PAIRS * pixel.reach[1] + 1e-9,
    ]
}

fn compare<T: Texels>(bytes: &[u8], frames: impl IntoIterator<Item = u32>, weights: Weights, round: bool) -> Found {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    let reference = Reference::new(&bundle);
    let (width, cell) = (bundle.size().0 as usize, 1 << bundle.path().cell_log2);
    let width_log2 = u32::from(bundle.atlas().width_log2);
    let mut found = Found::default();
    play::visit_as::<T>(bytes, frames, |frame, player| {
        let colours = play::pixels(player);
        let probes = play::probes(player);
        for (index, (exact, (colour, probe))) in reference.frame(frame, weights).iter().zip(colours.into_iter().zip(probes)).enumerate() {
            let place = || format!("frame {frame}, pixel ({}, {})", index % width, index / width);
            let exact = exact.unwrap_or_else(|| panic!("{}: no sheet shows", place()));
            let [bound, outline] = bounds(&exact, cell, bundle.path().space, width_log2, if round { Weights::Player } else { weights });
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
            let close = exact.margin <= bound + reference::PAIRS * exact.reach[0] || exact.outline <= outline;
            assert!(same || close, "{}: differs though no rounding explains it: {at:?}, {exact:?}", place());
            found.bound = found.bound.max(bound);
            found.fields += usize::from(exact.outline < f64::INFINITY);
            found.pixels += 1;
        }
    })
    .expect("the baker's bytes play");
    found
}

/// Whether all key intervals are of one length whose weights need no rounding.
fn round_intervals(bytes: &[u8]) -> bool {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    let count = bundle.intervals() as isize;
    let length = bundle.interval_length(0);
    // A path of one frame has an interval of none.
    (0..count).all(|interval| bundle.interval_length(interval) == length) && [0, 1, 2, 4, 8, 16].contains(&length)
}

/// Compares `frames` with the oracle, prints what was found (seen with `--nocapture`), and asserts the shares that may differ.
fn check(name: &str, bytes: &[u8], frames: impl IntoIterator<Item = u32> + Clone) -> Found {
    check_as::<Indexed8>(name, bytes, frames)
}

/// Like [`check`], by a player of texels that `T` names.
fn check_as<T: Texels>(name: &str, bytes: &[u8], frames: impl IntoIterator<Item = u32> + Clone) -> Found {
    let round = round_intervals(bytes);
    let most = DIFFERING[tile(bytes).ilog2() as usize - 2];
    let kinds = [("exact", Weights::Exact, if round { most } else { most + DIFFERING_IN_TIME }), ("the player's", Weights::Player, most)];
    let found = kinds.iter().take(if round { 1 } else { 2 }).map(|&(kind, weights, most)| {
        let found = compare::<T>(bytes, frames.clone(), weights, round);
        println!(
            "{name}, {kind} weights: {:.4} % differ, {} labels, {:.1e} texels apart (bound {:.1e}), {:.1} % ask fields",
            found.percent(),
            found.labels,
            found.apart,
            found.bound,
            100.0 * found.fields as f64 / found.pixels as f64
        );
        // A handful of pixels is no share: three may differ anywhere.
        assert!(found.colours <= 3 || found.percent() <= most, "{name}: {found:?}");
        found
    });
    found.last().expect("one comparison at least")
}

fn bake(name: &str, size: [u32; 2], frames: u32, settings: &Settings) -> Vec<u8> {
    scenes::bundle(name, size, frames, settings).expect("a built-in scene bakes")
}

fn settings(cell: u32, key_interval: u32) -> Settings {
    Settings { cell, key_interval, ..Settings::default() }
}

/// The weights of every frame of intervals of `lengths`, the player's less the exact ones: the largest difference of the first key's
/// and of any other's. Three are rounded, the first makes up for them.
fn weights_apart(time: u8, lengths: [u32; 3]) -> [f64; 2] {
    let (mut first, mut others) = (0.0f64, 0.0f64);
    for passed in 0..=lengths[1] {
        let found = timeline::weights(time, lengths, passed);
        for (set, missing) in found.iter().zip([[false, false], [true, false], [false, true], [true, true]]) {
            let exact = reference::weights(time, lengths, f64::from(passed) / f64::from(lengths[1]), missing);
            let apart: Vec<f64> =
                set.iter().zip(exact).map(|(&weight, exact)| (f64::from(weight) / f64::from(ONE) - exact).abs()).collect();
            first = first.max(apart[1]);
            others = [apart[0], apart[2], apart[3]].into_iter().fold(others, f64::max);
        }
    }
    [first, others]
}

#[test]
fn weights_are_near_the_exact_ones() {
    for time in [TIME_HOLD, TIME_LINEAR, TIME_CUBIC] {
        let (mut first, mut others) = (0.0f64, 0.0f64);
        for length in 1..=64 {
            for (before, after) in [(length, length), (1, 9), (200, 3), (7, 256), (8, 8)] {
                let [a, b] = weights_apart(time, [before, length, after]);
                (first, others) = (first.max(a), others.max(b));
            }
        }
        println!("time {time}: weights are at most {:.3} and {:.3} / {ONE} off", first * f64::from(ONE), others * f64::from(ONE));
        assert!(others <= WEIGHT && first <= 3.0 * WEIGHT, "time {time}: {first}, {others}");
    }
}

#[test]
fn weights_at_keys_a_power_of_two_apart_are_exact() {
    for time in [TIME_HOLD, TIME_LINEAR, TIME_CUBIC] {
        for length in [1, 2, 4, 8, 16] {
            assert_eq!(weights_apart(time, [length; 3]), [0.0, 0.0], "time {time}, {length} frames");
        }
    }
}

#[test]
fn field_codes_are_four_to_an_octave() {
    assert_eq!(field_distance(0), 0);
    for code in 1..=MAX_FIELD as i8 {
        let exact = 0.25 * 2f64.powf(f64::from(code - 1) / 4.0);
        let found = f64::from(field_distance(code)) / 256.0;
        assert!((found / exact - 1.0).abs() < 0.01, "code {code}: {found} for {exact}");
        assert_eq!(field_distance(-code), -field_distance(code));
    }
}

#[test]
fn the_baker_bends_cells_as_the_reference_does() {
    // The nodes that a patch looks at, in the order of the baker's, of four rows of four.
    let places: Vec<[usize; 2]> = (0..16).map(|at| [at % 4, at / 4]).filter(|at| at.iter().any(|at| (1..3).contains(at))).collect();
    assert_eq!(patch::CORNERS.map(|node| places[node]), [[1, 1], [2, 1], [1, 2], [2, 2]]);
    let mut random = Random(11);
    for present in (0..1 << patch::NODES).filter(|present| patch::CORNERS.iter().all(|node| present >> node & 1 == 1)) {
        let of_baker = [0; patch::NODES].map(|_| [random.below(1000) as f32 / 1000.0, 0.0]);
        let mut nodes = [[None; 4]; 4];
        for (node, &[column, row]) in places.iter().enumerate().filter(|(node, _)| present >> node & 1 == 1) {
            nodes[row][column] = Some(f64::from(of_baker[node][0]));
        }
        let (values, exact) = (patch::Stencil::new(present).values(&of_baker), reference::Patch::new(nodes).expect("its corners"));
        for at in (0..64).map(|at| [at % 8, at / 8].map(|at| at as f32 / 8.0)) {
            let (found, exact) = (f64::from(patch::value(&values, &patch::shares(at))[0]), exact.at(at.map(f64::from)));
            assert!((found - exact).abs() < 1e-6, "{present:x}, {at:?}: {found}, {exact}");
        }
    }
}

#[test]
fn a_backdrop_agrees_in_every_kind_of_space() {
    for space in [SPACE_CUBIC, SPACE_LINEAR] {
        let scene = scenes::without_sky("torus", SIZE, 17).expect("a built-in scene");
        let [bytes, _] = scenes::raw_and_packed(&scene, &Settings { space, ..settings(8, 8) }).expect("it bakes").1;
        check("torus without its sky", &bytes, [0, 3, 8, 11, 16]);
    }
}

#[test]
fn cells_and_straight_intervals_of_eight_are_exact() {
    // 5 bits of a stored coordinate, 3 of time, 3 down, 3 across: 14 of the 16 there are. What is left is how positions are packed.
    let bytes = bake("street", SIZE, 33, &Settings { time: TIME_LINEAR, space: SPACE_LINEAR, ..settings(8, 8) });
    let found = check("street, 8 and 8", &bytes, [0, 1, 7, 8, 15, 20, 31, 32]);
    assert!(found.apart <= 32.0 / 256.0, "{found:?}");
}

#[test]
fn the_default_agrees_on_every_scene() {
    let mut fields = 0;
    for name in builtin::NAMES {
        let bytes = bake(name, SIZE, 25, &Settings::default());
        fields += check(name, &bytes, [1, 8, 11, 15, 21, 24]).fields;
    }
    assert!(fields > 0, "fields belong to the test");
}

#[test]
fn keys_a_power_of_two_apart_agree() {
    for (name, interval, frames) in
        [("round-columns", 1, 6), ("wing", 2, 9), ("torus", 4, 17), ("cone-translate", 16, 33), ("street", 16, 33)]
    {
        let bytes = bake(name, SIZE, frames, &settings(8, interval));
        assert!(round_intervals(&bytes));
        check(&format!("{name}, keys every {interval}"), &bytes, (0..frames).step_by(3));
    }
}

#[test]
fn small_and_large_cells_agree() {
    for (name, cell, interval) in [("columns", 4, 16), ("torus", 16, 8), ("street", 32, 8)] {
        let bytes = bake(name, SIZE, 33, &settings(cell, interval));
        check(&format!("{name}, cell {cell}"), &bytes, (0..32).step_by(3));
    }
}

#[test]
fn intervals_that_are_no_power_of_two_agree() {
    for (name, interval) in [("arch", 5), ("mirrors", 12), ("terrain", 7)] {
        let bytes = bake(name, SIZE, 32, &settings(8, interval));
        check(&format!("{name}, keys every {interval}"), &bytes, (0..32).step_by(3));
    }
}

#[test]
fn outlines_finer_than_texels_agree() {
    for (name, outline) in [("round-columns", 1), ("mirrors", 2), ("street", 2)] {
        let source = atlas::Settings { outline: Some(outline), ..atlas::Settings::default() };
        let bytes = bake(name, SIZE, 17, &Settings { atlas: source, ..settings(8, 8) });
        assert_eq!(Bundle::parse(&bytes).expect("sound").mask().shape.finer, outline, "{name}");
        check(&format!("{name}, 2^{outline} bits of outline a texel"), &bytes, (0..17).step_by(3));
    }
}

#[test]
fn held_and_straight_time_agree() {
    for (name, time, interval) in [("street", TIME_LINEAR, 7), ("columns", TIME_HOLD, 4)] {
        let bytes = bake(name, SIZE, 32, &Settings { time, ..settings(8, interval) });
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
        let mut scene = scenes::reduced("cone-orbit", SIZE, frames).expect("there is such a scene");
        scene.playback.looping = true;
        let (_, encoded) = scenes::bake(&scene, &settings(8, interval)).expect("it bakes");
        check(&format!("cone-orbit looping, {frames} frames, keys every {interval}"), &encoded.bundle, 0..frames);
    }
}

#[test]
fn single_frames_agree() {
    for looping in [false, true] {
        let mut scene = scenes::reduced("pivot", SIZE, 1).expect("there is such a scene");
        scene.playback.looping = looping;
        let (_, encoded) = scenes::bake(&scene, &Settings::default()).expect("it bakes");
        let found = check("pivot, one frame", &encoded.bundle, [0]);
        // Keys need no rounding here: all that is left is a pixel by which an edge runs closely.
        assert!(found.labels <= 1, "looping {looping}: {}", found.labels);
    }
}

#[test]
fn every_kind_of_texels_agrees_however_stored() {
    for (name, max_side, storage) in [("street", 512, Storage::Raw), ("terrain", 256, Storage::Packed)] {
        let bake = |texels| {
            let source = atlas::Settings { max_side, texels, storage, ..atlas::Settings::default() };
            bake(name, SIZE, 17, &Settings { atlas: source, ..Settings::default() })
        };
        let (name, frames) = (format!("{name}, {storage:?}"), [0, 5, 11, 16]);
        let (four, direct) = (bake(TexelKind::Indexed4), bake(TexelKind::Direct565));
        check_as::<Indexed4>(&format!("{name}, 4 bits"), &four, frames);
        check_as::<Direct565>(&format!("{name}, RGB565"), &direct, frames);
        check(&name, &bake(TexelKind::Indexed8), frames);
        check_as::<AnyTexels>(&format!("{name}, any: 4 bits"), &four, frames);
        check_as::<AnyTexels>(&format!("{name}, any: RGB565"), &direct, frames);
    }
}

#[test]
fn the_street_agrees_at_full_size() {
    let bytes = bake("street", [320, 240], 9, &Settings::default());
    check("street, full size", &bytes, [0, 3, 5, 8]);
}
