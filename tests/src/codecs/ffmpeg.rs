//! The codecs of ffmpeg, as a program beside: raw frames in a file, encoded bytes in another, decoded frames through a pipe.
//! Frames come from `codecs`; bytes and the frames as decoded go back. What one command needs is in its temporary folder.
//!
//! Every command runs on one thread: encoders cut frames differently on more, and bytes would depend on the machine.

use super::Metric;
use super::clip::Shape;
use anyhow::{Context, Result, bail};
use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Stdio};

/// What converts between RGB and YUV as exactly as can be.
const EXACT: &str = "flags=lanczos+accurate_rnd+full_chroma_int+full_chroma_inp";
/// A GIF counts hundredths of a second: at this rate no frame is dropped or doubled, whatever the scene's own.
const RATE: &str = "25";

/// How finely colour differences are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chroma {
    /// As finely as brightness.
    Full,
    /// Half as finely in both directions.
    Quarter,
}

/// A codec of ffmpeg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Video {
    /// Motion JPEG, every frame by itself.
    Mjpeg(Chroma),
    /// GIF: one palette for all frames, only what changes from frame to frame.
    Gif,
    /// MPEG-1 with a key frame every this many.
    Mpeg1(u32),
    /// H.264 by x264 with a key frame at least every this many.
    H264(Chroma, u32),
}

/// An ffmpeg that runs.
#[derive(Clone, Debug)]
pub struct Ffmpeg {
    /// The version, as it says itself.
    pub version: String,
    encoders: String,
}

impl Ffmpeg {
    /// The ffmpeg of this machine; `None` if there is none.
    #[must_use]
    pub fn find() -> Option<Self> {
        let run = |option: &str| {
            let output = Command::new("ffmpeg").args(["-hide_banner", option]).stdin(Stdio::null()).output().ok()?;
            output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
        };
        let version = run("-version")?.split_whitespace().nth(2)?.to_owned();
        Some(Self { version, encoders: run("-encoders")? })
    }

    /// Whether it can encode `video`.
    #[must_use]
    pub fn has(&self, video: Video) -> bool {
        self.encoders.split_whitespace().any(|word| word == video.encoder())
    }
}

impl Video {
    /// All of the table; `gops` are the key frame intervals of those that have such, the longer first.
    #[must_use]
    pub fn all([long, short]: [u32; 2]) -> Vec<Self> {
        use Chroma::{Full, Quarter};
        vec![
            Self::Mjpeg(Full),
            Self::Mjpeg(Quarter),
            Self::Gif,
            Self::Mpeg1(long),
            Self::H264(Full, long),
            Self::H264(Quarter, long),
            Self::H264(Full, short),
        ]
    }

    /// Whether it can encode frames of that size: x264 samples colour differences of pairs of pixels only.
    #[must_use]
    pub fn fits(self, shape: Shape) -> bool {
        !matches!(self, Self::H264(Chroma::Quarter, _)) || (shape.width.is_multiple_of(2) && shape.height.is_multiple_of(2))
    }

    /// What the table calls it.
    #[must_use]
    pub fn name(self) -> String {
        let sampling = |chroma| if chroma == Chroma::Full { "4:4:4" } else { "4:2:0" };
        match self {
            Self::Mjpeg(chroma) => format!("MJPEG {}", sampling(chroma)),
            Self::Gif => "GIF".to_owned(),
            Self::Mpeg1(gop) => format!("MPEG-1 4:2:0, GOP {gop}"),
            Self::H264(chroma, gop) => format!("H.264 {}, GOP {gop}", sampling(chroma)),
        }
    }

