//! Budget: the best bundle of at most a number of bytes, which may have to play in a number of bytes of memory too.
//! Rays and options come from `tune`; the choice goes back there. Source images and ways to code keys are measured apart, then the pairs that promise most
//! are baked.

use crate::atlas::{self, Storage};
use crate::bake::{BakeError, Encoded, Flat, Settings, Sparing};
use crate::climb::{Free, Step, Take, climb};
use crate::encode::{image_bytes, raw_bytes};
use crate::repaint;
use crate::samples::Samples;
use crate::terminal::grouped;
use crate::tune::{Chosen, DENSITIES, MOST_MEMORY, STEPS, Search, possible};
use crate::verify;
use cubist_core::format::TexelKind;

/// What a bit is worth at first in the search for a budget.
const BUDGET_LAMBDA: f32 = 0.1;
/// Source images tried, at most, of each kind of texels.
const IMAGES: usize = 1 + DENSITIES.len();
/// Bundles that fit the budget and are measured, of each kind of texels, before the best of them is bettered step by step.
const TRIES: usize = 4;
/// How far a predicted size may lie over the budget and still be tried: coarser keys take less.
const SLACK: f64 = 1.15;
/// What texels of half a byte have to bring where whole ones fit too, dB: a device draws them slower, and its player has to be one for them.
const HALVES: f64 = 0.1;

/// A source image, measured.
struct Image {
    source: atlas::Settings,
    /// Bytes stored as asked for; packed, if that is left to the search.
    bytes: usize,
    packed: Option<usize>,
    /// Bytes that it takes of memory where it is packed.
    unpacked: usize,
    /// Mean squared error of exact rays through it against the truth.
    error: f64,
}

/// What of its settings says how fine a source image is.
type Fineness = ([f64; 2], TexelKind);

fn fineness(source: &atlas::Settings) -> Fineness {
    ([source.density, source.detail], source.texels)
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

    /// Bytes of working memory for playing that bundle.
    fn memory(&self, keys: &Keys, budget: u64) -> usize {
        let (_, source) = self.with(keys, budget);
        keys.memory + if source.storage == Storage::Packed { self.unpacked } else { 0 }
    }
}

/// The source images that a search for a budget has to choose from.
struct Images {
    all: Vec<Image>,
    /// The finest that leaves room for keys, or else the coarsest, of the first kind of texels: keys are measured at this one.
    reference: Flat,
    /// Of each kind of texels, bytes of the one that is as fine as asked for; packed, if that is left to the search.
    usual: Vec<(TexelKind, usize, Option<usize>)>,
}

/// What a climb starts from, and its score.
type Start = (Settings, f64);

/// A way to code keys, measured at one source image.
#[derive(Clone, Copy)]
struct Keys {
    settings: Settings,
    bytes: usize,
    /// Bytes of working memory, but for an unpacked source image.
    memory: usize,
    /// What playback adds to the mean squared error against the truth.
    error: f64,
}

