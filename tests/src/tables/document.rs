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

/// A document that has a place for a table.
pub struct Document<'a> {
    file: &'a Path,
    name: &'a str,
}

impl<'a> Document<'a> {
    /// Reads a document and looks for the place of the table called `name`: before hours of measuring, not after.
    ///
    /// # Errors
    /// The file cannot be read, or has no place for the table.
    pub fn open(file: &'a Path, name: &'a str) -> Result<Self> {
        let document = Self { file, name };
        document.replaced("")?;
        Ok(document)
    }

    fn replaced(&self, table: &str) -> Result<String> {
        let text = std::fs::read_to_string(self.file).with_context(|| format!("read {}", self.file.display()))?;
        replaced(&text, self.name, table).with_context(|| self.file.display().to_string())
    }

    /// Replaces the table in what the file holds now: it may have changed since it was opened.
    ///
    /// # Errors
    /// The file cannot be read or written, or has no place for the table any more.
    pub fn write(self, table: &str) -> Result<()> {
        let text = self.replaced(table)?;
        std::fs::write(self.file, text).with_context(|| format!("write {}", self.file.display()))
    }
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
    fn a_document_is_written_back() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("document.md");
        std::fs::write(&file, DOCUMENT).unwrap();
        Document::open(&file, "b").unwrap().write("| new |\n").unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), replaced(DOCUMENT, "b", "| new |").unwrap());
        for (file, name) in [(file.clone(), "c"), (folder.path().join("none.md"), "a")] {
            let error = format!("{:#}", Document::open(&file, name).err().unwrap());
            assert!(error.contains(&file.display().to_string()), "{error}");
        }
    }

    #[test]
    fn the_documents_have_places_for_their_tables() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        for (file, name) in [("README.md", "builtin"), ("docs/comparison.md", "coverage"), ("docs/comparison.md", "codecs")] {
            Document::open(&root.join(file), name).map_err(|error| format!("{error:#}")).map(drop).unwrap();
        }
    }
}
