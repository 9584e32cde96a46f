//! A whole job: a scene and what the user asks of its bundle in; the bundle, verified, and its report out.
//! The stages are `bake`'s, the search is `tune`'s, the figures are `verify`'s.

use crate::atlas;
use crate::bake::{self, BakeError, Fitted, Flat, Progress, Settings, something_seen};
pub use crate::baked::Baked;
use crate::bends::Bends;
use crate::budget;
use crate::cast::Cast;
use crate::chart::{self, Choice, Family};
use crate::choose;
use crate::fewer;
use crate::finer;
use crate::halves;
use crate::inspect::Inspection;
use crate::made::Made;
use crate::options::{Goal, Options, TruthFrames};
use crate::outlines;
use crate::repaint::Painter;
use crate::report::{Origin, Report, Seconds};
use crate::scene::{self, Scene};
use crate::seen::Seen;
use crate::straight;
use crate::trace::Tracer;
use crate::truth::{Truth, spread};
use crate::tune::{self, Chosen, Whole};
use crate::{usual, verify};
use cubist_core::format::TexelKind;
use std::time::Instant;

/// Keys that trials of charts have, at least, on paths with as many frames; on brief ones twice as many.
const TRIAL_KEYS: u32 = 16;

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
    let play = &scene.playback;
    let pixels = u64::from(play.width) * u64::from(play.height) * u64::from(play.frames);
    if pixels > u64::from(u32::MAX) {
        return Err(BakeError::Pixels(pixels));
    }
    progress("building the hierarchy", 0.0);
    // Charts that the scene brings are as it wants them.
    let split = if chart::brings_own(scene) { None } else { scene::split(scene) };
    let mut baked = by(&Tracer::new(split.as_ref().unwrap_or(scene)), options, progress)?;
    baked.report.triangles = scene.triangles.len();
    Ok(baked)
}

/// Like [`run`], of a scene whose rays `tracer` casts.
fn by(tracer: &Tracer<'_>, options: &Options, progress: Progress<'_>) -> Result<Baked, BakeError> {
    let start = Instant::now();
    let choice = choice(tracer, options, progress)?;
    let options = &Options { charts: Some(choice), ..*options };
    let mut baked = toward(tracer, options, progress)?;
    if let Some(budget) = options.limits().bytes {
        let (asked, used) = (options.source(), baked.settings.atlas);
        let halved = (used.texels != asked.texels).then(|| budget::halved(budget));
        // By what it takes with the outline that was chosen for it.
        let packed = (used.storage != asked.storage).then(|| budget::packed(budget, baked.report.memory.picture));
        baked.report.warnings.extend(halved.into_iter().chain(packed));
    }
    // Whatever was not for this bundle was for finding it.
    let (seconds, total) = (&mut baked.report.seconds, options.load_seconds + tracer.seconds + start.elapsed().as_secs_f64());
    seconds.search += total - seconds.total;
    seconds.total = total;
    Ok(baked)
}

/// Like [`by`], of charts that are chosen. What is baked where nothing is asked for is the answer where it is as good a one.
fn toward(tracer: &Tracer<'_>, options: &Options, progress: Progress<'_>) -> Result<Baked, BakeError> {
    let usual = |storage, texels| once(tracer, &Options { goal: None, storage, texels, ..*options }, None, progress);
    let Some(goal) = options.goal else { return once(tracer, options, None, progress) };
    match goal {
        // What needs no more memory than there is stays as it is; where it cannot be had at all, the search says why.
        Goal::Ram(_) => match usual(options.storage, options.texels) {
            Ok(baked) if usual::reaches(goal, options.limits(), &baked) => Ok(baked),
            Ok(Baked { settings, report, psnr_before: psnr, .. }) => {
                once(tracer, options, Some(Whole { settings, memory: report.memory.workspace, psnr }), progress)
            }
            Err(_) => once(tracer, options, None, progress),
        },
        Goal::Budget(_) | Goal::Psnr(_) => {
            let found = once(tracer, options, None, progress);
            let asked = options.source();
            let asked = (goal, options.limits(), (asked.storage, asked.texels));
            usual::or_found(asked, &Seen::new(tracer, None), found, |(storage, texels)| usual(Some(storage), Some(texels)))
        }
    }
}

