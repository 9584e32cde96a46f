//! The report: what a bake cost and what it reached, for people and scripts.
//! Figures come from the finished bytes through [`Inspection`] and `verify`; JSON goes out, and by `table` rows of text.

mod origin;
mod table;
mod warnings;

use crate::atlas::Storage;
use crate::bends::Bends;
use crate::causes::Causes;
use crate::chart::{Family, Trial};
use crate::halves;
use crate::inspect::{Inspection, space_name, time_name};
use crate::outlines;
use crate::straight;
use crate::verify::{Quality, TruthQuality, Work};
use cubist_core::format::{ATLAS, LABELS, MASK, SPACE_LINEAR, TexelKind};
use serde::{Deserialize, Serialize};

pub(crate) use origin::Origin;
pub use table::{sooner, table};

/// Seconds by stage, wall clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Everything.
    pub total: f64,
    /// Reading the scene.
    pub load: f64,
    /// Charts and source image.
    pub atlas: f64,
    /// Casting rays.
    pub rays: f64,
    /// Sheets, fit, order, coding.
    pub encode: f64,
    /// Colouring texels by the pixels that show them.
    #[serde(default)]
    pub paint: f64,
    /// Playing and comparing.
    pub verify: f64,
    /// Bakes that a search tried and did not keep.
    pub search: f64,
}

/// The key-ray grid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Side of a cell, pixels.
    pub cell: u32,
    /// Frames between keys.
    pub key_interval: u32,
    /// Keys.
    pub keys: usize,
    /// How positions are interpolated between keys, as `--time` has it.
    #[serde(default)]
    pub time: String,
    /// How positions are interpolated between the corners of cells, as `--space` has it.
    #[serde(default)]
    pub space: String,
    /// The kinds of space that were tried, and what came of them; empty where none was.
    #[serde(default)]
    pub spaces: Vec<straight::Trial>,
    /// How surfaces bend, where that alone told the space.
    #[serde(default)]
    pub bends: Option<Bends>,
    /// Why cells and intervals are not the usual ones, what these would come to, and how to have them.
    #[serde(default)]
    pub why: Option<String>,
}

impl Grid {
    fn of(origin: &Origin<'_>) -> Self {
        let Origin { encoded, settings, spaces, bends, why, .. } = origin;
        Self {
            cell: settings.cell,
            key_interval: settings.key_interval,
            keys: encoded.grid.keys.len(),
            time: time_name(settings.time).to_owned(),
            space: space_name(settings.space).to_owned(),
            spaces: spaces.clone(),
            bends: bends.filter(|&bends| spaces.is_empty() && (bends == Bends::Rough) == (settings.space == SPACE_LINEAR)),
            why: why.clone(),
        }
    }
}

/// Bytes by section; `bundle` is the sum of `atlas`, `labels`, `mask`, `keys` and `other`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bytes {
    /// The whole bundle.
    pub bundle: usize,
    /// The source image with its palette; where it is packed, its mask too.
    pub atlas: usize,
    /// The labels.
    pub labels: usize,
    /// The mask, if the source image is raw.
    pub mask: usize,
    /// The key records, their table, and the planes and cameras that positions are told from.
    pub keys: usize,
    /// Headers, limits, checksum, a text for people.
    pub other: usize,
    /// `keys` over frames.
    pub keys_per_frame: f64,
    /// `bundle` over frames.
    pub per_frame: f64,
}

impl Bytes {
    fn of(inspection: &Inspection, frames: u32) -> Self {
        let [atlas, labels, mask] = [ATLAS, LABELS, MASK].map(|tag| inspection.section_bytes(tag));
        let (bundle, keys, frames) = (inspection.bytes, inspection.key_bytes(), f64::from(frames.max(1)));
        Self {
            bundle,
            atlas,
            labels,
            mask,
            keys,
            other: bundle - atlas - labels - mask - keys,
            keys_per_frame: keys as f64 / frames,
            per_frame: bundle as f64 / frames,
        }
    }
}

/// Bytes of memory that playing takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Memory {
    /// What [`cubist_core::Player::new`] asks for.
    pub workspace: usize,
    /// A row of pixels.
    pub row: usize,
    /// Of `workspace`, the unpacked source image; 0 where it is raw.
    pub picture: usize,
}

