//! Material libraries: of .mtl files the lines that are shown, written such that `tobj` takes them. What cannot be read is left out by itself, and told
//! with its line. File names come from `obj`; materials go back there.

use crate::files::{beside, read as read_file};
use std::path::Path;

/// What libraries are at fault in.
#[derive(Default)]
pub(super) struct Trouble {
    /// In words, for people.
    pub told: Vec<String>,
    /// A whole library is not there.
    pub lost: bool,
}

/// Reads what `name` means: a file, or several with blanks between their names.
pub(super) fn read(name: &Path, folder: &Path, trouble: &mut Trouble) -> tobj::MTLLoadResult {
    let name = name.to_string_lossy();
    let names: Vec<&str> = if beside(&name, folder).exists() { vec![&*name] } else { name.split_whitespace().collect() };
    let mut lines = String::new();
    for name in names {
        let path = beside(name, folder);
        let library = format!("material library {}", path.display());
        match read_file(&path) {
            Ok(bytes) => clean(&text(&bytes), &library, &mut lines, &mut trouble.told),
            Err(e) => {
                trouble.told.push(format!("{library}: {e}: its materials are left white"));
                trouble.lost = true;
            }
        }
    }
    tobj::load_mtl_buf(&mut lines.as_bytes()).or_else(|e| {
        trouble.told.push(format!("material libraries: {e}: all materials are left white"));
        trouble.lost = true;
        Ok(Default::default())
    })
}

/// The text of an OBJ file or of a library, without a mark at its start. Names in other encodings are common; the numbers are ASCII whatever the encoding.
pub(super) fn text(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    // Lines may end as those of old Macintoshes.
    if text.contains('\n') { text.to_owned() } else { text.replace('\r', "\n") }
}

/// Appends the lines of `text` that are shown to `lines`; anything else in it may be as odd as it likes.
fn clean(text: &str, library: &str, lines: &mut String, told: &mut Vec<String>) {
    for (number, line) in text.lines().enumerate() {
        let line = without_comment(line);
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let place = || format!("{library}: line {}: \"{line}\"", number + 1);
        let numbers = rest.split_whitespace().map(|word| word.parse::<f32>().ok().filter(|v| v.is_finite())).collect::<Option<Vec<_>>>();
        let shown = match (word, numbers.as_deref()) {
            // What follows is about it, not about the one before.
            ("newmtl", _) if rest.is_empty() => {
                lines.push_str("newmtl (no name)\n");
                Err("a name after it")
            }
            ("newmtl", _) => Ok(line.to_owned()),
            // One number is grey.
            ("Kd" | "Ke", Some(&[grey])) => Ok(format!("{word} {grey} {grey} {grey}")),
            ("Kd" | "Ke", Some(&[r, g, b, ..])) => Ok(format!("{word} {r} {g} {b}")),
            ("Kd" | "Ke", _) => Err("three numbers from 0 to 1, red, green and blue"),
            // After options.
            ("d" | "Tr", _) => match rest.split_whitespace().next_back().and_then(|last| last.parse::<f32>().ok()) {
                Some(value) if value.is_finite() => Ok(format!("{word} {value}")),
                _ => Err("a number from 0 to 1"),
            },
            ("map_Kd" | "map_d", _) if rest.is_empty() => Err("the name of a picture"),
            ("map_Kd" | "map_d", _) => {
                if moves(rest) {
                    told.push(format!("{}: its options are not supported: the picture is taken as it is", place()));
                }
                Ok(line.to_owned())
            }
            _ => continue,
        };
        match shown {
            Ok(line) => lines.extend([&line, "\n"]),
            Err(expected) => told.push(format!("{}: expected {expected}: left out", place())),
        }
    }
}

/// A line without the comment at its end: from a `#` on that follows a blank and is no number's, as in 3ds Max's names ("Material #25").
fn without_comment(line: &str) -> &str {
    let starts = |&(at, _): &(usize, &str)| {
        let after = line[at + 1..].chars().next();
        line[..at].chars().next_back().is_none_or(char::is_whitespace) && !after.is_some_and(|c| c.is_ascii_digit())
    };
    line.match_indices('#').find(starts).map_or(line, |(at, _)| &line[..at]).trim()
}

