//! `cubist-player`: bundle in, window, pictures or figures out.
fn main() {}
