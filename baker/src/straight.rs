//! Straight space: a bundle whose surfaces bend between the corners of cells comes from `job`; one where they run straight goes back if that is
//! worth as much. It plays in a twentieth to a sixth fewer instructions and a tenth to a fifth less memory. Large flat surfaces seen at a slant
//! want the curve, most meshes show no difference. Where surfaces bend so that either is sure (see [`bends`]), nothing is tried.

use crate::bake::{BakeError, Flat, Progress, Settings};
use crate::bends::{self, Bends};
use crate::gbuffer::GBuffer;
use crate::inspect::{Inspection, space_name};
use crate::made::Made;
use crate::scene::Scene;
use crate::terminal::grouped;
use crate::verify;
use cubist_core::format::{SPACE_CUBIC, SPACE_LINEAR};
use serde::{Deserialize, Serialize};

/// Side of the largest cells that go straight, pixels: in larger ones surfaces bend too much.
const MOST: u32 = 8;
/// What curves have to gain to be used, dB: bytes of keys count as sparing counts them.
const GAIN: f64 = 0.1;

/// How surfaces bend, where that tells which space suits them in cells of `cell` pixels.
pub(crate) fn told(gbuffer: &GBuffer, cell: u32) -> Option<Bends> {
    if cell <= MOST { bends::of(gbuffer, cell) } else { None }
}

/// The space of what is first made in cells of `cell` pixels.
pub(crate) fn first(cell: u32, bends: Option<Bends>) -> u8 {
    if bends == Some(Bends::Rough) && cell <= MOST { SPACE_LINEAR } else { SPACE_CUBIC }
}

/// One kind of space, tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// What `--space` calls it.
    pub space: String,
    /// Bytes of keys, as the report counts them.
    pub keys: usize,
    /// Mean PSNR against exact rays, dB.
    pub psnr: f64,
    /// Bytes of working memory.
    pub memory: usize,
}

impl Trial {
    fn new(made: &Made) -> Result<Self, BakeError> {
        let found = Inspection::of(&made.encoded.bundle).map_err(verify::VerifyError::from)?;
        let space = space_name(made.settings.space).to_owned();
        Ok(Self { space, keys: found.key_bytes(), psnr: made.quality.psnr_mean, memory: found.workspace })
    }
}

/// `usual`, or what is made of the scene with straight space if that is worth as much; and both as they were tried, the straight one last. In large
/// cells nothing is tried, nor where it is straight already.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(scene: &Scene, flat: &Flat, usual: Made, progress: Progress<'_>) -> Result<(Made, Vec<Trial>), BakeError> {
    if usual.settings.cell > MOST || usual.settings.space == SPACE_LINEAR {
        return Ok((usual, Vec::new()));
    }
    let curved = usual;
    progress("trying straight space", 0.0);
    let straight = Made::new(scene, flat, Settings { space: SPACE_LINEAR, ..curved.settings })?;
    progress("trying straight space", 1.0);
    let trials = vec![Trial::new(&curved)?, Trial::new(&straight)?];
    let picture = curved.picture(flat);
    let gained = curved.worth(picture) - straight.worth(picture);
    Ok((if gained > GAIN { curved } else { straight }, trials))
}

/// What came of the kinds of space that were tried, in a line.
#[must_use]
pub fn reason(trials: &[Trial]) -> String {
    let told = |t: &Trial| format!("{} {:.2} dB, {} B of keys, {} B of memory", t.space, t.psnr, grouped(t.keys), grouped(t.memory));
    let all: Vec<String> = trials.iter().map(told).collect();
    format!("space tried: {}", all.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake;
    use crate::scene::builtin;

    fn chosen(name: &str, size: [u32; 2], frames: u32, cell: u32) -> (u8, Vec<Trial>) {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (size[0], size[1], frames);
        let settings = Settings { cell, ..Settings::default() };
        let flat = bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
        let (made, trials) = choose(&scene, &flat, Made::new(&scene, &flat, settings).unwrap(), &|_, _| {}).unwrap();
        (made.settings.space, trials)
    }

    #[test]
    fn a_floor_at_a_slant_keeps_its_curves() {
        let (space, trials) = chosen("cone-orbit", [160, 120], 33, 8);
        assert_eq!(space, SPACE_CUBIC, "{}", reason(&trials));
        assert!(trials[0].psnr > trials[1].psnr + 1.0 && trials[0].memory > trials[1].memory, "{}", reason(&trials));
    }

    #[test]
    fn rough_land_goes_straight() {
        let (space, trials) = chosen("terrain", [160, 120], 33, 8);
        assert_eq!(space, SPACE_LINEAR, "{}", reason(&trials));
        assert_eq!(trials.iter().map(|t| t.space.as_str()).collect::<Vec<_>>(), ["cubic", "linear"]);
    }

    #[test]
    fn large_cells_stay_curved() {
        assert_eq!(chosen("terrain", [96, 72], 9, 16), (SPACE_CUBIC, Vec::new()));
    }
}
