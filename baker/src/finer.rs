//! Other cells and key intervals than the usual ones, where trials show that they are worth it. A bundle baked as usual comes from `job`; the best of a few
//! goes back, and why.
//!
//! Two figures of the usual bundle tell what to try. Its wrong pixels: from [`TORN`] on, outlines are *many*, so many cross a cell that sheets are given up.
//! And by how much positions are off on their way from key to key: below [`STEADY`] they are *steady*, from [`BENT`] on they *bend*. `climbs` has the whole
//! list; its main rows are:
//!
//! | outlines | positions | tried | because |
//! |---|---|---|---|
//! | many | steady, or cells are large | cells half as large with keys twice as far apart | shows more for the bytes |
//! | | | else keys twice as far apart | shows as much for fewer bytes |
//! | | | else closer ones | outlines may turn though surfaces go straight on |
//! | many | in between | keys twice as far apart, else closer ones | the same |
//! | many | bend | closer keys | the path may turn too quickly for usual ones |
//! | few | steady | keys twice as far apart, and again | the same |
//! | | | else closer ones | outlines may turn though surfaces go straight on |
//! | few | in between | closer keys | the same |
//! | few | bend | keys twice as close | shows more |
//! | | | with cells twice as large besides, and then the usual ones again | rough land: shows more, in less memory |
//!
//! Two kinds of paths have keys an eighth as far apart tried at once besides, whatever crosses cells. Brief ones, of up to [`BRIEF`] frames, mostly go
//! fast, and a trial of them takes little time: all that is tried counts there, not only what comes before the first gain. On longer ones something may
//! pass close by the camera between two keys (see `passing`): closer keys then come first.

use crate::bake::{BakeError, Flat, Progress, Settings};
use crate::climb::{Free, Step, Take, climb};
use crate::made::Made;
use crate::scene::Scene;
use crate::seen::Seen;
use crate::verify::Brief;
use std::cmp::Ordering;

/// Wrong pixels, percent, from which on smaller cells are worth a try. Most scenes have a tenth of that.
pub(crate) const TORN: f64 = 2.0;
/// Texels that a pixel in a hundred is off by, from which on closer keys are worth a try, and keys farther apart are not. Most scenes have a half to
/// three quarters of that.
const BENT: f64 = 2.0;
/// Texels of the same up to which keys farther apart are worth a try, for their own sake and for smaller cells': what bends on the way then shows. In
/// cells larger than [`USUAL`] it may be the cell that surfaces bend in.
const STEADY: f64 = 1.0;
/// Side of a cell that is neither large nor small, pixels.
const USUAL: u32 = 8;
/// So many times as many wrong pixels as usual are too many for keys farther apart where outlines are few: they flicker, which no mean tells.
const FLICKER: f64 = 1.25;
/// Why keys farther apart are used where neither many outlines nor bends are, and why closer ones there and elsewhere.
const STEADILY: &str = "surfaces go straight on from key to key";
const TURNING: &str = "outlines turn on their way from key to key";
const BENDING: &str = "surfaces bend on their way from key to key";
/// The same where many outlines are.
const CROSSING: &str = "many outlines cross every cell";
const SWEEPING: &str = "outlines sweep past between keys";
/// What keys [`CLOSEST`] frames apart have to gain, dB: they take time in every frame. As much may farther ones lose of what is seen.
const TIME: f64 = 0.2;
/// Frames between keys from which on they are cheap: closer ones take more of every frame's time than all else.
const CLOSEST: u32 = 4;
/// Steps tried where positions bend, at most: fast turns want keys much closer.
const BENT_TRIES: usize = 4;
/// Steps tried from there with the usual cells, where those are worth more after all.
const BACK_TRIES: usize = 3;
/// Texels of the same from which on closer keys are tried whatever crosses cells: a path that turns as fast shows nothing right between its keys, and in
/// every cell outlines of what passes by.
const FAST: f64 = 5.0;
/// So much worse than the mean, dB, is the worst frame where something passes close by the camera between two keys: whole things are missing there for a
/// frame or two, and a key a frame brings them back. Lattices, which are wrong everywhere, have a half of that.
const PASSING: f64 = 4.0;
/// A frame from here on, dB, is good enough, whatever others are.
const GOOD: f64 = 34.0;
/// Paths of at most as many frames mostly go fast: closer keys are tried there whatever crosses cells, down to one a frame, and with larger cells. They are
/// few, and a trial takes little time.
pub(crate) const BRIEF: u32 = 64;

