//! Files that are written whole or not at all.
//! Bytes and pictures come in; they go to a temporary file in the target's own folder, which is renamed when it is complete.

use anyhow::{Context, Result};
use image::{ExtendedColorType, ImageEncoder, RgbImage, codecs::png::PngEncoder};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes `path` through `fill`; folders on the way are made. When `fill` fails, `path` stays as it was.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".cubist-").suffix(".tmp");
    // A temporary file is private by default; the finished one follows the user's umask like any other.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder).with_context(|| format!("{}: the folder cannot be written to", folder.display()))?;
    let mut writer = BufWriter::new(file);
    fill(&mut writer)?;
    let file = writer.into_inner().map_err(|e| e.into_error()).with_context(|| format!("{}: writing failed", path.display()))?;
    file.persist(path).with_context(|| format!("{}: the finished file cannot be put in its place", path.display()))?;
    Ok(())
}

/// Writes `picture` as an 8-bit RGB PNG.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<()> {
    write_with(path, |out| {
        let (width, height) = picture.dimensions();
        PngEncoder::new(out)
            .write_image(picture, width, height, ExtendedColorType::Rgb8)
            .with_context(|| format!("{}: the picture cannot be written", path.display()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new/folder/file.txt");
        write_with(&path, |out| Ok(out.write_all(b"first")?)).unwrap();
        let failed = write_with(&path, |out| {
            out.write_all(b"half")?;
            anyhow::bail!("stopped")
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_that_is_a_file_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("plain");
        std::fs::write(&file, "x").unwrap();
        let error = write_png(&file.join("a.png"), &RgbImage::new(1, 1)).unwrap_err();
        assert!(error.to_string().contains("plain: the folder cannot be made"), "{error:#}");
    }

    #[cfg(unix)]
    #[test]
    fn files_are_as_readable_as_any_other() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("plain"), "x").unwrap();
        write_with(&dir.path().join("ours"), |_| Ok(())).unwrap();
        let mode = |name: &str| std::fs::metadata(dir.path().join(name)).unwrap().permissions().mode();
        assert_eq!(mode("ours"), mode("plain"));
    }
}
