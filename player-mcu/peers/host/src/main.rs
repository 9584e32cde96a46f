//! `cubist-beside make TRUTH MESH BUNDLE FRAMES FOLDER`: makes what the peers play of the antialiased frames in TRUTH (R, G, B; every so manieth
//! of FRAMES), of the triangles in MESH and of BUNDLE, and what they must show: into FOLDER.
//! `cubist-beside run TARGET PLAYER FIRMWARE CODE STATIC FOLDER RESULTS README`: plays a firmware in QEMU, holds its pixels against the host's, and
//! puts the figures into RESULTS and the table of README. CODE is its bytes of flash with what it plays, STATIC those of static memory.
//! `peers/run` calls both.

mod decode;
#[path = "../../../bench/src/emulated.rs"]
mod emulated;
mod figures;
mod make;
mod qemu;
#[path = "../../src/raster.rs"]
mod raster;
mod screen;
#[path = "../../../bench/src/table.rs"]
mod table;
#[path = "../../src/warp.rs"]
mod warp;

use anyhow::{Context, Result, bail};
use figures::{Expected, Results};
use std::path::Path;
use std::{env, fs};

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["make", truth, mesh, bundle, frames, folder] => {
            make::all([truth, mesh, bundle].map(Path::new), frames.parse()?, Path::new(folder))
        }
        ["run", target, player, firmware, code, fixed, folder, results, readme] => {
            let expected = Expected::read(Path::new(folder), player)?;
            let played = qemu::play(Path::new(firmware)).with_context(|| format!("{player} on {target}"))?;
            let found =
                figures::figures(&played, &expected, code.parse()?, fixed.parse()?).with_context(|| format!("{player} on {target}"))?;
            println!(
                "{target:<14} {player:<11} {:7.2} instructions a pixel; RAM {}, code {}, content {:.0} a frame{}",
                found.instructions_per_pixel_mean,
                found.ram_bytes,
                found.code_bytes,
                found.content_bytes_per_frame,
                figures::decibels(found.psnr_db)
            );
            let mut all: Results = match fs::read(results) {
                Ok(text) => serde_json::from_slice(&text).with_context(|| (*results).to_owned())?,
                Err(_) => Results::new(),
            };
            all.entry((*target).to_owned()).or_default().insert((*player).to_owned(), found);
            fs::write(results, serde_json::to_string_pretty(&all)? + "\n").with_context(|| (*results).to_owned())?;
            figures::write_table(Path::new(readme), &all)
        }
        _ => bail!(
            "usage: cubist-beside make TRUTH MESH BUNDLE FRAMES FOLDER | run TARGET PLAYER FIRMWARE CODE STATIC FOLDER RESULTS README"
        ),
    }
}
