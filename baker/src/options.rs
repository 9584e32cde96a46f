//! What a user asks of a bundle, and which settings follow from it. The command line fills it in, `job` carries it out.

use crate::atlas::{self, Storage};
use crate::bake::{Settings, Sparing};
use crate::chart::Choice;
use cubist_core::format::{SPACE_CUBIC, TexelKind};

/// Screens wider than this get cells of 16 pixels unless told otherwise,
const WIDE: u32 = 640;
/// and of 32: of smaller ones there are more than a bundle holds.
const VAST: u32 = 2560;

/// Frames between keys where nothing is tried.
const QUICK_INTERVAL: u32 = 4;

/// What the bundle is to reach, by a search for the settings that do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// At most this many bytes, at the best quality that fits.
    Budget(u64),
    /// The fewest bytes with at least this mean PSNR, dB, against exact ray casting.
    Psnr(f64),
    /// At most this many bytes of working memory for playing, at the best quality that fits.
    Ram(usize),
}

/// What a bundle has to keep within.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Limits {
    /// Its bytes,
    pub bytes: Option<u64>,
    /// and those of working memory for playing it.
    pub memory: Option<usize>,
}

impl Limits {
    /// By how many bytes of either kind a bundle of so many `bytes` that plays in so much `memory` is too large.
    pub fn over(&self, bytes: u64, memory: usize) -> u64 {
        let flash = self.bytes.map_or(0, |most| bytes.saturating_sub(most));
        flash + self.memory.map_or(0, |most| memory.saturating_sub(most) as u64)
    }
}

/// The frames to compare with the antialiased scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TruthFrames {
    /// None.
    None,
    /// At most this many, evenly spread.
    Most(u32),
    /// All.
    All,
}

/// What the user asks of a bundle.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Side of a cell, pixels; `None`: the baker chooses.
    pub cell: Option<u32>,
    /// Frames between keys; `None`: the baker chooses.
    pub key_interval: Option<u32>,
    /// How layers are interpolated between keys: one of the format's `TIME_` numbers; `None`: the baker chooses.
    pub time: Option<u8>,
    /// How they are interpolated between nodes: one of the format's `SPACE_` numbers; `None`: the baker chooses.
    pub space: Option<u8>,
    /// Keys stand at even intervals, not where they are needed most.
    pub even_keys: bool,
    /// The source image; a search may make it coarser.
    pub source: atlas::Settings,
    /// What its detail is worth, in place of `source.detail`; `None`: as that says, but a search for a budget may keep all of it.
    pub detail: Option<f64>,
    /// What a texel is, in place of `source.texels`; `None`: as that says, but a search for a budget may take half a byte instead of a whole one.
    pub texels: Option<TexelKind>,
    /// How the bundle holds it, in place of `source.storage`; `None`: as that says, but a search for a budget may pack it.
    pub storage: Option<Storage>,
    /// How the surface is cut and flattened, in place of `source.charts`; `None`: the baker tries.
    pub charts: Option<Choice>,
    /// Whether texels move inside charts to where their detail is seen; `None`: the baker tries, where it tries charts.
    pub rewarp: Option<bool>,
    /// What a bit of the keys is worth, as [`Settings::coding`] has it; `None`: as much as hardly shows.
    pub lambda: Option<f32>,
    /// Every this many keys one that needs no earlier one.
    pub independent_every: usize,
    /// Keeps sheets that take more than what they show is worth.
    pub all_sheets: bool,
    /// Texels keep the colours of what lies there, whatever playback makes of them.
    pub plain: bool,
    /// Nothing is tried: what is left open is what mostly does.
    pub quick: bool,
    /// What to reach; `None`: what the settings give.
    pub goal: Option<Goal>,
    /// Bytes of working memory that playing may take beside another goal than [`Goal::Ram`]; `None`: a search takes what is usual.
    pub room: Option<usize>,
    /// How much is compared with the truth.
    pub truth: TruthFrames,
    /// Seconds that reading the scene took, for the report.
    pub load_seconds: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            cell: None,
            key_interval: None,
            time: None,
            space: None,
            even_keys: false,
            source: atlas::Settings::default(),
            detail: None,
            texels: None,
            storage: None,
            charts: None,
            rewarp: None,
            lambda: None,
            independent_every: Settings::default().coding.independent_every,
            all_sheets: false,
            plain: false,
            quick: false,
            goal: None,
            room: None,
            truth: TruthFrames::Most(16),
            load_seconds: 0.0,
        }
    }
}

