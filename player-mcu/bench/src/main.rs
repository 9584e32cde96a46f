//! `cubist-mcu TARGET SCENE FIRMWARE BUNDLE CODE_BYTES RESULTS README`: plays a firmware in its emulator, holds every frame's pixels against the
//! host's, and puts the figures into RESULTS (JSON: target, then scene) and the table of README. `run` calls it for each.

mod figures;
mod host;
mod qemu;

use anyhow::{Context, Result, bail};
use figures::Results;
use std::path::Path;
use std::{env, fs};

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [target, scene, firmware, bundle, code, results, readme] = arguments.as_slice() else {
        bail!("usage: cubist-mcu TARGET SCENE FIRMWARE BUNDLE CODE_BYTES RESULTS README");
    };
    let scratch = env::temp_dir().join(format!("cubist-mcu-{}", std::process::id()));
    fs::create_dir_all(&scratch)?;
    let played = qemu::play(Path::new(firmware), &scratch);
    fs::remove_dir_all(&scratch)?;
    let found = host::play(Path::new(bundle)).and_then(|expected| figures::figures(&played?, &expected, code.parse()?));
    let found = found.with_context(|| format!("{scene} on {target}"))?;
    println!(
        "{target:<14} {scene:<12} {:6.2} instructions a pixel, worst {:.2} of the mean: keys {:.2}, loading {:.2}, drawing {:.2} (smooth {:.2}, torn {:.2} at {:.1} %); stack {}",
        found.instructions_per_pixel_mean,
        found.worst_over_mean,
        found.key_decoding_instructions_per_pixel,
        found.loading_instructions_per_pixel,
        found.drawing_instructions_per_pixel,
        found.smooth_instructions_per_smooth_pixel,
        found.torn_instructions_per_torn_pixel,
        found.torn_percent,
        found.stack_peak_bytes,
    );
    let mut all: Results = match fs::read(results) {
        Ok(text) => serde_json::from_slice(&text).with_context(|| results.clone())?,
        Err(_) => Results::new(),
    };
    all.entry(target.clone()).or_default().insert(scene.clone(), found);
    fs::write(results, serde_json::to_string_pretty(&all)? + "\n").with_context(|| results.clone())?;
    figures::write_table(Path::new(readme), &all)
}