impl Search<'_> {
    /// The best bundle of at most `budget` bytes.
    ///
    /// Source images and grids are measured apart, then the sums of their bytes and of their errors say which pairs to bake.
    pub(crate) fn budget(&self, budget: u64) -> Result<Chosen, BakeError> {
        let steps = self.kinds().len() * (IMAGES + TRIES) + self.grids(self.options.source()).len() + STEPS;
        let samples = Samples::new(self.cast);
        let Images { all: images, reference, usual } = self.images(budget, &samples, steps)?;
        let keys = self.keys(&reference, &samples, steps)?;
        drop(reference);
        let mut pairs: Vec<(&Image, &Keys)> = images.iter().flat_map(|image| keys.iter().map(move |keys| (image, keys))).collect();
        pairs.sort_by(|a, b| {
            // Kind by kind of texels, so that what is tried next is often of the same image.
            let other = |(image, _): &(&Image, &Keys)| image.source.texels != self.options.source().texels;
            let error = |(image, keys): &(&Image, &Keys)| image.error + keys.error;
            other(a).cmp(&other(b)).then(error(a).total_cmp(&error(b))).then(a.0.with(a.1, budget).0.cmp(&b.0.with(b.1, budget).0))
        });
        let chosen = self.best_pair(budget, &pairs, &samples, steps)?;
        // Half of what its keys take here may go as they are settled.
        let base = self.options.settings(self.scene.playback.width);
        let own = keys.iter().find(|keys| (keys.settings.cell, keys.settings.key_interval) == (base.cell, base.key_interval));
        let fits = |image: usize| (image + own.map_or(0, |own| own.bytes / 2)) as u64 <= budget;
        // What was asked for before what the search took instead.
        let chose = chosen.settings.atlas.texels;
        let kinds = || usual.iter().filter(|&&(kind, ..)| kind == base.atlas.texels || kind == chose);
        let whole = kinds().find_map(|&(kind, bytes, _)| fits(bytes).then_some((base.atlas.storage, kind)));
        let packed = || kinds().find_map(|&(kind, _, packed)| packed.filter(|&packed| fits(packed)).map(|_| (Storage::Packed, kind)));
        let contested = whole.or_else(packed);
        Ok(Chosen { contested, ..chosen })
    }

    /// The kinds of texels to try.
    fn kinds(&self) -> Vec<TexelKind> {
        let asked = self.options.source().texels;
        if self.options.may_halve() { vec![asked, TexelKind::Indexed4] } else { vec![asked] }
    }

    /// What texels of `kind` have to bring beside those asked for, dB.
    fn price(&self, kind: TexelKind) -> f64 {
        if kind == self.options.source().texels { 0.0 } else { HALVES }
    }

    /// Measures source images, kind by kind of texels and the finest first, but for those that are far too large for `budget`.
    fn images(&self, budget: u64, samples: &Samples, steps: usize) -> Result<Images, BakeError> {
        let room = usize::try_from(budget).unwrap_or(usize::MAX);
        let asked = self.options.source();
        let (mut images, mut reference, mut usual): (Vec<Image>, _, _) = (Vec::new(), None, Vec::new());
        let all = self.options.detail.is_none().then_some((f64::INFINITY, 1.0));
        for (number, texels) in self.kinds().into_iter().enumerate() {
            // Where the finest one takes less than half of the room, half as many bytes would be of no use.
            if images.first().is_some_and(|finest| number > 0 && 2 * finest.bytes < room) {
                break;
            }
            let mut scale = 1.0;
            for (step, (detail, ratio)) in all.into_iter().chain(DENSITIES.map(|ratio| (asked.detail, ratio))).enumerate() {
                self.say(number * IMAGES + step, steps);
                let source = atlas::Settings { density: asked.density * scale * ratio, detail, texels, ..asked };
                let coarsest = ratio == DENSITIES[DENSITIES.len() - 1];
                let finer = |last: &Image| source.density / last.source.density;
                if let Some(last) = images.last()
                    && (last.source.detail, last.source.texels) == (detail, texels)
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
                    usual.push((texels, bytes, packed));
                }
                let unpacked = raw_bytes(&flat.atlas.image);
                let image = Image { source, bytes, packed, unpacked, error: samples.of_image(&flat.atlas) };
                if reference.is_none() && (image.least() < room / 10 * 9 || coarsest) {
                    reference = Some(flat);
                }
                // A flattening of the scene's own has all its detail as it is.
                if !images.last().is_some_and(|last| (last.bytes, last.error) == (image.bytes, image.error)) {
                    images.push(image);
                }
            }
        }
        let reference = reference.ok_or(BakeError::Budget { budget, smallest: u64::MAX })?;
        Ok(Images { all: images, reference, usual })
    }

    /// Measures every way to code keys at one source image.
    fn keys(&self, flat: &Flat, samples: &Samples, steps: usize) -> Result<Vec<Keys>, BakeError> {
        let asked = self.options.source();
        let (image_bytes, image_error) = (image_bytes(&flat.atlas.image, asked.storage), samples.of_image(&flat.atlas));
        let packed = asked.storage == Storage::Packed;
        let (mut keys, mut exceeded) = (Vec::<Keys>::new(), None);
        for mut settings in self.grids(asked) {
            self.say(self.kinds().len() * IMAGES + keys.len(), steps);
            settings.coding = settings.coding.worth(BUDGET_LAMBDA);
            // The last grid's error is about this one's, and a little more.
            settings.error = self.prunes(keys.last().map_or(0.0, |keys| keys.error));
            let Some(Encoded { bundle, .. }) = possible(self.encode(flat, &settings), &mut exceeded)? else { continue };
            let (error, _) = samples.of_bundle(&bundle)?;
            let (bytes, unpacked) = (bundle.len().saturating_sub(image_bytes), if packed { raw_bytes(&flat.atlas.image) } else { 0 });
            let memory = verify::memory(&bundle)?.saturating_sub(unpacked);
            keys.push(Keys { settings, bytes, memory, error: (error - image_error).max(0.0) });
        }
        exceeded.filter(|_| keys.is_empty()).map_or(Ok(keys), Err)
    }

    /// Bakes the `pairs` that promise most until enough of them fit, and steps on from the best.
    fn best_pair(&self, budget: u64, pairs: &[(&Image, &Keys)], samples: &Samples, steps: usize) -> Result<Chosen, BakeError> {
        let mut current: Option<(Fineness, Flat)> = None;
        let mut exceeded = None;
        // Of each kind of texels the best.
        let mut starts: Vec<Start> = Vec::new();
        let (limits, mut nearest) = (self.options.limits(), (u64::MAX, 0, 0));
        let (mut fitting, mut room) = (Vec::new(), MOST_MEMORY);
        // Of bundles that fit the better one counts, of those that do not the smaller one: from there steps may lead to one that does.
        let mut score = |flat: &Flat, settings: &Settings, first: bool| -> Result<Option<f64>, BakeError> {
            let Some(Encoded { bundle, .. }) = possible(self.encode(flat, settings), &mut exceeded)? else { return Ok(None) };
            let (bytes, memory) = (bundle.len() as u64, verify::memory(&bundle)?);
            let over = limits.over(bytes, memory);
            nearest = nearest.min((over, bytes, memory));
            if over > 0 {
                return Ok(Some(-(over as f64)));
            }
            // What is there may be used.
            room = if first || limits.memory.is_some() { room.max(memory) } else { room };
            Ok(if memory <= room { Some(samples.of_bundle(&bundle)?.1) } else { None })
        };
        // Of those that are predicted to take more memory than there is, the least are tried if there are no others.
        let memory = |(image, keys): &(&Image, &Keys)| image.memory(keys, budget);
        let most = limits.memory.map(|most| pairs.iter().map(memory).min().unwrap_or(0).max(most));
        let pairs = pairs.iter().filter(|pair| most.is_none_or(|most| memory(pair) <= most));
        // Where nothing is predicted to fit, the smallest prediction is tried all the same.
        let least = pairs.clone().map(|(image, keys)| image.with(keys, budget).0).min().unwrap_or(0);
        for (image, keys) in pairs {
            let (predicted, source) = image.with(keys, budget);
            let tried = fitting.iter().filter(|&&kind| kind == source.texels).count();
            if tried == TRIES || (predicted as f64 > budget as f64 * SLACK && predicted > least) {
                continue;
            }
            self.say(steps - STEPS - self.kinds().len() * TRIES + fitting.len(), steps);
            let flat = self.at_hand(&mut current, &image.source)?;
            let error = self.prunes(keys.error);
            let settings = Settings { atlas: source, sparing: Sparing::Within(budget), error, ..keys.settings };
            let found = score(&flat, &settings, true)?;
            current = Some((fineness(&image.source), flat));
            let Some(found) = found else { continue };
            fitting.extend((found > 0.0).then_some(source.texels));
            match starts.iter_mut().find(|(settings, _)| settings.atlas.texels == source.texels) {
                Some(best) if found <= best.1 => {}
                Some(best) => *best = (settings, found),
                None => starts.push((settings, found)),
            }
        }
        let Some((start, flat)) = self.better(&starts, current, samples)? else {
            return Err(exceeded.unwrap_or(BakeError::Budget { budget, smallest: u64::MAX }));
        };
        // Coarser coding is what makes a bundle fit.
        let free = Free { lambda: false, ..self.free() };
        let mut step = steps - STEPS;
        let (settings, found) = climb(start, &free, (Take::First, &Step::ALL), STEPS, |settings| {
            self.say(step, steps);
            step += 1;
            score(&flat, settings, false)
        })?;
        if found < 0.0 {
            let (_, bytes, memory) = nearest;
            return Err(match limits.memory {
                Some(room) => BakeError::Both { budget, room, bytes, memory, held: self.options.held() },
                None => BakeError::Budget { budget, smallest: bytes },
            });
        }
        self.finish(flat, settings, Vec::new())
    }

    /// The better one of `starts`, and its source image, which `current` may be: of those that fit by their painted colours, since 16 colours leave
    /// painting less to gain.
    fn better(
        &self,
        starts: &[Start],
        mut current: Option<(Fineness, Flat)>,
        samples: &Samples,
    ) -> Result<Option<(Start, Flat)>, BakeError> {
        let fit = starts.iter().all(|&(_, found)| found > 0.0);
        let best = starts.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(&[][..], std::slice::from_ref);
        let starts = if fit { starts } else { best };
        let mut better: Option<(f64, Start, Flat)> = None;
        for &(settings, found) in starts {
            let flat = self.at_hand(&mut current, &settings.atlas)?;
            // One alone is the best as it is.
            let psnr = if starts.len() == 1 { found } else { self.painted(&flat, &settings, samples)? - self.price(settings.atlas.texels) };
            if better.as_ref().is_none_or(|&(most, ..)| psnr > most) {
                better = Some((psnr, (settings, found), flat));
            }
        }
        Ok(better.map(|(_, start, flat)| (start, flat)))
    }

    /// The source image of `source`, laid out as asked for, however it is stored: `current`, if that is it.
    fn at_hand(&self, current: &mut Option<(Fineness, Flat)>, source: &atlas::Settings) -> Result<Flat, BakeError> {
        match current.take() {
            Some((fine, flat)) if fine == fineness(source) => Ok(flat),
            // Large: gone before another one is made.
            other => {
                drop(other);
                self.flat(atlas::Settings { storage: self.options.source().storage, ..*source })
            }
        }
    }

    /// The mean PSNR against the truth of what `settings` make of `flat`, dB, in the colours that it gets in the end.
    fn painted(&self, flat: &Flat, settings: &Settings, samples: &Samples) -> Result<f64, BakeError> {
        let Encoded { bundle, .. } = self.encode(flat, settings)?;
        Ok(samples.of_bundle(&repaint::finished(self.painter, &bundle, &flat.atlas.image, &settings.atlas)?)?.1)
    }
}

