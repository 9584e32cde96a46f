//! Kinks: frames where motion changes at once, and where keys stand closer.
//! The G-buffer and the keys' frames come in; the frames go out with those of kinks among them.
//!
//! A curve through the keys around it carries a camera that stops beyond where it does, and back; likewise one that turns around or starts, or
//! an object that hits the floor. Two keys close by each other, on the slower side, keep it from that: what comes before them tells next to nothing of
//! how it goes on.

use crate::gbuffer::{ANOTHER, GBuffer, difference, size};
use crate::sheets::KeyGrid;
use cubist_core::format::TIME_CUBIC;
use rayon::prelude::*;

/// Frames between keys from which on a curve has room to go wrong in.
const LEAST: u32 = 4;
/// How much a pixel's step changes where it is part of a kink: by this, texels, over the frames from key to key. Curves go wrong by three sixteenths of it
/// at most.
const CHANGE: f32 = 4.0;
/// So many of the pixels that show the same surface before and after a kink are part of it, percent.
const MOST: f32 = 10.0;
/// The two frames before a kink and the two after it change at most this share of what it does: else motion is fast, not new.
const AROUND: f32 = 0.25;
/// Of so many rows and columns of pixels one is looked at.
const STEP: usize = 2;

/// What surfaces seen in a frame, the one before it and the one after it do.
#[derive(Clone, Copy, Default)]
struct Motion {
    /// Pixels that show the same surface all the time.
    pixels: f32,
    /// How many of them change their steps; those that do by less than [`CHANGE`] count by the square of their share of it, as errors do.
    changed: f32,
    /// The sums of their steps to this frame and on from it, texels.
    steps: [f32; 2],
}

/// The frames of `grid`'s keys and those that kinks ask for; `None` where there is none.
#[must_use]
pub fn keys(gbuffer: &GBuffer, grid: &KeyGrid) -> Option<Vec<u32>> {
    let spacing = grid.spacing();
    if spacing < LEAST {
        return None;
    }
    let motions: Vec<Motion> =
        (0..grid.frames).into_par_iter().map(|frame| motion(gbuffer, grid, frame, CHANGE / spacing as f32)).collect();
    let kinks: Vec<[u32; 2]> = (0..grid.frames).filter_map(|frame| kink(&motions, grid, frame)).collect();
    // Where their keys, two each, are more than the others, other intervals are what helps.
    if kinks.len() > (grid.intervals() / 2).max(1) {
        return None;
    }
    let kinks: Vec<u32> = kinks.into_iter().flatten().collect();
    let close = |key: u32| kinks.iter().any(|&kink| kink.abs_diff(key) <= spacing / 4);
    let ends = |key: u32| key == 0 || (!grid.looping && key + 1 == grid.frames);
    let mut keys: Vec<u32> = grid.keys.iter().copied().filter(|&key| ends(key) || !close(key)).chain(kinks.iter().copied()).collect();
    keys.sort_unstable();
    keys.dedup();
    (keys != grid.keys).then_some(keys)
}

/// The frames of the keys of the kink at `frame`, or between it and the next one; `None` where there is none.
fn kink(motions: &[Motion], grid: &KeyGrid, frame: u32) -> Option<[u32; 2]> {
    let at = |by: i64| grid.beside(frame, by).map(|frame| motions[frame]).unwrap_or_default();
    let [own, next] = [0, 1].map(at);
    // Where one lies between two frames, both change.
    let between = next.changed > AROUND * own.changed && own.changed > AROUND * next.changed;
    let (changed, after) = if between { (own.changed + next.changed, 2) } else { (own.changed, 1) };
    let around = [-2, -1, after, after + 1].map(|by| at(by).changed).into_iter().fold(0.0, f32::max);
    if 100.0 * own.changed.max(next.changed) <= MOST * own.pixels.max(next.pixels) || around > AROUND * changed {
        return None;
    }
    let starts = own.steps[0] < own.steps[1];
    let by = match between {
        true => 1,
        // Without curves one key does.
        false if grid.time != TIME_CUBIC => 0,
        false if starts => -1,
        false => 1,
    };
    Some([frame, grid.beside(frame, by)? as u32])
}

