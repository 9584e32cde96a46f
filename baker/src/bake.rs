//! The whole line: a scene in, a bundle out.
//! The stages are the crate's modules; this runs them in order, times them, and reports progress.

use crate::atlas::{self, Atlas, AtlasError, SourceImage, Storage};
use crate::cast::Cast;
use crate::causes::{self, Causes};
use crate::chart;
use crate::encode::{self, CodingSettings, Content};
use crate::fit::{self, Fit};
use crate::folds::{self, Folded};
use crate::gbuffer::{GBuffer, Lens};
use crate::order::{self, Coverage};
use crate::planes::{self, FlatChart};
use crate::scene::Scene;
use crate::sheets::{self, KeyGrid, Layers, Sheets};
use crate::verify::VerifyError;
use crate::walls;
use crate::{brinks, cuts, kinks, prune, settle, spare, tears, timing};
use cubist_core::format::{SPACE_CUBIC, TIME_CUBIC};
use std::time::Instant;
use thiserror::Error;

/// Hears the name of the stage and how much of it is done, 0..=1.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

/// Why a scene cannot be baked.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum BakeError {
    /// The cell is not one the player knows.
    #[error("--cell: expected 4, 8, 16 or 32 pixels, found {0}")]
    Cell(u32),
    /// The key interval is out of range.
    #[error("--key-interval: expected 1 to 256 frames, found {0}")]
    KeyInterval(u32),
    /// There are more pixels than 32 bits number.
    #[error("--frames: expected at most {most} pixels in all frames together, found {0}; lower it, or --size", most = u32::MAX)]
    Pixels(u64),
    /// There is no source image.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
    /// No ray of any frame hits a triangle.
    #[error(
        "the camera sees nothing: expected some of {rays} rays to hit a triangle, none does; check the camera's place, its direction and fov, and \
         whether materials and textures have any alpha to show"
    )]
    Nothing {
        /// Rays cast.
        rays: u64,
    },
    /// Even the smallest bundle that a search found is too large.
    #[error(
        "--budget: expected room for about {smallest} bytes, as the smallest bundle that was tried takes, found {budget}; raise it, or lower --size or --frames"
    )]
    Budget {
        /// Bytes allowed.
        budget: u64,
        /// Bytes of the smallest bundle found.
        smallest: u64,
    },
    /// No bundle that a search found reaches the quality.
    #[error("--psnr: found at most {nearest:.2} dB, expected {asked:.2} dB; ask for less{held}")]
    Psnr {
        /// The mean PSNR asked for, dB.
        asked: f64,
        /// The best that a search found, dB.
        nearest: f64,
        /// What else helps: leaving options to the search that are given; empty where none is.
        held: String,
    },
    /// No bundle that a search found plays in the memory there is.
    #[error(
        "--ram: expected room for {smallest} bytes, the least that a player of this scene was found to need, found {asked}; raise it, or \
         lower --size{held}"
    )]
    Ram {
        /// Bytes allowed.
        asked: usize,
        /// Bytes of working memory of the least demanding bundle found.
        smallest: usize,
        /// What else helps: leaving options to the search that are given; empty where none is.
        held: String,
    },
    /// No bundle that a search found is small enough and plays in the memory there is as well.
    #[error(
        "--budget and --ram: expected a bundle of at most {budget} bytes that plays in {room}, found one of {bytes} that plays in {memory}, the nearest \
         that was tried; raise what is short, or lower --size or --frames{held}"
    )]
    Both {
        /// Bytes allowed.
        budget: u64,
        /// Bytes of working memory allowed.
        room: usize,
        /// Bytes of the bundle that came nearest,
        bytes: u64,
        /// and of its working memory.
        memory: usize,
        /// What else helps: leaving options to the search that are given; empty where none is.
        held: String,
    },
    /// The model has no flattening of its own.
    #[error(transparent)]
    Own(#[from] chart::NoIslands),
    /// The player refuses what was baked: a fault of the baker.
    #[error(transparent)]
    Verify(#[from] VerifyError),
    /// The scene is more than a bundle can hold.
    #[error(transparent)]
    Limit(#[from] encode::Exceeded),
}

/// Whether keys are coded coarser than their settings say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sparing {
    /// They are not.
    #[default]
    Nothing,
    /// Where it hardly shows.
    Unseen,
    /// As far as it takes for the bundle to have at most this many bytes.
    Within(u64),
}

/// What may be chosen about a bundle.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Side of a cell, pixels: 4, 8, 16 or 32.
    pub cell: u32,
    /// Frames between keys.
    pub key_interval: u32,
    /// Keys stand closer where positions bend more from key to key, and at a path's ends; farther apart elsewhere.
    pub adapt_keys: bool,
    /// How layers are interpolated between keys: one of the format's `TIME_` numbers.
    pub time: u8,
    /// How layers are interpolated between nodes: one of the format's `SPACE_` numbers.
    pub space: u8,
    /// The source image.
    pub atlas: atlas::Settings,
    /// The keys.
    pub coding: CodingSettings,
    /// Whether keys are coded coarser than that.
    pub sparing: Sparing,
    /// A label seen in fewer pixels of a cell and interval is left out of it; a torn part of one in fewer than twice as many.
    pub least_pixels: u32,
    /// Mean squared error, mean of the components 0..=255, that pictures are expected to have: sheets that save less than their layers' share of it are
    /// left out. 0 keeps all.
    pub error: f64,
    /// Wrong pixels that a field has to save in a cell and interval to be used.
    pub field_price: u32,
    /// The coverage tests to choose from.
    pub coverage: Coverage,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            cell: 8,
            key_interval: 8,
            adapt_keys: true,
            time: TIME_CUBIC,
            space: SPACE_CUBIC,
            atlas: atlas::Settings::default(),
            coding: CodingSettings { step_log2: 0, lambda: 0.01, independent_every: 16 },
            sparing: Sparing::Nothing,
            least_pixels: 8,
            error: 0.0,
            field_price: 4,
            coverage: Coverage::All,
        }
    }
}