/// Like [`toward`], of what the settings or a search give; `whole`: what is too large for a [`Goal::Ram`], where there is such a bundle.
fn once(tracer: &Tracer<'_>, options: &Options, whole: Option<Whole>, progress: Progress<'_>) -> Result<Baked, BakeError> {
    let (start, scene) = (Instant::now(), tracer.scene());
    // What outlines need of it, flash has. Where memory or quality is searched for no finer ones are tried.
    let outline = whole.map_or(options.source.outline, |whole| whole.settings.atlas.outline);
    let outline = if matches!(options.goal, None | Some(Goal::Budget(_))) { outline } else { outline.or(Some(0)) };
    let options = &Options { source: atlas::Settings { outline, ..options.source }, ..*options };
    let cast = Cast::by(tracer.of(scene), progress);
    let paint_start = Instant::now();
    let painter = (!options.plain).then(|| Painter::new(&cast, progress));
    let paint_seconds = paint_start.elapsed().as_secs_f64();
    let (chosen, surface) = match options.goal {
        None => as_set(&cast, options, progress)?,
        Some(goal) => (tune::search((&cast, painter.as_ref()), options, goal, whole, progress)?, Surface::default()),
    };
    let Chosen { mut flat, encoded, settings, search_seconds, warnings, contested } = chosen;
    // Large, and of no more use.
    drop(cast);
    let better_start = Instant::now();
    let quality = verify::briefly(&encoded.bundle, &flat.atlas.image, &flat.atlas.gbuffer)?;
    let (seen, bends) = (Seen::new(tracer, painter.as_ref()), surface.bends);
    let made = Made { settings, encoded, quality };
    let Bettered { mut made, outlines, spaces, why } = bettered((scene, &mut flat), made, surface, options, &seen, progress)?;
    let psnr_before = made.quality.psnr_mean;
    let (search_seconds, paint_start) = (search_seconds + better_start.elapsed().as_secs_f64(), Instant::now());
    let repainted = painter.as_ref().map_or(Ok(false), |painter| painter.repaint(&mut made, &mut flat.atlas, options.goal))?;
    let (paint_seconds, halves_start) = (paint_seconds + paint_start.elapsed().as_secs_f64(), Instant::now());
    let Made { settings, encoded, .. } = made;
    let halves = match &painter {
        Some(painter) if tells_halves(options) => {
            progress("trying half a byte a texel", 0.0);
            let (image, brought) = (&flat.atlas.image, settings.atlas.charts.family == Family::Own && chart::brings_own(scene));
            halves::tried(&encoded.bundle, image, &settings.atlas, !brought, (painter, &seen))?
        }
        _ => None,
    };
    let (search_seconds, verify_start) = (search_seconds + halves_start.elapsed().as_secs_f64(), Instant::now());
    progress("comparing with exact rays", 0.0);
    let quality = verify::against_exact(&encoded.bundle, &flat.atlas, &|d, n| progress("comparing with exact rays", part(d, n)))?;
    let inspection = Inspection::of(&encoded.bundle).map_err(verify::VerifyError::from)?;
    let work = verify::work(&encoded.bundle)?;
    let truth = against_truth(&encoded.bundle, (tracer, &seen), options.truth, progress)?;
    let seconds = Seconds {
        total: options.load_seconds + tracer.seconds + start.elapsed().as_secs_f64(),
        load: options.load_seconds,
        atlas: flat.atlas_seconds,
        rays: tracer.seconds + flat.ray_seconds,
        encode: encoded.seconds,
        paint: paint_seconds,
        verify: verify_start.elapsed().as_secs_f64(),
        search: search_seconds,
    };
    let origin = Origin { scene, flat: &flat, encoded: &encoded, settings: &settings, spaces, bends, why, outlines, halves, repainted };
    let mut report = Report::new(&origin, &inspection, quality, truth, work, seconds);
    report.warnings.extend(warnings);
    Ok(Baked { bundle: encoded.bundle, report, flat, settings, psnr_before, contested })
}

/// Whether the report has to say what texels of half a byte would come to: where it is open what they are, and no search has to tell.
fn tells_halves(options: &Options) -> bool {
    let (colours, half) = (options.source().colours, TexelKind::Indexed4.colours());
    // More colours than that may be asked for, but not all of them.
    let open = options.may_halve() && (colours <= half || colours >= TexelKind::Indexed8.colours());
    open && options.goal.is_none() && !options.quick && options.truth != TruthFrames::None
}

/// What is known of the surface that a bundle was made of, where the settings alone made it.
#[derive(Default)]
struct Surface {
    fitted: Option<Fitted>,
    bends: Option<Bends>,
}

/// How positions are interpolated between nodes at first, in cells of `cell` pixels.
fn first_space(options: &Options, bends: Option<Bends>, cell: u32) -> u8 {
    options.space.unwrap_or(straight::first(cell, bends))
}

