//! The choice of charts: each family flattens and codes the scene at half the size, and what costs least in bytes and quality is kept.
//! Scenes and settings come from `job`, which bakes what is chosen; the report and the bundle say why.

use crate::atlas::{self, LONGER, Storage};
use crate::bake::{self, BakeError, Flat, Progress, Settings, Sparing, something_seen};
use crate::cast::Cast;
use crate::chart::{self, Charting, Choice, Family, Trial};
use crate::encode;
use crate::scene::Scene;
use crate::trace::Tracer;
use crate::truth::Truth;
use crate::verify;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Screens narrower or lower than this are tried as they are.
const SMALL: u32 = 160;
/// Frames that a trial has at most.
const FRAMES: u32 = 128;
/// Frames compared with the truth.
const COMPARED: u32 = 8;
/// A model whose texture is in more islands than this is not tried with them: they would share labels, and rectangles as large as the image.
const MOST: usize = 2048;
/// What moving texels has to gain to be done, dB: less may come of anything.
const GAIN: f64 = 0.1;
/// How full of texels a raw image gets where trials do not care.
const FULL: f64 = 0.75;
/// The picture of half the size, in parts of the whole one: a little over a quarter, since outlines shrink less than areas.
const PICTURE: f64 = 1.0 / 3.5;

/// Tries the families on the scene of `tracer`: those that can flatten it, the scene's own among them if it brings one or has a texture that does. Then
/// the best of them with texels moved inside charts, unless `rewarp` says whether they are.
///
/// # Errors
/// [`BakeError`] where no family can bake the scene.
pub fn charts(tracer: &Tracer<'_>, settings: &Settings, rewarp: Option<bool>, progress: Progress<'_>) -> Result<Choice, BakeError> {
    let scene = tracer.scene();
    let families: &[Family] = if chart::brings_own(scene) {
        &[Family::Own, Family::Planes, Family::Sight]
    } else if chart::Islands::new(scene).is_ok_and(|islands| islands.count <= MOST) {
        &[Family::Planes, Family::Sight, Family::Own]
    } else {
        &[Family::Planes, Family::Sight]
    };
    let storage = settings.atlas.storage;
    let (small, settings) = halved(scene, settings);
    let cast = Cast::by(tracer.of(&small), &|_, _| {});
    let hits = &cast.hits;
    let truth = Truth::by(tracer.of(&small));
    let pictures = truth.frames(COMPARED);
    let settings_of = |family: Family, rewarped: bool| {
        let charts = Choice { rewarped, ..family.into() };
        Settings { atlas: atlas::Settings { charts, ..settings.atlas }, ..settings }
    };
    let tried = |charting: Charting, family: Family, rewarped: bool| -> Result<Trial, BakeError> {
        let settings = settings_of(family, rewarped);
        let atlas = atlas::of_charts(&small, hits, charting, &settings.atlas, &|_, _| {})?;
        let flat = bake::flat(&cast, atlas);
        let (keys, picture, psnr) = attempt(&small, &flat, &settings, storage, &pictures)?;
        let keys = keys * f64::from(scene.playback.frames) / f64::from(small.playback.frames.max(1));
        let scale = if small.playback.width < scene.playback.width { PICTURE } else { 1.0 };
        Ok(Trial { family, rewarped, bytes: (keys + picture / scale) as u64, psnr })
    };
    let (steps, done) = (families.len() + 1, AtomicUsize::new(0));
    progress("trying charts", 0.0);
    // Side by side: much of each is a matter of one thread.
    let of = |&family: &Family| {
        let charting = atlas::charts(&small, hits, &settings_of(family, false).atlas).map_err(BakeError::from);
        let trial = charting.and_then(|charting| Ok((tried(charting.clone(), family, rewarp.unwrap_or(false))?, charting)));
        progress("trying charts", (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / steps as f64);
        trial
    };
    let plain: Vec<Result<(Trial, Charting), BakeError>> = families.par_iter().map(of).collect();
    let mut choice = Choice::from(Family::Planes);
    for (slot, plain) in choice.trials.iter_mut().zip(&plain) {
        *slot = plain.as_ref().ok().map(|(trial, _)| *trial);
    }
    // Of equals the first.
    let better = |best: (Trial, Charting), other: (Trial, Charting)| if other.0.worth() > best.0.worth() { other } else { best };
    let mut refused = None;
    let known = plain.into_iter().filter_map(|plain| plain.map_err(|error| refused = refused.take().or(Some(error))).ok());
    let Some((mut best, charting)) = known.reduce(better) else { return refused.map_or(Ok(choice), Err) };
    if rewarp.is_none() {
        let warped = tried(charting, best.family, true).ok();
        let [.., last] = &mut choice.trials;
        *last = warped;
        best = warped.filter(|warped| warped.worth() > best.worth() + GAIN).unwrap_or(best);
    }
    progress("trying charts", 1.0);
    Ok(Choice { family: best.family, rewarped: best.rewarped, ..choice })
}

/// The scene at half the size and the settings for it. Cells keep theirs: half as many either way take a quarter of the time. To fill a raw image takes
/// most of the time that it takes to make it: trials do without.
fn halved(scene: &Scene, settings: &Settings) -> (Scene, Settings) {
    let (mut small, mut settings) = (scene.clone(), *settings);
    let play = &mut small.playback;
    play.frames = play.frames.min(FRAMES);
    if play.width.min(play.height) >= SMALL {
        (play.width, play.height) = (play.width / 2, play.height / 2);
    }
    (settings.atlas.storage, settings.sparing) = (Storage::Packed, Sparing::Nothing);
    settings.atlas.outline = settings.atlas.outline.or(Some(0));
    // All frames are meant.
    settings.atlas.detail *= (f64::from(scene.playback.frames) + LONGER) / (f64::from(play.frames) + LONGER);
    (small, settings)
}

/// Bytes of keys, bytes of the picture in `storage`, and PSNR against the truth.
fn attempt(
    scene: &Scene,
    flat: &Flat,
    settings: &Settings,
    storage: Storage,
    pictures: &[(u32, Vec<u8>)],
) -> Result<(f64, f64, f64), BakeError> {
    something_seen(flat)?;
    let encoded = bake::encode(scene, flat, settings, &|_, _| {})?;
    let image = &flat.atlas.image;
    let packed = encode::image_bytes(image, settings.atlas.storage) as f64;
    let picture = match storage {
        Storage::Packed => packed,
        Storage::Raw => encode::image_bytes(image, storage) as f64 * (flat.atlas.figures.fill / FULL).min(1.0),
    };
    let psnr = verify::against_pictures(&encoded.bundle, pictures)?;
    Ok((encoded.bundle.len() as f64 - packed, picture, psnr))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn every_family_is_tried_on_a_scene_with_islands() {
        let mut scene = builtin::build("pyramid").expect("there is one");
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (96, 64, 9);
        let choice = charts(&Tracer::new(&scene), &Settings::default(), Some(false), &|_, _| {}).expect("it bakes");
        let tried: Vec<Family> = choice.tried().map(|t| t.family).collect();
        assert_eq!(tried, [Family::Own, Family::Planes, Family::Sight]);
        assert!(choice.tried().all(|t| t.bytes > 100 && t.psnr > 20.0), "{choice:?}");
        let best = choice.tried().map(|t| t.worth()).fold(f64::NEG_INFINITY, f64::max);
        assert!(choice.tried().any(|t| t.family == choice.family && t.worth() == best));
    }
}