/// Why a bundle is of other cells or intervals than usual, and what the usual one was.
pub(crate) struct Other {
    why: &'static str,
    usual: Made,
}

impl Other {
    /// What the user should know about `made`.
    pub fn said(&self, made: &Made) -> String {
        let Self { why, usual } = self;
        let Settings { cell, key_interval, .. } = usual.settings;
        // Closer keys that are no better beside exact rays were taken for what is seen.
        let seen = if made.settings.key_interval < key_interval && made.quality.psnr_mean < usual.quality.psnr_mean {
            ", which shows less of the antialiased scene"
        } else {
            ""
        };
        // Either alone keeps both as they are usually, which is no advice where nothing speaks for it.
        let way = if cell == made.settings.cell { format!("--key-interval {key_interval}") } else { format!("--cell {cell}") };
        let wanted = if usual.beaten(made) { String::new() } else { format!(": give {way} for that") };
        format!(
            "{why}: --cell {} --key-interval {} are used, {}; with {cell} and {key_interval} it would be {}{seen}{wanted}",
            made.settings.cell,
            made.settings.key_interval,
            made.told(),
            usual.told(),
        )
    }
}

/// Whether so many outlines cross cells that sheets are given up, for else surfaces go on as they should: on rough land they do not.
pub(crate) fn crossed(quality: &Brief) -> bool {
    quality.wrong_surface_percent >= TORN && quality.path_error_texels.p99 < BENT
}

/// By how much the worst frame is worse than the mean, dB, where whole things are missing in it, or it is worse by far: pixels of what is seen that are
/// `wrong`, percent; PSNR, the mean and the worst.
pub(crate) fn uneven(wrong: f64, [mean, worst]: [f64; 2]) -> Option<f64> {
    Some(mean - worst).filter(|&off| worst < GOOD && (wrong >= TORN && off >= PASSING || off >= 2.0 * PASSING))
}

/// Whether things are lost in some frames that keys close together would show.
fn passing(quality: &Brief) -> bool {
    let &Brief { psnr_mean, psnr_min, wrong_surface_percent, wrong_seen_percent, path_error_texels } = quality;
    // Things that pass are missing from what is seen, however little that is; a path that goes fast tears whole pictures.
    uneven(wrong_seen_percent, [psnr_mean, psnr_min]).is_some() || wrong_surface_percent >= TORN && path_error_texels.p99 >= FAST
}

/// Whether many outlines cross cells and positions bend, as on lattices, but nothing says that the path goes fast.
fn lattice(cell: u32, quality: &Brief, brief: bool) -> bool {
    let many = quality.wrong_surface_percent >= TORN && quality.path_error_texels.p99 >= BENT;
    many && cell <= USUAL && !brief && !passing(quality)
}