/// What the user should know where texels are half a byte for the sake of `budget`.
pub(crate) fn halved(budget: u64) -> String {
    format!(
        "--budget {budget}: texels are half a byte, of 16 colours: a firmware's player of them is a Player<Indexed4> or Player<AnyTexels>; --texels 8 \
         keeps whole bytes, at lower quality, if they fit"
    )
}

/// What the user should know where the source image is packed for the sake of `budget`, and takes so many bytes of memory.
pub(crate) fn packed(budget: u64, memory: usize) -> String {
    format!(
        "--budget {budget}: the source image is packed to fit, and takes {} bytes of memory unpacked; --storage raw keeps it in flash, at lower quality",
        grouped(memory)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::bake_scene;
    use crate::options::{Goal, Options, TruthFrames};
    use crate::tune::tests::small;

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
    fn texels_are_half_a_byte_where_that_shows_more() {
        let mut scene = small("street");
        // As fine as charts are told to be.
        scene.triangles.iter_mut().for_each(|triangle| triangle.island = None);
        let bake = |goal, texels| {
            let charts = Some(crate::chart::Family::Planes.into());
            let options =
                Options { goal, texels, charts, storage: Some(Storage::Raw), cell: Some(8), truth: TruthFrames::All, ..Options::default() };
            bake_scene(&scene, &options, &|_, _| {}).unwrap()
        };
        let (plain, usual) = bake(None, None);
        assert_eq!(usual.source_image.texels, TexelKind::Indexed8);
        let tight = Some(Goal::Budget(plain.len() as u64 * 52 / 100));
        let told = |report: &crate::Report| report.warnings.iter().any(|warning| warning.contains("--texels 8"));
        let psnr = |report: &crate::Report| report.quality_vs_truth.unwrap().psnr_mean;
        let (bytes, open) = bake(tight, None);
        assert!(open.source_image.texels == TexelKind::Indexed4 && told(&open), "{:?}", open.warnings);
        assert!(bytes.len() <= plain.len() * 52 / 100);
        let (_, held) = bake(tight, Some(TexelKind::Indexed8));
        assert!(held.source_image.texels == TexelKind::Indexed8 && !told(&held));
        assert!(psnr(&open) > psnr(&held), "{} {}", psnr(&open), psnr(&held));
        // Where there is room, whole ones stay.
        let (_, wide) = bake(Some(Goal::Budget(plain.len() as u64 * 4)), None);
        assert!(wide.source_image.texels == TexelKind::Indexed8 && !told(&wide));
    }

    #[test]
    fn a_budget_is_kept_in_the_memory_there_is() {
        let scene = small("cone-orbit");
        let bake = |goal, room| {
            let options = Options { goal: Some(goal), room, key_interval: Some(4), truth: TruthFrames::All, ..Options::default() };
            bake_scene(&scene, &options, &|_, _| {})
        };
        let (_, wide) = bake(Goal::Budget(12_000), None).unwrap();
        let room = wide.memory.workspace * 6 / 10;
        let (bytes, tight) = bake(Goal::Budget(12_000), Some(room)).unwrap();
        assert!(bytes.len() <= 12_000 && tight.memory.workspace <= room, "{} {} {room}", bytes.len(), tight.memory.workspace);
        // More of it is no worse: what is baked without a word on memory needs no more than this.
        let (bytes, same) = bake(Goal::Budget(12_000), Some(wide.memory.workspace)).unwrap();
        assert!(bytes.len() <= 12_000 && same.memory.workspace <= wide.memory.workspace);
        let psnr = |report: &crate::Report| report.quality_vs_truth.unwrap().psnr_mean;
        assert!(psnr(&tight) > 20.0 && psnr(&same) >= psnr(&tight) - 0.2, "{} {}", psnr(&tight), psnr(&same));
        let Err(error @ BakeError::Both { memory, .. }) = bake(Goal::Budget(12_000), Some(500)) else { panic!("contexts alone take more") };
        assert!(memory > 500 && error.to_string().contains(&memory.to_string()), "{error}");
        // A quality likewise.
        let asked = same.quality.psnr_mean.min(tight.quality.psnr_mean) - 2.0;
        let (_, good) = bake(Goal::Psnr(asked), Some(room)).unwrap();
        assert!(good.quality.psnr_mean >= asked && good.memory.workspace <= room, "{} {}", good.quality.psnr_mean, good.memory.workspace);
        assert!(matches!(bake(Goal::Psnr(asked), Some(500)), Err(BakeError::Ram { asked: 500, smallest, .. }) if smallest > 500));
        let Err(error @ BakeError::Psnr { .. }) = bake(Goal::Psnr(90.0), Some(room)) else { panic!("90 dB are out of reach") };
        assert!(error.to_string().ends_with("or raise --ram"), "{error}");
    }
}
