//! The report as a table, for people: rows of a name and its value. The first has the scene, the last the seconds.

use super::{Grid, Report, Source};
use crate::atlas::Storage;
use crate::terminal::grouped;
use crate::{bends, chart, halves, outlines, straight};
use cubist_core::format::TexelKind;

/// Rows of name and value. One without a name goes on with what the row above it is about.
struct Rows(Vec<(String, String)>);

impl Rows {
    fn add(&mut self, name: &str, value: String) {
        self.0.push((name.to_owned(), value));
    }
}

/// The report as rows of name and value: bytes by section, quality, memory, seconds.
#[must_use]
pub fn table(report: &Report) -> Vec<(String, String)> {
    let mut rows = Rows(Vec::new());
    tell_scene(report, &mut rows);
    tell_bytes(report, &mut rows);
    tell_quality(report, &mut rows);
    tell_playing(report, &mut rows);
    rows.0
}

/// What is baked, and the grid of its keys.
fn tell_scene(report: &Report, rows: &mut Rows) {
    let [width, height] = report.size;
    let looping = if report.looping { ", looping" } else { "" };
    rows.add("scene", format!("{}: {} triangles, {} rays", report.scene, grouped(report.triangles), grouped(report.rays as usize)));
    rows.add("playback", format!("{} frames of {width} x {height}, {} frames/s{looping}", report.frames, report.fps));
    let Grid { keys, cell, time, space, key_interval, .. } = &report.grid;
    // Where the view turns quickly, and on a path shorter than the interval, they stand closer than asked for.
    let intervals = if report.looping { *keys } else { keys.saturating_sub(1) };
    let frames = if report.looping { report.frames } else { report.frames.saturating_sub(1) };
    let every = match f64::from(frames) / intervals.max(1) as f64 {
        mean if 1.5 * mean < f64::from(*key_interval) => format!("{mean:.1} frames on the mean"),
        _ => format!("{key_interval} frames"),
    };
    rows.add("grid", format!("{keys} keys, one every {every}; cells of {cell} pixels; time {time}, space {space}"));
    if let Some(why) = &report.grid.why {
        rows.add("", why.clone());
    }
    if !report.grid.spaces.is_empty() {
        rows.add("", straight::reason(&report.grid.spaces));
    }
    if let Some(bends) = report.grid.bends {
        rows.add("", bends::reason(bends).to_owned());
    }
}

/// The bytes, section by section.
fn tell_bytes(report: &Report, rows: &mut Rows) {
    let Report { bytes, source_image: image, .. } = report;
    rows.add("source image", format!("{} bytes: {}", grouped(bytes.atlas), picture(image)));
    if let Some(trial) = image.halves {
        rows.add("", halves::reason(trial));
    }
    rows.add("labels, mask", format!("{} bytes: {} labels for {} charts", grouped(bytes.labels + bytes.mask), image.labels, image.charts));
    if !image.outlines.is_empty() {
        rows.add("", outlines::reason(&image.outlines));
    }
    rows.add("", chart::reason(image.candidate, image.rewarped, image.trials.iter()));
    rows.add("keys", format!("{} bytes: {:.1} a frame", grouped(bytes.keys), bytes.keys_per_frame));
    rows.add("bundle", format!("{} bytes: {:.1} a frame", grouped(bytes.bundle), bytes.per_frame));
}

/// What the source image is like.
fn picture(image: &Source) -> String {
    format!(
        "{} x {} texels of {}, {} colours{}, {:.0} % covered; {}",
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
    )
}

/// How close playback comes: to exact rays through the source image, then to the antialiased scene.
fn tell_quality(report: &Report, rows: &mut Rows) {
    let quality = &report.quality;
    rows.add(
        "PSNR",
        format!(
            "{:.2} dB mean, {:.2} dB at worst (frame {}); bilinear {:.2} dB",
            quality.psnr_mean, quality.psnr_min, quality.worst_frame, quality.psnr_bilinear
        ),
    );
    rows.add("SSIM", format!("{:.4}", quality.ssim_mean));
    rows.add("wrong surface", format!("{:.3} % of the pixels", quality.wrong_surface_percent));
    let path = &quality.path_error_texels;
    rows.add("path error", format!("{:.2} texels median, {:.2} for 99 %, {:.1} worst", path.p50, path.p99, path.max));
    if let Some(truth) = &report.quality_vs_truth {
        let of = if truth.truth_frames == report.frames { "all".to_owned() } else { truth.truth_frames.to_string() };
        rows.add(
            "against truth",
            format!(
                "{:.2} dB, {:.2} dB with softened outlines, {:.2} dB with bilinear texels too, SSIM {:.4}, over {of} frames",
                truth.psnr_mean, truth.psnr_smooth, truth.psnr_fine, truth.ssim_mean
            ),
        );
    }
}

/// What playing takes, and what baking took.
fn tell_playing(report: &Report, rows: &mut Rows) {
    let Report { work, memory, seconds, .. } = report;
    rows.add(
        "torn",
        format!(
            "{:.1} % of the pixels; {:.0} coverage tests a frame, {} at most",
            work.torn_percent,
            work.coverage_tests_mean,
            grouped(work.coverage_tests_worst as usize)
        ),
    );
    let picture = if memory.picture > 0 { format!(", {} of them the source image", grouped(memory.picture)) } else { String::new() };
    rows.add("working memory", format!("{} bytes{picture}, and a row of {}", grouped(memory.workspace), grouped(memory.row)));
    rows.add("speed here", format!("{:.0} frames/s on one thread", work.host_frames_per_second));
    let search = if seconds.search > 0.0 { format!(", search {:.1}", seconds.search) } else { String::new() };
    rows.add(
        "seconds",
        format!(
            "{:.1}: load {:.1}, rays {:.1}, atlas {:.1}, encode {:.1}, paint {:.1}, verify {:.1}{search}",
            seconds.total, seconds.load, seconds.rays, seconds.atlas, seconds.encode, seconds.paint, seconds.verify
        ),
    );
}

/// What trials have found, as options: who gives those that are not given yet has much the same without these trials, in a fraction of the time. `None`
/// where none was made. (Which sheets are left out is told anew.)
#[must_use]
pub fn sooner(report: &Report) -> Option<String> {
    let Report { grid, source_image: image, .. } = report;
    let tried = !image.trials.is_empty() || grid.why.is_some() || !grid.spaces.is_empty() || !image.outlines.is_empty();
    let rewarp = if image.rewarped { "on" } else { "off" };
    let outline = if image.outlines.is_empty() { String::new() } else { format!(" --outline {}", image.outline) };
    tried.then(|| {
        format!(
            "--cell {} --key-interval {} --time {} --space {} --charts {} --rewarp {rewarp}{outline}",
            grid.cell,
            grid.key_interval,
            grid.time,
            grid.space,
            image.candidate.name()
        )
    })
}
