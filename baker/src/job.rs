//! A whole job: a scene and what the user asks of its bundle in; the bundle, verified, and its report out.
//! The stages are `bake`'s, the search is `tune`'s, the figures are `verify`'s.

use crate::atlas::{self, Storage};
use crate::bake::{self, BakeError, Encoded, Flat, Progress, Settings, Sparing};
use crate::bends::Bends;
use crate::cast::Cast;
use crate::chart::{self, Choice, Family};
use crate::choose;
use crate::fewer;
use crate::finer;
use crate::inspect::Inspection;
use crate::made::Made;
use crate::outlines;
use crate::repaint::Painter;
use crate::report::{Origin, Report, Seconds};
use crate::scene::{self, Scene};
use crate::seen::Seen;
use crate::straight;
use crate::trace::Tracer;
use crate::truth::{Truth, spread};
use crate::{tune, verify};
use std::time::Instant;

/// Screens wider than this get cells of 16 pixels unless told otherwise.
const WIDE: u32 = 640;
/// Keys that trials of charts have, at least, on paths with as many frames; on brief ones twice as many.
const TRIAL_KEYS: u32 = 16;

/// What the bundle is to reach.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Goal {
    /// What the settings give.
    #[default]
    AsSet,
    /// At most this many bytes, at the best quality that fits.
    Budget(u64),
    /// The fewest bytes with at least this mean PSNR, dB, against exact ray casting.
    Psnr(f64),
    /// At most this many bytes of working memory for playing, at the best quality that fits.
    Ram(usize),
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
    /// What to reach.
    pub goal: Goal,
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
            storage: None,
            charts: None,
            rewarp: None,
            lambda: None,
            independent_every: Settings::default().coding.independent_every,
            all_sheets: false,
            plain: false,
            goal: Goal::AsSet,
            truth: TruthFrames::Most(16),
            load_seconds: 0.0,
        }
    }
}

impl Options {
    /// The settings for a screen `width` pixels wide, the baker's choices filled in.
    #[must_use]
    pub fn settings(&self, width: u32) -> Settings {
        let mut settings = Settings { atlas: self.source(), ..Settings::default() };
        settings.coding.independent_every = self.independent_every;
        settings.coding.lambda = self.lambda.unwrap_or(settings.coding.lambda);
        // The other searches look for what a bit is worth themselves.
        let spares = self.lambda.is_none() && matches!(self.goal, Goal::AsSet | Goal::Ram(_));
        settings.sparing = if spares { Sparing::Unseen } else { Sparing::Nothing };
        settings.cell = self.cell.unwrap_or(if width > WIDE { 16 } else { settings.cell });
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
            storage: self.storage.unwrap_or(self.source.storage),
            charts: self.charts.unwrap_or(self.source.charts),
            ..self.source
        }
    }

    /// What else helps where a search finds nothing: to leave to it what is given; nothing where nothing is. `cells`: the search would try other
    /// cells than the one that is given.
    pub(crate) fn held(&self, cells: bool) -> String {
        let all = [
            (cells && self.cell.is_some(), "--cell"),
            (self.key_interval.is_some(), "--key-interval"),
            (!cells && self.time.is_some(), "--time"),
            (!cells && self.space.is_some(), "--space"),
            (!cells && self.storage == Some(Storage::Packed), "--storage"),
        ];
        let given: Vec<&str> = all.into_iter().filter_map(|(given, name)| given.then_some(name)).collect();
        if given.is_empty() { String::new() } else { format!(", or leave {} to the search", given.join(" and ")) }
    }
}

/// A finished job.
pub struct Baked {
    /// The bundle's bytes.
    pub bundle: Vec<u8>,
    /// What they cost and reach.
    pub report: Report,
    /// The source image and the G-buffer they came from.
    pub flat: Flat,
    /// What made them.
    pub settings: Settings,
    /// Mean PSNR against exact rays before texels were coloured by what is played, dB.
    pub(crate) psnr_before: f64,
}

/// What was chosen: by the settings or by a search.
pub(crate) struct Chosen {
    pub flat: Flat,
    pub encoded: Encoded,
    pub settings: Settings,
    /// Seconds for what was tried and not kept.
    pub search_seconds: f64,
    /// What the user should know about the choice.
    pub warnings: Vec<String>,
}

/// A bundle that needs more memory than there is.
#[derive(Clone, Copy)]
pub(crate) struct Whole {
    pub settings: Settings,
    pub memory: usize,
    /// Mean PSNR against exact rays before texels are coloured by what is played, dB.
    pub psnr: f64,
}

