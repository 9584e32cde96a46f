//! Quality: the smallest bundle whose pictures are as good as is asked for, which may have to play in a number of bytes of memory too.
//! Rays and options come from `tune`; the choice goes back there.

use crate::atlas;
use crate::bake::{BakeError, Encoded, Flat, Settings};
use crate::climb::{Step, Take, climb};
use crate::metrics;
use crate::tune::{Chosen, DENSITIES, MOST_MEMORY, STEPS, Search, possible};
use crate::verify;

/// The score of a bundle of no bytes that reaches the quality asked for; no quality in dB is half as high, nor is a bundle half as large.
const REACHED: f64 = 1e12;

/// What was tried for a quality, and what came of it.
struct Trials<'s, 'a> {
    search: &'s Search<'a>,
    /// Mean PSNR asked for, dB.
    asked: f64,
    /// How many there were, and may be.
    done: usize,
    most: usize,
    /// The best quality of those that play in the memory there is, dB.
    nearest: f64,
    /// Memory that others may take, bytes: as much as the first ones do.
    room: usize,
    /// The least that any takes.
    smallest: usize,
    /// What a bundle cannot hold.
    exceeded: Option<BakeError>,
}

impl<'s, 'a> Trials<'s, 'a> {
    const fn new(search: &'s Search<'a>, asked: f64, most: usize) -> Self {
        Self { search, asked, done: 0, most, nearest: 0.0, room: MOST_MEMORY, smallest: usize::MAX, exceeded: None }
    }

    /// What `settings` make of `flat` is worth: of bundles that reach the quality the smaller one more, of those that do not the better one, and less than those,
    /// of bundles that take more memory than there is, the one that takes less. `None` where there is none. `first`: it may take what memory it will.
    fn score(&mut self, flat: &Flat, settings: &Settings, first: bool) -> Result<Option<f64>, BakeError> {
        let (search, limits) = (self.search, self.search.options.limits());
        search.say(self.done, self.most);
        self.done += 1;
        let Some(Encoded { bundle, .. }) = possible(search.encode(flat, settings), &mut self.exceeded)? else { return Ok(None) };
        let memory = verify::memory(&bundle)?;
        self.smallest = self.smallest.min(memory);
        let over = limits.over(0, memory);
        if over > 0 {
            return Ok(Some(-(over as f64)));
        }
        let painted = search.painter.map_or(Ok(None), |painter| painter.painted(&bundle, &flat.atlas.image, &settings.atlas))?;
        let (bundle, image) = painted.map_or((bundle, None), |(bundle, image)| (bundle, Some(image)));
        let psnr = verify::briefly(&bundle, image.as_ref().unwrap_or(&flat.atlas.image), &flat.atlas.gbuffer)?.psnr_mean;
        let reached = psnr >= self.asked;
        // Where nothing is said of memory, it is no matter until there is one that reaches it.
        if first || limits.memory.is_some() || (reached && self.nearest < self.asked) {
            self.room = self.room.max(memory);
        }
        self.nearest = self.nearest.max(psnr);
        Ok(match reached {
            true if memory <= self.room => Some(REACHED - bundle.len() as f64),
            true => None,
            false => Some(psnr),
        })
    }

    /// The best of the grids that are tried at first, with its score.
    fn grids(&mut self, flat: &Flat, source: atlas::Settings) -> Result<Option<(Settings, f64)>, BakeError> {
        let mut best: Option<(Settings, f64)> = None;
        for settings in self.search.grids(source) {
            let settings = Settings { error: self.search.prunes(metrics::mse(self.asked)), ..settings };
            if let Some(found) = self.score(flat, &settings, true)?
                && best.is_none_or(|(_, most)| found > most)
            {
                best = Some((settings, found));
            }
        }
        Ok(best)
    }

    /// What to say where none reaches the quality; `any`: there was a bundle.
    fn failed(self, any: bool) -> BakeError {
        let Self { search: Search { options, .. }, asked, nearest, smallest, exceeded, .. } = self;
        let held = options.held();
        match (exceeded.filter(|_| !any), options.limits().memory) {
            // Not a single bundle: what was in the way is the answer.
            (Some(exceeded), _) => exceeded,
            (None, Some(asked)) if smallest > asked => BakeError::Ram { asked, smallest, held },
            _ => BakeError::Psnr { asked, nearest, held },
        }
    }
}

impl Search<'_> {
    /// The smallest bundle whose mean PSNR against exact rays reaches `asked`.
    ///
    /// # Errors
    /// [`BakeError::Psnr`] where none does, [`BakeError::Ram`] where none plays in the memory there is; whatever flattening and encoding say.
    pub(crate) fn psnr(&self, asked: f64) -> Result<Chosen, BakeError> {
        let (mut source, free) = (self.options.source(), self.free());
        let ratios: Vec<f64> = DENSITIES.into_iter().filter(|&ratio| ratio == 1.0 || ratio < 0.8).collect();
        let mut trials = Trials::new(self, asked, self.grids(source).len() + STEPS);
        let mut best: Option<(Settings, f64)> = None;
        for (turn, &ratio) in ratios.iter().enumerate() {
            let wanted = atlas::Settings { density: source.density * ratio, ..source };
            let flat = self.flat(wanted)?;
            if turn == 0 {
                source.density *= flat.atlas.figures.scale.min(1.0);
                best = trials.grids(&flat, wanted)?;
            } else if let Some((settings, found)) = &mut best {
                // With fewer texels a pixel, what came closest.
                settings.atlas = wanted;
                *found = trials.score(&flat, settings, false)?.unwrap_or(0.0);
            }
            let Some(start) = best else { break };
            let most = if turn == 0 || start.1 > REACHED / 2.0 { STEPS } else { 0 };
            let (settings, found) = climb(start, &free, (Take::First, &Step::ALL), most, |settings| trials.score(&flat, settings, false))?;
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
            if turn == 0 {
                // A coarser picture is rarely asked for: only then there is one more try for each, and steps from the one that does.
                trials.most += ratios.len() - 1 + STEPS;
            }
        }
        Err(trials.failed(best.is_some()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::bake_scene;
    use crate::options::{Goal, Options, TruthFrames};
    use crate::tune::tests::small;

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