/// What the settings make of the scene.
fn as_set(cast: &Cast<'_>, options: &Options, progress: Progress<'_>) -> Result<(Chosen, Surface), BakeError> {
    let scene = cast.scene;
    let settings = options.settings(scene.playback.width);
    let flat = bake::flatten_cast(cast, &settings.atlas, progress)?;
    something_seen(&flat)?;
    let bends = if options.space.is_none() { straight::told(&flat.atlas.gbuffer, settings.cell) } else { None };
    let settings = Settings { space: first_space(options, bends, settings.cell), ..settings };
    let fitted = bake::fitted(scene, &flat, &settings, progress)?;
    let encoded = bake::settled(scene, &flat, &fitted, &settings, progress)?;
    let chosen = Chosen { flat, encoded, settings, search_seconds: 0.0, warnings: Vec::new(), contested: None };
    Ok((chosen, Surface { fitted: Some(fitted), bends }))
}

/// A bundle bettered, and what the report has to say of it.
struct Bettered {
    made: Made,
    outlines: Vec<outlines::Trial>,
    spaces: Vec<straight::Trial>,
    /// Why it has other cells or intervals than usual.
    why: Option<String>,
}

/// `made`, or what is made of the same source image otherwise and is worth more: of what the user left open, the outline, the sheets, the grid and the
/// space are tried, one after the other. Searches have tried what they could; of theirs it is the outline alone.
fn bettered(
    (scene, flat): (&Scene, &mut Flat),
    made: Made,
    Surface { fitted, bends }: Surface,
    options: &Options,
    seen: &Seen<'_>,
    progress: Progress<'_>,
) -> Result<Bettered, BakeError> {
    let usual = made.settings;
    let (made, outlines) = outlines::choose(scene, flat, fitted, made, options.limits(), progress)?;
    if options.goal.is_some() {
        return Ok(Bettered { made, outlines, spaces: Vec::new(), why: None });
    }
    let all = made.quality;
    let made = if options.all_sheets { made } else { fewer::choose(scene, flat, made, progress)? };
    let (made, other) = if options.cell.is_none() && options.key_interval.is_none() {
        finer::choose(scene, flat, made, &all, &|cell| first_space(options, bends, cell), seen, progress)?
    } else {
        (made, None)
    };
    // In smaller cells they bend less.
    let smooth = bends == Some(Bends::Smooth) && made.settings.cell >= usual.cell;
    let (made, spaces) =
        if options.space.is_none() && !smooth { straight::choose(scene, flat, made, progress)? } else { (made, Vec::new()) };
    // In other cells what a sheet has to save is another thing.
    let made = if !options.all_sheets && other.is_some() { fewer::anew(scene, flat, made, progress)? } else { made };
    let why = other.map(|other| other.said(&made));
    Ok(Bettered { made, outlines, spaces, why })
}

/// The finished `bundle` beside as much of the antialiased scene as is asked for.
fn against_truth(
    bundle: &[u8],
    (tracer, seen): (&Tracer<'_>, &Seen<'_>),
    asked: TruthFrames,
    progress: Progress<'_>,
) -> Result<Option<verify::TruthQuality>, BakeError> {
    let scene = tracer.scene();
    let frames = match asked {
        TruthFrames::None => return Ok(None),
        TruthFrames::Most(most) => spread(scene.playback.frames, most),
        TruthFrames::All => spread(scene.playback.frames, scene.playback.frames),
    };
    if frames.is_empty() {
        return Ok(None);
    }
    progress("comparing with the truth", 0.0);
    let bar = |d, n| progress("comparing with the truth", part(d, n));
    Ok(Some(verify::against_truth(bundle, &Truth::by(tracer.of(scene)), &frames, seen.rendered(), &bar)?))
}

fn part(done: u32, total: u32) -> f64 {
    f64::from(done) / f64::from(total.max(1))
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
        None if options.quick => Ok(Choice { rewarped, ..Family::Planes.into() }),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn a_first_look_tries_nothing() {
        let mut scene = builtin::build("round-columns").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (64, 48, 9);
        // Charts are tried where the scene brings none.
        scene.triangles.iter_mut().for_each(|triangle| triangle.island = None);
        let options = Options { truth: TruthFrames::None, ..Options::default() };
        let of = |options| run(&scene, &options, &|_, _| {}).unwrap().report;
        let (quick, usual) = (of(options.quick()), of(options));
        let tried = |report: &Report| {
            let image = &report.source_image;
            (report.grid.spaces.len(), image.outlines.len(), image.trials.len(), report.grid.why.is_some())
        };
        assert_eq!(tried(&quick), (0, 0, 0, false));
        assert_ne!(tried(&usual), tried(&quick));
        let wanted = Options { key_interval: Some(2), ..options }.quick();
        assert_eq!((of(wanted).grid.key_interval, quick.grid.key_interval), (2, 4));
    }

    #[test]
    fn more_pixels_than_can_be_numbered_are_refused() {
        let mut scene = builtin::build("pyramid").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (4096, 4096, 256);
        let error = run(&scene, &Options::default(), &|_, _| {}).err();
        assert_eq!(error, Some(BakeError::Pixels(1 << 32)));
    }
}
