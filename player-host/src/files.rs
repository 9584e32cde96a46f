//! Pictures as files, written as the baker writes its own: whole or not at all.
//! Pictures come in from the window and from `render`; PNG files go out through `cubist_baker::files`.

use anyhow::Result;
use image::RgbImage;
use std::path::Path;

/// Writes `picture` as an 8-bit RGB PNG.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<()> {
    cubist_baker::files::write_png(path, picture.width(), picture)
}
