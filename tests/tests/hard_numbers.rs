//! Fixed point at its edges: the largest source image, positions at both ends of it, moments at both ends of an interval, weights that
//! add up, sums that stay in range, and a million seeks. Each bound is stated where it is used.

use cubist_core::fixed::{KEY_MAX, KEY_MIN, KeyUv, ONE, WEIGHT_BITS};
use cubist_core::format::{ATLAS, Limits, PATH, Path, SPACE_CUBIC, TIME_CUBIC, TIME_HOLD, TIME_LINEAR};
use cubist_core::{Bundle, Frame, Player, Probe, timeline};
use cubist_tests::random::Random;
use cubist_tests::reference::{Patch, Reference, SPREAD, Weights, packed, rounded};
use cubist_tests::synthetic::Synthetic;
use cubist_tests::{play, tamper};
use rayon::prelude::*;

/// Half a step of the positions that eight pixels in a row are packed to, and as much again for each step along them, texels.
const PACKED: f64 = 4.0 / 256.0;

/// The step of stored positions, texels.
fn stored(bytes: &[u8]) -> f64 {
    1.0 / f64::from(1u32 << Bundle::parse(bytes).expect("it parses").path().key_bits)
}

/// The farthest that what is played of `frames` is from `place`, texels.
fn off(bytes: &[u8], frames: impl IntoIterator<Item = u32>, place: impl Fn(u32, u32, u32) -> [f32; 2]) -> f64 {
    let mut most = 0.0f64;
    play::visit(bytes, frames, |frame, player| {
        let width = player.bundle().size().0;
        for (at, probe) in (0u32..).zip(play::probes(player)) {
            let exact = place(frame, at % width, at / width).map(f64::from);
            let off = [probe.at.u, probe.at.v].into_iter().zip(exact).map(|(at, exact)| (f64::from(at) / 65_536.0 - exact).abs());
            most = off.fold(most, f64::max);
        }
    })
    .expect("it plays");
    most
}

#[test]
fn the_largest_source_image_is_reached_from_end_to_end() {
    for image in [[1024, 1024], [1024, 16], [16, 1024]] {
        let scene = Synthetic { image, frames: 17, ..Synthetic::default() };
        // From the first texel's middle to the last one's, both ways, and moving by half a texel.
        let place = |frame: u32, x: u32, y: u32| {
            let along = |at: u32, size: u32, side: u32| (0.5 + (side - 1) as f32 * at as f32 / (size - 1) as f32).min(side as f32 - 0.5);
            [along(x, 32, image[0]) + if image[0] > 16 { 0.0 } else { frame as f32 / 64.0 }, along(23 - y, 24, image[1])]
        };
        let bytes = scene.bundle(place).expect("it fits");
        let (bound, off) = (PACKED + stored(&bytes), off(&bytes, 0..17, place));
        println!("{image:?}: {off:.4} texels off, bound {bound:.4}");
        assert!(off <= bound, "{image:?}: {off} texels off");
    }
}

#[test]
fn both_ends_of_an_interval_are_exactly_the_keys() {
    // Every key is somewhere else; between them positions go straight, which only linear time follows.
    for (time, interval) in [(TIME_LINEAR, 8), (TIME_LINEAR, 5), (TIME_LINEAR, 7), (TIME_CUBIC, 1), (TIME_HOLD, 1)] {
        let scene = Synthetic { interval, time, frames: 4 * interval + 1, ..Synthetic::default() };
        let at_key = |key: u32| (key * 37 % 11) as f32 * 9.0;
        let place = |frame: u32, x: u32, y: u32| {
            let (key, passed) = (frame / interval, (frame % interval) as f32 / interval as f32);
            let shift = at_key(key) * (1.0 - passed) + at_key(key + 1) * passed;
            [x as f32 + 20.5 + shift, y as f32 + 30.5]
        };
        let bytes = scene.bundle(place).expect("it fits");
        let bound = PACKED + SPREAD * 0.5 * stored(&bytes);
        let off = off(&bytes, (0..scene.frames).step_by(interval as usize), place);
        assert!(off <= bound, "time {time}, keys every {interval}: {off} texels off at keys, bound {bound}");
    }
}

