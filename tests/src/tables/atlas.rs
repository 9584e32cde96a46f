//! The table of source images: what each scene was cut into, how tightly that is packed, why cells are torn, and what it all costs beside
//! codecs of single frames. Scenes come from the command `table`, figures from the baker's report; the table goes back.

use super::{Table, baked, markdown, number};
use crate::codecs::clip::{self, Shape};
use crate::codecs::ffmpeg::Ffmpeg;
use crate::codecs::search::Match;
use crate::codecs::{Codec, Metric, Source};
use anyhow::{Context, Result};
use cubist_baker::Options;
use cubist_baker::atlas::{SourceImage, Storage};
use cubist_baker::encode::image_bytes;
use cubist_baker::job::Baked;
use cubist_baker::scene::Scene;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use serde_json::{Value, json};

/// The scenes of the table unless others are named.
pub const SCENES: [&str; 5] = ["cone-orbit", "street", "terrain", "columns", "torus"];

/// The columns: the key in JSON, the title, digits after the point; the first two are words.
const COLUMNS: [(&str, &str, usize); 21] = [
    ("scene", "scene", 0),
    ("candidate", "candidate", 0),
    ("charts", "charts", 0),
    ("labels", "labels", 0),
    ("torn_seam_percent", "torn %: seam", 1),
    ("torn_silhouette_percent", "silhouette", 1),
    ("torn_occlusion_percent", "occlusion", 1),
    ("torn_fold_percent", "fold", 1),
    ("fill_percent", "fill %", 1),
    ("raw_bytes", "raw", 0),
    ("packed_bytes", "packed", 0),
    ("deflated_bytes", "deflated", 0),
    ("key_bytes_per_frame", "keys/frame", 1),
    ("bytes_per_frame", "bytes/frame", 1),
    ("mjpeg_bytes_per_frame", "MJPEG/frame", 0),
    ("gif_bytes_per_frame", "GIF/frame", 0),
    ("exact_psnr", "PSNR exact", 2),
    ("truth_psnr", "PSNR truth", 2),
    ("smooth_psnr", "softened", 2),
    ("atlas_seconds", "charts s", 1),
    ("seconds", "bake s", 1),
];

/// The figures of one scene.
///
/// # Errors
/// The baker's, those of temporary files, and what ffmpeg says.
pub fn measure(scene: &Scene, ffmpeg: Option<&Ffmpeg>) -> Result<Value> {
    let baked = baked(scene, &Options::default())?;
    let mut row = own(&baked)?;
    eprintln!("{}: comparing with codecs", scene.name);
    let shape = Shape::of(scene);
    let folder = tempfile::tempdir().context("make a temporary folder")?;
    let source = Source::new(shape, clip::exact(&baked.flat.atlas), folder.path(), "exact")?;
    let asked = source.compare(&clip::played(&baked.bundle, shape.frames, |player, y, out| player.row(y, out))?).psnr;
    for codec in Codec::all(ffmpeg, [1, 1], shape) {
        let name = codec.name();
        let Some(key) = ["mjpeg", "gif"].into_iter().find(|key| name.to_lowercase().starts_with(key)) else { continue };
        let found = codec.equal(&source, Metric::Psnr, asked).with_context(|| format!("compare {}", scene.name))?;
        let Some((how, bytes)) = found.map(|found| match found {
            Match::Equal(bytes) => ("equal", bytes),
            Match::Coarsest(point) => ("at most", point.bytes),
            Match::Short(point) => ("short", point.bytes),
        }) else {
            continue;
        };
        let bytes = bytes / f64::from(shape.frames);
        // Of a codec's ways to sample colour the better one counts: first one that reaches as much, then the smaller.
        let rank = |how: &Value, bytes: f64| (how == "short", bytes);
        let [of, match_of] = [format!("{key}_bytes_per_frame"), format!("{key}_match")];
        let held = row[&of].as_f64().map(|bytes| rank(&row[&match_of], bytes));
        if held.is_none_or(|held| rank(&Value::from(how), bytes) < held) {
            (row[of], row[match_of]) = (Value::from(bytes), Value::from(how));
        }
    }
    Ok(row)
}