/// What is seen around `frame` does, where a change by `change` texels counts whole.
fn motion(gbuffer: &GBuffer, grid: &KeyGrid, frame: u32, change: f32) -> Motion {
    let mut motion = Motion::default();
    let [width, height] = grid.size;
    let Some(frames) = [-1, 0, 1].map(|by| grid.beside(frame, by)).into_iter().collect::<Option<Vec<usize>>>() else { return motion };
    for place in (0..height).step_by(STEP).flat_map(|y| (0..width).step_by(STEP).map(move |x| y * width + x)) {
        let [before, own, after] = [0, 1, 2].map(|at| frames[at] * width * height + place);
        let label = gbuffer.label[own];
        // Behind everything nothing moves.
        if label == 0 || gbuffer.label[before] != label || gbuffer.label[after] != label {
            continue;
        }
        let [a, b, c] = [before, own, after].map(|pixel| gbuffer.uv[pixel]);
        let steps = [difference(a, b), difference(b, c)];
        if steps.iter().any(|&step| size(step) > ANOTHER) {
            continue;
        }
        motion.pixels += 1.0;
        let share = (size(difference(steps[0], steps[1])) / change).min(1.0);
        motion.changed += share * share;
        for (sum, step) in motion.steps.iter_mut().zip(steps) {
            *sum += size(step);
        }
    }
    // Beside a cut few pixels show the same surface, and say nothing of the others.
    let looked_at = (width.div_ceil(STEP) * height.div_ceil(STEP)) as f32;
    if 16.0 * motion.pixels < looked_at { Motion::default() } else { motion }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cubist_core::format::{SPACE_CUBIC, TIME_LINEAR};

    /// Keys of 48 frames in which `part` of the screen's columns is `shift(frame)` texels along a chart, the others stand still.
    fn of(part: usize, looping: bool, shift: fn(f32) -> f32) -> Option<Vec<u32>> {
        timed(TIME_CUBIC, part, looping, shift)
    }

    fn timed(time: u8, part: usize, looping: bool, shift: fn(f32) -> f32) -> Option<Vec<u32>> {
        let (width, height, frames) = (32, 24, 48);
        let all = (0..frames).flat_map(|frame| (0..width * height).map(move |at| (frame, at % width, at / width)));
        let uv: Vec<[f32; 2]> = all.map(|(frame, x, y)| [x as f32 + if x < part { shift(frame as f32) } else { 0.0 }, y as f32]).collect();
        let gbuffer = GBuffer { width: 32, height: 24, frames: 48, label: vec![1; uv.len()], uv: uv.into() };
        keys(&gbuffer, &KeyGrid::new(&gbuffer, 3, 8, looping, [time, SPACE_CUBIC]))
    }

    #[test]
    fn a_stop_and_a_start_get_two_keys_where_nothing_moves() {
        assert_eq!(of(32, false, |frame| 2.0 * frame.min(21.0)), Some(vec![0, 8, 16, 21, 22, 32, 40, 47]));
        assert_eq!(of(32, false, |frame| 2.0 * frame.max(21.0)), Some(vec![0, 8, 16, 20, 21, 24, 32, 40, 47]));
        assert_eq!(of(8, false, |frame| 2.0 * frame.min(21.0)), Some(vec![0, 8, 16, 21, 22, 32, 40, 47]), "a quarter of the screen");
        assert_eq!(of(2, false, |frame| 2.0 * frame.min(21.0)), None, "a sixteenth");
    }

    #[test]
    fn straight_lines_do_with_one_key() {
        assert_eq!(timed(TIME_LINEAR, 32, false, |frame| 2.0 * frame.min(21.0)), Some(vec![0, 8, 16, 21, 24, 32, 40, 47]));
    }

    #[test]
    fn a_turn_between_two_frames_gets_a_key_at_both() {
        assert_eq!(of(32, false, |frame| 2.0 * (frame - 28.4).abs()), Some(vec![0, 8, 16, 24, 28, 29, 32, 40, 47]));
    }

    #[test]
    fn a_loop_that_turns_at_its_end_gets_a_key_there() {
        assert_eq!(of(32, true, |frame| 2.0 * (frame - 24.0).abs()), Some(vec![0, 1, 8, 16, 24, 25, 32, 40]));
    }

    #[test]
    fn motion_that_changes_all_the_time_is_no_kink() {
        assert_eq!(of(32, false, |frame| 2.0 * frame), None);
        assert_eq!(of(32, false, |frame| 0.2 * frame * frame), None);
        assert_eq!(of(32, false, |frame| 20.0 * libm::sinf(frame / 5.0)), None);
        assert_eq!(of(32, false, |frame| 2.0 * (frame % 4.0)), None, "to and fro from frame to frame");
        assert_eq!(of(32, false, |frame| 0.1 * frame.min(21.0)), None, "a tenth of a texel off at most");
        assert_eq!(of(32, false, |frame| if frame > 21.0 { 100.0 } else { 0.0 }), None, "a cut");
    }
}
