//! Tables in documents: what stands between `<!-- table: NAME -->` and `<!-- /table -->` is replaced.
//! Tables come from the command `table`; the document goes back to its file.

use anyhow::{Context, Result, bail};
use std::path::Path;

/// Where a table ends.
const END: &str = "<!-- /table -->";

/// The document with `table` in the place of the table called `name`.
///
/// # Errors
/// The document has no such place, several, or one without an end.
pub fn replaced(document: &str, name: &str, table: &str) -> Result<String> {
    let start = format!("<!-- table: {name} -->\n");
    let mut parts = document.split(&start);
    let (Some(before), Some(after), None) = (parts.next(), parts.next(), parts.next()) else {
        bail!("expected the line `{}` once, found it {} times; add it, and `{END}` below", start.trim(), document.matches(&start).count());
    };
    let end = after.find(END).filter(|&end| !after[..end].contains("<!-- table: "));
    let Some(end) = end else { bail!("expected `{END}` below `{}`, found none; add it", start.trim()) };
    Ok(format!("{before}{start}{}\n{}", table.trim_end(), &after[end..]))
}

/// Replaces the table called `name` in a file.
///
/// # Errors
/// The file cannot be read or written, or has no place for the table.
pub fn write(file: &Path, name: &str, table: &str) -> Result<()> {
    let document = std::fs::read_to_string(file).with_context(|| format!("read {}", file.display()))?;
    let document = replaced(&document, name, table).with_context(|| file.display().to_string())?;
    std::fs::write(file, document).with_context(|| format!("write {}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCUMENT: &str = "# A\n\n<!-- table: a -->\nold\nolder\n<!-- /table -->\n\ntext\n<!-- table: b -->\n<!-- /table -->\nend\n";

    #[test]
    fn only_the_named_table_changes() {
        let found = replaced(DOCUMENT, "a", "| new |\n").unwrap();
        assert_eq!(found, DOCUMENT.replace("old\nolder", "| new |"));
        assert_eq!(replaced(&found, "a", "| new |\n").unwrap(), found);
        let found = replaced(DOCUMENT, "b", "| new |\n").unwrap();
        assert_eq!(found, DOCUMENT.replace("<!-- table: b -->\n", "<!-- table: b -->\n| new |\n"));
    }

    #[test]
    fn a_document_without_the_place_is_refused() {
        for (document, name, found) in [
            (DOCUMENT.to_owned(), "c", "found it 0 times"),
            (DOCUMENT.repeat(2), "a", "found it 2 times"),
            (DOCUMENT.replacen(END, "", 1), "a", "found none"),
            (DOCUMENT.replace(END, ""), "b", "found none"),
        ] {
            let error = replaced(&document, name, "| new |").unwrap_err().to_string();
            assert!(error.contains(found) && error.contains(&format!("<!-- table: {name} -->")), "{error}");
        }
    }

    #[test]
    fn the_documents_have_places_for_their_tables() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        for (file, name) in [("README.md", "builtin"), ("docs/comparison.md", "coverage"), ("docs/comparison.md", "codecs")] {
            let document = std::fs::read_to_string(root.join(file)).unwrap();
            assert!(replaced(&document, name, "").is_ok(), "{file}: {name}");
        }
    }
}