#[test]
fn constants_stay_constant() {
    for (time, interval) in [(TIME_CUBIC, 8), (TIME_CUBIC, 7), (TIME_CUBIC, 3), (TIME_LINEAR, 5), (TIME_HOLD, 8)] {
        for looping in [false, true] {
            let scene = Synthetic { interval, time, looping, frames: 29, ..Synthetic::default() };
            let bytes = scene.bundle(|_, x, y| [0.37 * x as f32 + 99.3, 0.61 * y as f32 + 11.7]).expect("it fits");
            let mut first = None;
            play::visit(&bytes, 0..29, |frame, player| {
                let probes = play::probes(player);
                let first = first.get_or_insert_with(|| probes.clone());
                assert!(*first == probes, "time {time}, keys every {interval}, looping {looping}: frame {frame} differs");
            })
            .expect("it plays");
        }
    }
    // And where a value is the same at all keys, weights of any rounding give it back: they add up to one.
    let mut random = Random(5);
    for _ in 0..20_000 {
        let lengths = [random.below(300) as u32, 1 + random.below(256) as u32, random.below(300) as u32];
        let passed = random.below(lengths[1] as usize + 1) as u32;
        let value = random.below(1 << 16) as i64 - 16_384;
        for set in timeline::weights(random.below(3) as u8, lengths, passed) {
            let sum: i64 = set.iter().map(|&weight| i64::from(weight) * value).sum();
            assert_eq!(sum, value << WEIGHT_BITS, "{lengths:?}, {passed}");
        }
    }
}

/// What four keys give, in stored units, `passed` frames into the interval.
fn between(time: u8, lengths: [u32; 3], passed: u32, keys: [i64; 4]) -> f64 {
    let [set, ..] = timeline::weights(time, lengths, passed);
    set.iter().zip(keys).map(|(&weight, key)| i64::from(weight) * key).sum::<i64>() as f64 / f64::from(ONE)
}

#[test]
fn motion_is_monotone_where_its_keys_are() {
    let mut random = Random(6);
    for round in 0..4_000 {
        let length = 1 + random.below(32) as u32;
        // Steps of any size; of up to five times their neighbours': a cubic Hermite curve whose tangents are at most three secants does
        // not turn (Fritsch and Carlson 1980).
        let mut step = 1 + random.below(4000) as i64;
        let steps = [0; 3].map(|_| {
            step = (step * (20 + random.below(480) as i64) / 100).clamp(1, 20_000);
            step
        });
        let any = [0; 3].map(|_| random.below(20_000) as i64 * random.below(2) as i64);
        for (time, steps, tame) in [
            (TIME_LINEAR, any, true),
            (TIME_CUBIC, steps, steps.windows(2).all(|s| s[0] <= 5 * s[1] && s[1] <= 5 * s[0])),
            (TIME_CUBIC, any, false),
        ] {
            let mut at = KEY_MIN as i64;
            let keys = [0, steps[0], steps[1], steps[2]].map(|step| {
                at += step;
                at
            });
            let curve: Vec<f64> = (0..=length).map(|passed| between(time, [length; 3], passed, keys)).collect();
            assert_eq!((curve[0], curve[length as usize]), (keys[1] as f64, keys[2] as f64), "round {round}");
            // Weights are rounded to 1/2^14: by as much of the keys' distance.
            let rounding = 2.0 * (keys[3] - keys[0]) as f64 / f64::from(ONE);
            // Any keys: t (1 - t)^2 is at most 4/27, and the tangent half the neighbouring step where this one is nothing.
            let turn = if tame { 0.0 } else { 0.0741 * steps[0].max(steps[2]) as f64 };
            let (low, high) = (keys[1] as f64 - turn - rounding, keys[2] as f64 + turn + rounding);
            assert!(curve.iter().all(|&at| (low..=high).contains(&at)), "round {round}, time {time}: {keys:?}: {curve:?}");
            assert!(!tame || curve.windows(2).all(|pair| pair[1] >= pair[0] - rounding), "round {round}, time {time}: {keys:?}: {curve:?}");
        }
    }
}

