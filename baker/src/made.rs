//! A bundle as choices weigh it: what made it, how good it is, and what it costs. `job` makes the usual one; `finer` and `straight` make others.

use crate::bake::{self, BakeError, Encoded, Fitted, Flat, Settings};
use crate::encode::image_bytes;
use crate::metrics;
use crate::scene::Scene;
use crate::spare::DOUBLE;
use crate::terminal::grouped;
use crate::verify::{self, Brief};

/// A bundle, what made it, and how good it is.
pub(crate) struct Made {
    pub settings: Settings,
    pub encoded: Encoded,
    pub quality: Brief,
}

impl Made {
    /// What `settings` make of it.
    ///
    /// # Errors
    /// Those of encoding, and of the player.
    pub fn new(scene: &Scene, flat: &Flat, settings: Settings) -> Result<Self, BakeError> {
        Self::of(scene, flat, &bake::fitted(scene, flat, &settings, &|_, _| {})?, settings)
    }

    /// Likewise; `None` where that is more than a bundle can hold.
    ///
    /// # Errors
    /// The others.
    pub fn tried(scene: &Scene, flat: &Flat, settings: Settings) -> Result<Option<Self>, BakeError> {
        match Self::new(scene, flat, settings) {
            Err(BakeError::Limit(_)) => Ok(None),
            made => made.map(Some),
        }
    }

    /// What the same make of sheets that are `fitted` already.
    ///
    /// # Errors
    /// The same.
    pub fn of(scene: &Scene, flat: &Flat, fitted: &Fitted, settings: Settings) -> Result<Self, BakeError> {
        let encoded = bake::settled(scene, flat, fitted, &settings, &|_, _| {})?;
        let quality = verify::briefly(&encoded.bundle, &flat.atlas.image, &flat.atlas.gbuffer)?;
        Ok(Self { settings, encoded, quality })
    }

    /// Bytes of its source image, made of `flat`. A packed one is packed to tell.
    pub fn picture(&self, flat: &Flat) -> usize {
        image_bytes(&flat.atlas.image, self.settings.atlas.storage)
    }

    /// Quality less what all but its source image of `picture` bytes takes, dB, as sparing counts it.
    pub fn worth(&self, picture: usize) -> f64 {
        metrics::worth(self.quality.psnr_mean, self.encoded.bundle.len().saturating_sub(picture) as u64, DOUBLE)
    }

    /// Whether `other` is better than it, and smaller in flash and in memory.
    pub fn beaten(&self, other: &Self) -> bool {
        let memory = |made: &Self| verify::memory(&made.encoded.bundle).unwrap_or(0);
        let (bytes, psnr) = (|made: &Self| made.encoded.bundle.len(), |made: &Self| made.quality.psnr_mean);
        bytes(other) <= bytes(self) && memory(other) <= memory(self) && psnr(other) >= psnr(self)
    }

    /// What it is in the words of a warning.
    pub fn told(&self) -> String {
        let Self { encoded: Encoded { bundle, .. }, quality, .. } = self;
        let memory = verify::memory(bundle).map(grouped).unwrap_or_default();
        format!("{:.1} dB before repainting, in a bundle of {} B and {memory} B of memory", quality.psnr_mean, grouped(bundle.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn what_no_bundle_holds_is_none() {
        // In cells of 4 pixels 257 x 258 nodes with a layer each at least: more than 16 bits count.
        let mut scene = builtin::build("pyramid").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (1024, 1028, 1);
        let flat = bake::flatten(&scene, &crate::atlas::Settings::default(), &|_, _| {}).unwrap();
        assert!(Made::tried(&scene, &flat, Settings { cell: 4, ..Settings::default() }).unwrap().is_none());
        assert!(Made::tried(&scene, &flat, Settings { cell: 5, ..Settings::default() }).is_err(), "what else is wrong stays so");
    }
}
