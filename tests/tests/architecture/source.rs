//! The project's own sources, for the tests that hold the layout against them.
//! Files of the checkout come in; their text, and their code without comments and strings, go to `architecture`.

use std::path::{Path, PathBuf};

/// One `.rs` file.
#[derive(Clone, Debug)]
pub struct Source {
    /// Its path from the root of the checkout, with slashes.
    pub path: String,
    /// What it holds.
    pub text: String,
}

impl Source {
    /// The text with comments, strings and character literals blanked; lines stay where they are.
    #[must_use]
    pub fn code(&self) -> String {
        strip(&self.text)
    }

    /// [`Source::code`] up to the test module, which stands at a file's end; nothing of a file of tests.
    #[must_use]
    pub fn code_without_tests(&self) -> String {
        if self.path.ends_with("tests.rs") {
            return String::new();
        }
        let code = self.code();
        let end = code.find("#[cfg(test)]\nmod tests").unwrap_or(code.len());
        code[..end].to_owned()
    }
}

/// The root of the checkout.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map_or_else(PathBuf::new, Path::to_path_buf)
}

/// The text of the file at `path`, counted from the root.
///
/// # Panics
/// Where it cannot be read.
#[must_use]
pub fn file(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// All `.rs` files of the checkout in the order of their paths, without what cargo builds.
#[must_use]
pub fn all() -> Vec<Source> {
    let mut found = Vec::new();
    walk(&root(), "", &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// Those of [`all`] whose path starts with `folder`.
#[must_use]
pub fn below(folder: &str) -> Vec<Source> {
    all().into_iter().filter(|source| source.path.starts_with(folder)).collect()
}

fn walk(folder: &Path, prefix: &str, found: &mut Vec<Source>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = format!("{prefix}{name}");
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder && name != "target" && !name.starts_with('.') {
            walk(&entry.path(), &format!("{path}/"), found);
        } else if name.ends_with(".rs") {
            let text = file(&path);
            found.push(Source { path, text });
        }
    }
}

/// The words (identifiers, keywords, numbers) of `code`, each with where it starts.
pub fn words(code: &str) -> impl Iterator<Item = (usize, &str)> {
    let in_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + code[at..].find(in_word)?;
        let length = code[start..].find(|c| !in_word(c)).unwrap_or(code.len() - start);
        at = start + length;
        Some((start, &code[start..at]))
    })
}

/// The number of the line that byte `at` of `code` is in, from 1.
#[must_use]
pub fn line(code: &str, at: usize) -> usize {
    code[..at].matches('\n').count() + 1
}

/// What follows `from`, `crate::` or `super::`, in `code`: the first name, or each first name of a group in braces.
#[must_use]
pub fn imports(code: &str, from: &str) -> Vec<String> {
    code.split(from).skip(1).flat_map(first_names).collect()
}

/// The pairs (name, module) of every `pub use module::name` and `pub use module::{names}` in `code`, within the crate alone, too.
#[must_use]
pub fn reexports(code: &str) -> Vec<(String, String)> {
    let code = code.replace("pub(crate) use ", "pub use ");
    let uses = code.split("pub use ").skip(1).filter_map(|rest| rest.split_once("::"));
    uses.flat_map(|(module, rest)| first_names(rest).into_iter().map(move |name| (name, module.to_owned()))).collect()
}

/// The name that `text` starts with; all names one level deep if it starts with a group in braces.
fn first_names(text: &str) -> Vec<String> {
    let name = |text: &str| words(text).next().map(|(_, word)| word.to_owned());
    let Some(group) = text.strip_prefix('{') else { return name(text).into_iter().collect() };
    let (mut depth, mut part, mut names) = (0, String::new(), Vec::new());
    for c in group.chars() {
        match c {
            '}' if depth == 0 => break,
            ',' if depth == 0 => names.extend(name(&std::mem::take(&mut part))),
            _ => {
                depth += i32::from(c == '{') - i32::from(c == '}');
                part.push(c);
            }
        }
    }
    names.extend(name(&part));
    names
}

/// The packages of ours that the manifest in `folder` depends on, in its order; not those its tests alone use.
#[must_use]
pub fn own_dependencies(folder: &str) -> Vec<String> {
    let manifest = file(&format!("{folder}/Cargo.toml"));
    let mut inside = false;
    let mut names = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            inside = line.contains("dependencies") && !line.contains("dev-dependencies");
        } else if inside && line.starts_with("cubist-") {
            names.extend(line.split(['.', ' ', '=']).next().map(str::to_owned));
        }
    }
    names
}

/// `text` with every comment, string and character literal replaced by blanks.
fn strip(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let skipped = literal_or_comment(rest, code.ends_with(|c: char| c.is_alphanumeric() || c == '_'));
        let taken = if skipped > 0 { skipped } else { c.len_utf8() };
        let (head, tail) = rest.split_at(taken);
        if skipped > 0 {
            code.extend(head.chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
        } else {
            code.push_str(head);
        }
        rest = tail;
    }
    code
}

/// The length of the comment or literal that `text` starts with, 0 if it starts with neither. `in_word`: a word ends here.
fn literal_or_comment(text: &str, in_word: bool) -> usize {
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if text.starts_with("/*") {
        return text.find("*/").map_or(text.len(), |end| end + 2);
    }
    if !in_word && let Some(raw) = text.strip_prefix('r') {
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        if raw[hashes..].starts_with('"') {
            let close = format!("\"{}", &raw[..hashes]);
            let start = hashes + 2;
            return text[start..].find(&close).map_or(text.len(), |end| start + end + close.len());
        }
    }
    if text.starts_with('"') {
        return quoted(text, '"').unwrap_or(text.len());
    }
    // 'a' and '\n' are characters, 'a without a second quote is a lifetime.
    let mut after = text.chars().skip(1);
    match (text.starts_with('\''), after.next(), after.next()) {
        (true, Some('\\'), _) | (true, Some(_), Some('\'')) => quoted(text, '\'').unwrap_or(0),
        _ => 0,
    }
}

/// The length of the literal in `quote`s that `text` starts with.
fn quoted(text: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        if !escaped && c == quote {
            return Some(at + 1);
        }
        escaped = !escaped && c == '\\';
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_are_blanked() {
        let cases = [
            ("a // b\nc", "a     \nc"),
            ("f(\"x // \\\" y\") // z", "f(           )     "),
            ("let q = '\"'; let s = \"'\";", "let q =    ; let s =    ;"),
            ("fn f<'a>(x: &'a str)", "fn f<'a>(x: &'a str)"),
            ("r#\"a \" b\"# + var", "           + var"),
            ("b'\\'' - 1", "b     - 1"),
        ];
        for (text, code) in cases {
            assert_eq!(strip(text), code);
        }
    }

    #[test]
    fn names_are_found_in_paths_and_groups() {
        assert_eq!(
            imports("use crate::grid::Grid; crate::x(); use crate::{Bundle, key::{self, Key}, lists};", "crate::"),
            ["grid", "x", "Bundle", "key", "lists"]
        );
        let expected = [("A", "a"), ("B", "b"), ("c", "b")].map(|(name, module)| (name.to_owned(), module.to_owned()));
        assert_eq!(reexports("pub use a::A;\npub use b::{B, c};"), expected);
    }
}
