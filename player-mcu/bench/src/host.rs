//! The same bundle on the host: the checksums that every device's pixels must have, or the pixels themselves. They go to `figures` and `pico`.

use anyhow::{Context, Result, bail};
use cubist_core::{AnyTexels, Bundle, Frame, Player};
use std::fs;
use std::path::Path;

/// One of the player's ways to draw a row.
pub type Row = for<'p, 'a, 'r> fn(&'p mut Player<'a, AnyTexels>, u32, &'r mut [u16]);

/// The way that rows of `kind` are drawn, as the firmware's features name them.
///
/// # Errors
/// There is no such kind.
pub fn way(kind: &str) -> Result<Row> {
    Ok(match kind {
        "dithered" => |player, y, out| player.dithered_row(y, out),
        "bilinear" | "bilinear-spread" => |player, y, out| player.bilinear_row(y, out),
        "smooth" => |player, y, out| player.smooth_row(y, out),
        "fine" | "fine-spread" => |player, y, out| player.fine_row(y, out),
        _ => bail!("{kind}: no kind of rows; dithered, bilinear, smooth and fine are, and bilinear-spread and fine-spread"),
    })
}

/// What a bundle is to its figures, and the checksum of every frame's pixels: FNV-1a, a pixel at a time.
#[derive(Debug)]
pub struct Expected {
    pub pixels: u64,
    pub bytes: u64,
    pub checksums: Vec<u32>,
}

/// Plays the bundle in `file`.
///
/// # Errors
/// A file that cannot be read, or is no bundle.
pub fn play(file: &Path, draw: Row) -> Result<Expected> {
    let mut checksums = Vec::new();
    let mut sum = 0;
    let (pixels, bytes) = rows(file, draw, |y, row| {
        if y == 0 {
            checksums.push(0);
            sum = 0x811c_9dc5;
        }
        sum = row.iter().fold(sum, |sum: u32, &pixel| (sum ^ u32::from(pixel)).wrapping_mul(0x0100_0193));
        checksums.last_mut().into_iter().for_each(|last| *last = sum);
    })?;
    Ok(Expected { pixels, checksums, bytes })
}

/// What a device shows of the bundle in `file`: width, height, and all frames as RGB565, little-endian, one after the other.
///
/// # Errors
/// Those of [`play`].
pub fn frames(file: &Path) -> Result<((u32, u32), Vec<u8>)> {
    let mut all = Vec::new();
    let mut width = 0;
    let mut height = 0;
    rows(
        file,
        |player, y, out| player.row(y, out),
        |y, row| {
            (width, height) = (row.len() as u32, height.max(y + 1));
            all.extend(row.iter().flat_map(|pixel| pixel.to_le_bytes()));
        },
    )?;
    Ok(((width, height), all))
}

/// Hands out every row of every frame of the bundle in `file`, with its number; the pixels of a frame come back, and the bytes of the bundle.
fn rows(file: &Path, draw: Row, mut take: impl FnMut(u32, &[u16])) -> Result<(u64, u64)> {
    let place = || file.display().to_string();
    let bytes = fs::read(file).with_context(place)?;
    let bundle = Bundle::parse(&bytes).map_err(|error| anyhow::anyhow!("{}: {error}", place()))?;
    let mut memory = vec![0; bundle.memory_needed()];
    let mut player = Player::<AnyTexels>::with_texels(&bundle, &mut memory).map_err(|error| anyhow::anyhow!("{}: {error}", place()))?;
    let (width, height) = bundle.size();
    let mut row = vec![0; width as usize];
    for frame in 0..bundle.frames() {
        player.seek(Frame(frame));
        for y in 0..height {
            draw(&mut player, y, &mut row);
            take(y, &row);
        }
    }
    Ok((u64::from(width * height), bytes.len() as u64))
}