impl Options {
    /// The same with nothing left open that would be tried, but for charts, which the scene may bring.
    #[must_use]
    pub fn quick(self) -> Self {
        Self {
            key_interval: self.key_interval.or(Some(QUICK_INTERVAL)),
            space: self.space.or(Some(SPACE_CUBIC)),
            source: atlas::Settings { outline: self.source.outline.or(Some(0)), ..self.source },
            rewarp: self.rewarp.or(Some(false)),
            all_sheets: true,
            quick: true,
            ..self
        }
    }

    /// The settings for a screen `width` pixels wide, the baker's choices filled in.
    #[must_use]
    pub fn settings(&self, width: u32) -> Settings {
        let mut settings = Settings { atlas: self.source(), ..Settings::default() };
        settings.coding.independent_every = self.independent_every;
        settings.coding.lambda = self.lambda.unwrap_or(settings.coding.lambda);
        // The other searches look for what a bit is worth themselves.
        let spares = self.lambda.is_none() && matches!(self.goal, None | Some(Goal::Ram(_)));
        settings.sparing = if spares { Sparing::Unseen } else { Sparing::Nothing };
        let wide = if width > VAST { 32 } else { 16 };
        settings.cell = self.cell.unwrap_or(if width > WIDE { wide } else { settings.cell });
        settings.key_interval = self.key_interval.unwrap_or(settings.key_interval);
        settings.time = self.time.unwrap_or(settings.time);
        settings.space = self.space.unwrap_or(settings.space);
        settings.adapt_keys = !self.even_keys;
        settings
    }

    /// The source image, stored as asked for.
    #[must_use]
    pub fn source(&self) -> atlas::Settings {
        atlas::Settings {
            detail: self.detail.unwrap_or(self.source.detail),
            texels: self.texels.unwrap_or(self.source.texels),
            storage: self.storage.unwrap_or(self.source.storage),
            charts: self.charts.unwrap_or(self.source.charts),
            ..self.source
        }
    }

    /// Whether texels may be half a byte: where they are whole ones, and nobody said that they have to be.
    pub(crate) fn may_halve(&self) -> bool {
        self.texels.is_none() && self.source().texels == TexelKind::Indexed8
    }

    /// What the bundle has to keep within.
    pub(crate) fn limits(&self) -> Limits {
        match self.goal {
            Some(Goal::Budget(budget)) => Limits { bytes: Some(budget), memory: self.room },
            Some(Goal::Ram(room)) => Limits { bytes: None, memory: Some(room) },
            Some(Goal::Psnr(_)) | None => Limits { bytes: None, memory: self.room },
        }
    }

    /// What else helps where a search finds nothing: to leave to it what is given; nothing where nothing is.
    pub(crate) fn held(&self) -> String {
        // Where memory is all that matters, cells grow beyond the one that is given.
        let (cells, memory) = (!matches!(self.goal, Some(Goal::Ram(_))), self.limits().memory.is_some());
        let all = [
            (cells && self.cell.is_some(), "--cell"),
            (self.key_interval.is_some(), "--key-interval"),
            (matches!(self.goal, Some(Goal::Budget(_))) && self.texels == Some(TexelKind::Indexed8), "--texels"),
            (!cells && self.all_sheets, "--sheets"),
            (memory && self.time.is_some(), "--time"),
            (memory && self.space.is_some(), "--space"),
            (memory && self.storage == Some(Storage::Packed), "--storage"),
        ];
        let given: Vec<&str> = all.into_iter().filter_map(|(given, name)| given.then_some(name)).collect();
        let mut held = if given.is_empty() { String::new() } else { format!(", or leave {} to the search", given.join(" and ")) };
        if matches!(self.goal, Some(Goal::Psnr(_))) && self.room.is_some() {
            held.push_str(", or raise --ram");
        }
        held
    }
}
