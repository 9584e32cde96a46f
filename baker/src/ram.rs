//! Memory: the best bundle whose player gets by with a number of bytes.
//! Rays and options come from `tune`; the choice goes back there, with a word on what it gave up.
//!
//! A player holds five keys where time is cubic and three where it is straight, three rows of nodes where space is cubic, which bend, and two where it is
//! straight, and fewer layers in either where cells are larger. What each of these loses differs from scene to scene: it is measured.

use crate::atlas;
use crate::bake::{BakeError, Encoded, Flat, Settings};
use crate::chart::Choice;
use crate::climb::{CELLS, Free, Step, Take, climb};
use crate::encode::{image_bytes, with_section};
use crate::inspect::{space_name, time_name};
use crate::metrics;
use crate::terminal::grouped;
use crate::tune::{Chosen, Search, Whole, possible};
use crate::verify;
use cubist_core::Bundle;
use cubist_core::format::{PATH, Path, SPACE_LINEAR, TIME_LINEAR};

/// The largest cells tried, pixels.
const LARGEST: u32 = CELLS[CELLS.len() - 1];
/// Intervals at which all cells from those asked for on are tried: the usual one and half of it. Where none fits, shorter ones are with the largest alone.
const ALL_CELLS: usize = 2;
/// Where nothing fits, so many times the error that sheets are usually left out at.
const SPARSER: [f64; 3] = [4.0, 16.0, 64.0];
/// That error where no bundle tells it, as a picture's PSNR, dB.
const FAIR: f64 = 30.0;
/// What the memory may cost before other charts are tried, dB.
const LOST: f64 = 3.0;
/// What other charts have to be worth more, dB: either are held against exact rays through their own source image.
const CLEARLY: f64 = 0.5;
/// Steps tried from the best of what was tried at first.
const STEPS: usize = 10;
/// What twice the bytes of the keys have to bring, dB: a third of what sparing asks, since quality within the memory is what is wanted.
const DOUBLE: f64 = 0.5;

/// A bundle that was made, and what its player needs.
struct Tried {
    settings: Settings,
    encoded: Encoded,
    memory: usize,
}

/// What a bundle is good for.
#[derive(Clone, Copy)]
struct Value {
    /// Mean PSNR against exact rays, dB.
    psnr: f64,
    /// That less what its keys take, dB: of two that fit the one worth more is taken.
    worth: f64,
}

/// What was found on the way.
#[derive(Default)]
struct Found {
    /// The best that fits.
    best: Option<(Value, Tried)>,
    /// Time and space of all that fit.
    fitting: Vec<[u8; 2]>,
    /// The least memory that a bundle was measured to need, and its settings.
    smallest: Option<(usize, Settings)>,
    /// Of the settings that were not tried those that promise the least memory, and how much.
    least: Option<(usize, Settings)>,
    /// What a bundle cannot hold.
    exceeded: Option<BakeError>,
}

