//! The coverage table: what telling surfaces apart is worth, from the way of 1998 to a perfect one.
//! Scenes come from the command `table`; bundles play through the real player, baselines come from `partitions`.

use super::{Table, markdown, number};
use crate::figures;
use crate::partitions::{self, Score};
use anyhow::{Context, Result};
use cubist_baker::bake::{self, Encoded, Flat, Settings};
use cubist_baker::order::Coverage;
use cubist_baker::scene::Scene;
use cubist_baker::verify::{Quality, against_exact};
use serde_json::{Value, json};

/// The scenes of the table unless others are named.
pub const SCENES: [&str; 8] = ["cone-orbit", "cone-translate", "street", "terrain", "arch", "torus", "columns", "round-columns"];
/// Their screen, pixels.
pub const SIZE: (u32, u32) = (320, 240);
/// Their frames.
pub const FRAMES: u32 = 128;

/// The ways of telling surfaces apart: the key in JSON and the title.
const WAYS: [(&str, &str); 6] = [
    ("naive", "naive 1998"),
    ("nearest", "nearest node"),
    ("chart", "chart alone"),
    ("field", "field alone"),
    ("all", "all"),
    ("perfect", "perfect partition"),
];

/// A bundle with one choice of coverage tests, played.
struct Played {
    encoded: Encoded,
    quality: Quality,
    key_bytes_per_frame: f64,
}

fn play(scene: &Scene, flat: &Flat, settings: &Settings) -> Result<Played> {
    let name = || format!("{}: cells of {} pixels, coverage {:?}", scene.name, settings.cell, settings.coverage);
    eprintln!("{}", name());
    let encoded = bake::encode(scene, flat, settings, &|_, _| {}).with_context(name)?;
    let quality = against_exact(&encoded.bundle, &flat.atlas, &|_, _| {}).with_context(name)?;
    let key_bytes_per_frame = figures::key_bytes_per_frame(&encoded.bundle).with_context(name)?;
    Ok(Played { encoded, quality, key_bytes_per_frame })
}

/// The rows of one scene, one for each cell size, pixels.
///
/// # Errors
/// The baker's.
pub fn measure(scene: &Scene, cells: &[u32]) -> Result<Vec<Value>> {
    eprintln!("{}: casting rays", scene.name);
    let flat = bake::flatten(scene, &Settings::default().atlas, &|_, _| {}).with_context(|| format!("bake {}", scene.name))?;
    cells.iter().map(|&cell| row(scene, &flat, &Settings { cell, ..Settings::default() })).collect()
}

fn row(scene: &Scene, flat: &Flat, settings: &Settings) -> Result<Value> {
    let with = |coverage| play(scene, flat, &Settings { coverage, ..*settings });
    let (chart, field, all) = (with(Coverage::Chart)?, with(Coverage::Field)?, with(Coverage::All)?);
    eprintln!("{}: cells of {} pixels, baselines", scene.name, settings.cell);
    let grid = &all.encoded.grid;
    let baseline =
        |Score { psnr_mean, wrong_surface_percent }| json!({ "psnr_mean": psnr_mean, "wrong_surface_percent": wrong_surface_percent });
    let real = |Played { quality, key_bytes_per_frame, .. }: &Played| {
        json!({
            "psnr_mean": quality.psnr_mean,
            "psnr_min": quality.psnr_min,
            "psnr_bilinear": quality.psnr_bilinear,
            "wrong_surface_percent": quality.wrong_surface_percent,
            "key_bytes_per_frame": key_bytes_per_frame,
        })
    };
    Ok(json!({
        "scene": scene.name,
        "size": [scene.playback.width, scene.playback.height],
        "frames": scene.playback.frames,
        "cell": settings.cell,
        "key_interval": settings.key_interval,
        "naive": baseline(partitions::naive(&flat.atlas, grid)),
        "nearest": baseline(partitions::nearest(&flat.atlas, grid)),
        "chart": real(&chart),
        "field": real(&field),
        "all": real(&all),
        "perfect": baseline(partitions::perfect(&all.encoded.bundle, &flat.atlas)?),
    }))
}

/// The table of the rows that [`measure`] gave.
#[must_use]
pub fn table(rows: Vec<Value>) -> Table {
    let mut titles = vec!["scene", "cell"];
    titles.extend(WAYS.map(|way| way.1));
    titles.extend(["PSNR min", "bilinear", "keys/frame"]);
    let line = |row: &Value| {
        let mut cells = vec![row["scene"].as_str().unwrap_or("").to_owned(), number(&row["cell"], 0)];
        cells.extend(WAYS.map(|(way, _)| {
            let (psnr, wrong) = (number(&row[way]["psnr_mean"], 2), number(&row[way]["wrong_surface_percent"], 2));
            // Perfect is never wrong: that is what it is.
            if way == "perfect" { psnr } else { format!("{psnr} / {wrong}") }
        }));
        let all = &row["all"];
        cells.extend([number(&all["psnr_min"], 2), number(&all["psnr_bilinear"], 2), number(&all["key_bytes_per_frame"], 1)]);
        cells
    };
    let lines: Vec<Vec<String>> = rows.iter().map(line).collect();
    let conditions = rows.first().map_or_else(String::new, |row| {
        let [size, interval] = [&row["size"], &row["key_interval"]];
        format!("\n{} x {} pixels, {} frames, a key every {interval} frames.\n", size[0], size[1], row["frames"])
    });
    Table { markdown: markdown(&titles, 1, &lines) + &conditions, json: Value::from(rows) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes;

    #[test]
    fn a_scene_has_a_row_for_each_cell_size() {
        let scene = scenes::reduced("pyramid", [64, 48], 8).unwrap();
        let rows = measure(&scene, &[8, 16]).unwrap();
        let psnr = |row: &Value, way: &str| row[way]["psnr_mean"].as_f64().unwrap();
        assert_eq!(rows.len(), 2);
        for row in &rows {
            let [naive, all, perfect] = ["naive", "all", "perfect"].map(|way| psnr(row, way));
            assert!(naive <= all && all <= perfect, "{row}");
        }
        assert!(psnr(&rows[1], "all") < psnr(&rows[0], "all"), "larger cells are no better: {rows:?}");
        let text = table(rows).markdown;
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[2].starts_with("| pyramid | 8 | ") && lines[3].starts_with("| pyramid | 16 | "), "{text}");
        assert_eq!(lines[5], "64 x 48 pixels, 8 frames, a key every 8 frames.");
        assert!(lines[..4].iter().all(|line| line.matches('|').count() == 12), "{text}");
    }
}
