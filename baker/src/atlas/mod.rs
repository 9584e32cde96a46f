//! The source image: every visible surface point once, flattened, packed, coloured.
//! Charts come from [`crate::chart`]; the image and the G-buffer go to the sheets, the fit and the encoder.

mod fill;
mod footprint;
mod grid;
mod grow;
mod halve;
mod items;
mod mask;
mod outline;
mod pack;
mod palette;
mod place;
mod search;
mod strip;

use crate::chart::{self, Charting, Choice, Density, Family};
use crate::gbuffer::{BACKGROUND, GBuffer, Hits};
use crate::scene::{Background, Scene};
use crate::shade::Shader;
use cubist_core::format::{MOST_FINER, TexelKind};
use fill::Seen;
pub use outline::{Outline, Tiled};
pub use palette::widened;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use thiserror::Error;

/// Charts share labels where there would be more than this, the background's included.
const MOST_LABELS: usize = 255;
/// Charts that a source image can have.
const MOST_CHARTS: usize = 1 << 16;

/// Frames whose keys take about as much as a source image. What a texel is worth is weighed against the whole bundle, and that of a path of few
/// frames is hardly smaller.
pub const LONGER: f64 = 128.0;

/// Why there is no source image.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum AtlasError {
    /// The largest side is out of range.
    #[error("--atlas: expected a side of 64 to 1024 texels, found {0}; 512 is a good start")]
    Side(u32),
    /// The scene is in more pieces than the image has room for.
    #[error("source image: {charts} charts do not fit into {side} x {side} texels; raise --atlas{}", if *.side < 1024 { "" } else { " or simplify the scene" })]
    Room {
        /// Charts to place.
        charts: usize,
        /// The largest side allowed.
        side: u32,
    },
    /// The scene is in more pieces than can be told apart.
    #[error("source image: expected at most {MOST_CHARTS} charts, found {0}; lower --size or simplify the scene")]
    Charts(usize),
}

/// How a bundle holds its source image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Storage {
    /// As texels are: read from flash as they lie there, no memory.
    #[default]
    Raw,
    /// Coded, for a smaller bundle: the player unpacks it into its memory, as much as raw.
    Packed,
}

impl Storage {
    /// What `--storage` calls it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Packed => "packed",
        }
    }
}

/// What may be chosen about the source image.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Largest side, texels: 64..=1024.
    pub max_side: u32,
    /// Texels a pixel, at most, where a chart is seen closest.
    pub density: f64,
    /// What detail is worth, bytes: charts that few pixels see closely, or that show little detail, get fewer texels. For each pixel of each frame whose
    /// colour is eight levels of 255 off since its texel is longer than the pixel, four times as much where it is sixteen off; a path counts [`LONGER`]
    /// frames more than it has. Infinite: all charts have `density`.
    pub detail: f64,
    /// What a texel is.
    pub texels: TexelKind,
    /// Palette entries, at most: 2..=256. What the texels have no room for is not used; those without a palette have none.
    pub colours: usize,
    /// How the bundle holds it.
    pub storage: Storage,
    /// The outline has 2^this bits a texel in each direction, 0..=[`MOST_FINER`], where a bundle can hold that; `None`: 1, but finer ones are at hand.
    pub outline: Option<u32>,
    /// How the surface is cut and flattened.
    pub charts: Choice,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_side: 512,
            density: 1.0,
            detail: 0.03,
            texels: TexelKind::Indexed8,
            colours: 256,
            storage: Storage::Raw,
            outline: None,
            charts: Family::Own.into(),
        }
    }
}

/// A map from the screen that does not change: the background's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed {
    /// Texel coordinates of the screen's top left corner.
    pub origin: [f32; 2],
    /// Texels a pixel: uv = origin + (x, y) * step at the continuous screen position (x, y), pixel centres at halves.
    pub step: [f32; 2],
}

/// What a label covers.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// x0, y0, x1, y1 in texels, the ends exclusive.
    pub rect: [u16; 4],
    /// Whether some texel of the rectangle is not covered.
    pub masked: bool,
    /// Set for the background.
    pub fixed: Option<Fixed>,
}