    /// The encoder's name in ffmpeg.
    #[must_use]
    pub fn encoder(self) -> &'static str {
        match self {
            Self::Mjpeg(_) => "mjpeg",
            Self::Gif => "gif",
            Self::Mpeg1(_) => "mpeg1video",
            Self::H264(..) => "libx264",
        }
    }

    /// The quality steps, the coarsest first: quantisers, colours, rate factors.
    #[must_use]
    pub fn steps(self) -> Vec<u32> {
        match self {
            Self::Mjpeg(_) => vec![69, 60, 52, 45, 40, 36, 32, 28, 25, 22, 20, 18, 16, 14, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1],
            Self::Mpeg1(_) => (1..=31).rev().collect(),
            Self::Gif => vec![4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128, 160, 192, 224, 256],
            Self::H264(..) => (1..=51).rev().step_by(2).collect(),
        }
    }

    /// The options that encode at `quality`, tuned for `metric` where the encoder knows how.
    fn encode(self, quality: u32, metric: Metric) -> Vec<String> {
        let yuv = |chroma: Chroma| if chroma == Chroma::Full { "444p" } else { "420p" };
        let text = match self {
            Self::Mjpeg(chroma) => {
                let filter = format!("scale=out_color_matrix=bt601:out_range=full:{EXACT},format=yuvj{}", yuv(chroma));
                format!("-vf {filter} -c:v mjpeg -huffman optimal -qmin 1 -qmax 69 -q:v {quality} -f mjpeg")
            }
            Self::Gif => {
                // One colour of the palette is for what does not change.
                let palette = format!("split[a][b];[a]palettegen=max_colors={quality}[p];[b][p]paletteuse=dither=none");
                format!("-filter_complex {palette} -f gif")
            }
            Self::Mpeg1(gop) => {
                let filter = format!("scale=out_color_matrix=bt601:out_range=limited:{EXACT},format=yuv420p");
                format!(
                    "-vf {filter} -c:v mpeg1video -g {gop} -bf 2 -mbd rd -trellis 2 -cmp 2 -subcmp 2 -qmin 1 -q:v {quality} -f mpeg1video"
                )
            }
            Self::H264(chroma, gop) => {
                let filter = format!("scale=out_color_matrix=bt709:out_range=full:{EXACT},format=yuv{}", yuv(chroma));
                let tune = if metric == Metric::Psnr { "psnr" } else { "ssim" };
                // What it writes about itself is not counted.
                format!(
                    "-vf {filter} -color_range pc -c:v libx264 -preset veryslow -tune {tune} -crf {quality} -g {gop} \
                     -bsf:v filter_units=remove_types=6 -f h264"
                )
            }
        };
        text.split_whitespace().map(str::to_owned).collect()
    }

    /// The format to decode, and the filter that gives RGB back.
    fn decode(self) -> (&'static str, String) {
        let from = |matrix: &str, range: &str| format!("scale=in_color_matrix={matrix}:in_range={range}:{EXACT},format=rgb24");
        match self {
            Self::Mjpeg(_) => ("mjpeg", from("bt601", "full")),
            Self::Gif => ("gif", "format=rgb24".to_owned()),
            Self::Mpeg1(_) => ("mpegvideo", from("bt601", "limited")),
            Self::H264(..) => ("h264", from("bt709", "full")),
        }
    }
}

