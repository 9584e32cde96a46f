//! The table of scenes: what each costs and how well it plays, at its own playback, as `cubist-bake` bakes it without options.
//! Scenes come from the command `table`, figures from the baker's report; the table goes back.

use super::{Table, baked, markdown, number};
use anyhow::{Context, Result, bail};
use cubist_baker::job::Baked;
use cubist_baker::scene::Scene;
use cubist_baker::{Options, Report, TruthFrames};
use cubist_core::Bundle;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The columns: the key in JSON, the title, digits after the point.
const COLUMNS: [(&str, &str, usize); 16] = [
    ("scene", "scene", 0),
    ("triangles", "triangles", 0),
    ("bundle_bytes", "bundle", 0),
    ("atlas_bytes", "source image", 0),
    ("key_bytes_per_frame", "keys/frame", 1),
    ("bytes_per_frame", "bytes/frame", 1),
    ("psnr_mean", "PSNR mean", 2),
    ("psnr_min", "PSNR min", 2),
    ("wrong_surface_percent", "wrong %", 3),
    ("memory_bytes", "memory", 0),
    ("torn_percent", "torn %", 1),
    ("bake_seconds", "bake s", 1),
    ("host_frames_per_second", "host frames/s", 0),
    ("labels", "labels", 0),
    ("space", "space", 0),
    ("key_interval", "frames a key", 0),
];

/// The figures of one scene.
///
/// # Errors
/// The baker's.
pub fn measure(scene: &Scene) -> Result<Value> {
    let Baked { bundle, report, .. } = baked(scene, &Options { truth: TruthFrames::None, ..Options::default() })?;
    let bundle = Bundle::parse(&bundle).with_context(|| format!("parse the bundle of {}", scene.name))?;
    let atlas = bundle.atlas();
    let Report { grid, quality, work, .. } = &report;
    Ok(json!({
        "scene": report.scene,
        "size": report.size,
        "frames": report.frames,
        "triangles": report.triangles,
        "labels": bundle.label_count(),
        "bundle_bytes": report.bytes.bundle,
        "atlas_bytes": atlas.texels.len() + atlas.palette.len(),
        "key_bytes_per_frame": report.bytes.keys_per_frame,
        "bytes_per_frame": report.bytes.per_frame,
        "psnr_mean": quality.psnr_mean,
        "psnr_min": quality.psnr_min,
        "wrong_surface_percent": quality.wrong_surface_percent,
        "torn_percent": work.torn_percent,
        "memory_bytes": report.memory.workspace,
        "bake_seconds": report.seconds.total,
        "cell": grid.cell,
        "space": grid.space,
        "key_interval": grid.key_interval,
        "host_frames_per_second": work.host_frames_per_second,
    }))
}

/// The table of the rows that [`measure`] gave.
#[must_use]
pub fn table(rows: Vec<Value>) -> Table {
    let cell = |row: &Value, key: &str, digits: usize| row[key].as_str().map_or_else(|| number(&row[key], digits), str::to_owned);
    let cells = |row: &Value| COLUMNS.iter().map(|&(key, _, digits)| cell(row, key, digits)).collect();
    let lines: Vec<Vec<String>> = rows.iter().map(cells).collect();
    Table { markdown: markdown(&COLUMNS.map(|column| column.1), 1, &lines), json: Value::from(rows) }
}

/// The scene files of a folder, by name.
///
/// # Errors
/// The folder cannot be read, or has no scene file.
pub fn scene_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("read the folder {}", folder.display()))?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    files.retain(|file| file.extension().is_some_and(|ending| ending == "toml"));
    files.sort();
    if files.is_empty() {
        bail!("{}: no scene file (.toml) in this folder", folder.display());
    }
    Ok(files)
}
