//! `cubist-bake`: scene in, bundle out.
fn main() {}