/// What the camera sees, flattened: everything before the key-ray grid.
pub struct Flat {
    /// The source image and the G-buffer in it.
    pub atlas: Atlas,
    /// Where the G-buffer's charts hide parts of themselves (see [`tears`]).
    pub tears: Vec<u8>,
    /// Where its charts meet on one surface (see [`causes`]).
    pub seams: Vec<u8>,
    /// The flat ones among the labels.
    pub planes: Vec<Option<FlatChart>>,
    /// The frames after which the camera goes through a surface.
    pub crossed: Vec<u32>,
    /// Rays cast.
    pub rays: u64,
    /// Seconds the rays took.
    pub ray_seconds: f64,
    /// Seconds the source image took.
    pub atlas_seconds: f64,
}

/// A bundle and how it came about.
pub struct Encoded {
    /// The bundle's bytes.
    pub bundle: Vec<u8>,
    /// The key-ray grid.
    pub grid: KeyGrid,
    /// Pixels whose sheet was too small to keep.
    pub dropped_pixels: u64,
    /// Why cells are torn.
    pub torn_by_cause: Causes,
    /// Seconds for sheets, fit and coding.
    pub seconds: f64,
}

/// Casts the rays and makes the source image.
///
/// # Errors
/// [`BakeError`] where the settings are out of range or the charts do not fit.
pub fn flatten(scene: &Scene, settings: &atlas::Settings, progress: Progress<'_>) -> Result<Flat, BakeError> {
    flatten_cast(&Cast::new(scene, progress), settings, progress)
}

/// Makes the source image of rays that are cast.
///
/// # Errors
/// Those of [`flatten`].
pub fn flatten_cast(cast: &Cast<'_>, settings: &atlas::Settings, progress: Progress<'_>) -> Result<Flat, BakeError> {
    let start = Instant::now();
    let atlas = atlas::build(cast.scene, &cast.hits, settings, &|done, total| progress("flattening surfaces", part(done, total)))?;
    progress("looking for tears", 0.0);
    let flat = flat(cast, atlas);
    Ok(Flat { ray_seconds: cast.seconds, atlas_seconds: start.elapsed().as_secs_f64(), ..flat })
}

