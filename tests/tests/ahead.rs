//! Decoding ahead: the next key comes in slice by slice while the interval before it plays. Whatever way a frame is come by, its pixels
//! are those of a fresh player; played forwards, no frame pays for a whole key; no seek decodes more keys than the bundle says.

use cubist_baker::bake::{self, Settings};
use cubist_core::format::{TIME_CUBIC, TIME_HOLD, TIME_LINEAR};
use cubist_core::grid::Grid;
use cubist_core::{Bundle, Frame, Player, Work};
use cubist_tests::{play, scenes};

/// About what a slice costs beside the bytes that it reads, in bytes of equal time: 600 to 700 counted instructions each.
const SLICE_COST: u32 = 48;

/// The bundle of a scene whose every third key is independent.
fn bake(name: &str, size: [u32; 2], frames: u32, looping: bool, time: u8, key_interval: u32) -> Vec<u8> {
    bake_as(name, size, frames, looping, &Settings { time, key_interval, ..Settings::default() })
}

/// The same with keys at even intervals.
fn bake_even(name: &str, size: [u32; 2], frames: u32, looping: bool, time: u8, key_interval: u32) -> Vec<u8> {
    bake_as(name, size, frames, looping, &Settings { time, key_interval, adapt_keys: false, ..Settings::default() })
}

fn bake_as(name: &str, size: [u32; 2], frames: u32, looping: bool, settings: &Settings) -> Vec<u8> {
    bakes(name, size, frames, looping, &[*settings]).remove(0)
}

/// The bundles of one source image, by each of `settings`, with every third key independent.
fn bakes(name: &str, size: [u32; 2], frames: u32, looping: bool, settings: &[Settings]) -> Vec<Vec<u8>> {
    let mut scene = scenes::reduced(name, size, frames).expect("there is such a scene");
    scene.playback.looping = looping;
    let flat = bake::flatten(&scene, &Settings::default().atlas, &|_, _| {}).expect("a built-in scene is flattened");
    let coded = |settings: &Settings| {
        let mut settings = *settings;
        settings.coding.independent_every = 3;
        bake::encode(&scene, &flat, &settings, &|_, _| {}).expect("a built-in scene is encoded").bundle
    };
    settings.iter().map(coded).collect()
}

/// What seeking `frames` one after the other costs.
fn works(bytes: &[u8], frames: impl IntoIterator<Item = u32>) -> Vec<Work> {
    let mut works = Vec::new();
    play::visit(bytes, frames, |_, player| works.push(player.work())).expect("it plays");
    works
}

/// The slices of key `key`, and what decoding it costs.
fn cost(bundle: &Bundle<'_>, key: usize) -> (u32, u32) {
    let path = bundle.path();
    let slices = bundle.place(key, 0).slices(Grid::new(path.width, path.height, path.cell_log2)) as u32;
    (slices, bundle.record(key).len() as u32 + SLICE_COST * slices)
}

fn spent(work: &Work) -> u32 {
    work.record_bytes + SLICE_COST * work.slices
}

#[test]
fn whatever_was_shown_before_a_frame_is_that_of_a_fresh_player() {
    let frames = 43;
    for (name, looping, time) in [
        ("street", false, TIME_CUBIC),
        ("street", true, TIME_CUBIC),
        ("mirrors", true, TIME_LINEAR),
        ("cone-orbit", false, TIME_LINEAR),
        ("torus", true, TIME_HOLD),
    ] {
        let bytes = bake(name, [64, 48], frames, looping, time, 5);
        let fresh: Vec<Vec<u16>> = (0..frames).map(|frame| play::frames(&bytes, [frame]).expect("it plays").remove(0)).collect();
        let around = |frame: u32| if looping { frame % frames } else { frame.min(frames - 1) };
        let orders: [(&str, Vec<u32>); 9] = [
            ("forwards, three times around", (0..3 * frames).map(around).collect()),
            ("twice as fast", (0..3 * frames).step_by(2).map(around).collect()),
            ("three times as fast", (1..4 * frames).step_by(3).map(around).collect()),
            ("faster than keys", (2..9 * frames).step_by(7).map(around).collect()),
            ("backwards", (0..2 * frames).rev().map(around).collect()),
            ("with pauses", (0..frames).flat_map(|frame| [frame; 3]).collect()),
            ("two on, one back", (0..frames).flat_map(|frame| [around(frame + 2), around(frame + 1)]).collect()),
            (
                "four on, three back",
                (0..frames).flat_map(|frame| [frame, around(frame + 2), around(frame + 4), around(frame + 1)]).collect(),
            ),
            ("anywhere, and on from there", (0..120u32).flat_map(|i| (0..i % 4).map(move |on| around(i * i * 7 % 43 + on))).collect()),
        ];
        for (order, shown) in orders {
            let mut at = 0;
            play::visit(&bytes, shown.iter().copied(), |frame, player| {
                assert!(play::pixels(player) == fresh[frame as usize], "{name}, looping {looping}, {order}: frame {frame}, shown as {at}.");
                at += 1;
            })
            .expect("it plays");
        }
    }
}

