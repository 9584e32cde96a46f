//! What playback takes of flash: the least player, and what each effect adds to it. `sizes/run` links and measures them.

use crate::{limits, table};
use anyhow::{Context, Result};
use serde::Serialize;
use std::path::Path;

/// Bytes of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
struct Size {
    /// Compiled for speed.
    code_bytes: u64,
    /// Compiled for size.
    small_code_bytes: u64,
}

const BEGIN: &str = "<!-- sizes: written by sizes/run -->";
const END: &str = "<!-- end of sizes -->";

/// Holds the least player, the first of `programs` (NAME:SPEED:SIZE, bytes), against the limits in `file`; with others there are, puts them into the
/// table in `readme`.
///
/// # Errors
/// A program that is not told as above, one above its limit, a file that cannot be read or written.
pub fn tell(file: &Path, target: &str, readme: &Path, programs: &[&str]) -> Result<()> {
    let sizes = programs.iter().map(|program| parse(program).with_context(|| format!("{program}: not NAME:SPEED:SIZE")));
    let sizes = sizes.collect::<Result<Vec<_>>>()?;
    let [(name, least), effects @ ..] = sizes.as_slice() else { return Ok(()) };
    println!("{target:<14} {name}: {} bytes compiled for speed, {} for size", least.code_bytes, least.small_code_bytes);
    if !effects.is_empty() {
        let mut rows = format!(
            "\n| on {target} | for speed | for size |\n|---|---|---|\n| **{name}** | {} B | {} B |\n",
            least.code_bytes, least.small_code_bytes
        );
        let more = |size: u64, least: u64| format!("{:+} B", size as i64 - least as i64);
        for (effect, size) in effects {
            let (speed, small) = (more(size.code_bytes, least.code_bytes), more(size.small_code_bytes, least.small_code_bytes));
            rows += &format!("| {effect} | {speed} | {small} |\n");
        }
        table::put(readme, [BEGIN, END], &rows)?;
    }
    limits::check(file, target, name, least)
}

fn parse(program: &str) -> Option<(&str, Size)> {
    let (name, sizes) = program.split_once(':')?;
    let (speed, small) = sizes.split_once(':')?;
    Some((name, Size { code_bytes: speed.parse().ok()?, small_code_bytes: small.parse().ok()? }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_table_says_what_effects_add_and_the_least_player_is_held_to_its_limit() {
        let folder = std::env::temp_dir().join(format!("cubist-sizes-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        let (file, readme) = (folder.join("limits.json"), folder.join("README.md"));
        fs::write(&file, r#"{"cortex-m0plus": {"least": {"code_bytes": 900, "small_code_bytes": 500}}}"#).expect("written");
        fs::write(&readme, format!("before\n{BEGIN}\nold\n{END}\nafter\n")).expect("written");
        let tell = |programs: &[&str]| tell(&file, "cortex-m0plus", &readme, programs);
        tell(&["least:900:500", "dithered:1000:490"]).expect("at its limits");
        let text = fs::read_to_string(&readme).expect("read");
        assert!(text.starts_with("before\n") && text.ends_with("\nafter\n"), "{text}");
        assert!(text.contains("| dithered | +100 B | -10 B |") && !text.contains("old"), "{text}");
        let error = tell(&["least:900:501"]).expect_err("above a limit").to_string();
        assert!(error.contains("small_code_bytes is 501"), "{error}");
        assert!(tell(&["least:900"]).is_err());
        fs::remove_dir_all(folder).expect("removed");
    }
}
