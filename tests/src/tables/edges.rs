//! The table of antialiased outlines: what four samples a pixel where surfaces meet are worth, and what they cost.
//! Scenes come from the command `table`; every picture is compared with the antialiased scene itself.

use super::{Table, baked, markdown, number};
use crate::play;
use anyhow::Result;
use cubist_baker::job::Baked;
use cubist_baker::metrics;
use cubist_baker::scene::Scene;
use cubist_baker::truth::{Truth, spread};
use cubist_baker::verify::rgb;
use cubist_baker::{Options, TruthFrames};
use cubist_core::Player;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// The scenes of the table.
pub const SCENES: [&str; 5] = ["cone-orbit", "street", "arch", "torus", "columns"];
/// Frames compared, evenly spread over the path.
const COMPARED: u32 = 16;

/// One way to draw: sums over the frames.
#[derive(Default)]
struct Drawn {
    psnr: f64,
    ssim: f64,
    time: Duration,
}

/// The figures of one scene.
///
/// # Errors
/// The baker's.
pub fn measure(scene: &Scene) -> Result<Value> {
    let Baked { bundle, .. } = baked(scene, &Options { truth: TruthFrames::None, ..Options::default() })?;
    eprintln!("{}: comparing", scene.name);
    let truth = Truth::new(scene);
    let frames = spread(scene.playback.frames, COMPARED);
    let (width, pixels) = (scene.playback.width as usize, scene.playback.width as usize * scene.playback.height as usize);
    let (mut ways, mut smoothed): ([Drawn; 5], u64) = Default::default();
    play::visit(&bundle, frames.iter().copied(), |frame, player| {
        let exact = truth.frame(frame);
        let draw = |drawn: &mut Drawn, player: &mut Player<'_>, row: fn(&mut Player<'_>, u32, &mut [u16])| {
            let start = Instant::now();
            let picture = play::whole(player, row);
            drawn.time += start.elapsed();
            let played: Vec<u8> = picture.into_iter().flat_map(rgb).collect();
            drawn.psnr += metrics::psnr(metrics::mean_squared_error(&played, &exact));
            drawn.ssim += metrics::ssim(&played, &exact, width);
        };
        let [plain, smooth, dithered, bilinear, fine] = &mut ways;
        draw(plain, player, |player, y, out| player.row(y, out));
        draw(dithered, player, |player, y, out| player.dithered_row(y, out));
        draw(bilinear, player, |player, y, out| player.bilinear_row(y, out));
        draw(smooth, player, |player, y, out| player.smooth_row(y, out));
        smoothed += u64::from(player.work().smoothed_pixels);
        draw(fine, player, |player, y, out| player.fine_row(y, out));
    })?;
    let [plain, smooth, dithered, bilinear, fine] = &ways;
    let count = frames.len().max(1) as f64;
    let time = |way: &Drawn| way.time.as_secs_f64() / plain.time.as_secs_f64().max(1e-9);
    Ok(json!({
        "scene": scene.name,
        "truth_psnr": plain.psnr / count,
        "truth_psnr_smooth": smooth.psnr / count,
        "truth_psnr_dithered": dithered.psnr / count,
        "truth_psnr_bilinear": bilinear.psnr / count,
        "truth_psnr_fine": fine.psnr / count,
        "truth_ssim": plain.ssim / count,
        "truth_ssim_smooth": smooth.ssim / count,
        "truth_ssim_fine": fine.ssim / count,
        "smoothed_percent": 100.0 * smoothed as f64 / (count * pixels as f64),
        "time_ratio": time(smooth),
        "time_ratio_fine": time(fine),
    }))
}

/// The table of the rows that [`measure`] gave.
#[must_use]
pub fn table(rows: Vec<Value>) -> Table {
    let columns = [
        ("truth_psnr", 2),
        ("truth_psnr_smooth", 2),
        ("truth_psnr_dithered", 2),
        ("truth_psnr_bilinear", 2),
        ("truth_psnr_fine", 2),
        ("truth_ssim", 3),
        ("truth_ssim_smooth", 3),
        ("truth_ssim_fine", 3),
        ("smoothed_percent", 1),
        ("time_ratio", 2),
        ("time_ratio_fine", 2),
    ];
    let cells = |row: &Value| {
        let numbers = columns.iter().map(|&(key, digits)| number(&row[key], digits));
        std::iter::once(row["scene"].as_str().unwrap_or_default().to_owned()).chain(numbers).collect()
    };
    let lines: Vec<Vec<String>> = rows.iter().map(cells).collect();
    let titles =
        ["scene", "PSNR", "smooth", "dithered", "bilinear", "fine", "SSIM", "smooth", "fine", "smoothed %", "host time, smooth", "fine"];
    Table { markdown: markdown(&titles, 1, &lines), json: Value::from(rows) }
}
