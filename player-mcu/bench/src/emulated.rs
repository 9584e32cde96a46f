//! A firmware in QEMU: lines of JSON come out of it by semihosting, and at the end its memory is read for how far the painted stack was used. What the lines
//! mean is for `qemu` to say; `peers/host` has one of its own, and uses this file too.

use anyhow::{Context, Result, ensure};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

/// What cortex-m-rt paints the stack with.
const PAINT: [u8; 4] = [0xcc; 4];
/// The end of the RAM in the firmwares' `memory.x`: where their stacks start.
const STACK_END: u64 = 0x2040_0000;

/// What a firmware may take.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Seconds.
    pub seconds: u32,
    /// Bytes of stack.
    pub stack: usize,
}

/// Runs `firmware` until `hear`, which gets each line that it prints, has all that is to come of them; returns that, and the bytes of stack used. `stack` is
/// a file for the emulator to write.
///
/// # Errors
/// No emulator, a firmware that stops early or goes beyond its `bounds`; those of `hear`.
pub fn run<T>(firmware: &Path, stack: &Path, bounds: Bounds, mut hear: impl FnMut(&str) -> Result<Option<T>>) -> Result<(T, u64)> {
    let mut emulator = Command::new("timeout")
        .args([&bounds.seconds.to_string(), "qemu-system-arm"])
        .args(["-M", "mps2-an386", "-display", "none", "-serial", "none", "-monitor", "stdio", "-icount", "shift=7"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(firmware)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .context("timeout and qemu-system-arm do not start; apt-get install coreutils qemu-system-arm")?;
    let mut said = BufReader::new(emulator.stdout.take().context("the emulator has an output")?).lines();
    let mut frames = 0;
    let heard = loop {
        let line = said.next().with_context(|| format!("{}: stops after {frames} frames", firmware.display()))??;
        // The monitor's prompt stands before the first.
        let Some(json) = line.find('{').and_then(|at| line.get(at..)) else { continue };
        if let Some(heard) = hear(json).with_context(|| format!("{}: after {frames} frames: {json}", firmware.display()))? {
            break heard;
        }
        frames += 1;
    };
    let mut monitor = emulator.stdin.take().context("the emulator has a monitor")?;
    writeln!(monitor, "stop\npmemsave {:#x} {} \"{}\"\nquit", STACK_END - bounds.stack as u64, bounds.stack, stack.display())?;
    monitor.flush()?;
    emulator.wait()?;
    let stack = fs::read(stack).with_context(|| stack.display().to_string())?;
    ensure!(stack.len() == bounds.stack, "{}: the emulator did not hand out the stack", firmware.display());
    // Down from the first word that is not painted; the stack grows downwards.
    let unused = stack.chunks(4).take_while(|&word| word == PAINT).count() * 4;
    ensure!(unused > 0, "{}: more than {} bytes of stack", firmware.display(), bounds.stack);
    Ok((heard, (bounds.stack - unused) as u64))
}
