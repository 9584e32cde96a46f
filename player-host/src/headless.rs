//! The program without a window: the pictures it would show, as files.
//! A player or a stage comes in; PNG files and a GIF go out.

use crate::canvas::{Canvas, to_image};
use crate::files::write_png;
use crate::picture::Player;
use crate::render::{self, Plan};
use crate::stage::Stage;
use crate::window::DEFAULT_ROOM;
use anyhow::{Context, Result};
use std::path::Path;
use std::time::Duration;

/// Writes the first `limit` frames (all without one) as PNG files and as `demo.gif` into `folder`.
pub fn pictures(player: &mut Player<'_>, folder: &Path, limit: Option<u32>, scale: u32) -> Result<()> {
    let frames = player.bundle().frames();
    let gif = folder.join("demo.gif");
    let plan = Plan {
        frames: 0..limit.map_or(frames, |l| l.min(frames)),
        every: 1,
        out: Some(folder),
        gif: Some(&gif),
        scale,
        draw: |player, y, row| player.row(y, row),
    };
    render::write(player, &plan)
}

/// Shows `pictures` pictures on a canvas of the window's natural size, one frame after the other, and writes the last to `path`.
pub fn shot(mut stage: Stage<'_>, path: &Path, pictures: u32) -> Result<()> {
    let mut now = Duration::ZERO;
    let (width, height) = stage.natural_size(DEFAULT_ROOM, 1, now);
    let mut canvas = Canvas::new(width, height).with_context(|| format!("a window of {width} x {height} pixels is too large to draw"))?;
    for picture in 0..pictures {
        if picture > 0 {
            now = stage.deadline(now).unwrap_or(now);
        }
        stage.compose(&mut canvas, 1, now);
    }
    let mut buffer = vec![0; width as usize * height as usize];
    canvas.present(&mut buffer);
    write_png(path, &to_image(&buffer, width, height))
}
