//! Checksums of frames: as players print them, as goldens name them, and how two lists of them differ. Text comes in; `main` prints what
//! comes out.

use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The checksums of a scene's frames.
pub type Frames = BTreeMap<u32, u32>;
/// Those of all scenes of a target.
pub type Scenes = BTreeMap<String, Frames>;

/// What a comparison found.
#[derive(Debug, PartialEq, Eq)]
pub struct Found {
    /// How many frames are as expected.
    pub same: usize,
    /// What is wrong, frame by frame.
    pub faults: Vec<String>,
}

/// Holds `found` against `expected`.
pub fn compare(expected: &Frames, found: Option<&Frames>) -> Found {
    let Some(found) = found else { return Found { same: 0, faults: vec!["did not play".to_owned()] } };
    let mut faults = Vec::new();
    let mut same = 0;
    for (frame, sum) in expected {
        match found.get(frame) {
            Some(other) if other == sum => same += 1,
            Some(other) => faults.push(format!("frame {frame}: expected {sum:08x}, found {other:08x}")),
            None => faults.push(format!("frame {frame}: missing")),
        }
    }
    faults.extend(found.keys().filter(|frame| !expected.contains_key(frame)).map(|frame| format!("frame {frame}: one too many")));
    Found { same, faults }
}

/// Reads what a player printed: lines of `FILE FRAME CHECKSUM`; a scene is its file without folder and ending.
///
/// # Errors
/// Another line: what the player says went wrong.
pub fn scenes(text: &str) -> Result<Scenes> {
    let mut scenes = Scenes::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let &[file, frame, sum] = words.as_slice() else { bail!("expected FILE FRAME CHECKSUM, found {line:?}") };
        let scene = Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (frame, sum) = (frame.parse().with_context(|| line.to_owned())?, hex(sum).with_context(|| line.to_owned())?);
        scenes.entry(scene).or_default().insert(frame, sum);
    }
    Ok(scenes)
}

/// The frames that the golden in `file` names.
///
/// # Errors
/// A file that cannot be read, or is no golden.
pub fn golden(file: &Path) -> Result<Frames> {
    let place = || file.display().to_string();
    let json: serde_json::Value = serde_json::from_slice(&fs::read(file).with_context(place)?).with_context(place)?;
    let frames = json["frame_crc32"].as_object().with_context(|| format!("{}: no frame_crc32", place()))?;
    let pair = |(frame, sum): (&String, &serde_json::Value)| Ok((frame.parse()?, hex(sum.as_str().context("a checksum is text")?)?));
    frames.iter().map(pair).collect::<Result<_>>().with_context(place)
}

fn hex(text: &str) -> Result<u32> {
    u32::from_str_radix(text, 16).with_context(|| format!("expected a checksum in hexadecimal, found {text:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_missing_and_surplus_frames_are_faults() {
        let expected = Frames::from([(0, 1), (1, 2), (2, 3)]);
        assert_eq!(compare(&expected, Some(&expected)), Found { same: 3, faults: vec![] });
        let found = compare(&expected, Some(&Frames::from([(0, 1), (1, 9), (3, 4)])));
        assert_eq!((found.same, found.faults.len()), (1, 3), "{found:?}");
        assert_eq!(compare(&expected, None).faults.len(), 1);
    }

    #[test]
    fn a_players_complaint_is_an_error() {
        let scenes = scenes("a/b.cubist 0 0000000a\na/b.cubist 1 ffffffff\n").unwrap();
        assert_eq!(scenes, Scenes::from([("b".to_owned(), Frames::from([(0, 10), (1, u32::MAX)]))]));
        assert!(super::scenes("error: a/b.cubist: too little memory").is_err());
    }
}
