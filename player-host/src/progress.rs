//! Progress bars on standard error.
//! Commands say how much there is to do and when a part is done; people at a terminal see it, scripts do not.

use cubist_baker::terminal::bar;
use indicatif::ProgressBar;

/// A bar of `length` steps; hidden when standard error is no terminal.
pub fn progress(length: u64, what: &'static str) -> ProgressBar {
    bar(length, "{msg:12} [{wide_bar}] {percent:>3} %  {eta} left").with_message(what)
}
