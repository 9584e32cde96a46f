//! What can be wrong with a scene, said so that it can be put right; and what was merely approximated.
//! Filled by the loaders; shown by the programs.

use super::endings::MODELS_TOLD;
use std::path::PathBuf;

/// Why a scene cannot be loaded. Every message names the file, the place in it, what was found and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file is not there, is a directory, or may not be read.
    #[error("load {}: {what}", .file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What is wrong and what to do.
        what: String,
    },
    /// The name's ending is none of ours.
    #[error("load {}: the name ends in {found}; expected a scene file (.toml) or a model ({MODELS_TOLD})", .file.display())]
    Kind {
        /// The file.
        file: PathBuf,
        /// The ending found.
        found: String,
    },
    /// A key of a scene file, or a value of it, is at fault.
    #[error("load {}: {}{key}: {what}", .file.display(), .line.map(|l| format!("line {l}: ")).unwrap_or_default())]
    Key {
        /// The scene file.
        file: PathBuf,
        /// The line of the key, counted from 1, where known.
        line: Option<usize>,
        /// The key, as `table.key`.
        key: String,
        /// What was found, what was expected and what to do.
        what: String,
    },
    /// A model, a height map or a picture is at fault.
    #[error("load {}: {what}", .file.display())]
    Model {
        /// The file.
        file: PathBuf,
        /// The place in the file, what was expected and found, and what to do.
        what: String,
    },
    /// A value given on the command line is out of range.
    #[error("{option}: {what}")]
    Override {
        /// The option.
        option: &'static str,
        /// What was found and what was expected.
        what: String,
    },
    /// No built-in scene has this name.
    #[error("built-in scene \"{name}\": no such name{}; expected one of: {names}", .near.as_ref().map(|n| format!(" (did you mean \"{n}\"?)")).unwrap_or_default())]
    Builtin {
        /// The name asked for.
        name: String,
        /// The nearest name there is, if one is near.
        near: Option<String>,
        /// All names.
        names: String,
    },
}

/// How many warnings are kept.
const MAX_WARNINGS: usize = 100;

/// What a loader approximated or ignored, each thing once, in the order found.
#[derive(Debug, Default)]
pub(crate) struct Warnings(Vec<String>);

impl Warnings {
    pub(crate) fn add(&mut self, text: impl Into<String>) {
        // A damaged file can give cause for millions; nobody reads on after a hundred.
        if self.0.len() > MAX_WARNINGS {
            return;
        }
        let text = if self.0.len() == MAX_WARNINGS { "further warnings are left out".to_owned() } else { text.into() };
        if !self.0.contains(&text) {
            self.0.push(text);
        }
    }

    pub(crate) fn into_vec(self) -> Vec<String> {
        self.0
    }
}

/// The candidate nearest to `word` by edit distance, if it is near enough to be a slip of the pen.
pub(crate) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let best = candidates.into_iter().map(|c| (strsim::levenshtein(word, c), c)).min_by_key(|(d, _)| *d)?;
    (best.0 <= 1 + word.chars().count() / 3).then_some(best.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised_and_strangers_are_not() {
        assert_eq!(nearest("fvo", ["fov", "orbit"]), Some("fov"));
        assert_eq!(nearest("color", ["colour", "intensity"]), Some("colour"));
        assert_eq!(nearest("zebra", ["fov", "orbit"]), None);
    }

    #[test]
    fn a_warning_is_given_once() {
        let mut w = Warnings::default();
        w.add("a");
        w.add("b");
        w.add("a");
        assert_eq!(w.into_vec(), ["a", "b"]);
    }
}
