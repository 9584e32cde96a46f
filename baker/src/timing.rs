//! Timing: keys where they are needed. Positions that bend much from key to key ask for short intervals, others do with long ones.
//! The G-buffer comes in; the frames of as many keys as at even intervals go out.
//!
//! Interpolating through four keys leaves an error of about 3/128 of the positions' fourth difference, which grows with the fourth power
//! of the interval. With a given number of keys the sum of errors is least where intervals are as the error's fifth root to minus one.

use crate::gbuffer::{ANOTHER, GBuffer};
use crate::sheets::KeyGrid;

/// What else is off, as a fourth difference, texels: below it time does not matter.
const FLOOR: f64 = 2.0;
/// The first and the last interval of a path that ends know no key beyond: their error is as if positions bent this much more.
const END: f64 = 12.0;
/// Intervals are at most this many times as long or short as asked for.
const MOST: f64 = 2.0;

/// Frames for as many keys as `grid` has, whose intervals are even, and one more on a path that ends; `None` where even ones are as good.
#[must_use]
pub fn place(gbuffer: &GBuffer, grid: &KeyGrid) -> Option<Vec<u32>> {
    let intervals = grid.intervals();
    if intervals < 6 {
        return None;
    }
    let density = |interval: usize| {
        let end = !grid.looping && (interval == 0 || interval + 1 == intervals);
        libm::pow(bend(gbuffer, grid, interval) * if end { END } else { 1.0 } + FLOOR, 0.2)
    };
    let densities: Vec<f64> = (0..intervals).map(density).collect();
    let frames: Vec<f64> = (0..intervals).map(|interval| f64::from(grid.length(interval as isize))).collect();
    let total: f64 = frames.iter().zip(&densities).map(|(frames, density)| frames * density).sum();
    let mean = total / frames.iter().sum::<f64>();
    let densities: Vec<f64> = densities.iter().map(|density| (density / mean).clamp(1.0 / MOST, MOST)).collect();
    // Keys stand where the sum of densities passes equal parts.
    let total: f64 = frames.iter().zip(&densities).map(|(frames, density)| frames * density).sum();
    // The ends of a path ask for a key more.
    let more = usize::from(!grid.looping);
    let (wanted, count) = (intervals + more, grid.keys.len() + more);
    let mut keys = vec![0u32];
    let (mut passed, mut frame) = (0.0, 0.0);
    for (length, density) in frames.iter().zip(&densities) {
        let next = passed + length * density;
        while keys.len() < count && keys.len() as f64 / wanted as f64 * total <= next + 1e-9 {
            let part = keys.len() as f64 / wanted as f64 * total - passed;
            let stands = libm::round(frame + part / density) as u32;
            keys.push(stands.max(keys[keys.len() - 1] + 1));
        }
        (passed, frame) = (next, frame + length);
    }
    if keys.len() != count {
        return None;
    }
    // A loop ends with an interval back to the first key, another path with a key at its last frame.
    let end = if grid.looping { grid.frames } else { grid.frames - 1 };
    if !grid.looping {
        keys.pop();
    }
    if keys.last().is_some_and(|&key| key >= end) {
        return None;
    }
    if !grid.looping {
        keys.push(end);
    }
    // Even intervals are cheaper to play where the others gain nothing.
    let even = keys.iter().zip(&grid.keys).all(|(a, b)| a.abs_diff(*b) <= 1);
    (!even).then_some(keys)
}

/// The mean size of the fourth difference of positions around the middle of interval `interval`, at steps of half an interval but counted
/// as if at whole ones, texels; over the pixels at nodes that see one label all the time.
fn bend(gbuffer: &GBuffer, grid: &KeyGrid, interval: usize) -> f64 {
    let step = (grid.length(interval as isize) / 2).max(1);
    let middle = grid.keys[interval] + grid.length(interval as isize) / 2;
    let last = grid.frames - 1;
    let middle = if grid.looping { middle } else { middle.clamp((2 * step).min(last), last.saturating_sub(2 * step)) };
    let frames = [-2, -1, 0, 1, 2].map(|at| grid.beside(middle, at * i64::from(step)));
    let [Some(a), Some(b), Some(c), Some(d), Some(e)] = frames else { return 0.0 };
    let [width, height] = grid.size;
    let spacing = 1usize << grid.grid.log2;
    let (mut sum, mut count) = (0.0f64, 0u32);
    for y in (0..height).step_by(spacing) {
        for x in (0..width).step_by(spacing) {
            let pixels = [a, b, c, d, e].map(|frame| (frame * height + y) * width + x);
            let label = gbuffer.label[pixels[0]];
            if label == 0 || pixels.iter().any(|&pixel| gbuffer.label[pixel] != label) {
                continue;
            }
            let [a, b, c, d, e] = pixels.map(|pixel| gbuffer.uv[pixel]);
            let axis = |axis: usize| (a[axis] - 4.0 * b[axis] + 6.0 * c[axis] - 4.0 * d[axis] + e[axis]).abs();
            // Twice as long intervals bend sixteen times as much.
            sum += f64::from(axis(0).max(axis(1)).min(ANOTHER / 16.0) * 16.0);
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}
