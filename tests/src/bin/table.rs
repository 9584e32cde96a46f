//! Prints the project's tables.
fn main() {}
