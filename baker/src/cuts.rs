//! Cuts, and turns too quick for the keys around them: where keys are added.
//! The G-buffer and the keys' frames come in; the frames go out with more among them.
//!
//! At a cut the camera jumps: nothing seen after it has to do with what was seen before, or places move by much more than before and after. Keys on
//! either side keep interpolation from reaching across. In a quick turn two keys see hardly anything in common: keys go in between.

use crate::gbuffer::{ANOTHER, GBuffer, difference, size};
use crate::sheets::KeyGrid;
use rayon::prelude::*;

/// A place that moves farther than the first of these from one frame to the next, texels, is another place. One that moves farther than another, but not the
/// last, may be: a camera may jump by little.
const FAR: [f32; 8] = [ANOTHER, 23.0, 16.0, 11.0, 8.0, 5.6, 4.0, 2.8];
/// At a cut this share of the screen, background aside, sees another place, percent, and
const MOST: usize = 60;
/// from the frame before to the last before it, and after it likewise, at most this; where the jump is small, another place seven tenths as far away.
const LEAST: usize = 20;
/// A key that sees more than this share of its pixels on surfaces that the next one sees nothing of, or the other way round, percent, is too far from it.
const STRANGE: usize = 50;

/// The frames of `grid`'s keys and those that cuts ask for; `None` where there is no cut.
///
/// Between a key at the last frame before a cut and one at the first after it no frame is interpolated. The curve between others also
/// looks one key farther: so two stand on either side.
#[must_use]
pub fn keys(gbuffer: &GBuffer, grid: &KeyGrid) -> Option<Vec<u32>> {
    let last = grid.frames - 1;
    let jumps: Vec<[usize; FAR.len()]> = (0..last).into_par_iter().map(|frame| jump(gbuffer, grid.size, [frame, frame + 1])).collect();
    // Between two frames that are a jump apart, and those before and after them that are not.
    let cut = |jump: [usize; FAR.len()], around: [Option<usize>; 2], small: bool| {
        let calm = |far: usize| around.iter().flatten().filter_map(|&at| jumps.get(at)).all(|jump| jump[far] <= LEAST);
        jump[0] >= MOST && calm(0) || small && (1..FAR.len() - 1).any(|far| jump[far] >= MOST && calm(far + 1))
    };
    let cuts = |small| (0..jumps.len()).filter(|&at| cut(jumps[at], [at.checked_sub(1), Some(at + 1)], small)).collect::<Vec<usize>>();
    // Jumps that come as often as keys are how things move here.
    let cuts = Some(cuts(true)).filter(|cuts| cuts.len() <= (grid.intervals() / 2).max(1)).unwrap_or_else(|| cuts(false));
    let around = |at: usize| (at as u32).saturating_sub(1)..=(at as u32 + 2).min(last);
    let mut keys: Vec<u32> = cuts.into_iter().flat_map(around).collect();
    // A path that loops may well end elsewhere than it begins.
    if grid.looping && last > 1 && cut(jump(gbuffer, grid.size, [last, 0]), [Some(0), Some(jumps.len() - 1)], true) {
        keys.extend([0, 1, last - 1, last]);
    }
    let at_cuts = keys.clone();
    keys.extend(&grid.keys);
    keys.sort_unstable();
    keys.dedup();
    let seen: Vec<Vec<usize>> = (0..grid.frames).into_par_iter().map(|frame| seen(gbuffer, grid.size, frame)).collect();
    let mut at = 0;
    while let Some(&[from, to]) = keys.get(at..at + 2) {
        let within = to > from + 1 && !at_cuts.contains(&from) && !at_cuts.contains(&to);
        if within && strange(&seen[from as usize], &seen[to as usize]) {
            keys.insert(at + 1, from.midpoint(to));
        } else {
            at += 1;
        }
    }
    (keys != grid.keys).then_some(keys)
}

/// How many pixels of `frame` show each label.
fn seen(gbuffer: &GBuffer, [width, height]: [usize; 2], frame: u32) -> Vec<usize> {
    let start = frame as usize * width * height;
    let mut counts = Vec::new();
    for &label in &gbuffer.label[start..start + width * height] {
        let label = usize::from(label);
        if label >= counts.len() {
            counts.resize(label + 1, 0);
        }
        counts[label] += 1;
    }
    counts
}

/// Whether most of what one of two frames sees of surfaces lies on such as the other sees nothing of: where those would be is for neither to
/// say, least of all beside or behind the camera.
fn strange(a: &[usize], b: &[usize]) -> bool {
    let alone = |a: &[usize], b: &[usize]| {
        // The background is everywhere.
        let all: usize = a.iter().skip(1).sum();
        let gone: usize =
            a.iter().enumerate().skip(1).filter(|&(label, _)| b.get(label).is_none_or(|&count| count == 0)).map(|of| of.1).sum();
        100 * gone > STRANGE * all
    };
    alone(a, b) || alone(b, a)
}

