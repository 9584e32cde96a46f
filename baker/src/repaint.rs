//! Repainting: every texel in the colour that suits the pixels that show it.
//! A finished bundle and its source image come from `job`, those that are tried from searches, `seen` and `halves`; both go back with other colours,
//! everything else as it was.
//!
//! A texel is coloured by what lies there, but pixels show it that see what lies around it too, and by positions that are interpolated. Where pixels show
//! their nearest texel, the squared error of all of them is a sum over texels, and each one's part is least at the mean of what the scene has in its
//! pixels. Fine ribs then come out grey instead of speckled, and thin rods as bright as they are on the whole.

use crate::atlas::{self, Atlas, SourceImage};
use crate::bake::Progress;
use crate::cast::Cast;
use crate::encode;
use crate::gbuffer::{BACKGROUND, Sample};
use crate::made::Made;
use crate::options::Goal;
use crate::shade::Shader;
use crate::truth::spread;
use crate::verify::{self, VerifyError};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Frames looked at, evenly spread.
const FRAMES: u32 = 128;
/// Bytes that the frames looked at may take: of large ones there are fewer.
const MOST_BYTES: usize = 256 << 20;
/// Frames that one thread looks at in a row.
const RUN: usize = 4;
/// Colours that a picture keeps at least where more do not fit a budget.
const FEW: usize = 8;
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

/// The squared error of all pixels if texels had `colours`, less a part that no colours change.
fn error(shown: &[Shown], colours: impl Iterator<Item = [u8; 3]>) -> f64 {
    shown.iter().zip(colours).map(|(shown, colour)| shown.error(colour)).sum()
}

/// What the scene has in the pixels of some frames, at their centres. One sample of each is enough, for a texel is shown by many pixels; with more, texels
/// that are seen along outlines take in what lies beyond: .1 to .2 dB closer to the antialiased scene where outlines are not softened, as much farther where
/// they are, and smudges.
pub struct Painter {
    frames: Vec<u32>,
    /// R, G, B, row by row.
    pictures: Vec<Vec<u8>>,
}

