//! A peer in QEMU: what it prints of every frame. `emulated` runs it; the lines go to `figures`.

use crate::emulated::{self, Bounds};
use anyhow::{Result, bail};
use serde::Deserialize;
use std::path::Path;

/// What a firmware may take.
const BOUNDS: Bounds = Bounds { seconds: 300, stack: 128 << 10 };

/// What a firmware prints.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Line {
    Frame { instructions: u64, sum: u32 },
    Last { asked: u64, arena: u64 },
    Error { error: String },
}

/// A whole run.
#[derive(Debug)]
pub struct Played {
    /// Instructions and sum of every frame.
    pub frames: Vec<(u64, u32)>,
    /// What the player asked for at run time, of a static arena.
    pub asked: u64,
    pub arena: u64,
    pub stack_peak_bytes: u64,
}

/// Plays `firmware` to its end.
///
/// # Errors
/// No emulator, a firmware that fails, prints nonsense or takes too long.
pub fn play(firmware: &Path) -> Result<Played> {
    let mut frames = Vec::new();
    let ((asked, arena), stack_peak_bytes) = emulated::run(firmware, &firmware.with_extension("stack"), BOUNDS, |json| {
        match serde_json::from_str(json)? {
            Line::Frame { instructions, sum } => frames.push((instructions, sum)),
            Line::Last { asked, arena } => return Ok(Some((asked, arena))),
            Line::Error { error } => bail!("{error}"),
        }
        Ok(None)
    })?;
    Ok(Played { frames, asked, arena, stack_peak_bytes })
}
