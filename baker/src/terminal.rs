//! What programs are told, and say: arguments; results on standard output, lines for people on standard error; figures and tables as text. What the text says
//! comes from the programs.

use anyhow::{Context, Result};
use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind as Wrong};
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::time::Duration;

/// The arguments this program was called with; where they are wrong, it says how and ends.
#[must_use]
pub fn arguments<C: Parser>() -> C {
    C::try_parse().unwrap_or_else(|error| {
        let mut command = C::command();
        // To clap, what stands behind a first input is a command, whatever it is.
        if let (Wrong::ArgumentConflict, Some(ContextValue::String(more))) = (error.kind(), error.get(ContextKind::InvalidSubcommand)) {
            let names: Vec<_> = command.get_subcommands().map(|command| command.get_name().to_owned()).collect();
            let said = format!("expected one input, found \"{more}\" too; commands stand before theirs: {}", names.join(", "));
            command.error(Wrong::ArgumentConflict, said).exit();
        }
        error.exit()
    })
}

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

/// A number with its thousands apart: 12,345.
#[must_use]
pub fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// Rows of name and value as lines of text, the values in one column.
#[must_use]
pub fn aligned(rows: &[(String, String)]) -> String {
    let widest = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(name, value)| format!("{name:widest$}  {value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_stand_apart() {
        for (number, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(grouped(number), text);
        }
    }

    #[test]
    fn values_stand_in_one_column() {
        let rows = [("a", "1"), ("long name", "2")].map(|(name, value)| (name.to_owned(), value.to_owned()));
        assert_eq!(aligned(&rows), "a          1\nlong name  2\n");
    }
}
