//! Progress bars on standard error.
//! Commands say how much there is to do and when a part is done; people at a terminal see it, scripts do not.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// A bar of `length` steps; hidden when standard error is no terminal.
pub fn progress(length: u64, what: &'static str) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{msg:12} [{wide_bar}] {percent:>3} %  {eta} left").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(length).with_style(style).with_message(what);
    // Of two changes close behind each other only the first is drawn: a stage that says nothing for long would go by the name of the one before it.
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}
