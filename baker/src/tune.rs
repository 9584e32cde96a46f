//! Tuning: the bundle that fits a budget at the best quality, or that reaches a quality at the fewest bytes; `ram` has memory's.
//! A scene and a goal come from `job`; the winner goes back there. Rays are cast once; whatever is tried is baked, played
//! and measured. What is tried, and in which order, depends on nothing but the scene and the options.

use crate::atlas::{self, Storage};
use crate::bake::{self, BakeError, Encoded, Flat, Progress, Settings, Sparing};
use crate::cast::Cast;
use crate::climb::{Free, Step, Take, climb};
use crate::encode::image_bytes;
use crate::metrics;
use crate::options::{Goal, Options};
use crate::repaint::Painter;
use crate::samples::Samples;
use crate::scene::Scene;
use crate::terminal::grouped;
use crate::verify;
use std::cell::Cell;
use std::time::Instant;

/// Cells tried at first, pixels.
const CELLS: [u32; 2] = [16, 8];
/// Key intervals tried at first, frames,
const INTERVALS: [u32; 4] = [32, 16, 8, 4];
/// and those on paths of at most so many frames: whatever interval is asked for, they have keys at their ends and where they turn quickly, and no step to one
/// a little shorter shows what a key a frame would bring.
const SHORT: (u32, [u32; 2]) = (32, [2, 1]);
/// What a bit is worth at first in the search for a budget.
const BUDGET_LAMBDA: f32 = 0.1;
/// Densities of the source image tried, of the one asked for; in a search for a budget after that with all its detail, where that is left open.
const DENSITIES: [f64; 9] = [1.0, 0.85, 0.7, 0.6, 0.5, 0.35, 0.25, 0.18, 0.125];
/// Source images tried, at most.
const IMAGES: usize = 1 + DENSITIES.len();
/// Bundles that fit the budget and are measured, before the best of them is bettered step by step.
const TRIES: usize = 4;
/// Steps tried from the best of what was tried at first.
const STEPS: usize = 18;
/// The score of a bundle of no bytes that reaches the quality asked for; no quality in dB is half as high, nor is a bundle half as large.
const REACHED: f64 = 1e12;
/// Bytes of working memory that a player may need without having been told: half of an RP2040's. More only where the first tries take it too.
pub(crate) const MOST_MEMORY: usize = 128 << 10;
/// How far a predicted size may lie over the budget and still be tried: coarser keys take less.
const SLACK: f64 = 1.15;

/// What was chosen: by the settings or by a search.
pub(crate) struct Chosen {
    pub flat: Flat,
    pub encoded: Encoded,
    pub settings: Settings,
    /// Seconds for what was tried and not kept.
    pub search_seconds: f64,
    /// What the user should know about the choice.
    pub warnings: Vec<String>,
    /// Whether the search leaves room for what is baked where nothing is asked for: how that has to be stored.
    pub contested: Option<Storage>,
}

/// A bundle that needs more memory than there is.
#[derive(Clone, Copy)]
pub(crate) struct Whole {
    pub settings: Settings,
    pub memory: usize,
    /// Mean PSNR against exact rays before texels are coloured by what is played, dB.
    pub psnr: f64,
}

/// Searches for `goal`, with colours by `painter`, if any. `whole`: what is too large for a [`Goal::Ram`], where there is such a bundle.
///
/// # Errors
/// [`BakeError::Budget`], [`BakeError::Psnr`] or [`BakeError::Ram`] where nothing reaches the goal, with the nearest that can be; whatever
/// flattening and encoding say.
pub(crate) fn search(
    (cast, painter): (&Cast<'_>, Option<&Painter>),
    options: &Options,
    goal: Goal,
    whole: Option<Whole>,
    progress: Progress<'_>,
) -> Result<Chosen, BakeError> {
    let (start, scene) = (Instant::now(), cast.scene);
    let search = Search { scene, options, cast, painter, progress };
    let mut chosen = match goal {
        Goal::Budget(budget) => search.budget(budget)?,
        Goal::Psnr(asked) => search.psnr(asked)?,
        Goal::Ram(room) => search.ram(room, whole)?,
    };
    let kept = chosen.flat.atlas_seconds + chosen.encoded.seconds;
    chosen.search_seconds = (start.elapsed().as_secs_f64() - kept).max(0.0);
    Ok(chosen)
}

/// A scene whose rays are cast, and what is asked of its bundle.
pub(crate) struct Search<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) options: &'a Options,
    cast: &'a Cast<'a>,
    painter: Option<&'a Painter>,
    progress: Progress<'a>,
}

