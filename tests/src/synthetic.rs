//! Bundles of no scene: a G-buffer said by a function, so that what the player ought to show is known to the digit.
//! Functions come from the tests; bundles go back to them.

use anyhow::Result;
use cubist_baker::atlas::{Label, Outline, SourceImage, Storage};
use cubist_baker::encode::{self, CodingSettings, Content, Header};
use cubist_baker::gbuffer::GBuffer;
use cubist_baker::order::Coverage;
use cubist_baker::sheets::{self, KeyGrid, Layers};
use cubist_baker::{fit, order, settle};
use cubist_core::format::{SPACE_CUBIC, TIME_CUBIC, TexelKind};
use std::sync::Arc;

/// A screen all of one label, and how it is played.
#[derive(Clone, Copy, Debug)]
pub struct Synthetic {
    /// Width and height of the source image, texels: powers of two.
    pub image: [u32; 2],
    /// Width and height of the screen, pixels.
    pub size: [u32; 2],
    /// Number of frames.
    pub frames: u32,
    /// Frames between keys.
    pub interval: u32,
    /// One of the format's `TIME_` numbers.
    pub time: u8,
    /// Frame 0 follows the last frame.
    pub looping: bool,
    /// Every so many keys one needs no earlier one.
    pub independent_every: usize,
    /// How the bundle holds the source image.
    pub storage: Storage,
}

impl Default for Synthetic {
    fn default() -> Self {
        Self {
            image: [256, 256],
            size: [32, 24],
            frames: 33,
            interval: 8,
            time: TIME_CUBIC,
            looping: false,
            independent_every: 3,
            storage: Storage::Raw,
        }
    }
}

impl Synthetic {
    /// The bundle in which the pixel (x, y) of a frame looks at `place(frame, x, y)`, texels, coded as exactly as positions can be stored.
    ///
    /// # Errors
    /// It exceeds what a bundle holds.
    pub fn bundle(&self, place: impl Fn(u32, u32, u32) -> [f32; 2]) -> Result<Vec<u8>> {
        let ([width, height], [across, down]) = (self.image, self.size);
        let rect = [0, 0, width as u16, height as u16];
        let labels = vec![Label { rect: [0, 0, 1, 1], masked: false, fixed: None }, Label { rect, masked: false, fixed: None }];
        let texels = (0..width * height).map(|at| ((at % width * 7 + at / width * 13) & 0xff) as u16).collect();
        let palette = (0..=255u8).map(|at| [at & 0xf8, at & 0xfc, (at << 3) & 0xf8]).collect();
        let covered: Arc<[bool]> = vec![true; (width * height) as usize].into();
        let outline = Outline { finer: 0, bits: covered.clone() };
        let image = SourceImage { width, height, kind: TexelKind::Indexed8, texels, palette, covered, outline, labels };
        let pixels = (0..self.frames).flat_map(|frame| (0..down).flat_map(move |y| (0..across).map(move |x| (frame, x, y))));
        let uv: Vec<[f32; 2]> = pixels.map(|(frame, x, y)| place(frame, x, y)).collect();
        let gbuffer = GBuffer { width: across, height: down, frames: self.frames, label: vec![1; uv.len()], uv: uv.into() };
        let grid = KeyGrid::new(&gbuffer, 3, self.interval, self.looping, [self.time, SPACE_CUBIC]);
        let mut sheets = sheets::find(&gbuffer, &grid, 1);
        let layers = Layers::of(&grid, &sheets);
        let fit = fit::solve(&gbuffer, &grid, &sheets, &layers, &vec![None; layers.label.len()]);
        let evidence = order::Evidence {
            gbuffer: &gbuffer,
            grid: &grid,
            image: &image,
            layers: &layers,
            fit: &fit,
            field_price: 4,
            coverage: Coverage::All,
        };
        let fields = settle::settle(&evidence, &mut sheets);
        let settings = CodingSettings { step_log2: 0, lambda: 0.0, independent_every: self.independent_every };
        let content =
            Content { grid: &grid, image: &image, sheets: &sheets, layers: &layers, fit: &fit, fields: &fields, planes: &[], cameras: &[] };
        Ok(encode::bundle(&content, settings, Header { storage: self.storage, fps: 30, info: "synthetic" })?)
    }
}
