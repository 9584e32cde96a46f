//! Outlines finer than texels: where so many outlines cross a picture that a good part of it shows a wrong surface, masks of two and four bits a texel
//! each way may show more for the bytes. A bundle baked as usual comes from `job`; the best goes back. Lattices and foliage gain 1 to 3 dB.

use crate::atlas::Outline;
use crate::bake::{self, BakeError, Fitted, Flat, Progress};
use crate::finer;
use crate::made::Made;
use crate::metrics;
use crate::options::Limits;
use crate::scene::Scene;
use crate::spare::DOUBLE;
use crate::terminal::grouped;
use crate::verify;
use serde::{Deserialize, Serialize};

/// One outline, tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Bits a texel in each direction.
    pub bits: u32,
    /// Bytes of the bundle.
    pub bytes: usize,
    /// Mean PSNR against exact rays, dB.
    pub psnr: f64,
}

impl Trial {
    fn new(outline: &Outline, made: &Made) -> Self {
        Self { bits: outline.bits_a_texel(), bytes: made.encoded.bundle.len(), psnr: made.quality.psnr_mean }
    }

    fn worth(&self) -> f64 {
        metrics::worth(self.psnr, self.bytes as u64, DOUBLE)
    }
}

/// `usual`, or what is made of the scene with a finer outline if that is worth more, which `flat` then has; and all that were tried, the finest last:
/// one that is worth less than the one before is the last. Within `limits` of bytes quality alone counts. `fitted`: what `usual` came from, if that
/// is at hand.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(
    scene: &Scene,
    flat: &mut Flat,
    fitted: Option<Fitted>,
    usual: Made,
    limits: Limits,
    progress: Progress<'_>,
) -> Result<(Made, Vec<Trial>), BakeError> {
    let finer = std::mem::take(&mut flat.atlas.finer);
    if finer.is_empty() || !finer::crossed(&usual.quality) {
        return Ok((usual, Vec::new()));
    }
    let fitted = fitted.map_or_else(|| bake::fitted(scene, flat, &usual.settings, progress), Ok)?;
    let mut trials = vec![Trial::new(&flat.atlas.image.outline, &usual)];
    let worth = |trial: &Trial| if limits.bytes.is_some() { trial.psnr } else { trial.worth() };
    let (count, mut best) = (finer.len(), (worth(&trials[0]), flat.atlas.image.outline.clone(), usual));
    for (done, outline) in finer.into_iter().enumerate() {
        progress("trying outlines", done as f64 / count as f64);
        let mut settings = best.2.settings;
        settings.atlas.outline = Some(outline.finer);
        flat.atlas.image.outline = outline.clone();
        let made = Made::of(scene, flat, &fitted, settings)?;
        let trial = Trial::new(&outline, &made);
        let fits = limits.over(trial.bytes as u64, verify::memory(&made.encoded.bundle)?) == 0;
        let worth = worth(&trial);
        trials.push(trial);
        if worth <= best.0 || !fits {
            break;
        }
        best = (worth, outline, made);
    }
    progress("trying outlines", 1.0);
    let (_, outline, made) = best;
    flat.atlas.image.outline = outline;
    Ok((made, trials))
}

/// What came of the outlines that were tried, in a line.
#[must_use]
pub fn reason(trials: &[Trial]) -> String {
    let told = |t: &Trial| format!("{} {:.2} dB, {} B", t.bits, t.psnr, grouped(t.bytes));
    let all: Vec<String> = trials.iter().map(told).collect();
    format!("bits of outline a texel tried: {}", all.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas;
    use crate::bake::Settings;
    use crate::chart::Family;
    use crate::order::Coverage;
    use crate::scene::builtin;
    use cubist_core::format::SPACE_LINEAR;

    fn chosen(name: &str, settings: Settings, budget: Option<u64>) -> (u32, Flat, Made, Vec<Trial>) {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (64, 48, 17);
        let mut flat = bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
        let fitted = bake::fitted(&scene, &flat, &settings, &|_, _| {}).unwrap();
        let usual = Made::of(&scene, &flat, &fitted, settings).unwrap();
        let (made, trials) = choose(&scene, &mut flat, Some(fitted), usual, Limits { bytes: budget, memory: None }, &|_, _| {}).unwrap();
        (flat.atlas.image.outline.finer, flat, made, trials)
    }

    /// Stones seen so small that many stand in every cell, told by their charts alone.
    fn stones(budget: Option<u64>) -> (u32, Flat, Made, Vec<Trial>) {
        let source = atlas::Settings { charts: Family::Sight.into(), ..atlas::Settings::default() };
        let settings = Settings { key_interval: 4, space: SPACE_LINEAR, atlas: source, coverage: Coverage::Chart, ..Settings::default() };
        chosen("pivot", settings, budget)
    }

    #[test]
    fn what_stands_close_is_outlined_finely() {
        let (finer, flat, made, trials) = stones(None);
        assert!(trials.len() == 3 && trials.iter().map(|trial| trial.bits).eq([1, 2, 4]), "{}", reason(&trials));
        let best = trials.iter().map(Trial::worth).fold(f64::NEG_INFINITY, f64::max);
        let trial = &trials[finer as usize];
        assert!(finer > 0 && trial.worth() == best && trial.bytes == made.encoded.bundle.len(), "{}", reason(&trials));
        assert_eq!((made.settings.atlas.outline, flat.atlas.finer.len()), (Some(finer), 0));
    }

    #[test]
    fn a_budget_bounds_them_and_counts_no_bytes_within() {
        let (finest, _, _, trials) = stones(Some(1 << 20));
        let most = trials.iter().map(|trial| trial.psnr).fold(f64::NEG_INFINITY, f64::max);
        assert!(trials.len() == 3 && trials[finest as usize].psnr == most, "{}", reason(&trials));
        let (finer, _, made, tried) = stones(Some(trials[1].bytes as u64));
        assert!(finer == 1 && made.encoded.bundle.len() == trials[1].bytes && tried == trials, "{}", reason(&tried));
        let (usual, _, made, _) = stones(Some(trials[0].bytes as u64));
        assert!(usual == 0 && made.encoded.bundle.len() == trials[0].bytes);
    }

    #[test]
    fn few_outlines_stay_as_they_are() {
        let (finer, _, _, trials) = chosen("pyramid", Settings::default(), None);
        assert!(finer == 0 && trials.is_empty());
    }
}