/// Steps to climb by, which of them is taken, and how many tries they get.
type Climb = (Take, &'static [Step], usize);

/// The climbs worth a try after cells of `cell` pixels gave `quality`, on a path that is `brief` all of them, else each if those before it lead nowhere;
/// and why.
fn climbs(cell: u32, quality: &Brief, brief: bool) -> (&'static [Climb], &'static str) {
    // Smaller cells are there for the picture: keys still farther apart would take that back.
    const FINER: Climb = (Take::First, &[Step::FINER], 1);
    const FARTHER: Climb = (Take::First, &[Step::DOUBLE], 1);
    const FAR: Climb = (Take::First, &[Step::DOUBLE], 2);
    const CLOSER: Climb = (Take::Most, &[Step::COARSER, Step::HALF], BENT_TRIES);
    const CLOSE: Climb = (Take::First, &[Step::HALF, Step::CLOSER], 2);
    // What sweeps past may show with a key a frame, and hardly more than with usual ones where these are twice as close.
    const FASTER: Climb = (Take::Most, &[Step::HALF, Step::EIGHTH, Step::CLOSER], BENT_TRIES);
    // Where a camera shakes, keys twice as close hit no more of it.
    const FASTEST: Climb = (Take::First, &[Step::HALF, Step::EIGHTH], BENT_TRIES);
    // Lattices bend too, and stay as torn with closer keys.
    const HALVED: Climb = (Take::First, &[Step::HALF], BENT_TRIES);
    const BRIEFLY: Climb = (Take::First, &[Step::HALF, Step::COARSER, Step::CLOSER], BENT_TRIES);
    let (torn, bent) = (quality.wrong_surface_percent >= TORN, quality.path_error_texels.p99);
    let climbs: &[Climb] = match torn {
        true if (bent < STEADY || cell > USUAL) && brief => &[FINER, FARTHER, FASTEST],
        true if (bent < STEADY || cell > USUAL) && passing(quality) => &[FASTER, FINER, FARTHER],
        true if bent < STEADY || cell > USUAL => &[FINER, FARTHER, CLOSE],
        true if bent < BENT && brief => &[FARTHER, FASTEST],
        true if bent < BENT && passing(quality) => &[FASTER, FARTHER],
        true if bent < BENT => &[FARTHER, CLOSE],
        true if brief => &[FASTEST],
        true if lattice(cell, quality, brief) => &[HALVED],
        true => &[FASTER],
        false if bent >= BENT => &[CLOSER],
        false if bent < STEADY && brief => &[FAR, BRIEFLY],
        false if bent < STEADY && passing(quality) => &[FASTER, FAR],
        false if bent < STEADY => &[FAR, CLOSE],
        false if brief => &[BRIEFLY],
        false if passing(quality) => &[FASTER],
        false => &[CLOSE],
    };
    let why = match torn {
        true if bent >= BENT && cell <= USUAL => BENDING,
        true => CROSSING,
        false if bent >= BENT => BENDING,
        false => STEADILY,
    };
    (climbs, why)
}

/// What `keys` closer together (`Less`) or farther apart gain, dB, that are worth so much more beside `exact` rays, less what their `time` in every frame is
/// worth, there and by what is seen; `visible` tells how much more they are worth by that.
fn gain<E>(keys: Ordering, exact: f64, time: [f64; 2], visible: impl FnOnce() -> Result<f64, E>) -> Result<f64, E> {
    match keys {
        Ordering::Less if exact > time[0] => Ok(exact - time[0]),
        Ordering::Less => Ok(visible()? - time[1]),
        Ordering::Greater if exact > 0.0 && visible()? < -TIME => Ok(f64::NEG_INFINITY),
        _ => Ok(exact),
    }
}

/// What bundles are worth beside the usual one.
struct Gains<'a> {
    usual: &'a Made,
    /// Its quality before sheets were left out.
    all: &'a Brief,
    /// The path is, too.
    brief: bool,
    /// What they are made from, and hold the scene against.
    flat: &'a Flat,
    seen: &'a Seen<'a>,
    /// Bytes of the source image.
    picture: usize,
    /// What the usual one is worth beside exact rays,
    exact: f64,
    /// and by what is seen of it: told where it is asked for, as the scene has to be rendered for it.
    visible: Option<f64>,
}

impl Gains<'_> {
    /// By how much `made` is worth more.
    fn of(&mut self, made: &Made) -> Result<f64, BakeError> {
        let &mut Self { usual, all, brief, flat, seen, picture, .. } = self;
        let [before, after] = [usual, made].map(|made| made.quality.wrong_surface_percent);
        let keys = made.settings.key_interval.cmp(&usual.settings.key_interval);
        if keys == Ordering::Greater && all.wrong_surface_percent < TORN && after > FLICKER * before {
            return Ok(f64::NEG_INFINITY);
        }
        let exact = made.worth(picture) - self.exact;
        // Of a lattice more is seen with closer keys at any rate: what counts is what it takes.
        if lattice(usual.settings.cell, all, brief) || made.settings.cell != usual.settings.cell {
            return Ok(exact);
        }
        // Keys n times as close take n times the time, and have to gain n squared as much: for n times slow paths would have a key every other frame.
        let times = f64::from(CLOSEST) / f64::from(made.settings.key_interval.clamp(1, CLOSEST));
        let time = TIME * times * times;
        // Where surfaces bend, exact rays say what there is to gain, at any price.
        let free_of_charge = all.path_error_texels.p99 >= BENT;
        gain(keys, exact, [if free_of_charge { 0.0 } else { time }, time], || {
            let before = self.visible.map_or_else(|| seen.worth(usual, flat, picture), Ok)?;
            self.visible = Some(before);
            Ok(seen.worth(made, flat, picture)? - before)
        })
    }
}

