//! Repainting: every texel in the colour that suits the pixels that show it.
//! A finished bundle and its source image come from `job`; both go back with other colours, everything else as it was.
//!
//! A texel is coloured by what lies there, but a played pixel sees more than that: as much of the scene as the pixel covers, by a position that is
//! interpolated. Where pixels show their nearest texel, the squared error of all of them is a sum over texels, and each one's part is least at the
//! mean of what the antialiased scene has in its pixels. Fine ribs then come out grey instead of speckled, and thin rods as bright as what they
//! cover of a pixel.

use crate::atlas::{self, Atlas, SourceImage};
use crate::bake::{Encoded, Progress, Settings};
use crate::encode;
use crate::job::Goal;
use crate::made::Made;
use crate::truth::{Truth, spread};
use crate::verify::{self, VerifyError};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Frames looked at, evenly spread: twice as many gained real scenes .04 dB.
const FRAMES: u32 = 64;
/// Samples of the scene along each side of a pixel: as good as four, for a texel is shown by many pixels.
const SIDE: u32 = 2;
/// Frames that one thread looks at in a row.
const RUN: usize = 4;
/// Pixels that the colour a texel had counts as.
const BEFORE: f64 = 1.0;

/// What the scene has in the pixels that show a texel: the sum of their colours, and how many they are.
#[derive(Clone, Copy, Default)]
struct Shown {
    rgb: [u64; 3],
    pixels: u64,
}

impl Shown {
    /// The squared error of the pixels if they had `colour`, less a part that no colour changes.
    fn error(&self, colour: [u8; 3]) -> f64 {
        let of = |(v, sum): (u8, u64)| f64::from(v) * (f64::from(v) * self.pixels as f64 - 2.0 * sum as f64);
        colour.into_iter().zip(self.rgb).map(of).sum()
    }

    /// The colour with the least, `before` counted in.
    fn best(&self, before: [u8; 3]) -> [u8; 3] {
        let of = |k: usize| (f64::from(before[k]) * BEFORE + self.rgb[k] as f64) / (BEFORE + self.pixels as f64);
        std::array::from_fn(|k| (of(k) + 0.5) as u8)
    }
}

/// Gives `made`, and the source image that it came from, colours that suit what it shows, where there are better ones and it reaches `goal` with them:
/// whether it has them now.
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub(crate) fn repaint(made: &mut Made, atlas: &mut Atlas, goal: Goal, truth: &Truth<'_>, progress: Progress<'_>) -> Result<bool, VerifyError> {
    let (Made { settings: Settings { atlas: settings, .. }, encoded: Encoded { bundle, .. }, quality }, image) = (made, &atlas.image);
    let Some(painted) = painted(bundle, image, settings, truth, progress)? else { return Ok(false) };
    let Some(with_it) = encode::with_image(bundle, &painted, settings.storage) else { return Ok(false) };
    let before = std::mem::replace(&mut atlas.image, painted);
    let after = verify::against_exact(&with_it, atlas, &|_, _| {})?;
    let reached = match goal {
        Goal::Budget(most) => with_it.len() as u64 <= most,
        Goal::Psnr(least) => after.psnr_mean >= least,
        Goal::AsSet | Goal::Ram(_) => true,
    };
    if reached {
        (*bundle, *quality) = (with_it, after);
    } else {
        atlas.image = before;
    }
    Ok(reached)
}

/// `image` in colours that suit what `bundle` shows of it, if there are any that suit better. The background keeps its own.
fn painted(
    bundle: &[u8],
    image: &SourceImage,
    settings: &atlas::Settings,
    truth: &Truth<'_>,
    progress: Progress<'_>,
) -> Result<Option<SourceImage>, VerifyError> {
    let shown = shown(bundle, image, truth, progress)?;
    let [left, top, right, bottom] = image.labels.first().map_or([0; 4], |background| background.rect.map(u32::from));
    let fixed = |texel: u32| (left..right).contains(&(texel % image.width)) && (top..bottom).contains(&(texel / image.width));
    let before: Vec<[u8; 3]> = image.texels.iter().map(|&texel| image.colour(texel)).collect();
    let wanted = (0..).zip(&before).zip(&shown).map(|((texel, &colour), shown)| if fixed(texel) { colour } else { shown.best(colour) });
    let seen: Vec<u32> = shown.iter().map(|shown| shown.pixels as u32).collect();
    let (texels, palette) = atlas::reduced(&wanted.collect::<Vec<_>>(), &seen, settings);
    let painted = SourceImage { texels, palette, ..image.clone() };
    let after = painted.texels.iter().map(|&texel| painted.colour(texel));
    let gained: f64 = shown.iter().zip(before.iter().zip(after)).map(|(shown, (&before, after))| shown.error(before) - shown.error(after)).sum();
    Ok((gained > 0.0).then_some(painted))
}

/// What the scene has in the pixels that show each texel of `image`, by some frames of `bundle`. Sums of whole numbers: the same on any number of threads.
fn shown(bundle: &[u8], image: &SourceImage, truth: &Truth<'_>, progress: Progress<'_>) -> Result<Vec<Shown>, VerifyError> {
    let frames = spread(truth.frames(), FRAMES);
    let (done, total) = (AtomicU32::new(0), frames.len().max(1) as f64);
    let none = || vec![Shown::default(); image.texels.len()];
    let of = |frames: &[u32]| {
        let mut sums = none();
        verify::probe(bundle, frames, |frame, positions| {
            let scene = truth.sampled(frame, SIDE);
            for (&position, rgb) in positions.iter().zip(scene.as_chunks::<3>().0) {
                let sum = &mut sums[image.place(position)];
                sum.rgb.iter_mut().zip(rgb).for_each(|(sum, &v)| *sum += u64::from(v));
                sum.pixels += 1;
            }
            progress("repainting", f64::from(done.fetch_add(1, Ordering::Relaxed) + 1) / total);
        })?;
        Ok(sums)
    };
    let add = |mut all: Vec<Shown>, some: Vec<Shown>| {
        for (all, some) in all.iter_mut().zip(some) {
            all.rgb.iter_mut().zip(some.rgb).for_each(|(all, some)| *all += some);
            all.pixels += some.pixels;
        }
        Ok(all)
    };
    frames.par_chunks(RUN).map(of).try_reduce(none, add)
}
