//! The command line: what may be typed, and what it means.
//! Arguments come in; checked options go to `input`, `window`, `headless`, `render` and `measure`.

use crate::picture::Draw;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::str::FromStr;

/// Plays Cubist bundles: a film of a 3D scene, rendered from one source image and a sparse grid of key rays.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true, after_help = EXAMPLES)]
pub struct Cli {
    /// Files or figures instead of the window.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// The window's options.
    #[command(flatten)]
    pub show: Show,
}

const EXAMPLES: &str = "\
Examples:
  cubist-player                          bake the built-in demo and play it
  cubist-player street.cubist            play a bundle
  cubist-player lantern.toml             bake a scene (.toml .glb .gltf .obj .ply .stl), then play it
  cubist-player --headless street.cubist --out pictures
                                         no window: every frame as a PNG, and a GIF, into ./pictures
  cubist-player --headless --shot out.png --frames 10 street.cubist
                                         what the window shows at its tenth picture
  cubist-player render street.cubist --out frames --frames 0..30
  cubist-player measure street.cubist --json

Without a display the window's place is taken by files in ./cubist-demo.
H in the window lists the keys.";

/// What `cubist-player [BUNDLE | SCENE]` takes.
#[derive(Args, Debug)]
pub struct Show {
    /// A bundle, or a scene (builtin:NAME too) to bake first; left out: the built-in demo.
    #[arg(value_name = "BUNDLE | SCENE")]
    pub input: Option<PathBuf>,
    /// Opens no window: writes frame-0000.png ... and demo.gif into --out, or one picture with --shot.
    #[arg(long)]
    pub headless: bool,
    /// Writes what the window shows at picture N (--frames, else the first) as a PNG, then exits.
    #[arg(long, value_name = "FILE.png", value_parser = |name: &str| named(name, "png"))]
    pub shot: Option<PathBuf>,
    /// Shows N pictures, one frame after the other, then exits.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: Option<u32>,
    /// Where the files go when there is no window.
    #[arg(long, value_name = "DIR", default_value = "cubist-demo")]
    pub out: PathBuf,
    /// The window opens with N screen pixels to a pixel of the picture; left out: as many as fit the screen.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16))]
    pub scale: Option<u32>,
}

/// A file's name that ends in what it will be.
fn named(name: &str, kind: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(name);
    let so = path.extension().is_some_and(|end| end.eq_ignore_ascii_case(kind));
    if so { Ok(path) } else { Err(format!("a {} is written: expected FILE.{kind}", kind.to_uppercase())) }
}

/// The commands that need no window.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Writes frames as PNG files, exactly as the device shows them, and as a GIF.
    Render(Render),
    /// Prints bytes, working memory, and the work a frame takes.
    Measure(Measure),
}

/// What `cubist-player render` takes.
#[derive(Args, Debug)]
#[command(after_help = RENDER_EXAMPLES)]
pub struct Render {
    /// The bundle (a scene is baked first).
    pub bundle: PathBuf,
    /// Folder for frame-0000.png ...; made when missing.
    #[arg(long, value_name = "DIR", required_unless_present = "gif")]
    pub out: Option<PathBuf>,
    /// Frames A to B, B not included; A.. and ..B run to the end and from the start, A..=B includes B.
    #[arg(long, value_name = "A..B", default_value = "..")]
    pub frames: FrameRange,
    /// Takes every Nth of them only.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub every: u32,
    /// Writes a looping GIF too; a frame of more than 256 colours is reduced to that many.
    #[arg(long, value_name = "FILE.gif", value_parser = |name: &str| named(name, "gif"))]
    pub gif: Option<PathBuf>,
    /// Every pixel becomes a square of N x N.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub scale: u32,
    /// Antialiases outlines: four samples a pixel where surfaces meet, as the player's `smooth_row` does; such pixels take many times as long.
    #[arg(long)]
    pub smooth: bool,
    /// How texels become pixels [default: nearest].
    #[arg(long, value_name = "KIND", value_enum, default_value_t, hide_default_value = true)]
    pub texels: Texels,
}

/// How texels become pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Texels {
    /// The one that a pixel falls into: `row`
    #[default]
    Nearest,
    /// One of those around it, in a pattern of two by two pixels: `dithered_row`; not with --smooth
    Dithered,
    /// The mean of the four around it: `bilinear_row`, and `fine_row` with --smooth
    Bilinear,
}

impl Render {
    /// Refuses options that do not go together, before anything is loaded or baked.
    pub fn check(&self) -> Result<(), Usage> {
        if self.smooth && self.texels == Texels::Dithered {
            return Err(Usage("--smooth and --texels dithered: there are no such rows; take --texels nearest or bilinear".to_owned()));
        }
        Ok(())
    }

