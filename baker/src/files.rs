//! Files that are written whole or not at all, also when the program is interrupted; files read within bounds.
//! Bytes and pictures come in from both programs; they go to a temporary file in the target's own folder, which is renamed
//! when it is complete. Devices and pipes, which cannot be renamed over, are written to directly.

use anyhow::{Context, Result, ensure};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

/// No input file may be longer, bytes.
const MAX_FILE: u64 = 2 << 30;

/// What has been begun, and may not come to anything.
struct Begun {
    /// Temporary files that are being written.
    files: Vec<PathBuf>,
    /// Folders that were made, each after the one it lies in.
    folders: Vec<PathBuf>,
}

impl Begun {
    /// Makes `folder` and what it lies in.
    fn make(&mut self, folder: &Path) -> std::io::Result<()> {
        if folder.is_dir() {
            return Ok(());
        }
        if let Some(parent) = folder.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            self.make(parent)?;
        }
        match std::fs::create_dir(folder) {
            Ok(()) => self.folders.push(folder.to_owned()),
            // Somebody else was quicker.
            Err(_) if folder.is_dir() => {}
            Err(_) if folder.exists() => return Err(std::io::Error::other("expected a folder, found a file; name another one")),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Removes those of the folders that were made that nothing lies in.
    fn remove_empty_folders(&mut self) {
        for folder in self.folders.drain(..).rev() {
            // The system refuses where anything lies in it.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

static BEGUN: Mutex<Begun> = Mutex::new(Begun { files: Vec::new(), folders: Vec::new() });

fn begun() -> MutexGuard<'static, Begun> {
    BEGUN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the folders that this run of the program has made and nothing lies in: for a program that fails.
pub fn remove_empty_folders() {
    begun().remove_empty_folders();
}

/// Removes what is being written, and folders made for it, and leaves with exit code 130 when the user interrupts the program.
///
/// # Errors
/// The system refuses the handler, or there is one already.
pub fn clean_up_when_interrupted() -> Result<()> {
    ctrlc::set_handler(|| {
        // The list stays locked to the end: nobody begins a new file, nor finishes one half removed.
        let mut begun = begun();
        for file in &begun.files {
            // What cannot be removed is gone already.
            let _ = std::fs::remove_file(file);
        }
        begun.remove_empty_folders();
        std::process::exit(130);
    })
    .context("Ctrl-C cannot be caught")
}

/// Opens a file to read, and tells its length in bytes.
///
/// # Errors
/// What is wrong with it and what to do, without its name: it is not there, no plain file (a device may never end, a pipe
/// may never begin), too long, or not ours to read.
pub fn open_to_read(path: &Path) -> Result<(File, u64), String> {
    let denied = |e: std::io::Error| match e.kind() {
        ErrorKind::NotFound if path.to_string_lossy().contains("://") => {
            "no such file: addresses are not fetched: download it and give the file's path".to_owned()
        }
        ErrorKind::NotFound => "no such file: check the path".to_owned(),
        ErrorKind::PermissionDenied => format!("cannot be read ({e}): check its permissions"),
        _ => format!("cannot be read ({e})"),
    };
    let meta = std::fs::metadata(path).map_err(denied)?;
    if meta.is_dir() {
        return Err("is a directory; expected a file".to_owned());
    }
    if !meta.is_file() {
        return Err("is a device or a pipe; expected a file: save what it gives to a file first".to_owned());
    }
    if meta.len() > MAX_FILE {
        return Err(format!("{} bytes; at most {MAX_FILE} are read: make it smaller", meta.len()));
    }
    Ok((File::open(path).map_err(denied)?, meta.len()))
}

/// Whether a path leads from a root: such is right on one machine only, and on another leads to what is none of a model's.
#[must_use]
pub fn rooted(path: &[u8]) -> bool {
    matches!(path, [b'/' | b'\\', ..] | [_, b':', ..])
}

/// The file that a model in `folder` names, with either kind of slash. Of a path from the root, as some programs write, it is the file of that name
/// beside the model.
#[must_use]
pub fn beside(name: &str, folder: &Path) -> PathBuf {
    let name = if rooted(name.as_bytes()) { name.rsplit(['/', '\\']).next().unwrap_or(name) } else { name };
    let path = folder.join(name);
    if path.exists() { path } else { folder.join(name.replace('\\', "/")) }
}

/// The bytes of a file.
///
/// # Errors
/// Those of [`open_to_read`], or the system's while reading.
pub fn read(path: &Path) -> Result<Vec<u8>, String> {
    let (file, length) = open_to_read(path)?;
    let mut bytes = Vec::new();
    let cannot = |e: &dyn std::fmt::Display| format!("cannot be read ({e})");
    bytes.try_reserve(length as usize).map_err(|e| cannot(&e))?;
    file.take(MAX_FILE).read_to_end(&mut bytes).map_err(|e| cannot(&e))?;
    Ok(bytes)
}

/// Takes a temporary file off the list, whatever happens to it.
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        begun().files.retain(|path| *path != self.0);
    }
}

/// Makes the folder of `path` and a temporary file in it, which is on the list for as long as the second value lives.
fn begin(path: &Path) -> Result<(NamedTempFile, Listed)> {
    let named = !path.as_os_str().to_string_lossy().ends_with(std::path::is_separator);
    ensure!(named && !path.is_dir(), "{}: expected a file's name, found a folder; add a name", path.display());
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut begun = begun();
    begun.make(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".cubist-").suffix(".tmp");
    // A temporary file is private by default; the finished one follows the user's umask like any other.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder).with_context(|| format!("{}: the folder cannot be written to", folder.display()))?;
    begun.files.push(file.path().to_owned());
    let listed = Listed(file.path().to_owned());
    Ok((file, listed))
}

/// Whether two names lead to the same file, there or not yet.
#[must_use]
pub fn same(a: &Path, b: &Path) -> bool {
    let whole = |path: &Path| -> PathBuf {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        match (path.canonicalize(), path.parent().map(Path::canonicalize), path.file_name()) {
            (Ok(path), ..) => path,
            (_, Some(Ok(folder)), Some(name)) => folder.join(name),
            _ => path,
        }
    };
    whole(a) == whole(b)
}

/// Opens `path` if it is there and is no file but a device or a pipe, such as /dev/null: a file must not take its place.
fn device(path: &Path) -> Result<Option<File>> {
    match std::fs::metadata(path) {
        Ok(meta) if !meta.is_file() && !meta.is_dir() => {
            let file = File::options().write(true).open(path);
            file.map(Some).with_context(|| format!("{}: the device cannot be written to", path.display()))
        }
        // What is not there, or cannot be looked at, is for the temporary file to say.
        _ => Ok(None),
    }
}

/// Says now, before long work, if `path` could not be written after it.
///
/// # Errors
/// The path and why it cannot be written.
pub fn check(path: &Path) -> Result<()> {
    if device(path)?.is_none() {
        begin(path)?;
    }
    Ok(())
}

/// Makes `folder`, and says now, before long work, if files could not be written into it after it.
///
/// # Errors
/// The folder and why it cannot be made or written to.
pub fn check_folder(folder: &Path) -> Result<()> {
    begin(&folder.join("check")).map(drop)
}

/// Writes `path` through `fill`; folders on the way are made. When `fill` fails, `path` stays as it was.
///
/// # Errors
/// What `fill` says, or the path and why it cannot be written.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let failed = || format!("{}: writing failed", path.display());
    if let Some(file) = device(path)? {
        let mut writer = BufWriter::new(file);
        fill(&mut writer)?;
        return writer.flush().with_context(failed);
    }
    let (file, _listed) = begin(path)?;
    let mut writer = BufWriter::new(file);
    fill(&mut writer)?;
    let file = writer.into_inner().map_err(|e| e.into_error()).with_context(failed)?;
    let _whole = begun();
    file.persist(path).map_err(|e| e.error).with_context(|| format!("{}: the finished file cannot be put in its place", path.display()))?;
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
        assert!(begun().files.iter().all(|file| !file.starts_with(dir.path())));
    }