/// The name that a line has after its first word.
pub(super) fn name(line: &str) -> &str {
    without_comment(line).split_once(char::is_whitespace).map_or("", |(_, name)| name.trim())
}

/// Whether a map statement's options move, scale or cut the picture, or change its colours.
fn moves(statement: &str) -> bool {
    let words: Vec<&str> = statement.split_whitespace().collect();
    words.iter().any(|word| matches!(*word, "-s" | "-o" | "-t" | "-mm")) || words.windows(2).any(|pair| pair == ["-clamp", "on"])
}

/// The file name at the end of a map statement, after its options.
pub(super) fn map_name(statement: &str) -> &str {
    let mut rest = statement.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let (name, mut tail) = option.split_once(char::is_whitespace).unwrap_or((option, ""));
        // Numbers belong to the option; others take one word.
        let mut words = usize::from(!matches!(name, "s" | "o" | "t" | "mm" | "bm" | "boost" | "texres"));
        loop {
            let (word, after) = tail.trim_start().split_once(char::is_whitespace).unwrap_or((tail.trim_start(), ""));
            if after.is_empty() || (words == 0 && word.parse::<f32>().is_err()) {
                break;
            }
            words = words.saturating_sub(1);
            tail = after;
            if words == 0 && !matches!(name, "s" | "o" | "t" | "mm" | "bm" | "boost" | "texres") {
                break;
            }
        }
        rest = tail.trim();
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_options_are_skipped() {
        assert_eq!(map_name("wall brick.png"), "wall brick.png");
        assert_eq!(map_name("-s 2 2 1 -clamp on wall brick.png"), "wall brick.png");
        assert_eq!(map_name("-bm 0.5 a.png"), "a.png");
    }

    #[test]
    fn lines_that_cannot_be_read_leave_the_others() {
        let text = "newmtl\nKd 1 1 1\nnewmtl a\nKd 0.5\nKd 1 2\nKd xyz 0.1 0.2 0.3\nKe 1,0 0 0\nd -halo 0.3\nd\nNs many\nmap_Kd\nmap_Kd -clamp on a.png\nKd 0.1 0.2 0.3 9";
        let (mut lines, mut told) = (String::new(), Vec::new());
        clean(text, "library", &mut lines, &mut told);
        assert_eq!(lines, "newmtl (no name)\nKd 1 1 1\nnewmtl a\nKd 0.5 0.5 0.5\nd 0.3\nmap_Kd -clamp on a.png\nKd 0.1 0.2 0.3\n");
        let places: Vec<&str> = told.iter().map(|t| t.split(": ").nth(1).unwrap()).collect();
        assert_eq!(places, ["line 1", "line 5", "line 6", "line 7", "line 9", "line 11", "line 12"]);
        assert_eq!(tobj::load_mtl_buf(&mut lines.as_bytes()).unwrap().0[1].diffuse, Some([0.1, 0.2, 0.3]));
    }

    #[test]
    fn one_statement_may_name_several_files() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [("a.mtl", "newmtl a\nKd 1 0 0"), ("b.mtl", "newmtl b\nKd 0 1 0"), ("a b.mtl", "newmtl c\nKd 0 0 1")] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let names = |statement: &str| {
            let mut trouble = Trouble::default();
            let materials = read(Path::new(statement), folder.path(), &mut trouble).unwrap().0;
            (materials.into_iter().map(|m| m.name).collect::<Vec<_>>().join(" "), trouble.lost, trouble.told.len())
        };
        assert_eq!(names("a.mtl b.mtl"), ("a b".to_owned(), false, 0));
        assert_eq!(names("a b.mtl"), ("c".to_owned(), false, 0));
        assert_eq!(names("a.mtl none.mtl"), ("a".to_owned(), true, 1));
    }
}