    /// How the player draws a row.
    pub fn draw(&self) -> Draw {
        match (self.texels, self.smooth) {
            (Texels::Nearest, false) => |player, y, row| player.row(y, row),
            (Texels::Nearest, true) => |player, y, row| player.smooth_row(y, row),
            (Texels::Dithered, _) => |player, y, row| player.dithered_row(y, row),
            (Texels::Bilinear, false) => |player, y, row| player.bilinear_row(y, row),
            (Texels::Bilinear, true) => |player, y, row| player.fine_row(y, row),
        }
    }
}

const RENDER_EXAMPLES: &str = "\
Examples:
  cubist-player render street.cubist --out frames
  cubist-player render street.cubist --out frames --frames 30..60 --every 10 --scale 2
  cubist-player render street.cubist --gif street.gif

Pixels are the device's RGB565 ones, widened to 8 bits a channel by repeating their high bits.";

/// What `cubist-player measure` takes.
#[derive(Args, Debug)]
#[command(after_help = MEASURE_EXAMPLES)]
pub struct Measure {
    /// The bundle (a scene is baked first).
    pub bundle: PathBuf,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub json: bool,
}

const MEASURE_EXAMPLES: &str = "\
Examples:
  cubist-player measure street.cubist
  cubist-player measure street.cubist --json | jq .work.torn_pixels.max";

/// A range of frames as typed; its end may be left to the bundle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    start: u32,
    /// Not included.
    end: Option<u32>,
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number =
            |part: &str| part.parse::<u32>().map_err(|_| format!("\"{part}\" is not a frame number; write A..B, A.., ..B or A..=B"));
        let Some((start, end)) = text.split_once("..") else {
            return Err(format!("\"{text}\" has no \"..\"; write A..B, A.., ..B or A..=B"));
        };
        let start = if start.is_empty() { 0 } else { number(start)? };
        let end = match end.strip_prefix('=') {
            Some(last) => Some(number(last)?.checked_add(1).ok_or("that frame number is too large")?),
            None if end.is_empty() => None,
            None => Some(number(end)?),
        };
        match end {
            Some(end) if end <= start => Err(format!("{text} holds no frame: the end must lie after the start")),
            _ => Ok(Self { start, end }),
        }
    }
}

impl FrameRange {
    /// The range within a bundle of `frames` frames.
    pub fn within(self, frames: u32) -> Result<std::ops::Range<u32>, Usage> {
        let end = self.end.unwrap_or(frames);
        if self.start >= frames || end > frames {
            let asked = self.end.map_or(format!("{}..", self.start), |end| format!("{}..{end}", self.start));
            return Err(Usage(format!("--frames {asked} reaches past the bundle, which has frames 0..{frames}")));
        }
        Ok(self.start..end)
    }
}

/// An option that does not go with the bundle it was given for: exit code 2.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}
impl std::error::Error for Usage {}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(text: &str) -> Result<std::ops::Range<u32>, String> {
        text.parse::<FrameRange>()?.within(10).map_err(|e| e.to_string())
    }

    #[test]
    fn ranges_read_as_in_rust() {
        assert_eq!(range("2..5"), Ok(2..5));
        assert_eq!(range("2..=5"), Ok(2..6));
        assert_eq!(range(".."), Ok(0..10));
        assert_eq!(range("..4"), Ok(0..4));
        assert_eq!(range("9.."), Ok(9..10));
    }

    #[test]
    fn bad_ranges_say_why() {
        for (text, reason) in [
            ("5", "has no \"..\""),
            ("a..5", "\"a\" is not a frame number"),
            ("1..2..3", "\"2..3\" is not a frame number"),
            ("-1..3", "\"-1\" is not a frame number"),
            ("3..3", "holds no frame"),
            ("5..2", "holds no frame"),
            ("..=4294967295", "too large"),
            ("0..11", "0..11 reaches past the bundle, which has frames 0..10"),
            ("10..", "10.. reaches past"),
        ] {
            let error = range(text).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
        let cli = Cli::try_parse_from(["cubist-player", "--headless", "--shot", "a.png", "--frames", "3", "b.cubist"]).unwrap();
        assert!(cli.show.headless && cli.show.frames == Some(3) && cli.command.is_none());
        assert!(Cli::try_parse_from(["cubist-player", "render", "b.cubist"]).is_err(), "neither --out nor --gif");
        assert!(Cli::try_parse_from(["cubist-player", "--frames", "0"]).is_err());
    }
}