/// The share of the pixels, background aside, that see another place in the second of two frames than in the first, percent, for each distance of [`FAR`].
/// Of all pixels: a fence whose boards are as far apart as nodes passes all of those at once.
fn jump(gbuffer: &GBuffer, [width, height]: [usize; 2], frames: [u32; 2]) -> [usize; FAR.len()] {
    let (mut jumps, mut count) = ([0; FAR.len()], 0);
    let frames = frames.map(|frame| frame as usize * width * height..(frame as usize + 1) * width * height);
    for (from, to) in frames[0].clone().zip(frames[1].clone()) {
        // Behind everything nothing moves.
        if gbuffer.label[from] == 0 && gbuffer.label[to] == 0 {
            continue;
        }
        let (step, other) = (size(difference(gbuffer.uv[from], gbuffer.uv[to])), gbuffer.label[from] != gbuffer.label[to]);
        for (jumps, far) in jumps.iter_mut().zip(FAR) {
            *jumps += usize::from(other || step > far);
        }
        count += 1;
    }
    // Little is seen: it may come and go as it likes.
    jumps.map(|jumps| if 8 * count < width * height { 0 } else { 100 * jumps / count })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cubist_core::format::{SPACE_CUBIC, TIME_CUBIC};

    /// Keys of 24 frames in which all of the screen is `shift(frame)` texels along a chart.
    fn of(shift: fn(u32) -> f32) -> Option<Vec<u32>> {
        let (width, height, frames) = (32, 24, 24);
        let places =
            (0..frames).flat_map(|frame| (0..width * height).map(move |at| [(at % width) as f32 + shift(frame), (at / width) as f32]));
        let uv: Vec<[f32; 2]> = places.collect();
        let gbuffer = GBuffer { width, height, frames, label: vec![1; uv.len()], uv: uv.into() };
        keys(&gbuffer, &KeyGrid::new(&gbuffer, 3, 8, false, [TIME_CUBIC, SPACE_CUBIC]))
    }

    #[test]
    fn a_cut_gets_two_keys_on_either_side() {
        assert_eq!(of(|frame| frame as f32 + if frame > 11 { 100.0 } else { 0.0 }), Some(vec![0, 8, 10, 11, 12, 13, 16, 23]));
        assert_eq!(of(|frame| if frame > 0 { 100.0 } else { 0.0 }), Some(vec![0, 1, 2, 8, 16, 23]), "after the first frame");
        assert_eq!(of(|frame| frame as f32 + if frame > 11 { 5.0 } else { 0.0 }), Some(vec![0, 8, 10, 11, 12, 13, 16, 23]), "a small one");
        let in_motion = of(|frame| 5.0 * frame as f32 + if frame > 11 { 20.0 } else { 0.0 });
        assert_eq!(in_motion, Some(vec![0, 8, 10, 11, 12, 13, 16, 23]), "in motion");
    }

    #[test]
    fn a_turn_gets_keys_until_two_see_something_in_common() {
        // A pillar every 16 pixels, a label each; the screen of 32 pixels passes `speed` pixels a frame.
        let keys = |speed: usize| {
            let (width, height, frames) = (32usize, 24usize, 24usize);
            let labels = (0..frames * height * width).map(|at| 1 + ((at % width + at / (width * height) * speed) / 16) as u16);
            let label: Vec<u16> = labels.collect();
            let gbuffer = GBuffer { width: 32, height: 24, frames: 24, uv: vec![[0.0; 2]; label.len()].into(), label };
            keys(&gbuffer, &KeyGrid::new(&gbuffer, 3, 8, false, [TIME_CUBIC, SPACE_CUBIC]))
        };
        assert_eq!(keys(1), None, "half of the first key's pillars are in the next");
        assert_eq!(keys(4), Some(vec![0, 4, 8, 12, 16, 19, 23]), "a screen in eight frames: half of it in four");
    }

    #[test]
    fn a_loop_that_does_not_close_is_cut_at_its_end() {
        let (width, height, frames) = (32, 24, 24);
        let keys = |shift: fn(u32) -> u32| {
            let places =
                (0..frames).flat_map(|frame| (0..width * height).map(move |at| [(at % width + shift(frame)) as f32, (at / width) as f32]));
            let uv: Vec<[f32; 2]> = places.collect();
            let gbuffer = GBuffer { width, height, frames, label: vec![1; uv.len()], uv: uv.into() };
            keys(&gbuffer, &KeyGrid::new(&gbuffer, 3, 8, true, [TIME_CUBIC, SPACE_CUBIC]))
        };
        assert_eq!(keys(|frame| 3 * frame), Some(vec![0, 1, 8, 16, 22, 23]));
        assert_eq!(keys(|frame| 3 * frame.min(24 - frame)), None);
    }

    #[test]
    fn motion_is_no_cut_however_fast() {
        assert_eq!(of(|frame| frame as f32), None);
        assert_eq!(of(|frame| 40.0 * frame as f32), None);
        assert_eq!(of(|frame| 4.055 * frame as f32 - 0.025 * (frame * frame) as f32), None, "just above 4 texels a frame, then just below");
        assert_eq!(of(|frame| 6.0 * (frame / 2) as f32), None, "every other frame is shown twice");
    }
}