impl Search<'_> {
    /// The best bundle that plays in `room` bytes of working memory.
    ///
    /// Charts that lost against those of the `whole` bundle get another chance where much is lost, or nothing fits: what bends least in usual cells may
    /// not do so in large ones.
    ///
    /// # Errors
    /// [`BakeError::Ram`] where nothing fits; whatever flattening and encoding say.
    pub(crate) fn ram(&self, room: usize, whole: Option<Whole>) -> Result<Chosen, BakeError> {
        let asked = whole.map_or(self.options.settings(self.scene.playback.width), |whole| whole.settings);
        let mut flat = self.flat(asked.atlas)?;
        let mut found = self.within(&flat, asked, room, whole)?;
        let most = whole.map_or(f64::INFINITY, |whole| whole.psnr);
        let charts = asked.atlas.charts;
        // Each family was tried as it is first; the winner perhaps rewarped after that.
        let rewarped = self.options.rewarp.unwrap_or(false);
        for family in charts.tried().filter(|trial| trial.rewarped == rewarped && trial.family != charts.family).map(|trial| trial.family) {
            if found.psnr() >= most - LOST {
                break;
            }
            let atlas = atlas::Settings { charts: Choice { family, rewarped, ..charts }, ..asked.atlas };
            // What could be cut at half the size may be too much at the whole.
            let Ok(other) = self.flat(atlas) else { continue };
            let others = self.within(&other, Settings { atlas, ..asked }, room, whole)?;
            if found.takes(others) {
                flat = other;
            }
        }
        let Some((Value { psnr, .. }, tried)) = found.best else {
            return Err(match found.smallest {
                Some((smallest, _)) => BakeError::Ram { asked: room, smallest, held: self.options.held() },
                // Not a single bundle: what was in the way is the answer.
                None => found.exceeded.unwrap_or(BakeError::Ram { asked: room, smallest: 0, held: String::new() }),
            });
        };
        let warnings = vec![gave_up(room, &asked, whole, &tried, psnr)];
        Ok(Chosen { flat, encoded: tried.encoded, settings: tried.settings, search_seconds: 0.0, warnings, contested: None })
    }

    /// What plays in `room` bytes of working memory with the charts of `flat`.
    ///
    /// Straight time, straight space and larger cells than those `asked` for are tried, each as far as the user left it open, and shorter intervals, whose
    /// cells see fewer labels, where none of that fits; where that does not either, what promised to take least, with fewer and fewer sheets. From the one worth
    /// most of those that fit, steps lead on: closer keys may well make up for what had to go.
    fn within(&self, flat: &Flat, asked: Settings, room: usize, whole: Option<Whole>) -> Result<Found, BakeError> {
        let mut found = Found::default();
        // Sheets that show little go first, also where they would be worth their bytes.
        let error = self.prunes(whole.map_or(0.0, |whole| metrics::mse(whole.psnr)));
        let fewer = Settings { error: error.max(asked.error), ..asked };
        let shorter = |&interval: &u32| (self.options.key_interval.is_none() && interval > 1).then_some(interval / 2);
        for (turn, key_interval) in std::iter::successors(Some(asked.key_interval), shorter).enumerate() {
            let least = if turn < ALL_CELLS { asked.cell } else { LARGEST };
            for (step, cell) in CELLS.into_iter().filter(|&cell| cell >= least).enumerate() {
                self.say(step + CELLS.len() * turn.min(ALL_CELLS), (1 + ALL_CELLS) * CELLS.len());
                let Some(tried) = self.attempt(flat, Settings { cell, key_interval, ..fewer }, &mut found)? else { continue };
                if tried.memory <= room {
                    // Larger cells only lose.
                    found.consider(flat, tried)?;
                    break;
                }
                self.straighten(flat, &tried, room, &mut found)?;
            }
            if found.best.is_some() {
                break;
            }
        }
        if let Some((_, settings)) = found.least.filter(|_| found.best.is_none()) {
            self.fitting(flat, settings, room, &mut found)?;
        }
        let error = if fewer.error > 0.0 { fewer.error } else { self.prunes(metrics::mse(FAIR)) };
        for sparser in SPARSER.into_iter().filter(|_| error > 0.0) {
            let promising = found.least.into_iter().chain(found.smallest).min_by_key(|&(memory, _)| memory);
            let Some((_, least)) = promising.filter(|_| found.best.is_none()) else { break };
            self.fitting(flat, Settings { error: error * sparser, ..least }, room, &mut found)?;
        }
        if let Some((value, tried)) = &found.best {
            let start = (tried.settings, value.worth);
            self.refine(flat, start, room, &mut found)?;
        }
        Ok(found)
    }

    /// Tries what takes less memory than `tried` on the same grid: straight time, straight space, or both.
    fn straighten(&self, flat: &Flat, tried: &Tried, room: usize, found: &mut Found) -> Result<(), BakeError> {
        let (time, space) = (tried.settings.time, tried.settings.space);
        let straight_time = if self.options.time.is_none() { time.min(TIME_LINEAR) } else { time };
        let straight_space = if self.options.space.is_none() { SPACE_LINEAR } else { space };
        for [time, space] in [[straight_time, space], [time, straight_space], [straight_time, straight_space]] {
            // What fits with smaller cells, or with one of the two curved, is better. And two of the three may be the same.
            let lesser = found.fitting.iter().any(|fitting| fitting[0] >= time && fitting[1] >= space);
            if lesser || [time, space] == [tried.settings.time, tried.settings.space] {
                continue;
            }
            let settings = Settings { time, space, ..tried.settings };
            let memory = memory_as(&tried.encoded.bundle, time, space).unwrap_or(0);
            if memory > room {
                if found.least.is_none_or(|(least, _)| memory < least) {
                    found.least = Some((memory, settings));
                }
                continue;
            }
            self.fitting(flat, settings, room, found)?;
        }
        Ok(())
    }

    /// Steps from `start`, which fits, to what is worth more and fits too.
    fn refine(&self, flat: &Flat, start: (Settings, f64), room: usize, found: &mut Found) -> Result<(), BakeError> {
        let free = Free { lambda: false, ..self.free() };
        let mut step = 0;
        climb(start, &free, (Take::First, &Step::ALL), STEPS, |settings| {
            self.say(step, STEPS);
            step += 1;
            Ok(self.fitting(flat, *settings, room, found)?.map(|value| value.worth))
        })?;
        Ok(())
    }

    /// Makes a bundle, the best if it is, and says what it is good for; `None` where it does not fit, or no bundle can hold it.
    fn fitting(&self, flat: &Flat, settings: Settings, room: usize, found: &mut Found) -> Result<Option<Value>, BakeError> {
        let Some(tried) = self.attempt(flat, settings, found)?.filter(|tried| tried.memory <= room) else { return Ok(None) };
        found.consider(flat, tried).map(Some)
    }

    /// Makes a bundle; `None` where no bundle can hold it.
    fn attempt(&self, flat: &Flat, settings: Settings, found: &mut Found) -> Result<Option<Tried>, BakeError> {
        let Some(encoded) = possible(self.encode(flat, &settings), &mut found.exceeded)? else { return Ok(None) };
        let memory = verify::memory(&encoded.bundle)?;
        if found.smallest.is_none_or(|(smallest, _)| memory < smallest) {
            found.smallest = Some((memory, settings));
        }
        Ok(Some(Tried { settings, encoded, memory }))
    }
}

