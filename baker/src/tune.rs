//! Tuning: searches for a goal. What they have in common; `budget`, `quality` and `ram` have the three of them.
//! A scene and a goal come from `job`; the winner goes back there. Rays are cast once; whatever is tried is baked, played
//! and measured. What is tried, and in which order, depends on nothing but the scene and the options.

use crate::atlas::{self, Storage};
use crate::bake::{self, BakeError, Encoded, Flat, Progress, Settings};
use crate::cast::Cast;
use crate::climb::Free;
use crate::options::{Goal, Options};
use crate::repaint::Painter;
use crate::scene::Scene;
use cubist_core::format::{SPACE_LINEAR, TIME_LINEAR, TexelKind};
use std::time::Instant;

/// Cells tried at first, pixels,
const CELLS: [u32; 2] = [16, 8];
/// and where memory is short.
const SHORT_CELLS: [u32; 3] = [32, 16, 8];
/// Key intervals tried at first, frames,
const INTERVALS: [u32; 4] = [32, 16, 8, 4];
/// and those on paths of at most so many frames: whatever interval is asked for, they have keys at their ends and where they turn quickly, and no step to one
/// a little shorter shows what a key a frame would bring.
const SHORT: (u32, [u32; 2]) = (32, [2, 1]);
/// Densities of the source image tried, of the one asked for; in a search for a budget after that with all its detail, where that is left open.
pub(crate) const DENSITIES: [f64; 9] = [1.0, 0.85, 0.7, 0.6, 0.5, 0.35, 0.25, 0.18, 0.125];
/// Steps tried from the best of what was tried at first.
pub(crate) const STEPS: usize = 18;
/// Bytes of working memory that a player may need without having been told: half of an RP2040's. More only where the first tries take it too.
pub(crate) const MOST_MEMORY: usize = 128 << 10;

/// What was chosen: by the settings or by a search.
pub(crate) struct Chosen {
    pub flat: Flat,
    pub encoded: Encoded,
    pub settings: Settings,
    /// Seconds for what was tried and not kept.
    pub search_seconds: f64,
    /// What the user should know about the choice.
    pub warnings: Vec<String>,
    /// Whether the search leaves room for what is baked where nothing is asked for: how that has to be stored, and of which texels.
    pub contested: Option<(Storage, TexelKind)>,
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
    pub(crate) cast: &'a Cast<'a>,
    pub(crate) painter: Option<&'a Painter>,
    progress: Progress<'a>,
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

    /// What `settings` make of `flat`, as the choice.
    pub(crate) fn finish(&self, flat: Flat, settings: Settings, warnings: Vec<String>) -> Result<Chosen, BakeError> {
        let encoded = self.encode(&flat, &settings)?;
        Ok(Chosen {
            flat,
            encoded,
            settings,
            search_seconds: 0.0,
            warnings,
            contested: Some((settings.atlas.storage, settings.atlas.texels)),
        })
    }

    /// The grids to try, the coarsest first.
    pub(crate) fn grids(&self, source: atlas::Settings) -> Vec<Settings> {
        let base = Settings { atlas: source, ..self.options.settings(self.scene.playback.width) };
        let short = self.options.room.is_some();
        let usual: &[u32] = if short { &SHORT_CELLS } else { &CELLS };
        let cells = self.options.cell.map_or(usual.to_vec(), |cell| vec![cell]);
        // Where memory is short, straight time and space too: steps lead from there to one of both.
        let straight =
            Settings { time: self.options.time.unwrap_or(TIME_LINEAR), space: self.options.space.unwrap_or(SPACE_LINEAR), ..base };
        let kinds = if short { vec![straight, base] } else { vec![base] };
        let frames = self.scene.playback.frames;
        let shortest = SHORT.1.into_iter().filter(|_| frames <= SHORT.0);
        let shorter: Vec<u32> = INTERVALS.into_iter().chain(shortest).filter(|&interval| interval < frames).collect();
        let intervals = match self.options.key_interval {
            Some(interval) => vec![interval],
            None if shorter.is_empty() => vec![base.key_interval],
            None => shorter,
        };
        let each = |cell: u32, kind: Settings| intervals.iter().map(move |&key_interval| Settings { cell, key_interval, ..kind });
        let mut grids: Vec<Settings> = cells.iter().flat_map(|&cell| kinds.iter().flat_map(move |&kind| each(cell, kind))).collect();
        grids.dedup_by_key(|grid| (grid.cell, grid.key_interval, grid.time, grid.space));
        grids
    }

    /// Tells how much of the search is done.
    pub(crate) fn say(&self, done: usize, of: usize) {
        (self.progress)("searching", done as f64 / of.max(1) as f64);
    }

    /// The error that sheets are left out at where pictures have about that of `error`: none where all are asked for.
    pub(crate) fn prunes(&self, error: f64) -> f64 {
        if self.options.all_sheets { 0.0 } else { error }
    }

    /// What the user left open, and what a bit is worth, which searches choose.
    pub(crate) fn free(&self) -> Free {
        let Options { cell, key_interval, time, space, .. } = *self.options;
        // Straight time and space are for want of memory.
        let short = self.options.limits().memory.is_some();
        Free {
            cell: cell.is_none(),
            interval: key_interval.is_none(),
            lambda: true,
            time: short && time.is_none(),
            space: short && space.is_none(),
            frames: self.scene.playback.frames,
        }
    }
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
pub(crate) mod tests {
    use crate::scene::{Scene, builtin};

    /// A built-in scene that searches take seconds for.
    pub(crate) fn small(name: &str) -> Scene {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (48, 36, 9);
        scene
    }
}