/// What `atlas` and the rays that it was made of tell; no time is taken.
pub(crate) fn flat(cast: &Cast<'_>, atlas: Atlas) -> Flat {
    let Cast { scene, tracer, hits, .. } = cast;
    let tears = tears::find(cast, &atlas.gbuffer);
    let seams = causes::seams(scene, hits, &atlas.gbuffer);
    let planes = planes::find(scene, hits, &atlas.gbuffer, atlas.image.labels.len());
    let crossed = walls::crossed(scene, tracer);
    Flat { tears, seams, planes, crossed, rays: hits.samples.len() as u64, atlas, ray_seconds: 0.0, atlas_seconds: 0.0 }
}

/// Refuses a path that shows nothing but background.
pub(crate) fn something_seen(flat: &Flat) -> Result<(), BakeError> {
    if flat.atlas.gbuffer.label.iter().all(|&label| label == 0) { Err(BakeError::Nothing { rays: flat.rays }) } else { Ok(()) }
}

/// How much of `total` is done, 0..=1.
fn part(done: u64, total: u64) -> f64 {
    done as f64 / total.max(1) as f64
}

/// Sheets of a scene and where they lie in the source image: all that a bundle has but what settles which sheet shows where.
pub struct Fitted {
    grid: KeyGrid,
    folded: Folded,
    sheets: Sheets,
    layers: Layers,
    fit: Fit,
    charts: Vec<Option<FlatChart>>,
    lenses: Vec<Lens>,
    torn_by_cause: Causes,
    seconds: f64,
}

/// Frames for keys, where those that the grid has will not do.
type Keys = fn(&GBuffer, &KeyGrid) -> Option<Vec<u32>>;

/// The grid with keys where they are needed. Those of kinks may stand for others close by, those of cuts come beside them all.
fn adapted(gbuffer: &GBuffer, grid: KeyGrid) -> KeyGrid {
    [timing::place as Keys, kinks::keys, cuts::keys].into_iter().fold(grid, |grid, keys| match keys(gbuffer, &grid) {
        Some(keys) => grid.with_keys(keys),
        None => grid,
    })
}

/// Finds the sheets and fits their positions: nothing that depends on the outline of the source image.
///
/// # Errors
/// [`BakeError`] where the settings are out of range.
pub fn fitted(scene: &Scene, flat: &Flat, settings: &Settings, progress: Progress<'_>) -> Result<Fitted, BakeError> {
    if !matches!(settings.cell, 4 | 8 | 16 | 32) {
        return Err(BakeError::Cell(settings.cell));
    }
    if !(1..=256).contains(&settings.key_interval) {
        return Err(BakeError::KeyInterval(settings.key_interval));
    }
    let start = Instant::now();
    let Atlas { image, gbuffer: exact, .. } = &flat.atlas;
    let cell_log2 = settings.cell.trailing_zeros() as u8;
    let grid = KeyGrid::new(exact, cell_log2, settings.key_interval, scene.playback.looping, [settings.time, settings.space]);
    let grid = if settings.adapt_keys { adapted(exact, grid) } else { grid };
    // In small cells and short intervals a few pixels are much.
    let volume = settings.cell * settings.cell * settings.key_interval;
    let least = if volume < 512 { settings.least_pixels.min(volume / 64).max(1) } else { settings.least_pixels };
    progress("finding sheets", 0.0);
    let folded = folds::unfold(exact, &flat.tears, &grid, &image.labels, least.saturating_mul(2));
    let gbuffer = &folded.gbuffer;
    let mut sheets = sheets::find(gbuffer, &grid, least);
    if settings.error > 0.0 {
        prune::prune(&mut sheets, gbuffer, image, &grid, settings.error);
    }
    let torn_by_cause = causes::count(exact, &flat.tears, &flat.seams, &grid, &sheets);
    let layers = Layers::of(&grid, &sheets);
    progress("fitting keys", 0.2);
    let charts: Vec<Option<FlatChart>> = folded.stands_for.iter().map(|&label| flat.planes[usize::from(label)]).collect();
    let lenses: Vec<Lens> = grid.keys.iter().map(|&frame| Lens::new(scene, frame)).collect();
    let fit = fit::solve(gbuffer, &grid, &sheets, &layers, &planes::positions(&charts, &layers, &lenses, &grid));
    Ok(Fitted { grid, folded, sheets, layers, fit, charts, lenses, torn_by_cause, seconds: start.elapsed().as_secs_f64() })
}