/// What the bundle itself says.
fn own(baked: &Baked) -> Result<Value> {
    let (report, image) = (&baked.report, &baked.flat.atlas.image);
    let document = serde_json::to_value(report).context("write the report")?;
    let torn = &report.torn_by_cause;
    Ok(json!({
        "scene": report.scene,
        "size": report.size,
        "frames": report.frames,
        "candidate": document["source_image"]["candidate"].as_str().unwrap_or("-"),
        "charts": report.source_image.charts,
        "labels": report.source_image.labels,
        "torn_seam_percent": torn.seam,
        "torn_silhouette_percent": torn.silhouette,
        "torn_occlusion_percent": torn.occlusion,
        "torn_fold_percent": torn.fold,
        "fill_percent": 100.0 * report.source_image.fill,
        "texels": [image.width, image.height],
        "raw_bytes": image_bytes(image, Storage::Raw),
        "packed_bytes": image_bytes(image, Storage::Packed),
        "deflated_bytes": deflated(image)?,
        "key_bytes_per_frame": report.bytes.keys_per_frame,
        "bytes_per_frame": report.bytes.per_frame,
        "exact_psnr": report.quality.psnr_mean,
        "truth_psnr": report.quality_vs_truth.as_ref().map(|truth| truth.psnr_mean),
        "smooth_psnr": report.quality_vs_truth.as_ref().map(|truth| truth.psnr_smooth),
        "atlas_seconds": report.seconds.atlas,
        "seconds": report.seconds.total,
    }))
}

/// Bytes of the texels and their mask as PNG files hold them, deflated as well as those can.
fn deflated(image: &SourceImage) -> Result<usize> {
    let size = |pixels: &[u8]| -> Result<usize> {
        let mut file = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::NoFilter);
        encoder.write_image(pixels, image.width, image.height, ExtendedColorType::L8).context("deflate a source image")?;
        Ok(file.len())
    };
    let mask: Vec<u8> = image.covered.iter().map(|&covered| u8::from(covered)).collect();
    Ok(size(&image.texels.iter().map(|&texel| texel as u8).collect::<Vec<_>>())?
        + if image.labels.iter().any(|label| label.masked) { size(&mask)? } else { 0 })
}

/// The table of the rows that [`measure`] gave.
#[must_use]
pub fn table(rows: Vec<Value>) -> Table {
    let cell = |row: &Value, key: &str, digits: usize| {
        let plain = row[key].as_str().map_or_else(|| number(&row[key], digits), str::to_owned);
        match key.strip_suffix("_bytes_per_frame").and_then(|codec| row[format!("{codec}_match")].as_str()) {
            None | Some("equal") => plain,
            Some(how) => format!("{how} {plain}"),
        }
    };
    let cells = |row: &Value| COLUMNS.iter().map(|&(key, _, digits)| cell(row, key, digits)).collect();
    let lines: Vec<Vec<String>> = rows.iter().map(cells).collect();
    Table { markdown: markdown(&COLUMNS.map(|column| column.1), 2, &lines), json: Value::from(rows) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes;

    #[test]
    fn a_row_tells_causes_bytes_and_codecs() {
        let row = measure(&scenes::reduced("pyramid", [64, 48], 4).unwrap(), None).unwrap();
        for key in
            ["charts", "fill_percent", "raw_bytes", "packed_bytes", "deflated_bytes", "exact_psnr", "truth_psnr", "gif_bytes_per_frame"]
        {
            assert!(row[key].as_f64().unwrap() > 1.0, "{key}: {row}");
        }
        let torn = ["seam", "silhouette", "occlusion", "fold"].map(|cause| row[format!("torn_{cause}_percent")].as_f64().unwrap());
        assert!((1.0..100.0).contains(&torn.iter().sum::<f64>()), "{row}");
        assert!(row["mjpeg_bytes_per_frame"].is_null() && row["candidate"].is_string());
    }

    #[test]
    fn cells_say_what_is_not_equal() {
        let row = json!({ "scene": "a", "candidate": "-", "mjpeg_bytes_per_frame": 10.4, "mjpeg_match": "short", "gif_bytes_per_frame": 7.0, "gif_match": "equal" });
        let table = table(vec![row]);
        let line = table.markdown.lines().nth(2).unwrap();
        assert!(line.starts_with("| a | - |") && line.contains("| short 10 | 7 |"), "{line}");
    }
}
