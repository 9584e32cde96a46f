//! From what a firmware printed to the figures that are written down: `results.json`, and the table in README.md.

use crate::host::Expected;
use crate::qemu::{FrameLine, Played};
use crate::table;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The figures of one scene on one target. Parts of a frame are instructions a pixel of the whole screen; those of smooth and torn
/// cells are a pixel of their own, by least squares over rows. The code is that of the whole firmware, its bundle left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Figures {
    pub instructions_per_pixel_mean: f64,
    pub worst_over_mean: f64,
    pub key_decoding_instructions_per_pixel: f64,
    pub loading_instructions_per_pixel: f64,
    pub drawing_instructions_per_pixel: f64,
    pub smooth_instructions_per_smooth_pixel: f64,
    pub torn_instructions_per_torn_pixel: f64,
    pub torn_percent: f64,
    pub stack_peak_bytes: u64,
    pub player_struct_bytes: u64,
    pub working_memory_bytes: u64,
    pub firmware_code_bytes: u64,
    pub bundle_bytes: u64,
    pub frames: u64,
    pub frames_identical_to_host: u64,
    /// Of firmwares that draw rows in other ways.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub other_rows: BTreeMap<String, OtherRows>,
}

/// What another way to draw rows costs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OtherRows {
    pub instructions_per_pixel_mean: f64,
    pub firmware_code_bytes: u64,
}

impl From<&Figures> for OtherRows {
    fn from(figures: &Figures) -> Self {
        let &Figures { instructions_per_pixel_mean, firmware_code_bytes, .. } = figures;
        Self { instructions_per_pixel_mean, firmware_code_bytes }
    }
}

/// The figures of one scene on the Pico. Cycles are without waiting for flash, and those of frames played one after the other; `frames` counts
/// all that were compared. The static memory is that of the firmware, room for the player included.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PicoFigures {
    pub cycles_per_pixel_mean: f64,
    pub worst_over_mean: f64,
    pub display: String,
    pub code_bytes: u64,
    pub static_ram_bytes: u64,
    pub stack_peak_bytes: u64,
    pub working_memory_bytes: u64,
    pub bundle_bytes: u64,
    pub frames: u64,
    pub frames_identical_to_host: u64,
}

/// What is measured of one scene on one target.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Measured {
    /// Instructions, in QEMU.
    Instructions(Figures),
    /// Cycles of a Pico.
    Cycles(PicoFigures),
}

/// Everything measured: target, then scene.
pub type Results = BTreeMap<String, BTreeMap<String, Measured>>;

/// The figures of `played`, whose pixels must be `expected`.
///
/// # Errors
/// Frames missing, or one whose pixels are others than the host's.
pub fn figures(played: &Played, expected: &Expected, firmware_code_bytes: u64) -> Result<Figures> {
    ensure!(played.frames.len() == expected.checksums.len(), "{} frames of {}", played.frames.len(), expected.checksums.len());
    for (line, &checksum) in played.frames.iter().zip(&expected.checksums) {
        ensure!(line.checksum == checksum, "frame {}: other pixels than on the host", line.frame);
    }
    let count = played.frames.len() as f64;
    let sum = |get: fn(&FrameLine) -> u64| played.frames.iter().map(get).sum::<u64>() as f64;
    let per_pixel = |get: fn(&FrameLine) -> u64| round(sum(get) / count / expected.pixels as f64);
    let worst = played.frames.iter().map(|line| line.instructions).max().context("a frame at least")? as f64;
    let (smooth, torn) = solve(sum);
    let torn_pixels = sum(|line| line.torn_pixels);
    Ok(Figures {
        instructions_per_pixel_mean: per_pixel(|line| line.instructions),
        worst_over_mean: round(worst * count / sum(|line| line.instructions)),
        key_decoding_instructions_per_pixel: per_pixel(|line| line.seek),
        loading_instructions_per_pixel: per_pixel(|line| line.loading),
        drawing_instructions_per_pixel: per_pixel(|line| line.rows.saturating_sub(line.loading)),
        smooth_instructions_per_smooth_pixel: round(smooth),
        torn_instructions_per_torn_pixel: round(torn),
        torn_percent: round(100.0 * torn_pixels / (torn_pixels + sum(|line| line.smooth_pixels))),
        stack_peak_bytes: played.stack_peak_bytes,
        player_struct_bytes: played.player_bytes,
        working_memory_bytes: played.memory_bytes,
        firmware_code_bytes,
        bundle_bytes: expected.bytes,
        frames: played.frames.len() as u64,
        frames_identical_to_host: played.frames.len() as u64,
        other_rows: BTreeMap::new(),
    })
}

