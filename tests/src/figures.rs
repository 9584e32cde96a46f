//! Figures: how good a bundle's playback is, and what it costs.
//! A bundle and the G-buffer it was made from come in; numbers go to the tables and to tests.

use crate::play;
use anyhow::Result;
use cubist_baker::atlas::{Atlas, Label};
use cubist_core::Bundle;

/// A bundle played against exact ray casting of every pixel through the same source image.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quality {
    /// Mean over the frames of their PSNR, dB; a frame without error counts as 99.
    pub psnr_mean: f64,
    /// PSNR of the worst frame.
    pub psnr_min: f64,
    /// Pixels that show another label than the ray sees, percent.
    pub wrong_surface_percent: f64,
    /// Pixels in cells of more than one sheet, percent.
    pub torn_percent: f64,
}

/// Eight bits a component from RGB565, as displays widen them: the leading bits repeated.
#[must_use]
pub fn widen(colour: u16) -> [u8; 3] {
    let [r, g, b] = [colour >> 11, colour >> 5 & 0x3f, colour & 0x1f];
    [(r << 3 | r >> 2) as u8, (g << 2 | g >> 4) as u8, (b << 3 | b >> 2) as u8]
}

/// For every label of `bundle` the label of `atlas` with the same chart: a folded surface has several (see `cubist_baker::folds`).
pub(crate) fn charts(bundle: &Bundle<'_>, atlas: &Atlas) -> Vec<usize> {
    let labels = &atlas.image.labels;
    let chart = |label: usize| {
        let own = bundle.label(label as u8);
        let same = |other: &Label| other.rect == [own.left, own.top, own.right, own.bottom];
        if label < labels.len() { label } else { labels.iter().position(same).unwrap_or(label) }
    };
    (0..bundle.label_count()).map(chart).collect()
}

/// Compares all frames of a bundle with the G-buffer of `atlas`.
///
/// # Errors
/// The bundle does not parse.
pub fn quality(bytes: &[u8], atlas: &Atlas) -> Result<Quality> {
    let (image, gbuffer) = (&atlas.image, &atlas.gbuffer);
    let charts = charts(&Bundle::parse(bytes)?, atlas);
    let size = (gbuffer.width * gbuffer.height) as usize;
    let (mut sum, mut least, mut wrong, mut torn) = (0.0f64, f64::INFINITY, 0u64, 0u64);
    play::visit(bytes, 0..gbuffer.frames, |frame, player| {
        let exact = frame as usize * size..(frame as usize + 1) * size;
        let mut squares = 0u64;
        for (pixel, uv) in play::pixels(player).into_iter().zip(&gbuffer.uv[exact.clone()]) {
            let pairs = widen(pixel).into_iter().zip(image.colour_at(*uv));
            squares += pairs.map(|(a, b)| u64::from(a.abs_diff(b)).pow(2)).sum::<u64>();
        }
        let psnr = psnr(squares, 3 * size);
        (sum, least) = (sum + psnr, least.min(psnr));
        torn += u64::from(player.work().torn_pixels);
        let labels = play::probes(player).into_iter().zip(&gbuffer.label[exact]);
        wrong += labels.filter(|(probe, label)| charts[usize::from(probe.label)] != usize::from(**label)).count() as u64;
    })?;
    let percent = |count: u64| 100.0 * count as f64 / gbuffer.label.len() as f64;
    Ok(Quality {
        psnr_mean: sum / f64::from(gbuffer.frames),
        psnr_min: least,
        wrong_surface_percent: percent(wrong),
        torn_percent: percent(torn),
    })
}

/// PSNR of `values` components of eight bits whose squared errors sum to `squares`, dB; at most 99.
#[must_use]
pub fn psnr(squares: u64, values: usize) -> f64 {
    if squares == 0 { 99.0 } else { (10.0 * (255.0 * 255.0 * values as f64 / squares as f64).log10()).min(99.0) }
}

/// Bytes of the keys of a bundle, records, table, planes and cameras, over its frames.
///
/// # Errors
/// The bundle does not parse.
pub fn key_bytes_per_frame(bytes: &[u8]) -> Result<f64> {
    let bundle = Bundle::parse(bytes)?;
    Ok(bundle.path().key_bytes() as f64 / f64::from(bundle.frames()))
}
