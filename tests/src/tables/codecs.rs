//! The codec table: bytes of a bundle, its source image packed, beside those that other codecs take to be as good, by PSNR and by SSIM: against exact
//! rays, and against the antialiased truth, rows drawn plainly or as finely as the player can. Scenes come from the command `table`, codecs from
//! `crate::codecs`.

use super::{Table, baked, markdown, number};
use crate::codecs::clip::{self, Likeness, Shape};
use crate::codecs::ffmpeg::Ffmpeg;
use crate::codecs::search::Match;
use crate::codecs::{Codec, Metric, Source};
use anyhow::{Context, Result};
use cubist_baker::atlas::Storage;
use cubist_baker::bake::Settings;
use cubist_baker::job::Baked;
use cubist_baker::scene::Scene;
use cubist_baker::{Options, TruthFrames};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The scenes of the table unless others are named.
pub const SCENES: [&str; 4] = ["cone-orbit", "street", "torus", "arch"];

/// How the player draws, and what that is compared with.
#[derive(Clone, Copy)]
enum View {
    /// `row` beside exact rays.
    Exact,
    /// `row` beside the truth.
    Truth,
    /// `fine_row` beside the truth.
    Fine,
}

/// The comparisons: the key in JSON, the title, of what, by what.
const COMPARISONS: [(&str, &str, View, Metric); 6] = [
    ("exact_psnr", "exact, PSNR", View::Exact, Metric::Psnr),
    ("exact_ssim", "exact, SSIM", View::Exact, Metric::Ssim),
    ("truth_psnr", "truth, PSNR", View::Truth, Metric::Psnr),
    ("truth_ssim", "truth, SSIM", View::Truth, Metric::Ssim),
    ("fine_psnr", "fine, PSNR", View::Fine, Metric::Psnr),
    ("fine_ssim", "fine, SSIM", View::Fine, Metric::Ssim),
];

/// The key frame intervals of codecs that have such: of bundles whose keys are as far apart as they are unless the baker finds better, that of keys that need
/// no earlier one, and that of all keys.
fn gops() -> [u32; 2] {
    let settings = Settings::default();
    [settings.key_interval * settings.coding.independent_every as u32, settings.key_interval]
}

/// What a bundle costs and reaches.
struct Ours {
    key_bytes_per_frame: f64,
    bytes_per_frame: f64,
    /// The same where its source image is raw.
    raw_bytes_per_frame: f64,
    /// By [`View`].
    likeness: [Likeness; 3],
}

/// The rows of one scene: the bundle's, then every codec's.
///
/// # Errors
/// The baker's, those of temporary files, and what ffmpeg says.
pub fn measure(scene: &Scene, ffmpeg: Option<&Ffmpeg>) -> Result<Vec<Value>> {
    let options = Options { storage: Some(Storage::Packed), truth: TruthFrames::None, ..Options::default() };
    let Baked { bundle, report, flat, .. } = baked(scene, &options)?;
    eprintln!("{}: rendering the truth", scene.name);
    let shape = Shape::of(scene);
    let folder = tempfile::tempdir().context("make a temporary folder")?;
    let exact = Source::new(shape, clip::exact(&flat.atlas), folder.path(), "exact")?;
    let truth = Source::new(shape, clip::truth(scene), folder.path(), "truth")?;
    let sources = [&exact, &truth, &truth];
    let plain = clip::played(&bundle, shape.frames, |player, y, out| player.row(y, out))?;
    let fine = clip::played(&bundle, shape.frames, |player, y, out| player.fine_row(y, out))?;
    let frames = f64::from(shape.frames);
    let (picture, bytes) = (&report.source_image, report.bytes.bundle);
    let ours = Ours {
        key_bytes_per_frame: report.bytes.keys_per_frame,
        bytes_per_frame: bytes as f64 / frames,
        raw_bytes_per_frame: (bytes + picture.raw_bytes - picture.stored_bytes) as f64 / frames,
        likeness: [exact.compare(&plain), truth.compare(&plain), truth.compare(&fine)],
    };
    let codecs = Codec::all(ffmpeg, gops(), shape);
    let jobs: Vec<(usize, usize)> = (0..codecs.len()).flat_map(|codec| (0..COMPARISONS.len()).map(move |c| (codec, c))).collect();
    let done = AtomicUsize::new(0);
    let found = jobs
        .par_iter()
        .map(|&(codec, comparison)| {
            let (_, title, view, metric) = COMPARISONS[comparison];
            let found = codecs[codec].equal(sources[view as usize], metric, metric.of(ours.likeness[view as usize]));
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            eprintln!("{}: {done} of {} comparisons: {}, {title}", scene.name, jobs.len(), codecs[codec].name());
            found
        })
        .collect::<Result<Vec<Option<Match>>>>()
        .with_context(|| format!("compare {}", scene.name))?;
    let mut rows = vec![own(scene, &ours)];
    for (codec, found) in codecs.iter().zip(found.chunks(COMPARISONS.len())) {
        rows.push(row(scene, &codec.name(), found, &ours));
    }
    Ok(rows)
}

/// The bundle's own row.
fn own(scene: &Scene, ours: &Ours) -> Value {
    let mut row = json!({
        "scene": scene.name,
        "codec": "Cubist",
        "size": [scene.playback.width, scene.playback.height],
        "frames": scene.playback.frames,
        "key_bytes_per_frame": ours.key_bytes_per_frame,
        "bytes_per_frame": ours.bytes_per_frame,
        "raw_bytes_per_frame": ours.raw_bytes_per_frame,
    });
    for (key, _, view, metric) in COMPARISONS {
        row[key] = json!({ "reached": metric.of(ours.likeness[view as usize]) });
    }
    row
}