/// The one picture a bundle holds. What is as long as the image is shared by its clones.
#[derive(Clone, Debug)]
pub struct SourceImage {
    /// Texels a row: 64, 128, 256, 512 or 1024.
    pub width: u32,
    /// Rows, a multiple of 4.
    pub height: u32,
    /// What a texel is in the bundle.
    pub kind: TexelKind,
    /// Indices of `palette`, row-major.
    pub texels: Arc<[u16]>,
    /// Colours, each one an RGB565 value widened by repeating its leading bits. Where the bundle's texels are colours themselves, all there are.
    pub palette: Vec<[u8; 3]>,
    /// Which texels show a surface rather than continue one.
    pub covered: Arc<[bool]>,
    /// What of them does, as the player tells: finer than texels, perhaps.
    pub outline: Outline,
    /// Label 0 is the background.
    pub labels: Vec<Label>,
}

impl SourceImage {
    /// The colour of a texel; black for one that the palette has no entry for.
    #[must_use]
    pub fn colour(&self, texel: u16) -> [u8; 3] {
        self.palette.get(usize::from(texel)).copied().unwrap_or_default()
    }

    /// The colour at a position, texels; outside the image that of the nearest texel.
    #[inline]
    #[must_use]
    pub fn colour_at(&self, uv: [f32; 2]) -> [u8; 3] {
        self.colour(self.texels[self.place(uv)])
    }

    /// Whether a position lies inside the outline; outside the image the nearest one that is in it.
    #[inline]
    #[must_use]
    pub fn covered_at(&self, uv: [f32; 2]) -> bool {
        self.outline.bits[self.place_of(uv, self.outline.finer)]
    }

    /// The index of the texel at a position, texels; outside the image that of the nearest texel.
    #[inline]
    pub(crate) fn place(&self, uv: [f32; 2]) -> usize {
        self.place_of(uv, 0)
    }

    /// Likewise of what 2^`finer` are as wide and as high as a texel.
    #[inline]
    fn place_of(&self, uv: [f32; 2], finer: u32) -> usize {
        let [width, height] = [self.width, self.height].map(|texels| texels << finer);
        // What is below zero comes to zero.
        let [u, v] = uv.map(|at| (at * (1 << finer) as f32) as u32);
        (v.min(height - 1) * width + u.min(width - 1)) as usize
    }
}

/// What the reports say about the source image.
#[derive(Clone, Copy, Debug, Default)]
pub struct Figures {
    /// Connected regions of the image.
    pub charts: usize,
    /// Charts that were cut in two to fill it.
    pub halved: usize,
    /// Labels, the background included.
    pub labels: usize,
    /// Charts that are seen near another one of their label, for want of others.
    pub crowded: usize,
    /// Share of texels covered.
    pub fill: f64,
    /// The densities were multiplied by this: below 1 to make everything fit, above to fill the image with charts that bytes were saved on.
    pub scale: f64,
    /// Texels between charts.
    pub gutter: u32,
}

/// Everything about the source image that later stages need.
pub struct Atlas {
    /// The picture.
    pub image: SourceImage,
    /// Finer outlines that it could have, the finest last; none where the settings say which one it has.
    pub finer: Vec<Outline>,
    /// Where the pixels fall in it.
    pub gbuffer: GBuffer,
    /// For the reports.
    pub figures: Figures,
}

/// Cuts what the hits see into charts, packs and colours them. `progress` hears (steps done, steps in all).
///
/// # Errors
/// [`AtlasError`] where the settings are out of range, or there are more charts than room.
pub fn build(scene: &Scene, hits: &Hits, settings: &Settings, progress: &(dyn Fn(u64, u64) + Sync)) -> Result<Atlas, AtlasError> {
    progress(0, 4);
    of_charts(scene, hits, charts(scene, hits, settings)?, settings, progress)
}

/// Cuts what the hits see into charts, which are not halved yet, nor warped.
/// Fails if the settings are out of range.
pub(crate) fn charts(scene: &Scene, hits: &Hits, settings: &Settings) -> Result<Charting, AtlasError> {
    if !(64..=1024).contains(&settings.max_side) {
        return Err(AtlasError::Side(settings.max_side));
    }
    let detail = settings.detail * (f64::from(hits.frames) + LONGER) / f64::from(hits.frames.max(1));
    let density = Density { most: settings.density.clamp(0.05, 8.0), detail, texel: texel_bytes(settings.texels) };
    Ok(chart::build(scene, hits, settings.charts.family, &density, settings.max_side))
}