/// Bakes a scene, verifies the bundle and reports; `progress` hears the stages.
///
/// # Errors
/// [`BakeError`] where settings are out of range, the camera sees nothing, the scene exceeds what a bundle holds, or the
/// goal is out of reach.
pub fn bake_scene(scene: &Scene, options: &Options, progress: Progress<'_>) -> Result<(Vec<u8>, Report), BakeError> {
    run(scene, options, progress).map(|baked| (baked.bundle, baked.report))
}

/// Like [`bake_scene`], but hands out the source image and the G-buffer as well.
///
/// # Errors
/// The same.
pub fn run(scene: &Scene, options: &Options, progress: Progress<'_>) -> Result<Baked, BakeError> {
    progress("building the hierarchy", 0.0);
    // Charts that the scene brings are as it wants them.
    let split = if chart::brings_own(scene) { None } else { scene::split(scene) };
    let mut baked = by(&Tracer::new(split.as_ref().unwrap_or(scene)), options, progress)?;
    baked.report.triangles = scene.triangles.len();
    Ok(baked)
}

/// Like [`run`], of a scene whose rays `tracer` casts.
fn by(tracer: &Tracer<'_>, options: &Options, progress: Progress<'_>) -> Result<Baked, BakeError> {
    let (start, scene) = (Instant::now(), tracer.scene());
    let choice = choice(tracer, options, progress)?;
    let options = &Options { charts: Some(choice), ..*options };
    // What needs no more memory than there is stays as it is; where it cannot be had at all, the search says why.
    let mut whole = None;
    if let Goal::Ram(room) = options.goal
        && let Ok(baked) = by(tracer, &Options { goal: Goal::AsSet, ..*options }, progress)
    {
        let memory = baked.report.memory.workspace;
        if memory <= room {
            return Ok(baked);
        }
        whole = Some(Whole { settings: baked.settings, memory, psnr: baked.psnr_before });
    }
    // What outlines need of it, flash has. Where memory or quality is searched for no finer ones are tried.
    let outline = whole.map_or(options.source.outline, |whole| whole.settings.atlas.outline);
    let outline = if matches!(options.goal, Goal::AsSet | Goal::Budget(_)) { outline } else { outline.or(Some(0)) };
    let options = &Options { source: atlas::Settings { outline, ..options.source }, ..*options };
    let choice_seconds = start.elapsed().as_secs_f64();
    let settings = options.settings(scene.playback.width);
    let cast = Cast::by(tracer.of(scene), progress);
    let paint_start = Instant::now();
    let painter = (!options.plain).then(|| Painter::new(&cast, progress));
    let paint_seconds = paint_start.elapsed().as_secs_f64();
    let space = |cell: u32, bends: Option<Bends>| options.space.unwrap_or(straight::first(cell, bends));
    let (chosen, fitted, bends) = match options.goal {
        Goal::AsSet => {
            let flat = bake::flatten_cast(&cast, &settings.atlas, progress)?;
            something_seen(&flat)?;
            let bends = if options.space.is_none() { straight::told(&flat.atlas.gbuffer, settings.cell) } else { None };
            let settings = Settings { space: space(settings.cell, bends), ..settings };
            let fitted = bake::fitted(scene, &flat, &settings, progress)?;
            let encoded = bake::settled(scene, &flat, &fitted, &settings, progress)?;
            (Chosen { flat, encoded, settings, search_seconds: 0.0, warnings: Vec::new() }, Some(fitted), bends)
        }
        goal => (tune::search((&cast, painter.as_ref()), options, goal, whole, progress)?, None, None),
    };
    let Chosen { mut flat, encoded, settings, search_seconds, warnings } = chosen;
    // Large, and of no more use.
    drop(cast);
    let finer_start = Instant::now();
    let quality = verify::briefly(&encoded.bundle, &flat.atlas.image, &flat.atlas.gbuffer)?;
    let free = options.goal == Goal::AsSet && options.cell.is_none() && options.key_interval.is_none();
    let made = Made { settings, encoded, quality };
    let budget = if let Goal::Budget(budget) = options.goal { Some(budget) } else { None };
    let (made, outlines) = outlines::choose(scene, &mut flat, fitted, made, budget, progress)?;
    let all = made.quality;
    // Searches have left out what they could.
    let prunes = !options.all_sheets && options.goal == Goal::AsSet;
    let made = if prunes { fewer::choose(scene, &flat, made, progress)? } else { made };
    let seen = Seen::new(tracer, painter.as_ref());
    let (made, other) =
        if free { finer::choose(scene, &flat, made, &all, &|cell| space(cell, bends), &seen, progress)? } else { (made, None) };
    // In smaller cells they bend less.
    let smooth = bends == Some(Bends::Smooth) && made.settings.cell >= settings.cell;
    let tries = options.goal == Goal::AsSet && options.space.is_none() && !smooth;
    let (made, spaces) = if tries { straight::choose(scene, &flat, made, progress)? } else { (made, Vec::new()) };
    // In other cells what a sheet has to save is another thing.
    let mut made = if prunes && other.is_some() { fewer::anew(scene, &flat, made, progress)? } else { made };
    let finer = other.map(|other| other.said(&made));
    let psnr_before = made.quality.psnr_mean;
    let (search_seconds, paint_start) = (search_seconds + finer_start.elapsed().as_secs_f64(), Instant::now());
    let repainted = painter.as_ref().map_or(Ok(false), |painter| painter.repaint(&mut made, &mut flat.atlas, options.goal))?;
    let (paint_seconds, verify_start) = (paint_seconds + paint_start.elapsed().as_secs_f64(), Instant::now());
    let Made { settings, encoded, .. } = made;
    let part = |done: u32, total: u32| f64::from(done) / f64::from(total.max(1));
    progress("comparing with exact rays", 0.0);
    let quality = verify::against_exact(&encoded.bundle, &flat.atlas, &|d, n| progress("comparing with exact rays", part(d, n)))?;
    let inspection = Inspection::of(&encoded.bundle).map_err(verify::VerifyError::from)?;
    let work = verify::work(&encoded.bundle)?;
    let frames = match options.truth {
        TruthFrames::None => Vec::new(),
        TruthFrames::Most(most) => spread(scene.playback.frames, most),
        TruthFrames::All => spread(scene.playback.frames, scene.playback.frames),
    };
    let truth = if frames.is_empty() {
        None
    } else {
        progress("comparing with the truth", 0.0);
        let bar = |d, n| progress("comparing with the truth", part(d, n));
        Some(verify::against_truth(&encoded.bundle, &Truth::by(tracer.of(scene)), &frames, seen.rendered(), &bar)?)
    };
    let seconds = Seconds {
        total: options.load_seconds + tracer.seconds + start.elapsed().as_secs_f64(),
        load: options.load_seconds,
        atlas: flat.atlas_seconds,
        rays: tracer.seconds + flat.ray_seconds,
        encode: encoded.seconds,
        paint: paint_seconds,
        verify: verify_start.elapsed().as_secs_f64(),
        search: choice_seconds + search_seconds,
    };
    let origin = Origin { scene, flat: &flat, encoded: &encoded, settings: &settings, spaces, bends, outlines, repainted };
    let mut report = Report::new(&origin, &inspection, quality, truth, work, seconds);
    // By what it takes with the outline that was chosen for it.
    let packed = budget.filter(|_| settings.atlas.storage != options.source().storage);
    let packed = packed.map(|budget| tune::packed(budget, report.memory.picture));
    report.warnings.extend(warnings.into_iter().chain(packed).chain(finer));
    Ok(Baked { bundle: encoded.bundle, report, flat, settings, psnr_before })
}