    #[test]
    fn a_name_that_ends_like_a_folder_is_refused_before_anything_is_made() {
        let dir = tempfile::tempdir().unwrap();
        let error = check(&dir.path().join("new/")).unwrap_err();
        assert!(error.to_string().contains("expected a file's name"), "{error:#}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn the_same_file_has_many_names() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.obj");
        let again = dir.path().join("..").join(dir.path().file_name().unwrap()).join("a.obj");
        assert!(same(&file, &again), "not there yet");
        std::fs::write(&file, "x").unwrap();
        assert!(same(&file, &again));
        assert!(!same(&file, &dir.path().join("b.obj")));
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_written_to_and_never_replaced() {
        use std::os::unix::fs::FileTypeExt;
        let null = Path::new("/dev/null");
        check(null).unwrap();
        write(null, b"gone").unwrap();
        assert!(std::fs::metadata(null).unwrap().file_type().is_char_device());
        let full = Path::new("/dev/full");
        if full.exists() {
            let error = write(full, b"no room").unwrap_err();
            assert!(format!("{error:#}").starts_with("/dev/full: writing failed: No space left"), "{error:#}");
            assert!(std::fs::metadata(full).unwrap().file_type().is_char_device());
        }
    }

    #[test]
    fn what_never_ends_is_not_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file.bin");
        std::fs::write(&path, b"whole").unwrap();
        assert_eq!(read(&path).unwrap(), b"whole");
        assert_eq!(read(dir.path()).unwrap_err(), "is a directory; expected a file");
        assert_eq!(read(&dir.path().join("gone")).unwrap_err(), "no such file: check the path");
        assert!(read(Path::new("http://example.com/a.glb")).unwrap_err().contains("download it"));
        if cfg!(unix) {
            assert!(read(Path::new("/dev/zero")).unwrap_err().contains("is a device"));
        }
        // A sparse file: long without taking room.
        File::create(&path).unwrap().set_len(MAX_FILE + 1).unwrap();
        assert!(read(&path).unwrap_err().contains("at most"));
    }

    #[test]
    fn a_file_being_written_is_on_the_list() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file.bin");
        write_with(&path, |out| {
            assert!(!path.exists());
            assert_eq!(begun().files.iter().filter(|file| file.starts_with(dir.path())).count(), 1);
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
        assert!(format!("{error:#}").ends_with("found a file; name another one"), "{error:#}");
        let error = check(dir.path()).unwrap_err();
        assert!(error.to_string().contains("found a folder"), "{error:#}");
        check(&dir.path().join("new.bin")).unwrap();
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "a check leaves nothing behind");
    }
}