/// A codec's row: for every comparison its bytes a frame at ours, how often our bytes (the whole bundle's) go into them, and whether the codec
/// has a step that is just as good.
fn row(scene: &Scene, codec: &str, found: &[Option<Match>], ours: &Ours) -> Value {
    let frames = f64::from(scene.playback.frames);
    let mut row = json!({ "scene": scene.name, "codec": codec });
    for (&(key, ..), found) in COMPARISONS.iter().zip(found) {
        let (bytes, how, reached) = match *found {
            Some(Match::Equal(bytes)) => (bytes, "equal", None),
            Some(Match::Coarsest(point)) => (point.bytes, "coarsest", Some(point.score)),
            Some(Match::Short(point)) => (point.bytes, "short", Some(point.score)),
            None => continue,
        };
        let bytes = bytes / frames;
        row[key] = json!({ "bytes_per_frame": bytes, "factor": bytes / ours.bytes_per_frame, "match": how, "reached": reached });
    }
    row
}

/// The table of the rows that [`measure`] gave.
#[must_use]
pub fn table(rows: Vec<Value>, ffmpeg: Option<&Ffmpeg>) -> Table {
    let titles = ["scene", "codec", "bytes/frame"].into_iter().chain(COMPARISONS.map(|c| c.1)).collect::<Vec<_>>();
    let text = |row: &Value, key: &str| row[key].as_str().unwrap_or("").to_owned();
    let digits = |metric: Metric| if metric == Metric::Psnr { 2 } else { 4 };
    let unit = |metric: Metric| if metric == Metric::Psnr { " dB" } else { "" };
    let cell = |row: &Value, key: &str, metric: Metric| {
        let comparison = &row[key];
        let reached = number(&comparison["reached"], digits(metric)) + unit(metric);
        let bytes = format!("{} ({})", number(&comparison["bytes_per_frame"], 0), number(&comparison["factor"], 2));
        match comparison["match"].as_str() {
            None if comparison.is_null() => String::new(),
            None => reached,
            Some("equal") => bytes,
            Some("coarsest") => format!("at most {bytes}"),
            Some(_) => format!("short: {bytes} at {reached}"),
        }
    };
    let line = |row: &Value| {
        let keys = &row["key_bytes_per_frame"];
        let [packed, raw] = ["bytes_per_frame", "raw_bytes_per_frame"].map(|key| number(&row[key], 0));
        let own = if keys.is_null() { String::new() } else { format!("{packed} ({} keys; raw {raw})", number(keys, 0)) };
        let mut cells = vec![text(row, "scene"), text(row, "codec"), own];
        cells.extend(COMPARISONS.map(|(key, _, _, metric)| cell(row, key, metric)));
        cells
    };
    let lines: Vec<Vec<String>> = rows.iter().map(line).collect();
    let mut conditions = rows.first().map_or_else(String::new, |row| {
        let shape = format!("{} x {} pixels, {} frames", row["size"][0], row["size"][1], row["frames"]);
        let codecs = ffmpeg.map_or_else(|| "no ffmpeg".to_owned(), |ffmpeg| format!("ffmpeg {}", ffmpeg.version));
        format!("\n{shape}; {codecs}.")
    });
    conditions += "\n";
    Table { markdown: markdown(&titles, 2, &lines) + &conditions, json: Value::from(rows) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codecs::search::Point;
    use crate::scenes;

    fn ours() -> Ours {
        let likeness = Likeness { psnr: 30.0, ssim: 0.95 };
        Ours { key_bytes_per_frame: 100.0, bytes_per_frame: 1000.0, raw_bytes_per_frame: 3000.0, likeness: [likeness; 3] }
    }

    #[test]
    fn cells_say_bytes_factor_and_what_is_not_equal() {
        let scene = scenes::reduced("pyramid", [64, 48], 8).unwrap();
        let point = |score| Point { bytes: 4000.0, score };
        let found = [Some(Match::Equal(16000.0)), Some(Match::Coarsest(point(0.97))), Some(Match::Short(point(28.0))), None, None, None];
        let table = table(vec![own(&scene, &ours()), row(&scene, "MJPEG", &found, &ours())], None);
        let lines: Vec<&str> = table.markdown.lines().collect();
        assert_eq!(
            lines[2],
            "| pyramid | Cubist | 1000 (100 keys; raw 3000) | 30.00 dB | 0.9500 | 30.00 dB | 0.9500 | 30.00 dB | 0.9500 |"
        );
        assert_eq!(lines[3], "| pyramid | MJPEG |  | 2000 (2.00) | at most 500 (0.50) | short: 500 (0.50) at 28.00 dB |  |  |  |");
        assert_eq!(lines[5], "64 x 48 pixels, 8 frames; no ffmpeg.");
        assert_eq!(table.json[1]["exact_psnr"]["factor"], 2.0);
    }

    #[test]
    fn without_ffmpeg_there_is_a_table_still() {
        let rows = measure(&scenes::reduced("pyramid", [48, 32], 3).unwrap(), None).unwrap();
        assert_eq!(rows.len(), 2);
        for (key, ..) in COMPARISONS {
            assert!(rows[0][key]["reached"].as_f64().unwrap() > 0.5 && rows[1][key]["factor"].as_f64().unwrap() > 0.0, "{rows:?}");
        }
    }
}
