//! What figures may not exceed: `limits.json` has, for a target and a scene, the largest that some of their figures may be. A change that makes
//! any of them worse fails in `run`, and so in CI; one that makes them better should lower them.

use anyhow::{Context, Result, ensure};
use serde::Serialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Target, then scene, then figure.
type Limits = BTreeMap<String, BTreeMap<String, Map<String, Value>>>;

/// Holds what was measured of `scene` on `target` against the limits in `file`.
///
/// # Errors
/// A figure above its limit, or a limit of something that is none.
pub fn check(file: &Path, target: &str, scene: &str, measured: &impl Serialize) -> Result<()> {
    let place = || file.display().to_string();
    let limits: Limits = serde_json::from_slice(&fs::read(file).with_context(place)?).with_context(place)?;
    let figures = serde_json::to_value(measured)?;
    for (name, limit) in limits.get(target).and_then(|scenes| scenes.get(scene)).into_iter().flatten() {
        let nothing = || format!("{}: {target}, {scene}: {name} is no figure, or its limit no number", place());
        let (found, limit) = figures[name].as_f64().zip(limit.as_f64()).with_context(nothing)?;
        ensure!(
            found <= limit,
            "{name} is {found}; {} allows {limit} on {target}: make it smaller, or say there why it may be larger",
            place()
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::figures::{Measured, PicoFigures};

    #[test]
    fn figures_above_their_limits_are_refused() {
        let measured = Measured::Cycles(PicoFigures {
            cycles_per_pixel_mean: 95.5,
            worst_over_mean: 1.1,
            display: String::new(),
            code_bytes: 90_000,
            static_ram_bytes: 0,
            stack_peak_bytes: 0,
            working_memory_bytes: 0,
            bundle_bytes: 0,
            frames: 1,
            frames_identical_to_host: 1,
        });
        let file = std::env::temp_dir().join(format!("cubist-limits-{}.json", std::process::id()));
        let with = |limits: &str| {
            std::fs::write(&file, format!("{{\"rp2040\": {{\"street\": {limits}}}}}")).expect("a folder for temporary files");
            check(&file, "rp2040", "street", &measured)
        };
        with(r#"{"cycles_per_pixel_mean": 95.5, "code_bytes": 90000}"#).expect("at their limits");
        for (limits, named) in
            [(r#"{"cycles_per_pixel_mean": 95}"#, "cycles_per_pixel_mean is 95.5"), (r#"{"weight": 3}"#, "weight is no figure")]
        {
            let error = with(limits).expect_err("above").to_string();
            assert!(error.contains(named), "{error}");
        }
        check(&file, "rp2040", "columns", &measured).expect("nothing is said of it");
        std::fs::remove_file(&file).expect("it was written");
    }
}
