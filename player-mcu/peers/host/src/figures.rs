//! From what a peer printed to the figures that are written down: `results.json`, and the table in README.md.

use crate::qemu::Played;
use crate::screen::PIXELS;
use crate::table;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// What a player must show, and what that is worth.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Expected {
    /// What the table calls it.
    pub what: String,
    /// The sum of every frame's pixels.
    pub sums: Vec<u32>,
    /// The mean over the frames that the truth has; none where there is nothing to compare with.
    pub psnr_db: Option<f64>,
    /// Bytes of all frames.
    pub content_bytes: u64,
}

impl Expected {
    /// That of `player`, as `make` left it in `folder`.
    ///
    /// # Errors
    /// A file that cannot be read, or does not know the player.
    pub fn read(folder: &Path, player: &str) -> Result<Self> {
        let file = folder.join("expected.json");
        let place = || file.display().to_string();
        let mut all: BTreeMap<String, Self> = serde_json::from_slice(&fs::read(&file).with_context(place)?).with_context(place)?;
        all.remove(player).with_context(|| format!("{}: no player {player}", place()))
    }
}

/// The figures of a player on a target. RAM is what its program has statically, with as much of an arena as it asked for, and its deepest stack; no
/// picture that is not the player's own. The code is all of its flash but what it plays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Figures {
    pub what: String,
    pub instructions_per_pixel_mean: f64,
    pub worst_over_mean: f64,
    pub ram_bytes: u64,
    pub stack_peak_bytes: u64,
    pub code_bytes: u64,
    pub content_bytes_per_frame: f64,
    pub psnr_db: Option<f64>,
    pub frames: u64,
}

/// A PSNR as a line ends with it; nothing where there is none.
pub fn decibels(psnr: Option<f64>) -> String {
    psnr.map_or(String::new(), |db| format!(", {db:.2} dB"))
}

/// Everything measured: target, then player.
pub type Results = BTreeMap<String, BTreeMap<String, Figures>>;

/// The figures of `played`, whose pixels must be `expected`.
///
/// # Errors
/// Frames missing, or one whose pixels are others than the host's.
pub fn figures(played: &Played, expected: &Expected, code_bytes: u64, static_bytes: u64) -> Result<Figures> {
    ensure!(played.frames.len() == expected.sums.len(), "{} frames of {}", played.frames.len(), expected.sums.len());
    for (number, (&(_, sum), &expected)) in played.frames.iter().zip(&expected.sums).enumerate() {
        ensure!(sum == expected, "frame {number}: other pixels than on the host");
    }
    let count = played.frames.len() as f64;
    let mean = played.frames.iter().map(|&(instructions, _)| instructions).sum::<u64>() as f64 / count;
    let worst = played.frames.iter().map(|&(instructions, _)| instructions).max().context("a frame at least")? as f64;
    let round = |value: f64| (value * 1000.0).round() / 1000.0;
    Ok(Figures {
        what: expected.what.clone(),
        instructions_per_pixel_mean: round(mean / PIXELS as f64),
        worst_over_mean: round(worst / mean),
        ram_bytes: static_bytes + played.asked + played.stack_peak_bytes - played.arena,
        stack_peak_bytes: played.stack_peak_bytes,
        code_bytes,
        content_bytes_per_frame: round(expected.content_bytes as f64 / count),
        psnr_db: expected.psnr_db.map(round),
        frames: played.frames.len() as u64,
    })
}

const BEGIN: &str = "<!-- peers: written by peers/run -->";
const END: &str = "<!-- end of peers -->";

/// Puts the table between the marks in `readme`: a row for each player, the cheapest first.
///
/// # Errors
/// Those of [`table::put`].
pub fn write_table(readme: &Path, results: &Results) -> Result<()> {
    let mut rows: BTreeMap<&str, Vec<&Figures>> = BTreeMap::new();
    results.values().flatten().for_each(|(player, figures)| rows.entry(player).or_default().push(figures));
    let mut rows: Vec<Vec<&Figures>> = rows.into_values().collect();
    rows.sort_by(|a, b| a[0].instructions_per_pixel_mean.total_cmp(&b[0].instructions_per_pixel_mean));
    let targets: Vec<&str> = results.keys().map(String::as_str).collect();
    let mut table = format!(
        "\n| player | instr/px on {} | RAM | code | bytes a frame | PSNR |\n|---|{}---|---|---|---|\n",
        targets.join(" | instr/px on "),
        "---|".repeat(targets.len())
    );
    for row in rows {
        let each = |cell: fn(&Figures) -> String| row.iter().map(|&figures| cell(figures)).collect::<Vec<_>>();
        let psnr = row[0].psnr_db.map_or(String::new(), |db| format!("{db:.2} dB"));
        table += &format!(
            "| {} | {} | {} | {} | {:.0} | {psnr} |\n",
            row[0].what,
            each(|figures| format!("{:.2}", figures.instructions_per_pixel_mean)).join(" | "),
            each(|figures| figures.ram_bytes.to_string()).join(" / "),
            each(|figures| figures.code_bytes.to_string()).join(" / "),
            row[0].content_bytes_per_frame,
        );
    }
    table::put(readme, [BEGIN, END], &table)
}
