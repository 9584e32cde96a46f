//! Files that are written whole or not at all, also when the program is interrupted.
//! Bytes and pictures come in; they go to a temporary file in the target's own folder, which is renamed when it is complete.

use anyhow::{Context, Result, ensure};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

/// Temporary files that are being written.
static OPEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn open() -> MutexGuard<'static, Vec<PathBuf>> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is being written and leaves with exit code 130 when the user interrupts the program.
///
/// # Errors
/// The system refuses the handler, or there is one already.
pub fn clean_up_when_interrupted() -> Result<()> {
    ctrlc::set_handler(|| {
        // The list stays locked to the end: nobody begins a new file, nor finishes one half removed.
        let files = open();
        for file in files.iter() {
            // What cannot be removed is gone already.
            let _ = std::fs::remove_file(file);
        }
        std::process::exit(130);
    })
    .context("Ctrl-C cannot be caught")
}

/// Takes a temporary file off the list, whatever happens to it.
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        open().retain(|path| *path != self.0);
    }
}

/// Makes the folder of `path` and a temporary file in it, which is on the list for as long as the second value lives.
fn begin(path: &Path) -> Result<(NamedTempFile, Listed)> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    ensure!(!path.is_dir(), "{}: expected a file's name, found a folder; add a name", path.display());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".cubist-").suffix(".tmp");
    // A temporary file is private by default; the finished one follows the user's umask like any other.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut list = open();
    let file = builder.tempfile_in(folder).with_context(|| format!("{}: the folder cannot be written to", folder.display()))?;
    list.push(file.path().to_owned());
    let listed = Listed(file.path().to_owned());
    Ok((file, listed))
}

/// Says now, before long work, if `path` could not be written after it.
///
/// # Errors
/// The path and why it cannot be written.
pub fn check(path: &Path) -> Result<()> {
    begin(path).map(drop)
}

/// Writes `path` through `fill`; folders on the way are made. When `fill` fails, `path` stays as it was.
///
/// # Errors
/// What `fill` says, or the path and why it cannot be written.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let (file, _listed) = begin(path)?;
    let mut writer = BufWriter::new(file);
    fill(&mut writer)?;
    let file = writer.into_inner().map_err(|e| e.into_error()).with_context(|| format!("{}: writing failed", path.display()))?;
    let _whole = open();
    file.persist(path).with_context(|| format!("{}: the finished file cannot be put in its place", path.display()))?;
    Ok(())
}

/// Writes `bytes` as `path`.
///
/// # Errors
/// The path and why it cannot be written.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, |out| out.write_all(bytes).with_context(|| format!("{}: writing failed", path.display())))
}

/// Writes an 8-bit RGB PNG of `width` pixels a row.
///
/// # Errors
/// The path and why it cannot be written.
pub fn write_png(path: &Path, width: u32, rgb: &[u8]) -> Result<()> {
    let height = (rgb.len() / 3).checked_div(width as usize).unwrap_or(0) as u32;
    write_with(path, |out| {
        PngEncoder::new(out)
            .write_image(rgb, width, height, ExtendedColorType::Rgb8)
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
        write(&path, b"first").unwrap();
        let failed = write_with(&path, |out| {
            out.write_all(b"half")?;
            anyhow::bail!("stopped")
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        assert!(open().iter().all(|file| !file.starts_with(dir.path())));
    }

    #[test]
    fn a_file_being_written_is_on_the_list() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file.bin");
        write_with(&path, |out| {
            assert!(!path.exists());
            assert_eq!(open().iter().filter(|file| file.starts_with(dir.path())).count(), 1);
            Ok(out.write_all(b"whole")?)
        })
        .unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
    }

    #[test]
    fn a_folder_that_is_a_file_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("plain");
        std::fs::write(&file, "x").unwrap();
        let error = write_png(&file.join("a.png"), 1, &[0; 3]).unwrap_err();
        assert!(error.to_string().contains("plain: the folder cannot be made"), "{error:#}");
        let error = check(dir.path()).unwrap_err();
        assert!(error.to_string().contains("found a folder"), "{error:#}");
        check(&dir.path().join("new.bin")).unwrap();
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "a check leaves nothing behind");
    }
}
