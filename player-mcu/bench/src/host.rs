//! The same bundle on the host: the checksums that every device's pixels must have.

use anyhow::{Context, Result};
use cubist_core::{Bundle, Frame, Player};
use std::fs;
use std::path::Path;

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
pub fn play(file: &Path) -> Result<Expected> {
    let place = || file.display().to_string();
    let bytes = fs::read(file).with_context(place)?;
    let bundle = Bundle::parse(&bytes).map_err(|error| anyhow::anyhow!("{}: {error}", place()))?;
    let mut memory = vec![0; bundle.memory_needed()];
    let mut player = Player::new(&bundle, &mut memory).map_err(|error| anyhow::anyhow!("{}: {error}", place()))?;
    let (width, height) = bundle.size();
    let mut row = vec![0; width as usize];
    let checksums = (0..bundle.frames()).map(|frame| {
        player.seek(Frame(frame));
        (0..height).fold(0x811c_9dc5, |sum: u32, y| {
            player.row(y, &mut row);
            row.iter().fold(sum, |sum, &pixel| (sum ^ u32::from(pixel)).wrapping_mul(0x0100_0193))
        })
    });
    Ok(Expected { pixels: u64::from(width * height), checksums: checksums.collect(), bytes: bytes.len() as u64 })
}