/// A source image, measured.
struct Image {
    source: atlas::Settings,
    /// Bytes stored as asked for; packed, if that is left to the search.
    bytes: usize,
    packed: Option<usize>,
    /// Mean squared error of exact rays through it against the truth.
    error: f64,
}

/// What of `source` says how fine the image is.
fn fineness(source: &atlas::Settings) -> [f64; 2] {
    [source.density, source.detail]
}

impl Image {
    /// The fewest bytes that it can take.
    fn least(&self) -> usize {
        self.packed.map_or(self.bytes, |packed| packed.min(self.bytes))
    }

    /// Whether it has to be packed to fit into `budget` with `keys`: what fits as it is plays from flash.
    fn has_to_be_packed(&self, keys: &Keys, budget: u64) -> bool {
        (self.bytes + keys.bytes) as u64 > budget && self.least() < self.bytes
    }

    /// Bytes of a bundle with `keys`, and how the image is stored in it.
    fn with(&self, keys: &Keys, budget: u64) -> (usize, atlas::Settings) {
        if self.has_to_be_packed(keys, budget) {
            (self.least() + keys.bytes, atlas::Settings { storage: Storage::Packed, ..self.source })
        } else {
            (self.bytes + keys.bytes, self.source)
        }
    }
}

/// The source images that a search for a budget has to choose from.
struct Images {
    all: Vec<Image>,
    /// The finest that leaves room for keys, or else the coarsest: keys are measured at this one.
    reference: Flat,
    /// Bytes of the one that is as fine as asked for; packed, if that is left to the search.
    usual: (usize, Option<usize>),
}

/// A way to code keys, measured at one source image.
#[derive(Clone, Copy)]
struct Keys {
    settings: Settings,
    bytes: usize,
    /// What playback adds to the mean squared error against the truth.
    error: f64,
}

