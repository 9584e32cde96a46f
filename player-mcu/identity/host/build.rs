//! Tells the program what it is compiled for.

fn main() {
    println!("cargo:rustc-env=HOST={}", std::env::var("TARGET").unwrap_or_default());
}
