//! What programs say: results on standard output, lines for people on standard error. Text comes from the programs.

use anyhow::{Context, Result};
use std::fmt::Arguments;
use std::io::{ErrorKind, Write};

/// Prints `text`, where somebody reads it: who closes a pipe has read enough.
///
/// # Errors
/// Any other reason for which standard output cannot be written.
pub fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written"),
    }
}

/// A line for people. Where there is nobody to read it, so be it.
pub fn tell(line: Arguments<'_>) {
    let _unread = writeln!(std::io::stderr(), "{line}");
}
