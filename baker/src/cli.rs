//! The command line: what may be typed, and what it means.
//! Arguments come in; checked options go to `main`.

use crate::choices::{Charts, Outlines, Paint, Rewarp, Sheets, Space, Storage, Texels, Time};
use clap::{Args, Parser, Subcommand};
use cubist_baker::atlas;
use cubist_baker::chart::Family;
use cubist_baker::scene::Up;
use cubist_baker::{Goal, Options, TruthFrames};
use cubist_core::format::{SPACE_CUBIC, SPACE_LINEAR, TIME_CUBIC, TIME_HOLD, TIME_LINEAR, TexelKind};
use std::path::PathBuf;

/// Bakes a 3D scene and a camera path into a small bundle that plays on microcontrollers.
#[derive(Debug, Parser)]
#[command(name = "cubist-bake", version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, after_help = EXAMPLES)]
pub struct Cli {
    /// Anything but baking.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Baking.
    #[command(flatten)]
    pub bake: Bake,
}

const EXAMPLES: &str = "\
Examples:
  cubist-bake lantern.toml -o lantern.cubist
  cubist-bake fox.glb -o fox.cubist --size 240x240 --frames 90 --looping
                                         a model alone: a full circle around it
  cubist-bake fox.glb -o fox.cubist --quick
                                         a first look: nothing is tried
  cubist-bake builtin:street -o street.cubist --report street.json
  cubist-bake fox.glb -o fox.cubist --budget 64K
                                         at most 64 x 1024 bytes, at the best quality that fits
  cubist-bake fox.glb -o fox.cubist --psnr 32
                                         the smallest bundle of that quality
  cubist-bake fox.glb -o fox.cubist --ram 48K
                                         for a player with 48 x 1024 bytes of working memory
  cubist-bake fox.glb -o fox.cubist --storage packed
                                         the source image coded: less flash, more memory
  cubist-bake fox.glb -o fox.cubist --texels 4
                                         16 colours: half the source image, for little where colours are few
  cubist-bake inspect fox.cubist         what a bundle holds, byte by section

If something looks wrong, --diagnostics DIR shows the source image, and exact frames next to played ones.
Exit codes: 0 done, 1 the input is at fault, 2 usage, 130 interrupted.";

/// The commands besides baking.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Prints what a bundle holds: sections, header, keys, source image, labels, memory, limits.
    Inspect(Inspect),
    /// Measures ray casting on a scene against its ray library alone, with the same rays.
    Throughput(Throughput),
}