#[test]
fn positions_saturate_and_never_wrap() {
    for (far, edge) in [(i32::MAX, KEY_MAX), (KEY_MAX + 1, KEY_MAX), (i32::MIN, KEY_MIN), (KEY_MIN - 1, KEY_MIN)] {
        assert_eq!((KeyUv::new(far, 7).u(), KeyUv::new(far, 7).v()), (edge, 7));
        assert_eq!((KeyUv::new(7, far).u(), KeyUv::new(7, far).v()), (7, edge));
    }
    // Keys as far apart as they can be overshoot by less than a quarter of that, and nodes that do so in turn bend the cells between them by as much
    // again: both are told apart from wrapping by what f64 says.
    let play = |x: f64| (x * 2048.0) as i32;
    let (low, high) = (f64::from(KEY_MIN), f64::from(KEY_MAX));
    for keys in [[low, high, high, low], [high, low, low, high], [low, low, high, high], [high, high, low, high]] {
        for passed in 0..=16 {
            let time = between(TIME_CUBIC, [16; 3], passed, keys.map(|key| key as i64));
            assert!((low - 16_384.0..=high + 16_384.0).contains(&time), "{keys:?}, {passed}: {time}");
            let ends = [play(time), play(low + high - time)];
            for (log2, turns) in [(2, 1), (3, 0b01_1110), (4, 0b1_0110), (5, 0b11_0001)] {
                // Nodes are at one end or the other: like a chessboard, in rows, in columns, and otherwise.
                let nodes = [0, 1, 2, 3].map(|y: usize| [0, 1, 2, 3].map(|x: usize| Some(ends[(turns >> (x + 2 * y) ^ x ^ y) & 1])));
                let off = patch_off(log2, nodes);
                assert!(off <= 0.5 * (rounded(1 << log2, SPACE_CUBIC) - SPREAD), "{keys:?}, {passed}, {log2}: {off} units off");
            }
        }
    }
}

/// A patch in integers, word for word as FORMAT.md has it, at the pixel `x` columns and `y` rows into a cell of 2^`log2` pixels. Whatever has to fit
/// 32 bits does.
fn patch_in_integers(log2: u32, nodes: [[Option<i32>; 4]; 4], [x, y]: [i64; 2]) -> i64 {
    let fits = |value: i64| i64::from(i32::try_from(value).expect("it fits 32 bits"));
    let at = |line: [Option<i32>; 4], node: usize| i64::from(line[node].expect("a corner"));
    // What an edge takes: two second differences.
    let edge = |line: [Option<i32>; 4]| {
        let second = |node: usize| {
            let [before, here, after] = [node - 1, node, node + 1].map(|node| line[node].map(i64::from));
            Some(fits(before? - 2 * here? + after?))
        };
        let ends = [second(1), second(2)];
        ends[0].or(ends[1]).unwrap_or(0) + ends[1].or(ends[0]).unwrap_or(0)
    };
    let column = |column: usize| nodes.map(|row| row[column]);
    let mean = |sum: i64| fits(fits(sum) + (1 << (2 * log2 + 1))) >> (2 * log2 + 2);
    let (e, f) = (mean(edge(nodes[1]) + edge(nodes[2])), mean(edge(column(1)) + edge(column(2))));
    let n = 1 << log2;
    let round = |value: i64| fits(fits(value) + (n >> 1)) >> log2;
    let [[a, b], [c, d]] = [nodes[1], nodes[2]].map(|line| [at(line, 1), at(line, 2)]);
    let (left, right) = (round(c - a), round(d - b));
    let (down, step) = (left - (fits(f * (n - 1)) >> 1), round(b - a) - (fits(e * (n - 1)) >> 1));
    let turn = round(right - left);
    let row = fits(a + fits(y * down) + fits(y * (y - 1) / 2 * f));
    fits(row + fits(x * fits(step + fits(y * turn))) + fits(x * (x - 1) / 2 * e))
}

