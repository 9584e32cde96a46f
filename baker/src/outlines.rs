//! Outlines finer than texels: where so many outlines cross a picture that a good part of it shows a wrong surface, masks of two and four bits a texel
//! each way may show more for the bytes. A bundle baked as usual comes from `job`; the best goes back. Lattices and foliage gain 1 to 3 dB.

use crate::atlas::Outline;
use crate::bake::{BakeError, Flat, Progress};
use crate::finer;
use crate::made::Made;
use crate::metrics;
use crate::report::grouped;
use crate::scene::Scene;
use crate::spare::DOUBLE;
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

/// `usual`, or what is made of the scene with a finer outline if that is worth more, which `flat` then has; and all that were tried, the finest last.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(scene: &Scene, flat: &mut Flat, usual: Made, progress: Progress<'_>) -> Result<(Made, Vec<Trial>), BakeError> {
    let finer = std::mem::take(&mut flat.atlas.finer);
    if finer.is_empty() || !finer::crossed(&usual.quality) {
        return Ok((usual, Vec::new()));
    }
    let mut trials = vec![Trial::new(&flat.atlas.image.outline, &usual)];
    let (count, mut best) = (finer.len(), (trials[0].worth(), flat.atlas.image.outline.clone(), usual));
    for (done, outline) in finer.into_iter().enumerate() {
        progress("trying outlines", done as f64 / count as f64);
        let mut settings = best.2.settings;
        settings.atlas.outline = Some(outline.finer);
        flat.atlas.image.outline = outline.clone();
        let made = Made::new(scene, flat, settings)?;
        let trial = Trial::new(&outline, &made);
        if trial.worth() > best.0 {
            best = (trial.worth(), outline, made);
        }
        trials.push(trial);
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
