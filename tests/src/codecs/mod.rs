//! Other codecs, run on the same frames as the player: how many bytes they take to be as good.
//! Clips come from `clip`, quality steps from here; `ffmpeg` and `gif` encode and decode, `search` finds the step.

pub mod clip;
pub mod ffmpeg;
mod gif;
pub mod search;

use anyhow::{Context, Result};
use clip::{Likeness, Shape};
use ffmpeg::{Ffmpeg, Video};
use search::{Match, Point};
use std::path::{Path, PathBuf};

/// By what two clips are equally good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// The mean PSNR.
    Psnr,
    /// The mean SSIM.
    Ssim,
}

impl Metric {
    /// The number that a likeness has by this metric.
    #[must_use]
    pub fn of(self, likeness: Likeness) -> f64 {
        match self {
            Self::Psnr => likeness.psnr,
            Self::Ssim => likeness.ssim,
        }
    }
}

/// Frames for codecs to work on: in memory, and in a file of raw R, G, B.
pub struct Source {
    /// Width, height and frames.
    pub shape: Shape,
    rgb: Vec<u8>,
    file: PathBuf,
}

impl Source {
    /// Puts the frames `rgb` into the file `name` of `folder`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(shape: Shape, rgb: Vec<u8>, folder: &Path, name: &str) -> Result<Self> {
        let file = folder.join(format!("{name}.rgb"));
        std::fs::write(&file, &rgb).with_context(|| format!("write {}", file.display()))?;
        Ok(Self { shape, rgb, file })
    }

    /// How like the frames another clip is.
    #[must_use]
    pub fn compare(&self, clip: &[u8]) -> Likeness {
        clip::compare(self.shape, &self.rgb, clip)
    }
}

/// A codec of the table.
#[derive(Clone, Debug)]
pub enum Codec {
    /// One of ffmpeg's.
    Video(Video),
    /// GIF without ffmpeg: 256 colours a frame, no other step.
    PlainGif,
}

impl Codec {
    /// What the table calls it.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Video(video) => video.name(),
            Self::PlainGif => "GIF, 256 colours a frame".to_owned(),
        }
    }

    /// All that can be run on such clips, given what ffmpeg there is; `gops` are the key frame intervals of the codecs that have such.
    #[must_use]
    pub fn all(ffmpeg: Option<&Ffmpeg>, gops: [u32; 2], shape: Shape) -> Vec<Self> {
        let Some(ffmpeg) = ffmpeg else { return vec![Self::PlainGif] };
        Video::all(gops).into_iter().filter(|video| ffmpeg.has(*video) && video.fits(shape)).map(Self::Video).collect()
    }

    /// What the codec takes for `source` to be as good as `asked` by `metric`.
    ///
    /// # Errors
    /// ffmpeg fails, or gives other frames than asked.
    pub fn equal(&self, source: &Source, metric: Metric, asked: f64) -> Result<Option<Match>> {
        let steps = match self {
            Self::Video(video) => video.steps(),
            Self::PlainGif => vec![256],
        };
        search::equal(steps.len(), asked, |step| {
            let (bytes, decoded) = match self {
                Self::Video(video) => ffmpeg::round_trip(*video, steps[step], metric, source.shape, &source.file),
                Self::PlainGif => gif::round_trip(source.shape, &source.rgb),
            }
            .with_context(|| format!("{}, quality {}", self.name(), steps[step]))?;
            Ok(Point { bytes: bytes as f64, score: metric.of(source.compare(&decoded)) })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_ffmpeg_there_is_a_gif() {
        let folder = tempfile::tempdir().unwrap();
        let shape = Shape { width: 16, height: 12, frames: 3 };
        // Three flat frames of different grey: a GIF holds them exactly.
        let rgb: Vec<u8> = [0u8, 100, 200].into_iter().flat_map(|grey| vec![grey; shape.frame_bytes()]).collect();
        let source = Source::new(shape, rgb, folder.path(), "flat").unwrap();
        let codecs = Codec::all(None, [128, 8], shape);
        let [gif] = codecs.as_slice() else { panic!("{codecs:?}") };
        let Some(Match::Coarsest(point)) = gif.equal(&source, Metric::Psnr, 40.0).unwrap() else { panic!("a GIF is as good as that") };
        assert_eq!(point.score, 99.0);
        assert!((100.0..4000.0).contains(&point.bytes), "{} bytes", point.bytes);
    }
}