/// Runs ffmpeg in silence; what it writes to its output.
fn run<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Result<Vec<u8>> {
    let mut command = Command::new("ffmpeg");
    command.args(["-hide_banner", "-nostdin", "-v", "error", "-y", "-filter_threads", "1", "-filter_complex_threads", "1"]);
    let output = command.args(arguments).stdin(Stdio::null()).output().context("run ffmpeg")?;
    if !output.status.success() {
        bail!("ffmpeg failed: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(output.stdout)
}

/// Encodes the raw frames of `file` and decodes them again; the bytes of the encoded stream, and R, G, B of what it shows.
///
/// # Errors
/// ffmpeg fails, or gives another number of frames.
pub fn round_trip(video: Video, quality: u32, metric: Metric, shape: Shape, file: &Path) -> Result<(u64, Vec<u8>)> {
    let folder = tempfile::tempdir().context("make a temporary folder")?;
    let encoded = folder.path().join("encoded");
    let size = format!("{}x{}", shape.width, shape.height);
    let raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", &size, "-r", RATE, "-i"].map(OsStr::new);
    let options = video.encode(quality, metric);
    let input = raw.into_iter().chain([file.as_os_str()]);
    run(input.chain(["-threads", "1"].map(OsStr::new)).chain(options.iter().map(OsStr::new)).chain([encoded.as_os_str()]))?;
    let bytes = std::fs::metadata(&encoded).with_context(|| format!("look at {}", encoded.display()))?.len();
    let (format, filter) = video.decode();
    // A stream without times of its own gets the rate it was encoded with; a GIF brings its times.
    let rate: &[&str] = if video == Video::Gif { &[] } else { &["-r", RATE] };
    let before: Vec<&str> = [&["-threads", "1", "-f", format], rate, &["-i"]].concat();
    let after = ["-vf", &filter, "-f", "rawvideo", "-"].map(OsStr::new);
    let decoded = run(before.into_iter().map(OsStr::new).chain([encoded.as_os_str()]).chain(after))?;
    let expected = shape.frame_bytes() * shape.frames as usize;
    if decoded.len() != expected {
        bail!("ffmpeg decoded {} bytes of raw frames, expected {expected}", decoded.len());
    }
    Ok((bytes, decoded))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codecs::Source;

    /// A gradient that moves.
    fn source(folder: &Path, width: u32, height: u32) -> Source {
        let shape = Shape { width, height, frames: 5 };
        let pixel = |frame: u32, x: u32, y: u32| [2 * x + 8 * frame, 4 * y, 60 + x + y].map(|v| v.min(255) as u8);
        let frames = (0..5).flat_map(|f| (0..height).flat_map(move |y| (0..width).flat_map(move |x| pixel(f, x, y))));
        Source::new(shape, frames.collect(), folder, "gradient").unwrap()
    }

    #[test]
    fn steps_go_from_coarse_to_fine_and_colours_come_back() {
        let Some(ffmpeg) = Ffmpeg::find() else { return };
        let folder = tempfile::tempdir().unwrap();
        let source = source(folder.path(), 64, 48);
        for video in Video::all([128, 8]).into_iter().filter(|&video| ffmpeg.has(video)) {
            let steps = video.steps();
            let ends = [steps[0], steps[steps.len() - 1]].map(|quality| {
                let (bytes, decoded) = round_trip(video, quality, Metric::Psnr, source.shape, &source.file).unwrap();
                (bytes, source.compare(&decoded).psnr)
            });
            assert!(ends[0].0 < ends[1].0, "{video:?}: {ends:?} bytes, dB");
            // A wrong matrix or range would stay below 30 dB.
            assert!(ends[0].1 < ends[1].1 && ends[1].1 > 35.0, "{video:?}: {ends:?} bytes, dB");
        }
    }

    #[test]
    fn what_fits_an_odd_screen_encodes_it() {
        let Some(ffmpeg) = Ffmpeg::find() else { return };
        let folder = tempfile::tempdir().unwrap();
        let source = source(folder.path(), 33, 25);
        let all = Video::all([128, 8]).into_iter().filter(|&video| ffmpeg.has(video));
        for video in all.filter(|video| video.fits(source.shape)) {
            assert!(round_trip(video, video.steps()[5], Metric::Ssim, source.shape, &source.file).is_ok(), "{video:?}");
        }
        assert!(!Video::H264(Chroma::Quarter, 8).fits(source.shape) && Video::H264(Chroma::Full, 8).fits(source.shape));
    }

    #[test]
    fn a_wrong_file_is_an_error() {
        if Ffmpeg::find().is_none() {
            return;
        }
        let shape = Shape { width: 64, height: 48, frames: 5 };
        let error = round_trip(Video::Gif, 256, Metric::Psnr, shape, Path::new("no/such/file.rgb")).unwrap_err();
        assert!(format!("{error:#}").contains("no/such/file.rgb"), "{error:#}");
    }
}
