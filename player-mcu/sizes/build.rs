//! Hands `memory.x` to the linker.

#[path = "../link.rs"]
mod link;

fn main() -> std::io::Result<()> {
    link::memory()?;
    Ok(())
}
