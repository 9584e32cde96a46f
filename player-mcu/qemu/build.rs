//! Hands `memory.x` to the linker, and the bundle that CUBIST_BUNDLE names to the compiler: it is linked in, as it would lie in flash.

#[path = "../bundle.rs"]
mod bundle;
#[path = "../link.rs"]
mod link;

fn main() -> std::io::Result<()> {
    // Without a bundle the firmware builds all the same, and says what is wrong when it runs.
    bundle::copy(&link::memory()?)
}
