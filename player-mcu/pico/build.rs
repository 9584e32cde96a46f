//! Hands the linker `memory.x` and the boot loader's second stage, and the compiler two bundles: the test card, and the one that CUBIST_BUNDLE
//! names, if it does: that one is linked in, and plays whatever lies in flash.

#[path = "../bundle.rs"]
mod bundle;
#[path = "../link.rs"]
mod link;

use std::fmt::Write;

/// Sets up the flash as it is on a Pico, before anything else runs.
const BOOT2: &[u8; 256] = &rp2040_boot2::BOOT_LOADER_W25Q080;

fn main() -> std::io::Result<()> {
    let out = link::memory()?;
    // Words of a linker script, so that no static of the firmware needs a section of its own.
    let mut script = std::fs::read_to_string("memory.x")? + "SECTIONS {\n  .boot2 ORIGIN(BOOT2) : {\n";
    for word in BOOT2.as_chunks::<4>().0 {
        let _written = writeln!(script, "    LONG({:#010x})", u32::from_le_bytes(*word));
    }
    std::fs::write(out.join("memory.x"), script + "  } > BOOT2\n} INSERT BEFORE .text;\n")?;
    bundle::copy(&out)?;
    Ok(())
}