impl Search<'_> {
    /// The source image that `source` asks for, and what goes with it.
    pub(crate) fn flat(&self, source: atlas::Settings) -> Result<Flat, BakeError> {
        let flat = bake::flatten_cast(self.cast, &source, &|_, _| {})?;
        bake::something_seen(&flat)?;
        Ok(flat)
    }

    /// Fits and codes keys, in silence.
    pub(crate) fn encode(&self, flat: &Flat, settings: &Settings) -> Result<Encoded, BakeError> {
        bake::encode(self.scene, flat, settings, &|_, _| {})
    }

    fn finish(&self, flat: Flat, settings: Settings, warnings: Vec<String>) -> Result<Chosen, BakeError> {
        let encoded = self.encode(&flat, &settings)?;
        Ok(Chosen { flat, encoded, settings, search_seconds: 0.0, warnings, contested: Some(settings.atlas.storage) })
    }

    /// The grids to try, the coarsest first.
    fn grids(&self, source: atlas::Settings) -> Vec<Settings> {
        let base = Settings { atlas: source, ..self.options.settings(self.scene.playback.width) };
        let cells = self.options.cell.map_or(CELLS.to_vec(), |cell| vec![cell]);
        let frames = self.scene.playback.frames;
        let shortest = SHORT.1.into_iter().filter(|_| frames <= SHORT.0);
        let shorter: Vec<u32> = INTERVALS.into_iter().chain(shortest).filter(|&interval| interval < frames).collect();
        let intervals = match self.options.key_interval {
            Some(interval) => vec![interval],
            None if shorter.is_empty() => vec![base.key_interval],
            None => shorter,
        };
        let each = |cell: u32| intervals.iter().map(move |&key_interval| Settings { cell, key_interval, ..base });
        cells.iter().flat_map(|&cell| each(cell)).collect()
    }

    /// Tells how much of the search is done.
    pub(crate) fn say(&self, done: usize, of: usize) {
        (self.progress)("searching", done as f64 / of.max(1) as f64);
    }

    /// The best bundle of at most `budget` bytes.
    ///
    /// Source images and grids are measured apart, then the sums of their bytes and of their errors say which pairs to bake.
    fn budget(&self, budget: u64) -> Result<Chosen, BakeError> {
        let steps = IMAGES + self.grids(self.options.source()).len() + TRIES + STEPS;
        let samples = Samples::new(self.cast);
        let Images { all: images, reference, usual } = self.images(budget, &samples, steps)?;
        let keys = self.keys(&reference, &samples, steps)?;
        drop(reference);
        let mut pairs: Vec<(&Image, &Keys)> = images.iter().flat_map(|image| keys.iter().map(move |keys| (image, keys))).collect();
        pairs.sort_by(|a, b| {
            let error = |(image, keys): &(&Image, &Keys)| image.error + keys.error;
            error(a).total_cmp(&error(b)).then(a.0.with(a.1, budget).0.cmp(&b.0.with(b.1, budget).0))
        });
        let chosen = self.best_pair(budget, &pairs, &samples, steps)?;
        // Half of what its keys take here may go as they are settled.
        let base = self.options.settings(self.scene.playback.width);
        let own = keys.iter().find(|keys| (keys.settings.cell, keys.settings.key_interval) == (base.cell, base.key_interval));
        let fits = |image: usize| (image + own.map_or(0, |own| own.bytes / 2)) as u64 <= budget;
        let contested = match usual {
            (bytes, _) if fits(bytes) => Some(base.atlas.storage),
            (_, Some(packed)) if fits(packed) => Some(Storage::Packed),
            _ => None,
        };
        Ok(Chosen { contested, ..chosen })
    }

    /// Measures source images, the finest first, but for those that are far too large for `budget`.
    fn images(&self, budget: u64, samples: &Samples, steps: usize) -> Result<Images, BakeError> {
        let room = usize::try_from(budget).unwrap_or(usize::MAX);
        let asked = self.options.source();
        let (mut images, mut reference, mut usual): (Vec<Image>, _, _) = (Vec::new(), None, None);
        let all = self.options.detail.is_none().then_some((f64::INFINITY, 1.0));
        let mut scale = 1.0;
        for (step, (detail, ratio)) in all.into_iter().chain(DENSITIES.map(|ratio| (asked.detail, ratio))).enumerate() {
            self.say(step, steps);
            let source = atlas::Settings { density: asked.density * scale * ratio, detail, ..asked };
            let coarsest = ratio == DENSITIES[DENSITIES.len() - 1];
            let finer = |last: &Image| source.density / last.source.density;
            if let Some(last) = images.last()
                && last.source.detail == detail
                && !coarsest
                && last.least() as f64 * finer(last) * finer(last) > 1.5 * room as f64
            {
                continue;
            }
            let flat = self.flat(source)?;
            let packed = self.options.storage.is_none().then(|| image_bytes(&flat.atlas.image, Storage::Packed));
            let bytes = image_bytes(&flat.atlas.image, source.storage);
            if detail == asked.detail && ratio == 1.0 {
                // Where the image is full, densities above what it holds change nothing.
                scale = flat.atlas.figures.scale.min(1.0);
                usual = Some((bytes, packed));
            }
            let image = Image { source, bytes, packed, error: samples.of_image(&flat.atlas) };
            if reference.is_none() && (image.least() < room / 10 * 9 || coarsest) {
                reference = Some(flat);
            }
            // A flattening of the scene's own has all its detail as it is.
            if !images.last().is_some_and(|last| (last.bytes, last.error) == (image.bytes, image.error)) {
                images.push(image);
            }
        }
        match (reference, usual) {
            (Some(reference), Some(usual)) => Ok(Images { all: images, reference, usual }),
            _ => Err(BakeError::Budget { budget, smallest: u64::MAX }),
        }
    }

    /// Measures every way to code keys at one source image.
    fn keys(&self, flat: &Flat, samples: &Samples, steps: usize) -> Result<Vec<Keys>, BakeError> {
        let asked = self.options.source();
        let (image_bytes, image_error) = (image_bytes(&flat.atlas.image, asked.storage), samples.of_image(&flat.atlas));
        let (mut keys, mut exceeded) = (Vec::<Keys>::new(), None);
        for mut settings in self.grids(asked) {
            self.say(IMAGES + keys.len(), steps);
            settings.coding = settings.coding.worth(BUDGET_LAMBDA);
            // The last grid's error is about this one's, and a little more.
            settings.error = self.prunes(keys.last().map_or(0.0, |keys| keys.error));
            let Some(Encoded { bundle, .. }) = possible(self.encode(flat, &settings), &mut exceeded)? else { continue };
            let (error, _) = samples.of_bundle(&bundle)?;
            keys.push(Keys { settings, bytes: bundle.len().saturating_sub(image_bytes), error: (error - image_error).max(0.0) });
        }
        exceeded.filter(|_| keys.is_empty()).map_or(Ok(keys), Err)
    }

    /// The error that sheets are left out at where pictures have about that of `error`: none where all are asked for.
    pub(crate) fn prunes(&self, error: f64) -> f64 {
        if self.options.all_sheets { 0.0 } else { error }
    }

    /// What the user left open, and what a bit is worth, which searches choose.
    pub(crate) fn free(&self) -> Free {
        let Options { cell, key_interval, time, space, .. } = *self.options;
        Free {
            cell: cell.is_none(),
            interval: key_interval.is_none(),
            lambda: true,
            time: time.is_none(),
            space: space.is_none(),
            frames: self.scene.playback.frames,
        }
    }

    /// Bakes the pairs that promise most until enough of them fit, and steps on from the best.
    fn best_pair(&self, budget: u64, pairs: &[(&Image, &Keys)], samples: &Samples, steps: usize) -> Result<Chosen, BakeError> {
        let mut current: Option<([f64; 2], Flat)> = None;
        let mut exceeded = None;
        let mut best: Option<(Settings, f64)> = None;
        let (mut fitting, mut smallest, mut room) = (0, u64::MAX, MOST_MEMORY);
        // Of bundles that fit the better one counts, of those that do not the smaller one: from there steps may lead to one that does.
        let mut score = |flat: &Flat, settings: &Settings, first: bool| -> Result<Option<f64>, BakeError> {
            let Some(Encoded { bundle, .. }) = possible(self.encode(flat, settings), &mut exceeded)? else { return Ok(None) };
            let (bytes, memory) = (bundle.len() as u64, verify::memory(&bundle)?);
            smallest = smallest.min(bytes);
            if bytes > budget {
                return Ok(Some(-(bytes as f64)));
            }
            room = if first { room.max(memory) } else { room };
            Ok(if memory <= room { Some(samples.of_bundle(&bundle)?.1) } else { None })
        };
        // Where nothing is predicted to fit, the smallest prediction is tried all the same.
        let least = pairs.iter().map(|(image, keys)| image.with(keys, budget).0).min().unwrap_or(0);
        for (image, keys) in pairs {
            let (predicted, source) = image.with(keys, budget);
            if fitting == TRIES || (predicted as f64 > budget as f64 * SLACK && predicted > least) {
                continue;
            }
            self.say(steps - STEPS - TRIES + fitting, steps);
            let flat = match current.take() {
                Some((fine, flat)) if fine == fineness(&image.source) => flat,
                _ => self.flat(image.source)?,
            };
            let error = self.prunes(keys.error);
            let settings = Settings { atlas: source, sparing: Sparing::Within(budget), error, ..keys.settings };
            let found = score(&flat, &settings, true)?;
            current = Some((fineness(&image.source), flat));
            let Some(found) = found else { continue };
            fitting += usize::from(found > 0.0);
            if best.is_none_or(|(_, most)| found > most) {
                best = Some((settings, found));
            }
        }
        let Some(start) = best else { return Err(exceeded.unwrap_or(BakeError::Budget { budget, smallest })) };
        let flat = match current {
            Some((fine, flat)) if fine == fineness(&start.0.atlas) => flat,
            _ => self.flat(start.0.atlas)?,
        };
        // Coarser coding is what makes a bundle fit.
        let free = Free { lambda: false, time: false, space: false, ..self.free() };
        let mut step = steps - STEPS;
        let (settings, found) = climb(start, &free, (Take::First, &Step::ALL), STEPS, |settings| {
            self.say(step, steps);
            step += 1;
            score(&flat, settings, false)
        })?;
        if found < 0.0 {
            return Err(BakeError::Budget { budget, smallest });
        }
        self.finish(flat, settings, Vec::new())
    }

    /// The smallest bundle whose mean PSNR against exact rays reaches `asked`.
    fn psnr(&self, asked: f64) -> Result<Chosen, BakeError> {
        let mut source = self.options.source();
        let ratios: Vec<f64> = DENSITIES.into_iter().filter(|&ratio| ratio == 1.0 || ratio < 0.8).collect();
        let steps = Cell::new(self.grids(source).len() + STEPS);
        let (mut step, mut nearest, mut room, mut exceeded) = (0, 0.0f64, MOST_MEMORY, None);
        // Of bundles that reach it the smaller one counts, of those that do not the better one.
        let mut score = |flat: &Flat, settings: &Settings, first: bool| -> Result<Option<f64>, BakeError> {
            self.say(step, steps.get());
            step += 1;
            let Some(Encoded { bundle, .. }) = possible(self.encode(flat, settings), &mut exceeded)? else { return Ok(None) };
            let painted = self.painter.map_or(Ok(None), |painter| painter.painted(&bundle, &flat.atlas.image, &settings.atlas))?;
            let (bundle, image) = painted.map_or((bundle, None), |(bundle, image)| (bundle, Some(image)));
            let psnr = verify::briefly(&bundle, image.as_ref().unwrap_or(&flat.atlas.image), &flat.atlas.gbuffer)?.psnr_mean;
            let (reached, memory) = (psnr >= asked, verify::memory(&bundle)?);
            // Memory is no matter until there is one that reaches it.
            if first || (reached && nearest < asked) {
                room = room.max(memory);
            }
            nearest = nearest.max(psnr);
            Ok(match reached {
                true if memory <= room => Some(REACHED - bundle.len() as f64),
                true => None,
                false => Some(psnr),
            })
        };
        let free = Free { time: false, space: false, ..self.free() };
        let mut best: Option<(Settings, f64)> = None;
        for (turn, &ratio) in ratios.iter().enumerate() {
            if turn == 1 {
                // A coarser picture is rarely asked for: only then there is one more try for each, and steps from the one that does.
                steps.set(steps.get() + ratios.len() - 1 + STEPS);
            }
            let wanted = atlas::Settings { density: source.density * ratio, ..source };
            let flat = self.flat(wanted)?;
            if turn == 0 {
                source.density *= flat.atlas.figures.scale.min(1.0);
                for settings in self.grids(wanted) {
                    let settings = Settings { error: self.prunes(metrics::mse(asked)), ..settings };
                    if let Some(found) = score(&flat, &settings, true)?
                        && best.is_none_or(|(_, most)| found > most)
                    {
                        best = Some((settings, found));
                    }
                }
            } else if let Some((settings, found)) = &mut best {
                // With fewer texels a pixel, what came closest.
                settings.atlas = wanted;
                *found = score(&flat, settings, false)?.unwrap_or(0.0);
            }
            let Some(start) = best else { break };
            let most = if turn == 0 || start.1 > REACHED / 2.0 { STEPS } else { 0 };
            let (settings, found) = climb(start, &free, (Take::First, &Step::ALL), most, |settings| score(&flat, settings, false))?;
            best = Some((settings, found));
            if found > REACHED / 2.0 {
                let coarser = (turn > 0).then(|| {
                    format!(
                        "--psnr {asked}: out of reach at a density of {:.2} texels a pixel: the source image has {:.2}, which shows less detail",
                        source.density, wanted.density
                    )
                });
                return self.finish(flat, settings, coarser.into_iter().collect());
            }
        }
        // Not a single bundle: what was in the way is the answer.
        Err(exceeded.filter(|_| best.is_none()).unwrap_or(BakeError::Psnr { asked, nearest, held: self.options.held(true) }))
    }
}