/// What was tried, and the best of it.
struct Trials<'a> {
    scene: &'a Scene,
    space: &'a dyn Fn(u32) -> u8,
    progress: Progress<'a>,
    gains: Gains<'a>,
    /// What is worth most of all that is worth more than the usual bundle, and by how much.
    better: Option<(f64, Made)>,
    /// What was tried, and what it gained.
    known: Vec<([u32; 2], Option<f64>)>,
    /// Tries that are expected, at most; those of going back come on top.
    most: usize,
}

impl Trials<'_> {
    /// By how much a bundle of `settings` is worth more than the usual one; `None` where there is none.
    fn gain(&mut self, settings: &Settings) -> Result<Option<f64>, BakeError> {
        let name = [settings.cell, settings.key_interval];
        if let Some(&(_, gained)) = self.known.iter().find(|(known, _)| *known == name) {
            return Ok(gained);
        }
        (self.progress)("trying other cells", (self.known.len() as f64 / self.most as f64).min(1.0));
        let gained = self.anew(settings)?;
        self.known.push((name, gained));
        Ok(gained)
    }

    fn anew(&mut self, settings: &Settings) -> Result<Option<f64>, BakeError> {
        let &mut Self { scene, space, .. } = self;
        // Smaller cells may be more than a bundle can hold: then the usual ones it is.
        let Some(made) = Made::tried(scene, self.gains.flat, Settings { space: space(settings.cell), ..*settings })? else {
            return Ok(None);
        };
        let gained = self.gains.of(&made)?;
        if gained > self.better.as_ref().map_or(0.0, |&(most, _)| most) {
            self.better = Some((gained, made));
        }
        Ok(Some(gained))
    }
}

