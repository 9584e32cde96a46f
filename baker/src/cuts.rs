//! Cuts: between which frames the camera jumps, so that nothing seen after has to do with what was seen before.
//! The G-buffer comes in; the frames of the keys go out, with those added that keep interpolation on either side of each cut.

use crate::gbuffer::GBuffer;
use crate::sheets::KeyGrid;
use rayon::prelude::*;

/// A place that moves farther than this from one frame to the next, texels, is another place.
const FAR: f32 = 32.0;
/// At a cut this share of the screen, background aside, sees another place, percent, and
const MOST: usize = 60;
/// from the frame before to the last before it, and after it likewise, at most this.
const LEAST: usize = 20;

/// The frames of `grid`'s keys and those that cuts ask for; `None` where there is no cut.
///
/// Between a key at the last frame before a cut and one at the first after it no frame is interpolated. The curve between others also
/// looks one key farther: so two stand on either side.
#[must_use]
pub fn keys(gbuffer: &GBuffer, grid: &KeyGrid) -> Option<Vec<u32>> {
    let last = grid.frames - 1;
    let jumps: Vec<usize> = (0..last).into_par_iter().map(|frame| jump(gbuffer, grid.size, frame)).collect();
    let calm = |frame: Option<usize>| frame.and_then(|frame| jumps.get(frame)).is_none_or(|&jump| jump <= LEAST);
    let cuts = (0..jumps.len()).filter(|&at| jumps[at] >= MOST && calm(at.checked_sub(1)) && calm(Some(at + 1)));
    let mut keys: Vec<u32> = cuts.map(|at| at as u32).flat_map(|at| at.saturating_sub(1)..=(at + 2).min(last)).collect();
    if keys.is_empty() {
        return None;
    }
    keys.extend(&grid.keys);
    keys.sort_unstable();
    keys.dedup();
    Some(keys)
}

/// The share of the pixels, background aside, that see another place in the frame after `frame`, percent. Of all pixels: a fence whose boards
/// are as far apart as nodes passes all of those at once.
fn jump(gbuffer: &GBuffer, [width, height]: [usize; 2], frame: u32) -> usize {
    let (mut jumps, mut count) = (0, 0);
    let frames = [frame, frame + 1].map(|frame| frame as usize * width * height..(frame as usize + 1) * width * height);
    for (from, to) in frames[0].clone().zip(frames[1].clone()) {
        // Behind everything nothing moves.
        if gbuffer.label[from] == 0 && gbuffer.label[to] == 0 {
            continue;
        }
        let [a, b] = [from, to].map(|pixel| gbuffer.uv[pixel]);
        let far = (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) > FAR;
        jumps += usize::from(far || gbuffer.label[from] != gbuffer.label[to]);
        count += 1;
    }
    // Little is seen: it may come and go as it likes.
    if 8 * count < width * height { 0 } else { 100 * jumps / count }
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
    }

    #[test]
    fn motion_is_no_cut_however_fast() {
        assert_eq!(of(|frame| frame as f32), None);
        assert_eq!(of(|frame| 40.0 * frame as f32), None);
    }
}