impl Found {
    /// Makes `tried`, which fits, the best if it is.
    fn consider(&mut self, flat: &Flat, tried: Tried) -> Result<Value, BakeError> {
        self.fitting.push([tried.settings.time, tried.settings.space]);
        let value = value(flat, &tried)?;
        if self.best.as_ref().is_none_or(|(best, _)| value.worth > best.worth) {
            self.best = Some((value, tried));
        }
        Ok(value)
    }

    /// Beside exact rays, dB; less than any where nothing fits.
    fn psnr(&self) -> f64 {
        self.best.as_ref().map_or(f64::NEG_INFINITY, |(value, _)| value.psnr)
    }

    /// Takes what `other` charts gave in place of its own where that is clearly worth more, and says so.
    fn takes(&mut self, other: Self) -> bool {
        let worth = |found: &Self| found.best.as_ref().map_or(f64::NEG_INFINITY, |(value, _)| value.worth);
        let better = worth(&other) > worth(self) + CLEARLY;
        let smallest = self.smallest.into_iter().chain(other.smallest).min_by_key(|&(memory, _)| memory);
        if better {
            *self = other;
        }
        self.smallest = smallest;
        better
    }
}

/// What `tried` is good for.
fn value(flat: &Flat, tried: &Tried) -> Result<Value, BakeError> {
    let psnr = verify::briefly(&tried.encoded.bundle, &flat.atlas.image, &flat.atlas.gbuffer)?.psnr_mean;
    let picture = image_bytes(&flat.atlas.image, tried.settings.atlas.storage);
    let keys = tried.encoded.bundle.len().saturating_sub(picture) as u64;
    Ok(Value { psnr, worth: metrics::worth(psnr, keys, DOUBLE) })
}

/// The memory that a player of `bundle` would need if its time and its space were others, with the same layers; `None` if that is no bundle.
fn memory_as(bundle: &[u8], time: u8, space: u8) -> Option<usize> {
    let path = postcard::to_stdvec(&Path { time, space, ..*Bundle::parse(bundle).ok()?.path() }).ok()?;
    Some(Bundle::parse(&with_section(bundle, PATH, &path)?).ok()?.memory_needed())
}

