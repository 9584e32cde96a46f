//! What programs say: results on standard output, lines for people on standard error. Text comes from the programs.

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::time::Duration;

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

/// A progress bar of `length` steps, which looks as indicatif's `template` says; hidden where standard error is no terminal.
#[must_use]
pub fn bar(length: u64, template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(length).with_style(style);
    // Of two changes close behind each other only the first is drawn: a stage that says nothing for long would go by the name of the one before it.
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}