/// What the user should know where the source image is packed for the sake of `budget`, and takes so many bytes of memory.
pub(crate) fn packed(budget: u64, memory: usize) -> String {
    format!(
        "--budget {budget}: the source image is packed to fit, and takes {} bytes of memory unpacked; --storage raw keeps it in flash, at lower quality",
        grouped(memory)
    )
}

/// What came of an attempt; `None` where a bundle cannot hold it: that ends the attempt, not the search. The first to exceed
/// a bound is remembered.
pub(crate) fn possible<T>(attempt: Result<T, BakeError>, exceeded: &mut Option<BakeError>) -> Result<Option<T>, BakeError> {
    match attempt {
        Err(error @ BakeError::Limit(_)) => {
            exceeded.get_or_insert(error);
            Ok(None)
        }
        other => other.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::bake_scene;
    use crate::options::TruthFrames;
    use crate::scene::builtin;

    fn small(name: &str) -> Scene {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (48, 36, 9);
        scene
    }

    #[test]
    fn a_budget_is_kept_and_more_of_it_is_no_worse() {
        let scene = small("cone-orbit");
        let bake = |budget| {
            let options = Options { goal: Some(Goal::Budget(budget)), truth: TruthFrames::All, ..Options::default() };
            bake_scene(&scene, &options, &|_, _| {})
        };
        let (bytes, small) = bake(6_000).unwrap();
        assert!(bytes.len() <= 6_000, "{}", bytes.len());
        let (bytes, large) = bake(12_000).unwrap();
        assert!(bytes.len() <= 12_000, "{}", bytes.len());
        let psnr = |report: &crate::Report| report.quality_vs_truth.unwrap().psnr_mean;
        assert!(psnr(&large) >= psnr(&small) - 0.2, "{} {}", psnr(&large), psnr(&small));
        let Err(BakeError::Budget { budget: 500, smallest }) = bake(500) else { panic!("500 bytes cannot hold a scene") };
        assert!((500..6_000).contains(&smallest), "{smallest}");
    }

    #[test]
    fn a_picture_is_packed_where_it_does_not_fit_raw() {
        let scene = small("street");
        let bake = |goal, storage| {
            let options = Options { goal, storage, cell: Some(8), truth: TruthFrames::All, ..Options::default() };
            bake_scene(&scene, &options, &|_, _| {}).unwrap()
        };
        let (plain, usual) = bake(None, None);
        let tight = Some(Goal::Budget(plain.len() as u64 * 45 / 100));
        let told = |report: &crate::Report| report.warnings.iter().any(|warning| warning.contains("--storage raw"));
        let (bytes, open) = bake(tight, None);
        assert!(
            bytes.len() <= plain.len() * 45 / 100 && open.source_image.storage == Storage::Packed && told(&open),
            "{:?}",
            open.warnings
        );
        let takes = format!("takes {} bytes of memory", grouped(open.memory.picture));
        assert!(open.warnings.iter().any(|warning| warning.contains(&takes)), "{:?}", open.warnings);
        assert!(open.memory.picture == open.source_image.raw_bytes && open.source_image.stored_bytes < open.source_image.raw_bytes);
        let (_, raw) = bake(tight, Some(Storage::Raw));
        assert!(raw.source_image.storage == Storage::Raw && raw.memory.picture == 0 && !told(&raw));
        let psnr = |report: &crate::Report| report.quality_vs_truth.unwrap().psnr_mean;
        assert!(psnr(&open) > psnr(&raw), "{} {}", psnr(&open), psnr(&raw));
        // Where there is room, flash is where the picture stays, and nothing is worse than it would be without a budget.
        let (_, wide) = bake(Some(Goal::Budget(plain.len() as u64 * 4)), None);
        assert!(wide.source_image.storage == Storage::Raw && !told(&wide));
        assert!(psnr(&wide) >= psnr(&usual), "{} {}", psnr(&wide), psnr(&usual));
    }

    #[test]
    fn a_quality_is_reached_or_the_nearest_is_named() {
        let scene = small("cone-orbit");
        let bake = |asked| {
            let options = Options { goal: Some(Goal::Psnr(asked)), truth: TruthFrames::None, ..Options::default() };
            bake_scene(&scene, &options, &|_, _| {})
        };
        let (plain, report) = bake_scene(&scene, &Options::default(), &|_, _| {}).unwrap();
        let reached = report.quality.psnr_mean;
        // At the worst it is what is baked without a goal.
        for asked in [reached, reached - 1.0] {
            let (bytes, report) = bake(asked).unwrap();
            let psnr = report.quality.psnr_mean;
            let told = (plain.len(), bytes.len(), &report.grid);
            assert!(psnr >= asked && bytes.len() <= plain.len(), "{asked} {psnr} dB, {told:?}");
        }
        let Err(error @ BakeError::Psnr { nearest, .. }) = bake(98.0) else { panic!("98 dB are out of reach") };
        assert!(nearest > reached && error.to_string().contains(&format!("{nearest:.2}")), "{error}");
        // What was not given is not to blame.
        assert!(!error.to_string().contains("--cell"), "{error}");
        let options =
            Options { goal: Some(Goal::Psnr(98.0)), cell: Some(16), key_interval: Some(4), truth: TruthFrames::None, ..Options::default() };
        let error = bake_scene(&scene, &options, &|_, _| {}).err().unwrap();
        assert!(error.to_string().ends_with("ask for less, or leave --cell and --key-interval to the search"), "{error}");
    }
}
