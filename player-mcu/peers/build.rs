//! Hands `memory.x` to the linker, and what is played to the compiler: the files of the folder that CUBIST_PEERS names are linked in, as
//! they would lie in flash.

#[path = "../link.rs"]
mod link;

use std::path::Path;

/// What the players play; `cubist-beside` makes them.
const FILES: [&str; 6] = ["frames.raw", "warp.raw", "scene.mesh", "clip.gif", "clip.mjpeg", "clip.cubist"];

fn main() -> std::io::Result<()> {
    let out = link::memory()?;
    println!("cargo:rerun-if-env-changed=CUBIST_PEERS");
    for file in FILES {
        // Without them the firmware builds all the same, and has nothing to play.
        let content = match std::env::var_os("CUBIST_PEERS") {
            Some(folder) => {
                let path = Path::new(&folder).join(file);
                println!("cargo:rerun-if-changed={}", path.display());
                std::fs::read(path)?
            }
            None => Vec::new(),
        };
        std::fs::write(out.join(file), content)?;
    }
    Ok(())
}
