//! Runs a peer in QEMU: lines of JSON come out of it by semihosting, and at the end its memory is read for how far the painted stack was used.
//! What it printed goes to `figures`.

use anyhow::{Context, Result, bail, ensure};
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
const STACK_READ: usize = 128 << 10;
/// The longest a firmware may run, seconds.
const PATIENCE: &str = "300";

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
    let stack = firmware.with_extension("stack");
    let mut emulator = Command::new("timeout")
        .args([PATIENCE, "qemu-system-arm"])
        .args(["-M", "mps2-an386", "-display", "none", "-serial", "none", "-monitor", "stdio", "-icount", "shift=7"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(firmware)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .context("timeout and qemu-system-arm do not start; apt-get install coreutils qemu-system-arm")?;
    let mut frames = Vec::new();
    let mut said = BufReader::new(emulator.stdout.take().context("the emulator has an output")?).lines();
    let (asked, arena) = loop {
        let line = said.next().with_context(|| format!("{}: stops after {} frames", firmware.display(), frames.len()))??;
        // The monitor's prompt stands before the first.
        let Some(json) = line.find('{').and_then(|at| line.get(at..)) else { continue };
        match serde_json::from_str(json).with_context(|| format!("{}: after {} frames: {json}", firmware.display(), frames.len()))? {
            Line::Frame { instructions, sum } => frames.push((instructions, sum)),
            Line::Last { asked, arena } => break (asked, arena),
            Line::Error { error } => bail!("{}: after {} frames: {error}", firmware.display(), frames.len()),
        }
    };
    let mut monitor = emulator.stdin.take().context("the emulator has a monitor")?;
    writeln!(monitor, "stop\npmemsave {:#x} {STACK_READ} \"{}\"\nquit", STACK_END - STACK_READ as u64, stack.display())?;
    monitor.flush()?;
    emulator.wait()?;
    let stack = fs::read(&stack).with_context(|| stack.display().to_string())?;
    ensure!(stack.len() == STACK_READ, "{}: the emulator did not hand out the stack", firmware.display());
    // Down from the first word that is not painted; the stack grows downwards.
    let unused = stack.chunks(4).take_while(|&word| word == PAINT).count() * 4;
    ensure!(unused > 0, "{}: more than {STACK_READ} bytes of stack", firmware.display());
    Ok(Played { frames, asked, arena, stack_peak_bytes: (STACK_READ - unused) as u64 })
}