/// The farthest that such a patch is off anywhere in its cell, units.
fn patch_off(log2: u32, nodes: [[Option<i32>; 4]; 4]) -> f64 {
    let exact = Patch::new(nodes.map(|row| row.map(|node| node.map(f64::from)))).expect("it has its corners");
    let pixels = (0..1i64 << log2).flat_map(|y| (0..1i64 << log2).map(move |x| [x, y]));
    let off = |at: [i64; 2]| (patch_in_integers(log2, nodes, at) as f64 - exact.at(at.map(|at| at as f64 / f64::from(1u32 << log2)))).abs();
    pixels.map(off).fold(0.0, f64::max)
}

#[test]
fn patches_in_integers_are_where_f64_says() {
    let mut random = Random(7);
    for log2 in 2..=5 {
        let (bound, mut most) = (0.5 * (rounded(1 << log2, SPACE_CUBIC) - SPREAD), 0.0f64);
        for _ in 0..2_000 {
            let range = 1 + random.below(1 << 26);
            let nodes = [0, 1, 2, 3].map(|y| {
                [0, 1, 2, 3].map(|x| {
                    let corner = (1..3).contains(&x) && (1..3).contains(&y);
                    (corner || random.below(3) > 0).then_some(random.below(range) as i32 - range as i32 / 3)
                })
            });
            most = most.max(patch_off(log2, nodes));
        }
        println!("cells of {}: {most:.2} units off, bound {bound:.2}", 1 << log2);
        assert!(most <= bound && most > 0.5 * bound, "cells of {}: {most} units off, bound {bound}", 1 << log2);
        // A plane of whole steps a pixel is met exactly, whatever is carried, and so is what bends by whole units.
        let n = 1 << log2;
        for missing in 0..1 << 16 {
            let missing = missing & !0x660;
            let nodes = [0, 1, 2, 3]
                .map(|y: i32| [0, 1, 2, 3].map(|x: i32| (missing >> (4 * y + x) & 1 == 0).then_some(n * (37 * x - 11 * y) + 9)));
            let at = [1, n - 1].map(i64::from);
            assert_eq!(patch_in_integers(log2, nodes, at), (26 * i64::from(n) + 9) + 37 - 11 * (i64::from(n) - 1), "{missing:x}");
        }
        let bent = |x: i32, y: i32| x * x - 5 * x + 3 * y * y + 7 * y;
        let nodes = [0, 1, 2, 3].map(|y: i32| [0, 1, 2, 3].map(|x: i32| Some(bent((x - 1) * n, (y - 1) * n))));
        for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
            assert_eq!(patch_in_integers(log2, nodes, [x, y].map(i64::from)), i64::from(bent(x, y)), "({x}, {y})");
        }
    }
}

