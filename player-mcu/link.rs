//! What the build scripts of all firmware share: the crate's `memory.x` goes to the linker, by way of cortex-m-rt's `link.x`.

use std::path::PathBuf;

/// Hands over `memory.x`; the folder for what else the script makes comes back.
pub fn memory() -> std::io::Result<PathBuf> {
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    std::fs::copy("memory.x", out.join("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rerun-if-changed=memory.x");
    Ok(out)
}
