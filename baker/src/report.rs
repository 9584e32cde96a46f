//! The report: what a bake cost and what it reached, for people and scripts.
//! Figures come from the finished bytes through [`Inspection`] and `verify`; JSON and table rows go out.

use crate::atlas::Storage;
use crate::bake::{Encoded, Flat, Settings};
use crate::bends::{self, Bends};
use crate::causes::Causes;
use crate::chart::{self, Family, Trial};
use crate::finer::uneven;
use crate::inspect::{Inspection, space_name, time_name};
use crate::outlines;
use crate::scene::Scene;
use crate::straight;
use crate::terminal::grouped;
use crate::verify::{Quality, TruthQuality, Work};
use cubist_core::format::{ATLAS, LABELS, MASK, SPACE_LINEAR, TexelKind};
use serde::{Deserialize, Serialize};

/// Below this share of the resolution asked for, the source image is called too small.
const COARSE: f64 = 0.7;
/// From this share of pixels on, %, left-out surfaces are worth a warning.
const DROPPED_PERCENT: f64 = 0.01;
/// Of the pixels that show the scene, percent, from which on the warning says that most likely something else was meant.
const LOST_PERCENT: f64 = 25.0;

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

/// Where a bundle comes from.
pub(crate) struct Origin<'a> {
    pub scene: &'a Scene,
    pub flat: &'a Flat,
    pub encoded: &'a Encoded,
    pub settings: &'a Settings,
    /// Kinds of space that were tried.
    pub spaces: Vec<straight::Trial>,
    /// How surfaces bend, where that tells anything.
    pub bends: Option<Bends>,
    /// Outlines that were tried.
    pub outlines: Vec<outlines::Trial>,
    /// Texels were coloured by the pixels that show them.
    pub repainted: bool,
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
        let Origin { scene, flat, encoded, settings, .. } = origin;
        let play = &scene.playback;
        let frames = f64::from(play.frames.max(1));
        let (atlas, labels, mask) = (inspection.section_bytes(ATLAS), inspection.section_bytes(LABELS), inspection.section_bytes(MASK));
        let keys = inspection.key_bytes();
        let (image, figures) = (&flat.atlas.image, &flat.atlas.figures);
        Self {
            scene: scene.name.clone(),
            size: [play.width, play.height],
            frames: play.frames,
            fps: play.fps,
            looping: play.looping,
            triangles: scene.triangles.len(),
            rays: flat.rays,
            seconds,
            grid: Grid {
                cell: settings.cell,
                key_interval: settings.key_interval,
                keys: encoded.grid.keys.len(),
                time: time_name(settings.time).to_owned(),
                space: space_name(settings.space).to_owned(),
                spaces: origin.spaces.clone(),
                bends: origin
                    .bends
                    .filter(|&bends| origin.spaces.is_empty() && (bends == Bends::Rough) == (settings.space == SPACE_LINEAR)),
            },
            source_image: Source {
                width: image.width,
                height: image.height,
                texels: image.kind,
                colours: image.palette.len(),
                storage: settings.atlas.storage,
                stored_bytes: inspection.image.stored_bytes,
                raw_bytes: inspection.image.raw_bytes,
                candidate: settings.atlas.charts.family,
                rewarped: settings.atlas.charts.rewarped,
                repainted: origin.repainted,
                trials: settings.atlas.charts.tried().copied().collect(),
                charts: figures.charts,
                halved: figures.halved,
                labels: figures.labels,
                fill: figures.fill,
                density: settings.atlas.density,
                detail: Some(settings.atlas.detail).filter(|detail| detail.is_finite()),
                scale: figures.scale,
                gutter: figures.gutter,
                outline: image.outline.bits_a_texel(),
                outlines: origin.outlines.clone(),
            },
            bytes: Bytes {
                bundle: inspection.bytes,
                atlas,
                labels,
                mask,
                keys,
                other: inspection.bytes - atlas - labels - mask - keys,
                keys_per_frame: keys as f64 / frames,
                per_frame: inspection.bytes as f64 / frames,
            },
            memory: Memory { workspace: inspection.workspace, row: play.width as usize * 2, picture: inspection.unpacked_bytes() },
            quality,
            quality_vs_truth: truth,
            work,
            torn_by_cause: encoded.torn_by_cause,
            effects: if image.kind.colours() > 0 { vec!["palette".to_owned()] } else { Vec::new() },
            warnings: scene.warnings.iter().cloned().chain(warnings(origin)).chain(missing(&quality, settings.key_interval)).collect(),
        }
    }

    /// The report as one JSON document.
    #[must_use]
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_else(|error| unreachable!("numbers, strings and lists always serialise: {error}"))
    }
}

