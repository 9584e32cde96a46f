//! Sparing: keys coded as coarsely as the picture lets pass. Where positions bend more than a grid can follow, bits that place it finely show nothing.
//! `bake` hands in how to code; the bundle of the best coarseness goes back.

use crate::atlas::Atlas;
use crate::metrics;
use crate::truth::spread;
use crate::verify::{self, VerifyError};

/// What a bit is worth, finest first.
const LAMBDAS: [f32; 4] = [0.01, 0.05, 0.2, 1.0];
/// Frames compared.
const COMPARED: u32 = 16;
/// What twice the bytes of a bundle's keys have to bring, dB against exact rays.
const DOUBLE: f64 = 1.5;

/// The bundle among those that `code` makes, at what a bit is worth, that is worth most; `picture`: bytes that are not keys. Stops where coarser
/// is no better.
///
/// # Errors
/// Those of `code`, and [`VerifyError`] where the player refuses a bundle.
pub(crate) fn spare<E: From<VerifyError>>(atlas: &Atlas, picture: usize, code: impl Fn(f32) -> Result<Vec<u8>, E>) -> Result<Vec<u8>, E> {
    let frames = spread(atlas.gbuffer.frames, COMPARED);
    let exact: Vec<Vec<u8>> = frames.iter().map(|&frame| verify::exact_frame(atlas, frame)).collect();
    let mut best: Option<(f64, Vec<u8>)> = None;
    for lambda in LAMBDAS {
        let bundle = code(lambda)?;
        let (mut psnr, mut rest) = (0.0, exact.iter());
        verify::play(&bundle, &frames, |_, played| {
            psnr += rest.next().map_or(0.0, |exact| metrics::psnr(metrics::mean_squared_error(played, exact)));
        })?;
        let keys = bundle.len().saturating_sub(picture).max(1);
        let worth = psnr / frames.len().max(1) as f64 - DOUBLE * libm::log2(keys as f64);
        match &best {
            Some((most, _)) if worth <= *most => break,
            _ => best = Some((worth, bundle)),
        }
    }
    best.map_or_else(|| code(LAMBDAS[0]), |(_, bundle)| Ok(bundle))
}
