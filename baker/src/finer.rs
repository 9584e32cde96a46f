//! Finer cells for lattices and foliage: where so many outlines cross a cell that sheets are given up in a good part of the picture, cells half
//! as large with keys twice as far apart show more for the bytes. A bundle baked as usual comes from `job`; the better of two goes back.

use crate::bake::{self, BakeError, Encoded, Flat, Progress, Settings};
use crate::encode::image_bytes;
use crate::metrics;
use crate::report::grouped;
use crate::scene::Scene;
use crate::spare::DOUBLE;
use crate::verify::{self, Quality};
use cubist_core::Bundle;

/// Wrong pixels, percent, from which on it is worth a try. Most scenes have a tenth of that.
const TORN: f64 = 2.0;
/// The smallest cells there are, pixels.
const SMALLEST: u32 = 4;
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

/// `coarse`, or a bundle of smaller cells if that is worth more, as sparing counts it; and then what the user should know about it.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(scene: &Scene, flat: &Flat, coarse: Made, progress: Progress<'_>) -> Result<(Made, Option<String>), BakeError> {
    let Settings { cell, key_interval, .. } = coarse.settings;
    if coarse.quality.wrong_surface_percent < TORN || cell / 2 < SMALLEST || key_interval * 2 > LONGEST {
        return Ok((coarse, None));
    }
    progress("trying smaller cells", 0.0);
    let settings = Settings { cell: cell / 2, key_interval: key_interval * 2, ..coarse.settings };
    let encoded = bake::encode(scene, flat, &settings, &|_, _| {})?;
    let quality = verify::against_exact(&encoded.bundle, &flat.atlas, &|_, _| {})?;
    let fine = Made { settings, encoded, quality };
    let picture = image_bytes(&flat.atlas.image, settings.atlas.storage);
    if fine.worth(picture) <= coarse.worth(picture) {
        return Ok((coarse, None));
    }
    let said = format!(
        "many outlines cross every cell: --cell {} --key-interval {} are used, {:.1} dB in place of {:.1} with {cell} and {key_interval}, at {} B of \
         working memory in place of {}; give --cell {cell} for the latter",
        settings.cell,
        settings.key_interval,
        fine.quality.psnr_mean,
        coarse.quality.psnr_mean,
        fine.memory(),
        coarse.memory(),
    );
    Ok((fine, Some(said)))
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
        let (scene, flat, coarse) = made("cone-orbit", [80, 60], 9, Settings::default());
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
}
