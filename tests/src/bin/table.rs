//! Prints the project's tables: what scenes cost and how well they play, as Markdown or as one JSON document.
//! Scenes come from the baker, figures from `cubist_tests::figures`; tables go to stdout, progress to stderr.

use anyhow::{Context, Result, bail};
use clap::{Parser, Subcommand};
use cubist_baker::bake::Settings;
use cubist_baker::scene::{Overrides, Scene, builtin, load, load_builtin};
use cubist_core::Bundle;
use cubist_tests::{figures, scenes};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Prints the tables of the README and the docs.
#[derive(Parser)]
#[command(name = "table")]
struct Arguments {
    #[command(subcommand)]
    table: Table,
    /// One JSON document instead of Markdown.
    #[arg(long, global = true)]
    json: bool,
    /// Frames of every scene.
    #[arg(long, global = true)]
    frames: Option<u32>,
    /// Screen of every scene, WIDTHxHEIGHT.
    #[arg(long, global = true, value_parser = size)]
    size: Option<(u32, u32)>,
}

#[derive(Subcommand)]
enum Table {
    /// Every built-in scene at its own playback and default settings.
    Builtin,
    /// Every scene file (.toml) of a folder.
    Scenes {
        /// The folder.
        folder: PathBuf,
    },
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let number = |side: &str| side.parse().map_err(|_| format!("expected WIDTHxHEIGHT such as 320x240, found {text}"));
    let (width, height) = text.split_once('x').unwrap_or((text, ""));
    Ok((number(width)?, number(height)?))
}

/// The columns: the key in JSON, the title, digits after the point.
const COLUMNS: [(&str, &str, usize); 14] = [
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
];

/// The figures of one scene.
fn measure(scene: &Scene) -> Result<Value> {
    eprintln!("{}: baking", scene.name);
    let start = Instant::now();
    let (flat, encoded) = scenes::bake(scene, &Settings::default())?;
    let seconds = start.elapsed().as_secs_f64();
    eprintln!("{}: playing", scene.name);
    let bundle = Bundle::parse(&encoded.bundle).with_context(|| format!("parse the bundle of {}", scene.name))?;
    let quality = figures::quality(&encoded.bundle, &flat.atlas)?;
    let (atlas, path) = (bundle.atlas(), bundle.path());
    let per_frame = |bytes: usize| bytes as f64 / f64::from(bundle.frames());
    Ok(json!({
        "scene": scene.name,
        "size": [bundle.size().0, bundle.size().1],
        "frames": bundle.frames(),
        "triangles": scene.triangles.len(),
        "labels": bundle.label_count(),
        "bundle_bytes": encoded.bundle.len(),
        "atlas_bytes": atlas.texels.len() + atlas.palette.len(),
        "key_bytes_per_frame": per_frame(path.records.len() + path.table.len()),
        "bytes_per_frame": per_frame(encoded.bundle.len()),
        "psnr_mean": quality.psnr_mean,
        "psnr_min": quality.psnr_min,
        "wrong_surface_percent": quality.wrong_surface_percent,
        "torn_percent": quality.torn_percent,
        "memory_bytes": bundle.memory_needed(),
        "bake_seconds": seconds,
        "host_frames_per_second": figures::speed(&encoded.bundle, bundle.frames())?,
    }))
}

fn markdown(rows: &[Value]) -> String {
    let cell = |row: &Value, &(key, _, digits): &(&str, &str, usize)| match &row[key] {
        Value::String(text) => text.clone(),
        number => format!("{:.digits$}", number.as_f64().unwrap_or(f64::NAN)),
    };
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let titles = line(COLUMNS.iter().map(|column| column.1.to_owned()).collect());
    let rule = line(COLUMNS.iter().map(|column| if column.0 == "scene" { "---" } else { "---:" }.to_owned()).collect());
    let body: String = rows.iter().map(|row| line(COLUMNS.iter().map(|column| cell(row, column)).collect())).collect();
    titles + &rule + &body
}

/// The scene files of a folder, by name.
fn scene_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("read the folder {}", folder.display()))?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    files.retain(|file| file.extension().is_some_and(|ending| ending == "toml"));
    files.sort();
    if files.is_empty() {
        bail!("{}: no scene file (.toml) in this folder", folder.display());
    }
    Ok(files)
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let overrides = Overrides { size: arguments.size, frames: arguments.frames, ..Overrides::default() };
    let mut rows = Vec::new();
    match &arguments.table {
        Table::Builtin => {
            for name in builtin::NAMES {
                rows.push(measure(&load_builtin(name, &overrides)?)?);
            }
        }
        Table::Scenes { folder } => {
            for file in scene_files(folder)? {
                rows.push(measure(&load(&file, &overrides)?)?);
            }
        }
    }
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
    } else {
        print!("{}", markdown(&rows));
    }
    Ok(())
}
