//! How good bundles look: their frames beside the antialiased scene, in the colours that their texels get in the end.
//! The scene and a painter come from `job`. `finer` asks what closer keys or keys farther apart are worth, `usual` which of two bundles is better, `halves`
//! how good one with texels of half a byte would be.
//!
//! Exact rays through the source image do not tell that: what outlines and texels lose against the scene, no keys bring back.

use crate::bake::{BakeError, Flat};
use crate::made::Made;
use crate::metrics;
use crate::repaint::{self, Painter};
use crate::trace::Tracer;
use crate::truth::Truth;
use crate::verify;
use std::sync::OnceLock;

/// Frames compared.
const COMPARED: u32 = 16;
/// What twice the bytes of all but the source image have to bring, dB: what twice as many texels bring, or less.
const DOUBLE: f64 = 0.5;

/// The scene, to hold bundles against.
pub(crate) struct Seen<'a> {
    tracer: &'a Tracer<'a>,
    painter: Option<&'a Painter>,
    /// Rendered when it is first asked for.
    pictures: OnceLock<Vec<(u32, Vec<u8>)>>,
}

impl<'a> Seen<'a> {
    /// That of the scene whose rays `tracer` casts; bundles are to have colours by `painter`, if any.
    pub fn new(tracer: &'a Tracer<'a>, painter: Option<&'a Painter>) -> Self {
        Self { tracer, painter, pictures: OnceLock::new() }
    }

    /// The quality of `made`, which came from `flat`, less what all but its source image of `picture` bytes takes, dB.
    ///
    /// # Errors
    /// Those of the player.
    pub fn worth(&self, made: &Made, flat: &Flat, picture: usize) -> Result<f64, BakeError> {
        let bundle = &made.encoded.bundle;
        let psnr = self.psnr(&repaint::finished(self.painter, bundle, &flat.atlas.image, &made.settings.atlas)?)?;
        Ok(metrics::worth(psnr, bundle.len().saturating_sub(picture) as u64, DOUBLE))
    }

    /// Mean PSNR of a finished bundle's frames, dB.
    ///
    /// # Errors
    /// Those of the player.
    pub fn psnr(&self, bundle: &[u8]) -> Result<f64, BakeError> {
        Ok(verify::against_pictures(bundle, self.pictures())?)
    }

    /// What was rendered of the scene: which frames, and R, G, B, row by row.
    pub fn rendered(&self) -> &[(u32, Vec<u8>)] {
        self.pictures.get().map_or(&[], Vec::as_slice)
    }

    fn pictures(&self) -> &[(u32, Vec<u8>)] {
        self.pictures.get_or_init(|| Truth::by(self.tracer.of(self.tracer.scene())).frames(COMPARED))
    }
}