/// How to cut the surface: as asked for, as the scene brings it, or as trials show.
fn choice(tracer: &Tracer<'_>, options: &Options, progress: Progress<'_>) -> Result<Choice, BakeError> {
    let scene = tracer.scene();
    let rewarped = options.rewarp.unwrap_or(false);
    match options.charts {
        Some(choice) => {
            if choice.family == Family::Own && !chart::brings_own(scene) {
                chart::Islands::new(scene)?;
            }
            Ok(Choice { rewarped: options.rewarp.unwrap_or(choice.rewarped), ..choice })
        }
        None if chart::brings_own(scene) => Ok(Choice { rewarped, ..Family::Own.into() }),
        None => {
            let mut settings = options.settings(scene.playback.width);
            if options.key_interval.is_none() {
                // Where that is close, the path goes fast, and keys will stand as close, or closer.
                let frames = scene.playback.frames;
                let keys = if frames <= finer::BRIEF { 2 * TRIAL_KEYS } else { TRIAL_KEYS };
                settings.key_interval = settings.key_interval.min((frames / keys).max(1));
            }
            choose::charts(tracer, &settings, options.rewarp, progress)
        }
    }
}

/// Refuses a path that shows nothing but background.
pub(crate) fn something_seen(flat: &Flat) -> Result<(), BakeError> {
    if flat.atlas.gbuffer.label.iter().all(|&label| label == 0) { Err(BakeError::Nothing { rays: flat.rays }) } else { Ok(()) }
}
