//! The table of hard scenes: what each reaches, and whether that is less than it was.
//! Scenes and the baseline come from `crate::hard`; the table goes back.

use super::{Table, markdown, number};
use crate::hard::baseline::{self, Baseline};
use crate::hard::{CASES, Figures, measure};
use anyhow::{Context, Result};
use rayon::prelude::*;
use serde_json::{Value, json};

/// The columns: the key in JSON, the title, digits after the point; the first two are words.
const COLUMNS: [(&str, &str, usize); 7] = [
    ("scene", "scene", 0),
    ("why", "hard because", 0),
    ("psnr_mean", "PSNR mean", 2),
    ("psnr_min", "PSNR min", 2),
    ("psnr_worst_cell", "worst cell", 2),
    ("wrong_surface_percent", "wrong %", 3),
    ("position_error_texels", "farthest off, texels", 2),
];

/// The figures of all hard scenes.
///
/// # Errors
/// The baker's, with the scene's name.
pub fn measure_all() -> Result<Baseline> {
    let of = |case: &crate::hard::Case| -> Result<(String, Figures)> {
        let baked = case.baked()?;
        let figures = measure(&baked.encoded.bundle, &baked.flat.atlas).with_context(|| format!("play {}", case.name))?;
        Ok((case.name.to_owned(), figures))
    };
    CASES.par_iter().map(of).collect()
}

/// What is worse than in the baseline, a line for each.
#[must_use]
pub fn regressions(now: &Baseline, before: &Baseline) -> Vec<String> {
    let lines = now.iter().flat_map(|(name, now)| {
        match before.get(name) {
            Some(before) => baseline::worse(now, before),
            None => vec![format!("not in {}; make it with: {}", baseline::file().display(), baseline::COMMAND)],
        }
        .into_iter()
        .map(move |line| format!("{name}: {line}"))
    });
    lines.collect()
}

/// The table, in the order of the cases.
///
/// # Errors
/// A figure has no number.
pub fn table(figures: &Baseline) -> Result<Table> {
    let mut rows = Vec::new();
    for case in &CASES {
        let Some(of) = figures.get(case.name) else { continue };
        let mut row = serde_json::to_value(of)?;
        (row["scene"], row["why"]) = (json!(case.name.replace('_', " ")), json!(case.why));
        rows.push(row);
    }
    let cell = |row: &Value, key: &str, digits: usize| row[key].as_str().map_or_else(|| number(&row[key], digits), str::to_owned);
    let lines: Vec<Vec<String>> = rows.iter().map(|row| COLUMNS.iter().map(|&(key, _, digits)| cell(row, key, digits)).collect()).collect();
    Ok(Table { markdown: markdown(&COLUMNS.map(|column| column.1), 2, &lines), json: Value::from(rows) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_got_worse_is_named() {
        let good =
            Figures { psnr_mean: 30.0, psnr_min: 25.0, psnr_worst_cell: 12.0, wrong_surface_percent: 1.0, position_error_texels: 1.0 };
        let before = Baseline::from([("town".to_owned(), good)]);
        assert!(regressions(&before, &before).is_empty());
        let now = Baseline::from([("town".to_owned(), Figures { psnr_min: 24.0, ..good }), ("new".to_owned(), good)]);
        let lines = regressions(&now, &before);
        assert!(
            lines.len() == 2 && lines[0].starts_with("new: not in ") && lines[1].starts_with("town: PSNR of the worst frame"),
            "{lines:?}"
        );
        let table = table(&before).unwrap();
        assert!(table.markdown.contains("| town | nothing is hard"), "{}", table.markdown);
        assert_eq!(table.json[0]["psnr_mean"], 30.0);
    }
}
