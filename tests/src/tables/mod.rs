//! The project's tables: what scenes cost and how well they play, beside other ways of playing and other codecs.
//! Scenes come from the baker, figures from the rest of this crate; tables go to the command `table` and into the documents.

pub mod atlas;
pub mod builtin;
pub mod codecs;
pub mod coverage;
pub mod document;
pub mod edges;
pub mod hard;

use anyhow::{Context, Result};
use cubist_baker::Options;
use cubist_baker::job::{self, Baked};
use cubist_baker::scene::{Overrides, Scene, load, load_builtin};
use serde_json::Value;
use std::path::Path;

/// A finished table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Markdown, with a line of conditions below where there are any.
    pub markdown: String,
    /// The same figures for scripts.
    pub json: Value,
}

/// A Markdown table: titles, then rows; the first `text` columns are words, the others numbers.
#[must_use]
pub fn markdown(titles: &[&str], text: usize, rows: &[Vec<String>]) -> String {
    let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let rule = (0..titles.len()).map(|column| if column < text { "---" } else { "---:" }).collect();
    let body: String = rows.iter().map(|row| line(row.iter().map(String::as_str).collect())).collect();
    line(titles.to_vec()) + &line(rule) + &body
}

/// A number with that many digits after the point; nothing for what is not there.
fn number(value: &Value, digits: usize) -> String {
    value.as_f64().map_or_else(String::new, |value| format!("{value:.digits$}"))
}

/// `scene` as `cubist-bake` bakes it with `options`.
///
/// # Errors
/// The baker's, with the scene's name.
fn baked(scene: &Scene, options: &Options) -> Result<Baked> {
    eprintln!("{}: baking", scene.name);
    job::run(scene, options, &|_, _| {}).with_context(|| format!("bake {}", scene.name))
}

/// The scene that `name` means: a built-in one, or a file where it looks like one.
///
/// # Errors
/// There is no such scene, or the file is at fault.
pub fn scene(name: &str, overrides: &Overrides) -> Result<Scene> {
    if let Some(name) = name.strip_prefix("builtin:") {
        return Ok(load_builtin(name, overrides)?);
    }
    let file = Path::new(name);
    let named = file.extension().is_some() || file.components().count() > 1;
    Ok(if named { load(file, overrides)? } else { load_builtin(name, overrides)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_their_columns() {
        let rows = [vec!["cone".to_owned(), "1.5".to_owned()]];
        assert_eq!(markdown(&["scene", "dB"], 1, &rows), "| scene | dB |\n| --- | ---: |\n| cone | 1.5 |\n");
        assert_eq!((number(&Value::from(1.25), 1), number(&Value::from("x"), 1)), ("1.2".to_owned(), String::new()));
    }

    #[test]
    fn names_and_files_are_told_apart() {
        let overrides = Overrides { frames: Some(3), ..Overrides::default() };
        for name in ["arch", "builtin:arch"] {
            assert_eq!(scene(name, &overrides).unwrap().playback.frames, 3);
        }
        let error = |name: &str| format!("{:#}", scene(name, &overrides).err().unwrap());
        assert!(error("arhc").contains("arch"), "{}", error("arhc"));
        assert!(error("no/arch.toml").contains("no/arch.toml"), "{}", error("no/arch.toml"));
    }
}
