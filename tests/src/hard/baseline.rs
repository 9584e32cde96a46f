//! What the hard scenes reached when it was last looked at: a file in `fixtures`, written by the table `hard`, held against by its tests.

use super::Figures;
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// How much worse a figure may be: dB, and percent of wrong pixels.
pub const SLACK: f64 = 0.1;
/// What writes the file anew.
pub const COMMAND: &str = "cargo run --release -p cubist-tests --bin table -- hard --update";

/// The figures of every case, by name.
pub type Baseline = BTreeMap<String, Figures>;

/// Where the file is.
#[must_use]
pub fn file() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", "fixtures", "hard.json"].iter().collect()
}

/// Reads the file.
///
/// # Errors
/// It is not there or holds something else.
pub fn read() -> Result<Baseline> {
    let (path, how) = (file(), || format!("make it with: {COMMAND}"));
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string()).with_context(how)?;
    serde_json::from_str(&text).with_context(|| path.display().to_string()).with_context(how)
}

/// Writes the file, figures to a thousandth.
///
/// # Errors
/// The system's.
pub fn write(baseline: &Baseline) -> Result<()> {
    let round = |x: f64| (x * 1000.0).round() / 1000.0;
    let rounded: Baseline = baseline
        .iter()
        .map(|(name, of)| {
            let figures = Figures {
                psnr_mean: round(of.psnr_mean),
                psnr_min: round(of.psnr_min),
                psnr_worst_cell: round(of.psnr_worst_cell),
                wrong_surface_percent: round(of.wrong_surface_percent),
                position_error_texels: round(of.position_error_texels),
            };
            (name.clone(), figures)
        })
        .collect();
    std::fs::write(file(), serde_json::to_string_pretty(&rounded)? + "\n").with_context(|| file().display().to_string())
}

/// What of `now` is worse than `before` by more than [`SLACK`], in words; empty where all is well.
#[must_use]
pub fn worse(now: &Figures, before: &Figures) -> Vec<String> {
    let pairs = [
        ("mean PSNR", before.psnr_mean - now.psnr_mean, before.psnr_mean, now.psnr_mean),
        ("PSNR of the worst frame", before.psnr_min - now.psnr_min, before.psnr_min, now.psnr_min),
        ("PSNR of the worst cell", before.psnr_worst_cell - now.psnr_worst_cell, before.psnr_worst_cell, now.psnr_worst_cell),
        (
            "wrong pixels, percent",
            now.wrong_surface_percent - before.wrong_surface_percent,
            before.wrong_surface_percent,
            now.wrong_surface_percent,
        ),
    ];
    let faults = pairs.into_iter().filter(|(_, loss, ..)| *loss > SLACK);
    faults.map(|(what, _, before, now)| format!("{what}: {now:.3}, was {before:.3}; if that is meant: {COMMAND}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_of_a_decibel_passes_and_more_does_not() {
        let before =
            Figures { psnr_mean: 30.0, psnr_min: 25.0, psnr_worst_cell: 12.0, wrong_surface_percent: 1.0, position_error_texels: 1.0 };
        assert!(worse(&Figures { psnr_mean: 29.91, psnr_min: 40.0, ..before }, &before).is_empty());
        for bad in [
            Figures { psnr_mean: 29.89, ..before },
            Figures { psnr_min: 24.8, ..before },
            Figures { psnr_worst_cell: 11.8, ..before },
            Figures { wrong_surface_percent: 1.2, ..before },
        ] {
            assert_eq!(worse(&bad, &before).len(), 1, "{bad:?}");
        }
    }
}