/// What `cubist-bake SCENE` takes.
#[derive(Args, Debug)]
pub struct Bake {
    /// A scene file (.toml), a model (.glb .gltf .obj .ply .stl), or builtin:NAME.
    #[arg(required = true)]
    pub scene: Option<String>,
    /// The bundle to write; folders on the way are made.
    #[arg(short, long, value_name = "OUT.cubist", required = true)]
    pub output: Option<PathBuf>,
    /// What replaces the scene's playback.
    #[command(flatten)]
    pub playback: Playback,
    /// Side of a cell of the key-ray grid, pixels: 4, 8, 16 or 32 [default: 8; 16 on screens over 640 wide, 32 over 2560].
    ///
    /// Smaller cells follow outlines better and take more bytes and memory. Cells of 16 are what small memories want first: half of it or so, about
    /// half fewer bytes of keys, and up to an eighth fewer instructions. Scenes of large flat faces show hardly a difference on a display then, models
    /// lose .5 to 3.5 dB.
    ///
    /// Where neither this nor --key-interval is given, lattices and foliage get cells half as large with keys twice as far apart, and rough land, smooth
    /// bodies and fast paths cells twice as large with keys twice as close, or usual cells with keys closer still, if that shows more for the bytes.
    #[arg(long, value_name = "PX", value_parser = cell)]
    pub cell: Option<u32>,
    /// Frames between keys, 1 to 256 [default: 8; 16 or more where that shows as much for the bytes, fewer where that shows more].
    ///
    /// That is the mean: keys stand closer where the view turns quickly, where motion stops, starts, turns or jumps at once, and at a path's ends, unless
    /// --even-keys says otherwise.
    ///
    /// Keys twice as far apart take a third fewer bytes and half as much of every frame's time. Each holds more, for what comes into view between two of
    /// them: that is up to a sixth more memory. Without this and --cell they are tried where surfaces go nearly straight on from key to key, and closer
    /// ones where that leads nowhere, and on fast paths, down to a key a frame: what is seen of either beside the antialiased scene decides, and what it
    /// takes.
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub key_interval: Option<u32>,
    /// Keys stand every --key-interval frames, whether or not they are needed there.
    ///
    /// Every key then takes the same time to come in; quality is a little lower.
    #[arg(long)]
    pub even_keys: bool,
    /// How surfaces move between keys [default: cubic].
    ///
    /// The player holds two keys more for cubic, which is about a quarter of its memory; linear and hold take the same.
    #[arg(long, value_enum, value_name = "KIND")]
    pub time: Option<Time>,
    /// How surfaces bend between the corners of cells [default: linear where that is worth as much, else cubic].
    ///
    /// Cubic bends every cell evenly across and down, by as much as the corners around it say: large flat surfaces seen at a slant want that. Linear
    /// takes less memory, and draws in a twentieth to a sixth fewer instructions; on most models of many small faces nothing
    /// shows the difference. Without this both are made in cells of 4 and 8 pixels, and the report has the figures of both, unless surfaces are so
    /// rough, or bend so smoothly, that one is sure. Searches (--budget, --psnr) try cubic, beside what is baked without them; --ram tries what fits.
    #[arg(long, value_enum, value_name = "KIND")]
    pub space: Option<Space>,
    /// Largest side of the source image, texels, 64 to 1024.
    #[arg(long, value_name = "MAX_SIDE", default_value_t = atlas::Settings::default().max_side, value_parser = clap::value_parser!(u32).range(64..=1024))]
    pub atlas: u32,
    /// Texels a pixel where a surface is seen closest, at most, 0.05 to 8; 0.7 halves the source image.
    #[arg(long, value_name = "RATIO", default_value_t = atlas::Settings::default().density, value_parser = density)]
    pub density: f64,
    /// How many bytes detail is worth: 0.001 to 100, or all. More keeps more texels and makes the source image larger [default: 0.03].
    ///
    /// Plain walls get few texels, and print on them many. For each chart, the bytes of its texels are weighed against what they would show. WORTH is what
    /// one pixel of one frame counts whose colour is eight levels of 255 off because its texel is longer than the pixel. One that is sixteen levels off
    /// counts four times as much. One whose texel is twice as long as the pixel counts an eighth of WORTH, whatever its colour. A path counts 128 frames
    /// more than it has.
    ///
    /// All gives every chart the texels that --density asks for. Bundles of models then take a third to a half more bytes, those of a street or a room
    /// three times as many, for .2 to 1.3 dB. With 0.1 a model took a third more for .9 dB (1.3 with softened outlines), a street a third more for .3 dB,
    /// and a room four fifths more for .1 dB.
    ///
    /// A scene that brings a flattening of its own, as built-in ones do, keeps its texels. With --budget the search may keep all, unless this is given.
    #[arg(long, value_name = "WORTH")]
    pub detail: Option<Detail>,
    /// What a texel of the source image is, and so what it costs [default: 8].
    ///
    /// A player names the kinds it plays in its type: Player of Indexed8 (which Player alone means), of Indexed4, of Direct565, or of
    /// AnyTexels; a firmware links the code of no others. All kinds are stored --storage raw or packed. With --budget the search may take 4 where 8 do not
    /// fit or show less, unless this is given.
    #[arg(long, value_enum, value_name = "BITS")]
    pub texels: Option<Texels>,
    /// Colours of the source image, at most, 2 to 256; at most 16 with --texels 4, none with 565 [default: 256; 16 with --texels 4].
    ///
    /// They are chosen for what is seen, in Oklab, and rounded to what an RGB565 display shows. Fewer save next to nothing raw, but pack better.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=256))]
    pub colours: Option<u16>,
    /// How the bundle holds the source image [default: raw].
    ///
    /// Raw plays straight from flash, at no memory. Packed takes a tenth to a third of the bytes and is unpacked once, before the first frame,
    /// into memory: a byte a texel and the mask, at some hundred instructions each. Where flash is slow and memory is not, as on
    /// an RP2040, drawing can then be faster. With --budget the search may pack what does not fit raw, unless this is given; --ram counts it.
    #[arg(long, value_enum, value_name = "KIND")]
    pub storage: Option<Storage>,
    /// How the surface is cut into charts and flattened.
    ///
    /// Auto tries all on the scene at half the size, and keeps what costs least in bytes and quality; the report says why. A scene that brings a
    /// flattening of its own, as built-in ones do, keeps it.
    #[arg(long, value_enum, value_name = "KIND", default_value_t = Charts::Auto)]
    pub charts: Charts,
    /// Whether texels move inside charts to where their detail is seen [default: auto].
    ///
    /// Land that reaches from the camera to the horizon is then finer near than far. Auto tries it where --charts tries, after the best of those.
    #[arg(long, value_enum, value_name = "KIND", default_value_t = Rewarp::Auto)]
    pub rewarp: Rewarp,
    /// What a bit of the keys is worth: auto, or 0 to 100. A larger number takes fewer bytes, at less quality.
    ///
    /// Auto tries 0.01, 0.05, 0.2 and 1, and takes the largest that pays: half the keys' bytes may cost 1.55 dB. Rough land is as good at 1. A flat picture
    /// of fine stripes needs 0.01. By the same rule auto then tries to store positions in steps twice to eight times as coarse. The searches for --budget
    /// and --psnr choose the number themselves.
    #[arg(long, value_name = "WORTH", value_parser = lambda, default_value = "auto")]
    pub lambda: Worth,
    /// Which of the surfaces that a cell sees it keeps.
    ///
    /// Auto leaves out of a cell what shows less there than its bytes are worth, as --lambda counts them, and only where a bundle without it is worth more:
    /// keys of models take a tenth to a third fewer bytes then, and their player up to half less memory, for 0 to .2 dB. All keeps whatever covers
    /// eight pixels of a cell in all frames between two keys, fewer where these are a frame or two.
    #[arg(long, value_enum, value_name = "KIND", default_value_t = Sheets::Auto)]
    pub sheets: Sheets,
    /// What texels are coloured by.
    ///
    /// Played: the mean of what the scene has in the pixels that show a texel, the colour with which nearest texels come closest to it: .4 to 2.5 dB closer
    /// to the antialiased scene for the same bytes, most where detail is finer than a pixel. Looks at 128 frames, which takes a second or two. Surface:
    /// what lies there, as the scene has it; where textures have sharp edges, rows with bilinear texels are .2 to 1.7 dB better so.
    #[arg(long, value_enum, value_name = "KIND", default_value_t = Paint::Played)]
    pub paint: Paint,
    /// How finely the source image's charts are outlined: bits a texel, each way.
    ///
    /// Bars, railings and leaves about as thin as a texel want finer outlines than texels. They take as much flash as a quarter (2) to as much as all of
    /// the texels (4) where most of a picture is such, next to nothing where charts are large; nothing else changes. Lattices gain 1 to 3 dB, bodies of
    /// few outlines nothing. Auto tries them where many outlines cross the picture, and takes what is worth its bytes: twice the bundle has to bring 1.55 dB.
    /// --budget takes them where there is room; the search for --psnr tries 1.
    #[arg(long, value_enum, value_name = "BITS", default_value_t = Outlines::Auto)]
    pub outline: Outlines,
    /// Every Nth key needs no earlier one: a seek decodes at most N + 3 keys, N + 1 where time is straight or held.
    ///
    /// Playing backwards is such a seek at every key. With 4 it takes half, for up to 3 % more bytes; `cubist-player measure` tells keys a frame
    /// backwards.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub independent_every: u16,
    /// A first look: nothing is tried, in an eighth to two fifths of the time.
    ///
    /// Charts are planes, keys stand every 4 frames, space is cubic, and all sheets are kept, as far as options do not say otherwise. On slow paths that is
    /// about as good for up to two and a half times the bytes; on fast ones it is worse, since keys would stand closer.
    #[arg(long, conflicts_with_all = ["budget", "psnr", "ram"])]
    pub quick: bool,
    /// The whole bundle takes at most this many bytes (also 256K, 2M), at the best quality that does.
    ///
    /// Quality is measured against the antialiased scene; cells, keys and the source image are searched. What is baked without a budget is taken
    /// where it fits and shows more. With --ram the bundle plays in that memory as well.
    #[arg(long, value_name = "BYTES", value_parser = budget, allow_negative_numbers = true, conflicts_with = "psnr")]
    pub budget: Option<u64>,
    /// The smallest bundle whose mean PSNR against exact rays through its source image reaches this many dB.
    ///
    /// Cells and keys are searched; the source image stays as --atlas and --density ask, and gets coarser only where nothing
    /// else reaches the goal. What is baked without a goal is taken where it reaches this one in fewer bytes. With --ram the bundle plays in that
    /// memory as well.
    #[arg(long, value_name = "DB", value_parser = psnr, allow_negative_numbers = true)]
    pub psnr: Option<f64>,
    /// Playing takes at most this many bytes of working memory (also 48K), at the best quality that does.
    ///
    /// A bundle that needs no more stays as it is. Else linear --time, linear --space, larger cells and closer keys are tried, each unless it is
    /// given (a given cell may grow all the same), and from what fits on to what is worth more; where much is lost other --charts too, and where
    /// nothing fits more sheets are left out. What was given up is said at the end. A row of pixels comes on top: two bytes each. Where flash is
    /// short as well, --budget goes with it, and --psnr where quality is given: both keep a given cell, and search linear --time and --space beside
    /// the rest.
    #[arg(long, value_name = "BYTES", value_parser = budget, allow_negative_numbers = true)]
    pub ram: Option<u64>,
    /// Writes bytes, seconds, quality and warnings as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Writes pictures of the source image, and of three frames and the worst one; an earlier bake's there go.
    ///
    /// source-image.png: with the charts' borders; mask.png: its covered texels; never-seen.png: covered texels that no pixel of any frame falls
    /// on, in magenta; density.png: texels a pixel where a surface is seen closest, over what was asked for, from a quarter (blue: too coarse)
    /// to four times that (red: more than needed). frame-NNNN-exact.png, -played.png and -compare.png: cast, played, and both with their
    /// difference four times as strong, each in the source image's colours; frame-NNNN-scene.png: the antialiased scene in its own;
    /// frame-NNNN-rays.png: where the frame's rays fall in the source image, with the key-ray grid's corners and lines between those that see one
    /// surface.
    #[arg(long, value_name = "DIR")]
    pub diagnostics: Option<PathBuf>,
    /// Frames compared with the antialiased scene: a number (evenly spread over the path), all, or none.
    #[arg(long, value_name = "FRAMES", default_value = "16", value_parser = truth)]
    pub truth: TruthFrames,
    /// Threads; the bundle is the same on any number [default: all processors].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// No progress, no table, no warnings: errors only.
    #[arg(long)]
    pub quiet: bool,
}

