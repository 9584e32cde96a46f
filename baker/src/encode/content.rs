//! What becomes a bundle, and how its keys are to be coded.
//! Both come from the baker's stages; `encode` and `limits` read them.

use crate::atlas::SourceImage;
use crate::fields::Fields;
use crate::fit::Fit;
use crate::sheets::{KeyGrid, Layers, Sheets};
use cubist_core::plane::{Camera, Plane};

/// How keys are coded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CodingSettings {
    /// Coordinates are stored in steps of 2^this of their units: 1/64 texel, 1/32 where the picture is wider or higher than 512 texels.
    pub step_log2: u8,
    /// What a bit is worth, in squared texels of error summed over pixels, when residuals are rounded towards zero; 0 keeps
    /// them all.
    pub lambda: f32,
    /// Every this many keys one that needs no earlier one; bounds what a seek decodes.
    pub independent_every: usize,
}

impl CodingSettings {
    /// The same where a bit is worth `lambda`, in steps as coarse as lose no more than that does.
    #[must_use]
    pub(crate) fn worth(self, lambda: f32) -> Self {
        let coarser = [0.02, 0.06, 0.6].into_iter().take_while(|&least| lambda >= least);
        Self { lambda, step_log2: coarser.count() as u8, ..self }
    }
}

/// Everything that becomes a bundle.
#[derive(Clone, Copy)]
pub struct Content<'a> {
    /// The key-ray grid.
    pub grid: &'a KeyGrid,
    /// The source image.
    pub image: &'a SourceImage,
    /// The sheets, front to back.
    pub sheets: &'a Sheets,
    /// The layers they share.
    pub layers: &'a Layers,
    /// The layers' positions.
    pub fit: &'a Fit,
    /// The layers' fields.
    pub fields: &'a Fields,
    /// The planes that positions are told from, labels ascending.
    pub planes: &'a [Plane],
    /// From where every key looks, where there are planes.
    pub cameras: &'a [Camera],
}
