//! Blur: how much of what charts show is lost in longer texels, told from colours that the scene has in the pixels of some frames.
//! Samples come from the G-buffer and colours from [`Shader`]; `measure` weighs what is lost against bytes.

use super::charting::{COARSER, Charting};
use crate::gbuffer::{BACKGROUND, Hits, Lens, Sample};
use crate::scene::Scene;
use crate::shade::Shader;
use crate::truth::spread;
use rayon::prelude::*;

/// Frames looked at, evenly spread: so many,
const FRAMES: usize = 16;
/// or fewer of large ones, down to a quarter, for that many pixels.
const PIXELS: usize = 4 << 20;
/// What a pixel counts beside its colour, whatever that is, squared levels an octave squared: outlines are of texels too.
const OUTLINE: f64 = 8.0;
/// Bits of a texel's column and row.
const SIDE: u32 = 20;

/// What the scene has in the pixels of some frames that hit a surface: the sample, and R, G, B in the lower bytes.
pub(super) struct Seen(Vec<(Sample, u32)>);

impl Seen {
    /// Looks at the frames.
    pub(super) fn new(scene: &Scene, hits: &Hits) -> Self {
        let (shader, size) = (Shader::new(scene), hits.width as usize * hits.height as usize);
        let of = |frame: u32| {
            let lens = Lens::new(scene, frame);
            let samples = hits.samples.iter().skip(frame as usize * size).take(size).filter(|s| s.surface != BACKGROUND);
            let coloured = |s: &Sample| {
                let pixel = (s.point(scene) - lens.eye).dot(lens.forward).max(0.0) / lens.focal;
                let rgb = shader.shade(s.surface, [s.b, s.c].map(f64::from), pixel).to_array().map(|v| (v + 0.5) as u8);
                (*s, u32::from_le_bytes([rgb[0], rgb[1], rgb[2], 0]))
            };
            samples.map(coloured).collect::<Vec<_>>()
        };
        let most = (PIXELS / size.max(1)).clamp(FRAMES / 4, FRAMES);
        Self(spread(hits.frames, most as u32).into_par_iter().flat_map_iter(of).collect())
    }

    /// What longer texels lose in each chart, counted from those of such `densities`.
    pub(super) fn losses(&self, charting: &Charting, densities: &[f64]) -> Vec<Loss> {
        let place = |&(s, rgb): &(Sample, u32)| {
            let face = charting.faces.of[s.surface as usize] as usize;
            let chart = charting.chart_of[face];
            let [u, v, _] = charting.flat(face, f64::from(s.b), f64::from(s.c));
            let texel = [u, v].map(|x| (x * densities[chart as usize]).floor() as i64 as u64);
            (u64::from(chart) << (2 * SIDE) | interleaved(texel), rgb)
        };
        let mut pixels: Vec<(u64, u32)> = self.0.par_iter().map(place).collect();
        pixels.par_sort_unstable_by_key(|pixel| pixel.0);
        let of = |chart: &[(u64, u32)]| {
            let kept: [f64; COARSER + 1] = std::array::from_fn(|octave| kept(chart, 2 * octave as u32));
            let loss = |octave: usize| (kept[0] - kept[octave]).max(0.0) / (3 * chart.len()) as f64;
            ((chart[0].0 >> (2 * SIDE)) as usize, Loss(std::array::from_fn(loss)))
        };
        let charts = pixels.par_chunk_by(|a, b| a.0 >> (2 * SIDE) == b.0 >> (2 * SIDE)).map(of);
        let mut losses = vec![Loss::default(); densities.len()];
        charts.collect::<Vec<_>>().into_iter().for_each(|(chart, loss)| losses[chart] = loss);
        losses
    }
}

/// The mean squared error, of a component 0..=255, of a chart's pixels in texels 2^i times as long as need be.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Loss([f64; COARSER + 1]);

impl Loss {
    /// What it costs a pixel whose texel is so many `octaves` too long: 1 where that is eight levels of 255 off.
    pub(super) fn of(&self, octaves: f64) -> f64 {
        let (whole, part) = (octaves as usize, octaves.fract());
        let [below, above] = [whole, whole + 1].map(|octave| self.0[octave.min(COARSER)]);
        // As little as a pixel's texel is off at first, as little does it show.
        let colours = below + (above - below) * if whole == 0 { part * part } else { part };
        (colours + OUTLINE * octaves * octaves) / 64.0
    }
}

/// The sum of squares that is left of such pixels where those whose places differ in the last so many `bits` alone have one colour: their mean.
fn kept(pixels: &[(u64, u32)], bits: u32) -> f64 {
    let of = |texel: &[(u64, u32)]| {
        let mut sums = [0u64; 3];
        for (_, rgb) in texel {
            sums.iter_mut().zip(rgb.to_le_bytes()).for_each(|(sum, v)| *sum += u64::from(v));
        }
        sums.iter().map(|&sum| (sum * sum) as f64).sum::<f64>() / texel.len() as f64
    };
    pixels.chunk_by(|a, b| a.0 >> bits == b.0 >> bits).map(of).sum()
}

/// Column and row, bit by bit: what has the same of both but for the last bits stands together.
fn interleaved([x, y]: [u64; 2]) -> u64 {
    let spread = |x: u64| (0..SIDE).map(|bit| (x >> bit & 1) << (2 * bit)).sum::<u64>();
    spread(x) | spread(y) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_within_a_texel_is_lost() {
        // Four texels in a row: two of one colour, two of two.
        let row = |colours: [u8; 4]| -> Vec<(u64, u32)> {
            (0..).zip(colours).map(|(x, v)| (interleaved([x, 0]), u32::from_le_bytes([v, v, v, 0]))).collect()
        };
        let pixels = row([10, 10, 20, 40]);
        let lost = [0, 2, 4].map(|bits| kept(&pixels, 0) - kept(&pixels, bits));
        // About their mean, 30, the last two are ten levels off, in three components; about that of all, 20, it is 10, 10, 0 and 20.
        assert_eq!(lost, [0.0, 600.0, 1800.0]);
        assert_eq!([[0, 0], [1, 0], [0, 1], [3, 2]].map(interleaved), [0, 1, 2, 13]);
    }

    #[test]
    fn losses_grow_with_texels() {
        let [plain, patterned] = [Loss::default(), Loss([0.0, 64.0, 100.0, 120.0])];
        assert_eq!(patterned.of(0.0), 0.0);
        assert!((patterned.of(1.0) - plain.of(1.0) - 1.0).abs() < 1e-12);
        let steps = (0..80).map(|step| f64::from(step) / 8.0);
        assert!(steps.clone().zip(steps.skip(1)).all(|(a, b)| patterned.of(a) < patterned.of(b) && patterned.of(b) > plain.of(b)));
    }
}