/// What replaces the scene's playback.
#[derive(Args, Clone, Copy, Debug)]
pub struct Playback {
    /// Screen, pixels: 320x240; up to 4096 a side.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Frames, 1 to 65535.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_535))]
    pub frames: Option<u32>,
    /// Frames per second, 1 to 1000.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub fps: Option<u16>,
    /// Frame 0 follows the last frame.
    #[arg(long)]
    pub looping: bool,
    /// The model's axis that points up: x, y, z, -x, -y or -z [default: as the scene file says, else z for .stl, y for others].
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub up: Option<Up>,
    /// Turns the picture clockwise: 90, 180 or 270 degrees [default: 0].
    ///
    /// For a display that is mounted on its side: its own rows are then the bundle's, and nothing tears along a diagonal. The size is that before
    /// turning: 320x240 turned by 90 makes a bundle of 240x320.
    #[arg(long, value_name = "DEGREES", value_parser = quarters)]
    pub turn: Option<u8>,
}

/// Quarters of a full turn.
fn quarters(text: &str) -> Result<u8, String> {
    match text {
        "0" => Ok(0),
        "90" => Ok(1),
        "180" => Ok(2),
        "270" => Ok(3),
        _ => Err("expected 0, 90, 180 or 270 degrees".to_owned()),
    }
}