/// The source image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Texels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What a texel is.
    pub texels: TexelKind,
    /// Colours: palette entries, or where texels are colours themselves, how many different ones there are.
    pub colours: usize,
    /// How it is stored.
    pub storage: Storage,
    /// Bytes of texels and mask as they are stored.
    pub stored_bytes: usize,
    /// Bytes of texels and mask, raw.
    pub raw_bytes: usize,
    /// How the surface was cut and flattened.
    pub candidate: Family,
    /// Whether texels were moved inside charts to where their detail is seen.
    #[serde(default)]
    pub rewarped: bool,
    /// Whether texels have the colours of the pixels that show them rather than of what lies there.
    #[serde(default)]
    pub repainted: bool,
    /// What was tried before, and what came of it; empty where nothing was.
    pub trials: Vec<Trial>,
    /// Connected regions.
    pub charts: usize,
    /// Charts that were cut in two because much of the image stayed empty beside them.
    #[serde(default)]
    pub halved: usize,
    /// Labels, the background included.
    pub labels: usize,
    /// Share of texels covered, 0..=1.
    pub fill: f64,
    /// Texels a pixel that were asked for where a surface is seen closest.
    pub density: f64,
    /// What detail was worth, bytes; none: charts have all the density.
    #[serde(default)]
    pub detail: Option<f64>,
    /// What densities were multiplied by to make everything fit; at most 1.
    pub scale: f64,
    /// Texels between charts.
    pub gutter: u32,
    /// Bits of the outline a texel, in each direction.
    #[serde(default = "whole")]
    pub outline: u32,
    /// Outlines that were tried; empty where none were.
    #[serde(default)]
    pub outlines: Vec<outlines::Trial>,
    /// What the bundle would come to with texels of half a byte; none where that was not tried, or takes no fewer bytes.
    #[serde(default)]
    pub halves: Option<halves::Trial>,
}

impl Source {
    fn of(origin: &Origin<'_>, inspection: &Inspection) -> Self {
        let (settings, image, figures) = (&origin.settings.atlas, &origin.flat.atlas.image, &origin.flat.atlas.figures);
        Self {
            width: image.width,
            height: image.height,
            texels: image.kind,
            colours: image.palette.len(),
            storage: settings.storage,
            stored_bytes: inspection.image.stored_bytes,
            raw_bytes: inspection.image.raw_bytes,
            candidate: settings.charts.family,
            rewarped: settings.charts.rewarped,
            repainted: origin.repainted,
            trials: settings.charts.tried().copied().collect(),
            charts: figures.charts,
            halved: figures.halved,
            labels: figures.labels,
            fill: figures.fill,
            density: settings.density,
            detail: Some(settings.detail).filter(|detail| detail.is_finite()),
            scale: figures.scale,
            gutter: figures.gutter,
            outline: image.outline.bits_a_texel(),
            outlines: origin.outlines.clone(),
            halves: origin.halves,
        }
    }
}

/// What outlines had before they could be finer.
const fn whole() -> u32 {
    1
}

/// The report; its keys keep their names and meaning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// What the scene is called.
    pub scene: String,
    /// Width and height of the screen, pixels.
    pub size: [u32; 2],
    /// Frames.
    pub frames: u32,
    /// Frames per second.
    pub fps: u16,
    /// Frame 0 follows the last frame.
    pub looping: bool,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Rays cast for the G-buffer.
    pub rays: u64,
    /// Seconds by stage.
    pub seconds: Seconds,
    /// The key-ray grid.
    pub grid: Grid,
    /// The source image.
    pub source_image: Source,
    /// Bytes by section.
    pub bytes: Bytes,
    /// Memory for playing.
    pub memory: Memory,
    /// Playback against exact ray casting through the same source image.
    pub quality: Quality,
    /// Playback against the antialiased scene; `None` (null) where it was not asked for.
    pub quality_vs_truth: Option<TruthQuality>,
    /// Work per frame.
    pub work: Work,
    /// Cells of the key-ray grid that show several surfaces, by why.
    pub torn_by_cause: Causes,
    /// What the player does beyond looking up texels.
    pub effects: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Report {
    /// Puts the report together; bytes are counted in the bundle itself, as `inspection` found them.
    pub(crate) fn new(
        origin: &Origin<'_>,
        inspection: &Inspection,
        quality: Quality,
        truth: Option<TruthQuality>,
        work: Work,
        seconds: Seconds,
    ) -> Self {
        let Origin { scene, flat, encoded, .. } = origin;
        let play = &scene.playback;
        Self {
            scene: scene.name.clone(),
            size: [play.width, play.height],
            frames: play.frames,
            fps: play.fps,
            looping: play.looping,
            triangles: scene.triangles.len(),
            rays: flat.rays,
            seconds,
            grid: Grid::of(origin),
            source_image: Source::of(origin, inspection),
            bytes: Bytes::of(inspection, play.frames),
            memory: Memory { workspace: inspection.workspace, row: play.width as usize * 2, picture: inspection.unpacked_bytes() },
            quality,
            quality_vs_truth: truth,
            work,
            torn_by_cause: encoded.torn_by_cause,
            effects: if flat.atlas.image.kind.colours() > 0 { vec!["palette".to_owned()] } else { Vec::new() },
            warnings: warnings::of(origin, &quality),
        }
    }

    /// The report as one JSON document.
    #[must_use]
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_else(|error| unreachable!("numbers, strings and lists always serialise: {error}"))
    }
}