/// What keeps surfaces too small for cells of `cell` pixels and keys every `interval` frames.
fn finer(cell: u32, interval: u32) -> &'static str {
    match (cell, interval) {
        (5.., 2..) => "a shorter --key-interval or smaller cells (--cell) keep them",
        (5.., _) => "smaller cells (--cell) keep them",
        // There are no smaller cells than of 4 pixels.
        (_, 2..) => "a shorter --key-interval keeps them",
        _ => "a larger --size keeps them",
    }
}

/// Tells a frame in which whole things are missing.
fn missing(quality: &Quality, interval: u32) -> Option<String> {
    let off = uneven(quality.wrong_surface_percent, [quality.psnr_mean, quality.psnr_min])?;
    let cure = if interval > 1 { "--key-interval 1 keeps most of them" } else { "a slower path, or more --frames, keeps them" };
    Some(format!(
        "frame {} is {off:.1} dB worse than the mean: things that sweep past the camera are missing there; {cure}",
        quality.worst_frame
    ))
}

/// What the pipeline itself warns of.
fn warnings(origin: &Origin<'_>) -> Vec<String> {
    let Origin { scene, flat, encoded, settings, .. } = origin;
    let figures = &flat.atlas.figures;
    let mut out = Vec::new();
    let share = |of: u64| 100.0 * encoded.dropped_pixels as f64 / of.max(1) as f64;
    let dropped = share(flat.rays);
    // Of those that show more than the backdrop.
    let lost = share(flat.atlas.gbuffer.label.iter().filter(|&&label| label != 0).count() as u64);
    if lost > LOST_PERCENT {
        out.push(format!(
            "{lost:.0} % of what the camera sees of the scene is lost: its surfaces are too small on the screen for cells of {0} x {0} pixels; bring the camera \
             nearer, raise --size, or try --cell 4 --key-interval 1 --sheets all",
            settings.cell
        ));
    } else if dropped > DROPPED_PERCENT {
        let cure = finer(settings.cell, settings.key_interval);
        let (what, cure) = match settings.error > 0.0 {
            true => (", or that shows less there than it takes", format!("--sheets all keeps more, {cure}")),
            false => ("", cure.to_owned()),
        };
        out.push(format!(
            "{dropped:.2} % of the pixels show a surface too small for its cell of {0} x {0} pixels x {1} frames{what}; they show a neighbour instead; {cure}",
            settings.cell, settings.key_interval
        ));
    }
    if figures.scale < COARSE {
        let cure = if settings.atlas.max_side < 1024 {
            format!("raise --atlas above {}", settings.atlas.max_side)
        } else {
            "shorten the path or lower --size".to_owned()
        };
        out.push(format!(
            "the source image holds {:.0} % of the resolution asked for, {:.2} texels a pixel at the closest view; {cure}",
            100.0 * figures.scale,
            figures.scale * settings.atlas.density
        ));
    }
    if figures.charts + 1 > figures.labels {
        let but = match figures.crowded {
            0 => String::new(),
            crowded => format!(", but for {crowded} that little is seen of, for want of labels; lower --size or simplify the scene"),
        };
        out.push(format!(
            "{} charts share {} labels: charts that are never seen near each other have one in common{but}",
            figures.charts,
            figures.labels - 1
        ));
    }
    if let [first, rest @ ..] = flat.crossed.as_slice() {
        let more = if rest.is_empty() { String::new() } else { format!(", and {} more times", rest.len()) };
        out.push(format!(
            "the camera goes through a surface between frames {first} and {}{more}: what is behind it shows all at once; move the path around it",
            first + 1
        ));
    }
    if scene.playback.looping && scene.playback.frames == 1 {
        out.push("a looping path of one frame shows a single picture".to_owned());
    }
    out
}

