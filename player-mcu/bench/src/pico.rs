//! Runs the Pico's firmware in its emulator: `emulator/play.mjs` holds what the display shows against the host's frames, which are made here, and
//! prints a line of JSON for each. What it printed becomes figures.

use crate::figures::{PicoFigures, round};
use crate::host;
use anyhow::{Context, Result, anyhow, ensure};
use cubist_core::Bundle;
use serde::Deserialize;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// A frame, as the emulator prints it.
#[derive(Debug, Deserialize)]
struct FrameLine {
    frame: u32,
    mode: String,
    cycles: u64,
    wrong: u64,
}

/// The emulator's last line.
#[derive(Debug, Deserialize)]
struct LastLine {
    stack: u64,
}

/// A firmware, what it plays, and what is known of it.
#[derive(Debug)]
pub struct Run<'a> {
    /// The ELF.
    pub firmware: &'a Path,
    /// `st7789` or `ili9341`.
    pub display: &'a str,
    /// The bundle, which goes into flash.
    pub bundle: &'a Path,
    /// The folder with `play.mjs`.
    pub emulator: &'a Path,
    /// Bytes of code and constants.
    pub code_bytes: u64,
    /// Bytes of all statics.
    pub static_ram_bytes: u64,
}

/// Writes all frames of `bundle` to `file`, and returns the size of one as the emulator takes it.
///
/// # Errors
/// A bundle that is none, a file that cannot be written.
pub fn write_frames(bundle: &Path, file: &Path) -> Result<String> {
    let ((width, height), frames) = host::frames(bundle)?;
    fs::write(file, frames).with_context(|| file.display().to_string())?;
    Ok(format!("{width}x{height}"))
}

/// Plays stretches of the bundle; `scratch` is a folder for the host's frames.
///
/// # Errors
/// A pixel that is not the host's, no emulator, a firmware that does not get to the end.
pub fn play(run: &Run<'_>, scratch: &Path) -> Result<PicoFigures> {
    let file = scratch.join("frames");
    let size = write_frames(run.bundle, &file)?;
    let out = Command::new("node")
        .arg(run.emulator.join("play.mjs"))
        .arg("--firmware")
        .arg(run.firmware)
        .args(["--display", run.display, "--size", &size, "--frames"])
        .arg(&file)
        .arg("--bundle")
        .arg(run.bundle)
        .stdout(Stdio::piped())
        .spawn()
        .and_then(|emulator| emulator.wait_with_output())
        .context("node does not start; apt-get install nodejs")?;
    let said = String::from_utf8(out.stdout).context("the emulator's output")?;
    let lines: Vec<&str> = said.lines().collect();
    let (last, frames) = lines.split_last().with_context(|| format!("{}: the emulator says nothing", run.firmware.display()))?;
    ensure!(out.status.success(), "{}: other pixels than on the host, or no end:\n{said}", run.firmware.display());
    let frames: Vec<FrameLine> =
        frames.iter().map(|line| serde_json::from_str(line).with_context(|| (*line).to_owned())).collect::<Result<_>>()?;
    if let Some(line) = frames.iter().find(|line| line.wrong > 0) {
        return Err(anyhow!("frame {}: {} pixels other than on the host", line.frame, line.wrong));
    }
    let last: LastLine = serde_json::from_str(last).with_context(|| (*last).to_owned())?;
    // Seeks cost what keys they need; playing is what has a pace.
    let played: Vec<u64> = frames.iter().filter(|line| line.mode == "loop").map(|line| line.cycles).collect();
    let worst = played.iter().max().context("no frame was played in a loop")?;
    let mean = played.iter().sum::<u64>() as f64 / played.len() as f64;
    let bytes = fs::read(run.bundle)?;
    let bundle = Bundle::parse(&bytes).map_err(|error| anyhow!("{}: {error}", run.bundle.display()))?;
    let (width, height) = bundle.size();
    Ok(PicoFigures {
        cycles_per_pixel_mean: round(mean / f64::from(width * height)),
        worst_over_mean: round(*worst as f64 / mean),
        display: format!("{} {size}", run.display),
        code_bytes: run.code_bytes,
        static_ram_bytes: run.static_ram_bytes,
        stack_peak_bytes: last.stack,
        working_memory_bytes: bundle.memory_needed() as u64,
        bundle_bytes: bytes.len() as u64,
        frames: frames.len() as u64,
        frames_identical_to_host: frames.len() as u64,
    })
}
