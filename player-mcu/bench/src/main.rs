//! What `run` calls:
//!
//! `cubist-mcu TARGET SCENE FIRMWARE BUNDLE CODE_BYTES RESULTS README` plays a firmware in QEMU, holds every frame's pixels against the host's, and
//! puts the figures into RESULTS (JSON: target, then scene) and the tables of README.
//! `cubist-mcu rp2040 SCENE FIRMWARE BUNDLE CODE_BYTES RAM_BYTES DISPLAY EMULATOR RESULTS README` does the same with a Pico's.
//! `cubist-mcu rows KIND TARGET SCENE FIRMWARE BUNDLE CODE_BYTES RESULTS README` does it with a firmware that draws its rows in another way.
//! `cubist-mcu sizes TARGET README NAME:SPEED:SIZE...` puts the sizes of the least player and of effects into the table of README.
//! Figures above what `limits.json` allows are errors, once they are written.
//! `cubist-mcu frames BUNDLE OUT` writes the host's frames, for the emulator, and prints their size.
//! `cubist-mcu card WIDTHxHEIGHT OUT` writes the test card's scene, for the baker, into the folder OUT.

mod card;
mod emulated;
mod figures;
mod font;
mod host;
mod limits;
mod pico;
mod qemu;
mod sizes;
mod table;

use anyhow::{Context, Result, bail};
use figures::{Measured, Results};
use std::path::Path;
use std::{env, fs};

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match *arguments.as_slice() {
        ["frames", bundle, out] => println!("{}", pico::write_frames(Path::new(bundle), Path::new(out))?),
        ["card", size, out] => card::write(size, Path::new(out))?,
        ["rp2040", scene, firmware, bundle, code, ram, display, emulator, results, readme] => {
            let found = with_scratch(|scratch| {
                let run = pico::Run {
                    firmware: Path::new(firmware),
                    display,
                    bundle: Path::new(bundle),
                    emulator: Path::new(emulator),
                    code_bytes: code.parse()?,
                    static_ram_bytes: ram.parse()?,
                };
                pico::play(&run, scratch)
            });
            let found = found.with_context(|| format!("{scene} on rp2040 with {display}"))?;
            println!(
                "{:<14} {scene:<18} {:6.2} cycles a pixel, worst {:.2} of the mean; {} frames on {} identical to the host's",
                "rp2040", found.cycles_per_pixel_mean, found.worst_over_mean, found.frames_identical_to_host, found.display,
            );
            write("rp2040", scene, Measured::Cycles(found), results, readme)?;
        }
        ["sizes", target, readme, ref programs @ ..] => sizes::tell(Path::new("limits.json"), target, Path::new(readme), programs)?,
        [target, scene, firmware, bundle, code, results, readme] => {
            let played = with_scratch(|scratch| qemu::play(Path::new(firmware), scratch));
            let expected = host::play(Path::new(bundle), |player, y, out| player.row(y, out));
            let found = expected.and_then(|expected| figures::figures(&played?, &expected, code.parse()?));
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
            write(target, scene, Measured::Instructions(found), results, readme)?;
        }
        ["rows", kind, target, scene, firmware, bundle, code, results, readme] => {
            let played = with_scratch(|scratch| qemu::play(Path::new(firmware), scratch));
            let expected = host::way(kind).and_then(|row| host::play(Path::new(bundle), row));
            let found = expected.and_then(|expected| figures::figures(&played?, &expected, code.parse()?));
            let found = found.with_context(|| format!("{scene} on {target}, {kind} rows"))?;
            println!("{target:<14} {scene:<12} {:6.2} instructions a pixel, {kind} rows", found.instructions_per_pixel_mean);
            let mut all = read(results)?;
            let scenes = all.get_mut(target).and_then(|scenes| scenes.get_mut(scene));
            let Some(Measured::Instructions(plain)) = scenes else { bail!("{results}: {scene} is to be played on {target} first") };
            let rows = figures::OtherRows::from(&found);
            let checked = limits::check(Path::new("limits.json"), target, &format!("{scene}, {kind} rows"), &rows);
            plain.other_rows.insert(kind.to_owned(), rows);
            write_all(&all, results, readme)?;
            checked?;
        }
        _ => bail!(
            "usage: cubist-mcu TARGET SCENE FIRMWARE BUNDLE CODE_BYTES RESULTS README\n       cubist-mcu rp2040 SCENE FIRMWARE BUNDLE CODE_BYTES RAM_BYTES DISPLAY EMULATOR RESULTS README\n       cubist-mcu rows KIND TARGET SCENE FIRMWARE BUNDLE CODE_BYTES RESULTS README\n       cubist-mcu sizes TARGET README NAME:SPEED:SIZE...\n       cubist-mcu frames BUNDLE OUT\n       cubist-mcu card WIDTHxHEIGHT OUT"
        ),
    }
    Ok(())
}

/// Runs `task` with a folder that is gone afterwards.
fn with_scratch<T>(task: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    let scratch = env::temp_dir().join(format!("cubist-mcu-{}", std::process::id()));
    fs::create_dir_all(&scratch)?;
    let done = task(&scratch);
    fs::remove_dir_all(&scratch)?;
    done
}

/// Puts `measured` in the place of what RESULTS and README have.
fn write(target: &str, scene: &str, measured: Measured, results: &str, readme: &str) -> Result<()> {
    let mut all = read(results)?;
    let checked = limits::check(Path::new("limits.json"), target, scene, &measured);
    all.entry(target.to_owned()).or_default().insert(scene.to_owned(), measured);
    write_all(&all, results, readme)?;
    checked
}

/// What RESULTS has; nothing where there is no such file.
fn read(results: &str) -> Result<Results> {
    match fs::read(results) {
        Ok(text) => serde_json::from_slice(&text).with_context(|| results.to_owned()),
        Err(_) => Ok(Results::new()),
    }
}

/// Writes RESULTS and README's tables.
fn write_all(all: &Results, results: &str, readme: &str) -> Result<()> {
    fs::write(results, serde_json::to_string_pretty(all)? + "\n").with_context(|| results.to_owned())?;
    figures::write_table(Path::new(readme), all)
}
