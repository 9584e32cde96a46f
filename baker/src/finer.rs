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

/// What was kept: the settings, the bundle, and what the user should know about it.
type Kept = (Settings, Encoded, Vec<String>);

/// `encoded`, which `settings` made, or a bundle of smaller cells if that is worth more, as sparing counts it.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(scene: &Scene, flat: &Flat, settings: Settings, encoded: Encoded, progress: Progress<'_>) -> Result<Kept, BakeError> {
    let quality = |encoded: &Encoded| verify::against_exact(&encoded.bundle, &flat.atlas, &|_, _| {});
    let coarse = quality(&encoded)?;
    if coarse.wrong_surface_percent < TORN || settings.cell / 2 < SMALLEST || settings.key_interval * 2 > LONGEST {
        return Ok((settings, encoded, Vec::new()));
    }
    progress("trying smaller cells", 0.0);
    let smaller = Settings { cell: settings.cell / 2, key_interval: settings.key_interval * 2, ..settings };
    let finer = bake::encode(scene, flat, &smaller, &|_, _| {})?;
    let picture = image_bytes(&flat.atlas.image, settings.atlas.storage);
    let keys = |encoded: &Encoded| encoded.bundle.len().saturating_sub(picture) as u64;
    let worth = |encoded: &Encoded, quality: &Quality| metrics::worth(quality.psnr_mean, keys(encoded), DOUBLE);
    let fine = quality(&finer)?;
    if worth(&finer, &fine) <= worth(&encoded, &coarse) {
        return Ok((settings, encoded, Vec::new()));
    }
    let memory = |encoded: &Encoded| Bundle::parse(&encoded.bundle).map(|bundle| grouped(bundle.memory_needed())).unwrap_or_default();
    let said = format!(
        "many outlines cross every cell: --cell {} --key-interval {} are used, {:.1} dB in place of {:.1} with {} and {}, at {} B of working memory in \
         place of {}; give --cell {} for the latter",
        smaller.cell,
        smaller.key_interval,
        fine.psnr_mean,
        coarse.psnr_mean,
        settings.cell,
        settings.key_interval,
        memory(&finer),
        memory(&encoded),
        settings.cell
    );
    Ok((smaller, finer, vec![said]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn pictures_that_come_out_right_keep_their_cells() {
        let mut scene = builtin::build("cone-orbit").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (80, 60, 9);
        let settings = Settings::default();
        let flat = bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
        let encoded = bake::encode(&scene, &flat, &settings, &|_, _| {}).unwrap();
        let bytes = encoded.bundle.clone();
        let (kept, encoded, said) = choose(&scene, &flat, settings, encoded, &|_, _| {}).unwrap();
        assert_eq!((kept.cell, encoded.bundle == bytes, said.len()), (settings.cell, true, 0));
    }

    #[test]
    fn a_fence_gets_smaller_cells() {
        // Columns seen so small that many stand in every cell of 16 pixels.
        let mut scene = builtin::build("round-columns").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (64, 48, 17);
        let settings = Settings { cell: 16, key_interval: 4, ..Settings::default() };
        let flat = bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
        let encoded = bake::encode(&scene, &flat, &settings, &|_, _| {}).unwrap();
        let before = verify::against_exact(&encoded.bundle, &flat.atlas, &|_, _| {}).unwrap();
        let (kept, encoded, said) = choose(&scene, &flat, settings, encoded, &|_, _| {}).unwrap();
        let after = verify::against_exact(&encoded.bundle, &flat.atlas, &|_, _| {}).unwrap();
        assert_eq!((kept.cell, kept.key_interval, said.len()), (8, 8, 1));
        assert!(after.psnr_mean > before.psnr_mean + 0.5, "{before:?} {after:?}");
    }
}
