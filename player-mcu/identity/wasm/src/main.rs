//! Plays one bundle for `play.mjs`, which puts it into this program's memory, calls `main` and reads the checksums of the frames there.
//!
//! Nothing is imported and nothing but `main` exported, so that no line steps outside of the language: `play.mjs` finds the `Door` by the
//! words it starts with, and in it the addresses of what goes in and comes out.

use cubist_identity::{BUNDLE_ROOM, MEMORY_ROOM, PICTURE_ROOM, play};
use std::hint::black_box;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering::Relaxed};

/// The most frames of a bundle.
const FRAMES: usize = 4096;

/// What `play.mjs` finds.
#[repr(C)]
struct Door {
    words: [u8; 16],
    bundle: &'static [AtomicU8; BUNDLE_ROOM],
    /// How many bytes the bundle has.
    length: AtomicU32,
    sums: &'static [AtomicU32; FRAMES],
    /// How many frames were played; none where the bundle does not play.
    frames: AtomicU32,
}

static BUNDLE: [AtomicU8; BUNDLE_ROOM] = [const { AtomicU8::new(0) }; BUNDLE_ROOM];
static SUMS: [AtomicU32; FRAMES] = [const { AtomicU32::new(0) }; FRAMES];
static DOOR: Door =
    Door { words: *b"cubist identity:", bundle: &BUNDLE, length: AtomicU32::new(0), sums: &SUMS, frames: AtomicU32::new(0) };

fn main() {
    // Somebody else writes what lies behind the door: the compiler must not think that it stays as it is.
    let door = black_box(&DOOR);
    let bytes: Vec<u8> = door.bundle.iter().take(door.length.load(Relaxed) as usize).map(|byte| byte.load(Relaxed)).collect();
    let (mut memory, mut picture) = (vec![0; MEMORY_ROOM], vec![0; PICTURE_ROOM]);
    let mut frames = 0;
    let played = play(&bytes, &mut memory, &mut picture, |frame, sum| {
        if let Some(slot) = door.sums.get(frame as usize) {
            slot.store(sum, Relaxed);
            frames = frame + 1;
        }
    });
    door.frames.store(if played.is_ok() { frames } else { 0 }, Relaxed);
}
