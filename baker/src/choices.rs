//! What options of the command line choose between, in the words of `--help`.
//! `cli` makes the baker's settings of them.

use clap::ValueEnum;

/// How surfaces move between keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Time {
    /// Not at all: the picture jumps from key to key.
    Hold,
    /// Straight from key to key.
    Linear,
    /// On a curve through four keys.
    Cubic,
}

/// How surfaces bend between the corners of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Space {
    /// Not at all: straight from corner to corner.
    Linear,
    /// Evenly, by as much as the corners around say.
    Cubic,
}

/// How the bundle holds the source image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Storage {
    /// As it is: read from flash, no memory.
    Raw,
    /// Coded: smaller in flash, unpacked into memory.
    Packed,
}

/// What a texel of the source image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Texels {
    /// A byte: one of 256 colours. Loses next to no quality, and draws fastest.
    #[value(name = "8")]
    Eight,
    /// Half a byte: one of 16 colours. Of as many texels (--detail 0.017) real scenes took 16 to 42 % fewer bytes, for 0 to 0.4 dB against the
    /// antialiased scene, those of many colours for up to 1; the report says what the scene's own would come to. Smooth gradients show bands. A pixel
    /// takes 4.6 instructions more on a Cortex-M4, 8 on a Cortex-M0+.
    #[value(name = "4")]
    Four,
    /// Two bytes: any colour of the display, no palette. Gradients of more than 256 colours show no bands; no real scene measured gained in dB. A
    /// pixel takes two instructions more where the display swaps bytes, none else, but flash delivers twice as much.
    #[value(name = "565")]
    Direct,
}

/// How the surface is cut into charts and flattened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Charts {
    /// What costs least.
    Auto,
    /// Straight on, along parallel rays: for rooms, buildings, machines.
    Planes,
    /// As the camera sees it: for curved bodies and land.
    Sight,
    /// As the scene itself has it, or as its texture coordinates do; planes where there are none.
    Own,
}

/// Whether texels move inside charts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Rewarp {
    /// Where that costs least.
    Auto,
    /// Not at all.
    Off,
    /// In every chart but those whose texels are the scene's own.
    On,
}

/// Which of the surfaces that a cell sees it keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sheets {
    /// What is worth its bytes.
    Auto,
    /// All but the smallest.
    All,
}

/// How finely charts are outlined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Outlines {
    /// What is worth its bytes.
    Auto,
    /// Whole texels.
    #[value(name = "1")]
    One,
    /// Halves of texels.
    #[value(name = "2")]
    Two,
    /// Quarters of texels.
    #[value(name = "4")]
    Four,
}

/// What texels are coloured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Paint {
    /// The pixels that show them.
    Played,
    /// What lies there.
    Surface,
}
