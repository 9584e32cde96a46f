//! Hands the target's memories to the linker, as the `memory.x` that the `link.x` of cortex-m-rt and riscv-rt asks for.

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let arm = std::env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "arm");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    std::fs::copy(if arm { "arm.x" } else { "riscv.x" }, out.join("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    for file in ["arm.x", "riscv.x"] {
        println!("cargo:rerun-if-changed={file}");
    }
    Ok(())
}
