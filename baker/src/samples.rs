//! Samples: some frames of the truth, to which whatever a search tries is compared.
//! The scene comes in; `tune` asks how far source images and bundles are off.

use crate::atlas::Atlas;
use crate::bake::BakeError;
use crate::cast::Cast;
use crate::metrics;
use crate::truth::Truth;
use crate::verify;

/// Frames compared with the truth while searching.
const SAMPLES: u32 = 12;

/// Some frames of the truth.
pub(crate) struct Samples {
    frames: Vec<u32>,
    pictures: Vec<Vec<u8>>,
}

impl Samples {
    /// Renders them.
    pub(crate) fn new(cast: &Cast<'_>) -> Self {
        let truth = Truth::by(cast.tracer.of(cast.scene));
        let frames = scattered(cast.scene.playback.frames);
        let pictures = frames.iter().map(|&frame| truth.frame(frame)).collect();
        Self { frames, pictures }
    }

    /// The mean squared error of exact rays through a source image.
    pub(crate) fn of_image(&self, atlas: &Atlas) -> f64 {
        let errors = self.frames.iter().zip(&self.pictures).map(|(&frame, truth)| {
            let exact = verify::exact_frame(atlas, frame);
            metrics::mean_squared_error(&exact, truth)
        });
        errors.sum::<f64>() / self.frames.len().max(1) as f64
    }

    /// The mean squared error and the mean PSNR, dB, of a bundle.
    pub(crate) fn of_bundle(&self, bundle: &[u8]) -> Result<(f64, f64), BakeError> {
        let (mut errors, mut truth) = (Vec::new(), self.pictures.iter());
        verify::play(bundle, &self.frames, |_, played| {
            errors.push(truth.next().map_or(0.0, |truth| metrics::mean_squared_error(played, truth)));
        })?;
        let psnr = metrics::mean_psnr(errors.iter().map(|&error| metrics::psnr(error)));
        Ok((errors.iter().sum::<f64>() / errors.len().max(1) as f64, psnr))
    }
}

/// Frames that lie evenly on the path but fall on keys no more often than others, whatever the interval.
fn scattered(frames: u32) -> Vec<u32> {
    // Multiples of the golden ratio modulo 1 spread best; 0.618.. as a 32-bit fraction.
    const GOLDEN: u64 = 2_654_435_769;
    let place = |i: u64| (((2 * i + 1) * GOLDEN / 2) & 0xffff_ffff) * u64::from(frames);
    let mut out: Vec<u32> = (0..u64::from(SAMPLES)).map(|i| (place(i) >> 32) as u32).collect();
    out.sort_unstable();
    out.dedup();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_everywhere() {
        let frames = scattered(128);
        assert_eq!(frames.len(), SAMPLES as usize);
        assert!(frames[0] < 16 && frames[11] >= 112 && frames.windows(2).all(|w| w[1] - w[0] < 24), "{frames:?}");
        assert!(frames.iter().filter(|f| *f % 4 == 0).count() <= 5, "{frames:?}");
        assert_eq!(scattered(1), [0]);
    }
}