#[test]
fn no_frame_pays_for_a_key() {
    let frames = 48;
    for (name, looping, time) in [("street", true, TIME_CUBIC), ("terrain", true, TIME_LINEAR), ("round-columns", false, TIME_CUBIC)] {
        let bytes = bake_even(name, [240, 176], frames, looping, time, 8);
        let bundle = Bundle::parse(&bytes).expect("the baker's bytes parse");
        let (ahead, keys) = (if time == TIME_CUBIC { 3 } else { 2 }, bundle.key_count());
        let works = works(&bytes, 0..if looping { 2 * frames } else { frames });
        for (interval, works) in works.chunks(8).enumerate() {
            let next = interval + ahead;
            if !looping && next >= keys {
                assert!(works.iter().all(|work| work.slices == 0 && work.keys == 0), "{name}: nothing follows the last key");
                continue;
            }
            let (slices, whole) = cost(&bundle, next % keys);
            let share = whole / 8;
            // A new player has already shown frame 0.
            for (passed, work) in works.iter().enumerate().skip(usize::from(interval == 0)) {
                let place = format!("{name}: interval {interval}, {passed} frames on, {slices} slices, share {share}: {work:?}");
                assert!(spent(work) <= share + share / 2, "more than half as much again, {place}");
                assert!(work.slices <= slices.div_ceil(2) && work.slices > 0, "{place}");
                assert_eq!(work.keys, u32::from(passed == 7), "a key is complete when it is needed, not before: {place}");
            }
            let (decoded, paid) = works.iter().fold((0, 0), |(slices, sum), work| (slices + work.slices, sum + spent(work)));
            assert!(interval == 0 || decoded == slices, "{name}: interval {interval}: {decoded} slices of {slices}");
            // The decoder reads four bytes ahead, and may leave some unread.
            assert!(interval == 0 || paid + 8 >= whole, "{name}: interval {interval}: {paid} of {whole}");
        }
    }
}

#[test]
fn a_frame_that_is_shown_again_decodes_nothing() {
    let bytes = bake_even("street", [64, 48], 43, true, TIME_CUBIC, 5);
    let bundle = Bundle::parse(&bytes).expect("the baker's bytes parse");
    let mut memory = vec![0; bundle.memory_needed()];
    let mut player = Player::new(&bundle, &mut memory).expect("the memory it asked for");
    for frame in (0..43).chain(0..20) {
        player.seek(Frame(frame));
        for again in [frame, frame - frame % 5, frame] {
            player.seek(Frame(again));
            assert_eq!(player.work(), Work::default(), "frame {frame}, {again} again");
        }
    }
}

#[test]
fn a_frame_that_was_jumped_to_and_is_shown_again_decodes_nothing() {
    for time in [TIME_CUBIC, TIME_LINEAR, TIME_HOLD] {
        let bytes = bake_even("street", [64, 48], 43, false, time, 4);
        let bundle = Bundle::parse(&bytes).expect("the baker's bytes parse");
        let mut memory = vec![0; bundle.memory_needed()];
        for frame in 0..43 {
            let mut player = Player::new(&bundle, &mut memory).expect("the memory it asked for");
            for shown in 0..3 {
                player.seek(Frame(frame));
                assert!(shown == 0 || player.work() == Work::default(), "frame {frame}: {:?}", player.work());
            }
        }
    }
}

#[test]
fn no_seek_decodes_more_keys_than_the_bundle_says() {
    for looping in [false, true] {
        let frames = if looping { 60 } else { 61 };
        let times = [TIME_CUBIC, if looping { TIME_HOLD } else { TIME_LINEAR }];
        let cases = times.into_iter().flat_map(|time| [(time, false), (time, true)]);
        let settings = cases.map(|(time, even)| Settings { time, key_interval: 4, adapt_keys: !even, ..Settings::default() });
        let settings: Vec<Settings> = settings.collect();
        for (bytes, settings) in bakes("pivot", [64, 48], frames, looping, &settings).iter().zip(&settings) {
            let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
            let limit = u32::from(bundle.limits().seek_keys);
            let slices = (0..bundle.key_count()).map(|key| cost(&bundle, key).0).max().expect("a key");
            let (mut most, mut after) = (0, 0);
            // To every frame from far away, and on from there.
            for frame in 0..60 {
                let far = (frame + 30) % frames;
                let works = works(bytes, [far, frame, frame + 1]);
                assert!(works.iter().all(|work| work.keys <= limit && work.slices <= limit * slices), "frame {frame}: {works:?}");
                most = works.iter().map(|work| work.keys).fold(most, u32::max);
                after = after.max(works[2].slices);
            }
            assert_eq!(most, limit, "the bound is met somewhere");
            // This path ends elsewhere than it begins. Keys that adapt to a loop stand a frame apart there: one is decoded for each frame.
            let close = if looping && settings.adapt_keys { slices } else { 0 };
            assert!(after <= close + slices + slices.div_ceil(2), "the frame after a seek decodes {after} slices; a key has {slices}");
        }
    }
}

#[test]
fn linear_time_holds_fewer_keys_than_cubic_time() {
    let needed = |time| {
        let bytes = bake("pivot", [64, 48], 21, false, time, 4);
        let bundle = Bundle::parse(&bytes).expect("the baker's bytes parse");
        let (limits, rows) = (bundle.limits(), 7);
        let fields = usize::from(limits.key_fields) * usize::from(limits.fields);
        let key = usize::from(limits.key_layers) * 4 + usize::from(limits.key_chains) * 10 + fields + 2 * (rows + 1);
        (bundle.memory_needed(), key, usize::from(limits.list_bytes))
    };
    let ((cubic, key, lists), (linear, ..)) = (needed(TIME_CUBIC), needed(TIME_LINEAR));
    // Five keys and four intervals' lists against three and three.
    let expected = 2 * key + lists;
    assert!(cubic.abs_diff(linear + expected) <= expected / 8, "{cubic} and {linear} bytes; a key {key}, lists {lists}");
}
