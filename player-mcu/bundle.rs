//! What the build scripts of firmwares that play share: the bundle that CUBIST_BUNDLE names goes to the compiler, as `bundle.cubist` in its folder.

use cubist_core::Bundle;
use cubist_core::format::TexelKind;
use std::io::Error;
use std::path::Path;

/// Copies it into `out`, and says what its texels are; an empty file where none is named. What is no bundle is better told here than by a light that
/// flashes.
pub fn copy(out: &Path) -> Result<Option<TexelKind>, Error> {
    println!("cargo:rerun-if-env-changed=CUBIST_BUNDLE");
    let (bundle, texels) = match std::env::var("CUBIST_BUNDLE") {
        Ok(path) => {
            println!("cargo:rerun-if-changed={path}");
            let named = |error: Error| Error::new(error.kind(), format!("CUBIST_BUNDLE={path}: {error}; expected an absolute path"));
            let bytes = std::fs::read(&path).map_err(named)?;
            // There may be more behind it.
            let texels = Bundle::parse_first(&bytes)
                .map_err(|error| Error::other(format!("CUBIST_BUNDLE={path}: {error}; bake one with `cubist-bake SCENE -o OUT.cubist`")))?
                .texel_kind();
            (bytes, Some(texels))
        }
        Err(_) => (Vec::new(), None),
    };
    std::fs::write(out.join("bundle.cubist"), bundle)?;
    Ok(texels)
}
