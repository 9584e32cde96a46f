//! `cubist-player render`: frames as PNG files and as a GIF.
//! A player comes in; files go out through `files`, so that each is whole or not there.

use crate::cli::{Render, Usage};
use crate::files::write_png;
use crate::input;
use crate::picture::{Draw, Picture, Player};
use crate::progress::progress;
use anyhow::{Context, Result};
use cubist_baker::files::write_with;
use cubist_baker::terminal::print;
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, DynamicImage};
use std::ops::Range;
use std::path::Path;

/// What to write.
pub struct Plan<'p> {
    /// Frames, all within the bundle.
    pub frames: Range<u32>,
    /// Takes every Nth of them.
    pub every: u32,
    /// Folder of the PNG files.
    pub out: Option<&'p Path>,
    /// The GIF.
    pub gif: Option<&'p Path>,
    /// Every pixel becomes a square of this side.
    pub scale: u32,
    /// How the player draws a row.
    pub draw: Draw,
}

/// Runs the command.
pub fn run(player: &mut Player<'_>, args: &Render) -> Result<()> {
    let plan = Plan {
        frames: args.frames.within(player.bundle().frames())?,
        every: args.every,
        out: args.out.as_deref(),
        gif: args.gif.as_deref(),
        scale: args.scale,
        draw: args.draw(),
    };
    if let Some(gif) = plan.gif {
        input::keep(&args.bundle, "--gif", gif)?;
    }
    write(player, &plan)
}

/// Writes what `plan` asks for and prints where it went.
pub fn write(player: &mut Player<'_>, plan: &Plan<'_>) -> Result<()> {
    let (width, height) = player.bundle().size();
    let frames: Vec<u32> = plan.frames.clone().step_by(plan.every.max(1) as usize).collect();
    // A GIF holds its sides in 16 bits.
    if plan.gif.is_some() && width.max(height) * plan.scale > u32::from(u16::MAX) {
        let sides = (width * plan.scale, height * plan.scale);
        return Err(
            Usage(format!("--scale {} makes {} x {} pixels; a GIF holds at most 65535 a side", plan.scale, sides.0, sides.1)).into()
        );
    }
    let mut picture = Picture::new(width, height).drawn_by(plan.draw);
    if let Some(folder) = plan.out {
        std::fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
        let bar = progress(frames.len() as u64, "pictures");
        for &frame in &frames {
            picture.play(player, frame);
            write_png(&folder.join(format!("frame-{frame:04}.png")), &picture.to_rgb(plan.scale))?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        print(&format!("{} frames in {}\n", frames.len(), folder.display()))?;
    }
    if let Some(path) = plan.gif {
        let timed = delays(frames.len(), plan.every, player.bundle().fps());
        let bar = progress(timed.len() as u64, "gif");
        write_with(path, |out| {
            let mut encoder = GifEncoder::new_with_speed(out, 10);
            encoder.set_repeat(Repeat::Infinite)?;
            for &(index, hundredths) in &timed {
                picture.play(player, frames[index]);
                let rgba = DynamicImage::ImageRgb8(picture.to_rgb(plan.scale)).into_rgba8();
                let delay = Delay::from_numer_denom_ms(hundredths * 10, 1);
                encoder
                    .encode_frame(image::Frame::from_parts(rgba, 0, 0, delay))
                    .with_context(|| format!("{}: writing failed", path.display()))?;
                bar.inc(1);
            }
            Ok(())
        })?;
        bar.finish_and_clear();
        print(&format!("{} frames in {}\n", timed.len(), path.display()))?;
    }
    Ok(())
}

/// Which of `count` pictures, each `every` / `fps` seconds long, a GIF shows, and for how many hundredths of a second.
///
/// Each delay ends where its picture ends on the exact time line, rounded, so the total is right to half a hundredth.
/// Viewers play delays below two hundredths as ten, so pictures are dropped rather than shown for one.
fn delays(count: usize, every: u32, fps: u16) -> Vec<(usize, u32)> {
    let fps = u64::from(fps.max(1));
    let start = |i: usize| (i as u64 * 100 * u64::from(every) * 2 + fps) / (2 * fps);
    let mut kept: Vec<usize> = Vec::new();
    for i in 0..count {
        if kept.last().is_none_or(|&last| start(i) - start(last) >= 2) {
            kept.push(i);
        }
    }
    // The last picture, too, needs its two hundredths before the end.
    while kept.len() > 1 && kept.last().is_some_and(|&last| start(count) - start(last) < 2) {
        kept.pop();
    }
    let ends = kept.iter().skip(1).copied().chain([count]);
    kept.iter()
        .zip(ends)
        .map(|(&i, end)| (i, u32::try_from((start(end) - start(i)).max(2)).unwrap_or(u32::MAX).min(u16::MAX.into())))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_add_up_to_the_films_duration() {
        for fps in [1, 7, 10, 12, 15, 24, 25, 30, 48, 50, 60, 90, 120, 240] {
            for (count, every) in [(1, 1), (2, 1), (30, 1), (120, 1), (121, 1), (17, 3), (1000, 2)] {
                let exact = 100.0 * count as f64 * f64::from(every) / f64::from(fps);
                let timed = delays(count, every, fps);
                let total: u32 = timed.iter().map(|t| t.1).sum();
                if exact >= 2.0 {
                    assert!((f64::from(total) - exact).abs() <= 0.5, "{count} x {every} at {fps}: {total} for {exact}");
                }
                assert!(timed.iter().all(|t| t.1 >= 2), "{count} x {every} at {fps}: a delay viewers distort");
                assert_eq!(timed[0].0, 0);
            }
        }
    }

    #[test]
    fn thirty_frames_a_second_spread_their_thirds() {
        assert_eq!(delays(6, 1, 30), [(0, 3), (1, 4), (2, 3), (3, 3), (4, 4), (5, 3)]);
        assert_eq!(delays(4, 1, 100), [(0, 2), (2, 2)]);
        assert_eq!(delays(0, 1, 30), []);
    }
}