/// What `cubist-bake inspect` takes.
#[derive(Args, Debug)]
pub struct Inspect {
    /// The bundle.
    pub bundle: PathBuf,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub json: bool,
}

/// What `cubist-bake throughput` takes.
#[derive(Args, Debug)]
pub struct Throughput {
    /// A scene file (.toml), a model (.glb .gltf .obj .ply .stl), or builtin:NAME.
    pub scene: String,
    /// What replaces the scene's playback.
    #[command(flatten)]
    pub playback: Playback,
    /// Threads [default: all processors].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub json: bool,
}

impl Bake {
    /// What is wrong with options that do not go together.
    #[must_use]
    pub fn clash(&self) -> Option<String> {
        match (self.texels, self.colours?) {
            (Some(Texels::Four), colours @ 17..) => Some(format!(
                "--colours {colours}: expected at most 16, which is what --texels 4 can tell apart; lower it, or use --texels 8"
            )),
            (Some(Texels::Direct), _) => {
                Some("--colours: --texels 565 has no palette to limit; leave it out, or use --texels 8".to_owned())
            }
            _ => None,
        }
    }

    /// The baker's options.
    #[must_use]
    pub fn options(&self, load_seconds: f64) -> Options {
        let ram = self.ram.map(|ram| usize::try_from(ram).unwrap_or(usize::MAX));
        let goal = match (self.budget, self.psnr) {
            (Some(budget), _) => Some(Goal::Budget(budget)),
            (None, Some(psnr)) => Some(Goal::Psnr(psnr)),
            (None, None) => ram.map(Goal::Ram),
        };
        let time = |time| match time {
            Time::Hold => TIME_HOLD,
            Time::Linear => TIME_LINEAR,
            Time::Cubic => TIME_CUBIC,
        };
        let charts = match self.charts {
            Charts::Auto => None,
            Charts::Planes => Some(Family::Planes),
            Charts::Sight => Some(Family::Sight),
            Charts::Own => Some(Family::Own),
        };
        let storage = |storage| if storage == Storage::Raw { atlas::Storage::Raw } else { atlas::Storage::Packed };
        let kind = |texels| match texels {
            Texels::Eight => TexelKind::Indexed8,
            Texels::Four => TexelKind::Indexed4,
            Texels::Direct => TexelKind::Direct565,
        };
        let texels = self.texels.map(kind);
        let space = |space| if space == Space::Linear { SPACE_LINEAR } else { SPACE_CUBIC };
        let options = Options {
            cell: self.cell,
            key_interval: self.key_interval,
            time: self.time.map(time),
            space: self.space.map(space),
            even_keys: self.even_keys,
            source: atlas::Settings {
                max_side: self.atlas,
                density: self.density,
                colours: self.colours.map_or(texels.unwrap_or_default().colours(), usize::from),
                outline: match self.outline {
                    Outlines::Auto => None,
                    Outlines::One => Some(0),
                    Outlines::Two => Some(1),
                    Outlines::Four => Some(2),
                },
                ..atlas::Settings::default()
            },
            detail: self.detail.map(|Detail(worth)| worth),
            texels,
            storage: self.storage.map(storage),
            charts: charts.map(Into::into),
            rewarp: match self.rewarp {
                Rewarp::Auto => None,
                Rewarp::Off => Some(false),
                Rewarp::On => Some(true),
            },
            lambda: match self.lambda {
                Worth::Auto => None,
                Worth::Of(worth) => Some(worth as f32),
            },
            independent_every: self.independent_every.into(),
            all_sheets: self.sheets == Sheets::All,
            plain: self.paint == Paint::Surface,
            quick: false,
            goal,
            room: ram.filter(|_| !matches!(goal, Some(Goal::Ram(_)))),
            truth: self.truth,
            load_seconds,
        };
        if self.quick { options.quick() } else { options }
    }
}

