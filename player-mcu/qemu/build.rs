//! Hands `memory.x` to the linker, and the bundle that CUBIST_BUNDLE names to the compiler: it is linked in, as it would lie in flash.

#[path = "../link.rs"]
mod link;

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let out = link::memory()?;
    println!("cargo:rerun-if-env-changed=CUBIST_BUNDLE");
    // Without a bundle the firmware builds all the same, and says what is wrong when it runs.
    let bundle = match std::env::var_os("CUBIST_BUNDLE") {
        Some(path) => {
            println!("cargo:rerun-if-changed={}", PathBuf::from(&path).display());
            std::fs::read(path)?
        }
        None => Vec::new(),
    };
    std::fs::write(out.join("bundle.cubist"), bundle)
}