/// What a smooth and a torn pixel cost.
fn solve(sum: impl Fn(fn(&FrameLine) -> u64) -> f64) -> (f64, f64) {
    let (ss, st, tt) = (sum(|line| line.smooth_smooth), sum(|line| line.smooth_torn), sum(|line| line.torn_torn));
    let (sc, tc) = (sum(|line| line.smooth_cost), sum(|line| line.torn_cost));
    let determinant = ss * tt - st * st;
    if determinant > 0.0 { ((sc * tt - tc * st) / determinant, (tc * ss - sc * st) / determinant) } else { (sc / ss.max(1.0), 0.0) }
}

pub fn round(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

const BEGIN: &str = "<!-- figures: written by run -->";
const END: &str = "<!-- end of figures -->";

/// Puts the tables of `results` into `readme`.
///
/// # Errors
/// Those of [`table::put`].
pub fn write_table(readme: &Path, results: &Results) -> Result<()> {
    let mut table = String::from(
        "\n| target | scene | instr/px | worst / mean | keys | loading | drawing | smooth, per smooth px | torn, per torn px | torn | working memory | stack | code |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let (mut pico, mut rows) = (String::new(), String::new());
    for (target, scenes) in results {
        for (scene, f) in scenes {
            let f = match f {
                Measured::Instructions(f) => f,
                Measured::Cycles(f) => {
                    if pico.is_empty() {
                        pico += "\n| target | scene | display | cycles/px | worst / mean | frames identical to host | working memory | static RAM | stack | code |\n|---|---|---|---|---|---|---|---|---|---|\n";
                    }
                    pico += &format!(
                        "| {target} | {scene} | {} | **{:.2}** | {:.2} | {} of {} | {} B | {} B | {} B | {} B |\n",
                        f.display,
                        f.cycles_per_pixel_mean,
                        f.worst_over_mean,
                        f.frames_identical_to_host,
                        f.frames,
                        f.working_memory_bytes,
                        f.static_ram_bytes,
                        f.stack_peak_bytes,
                        f.code_bytes,
                    );
                    continue;
                }
            };
            for (kind, other) in &f.other_rows {
                if rows.is_empty() {
                    rows += "\n| target | scene | rows | instr/px | code |\n|---|---|---|---|---|\n";
                }
                rows += &format!(
                    "| {target} | {scene} | {kind} | **{:.2}** | {} B |\n",
                    other.instructions_per_pixel_mean, other.firmware_code_bytes
                );
            }
            table += &format!(
                "| {target} | {scene} | **{:.2}** | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} | {:.1} | {:.1} % | {} B | {} B | {} B |\n",
                f.instructions_per_pixel_mean,
                f.worst_over_mean,
                f.key_decoding_instructions_per_pixel,
                f.loading_instructions_per_pixel,
                f.drawing_instructions_per_pixel,
                f.smooth_instructions_per_smooth_pixel,
                f.torn_instructions_per_torn_pixel,
                f.torn_percent,
                f.working_memory_bytes,
                f.stack_peak_bytes,
                f.firmware_code_bytes,
            );
        }
    }
    table::put(readme, [BEGIN, END], &format!("{table}{rows}{pico}"))
}