#[test]
fn records_of_noise_play_what_f64_says() {
    // Noise for records gives keys all over the range there is, ghosts far outside the picture among them. What the integers make of it is
    // what f64 does: a sum that wrapped would be hundreds of texels off.
    let scene = Synthetic { image: [1024, 64], frames: 17, independent_every: 1, ..Synthetic::default() };
    let bytes = scene.bundle(|_, x, y| [x as f32 + 9.5, y as f32 + 9.5]).expect("it fits");
    let section = Bundle::parse(&bytes).expect("it parses").sections().find(|section| section.tag == PATH).expect("it is there").bytes;
    let (mut random, mut wide, mut compared) = (Random(9), 0, 0);
    for round in 0..60 {
        let mut path: Path<'_> = postcard::from_bytes(section).expect("a sound path");
        let mut records = path.records.to_vec();
        let noise = round % 3;
        records.iter_mut().for_each(|byte| {
            if noise == 0 || random.below(12) == 0 {
                *byte = random.below(256) as u8;
            }
        });
        path.records = &records;
        // Room for whatever the noise lists: what is beyond the bounds is left out, and what is told from it is told otherwise.
        path.limits = Limits {
            key_layers: 4000,
            row_layers: 1000,
            key_chains: 4000,
            row_chains: 1000,
            key_fields: 4000,
            list_bytes: 4000,
            row_sheets: 200,
            cell_sheets: 9,
            fields: 2,
            ..path.limits
        };
        let changed = postcard::to_stdvec(&path).expect("a path serialises");
        let changed = tamper::with_section(&bytes, PATH, &changed).expect("it is there");
        let bundle = Bundle::parse(&changed).expect("any records parse");
        let reference = Reference::new(&bundle);
        let bound = packed(1 << path.cell_log2, path.space, u32::from(bundle.atlas().width_log2));
        play::visit(&changed, [0, 3, 8, 13, 16], |frame, player| {
            let (probes, reference) = (play::probes(player), reference.frame(frame, Weights::Player));
            for (index, (exact, probe)) in reference.iter().zip(probes).enumerate() {
                let Some(exact) = exact else { continue };
                let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
                let off = apart([probe.at.u, probe.at.v].map(|x| f64::from(x) / 65_536.0), exact.at);
                // A cell that lists nothing which all its corners carry is left out.
                let good = probe.label != exact.label || probe == Probe::default() || off <= bound;
                compared += usize::from(probe.label == exact.label && probe != Probe::default());
                assert!(good, "round {round}, frame {frame}, pixel {index}: {off} texels apart: {:?}, {exact:?}", probe.at);
                wide += usize::from(exact.motion > 500.0);
            }
        })
        .expect("it plays");
    }
    println!("{compared} pixels compared, {wide} of all between keys far apart");
    assert!(compared > 100_000, "{compared} pixels compared");
    assert!(wide > 1000, "keys far apart belong to the test: {wide}");
}

#[test]
fn a_million_seeks_give_the_frames_of_the_first() {
    const SEEKS: usize = 1_000_000;
    const PARTS: usize = 8;
    let scene = Synthetic { size: [16, 8], frames: 40, interval: 3, looping: true, ..Synthetic::default() };
    let place = |frame: u32, x: u32, y: u32| [x as f32 + 9.5 + (frame % 20) as f32 * 2.3, y as f32 + 40.5 + (frame * frame % 40) as f32];
    let bytes = scene.bundle(place).expect("it fits");
    assert!(Bundle::parse(&bytes).expect("it parses").sections().any(|section| section.tag == ATLAS));
    let first: Vec<Vec<u16>> =
        (0..40).map(|frame| play::frames(&bytes, [frame]).expect("it plays").remove(0)[3 * 16..4 * 16].to_vec()).collect();
    assert!(first.windows(2).any(|pair| pair[0] != pair[1]), "frames differ");
    (0..PARTS).into_par_iter().for_each(|part| {
        let bundle = Bundle::parse(&bytes).expect("it parses");
        let mut memory = vec![0; bundle.memory_needed()];
        let mut player = Player::new(&bundle, &mut memory).expect("the memory it asked for");
        let (mut random, mut row, mut frame) = (Random(part as u64), [0u16; 16], 0u32);
        for seek in 0..SEEKS / PARTS {
            // On by one, on by a few, or anywhere.
            frame = match random.below(4) {
                0 => frame + 1,
                1 => frame + random.below(9) as u32,
                2 => random.below(40) as u32,
                _ => random.below(1 << 30) as u32,
            };
            player.seek(Frame(frame));
            player.row(3, &mut row);
            assert!(row[..] == first[(frame % 40) as usize], "part {part}, seek {seek}: frame {frame}");
        }
    });
}
