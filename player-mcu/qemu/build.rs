//! Hands `memory.x` to the linker, and the bundle that CUBIST_BUNDLE names to the compiler: it is linked in, as it would lie in flash. The player is
//! one of what its texels are.

#[path = "../bundle.rs"]
mod bundle;
#[path = "../link.rs"]
mod link;

use cubist_core::format::TexelKind;

fn main() -> std::io::Result<()> {
    println!("cargo:rustc-check-cfg=cfg(texels, values(\"4\", \"565\"))");
    // Without a bundle the firmware builds all the same, and says what is wrong when it runs.
    match bundle::copy(&link::memory()?)? {
        Some(TexelKind::Indexed4) => println!("cargo:rustc-cfg=texels=\"4\""),
        Some(TexelKind::Direct565) => println!("cargo:rustc-cfg=texels=\"565\""),
        Some(TexelKind::Indexed8) | None => {}
    }
    Ok(())
}
