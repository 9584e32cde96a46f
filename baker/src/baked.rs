//! A finished job: what `job` hands out, and what `usual` holds against another.

use crate::atlas::Storage;
use crate::bake::{Flat, Settings};
use crate::report::Report;
use cubist_core::format::TexelKind;

/// A finished job.
pub struct Baked {
    /// The bundle's bytes.
    pub bundle: Vec<u8>,
    /// What they cost and reach.
    pub report: Report,
    /// The source image and the G-buffer they came from.
    pub flat: Flat,
    /// What made them.
    pub settings: Settings,
    /// Mean PSNR against exact rays before texels were coloured by what is played, dB.
    pub(crate) psnr_before: f64,
    /// Whether the search that found it leaves room for what is baked where nothing is asked for: how that has to be stored, and of which texels.
    pub(crate) contested: Option<(Storage, TexelKind)>,
}
