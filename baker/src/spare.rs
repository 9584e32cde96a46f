//! Sparing: keys coded as coarsely as the picture lets pass, or as a number of bytes asks for. Where positions bend more than a grid can follow, bits
//! that place it finely show nothing.
//! `bake` hands in how to code; the bundle of the best coarseness goes back.

use crate::atlas::Atlas;
use crate::encode::CodingSettings;
use crate::metrics;
use crate::truth::spread;
use crate::verify::{self, VerifyError};
use rayon::prelude::*;

/// What a bit is worth, finest first, where it hardly shows.
const LAMBDAS_UP: [Coarser; 4] = [Coarser::Lambda(0.01), Coarser::Lambda(0.05), Coarser::Lambda(0.2), Coarser::Lambda(1.0)];
/// Steps that positions are coded in after that: twice to eight times what they are stored in.
const STEPS_UP: [Coarser; 3] = [Coarser::Step(1), Coarser::Step(2), Coarser::Step(3)];
/// What a bit is worth, finest first, where a budget asks for it, and on the ladder that searches climb.
pub(crate) const LAMBDAS: [f32; 5] = [0.01, 0.03, 0.1, 0.3, 1.0];
/// Frames compared.
const COMPARED: u32 = 16;
/// What twice the bytes of a bundle's keys have to bring, dB against exact rays.
pub(crate) const DOUBLE: f64 = 1.55;

/// A way to code coarser.
#[derive(Clone, Copy)]
enum Coarser {
    /// By what a bit is worth.
    Lambda(f32),
    /// By steps of 2^this.
    Step(u8),
}

impl Coarser {
    const fn than(self, coding: CodingSettings) -> CodingSettings {
        match self {
            Self::Lambda(lambda) => CodingSettings { lambda, ..coding },
            Self::Step(step_log2) => CodingSettings { step_log2, ..coding },
        }
    }
}

/// The bundle among those that `code` makes, of settings as coarse as `finest` or coarser, that is worth most, and its settings; `picture`: bytes that are
/// not keys. What a bit is worth grows first, then the steps that positions are coded in, each as long as coarser is better.
///
/// # Errors
/// Those of `code`, and [`VerifyError`] where the player refuses a bundle.
pub(crate) fn unseen<E: From<VerifyError> + Send>(
    atlas: &Atlas,
    picture: usize,
    finest: CodingSettings,
    code: impl Fn(CodingSettings) -> Result<Vec<u8>, E> + Sync,
) -> Result<(Vec<u8>, CodingSettings), E> {
    let frames = spread(atlas.gbuffer.frames, COMPARED);
    let exact: Vec<(u32, Vec<u8>)> = frames.into_iter().map(|frame| (frame, verify::exact_frame(atlas, frame))).collect();
    type Measured = (f64, Vec<u8>, CodingSettings);
    let measured = |&coding: &CodingSettings| -> Result<Measured, E> {
        let bundle = code(coding)?;
        let keys = bundle.len().saturating_sub(picture) as u64;
        Ok((metrics::worth(verify::against_pictures(&bundle, &exact)?, keys, DOUBLE), bundle, coding))
    };
    let mut best: Option<Measured> = None;
    for ladder in [&LAMBDAS_UP[..], &STEPS_UP] {
        // Coding is a matter of one thread: two rungs at a time, whether or not the first of them leads on to the second.
        'climb: for rungs in ladder.chunks(2) {
            let coding = best.as_ref().map_or(finest, |best| best.2);
            let codings: Vec<CodingSettings> = rungs.iter().map(|rung| rung.than(coding)).collect();
            for next in codings.par_iter().map(measured).collect::<Vec<_>>() {
                let next = next?;
                if best.as_ref().is_some_and(|best| next.0 <= best.0) {
                    break 'climb;
                }
                best = Some(next);
            }
        }
    }
    Ok(best.map_or((Vec::new(), finest), |(_, bundle, coding)| (bundle, coding)))
}

/// The finest bundle among those that `code` makes, at what a bit is worth, that has at most so many `bytes`, within half a rung of the ladder that
/// searches climb; the coarsest where none has.
///
/// # Errors
/// Those of `code`.
pub(crate) fn within<E>(bytes: u64, code: impl Fn(f32) -> Result<Vec<u8>, E>) -> Result<Vec<u8>, E> {
    let fits = |bundle: &[u8]| bundle.len() as u64 <= bytes;
    let mut bundle = code(LAMBDAS[0])?;
    for pair in LAMBDAS.windows(2) {
        if fits(&bundle) {
            break;
        }
        bundle = code(pair[1])?;
        if fits(&bundle) {
            let between = code(libm::sqrtf(pair[0] * pair[1]))?;
            bundle = if fits(&between) { between } else { bundle };
        }
    }
    Ok(bundle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_is_as_fine_as_can_be() {
        // 1,000 bytes and less the more a bit is worth, by thousandths.
        let code = |lambda: f32| Ok::<_, VerifyError>(vec![0; 1000 - (500.0 * lambda) as usize]);
        let bytes = [1000, 999, 990, 900, 600, 500, 10];
        let lengths = bytes.map(|bytes| within(bytes, code).unwrap().len());
        assert_eq!(lengths, [995, 995, 985, 850, 500, 500, 500]);
    }
}
