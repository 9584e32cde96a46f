//! What the baker writes, the player plays: any motion that is straight on the screen comes back, raw and packed alike.
//! Screens, timelines and motion come from libFuzzer's bytes through `arbitrary`; they are baked as `cubist_tests::synthetic` bakes.
#![no_main]

use arbitrary::Arbitrary;
use cubist_baker::atlas::Storage;
use cubist_core::Bundle;
use cubist_core::format::TIME_HOLD;
use cubist_tests::play;
use cubist_tests::survive::{Dose, survives};
use cubist_tests::synthetic::Synthetic;
use libfuzzer_sys::fuzz_target;

/// A screen, a timeline and a motion, before they are brought into range.
#[derive(Arbitrary, Debug)]
struct Any {
    image: [u8; 2],
    size: [u8; 2],
    frames: u8,
    interval: u8,
    time: u8,
    looping: bool,
    independent_every: u8,
    /// Where the first pixel looks, and how far its neighbours look from it, parts of the picture.
    start: [u8; 2],
    step: [u8; 2],
    /// How far a pixel moves in a frame, parts of a texel.
    motion: [i8; 2],
}

fuzz_target!(|any: Any| {
    let side = |x: u8| 16u32 << (x % 5);
    let scene = Synthetic {
        image: any.image.map(side),
        size: any.size.map(|x| 1 + u32::from(x) % 40),
        frames: 1 + u32::from(any.frames) % 30,
        interval: 1 + u32::from(any.interval) % 12,
        time: any.time % 3,
        looping: any.looping,
        independent_every: 1 + usize::from(any.independent_every) % 9,
        storage: Storage::Raw,
    };
    let place = |frame: u32, x: u32, y: u32| {
        [0, 1].map(|axis: usize| {
            let side = scene.image[axis] as f32;
            let along = [x, y][axis] as f32 / scene.size[axis] as f32;
            let start = f32::from(any.start[axis]) / 256.0;
            let at = start * side + along * f32::from(any.step[axis]) / 256.0 * side + f32::from(any.motion[axis]) / 64.0 * frame as f32;
            at.clamp(0.0, side - 0.01)
        })
    };
    let raw = scene.bundle(place).expect("it fits");
    let packed = Synthetic { storage: Storage::Packed, ..scene }.bundle(place).expect("it fits");
    let bundle = Bundle::parse(&raw).expect("what the baker writes parses");
    assert_eq!((bundle.size(), bundle.frames()), ((scene.size[0], scene.size[1]), scene.frames));
    let frames = [0, scene.frames / 2, scene.frames - 1];
    let shown = play::frames(&raw, frames).expect("it plays");
    assert!(shown == play::frames(&packed, frames).expect("it plays"), "packed is not what was raw");
    // What is straight in space and time comes back to a few steps of what is stored. Not what holds still between keys, turns at a loop's
    // seam or at the picture's edge, or is so steep that the nodes beyond the screen lie outside what can be stored.
    let slow = |axis: usize| f64::from(any.step[axis]) / 256.0 * f64::from(scene.image[axis]) <= 4.0 * f64::from(scene.size[axis]);
    let inside = |at: [f32; 2]| (0..2).all(|axis| at[axis] > 0.0 && at[axis] < scene.image[axis] as f32 - 0.02);
    let corners = [0, scene.frames - 1]
        .into_iter()
        .flat_map(|f| [0, 1, 2, 3].map(|i: u32| place(f, (i & 1) * (scene.size[0] - 1), (i >> 1) * (scene.size[1] - 1))));
    if scene.time != TIME_HOLD && !scene.looping && slow(0) && slow(1) && corners.into_iter().all(inside) {
        play::visit(&raw, frames, |frame, player| {
            for (at, probe) in (0..).zip(play::probes(player)) {
                let exact = place(frame, at % scene.size[0], at / scene.size[0]);
                let found = [probe.at.u, probe.at.v].map(|x| x as f32 / 65_536.0);
                let off = (found[0] - exact[0]).abs().max((found[1] - exact[1]).abs());
                assert!(probe.label != 1 || off <= 0.125, "frame {frame}, pixel {at}: {found:?}, exactly {exact:?}");
            }
        })
        .expect("it plays");
    }
    assert!(survives(&raw, Dose { rows: 3, pixels: 64, walk: 3, middle: true }));
});