/// What the user should know: how `tried` differs from what was `asked` for, and what that costs. `whole`: the bundle that is too large.
fn gave_up(room: usize, asked: &Settings, whole: Option<Whole>, tried: &Tried, psnr: f64) -> String {
    let Settings { time, space, cell, key_interval, .. } = tried.settings;
    let [charts, before] = [tried.settings, *asked].map(|settings| settings.atlas.charts.family);
    let changes = [
        (charts != before).then(|| format!("--charts {} instead of {}", charts.name(), before.name())),
        (time != asked.time).then(|| format!("--time {} instead of {}", time_name(time), time_name(asked.time))),
        (space != asked.space).then(|| format!("--space {} instead of {}", space_name(space), space_name(asked.space))),
        (tried.settings.error > asked.error).then(|| "sheets left out that show little".to_owned()),
        (cell != asked.cell).then(|| format!("--cell {cell} instead of {}", asked.cell)),
        (key_interval != asked.key_interval).then(|| format!("--key-interval {key_interval} instead of {}", asked.key_interval)),
    ];
    let changes: Vec<String> = changes.into_iter().flatten().collect();
    let cost = match whole {
        Some(Whole { memory, psnr: most, .. }) => {
            format!(
                "{psnr:.2} dB before repainting, in {} bytes of memory, where {most:.2} dB take {}",
                grouped(tried.memory),
                grouped(memory)
            )
        }
        None => format!("{psnr:.2} dB before repainting, in {} bytes of memory", grouped(tried.memory)),
    };
    if changes.is_empty() {
        return format!("--ram {room}: nothing was given up to fit: {cost}");
    }
    format!("--ram {room}: to fit, the bundle has {}: {cost}", changes.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::Storage;
    use crate::chart::Family;
    use crate::job::bake_scene;
    use crate::options::{Goal, Options, TruthFrames};
    use crate::report::Report;
    use crate::scene::{Scene, builtin};
    use cubist_core::format::{SPACE_CUBIC, TIME_CUBIC};
    use std::sync::OnceLock;

    fn small() -> Scene {
        let mut scene = builtin::build("cone-orbit").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (96, 72, 17);
        scene
    }

    fn bake(room: Option<usize>, options: Options) -> Result<(usize, Vec<u8>, Report), BakeError> {
        let goal = room.map(Goal::Ram);
        let (bytes, report) = bake_scene(&small(), &Options { goal, truth: TruthFrames::None, ..options }, &|_, _| {})?;
        let memory = Bundle::parse(&bytes).unwrap().memory_needed();
        assert_eq!(report.memory.workspace, memory);
        assert!(room.is_none_or(|room| memory <= room), "{memory} {room:?}");
        Ok((memory, bytes, report))
    }

    /// What is baked where nothing is asked for.
    fn plain() -> &'static (usize, Vec<u8>) {
        static PLAIN: OnceLock<(usize, Vec<u8>)> = OnceLock::new();
        PLAIN.get_or_init(|| bake(None, Options::default()).map(|(memory, bytes, _)| (memory, bytes)).unwrap())
    }

    fn kind(bytes: &[u8]) -> (u8, u8, u8) {
        let bundle = Bundle::parse(bytes).unwrap();
        (bundle.path().time, bundle.path().space, bundle.path().cell_log2)
    }

    #[test]
    fn what_fits_is_left_as_it_is() {
        let (memory, plain) = plain();
        let (_, bytes, report) = bake(Some(*memory), Options::default()).unwrap();
        assert!(bytes == *plain && report.warnings.iter().all(|warning| !warning.contains("--ram")), "{:?}", report.warnings);
        // A byte less, and something has to go: the cheapest loss, with its price.
        let (less, bytes, report) = bake(Some(memory - 1), Options::default()).unwrap();
        let warning = report.warnings.iter().find(|warning| warning.contains("--ram")).unwrap();
        assert!(less < *memory && bytes != *plain && warning.contains(&grouped(*memory)) && warning.contains("dB"), "{warning}");
    }

    #[test]
    fn an_unpacked_picture_counts() {
        let (raw, _) = plain();
        let storage = Some(Storage::Packed);
        let (packed, _, report) = bake(None, Options { storage, ..Options::default() }).unwrap();
        assert!(report.memory.picture > 0 && packed == *raw + report.memory.picture, "{packed} {raw}");
        // What would do for a raw one does not: something else has to go, for the picture was asked for.
        let (_, _, report) = bake(Some(packed - 1), Options { storage, ..Options::default() }).unwrap();
        assert!(report.source_image.storage == Storage::Packed && report.warnings.iter().any(|warning| warning.contains("--ram")));
        let error = bake(Some(1_000), Options { storage, cell: Some(8), ..Options::default() }).err().unwrap().to_string();
        assert!(error.ends_with("or leave --storage to the search"), "{error}");
    }

    #[test]
    fn straight_time_saves_two_keys() {
        // Keys as far apart as usual, whatever the cells.
        let asked = Options { space: Some(SPACE_CUBIC), key_interval: Some(8), ..Options::default() };
        let (_, curved, _) = bake(None, asked).unwrap();
        let straight = memory_as(&curved, TIME_LINEAR, SPACE_CUBIC).unwrap();
        let (memory, bytes, report) = bake(Some(straight + 64), asked).unwrap();
        assert_eq!((kind(&bytes), report.grid.cell), ((TIME_LINEAR, SPACE_CUBIC, 3), 8), "{memory}");
        assert!(report.warnings.iter().any(|warning| warning.contains("--time linear instead of cubic")), "{:?}", report.warnings);
        // What the user sets stays: cells have to grow instead.
        let (_, bytes, _) = bake(Some(straight), Options { time: Some(TIME_CUBIC), ..asked }).unwrap();
        assert_eq!(kind(&bytes), (TIME_CUBIC, SPACE_CUBIC, 4));
    }

    #[test]
    fn larger_cells_come_when_straight_lines_do_not_do() {
        let straight = memory_as(&plain().1, TIME_LINEAR, SPACE_LINEAR).unwrap();
        let (_, bytes, report) = bake(Some(straight * 9 / 10), Options::default()).unwrap();
        assert!(kind(&bytes).2 > 3 && report.grid.cell > 8, "{:?}", kind(&bytes));
        assert!(report.warnings.iter().any(|warning| warning.contains("instead of 8")), "{:?}", report.warnings);
    }

    #[test]
    fn sheets_and_charts_give_way_before_a_room_is_refused() {
        let mut scene = builtin::build("round-columns").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (64, 48, 9);
        // Charts are tried where the scene brings none.
        scene.triangles.iter_mut().for_each(|triangle| triangle.island = None);
        let made = |room, options| {
            let options = Options { goal: Some(Goal::Ram(room)), truth: TruthFrames::None, ..options };
            bake_scene(&scene, &options, &|_, _| {}).map(|(_, report)| report)
        };
        let least = |options| match made(1_000, options) {
            Err(error @ BakeError::Ram { smallest, .. }) => (smallest, error.to_string()),
            other => panic!("contexts alone take more: {:?}", other.map(|report| report.memory.workspace)),
        };
        let ((all, said), (fewer, _)) = (least(Options { all_sheets: true, ..Options::default() }), least(Options::default()));
        assert!(fewer < all && said.ends_with("or leave --sheets to the search"), "{fewer} {all} {said}");
        let given = Options { charts: Some(Family::Planes.into()), ..Options::default() };
        let (planes, _) = least(given);
        assert!(fewer <= planes, "{fewer} {planes}");
        let report = made(fewer, Options::default()).unwrap();
        assert_eq!(report.memory.workspace, fewer, "what is named can be had");
        // What the user sets stays.
        let report = made(planes, given).unwrap();
        assert_eq!((report.memory.workspace, report.source_image.candidate), (planes, Family::Planes));
    }

    #[test]
    fn what_is_out_of_reach_is_refused_with_the_least_there_is() {
        let Err(error @ BakeError::Ram { asked: 1_000, smallest, .. }) = bake(Some(1_000), Options::default()) else {
            panic!("contexts alone take more")
        };
        let text = error.to_string();
        assert!(text.contains(&smallest.to_string()) && text.contains("--size") && !text.contains("to the search"), "{error}");
        let (memory, ..) = bake(Some(smallest), Options::default()).unwrap();
        assert_eq!(memory, smallest, "what is named can be had");
    }
}