fn cell(text: &str) -> Result<u32, String> {
    match text {
        "4" | "8" | "16" | "32" => text.parse().map_err(|_| String::new()),
        _ => Err("expected 4, 8, 16 or 32 pixels".to_owned()),
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let expected = || "expected WIDTHxHEIGHT, as in 320x240, 1 to 4096 pixels each".to_owned();
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
    let side = |text: &str| text.parse().ok().filter(|side| (1..=4096).contains(side)).ok_or_else(expected);
    Ok((side(width)?, side(height)?))
}

/// A number of bytes; K is 1024 of them, M 1024 K. Fractions are fine before K and M: 1.5M.
fn budget(text: &str) -> Result<u64, String> {
    let expected = || "expected a number of bytes, as in 65536, 64K or 1.5M".to_owned();
    let (digits, unit) = match text.as_bytes().last().map(u8::to_ascii_uppercase) {
        Some(b'K') => (&text[..text.len() - 1], 1u64 << 10),
        Some(b'M') => (&text[..text.len() - 1], 1 << 20),
        _ => (text, 1),
    };
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit() || (b == b'.' && unit > 1)) {
        return Err(expected());
    }
    let bytes = if digits.contains('.') {
        // A cast saturates: what is too large stays too large.
        (digits.parse::<f64>().map_err(|_| expected())? * unit as f64) as u64
    } else {
        digits.parse::<u64>().ok().and_then(|whole| whole.checked_mul(unit)).ok_or_else(expected)?
    };
    if bytes == 0 { Err(expected()) } else { Ok(bytes) }
}