/// `usual`, or a bundle of other cells or intervals if that is worth more, as sparing counts it; and then why. Closer keys may be worth it by what is `seen`
/// of them instead, and farther ones have to be by both. `all`: quality before sheets were left out; `space`: what a bundle of other cells is made with.
///
/// # Errors
/// Those of encoding, and of the player.
pub(crate) fn choose(
    scene: &Scene,
    flat: &Flat,
    usual: Made,
    all: &Brief,
    space: &dyn Fn(u32) -> u8,
    seen: &Seen<'_>,
    progress: Progress<'_>,
) -> Result<(Made, Option<Other>), BakeError> {
    let brief = scene.playback.frames <= BRIEF;
    let (climbs, why) = climbs(usual.settings.cell, all, brief);
    let picture = usual.picture(flat);
    // Where a path turns quickly, or is short, keys stand much closer already.
    let (asked, spacing) = (usual.settings.key_interval, usual.encoded.grid.spacing());
    let stand = Settings { key_interval: if 2 * spacing <= asked { spacing } else { asked }, ..usual.settings };
    let most = climbs.iter().map(|(.., tries)| tries).sum();
    let gains = Gains { usual: &usual, all, brief, flat, seen, picture, exact: usual.worth(picture), visible: None };
    let mut trials = Trials { scene, space, progress, gains, better: None, known: Vec::new(), most };
    let free = Free { cell: true, interval: true, lambda: false, time: false, space: false, frames: scene.playback.frames };
    for &(take, steps, tries) in climbs {
        climb((stand, 0.0), &free, (take, steps), tries, |settings| trials.gain(settings))?;
        // On brief paths closer keys may be worth far more than what was tried before them.
        if trials.better.is_some() && !brief {
            break;
        }
    }
    // What larger cells lose may be more than they save where keys stand close together.
    let larger = trials.better.as_ref().filter(|(_, better)| better.settings.cell > stand.cell);
    if let Some((gained, closer)) = larger.map(|(gained, better)| (*gained, Settings { cell: stand.cell, ..better.settings }))
        && let Some(back) = trials.gain(&closer)?.filter(|&back| back > gained)
    {
        climb((closer, back), &free, (Take::First, &[Step::HALF]), BACK_TRIES, |settings| trials.gain(settings))?;
    }
    let Some((_, better)) = trials.better else { return Ok((usual, None)) };
    let closer = better.settings.key_interval < usual.settings.key_interval;
    let why = match why {
        STEADILY if closer && !passing(all) => TURNING,
        STEADILY | CROSSING if closer => SWEEPING,
        why => why,
    };
    Ok((better, Some(Other { why, usual })))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Path, Pivot, Pose};
    use crate::scene::builtin;
    use crate::trace::Tracer;
    use crate::{bake, verify};
    use glam::DVec3;
    use std::sync::Arc;

    fn made(name: &str, size: [u32; 2], frames: u32, settings: Settings) -> (Scene, Flat, Made) {
        along(name, size, frames, settings, |own| own)
    }

    /// The same where the camera goes along the path that `path` makes of the scene's own.
    fn along<F>(name: &str, size: [u32; 2], frames: u32, settings: Settings, path: F) -> (Scene, Flat, Made)
    where
        F: FnOnce(Arc<dyn Path>) -> Arc<dyn Path>,
    {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (size[0], size[1], frames);
        scene.camera = path(scene.camera);
        let flat = bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
        let made = Made::new(&scene, &flat, settings).unwrap();
        (scene, flat, made)
    }

    fn chosen(scene: &Scene, flat: &Flat, usual: Made) -> (Made, Option<Other>) {
        let all = usual.quality;
        let tracer = Tracer::new(scene);
        let space = usual.settings.space;
        choose(scene, flat, usual, &all, &|_| space, &Seen::new(&tracer, None), &|_, _| {}).unwrap()
    }

    #[test]
    fn pictures_that_come_out_right_keep_their_cells() {
        let settings = Settings { key_interval: 16, ..Settings::default() };
        let (scene, flat, coarse) = made("cone-orbit", [160, 120], 65, settings);
        let bytes = coarse.encoded.bundle.clone();
        let (kept, other) = chosen(&scene, &flat, coarse);
        assert_eq!((kept.settings.cell, kept.encoded.bundle == bytes, other.is_none()), (settings.cell, true, true));
    }

    #[test]
    fn slow_paths_get_farther_keys() {
        let (scene, flat, usual) = made("cone-orbit", [160, 120], 65, Settings::default());
        let picture = usual.picture(&flat);
        let (before, bytes) = (usual.worth(picture), usual.encoded.bundle.len());
        let (kept, other) = chosen(&scene, &flat, usual);
        assert_eq!((kept.settings.cell, kept.settings.key_interval, other.is_some()), (8, 16, true));
        assert!(kept.worth(picture) > before && kept.encoded.bundle.len() < bytes);
    }

    #[test]
    fn a_fence_gets_smaller_cells() {
        // Columns seen so small that many stand in every cell of 16 pixels.
        let settings = Settings { cell: 16, key_interval: 4, ..Settings::default() };
        let (scene, flat, coarse) = made("round-columns", [64, 48], 17, settings);
        let before = coarse.quality.psnr_mean;
        let (kept, other) = chosen(&scene, &flat, coarse);
        let after = verify::against_exact(&kept.encoded.bundle, &flat.atlas, &|_, _| {}).unwrap();
        assert_eq!((kept.settings.cell, kept.settings.key_interval, other.is_some()), (8, 8, true));
        assert!(after.psnr_mean > before + 0.5 && after.psnr_mean == kept.quality.psnr_mean, "{before} {after:?}");
    }

    #[test]
    fn rough_land_gets_larger_cells() {
        // Keys so far apart that no curve through them follows the hills.
        let atlas = crate::atlas::Settings { storage: crate::atlas::Storage::Packed, ..Default::default() };
        let settings = Settings { cell: 8, key_interval: 16, atlas, ..Settings::default() };
        let (scene, flat, usual) = made("terrain", [96, 72], 65, settings);
        let picture = usual.picture(&flat);
        let (before, told) = (usual.worth(picture), usual.told());
        let (kept, other) = chosen(&scene, &flat, usual);
        assert_eq!((kept.settings.cell, kept.settings.key_interval), (16, 8));
        let said = other.unwrap().said(&kept);
        assert!(kept.worth(picture) > before && said.contains(&told) && said.contains("--cell 16 --key-interval 8"), "{before} {said}");
    }

    #[test]
    fn fast_turns_get_closer_keys() {
        // A twelfth of a circle around the cone in five frames.
        let settings = Settings { cell: 8, key_interval: 8, ..Settings::default() };
        let (scene, flat, usual) = made("cone-orbit", [96, 72], 9, settings);
        let before = usual.quality.psnr_mean;
        let (kept, _) = chosen(&scene, &flat, usual);
        assert!(kept.settings.key_interval < 8 && kept.quality.psnr_mean > before + 2.0, "{before} {}", kept.told());
    }

    /// A path that is shaken from side to side and up and down, so that no two frames in a row look the same way.
    struct Shaken(Arc<dyn Path>, f64);

    impl Path for Shaken {
        fn pose(&self, s: f64) -> Pose {
            let (pose, frame) = (self.0.pose(s), s * self.1);
            let by = DVec3::new(libm::sin(2.3 * frame), libm::cos(2.9 * frame), 0.0);
            Pose { eye: pose.eye + by, ..pose }
        }
    }

    #[test]
    fn shaken_cameras_get_a_key_a_frame() {
        let (scene, flat, usual) = along("columns", [96, 72], 25, Settings::default(), |own| Arc::new(Shaken(own, 24.0)));
        assert!(usual.quality.wrong_surface_percent >= TORN, "{}", usual.told());
        let before = usual.quality.psnr_mean;
        let (kept, other) = chosen(&scene, &flat, usual);
        assert_eq!((kept.settings.key_interval, other.is_some()), (1, true));
        assert!(kept.quality.psnr_mean > before + 5.0, "{before} {}", kept.told());
    }

    #[test]
    fn brief_turns_get_closer_keys_though_others_gain_too() {
        // Two turns in forty frames: keys farther apart, which are tried first, show a little more.
        let eye = DVec3::new(0.0, 0.5, 0.3);
        let turns = Pivot { eye, azimuth: [0.0, 720.0], elevation: [0.0, 0.0], up: DVec3::Y, fov: 60.0 };
        let settings = Settings { key_interval: 8, ..Settings::default() };
        let (scene, flat, usual) = along("pivot", [96, 72], 40, settings, |_| Arc::new(turns));
        let before = usual.quality.psnr_mean;
        let (kept, other) = chosen(&scene, &flat, usual);
        assert_eq!((kept.settings.key_interval, other.is_some()), (1, true), "{}", kept.told());
        assert!(kept.quality.psnr_mean > before + 4.0, "{before} {}", kept.told());
    }

    #[test]
    fn short_clips_get_a_key_a_frame_where_they_want_it() {
        // A quarter of a circle in four frames: keys at both ends alone, whatever the interval.
        let (scene, flat, usual) = made("cone-orbit", [96, 72], 4, Settings::default());
        assert_eq!((usual.encoded.grid.keys.len(), usual.encoded.grid.spacing()), (2, 3));
        let before = usual.quality.psnr_mean;
        let (kept, other) = chosen(&scene, &flat, usual);
        assert_eq!((kept.settings.key_interval, other.is_some()), (1, true));
        assert!(kept.quality.psnr_mean > before + 2.0, "{before} {}", kept.told());
    }

    /// A path gone along so many times as fast, from its beginning anew at its end.
    struct Quick(Arc<dyn Path>, f64);

    impl Path for Quick {
        fn pose(&self, s: f64) -> Pose {
            self.0.pose((s * self.1).fract())
        }
    }

    #[test]
    fn torn_turns_get_closer_keys_on_long_paths() {
        let settings = Settings { key_interval: 8, ..Settings::default() };
        let (scene, flat, usual) = along("mirrors", [96, 72], 70, settings, |own| Arc::new(Quick(own, 3.0)));
        let (quality, before) = (usual.quality, usual.quality.psnr_mean);
        let torn = quality.wrong_surface_percent >= TORN && quality.path_error_texels.p99 >= BENT;
        assert!(torn && !passing(&quality), "{quality:?}");
        let (kept, other) = chosen(&scene, &flat, usual);
        assert!(kept.settings.key_interval < 8 && kept.settings.cell == 8 && other.is_some(), "{}", kept.told());
        assert!(kept.quality.psnr_mean > before + 1.0, "{before} {}", kept.told());
    }

    #[test]
    fn closer_keys_gain_by_either_measure_and_farther_ones_by_both() {
        let gain = |keys, exact, visible| gain(keys, exact, [TIME; 2], || Ok::<_, ()>(visible)).unwrap();
        assert_eq!([gain(Ordering::Less, 0.5, -9.0), gain(Ordering::Less, -0.5, 0.5)], [0.5 - TIME, 0.5 - TIME]);
        assert!(gain(Ordering::Less, -0.5, 0.5 * TIME) < 0.0);
        assert_eq!([gain(Ordering::Greater, 0.5, -0.5 * TIME), gain(Ordering::Greater, -0.5, 9.0)], [0.5, -0.5]);
        assert!(gain(Ordering::Greater, 0.5, -2.0 * TIME) < 0.0);
    }

    #[test]
    fn closer_keys_are_kept_where_they_show() {
        // The sparing of keys would not have them: of what they bring beside exact rays, twice the bytes have to bring more.
        let (scene, flat, usual) = made("terrain", [128, 96], 49, Settings::default());
        let (picture, tracer) = (usual.picture(&flat), Tracer::new(&scene));
        let seen = Seen::new(&tracer, None);
        let (exact, visible) = (usual.worth(picture), seen.worth(&usual, &flat, picture).unwrap());
        let (kept, other) = chosen(&scene, &flat, usual);
        assert_eq!((kept.settings.cell, kept.settings.key_interval, other.is_some()), (8, 4, true));
        assert!(kept.worth(picture) < exact && seen.worth(&kept, &flat, picture).unwrap() > visible + TIME, "{}", kept.told());
    }

    #[test]
    fn what_is_tried_depends_on_outlines_and_bends() {
        let of = |cell, wrong_surface_percent, p99, brief| {
            let path_error_texels = verify::PathError { p99, ..verify::PathError::default() };
            let (climbs, why) = climbs(cell, &Brief { wrong_surface_percent, path_error_texels, ..Brief::default() }, brief);
            (climbs.len(), why.split(' ').next().unwrap())
        };
        let tried = |cell, wrong_surface_percent, p99| of(cell, wrong_surface_percent, p99, false);
        // Torn and steady, torn and not quite so, both torn and bent, the last in large cells; bent; neither; steady.
        assert_eq!([tried(8, 2.0, 0.9), tried(8, 2.0, 1.0), tried(8, 2.0, 2.0)], [(3, "many"), (2, "many"), (1, "surfaces")]);
        assert_eq!([tried(16, 2.0, 2.0), tried(8, 1.9, 2.0), tried(8, 1.9, 1.9)], [(3, "many"), (1, "surfaces"), (1, "surfaces")]);
        assert_eq!(tried(8, 1.9, 0.9), (2, "surfaces"));
        // So fast that outlines are no matter.
        assert_eq!([tried(8, 20.0, 4.9), tried(8, 20.0, 5.0)], [(1, "surfaces"); 2]);
        // What passes by in some frames is worth a try of keys close together, first.
        let uneven = |[wrong_surface_percent, wrong_seen_percent]: [f64; 2], p99| {
            let path_error_texels = verify::PathError { p99, ..verify::PathError::default() };
            let quality = Brief { psnr_mean: 30.0, psnr_min: 26.0, wrong_surface_percent, wrong_seen_percent, path_error_texels };
            let (climbs, _) = climbs(8, &quality, false);
            (climbs.len(), climbs[0].1.contains(&Step::EIGHTH))
        };
        assert_eq!([0.9, 1.0, 2.0].map(|p99| uneven([2.0; 2], p99)), [(3, true), (2, true), (1, true)]);
        // Of what is seen, on much backdrop.
        assert_eq!([0.9, 1.0, 2.0].map(|p99| uneven([0.2, 2.0], p99)), [(2, true), (1, true), (1, false)]);
        assert_eq!([0.9, 1.0, 2.0].map(|p99| uneven([0.2, 1.9], p99)), [(2, false), (1, false), (1, false)]);
        // On a brief path closer keys come last, or alone.
        assert_eq!([of(8, 2.0, 0.9, true), of(8, 2.0, 1.0, true), of(8, 2.0, 2.0, true)].map(|of| of.0), [3, 2, 1]);
    }
}
