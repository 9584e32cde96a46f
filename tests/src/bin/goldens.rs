//! Makes the golden checksums anew: bakes and plays every built-in scene at the reduced setting, writes
//! `fixtures/golden/<scene>.json`, and says on stderr which of them changed.
//!
//! `goldens --bundles FOLDER` leaves these as they are and writes the bundles they are about instead: `FOLDER/<scene>.cubist`, which
//! `player-mcu/identical` plays on every target.

use anyhow::{Context, Result, bail};
use cubist_baker::scene::builtin;
use cubist_tests::golden;
use rayon::prelude::*;
use std::fs;
use std::path::Path;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [] => checksums(),
        ["--bundles", folder] => bundles(Path::new(folder)),
        _ => bail!("usage: goldens [--bundles FOLDER]"),
    }
}

fn checksums() -> Result<()> {
    for name in builtin::NAMES {
        let file = golden::file(name);
        let text = serde_json::to_string_pretty(&golden::checksums(name, &golden::bundle(name)?)?)? + "\n";
        let same = fs::read_to_string(&file).is_ok_and(|old| old == text);
        eprintln!("{name}: {}", if same { "as it was" } else { "new" });
        if let Some(folder) = file.parent() {
            fs::create_dir_all(folder).with_context(|| format!("make {}", folder.display()))?;
        }
        fs::write(&file, text).with_context(|| format!("write {}", file.display()))?;
    }
    Ok(())
}

fn bundles(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("make {}", folder.display()))?;
    builtin::NAMES.par_iter().try_for_each(|name| {
        let file = folder.join(format!("{name}.cubist"));
        fs::write(&file, golden::bundle(name)?).with_context(|| format!("write {}", file.display()))
    })
}
