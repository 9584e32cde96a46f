//! The player's firmware in QEMU: what it prints of every frame. `emulated` runs it; the lines go to `figures`.

use crate::emulated::{self, Bounds};
use anyhow::Result;
use serde::Deserialize;
use std::path::Path;

/// What the firmware may take.
const BOUNDS: Bounds = Bounds { seconds: 900, stack: 64 << 10 };

/// A frame, as the firmware prints it: instructions and counts.
#[derive(Debug, Deserialize)]
pub struct FrameLine {
    pub frame: u32,
    pub instructions: u64,
    pub seek: u64,
    pub loading: u64,
    pub rows: u64,
    pub smooth_pixels: u64,
    pub torn_pixels: u64,
    pub smooth_smooth: u64,
    pub smooth_torn: u64,
    pub torn_torn: u64,
    pub smooth_cost: u64,
    pub torn_cost: u64,
    pub checksum: u32,
}

/// The firmware's last line.
#[derive(Debug, Deserialize)]
struct LastLine {
    memory_bytes: u64,
    player_bytes: u64,
}

/// A whole run.
#[derive(Debug)]
pub struct Played {
    pub frames: Vec<FrameLine>,
    pub memory_bytes: u64,
    pub player_bytes: u64,
    pub stack_peak_bytes: u64,
}

/// Plays `firmware` to its end; `scratch` is a folder for the emulator's files.
///
/// # Errors
/// No emulator, a firmware that fails, prints nonsense or takes too long.
pub fn play(firmware: &Path, scratch: &Path) -> Result<Played> {
    let mut frames = Vec::new();
    let (last, stack_peak_bytes) = emulated::run(firmware, &scratch.join("stack"), BOUNDS, |json| {
        if json.contains("\"memory_bytes\"") {
            return Ok(Some(serde_json::from_str(json)?));
        }
        frames.push(serde_json::from_str(json)?);
        Ok(None)
    })?;
    let LastLine { memory_bytes, player_bytes } = last;
    Ok(Played { frames, memory_bytes, player_bytes, stack_peak_bytes })
}