/// Packs and colours such charts: otherwise like [`build`].
pub(crate) fn of_charts(
    scene: &Scene,
    hits: &Hits,
    mut charting: Charting,
    settings: &Settings,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Atlas, AtlasError> {
    let backdrop = backdrop(scene, hits);
    let pack = |charting: &Charting| pack::pack(&footprint::Footprints::new(scene, hits, charting), backdrop, settings.max_side);
    let (halved, mut packed) = match settings.storage {
        Storage::Raw => halve::halve(scene, hits, &mut charting, texel_bytes(settings.texels), pack),
        // Empty texels take next to nothing.
        Storage::Packed => (0, None),
    };
    if settings.charts.rewarped {
        chart::rewarp(hits, &mut charting);
        packed = None;
    }
    progress(1, 4);
    if charting.charts.len() > MOST_CHARTS {
        return Err(AtlasError::Charts(charting.charts.len()));
    }
    let chart::Labels { of: label_of, count: labels, crowded } = chart::assign(hits, &charting, MOST_LABELS - 1);
    let layout = packed.or_else(|| pack(&charting)).ok_or(AtlasError::Room { charts: charting.charts.len(), side: settings.max_side })?;
    let layout = match settings.storage {
        Storage::Raw => pack::filled(&footprint::Footprints::new(scene, hits, &charting), backdrop, settings.max_side, layout),
        Storage::Packed => layout,
    };
    progress(2, 4);
    let fixed = fixed(scene, &layout.backdrop);
    let (gbuffer, seen) = locate(scene, hits, &charting, &layout, &label_of, &fixed);
    let filled = fill::fill(scene, &Shader::new(scene), hits, &charting, &layout, &seen);
    progress(3, 4);
    let kind = settings.texels;
    let (texels, palette) = reduced(&filled.colours, &seen.count, settings);
    let labels = rectangles(&charting, &layout, &label_of, labels, fixed, &filled.covered);
    let fill = filled.covered.iter().filter(|&&c| c).count() as f64 / filled.covered.len().max(1) as f64;
    let figures =
        Figures { charts: charting.charts.len(), halved, labels: labels.len(), crowded, fill, scale: layout.scale, gutter: layout.gutter };
    let outlined = |finer: u32| outline::outline(scene, &charting, &layout, &gbuffer, &filled.covered, finer);
    let masked = labels.iter().any(|label| label.masked);
    let finer: Vec<Outline> = match settings.outline {
        None if masked => (1..=u32::from(MOST_FINER)).map_while(outlined).collect(),
        _ => Vec::new(),
    };
    // The finest that a bundle can hold.
    let asked = settings.outline.filter(|_| masked).and_then(|finer| (1..=finer).rev().find_map(outlined));
    let covered: Arc<[bool]> = filled.covered.into();
    let outline = asked.unwrap_or_else(|| Outline { finer: 0, bits: covered.clone() });
    let (width, height) = (layout.width, layout.height);
    let image = SourceImage { width, height, kind, texels: texels.into(), palette, covered, outline, labels };
    progress(4, 4);
    Ok(Atlas { image, finer, gbuffer, figures })
}

/// Indices and palette of `colours`; a texel weighs as much as the pixels that see it.
pub(crate) fn reduced(colours: &[[u8; 3]], seen: &[u32], settings: &Settings) -> (Vec<u16>, Vec<[u8; 3]>) {
    match settings.texels.colours() {
        0 => palette::direct(colours),
        most => palette::reduce(colours, seen, settings.colours.clamp(2, most)),
    }
}

/// Bytes of a raw texel, its bit of the mask counted in.
pub(crate) fn texel_bytes(kind: TexelKind) -> f64 {
    (kind.bytes(8) + 1) as f64 / 8.0
}

/// The size the background wants: one colour needs little, a picture that is never seen as well.
fn backdrop(scene: &Scene, hits: &Hits) -> [u32; 2] {
    match scene.background {
        Background::Image(_) if hits.samples.iter().any(|s| s.surface == BACKGROUND) => [hits.width, hits.height],
        _ => [4, 4],
    }
}

/// The background's map from the screen to its rectangle.
fn fixed(scene: &Scene, rect: &[u32; 4]) -> Fixed {
    let [x0, y0, x1, y1] = rect.map(|v| v as f32);
    match scene.background {
        Background::Colour(_) => Fixed { origin: [(x0 + x1) * 0.5, (y0 + y1) * 0.5], step: [0.0; 2] },
        Background::Image(_) => Fixed {
            origin: [x0, y0],
            step: [(x1 - x0) / scene.playback.width.max(1) as f32, (y1 - y0) / scene.playback.height.max(1) as f32],
        },
    }
}

/// The G-buffer, and what of it falls into each texel.
fn locate(scene: &Scene, hits: &Hits, charting: &Charting, layout: &pack::Layout, label_of: &[u16], fixed: &Fixed) -> (GBuffer, Seen) {
    let atomics = |value: u32| -> Vec<AtomicU32> { (0..layout.width * layout.height).map(|_| AtomicU32::new(value)).collect() };
    let (count, first) = (atomics(0), atomics(u32::MAX));
    let (width, height) = (hits.width as usize, hits.height as usize);
    let mut label = vec![0u16; hits.samples.len()];
    let mut uv = vec![[0f32; 2]; hits.samples.len()];
    let rows = hits.samples.par_chunks(width.max(1)).zip(label.par_chunks_mut(width.max(1))).zip(uv.par_chunks_mut(width.max(1)));
    rows.enumerate().for_each(|(line, ((samples, label), uv))| {
        let y = (line % height.max(1)) as f32 + 0.5;
        for (x, ((s, label), uv)) in samples.iter().zip(label).zip(uv).enumerate() {
            if s.surface == BACKGROUND {
                *uv = [fixed.origin[0] + (x as f32 + 0.5) * fixed.step[0], fixed.origin[1] + y * fixed.step[1]];
            } else {
                let face = charting.faces.of[s.surface as usize] as usize;
                let chart = charting.chart_of[face] as usize;
                *label = label_of[chart];
                *uv = layout.places[chart].uv(charting.flat(face, f64::from(s.b), f64::from(s.c)));
            }
            let texel = uv[1] as usize * layout.width as usize + uv[0] as usize;
            count[texel].fetch_add(1, Ordering::Relaxed);
            first[texel].fetch_min((line * width + x) as u32, Ordering::Relaxed);
        }
    });
    let plain = |v: Vec<AtomicU32>| v.into_iter().map(AtomicU32::into_inner).collect();
    let frames = scene.playback.frames;
    (GBuffer { width: hits.width, height: hits.height, frames, label, uv: Arc::new(uv) }, Seen { count: plain(count), first: plain(first) })
}

/// The labels: the rectangles around their charts.
fn rectangles(charting: &Charting, layout: &pack::Layout, label_of: &[u16], count: usize, fixed: Fixed, covered: &[bool]) -> Vec<Label> {
    let mut rects = vec![[u32::MAX, u32::MAX, 0, 0]; count + 1];
    rects[0] = layout.backdrop;
    for (chart, place) in layout.places.iter().enumerate().take(charting.charts.len()) {
        let rect = &mut rects[usize::from(label_of[chart])];
        let [x0, y0, x1, y1] = place.rect;
        *rect = [rect[0].min(x0), rect[1].min(y0), rect[2].max(x1), rect[3].max(y1)];
    }
    rects
        .into_iter()
        .enumerate()
        .map(|(i, [x0, y0, x1, y1])| {
            let rows = (y0..y1).map(|y| (y * layout.width + x0) as usize..(y * layout.width + x1) as usize);
            let masked = rows.into_iter().any(|row| covered[row].iter().any(|&c| !c));
            Label { rect: [x0, y0, x1, y1].map(|v| v as u16), masked, fixed: (i == 0).then_some(fixed) }
        })
        .collect()
}

#[cfg(test)]
mod tests;
