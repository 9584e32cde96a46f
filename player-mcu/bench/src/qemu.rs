//! Runs a firmware in QEMU: lines of JSON come out of it by semihosting, and at the end its memory is read for how far the painted
//! stack was used. What it printed goes to `figures`.

use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

/// What cortex-m-rt paints the stack with.
const PAINT: [u8; 4] = [0xcc; 4];
/// The end of the RAM in the firmware's `memory.x`: where its stack starts.
const STACK_END: u64 = 0x2040_0000;
/// How much of it is read.
const STACK_READ: usize = 64 << 10;
/// The longest a firmware may run, seconds.
const PATIENCE: &str = "900";

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
    let stack = scratch.join("stack");
    let mut emulator = Command::new("timeout")
        .args([PATIENCE, "qemu-system-arm"])
        .args(["-M", "mps2-an386", "-display", "none", "-serial", "none", "-monitor", "stdio", "-icount", "shift=7"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(firmware)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .context("timeout and qemu-system-arm do not start; apt-get install coreutils qemu-system-arm")?;
    let mut frames: Vec<FrameLine> = Vec::new();
    let mut said = BufReader::new(emulator.stdout.take().context("the emulator has an output")?).lines();
    let last: LastLine = loop {
        let line = said.next().with_context(|| format!("{}: stops after {} frames", firmware.display(), frames.len()))??;
        // The monitor's prompt stands before the first.
        let Some(json) = line.find('{').and_then(|at| line.get(at..)) else { continue };
        if json.contains("\"memory_bytes\"") {
            break serde_json::from_str(json)?;
        }
        let frame = serde_json::from_str(json);
        frames.push(frame.with_context(|| format!("{}: after {} frames: {json}", firmware.display(), frames.len()))?);
    };
    let mut monitor = emulator.stdin.take().context("the emulator has a monitor")?;
    writeln!(monitor, "stop\npmemsave {:#x} {STACK_READ} \"{}\"\nquit", STACK_END - STACK_READ as u64, stack.display())?;
    monitor.flush()?;
    emulator.wait()?;
    let stack = fs::read(&stack)?;
    ensure!(stack.len() == STACK_READ, "{}: the emulator did not hand out the stack", firmware.display());
    // Down from the first word that is not painted; the stack grows downwards.
    let unused = stack.chunks(4).take_while(|&word| word == PAINT).count() * 4;
    ensure!(unused > 0, "{}: more than {STACK_READ} bytes of stack", firmware.display());
    let LastLine { memory_bytes, player_bytes } = last;
    Ok(Played { frames, memory_bytes, player_bytes, stack_peak_bytes: (STACK_READ - unused) as u64 })
}
