//! Tables in README.md: they stand between two marks, and are put there by what measures. `peers/host` does so too.

use anyhow::{Context, Result};
use std::fs;
use std::path::Path;

/// Puts `table` between two marks in `readme`.
///
/// # Errors
/// A file that cannot be read or written, or has no marks.
pub fn put(readme: &Path, [begin, end]: [&str; 2], table: &str) -> Result<()> {
    let text = fs::read_to_string(readme).with_context(|| readme.display().to_string())?;
    let (before, rest) = text.split_once(begin).with_context(|| format!("{}: no line {begin}", readme.display()))?;
    let (_, after) = rest.split_once(end).with_context(|| format!("{}: no line {end}", readme.display()))?;
    fs::write(readme, format!("{before}{begin}\n{table}\n{end}{after}")).with_context(|| readme.display().to_string())
}
