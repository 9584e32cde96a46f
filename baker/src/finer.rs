//! Cells and keys of another shape: where so many outlines cross a cell that sheets are given up in a good part of the picture, cells half as large
//! with keys twice as far apart show more for the bytes; where outlines are few but positions bend on their way from key to key, as on rough land,
//! cells twice as large with keys twice as close do, in less memory. A bundle baked as usual comes from `job`; the better of two goes back.

use crate::bake::{self, BakeError, Encoded, Flat, Progress, Settings};
use crate::encode::image_bytes;
use crate::metrics;
use crate::report::grouped;
use crate::scene::Scene;
use crate::spare::DOUBLE;
use crate::verify::{self, Quality};
use cubist_core::Bundle;

/// Wrong pixels, percent, from which on smaller cells are worth a try. Most scenes have a tenth of that.
const TORN: f64 = 2.0;
/// Texels that a pixel in a hundred is off by, from which on closer keys are worth a try. Most scenes have a half to three quarters of that.
const BENT: f64 = 2.0;
/// The smallest and the largest cells there are, pixels.
const CELLS: [u32; 2] = [4, 32];
/// The longest interval between keys, frames.
const LONGEST: u32 = 256;

/// A bundle, what made it, and how good it is.
pub(crate) struct Made {
    pub settings: Settings,
    pub encoded: Encoded,
    pub quality: Quality,
}

impl Made {
    /// Quality less what `picture` bytes leave for keys, dB.
    fn worth(&self, picture: usize) -> f64 {
        metrics::worth(self.quality.psnr_mean, self.encoded.bundle.len().saturating_sub(picture) as u64, DOUBLE)
    }

    fn memory(&self) -> String {
        Bundle::parse(&self.encoded.bundle).map(|bundle| grouped(bundle.memory_needed())).unwrap_or_default()
    }
}

/// The cells and the interval worth a try after `settings` gave `quality`, and why.
fn other(settings: &Settings, quality: &Quality) -> Option<(Settings, &'static str)> {
    let Settings { cell, key_interval, .. } = *settings;
    let [smallest, largest] = CELLS;
    let (torn, bent) = (quality.wrong_surface_percent >= TORN, quality.path_error_texels.p99 >= BENT);
    if torn && cell / 2 >= smallest && key_interval * 2 <= LONGEST {
        Some((Settings { cell: cell / 2, key_interval: key_interval * 2, ..*settings }, "many outlines cross every cell"))
    } else if !torn && bent && cell * 2 <= largest && key_interval >= 2 {
        Some((
            Settings { cell: cell * 2, key_interval: key_interval / 2, ..*settings },
            "surfaces bend between keys more than between cells",
        ))
    } else {
        None
    }
}

/// `usual`, or a bundle of smaller or larger cells if that is worth more, as sparing counts it; and then what the user should know about it.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(scene: &Scene, flat: &Flat, usual: Made, progress: Progress<'_>) -> Result<(Made, Option<String>), BakeError> {
    let Some((settings, why)) = other(&usual.settings, &usual.quality) else { return Ok((usual, None)) };
    progress("trying other cells", 0.0);
    let encoded = bake::encode(scene, flat, &settings, &|_, _| {})?;
    let quality = verify::against_exact(&encoded.bundle, &flat.atlas, &|_, _| {})?;
    let tried = Made { settings, encoded, quality };
    let picture = image_bytes(&flat.atlas.image, settings.atlas.storage);
    if tried.worth(picture) <= usual.worth(picture) {
        return Ok((usual, None));
    }
    let Settings { cell, key_interval, .. } = usual.settings;
    let said = format!(
        "{why}: --cell {} --key-interval {} are used, {:.1} dB in place of {:.1} with {cell} and {key_interval}, at {} B of working memory in place \
         of {}; give --cell {cell} for the latter",
        settings.cell,
        settings.key_interval,
        tried.quality.psnr_mean,
        usual.quality.psnr_mean,
        tried.memory(),
        usual.memory(),
    );
    Ok((tried, Some(said)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    fn made(name: &str, size: [u32; 2], frames: u32, settings: Settings) -> (Scene, Flat, Made) {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (size[0], size[1], frames);
        let flat = bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
        let encoded = bake::encode(&scene, &flat, &settings, &|_, _| {}).unwrap();
        let quality = verify::against_exact(&encoded.bundle, &flat.atlas, &|_, _| {}).unwrap();
        (scene, flat, Made { settings, encoded, quality })
    }

    #[test]
    fn pictures_that_come_out_right_keep_their_cells() {
        let (scene, flat, coarse) = made("cone-orbit", [160, 120], 65, Settings::default());
        let bytes = coarse.encoded.bundle.clone();
        let (kept, said) = choose(&scene, &flat, coarse, &|_, _| {}).unwrap();
        assert_eq!((kept.settings.cell, kept.encoded.bundle == bytes, said), (Settings::default().cell, true, None));
    }

    #[test]
    fn a_fence_gets_smaller_cells() {
        // Columns seen so small that many stand in every cell of 16 pixels.
        let settings = Settings { cell: 16, key_interval: 4, ..Settings::default() };
        let (scene, flat, coarse) = made("round-columns", [64, 48], 17, settings);
        let before = coarse.quality.psnr_mean;
        let (kept, said) = choose(&scene, &flat, coarse, &|_, _| {}).unwrap();
        let after = verify::against_exact(&kept.encoded.bundle, &flat.atlas, &|_, _| {}).unwrap();
        assert_eq!((kept.settings.cell, kept.settings.key_interval, said.is_some()), (8, 8, true));
        assert!(after.psnr_mean > before + 0.5 && after.psnr_mean == kept.quality.psnr_mean, "{before} {after:?}");
    }

    #[test]
    fn rough_land_gets_larger_cells() {
        // Keys so far apart that no curve through them follows the hills.
        let settings = Settings { cell: 8, key_interval: 16, ..Settings::default() };
        let (scene, flat, usual) = made("terrain", [96, 72], 65, settings);
        let picture = image_bytes(&flat.atlas.image, settings.atlas.storage);
        let (before, memory) = (usual.worth(picture), usual.memory());
        let (kept, said) = choose(&scene, &flat, usual, &|_, _| {}).unwrap();
        assert_eq!((kept.settings.cell, kept.settings.key_interval), (16, 8));
        let said = said.unwrap();
        assert!(kept.worth(picture) > before && said.contains(&memory) && said.contains("--cell 16 --key-interval 8"), "{before} {said}");
    }

    #[test]
    fn cells_and_intervals_stay_in_their_range() {
        let tried = |cell, key_interval, wrong_surface_percent, p99| {
            let path_error_texels = verify::PathError { p99, ..verify::PathError::default() };
            let quality = Quality { wrong_surface_percent, path_error_texels, ..Quality::default() };
            other(&Settings { cell, key_interval, ..Settings::default() }, &quality).map(|(s, _)| (s.cell, s.key_interval))
        };
        // Torn, whether or not bent; bent; neither.
        assert_eq!([tried(8, 8, 2.0, 0.0), tried(8, 8, 2.0, 9.0)], [Some((4, 16)); 2]);
        assert_eq!([tried(8, 8, 1.9, 2.0), tried(8, 8, 1.9, 1.9)], [Some((16, 4)), None]);
        assert_eq!([tried(4, 8, 9.0, 9.0), tried(8, 200, 9.0, 9.0)], [None; 2]);
        assert_eq!([tried(32, 8, 0.0, 9.0), tried(16, 1, 0.0, 9.0), tried(16, 3, 0.0, 9.0)], [None, None, Some((32, 1))]);
    }
}