/// The report as rows of name and value: bytes by section, quality, memory, seconds.
#[must_use]
pub fn table(report: &Report) -> Vec<(String, String)> {
    let Report { bytes, quality, source_image: image, seconds, grid, work, .. } = report;
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
    let [width, height] = report.size;
    let looping = if report.looping { ", looping" } else { "" };
    row("scene", format!("{}: {} triangles, {} rays", report.scene, grouped(report.triangles), grouped(report.rays as usize)));
    row("playback", format!("{} frames of {width} x {height}, {} frames/s{looping}", report.frames, report.fps));
    let Grid { keys, cell, time, space, .. } = grid;
    // Where the view turns quickly, and on a path shorter than the interval, they stand closer than asked for.
    let intervals = if report.looping { *keys } else { keys.saturating_sub(1) };
    let frames = if report.looping { report.frames } else { report.frames.saturating_sub(1) };
    let every = match f64::from(frames) / intervals.max(1) as f64 {
        mean if 1.5 * mean < f64::from(grid.key_interval) => format!("{mean:.1} frames on the mean"),
        _ => format!("{} frames", grid.key_interval),
    };
    row("grid", format!("{keys} keys, one every {every}; cells of {cell} pixels; time {time}, space {space}"));
    if !grid.spaces.is_empty() {
        row("", straight::reason(&grid.spaces));
    }
    if let Some(bends) = grid.bends {
        row("", bends::reason(bends).to_owned());
    }
    row(
        "source image",
        format!(
            "{} bytes: {} x {} texels of {}, {} colours{}, {:.0} % covered; {}",
            grouped(bytes.atlas),
            image.width,
            image.height,
            match image.texels {
                TexelKind::Indexed8 => "8 bits",
                TexelKind::Indexed4 => "4 bits",
                TexelKind::Direct565 => "RGB565",
            },
            image.colours,
            if image.repainted { " by what is played" } else { "" },
            100.0 * image.fill,
            match image.storage {
                Storage::Raw => "raw".to_owned(),
                Storage::Packed => format!("packed, with the mask, from {}", grouped(image.raw_bytes)),
            }
        ),
    );
    row("labels, mask", format!("{} bytes: {} labels for {} charts", grouped(bytes.labels + bytes.mask), image.labels, image.charts));
    if !image.outlines.is_empty() {
        row("", outlines::reason(&image.outlines));
    }
    row("", chart::reason(image.candidate, image.rewarped, image.trials.iter()));
    row("keys", format!("{} bytes: {:.1} a frame", grouped(bytes.keys), bytes.keys_per_frame));
    row("bundle", format!("{} bytes: {:.1} a frame", grouped(bytes.bundle), bytes.per_frame));
    row(
        "PSNR",
        format!(
            "{:.2} dB mean, {:.2} dB at worst (frame {}); bilinear {:.2} dB",
            quality.psnr_mean, quality.psnr_min, quality.worst_frame, quality.psnr_bilinear
        ),
    );
    row("SSIM", format!("{:.4}", quality.ssim_mean));
    row("wrong surface", format!("{:.3} % of the pixels", quality.wrong_surface_percent));
    let path = &quality.path_error_texels;
    row("path error", format!("{:.2} texels median, {:.2} for 99 %, {:.1} worst", path.p50, path.p99, path.max));
    if let Some(truth) = &report.quality_vs_truth {
        let of = if truth.truth_frames == report.frames { "all".to_owned() } else { truth.truth_frames.to_string() };
        row(
            "against truth",
            format!(
                "{:.2} dB, {:.2} dB with softened outlines, {:.2} dB with bilinear texels too, SSIM {:.4}, over {of} frames",
                truth.psnr_mean, truth.psnr_smooth, truth.psnr_fine, truth.ssim_mean
            ),
        );
    }
    row(
        "torn",
        format!(
            "{:.1} % of the pixels; {:.0} coverage tests a frame, {} at most",
            work.torn_percent,
            work.coverage_tests_mean,
            grouped(work.coverage_tests_worst as usize)
        ),
    );
    let picture =
        if report.memory.picture > 0 { format!(", {} of them the source image", grouped(report.memory.picture)) } else { String::new() };
    row("working memory", format!("{} bytes{picture}, and a row of {}", grouped(report.memory.workspace), grouped(report.memory.row)));
    row("speed here", format!("{:.0} frames/s on one thread", work.host_frames_per_second));
    let search = if seconds.search > 0.0 { format!(", search {:.1}", seconds.search) } else { String::new() };
    row(
        "seconds",
        format!(
            "{:.1}: load {:.1}, rays {:.1}, atlas {:.1}, encode {:.1}, paint {:.1}, verify {:.1}{search}",
            seconds.total, seconds.load, seconds.rays, seconds.atlas, seconds.encode, seconds.paint, seconds.verify
        ),
    );
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_can_be_followed() {
        assert!(finer(8, 8).contains("--cell"));
        assert!(finer(4, 8).contains("--key-interval"));
        assert!(finer(4, 1).contains("--size"));
    }

    #[test]
    fn what_is_missing_in_a_frame_is_told() {
        let quality = |psnr_min, wrong_surface_percent| Quality {
            psnr_mean: 30.0,
            psnr_min,
            worst_frame: 7,
            wrong_surface_percent,
            ..Quality::default()
        };
        assert!(missing(&quality(25.0, 3.0), 8).unwrap().starts_with("frame 7 is 5.0 dB worse"));
        assert!(missing(&quality(25.0, 3.0), 1).unwrap().contains("--frames"));
        assert!(missing(&quality(25.0, 1.0), 8).is_none() && missing(&quality(27.0, 3.0), 8).is_none());
    }
}
