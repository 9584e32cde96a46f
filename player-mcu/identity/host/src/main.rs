//! `cubist-identical GOLDENS BUNDLES TARGET=OUTPUT...`: plays every bundle of the folder BUNDLES on the host, and holds against it the goldens of
//! the folder GOLDENS (the frames that these name) and every frame that each target's player printed into its OUTPUT. Prints a table; exit
//! code 1 says that a frame differs or is missing. `identical` calls it.

mod sums;

use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};
use sums::{Found, Frames, compare};

fn main() -> Result<ExitCode> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [goldens, bundles, targets @ ..] = arguments.as_slice() else {
        bail!("usage: cubist-identical GOLDENS BUNDLES TARGET=OUTPUT...");
    };
    let host = env!("HOST").split('-').next().unwrap_or_default();
    let targets = targets.iter().map(|target| output(target)).collect::<Result<Vec<_>>>()?;
    let names = targets.iter().map(|(name, _)| name.as_str());
    println!("golden: frames of the golden as {host} plays them; then frames of each target as {host} plays them");
    println!("{}", line("scene", &["golden"].into_iter().chain(names).map(str::to_owned).collect::<Vec<_>>()));
    let mut identical = true;
    for file in files(Path::new(bundles))? {
        let scene = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let played = play(&file)?;
        let golden = sums::golden(&Path::new(goldens).join(format!("{scene}.json")))?;
        ensure!(!golden.is_empty(), "{scene}: its golden names no frame");
        let mut cells = Vec::new();
        let mut cell = |name: &str, expected: &Frames, found: Option<&Frames>| {
            let Found { same, faults } = compare(expected, found);
            faults.iter().for_each(|fault| eprintln!("{scene} on {name}: {fault}"));
            identical &= faults.is_empty();
            cells.push(format!("{same}/{}", expected.len()));
        };
        let shown = golden.keys().filter_map(|&frame| Some((frame, *played.get(&frame)?))).collect();
        cell(host, &golden, Some(&shown));
        for (name, scenes) in &targets {
            cell(name, &played, scenes.get(&scene));
        }
        println!("{}", line(&scene, &cells));
    }
    println!("{}", if identical { "identical: every frame of every scene on every target" } else { "NOT identical" });
    Ok(if identical { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// A line of the table.
fn line(scene: &str, cells: &[String]) -> String {
    cells.iter().fold(format!("{scene:<16}"), |line, cell| line + &format!("{cell:>12}"))
}

/// What `TARGET=OUTPUT` names.
fn output(target: &str) -> Result<(String, sums::Scenes)> {
    let (name, file) = target.split_once('=').with_context(|| format!("{target}: expected TARGET=OUTPUT"))?;
    let text = fs::read_to_string(file).with_context(|| file.to_owned())?;
    Ok((name.to_owned(), sums::scenes(&text).with_context(|| file.to_owned())?))
}

/// The bundles of `folder`, by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let place = || folder.display().to_string();
    let entries = fs::read_dir(folder).with_context(place)?.collect::<Result<Vec<_>, _>>().with_context(place)?;
    let mut files: Vec<PathBuf> =
        entries.into_iter().map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "cubist")).collect();
    files.sort();
    ensure!(!files.is_empty(), "{}: no *.cubist in it", place());
    Ok(files)
}

/// The checksum of every frame of the bundle in `file`.
fn play(file: &Path) -> Result<Frames> {
    let bytes = fs::read(file).with_context(|| file.display().to_string())?;
    let (mut memory, mut picture) = (vec![0; cubist_identity::MEMORY_ROOM], vec![0; cubist_identity::PICTURE_ROOM]);
    let mut frames = Frames::new();
    let played = cubist_identity::play(&bytes, &mut memory, &mut picture, |frame, sum| {
        frames.insert(frame, sum);
    });
    played.map_err(|trouble| anyhow::anyhow!("{}: {trouble}", file.display()))?;
    Ok(frames)
}