impl Painter {
    /// Colours what rays hit; `progress` hears how many of the frames are done.
    #[must_use]
    pub fn new(cast: &Cast<'_>, progress: Progress<'_>) -> Self {
        let Cast { scene, hits, .. } = cast;
        let (width, size) = (hits.width as usize, hits.width as usize * hits.height as usize);
        let most = MOST_BYTES / (3 * size).max(1);
        let frames = spread(hits.frames, FRAMES.min(most.max(1) as u32));
        let (shader, total, done) = (Shader::new(scene), frames.len().max(1), AtomicUsize::new(0));
        let colour = |at: usize, sample: &Sample| match sample.surface {
            BACKGROUND => shader.background((at % width) as f64 + 0.5, (at / width) as f64 + 0.5),
            surface => shader.shade(surface, [sample.b, sample.c].map(f64::from), 0.0),
        };
        let coloured = |&frame: &u32| {
            let samples = hits.samples.iter().skip(frame as usize * size).take(size);
            let picture = samples.enumerate().flat_map(|(at, sample)| colour(at, sample).to_array().map(|v| (v + 0.5) as u8)).collect();
            progress("painting", (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / total as f64);
            picture
        };
        let pictures = frames.par_iter().map(coloured).collect();
        Self { frames, pictures }
    }

    /// Gives `made`, and the source image that it came from, colours that suit what it shows, where there are better ones and it reaches `goal`, if any, with
    /// them: whether it has them now.
    ///
    /// # Errors
    /// [`VerifyError`] where the player refuses the bytes.
    pub(crate) fn repaint(&self, made: &mut Made, atlas: &mut Atlas, goal: Option<Goal>) -> Result<bool, VerifyError> {
        // Fewer colours take fewer bytes, which a budget may ask for.
        let (all, before) = (made.settings.atlas.colours, atlas.image.palette.len());
        let fewer = (0..).map(|halvings| before >> halvings).take_while(|&colours| colours >= FEW);
        for colours in std::iter::once(all).chain(fewer.filter(|_| matches!(goal, Some(Goal::Budget(_))))) {
            let settings = atlas::Settings { colours, ..made.settings.atlas };
            let Some((bundle, image)) = self.painted(&made.encoded.bundle, &atlas.image, &settings)? else { break };
            if matches!(goal, Some(Goal::Budget(most)) if bundle.len() as u64 > most) {
                continue;
            }
            let quality = verify::briefly(&bundle, &image, &atlas.gbuffer)?;
            if matches!(goal, Some(Goal::Psnr(least)) if quality.psnr_mean < least) {
                break;
            }
            (made.encoded.bundle, made.quality, atlas.image) = (bundle, quality, image);
            return Ok(true);
        }
        Ok(false)
    }

    /// `bundle` and its source image in colours that suit what it shows, if there are any that suit better. The background keeps its own.
    ///
    /// # Errors
    /// [`VerifyError`] where the player refuses the bytes.
    pub fn painted(
        &self,
        bundle: &[u8],
        image: &SourceImage,
        settings: &atlas::Settings,
    ) -> Result<Option<(Vec<u8>, SourceImage)>, VerifyError> {
        let shown = self.shown(bundle, image)?;
        let painted = suited(&shown, image, settings);
        let [before, after] = [image, &painted].map(|image| error(&shown, image.texels.iter().map(|&texel| image.colour(texel))));
        if after >= before {
            return Ok(None);
        }
        Ok(encode::with_image(bundle, &painted, settings.storage).map(|bundle| (bundle, painted)))
    }

    /// `bundle` in colours that suit what it shows, with texels of the kind that `settings` ask for, whether that is better or not.
    ///
    /// # Errors
    /// [`VerifyError`] where the player refuses the bytes.
    pub(crate) fn recoloured(
        &self,
        bundle: &[u8],
        image: &SourceImage,
        settings: &atlas::Settings,
    ) -> Result<Option<Vec<u8>>, VerifyError> {
        Ok(encode::with_image(bundle, &suited(&self.shown(bundle, image)?, image, settings), settings.storage))
    }

    /// What the scene has in the pixels that show each texel of `image`. Sums of whole numbers: the same on any number of threads.
    fn shown(&self, bundle: &[u8], image: &SourceImage) -> Result<Vec<Shown>, VerifyError> {
        let none = || vec![Shown::default(); image.texels.len()];
        let of = |(frames, pictures): (&[u32], &[Vec<u8>])| {
            let (mut sums, mut pictures) = (none(), pictures.iter());
            verify::probe(bundle, frames, |_, positions| {
                let scene = pictures.next().map_or(&[][..], |picture| picture.as_chunks::<3>().0);
                for (&position, rgb) in positions.iter().zip(scene) {
                    let sum = &mut sums[image.place(position)];
                    sum.rgb.iter_mut().zip(rgb).for_each(|(sum, &v)| *sum += u64::from(v));
                    sum.pixels += 1;
                }
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
        self.frames.par_chunks(RUN).zip(self.pictures.par_chunks(RUN)).map(of).try_reduce(none, add)
    }
}

/// `bundle` in the colours that it gets in the end by `painter`: its own where there is none, or none that suit better.
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub(crate) fn finished<'b>(
    painter: Option<&Painter>,
    bundle: &'b [u8],
    image: &SourceImage,
    settings: &atlas::Settings,
) -> Result<Cow<'b, [u8]>, VerifyError> {
    let painted = painter.map_or(Ok(None), |painter| painter.painted(bundle, image, settings))?;
    Ok(painted.map_or(Cow::Borrowed(bundle), |(painted, _)| Cow::Owned(painted)))
}

/// `image` in the colours that suit what is `shown` of each texel, reduced to what texels of `settings` can have. The background is not repainted.
fn suited(shown: &[Shown], image: &SourceImage, settings: &atlas::Settings) -> SourceImage {
    let [left, top, right, bottom] = image.labels.first().map_or([0; 4], |background| background.rect.map(u32::from));
    let fixed = |texel: u32| (left..right).contains(&(texel % image.width)) && (top..bottom).contains(&(texel / image.width));
    let before = image.texels.iter().map(|&texel| image.colour(texel));
    let best = |((texel, colour), shown): ((u32, [u8; 3]), &Shown)| if fixed(texel) { colour } else { shown.best(colour) };
    let wanted: Vec<[u8; 3]> = (0..).zip(before).zip(shown).map(best).collect();
    let seen: Vec<u32> = shown.iter().map(|shown| shown.pixels as u32).collect();
    let (texels, palette) = atlas::reduced(&wanted, &seen, settings);
    SourceImage { kind: settings.texels, texels: texels.into(), palette, ..image.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{self, Settings};
    use crate::inspect::Inspection;
    use crate::scene::{Scene, builtin};
    use crate::truth::Truth;
    use cubist_core::format::ATLAS;

    fn small(name: &str) -> (Scene, Atlas, Made) {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (96, 72, 17);
        let settings = Settings::default();
        let flat = bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
        let made = Made::new(&scene, &flat, settings).unwrap();
        (scene, flat.atlas, made)
    }

    fn repainted(scene: &Scene, atlas: &mut Atlas, made: &mut Made, goal: Option<Goal>) -> bool {
        Painter::new(&Cast::new(scene, &|_, _| {}), &|_, _| {}).repaint(made, atlas, goal).unwrap()
    }

    /// The mean PSNR against the antialiased scene, all frames.
    fn against_truth(scene: &Scene, made: &Made) -> f64 {
        let frames = spread(scene.playback.frames, u32::MAX);
        verify::against_truth(&made.encoded.bundle, &Truth::new(scene), &frames, &[], &|_, _| {}).unwrap().psnr_mean
    }

    #[test]
    fn the_best_colour_has_the_least_error() {
        let shown = Shown { rgb: [0, 255 * 999, 100 * 999], pixels: 999 };
        let best = shown.best([255, 0, 100]);
        assert_eq!(best, [0, 255, 100]);
        for other in [[1, 255, 100], [0, 254, 100], [0, 255, 99], [0, 255, 101]] {
            assert!(shown.error(best) < shown.error(other), "{other:?}");
        }
        // What no pixel shows keeps its colour.
        assert_eq!(Shown::default().best([7, 8, 9]), [7, 8, 9]);
    }

    #[test]
    fn pictures_come_closer_to_the_scene_by_colours_alone() {
        for (name, least) in [("round-columns", 1.0), ("terrain", 1.0), ("pivot", 0.2)] {
            let (scene, mut atlas, mut made) = small(name);
            let (before, bundle, image) = (against_truth(&scene, &made), made.encoded.bundle.clone(), atlas.image.clone());
            assert!(repainted(&scene, &mut atlas, &mut made, None), "{name}");
            let after = against_truth(&scene, &made);
            assert!(after > before + least, "{name}: {before} {after}");
            let of = |bytes: &[u8]| {
                let found = Inspection::of(bytes).unwrap();
                (found.key_bytes(), found.workspace, found.bytes - found.section_bytes(ATLAS))
            };
            assert_eq!(of(&bundle), of(&made.encoded.bundle), "{name}");
            // What goes with it are the figures of what plays.
            let figures = verify::against_exact(&made.encoded.bundle, &atlas, &|_, _| {}).unwrap();
            assert_eq!(made.quality.psnr_mean, figures.psnr_mean, "{name}");
            assert_eq!(made.quality.wrong_surface_percent, figures.wrong_surface_percent, "{name}");
            let [left, top, right, bottom] = image.labels[0].rect.map(u32::from);
            for texel in (top..bottom).flat_map(|y| (left..right).map(move |x| (y * image.width + x) as usize)) {
                let [before, after] = [&image, &atlas.image].map(|image| image.colour(image.texels[texel]));
                let apart = before.iter().zip(after).map(|(a, b)| a.abs_diff(b)).max().unwrap();
                assert!(apart <= 8, "{name}: the background was {before:?} and is {after:?}");
            }
        }
    }

    #[test]
    fn goals_that_are_reached_stay_reached() {
        let (scene, mut atlas, mut made) = small("pyramid");
        let (bundle, quality, texels) = (made.encoded.bundle.clone(), made.quality, atlas.image.texels.clone());
        for goal in [Goal::Budget(10), Goal::Psnr(99.0)] {
            assert!(!repainted(&scene, &mut atlas, &mut made, Some(goal)), "{goal:?}");
            assert!(made.encoded.bundle == bundle && made.quality == quality && atlas.image.texels == texels, "{goal:?}");
        }
        assert!(repainted(&scene, &mut atlas, &mut made, Some(Goal::Budget(1 << 20))) && made.encoded.bundle != bundle);
    }
}
