//! What the build scripts of firmwares that play share: the bundle that CUBIST_BUNDLE names goes to the compiler, as `bundle.cubist` in its folder.

use std::io::Error;
use std::path::Path;

/// Copies it into `out`; an empty file where none is named. What is no bundle is better told here than by a light that flashes.
pub fn copy(out: &Path) -> Result<(), Error> {
    println!("cargo:rerun-if-env-changed=CUBIST_BUNDLE");
    let bundle = match std::env::var("CUBIST_BUNDLE") {
        Ok(path) => {
            println!("cargo:rerun-if-changed={path}");
            let named = |error: Error| Error::new(error.kind(), format!("CUBIST_BUNDLE={path}: {error}; expected an absolute path"));
            let bytes = std::fs::read(&path).map_err(named)?;
            // There may be more behind it.
            cubist_core::Bundle::parse_first(&bytes)
                .map_err(|error| Error::other(format!("CUBIST_BUNDLE={path}: {error}; bake one with `cubist-bake SCENE -o OUT.cubist`")))?;
            bytes
        }
        Err(_) => Vec::new(),
    };
    std::fs::write(out.join("bundle.cubist"), bundle)
}