fn ranged(text: &str, range: std::ops::RangeInclusive<f64>, what: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value| range.contains(value)).ok_or_else(|| format!("expected {what}, {} to {}", range.start(), range.end()))
}

fn density(text: &str) -> Result<f64, String> {
    ranged(text, 0.05..=8.0, "texels a pixel")
}

/// What detail is worth, bytes; infinite: all there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail(pub f64);

impl std::str::FromStr for Detail {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" { Ok(Self(f64::INFINITY)) } else { ranged(text, 0.001..=100.0, "all, or bytes").map(Self) }
    }
}

/// What a bit of the keys is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Worth {
    /// What pays.
    Auto,
    /// This.
    Of(f64),
}

fn lambda(text: &str) -> Result<Worth, String> {
    if text == "auto" {
        return Ok(Worth::Auto);
    }
    ranged(text, 0.0..=100.0, "auto, or what a bit is worth").map(Worth::Of)
}

fn psnr(text: &str) -> Result<f64, String> {
    ranged(text, 1.0..=99.0, "decibels")
}

fn truth(text: &str) -> Result<TruthFrames, String> {
    match text {
        "all" => Ok(TruthFrames::All),
        "none" => Ok(TruthFrames::None),
        _ => match text.parse::<u32>() {
            Ok(0) => Ok(TruthFrames::None),
            Ok(most) => Ok(TruthFrames::Most(most)),
            Err(_) => Err("expected a number of frames, all, or none".to_owned()),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn budgets_count_in_1024s() {
        for (text, bytes) in [("1", 1), ("65536", 65_536), ("256K", 262_144), ("2M", 2_097_152), ("2m", 2_097_152), ("1.5k", 1536)] {
            assert_eq!(budget(text), Ok(bytes), "{text}");
        }
        for text in [
            "",
            "K",
            "0",
            "0K",
            "-1",
            "1.5",
            "1e3",
            "64KB",
            "64 K",
            "K64",
            "99999999999999999999",
            "99999999999999999M",
            "1.2.3K",
            "µ",
            "6µ",
        ] {
            assert!(budget(text).is_err(), "{text}");
        }
    }

    #[test]
    fn sizes_are_width_and_height() {
        assert_eq!(size("320x240"), Ok((320, 240)));
        assert_eq!(size("64X48"), Ok((64, 48)));
        for text in ["320", "320x", "x240", "0x240", "320x5000", "-1x5", "320x240x3", "320 x 240"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
        let cli = Cli::try_parse_from(["cubist-bake", "a.toml", "-o", "a.cubist", "--budget", "64K", "--truth", "all"]).unwrap();
        let options = cli.bake.options(0.5);
        assert_eq!((options.goal, options.truth, options.load_seconds), (Some(Goal::Budget(65_536)), TruthFrames::All, 0.5));
        let wanted = ["cubist-bake", "a.glb", "-o", "a.cubist", "--ram", "16K", "--time", "linear", "--space", "cubic", "--even-keys"];
        let options = Cli::try_parse_from(wanted).unwrap().bake.options(0.0);
        assert_eq!((options.goal, options.room, options.even_keys), (Some(Goal::Ram(16_384)), None, true));
        for (beside, goal) in [(["--budget", "64K"], Goal::Budget(65_536)), (["--psnr", "30"], Goal::Psnr(30.0))] {
            let wanted = ["cubist-bake", "a.glb", "-o", "a.cubist", "--ram", "16K"].into_iter().chain(beside);
            let options = Cli::try_parse_from(wanted).unwrap().bake.options(0.0);
            assert_eq!((options.goal, options.room), (Some(goal), Some(16_384)));
        }
        assert_eq!((options.time, options.space), (Some(TIME_LINEAR), Some(SPACE_CUBIC)));
        let quick = ["cubist-bake", "a.glb", "-o", "a.cubist", "--quick", "--key-interval", "9"];
        let options = Cli::try_parse_from(quick).unwrap().bake.options(0.0);
        assert_eq!((options.quick, options.key_interval, options.space, options.all_sheets), (true, Some(9), Some(SPACE_CUBIC), true));
        let packed = Cli::try_parse_from(["cubist-bake", "a.glb", "-o", "a.cubist", "--storage", "packed"]).unwrap().bake.options(0.0);
        assert_eq!((packed.source().storage, packed.source().outline), (atlas::Storage::Packed, None));
        let fine = Cli::try_parse_from(["cubist-bake", "a.glb", "-o", "a.cubist", "--outline", "4"]).unwrap().bake.options(0.0);
        assert_eq!(fine.source().outline, Some(2));
        let texels = |options: &[&str]| {
            let given = ["cubist-bake", "a.glb", "-o", "a.cubist"].iter().chain(options);
            let bake = Cli::try_parse_from(given).unwrap().bake;
            let atlas::Settings { texels, colours, .. } = bake.options(0.0).source();
            (bake.clash(), texels, colours)
        };
        assert_eq!(texels(&[]), (None, TexelKind::Indexed8, 256));
        assert_eq!(texels(&["--texels", "4"]), (None, TexelKind::Indexed4, 16));
        assert_eq!(texels(&["--texels", "4", "--colours", "9"]), (None, TexelKind::Indexed4, 9));
        assert_eq!(texels(&["--texels", "565"]).1, TexelKind::Direct565);
        // Given or not is another matter than which.
        let given = |options: &[&str]| {
            let bake = Cli::try_parse_from(["cubist-bake", "a.glb", "-o", "a.cubist"].iter().chain(options)).unwrap().bake;
            bake.options(0.0).texels
        };
        assert_eq!((given(&[]), given(&["--texels", "8"])), (None, Some(TexelKind::Indexed8)));
        assert!(texels(&["--texels", "4", "--colours", "17"]).0.unwrap().contains("at most 16"));
        assert!(texels(&["--texels", "565", "--colours", "16"]).0.unwrap().contains("no palette"));
        assert!(Cli::try_parse_from(["cubist-bake", "inspect", "a.cubist", "--json"]).unwrap().command.is_some());
        for wrong in [
            &["cubist-bake", "a.toml"][..],
            &["cubist-bake", "a.toml", "-o", "b", "--budget", "1K", "--psnr", "30"],
            &["cubist-bake", "a.toml", "-o", "b", "--quick", "--ram", "30K"],
            &["cubist-bake", "a.toml", "-o", "b", "--time", "square"],
            &["cubist-bake", "a.toml", "-o", "b", "--space", "hold"],
            &["cubist-bake", "a.toml", "-o", "b", "--storage", "zip"],
            &["cubist-bake", "a.toml", "-o", "b", "--texels", "16"],
            &["cubist-bake", "a.toml", "-o", "b", "--cell", "7"],
            &["cubist-bake", "a.toml", "-o", "b", "--outline", "3"],
            &["cubist-bake", "a.toml", "-o", "b", "--psnr", "nan"],
            &["cubist-bake", "a.toml", "-o", "b", "--atlas", "32"],
            &["cubist-bake", "a.toml", "-o", "b", "--truth", "some"],
        ] {
            assert!(Cli::try_parse_from(wrong).is_err(), "{wrong:?}");
        }
    }
}