/// Settles which of the `fitted` sheets shows where, codes the keys, and puts the bundle together; `settings` are those of the fit.
///
/// # Errors
/// [`BakeError`] where the scene exceeds what a bundle holds.
pub fn settled(scene: &Scene, flat: &Flat, fitted: &Fitted, settings: &Settings, progress: Progress<'_>) -> Result<Encoded, BakeError> {
    let start = Instant::now();
    let Fitted { grid, folded: Folded { gbuffer, labels, .. }, layers, fit, charts, lenses, torn_by_cause, .. } = fitted;
    let image = &SourceImage { labels: labels.clone(), ..flat.atlas.image.clone() };
    let mut sheets = fitted.sheets.clone();
    progress("fitting outlines", 0.5);
    let &Settings { field_price, coverage, .. } = settings;
    let evidence = order::Evidence { gbuffer, grid, image, layers, fit, field_price, coverage };
    let fields = settle::settle(&evidence, &mut sheets);
    let more = brinks::weights(&evidence, &sheets);
    let fit = &Fit { uv: fit.uv.clone(), weight: fit.weight.iter().zip(more).map(|(weight, more)| weight + more).collect() };
    progress("coding keys", 0.8);
    let choice = settings.atlas.charts;
    let reason = || chart::reason(choice.family, choice.rewarped, choice.tried());
    let info =
        if choice.rewarped || choice.tried().next().is_some() { format!("{}; {}", scene.name, reason()) } else { scene.name.clone() };
    let header = encode::Header { storage: settings.atlas.storage, fps: scene.playback.fps, info: &info };
    let (planes, cameras) = planes::records(charts, &layers.by_label(image.labels.len()), lenses, grid);
    let content = Content { grid, image, sheets: &sheets, layers, fit, fields: &fields, planes: &planes, cameras: &cameras };
    let own = settings.atlas.storage;
    let code = |coding: CodingSettings, storage: Storage| -> Result<Vec<u8>, BakeError> {
        Ok(encode::bundle(&content, coding, encode::Header { storage, ..header })?)
    };
    let bundle = match settings.sparing {
        Sparing::Nothing => code(settings.coding, own)?,
        Sparing::Unseen => {
            // To pack the same picture for each that is tried, and unpack it for each player, took two thirds of a small scene's time.
            let raw = encode::image_bytes(image, Storage::Raw);
            let (bundle, coding) = spare::unseen(&flat.atlas, raw, settings.coding, |coding| code(coding, Storage::Raw))?;
            if own == Storage::Raw { bundle } else { code(coding, own)? }
        }
        Sparing::Within(bytes) => spare::within(bytes, |lambda| code(settings.coding.worth(lambda), own))?,
    };
    progress("coding keys", 1.0);
    let seconds = fitted.seconds + start.elapsed().as_secs_f64();
    Ok(Encoded { bundle, grid: grid.clone(), dropped_pixels: sheets.dropped, torn_by_cause: *torn_by_cause, seconds })
}

/// Fits and codes the keys, and puts the bundle together.
///
/// # Errors
/// Those of [`fitted`] and [`settled`].
pub fn encode(scene: &Scene, flat: &Flat, settings: &Settings, progress: Progress<'_>) -> Result<Encoded, BakeError> {
    settled(scene, flat, &fitted(scene, flat, settings, progress)?, settings, progress)
}
