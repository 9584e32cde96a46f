//! Climbing: from one way to code keys to a better one, a step at a time, for as long as a step helps. `tune`, `ram` and `finer` hand in where to
//! start, what may change and what a bundle is worth to them; which steps are tried, and in which order, depends on nothing else.

use crate::bake::{BakeError, Settings};
use crate::spare::LAMBDAS;
use cubist_core::format::{SPACE_CUBIC, SPACE_LINEAR, TIME_CUBIC, TIME_LINEAR};

/// Cells, pixels; key intervals, frames: the rungs that steps lead to, and those of [`LAMBDAS`].
pub(crate) const CELLS: [u32; 4] = [4, 8, 16, 32];
const INTERVALS: [u32; 14] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 32, 48, 64];
/// The longest interval between keys, frames.
const LONGEST: u32 = 256;
/// What a step has to bring to be taken, in whatever the score counts.
const GAIN: f64 = 0.01;

/// What may change on the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Free {
    pub cell: bool,
    pub interval: bool,
    pub lambda: bool,
    pub time: bool,
    pub space: bool,
    /// Frames of the path: no interval is as long.
    pub frames: u32,
}

/// One way to change settings: by how many rungs each. `scale`: the key interval is doubled or, below 0, halved that many times.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Step {
    cell: i32,
    scale: i32,
    interval: i32,
    lambda: i32,
    time: bool,
    space: bool,
}

impl Step {
    const NONE: Self = Self { cell: 0, scale: 0, interval: 0, lambda: 0, time: false, space: false };
    /// Cells half or twice as large.
    const SMALLER: Self = Self { cell: -1, ..Self::NONE };
    const LARGER: Self = Self { cell: 1, ..Self::NONE };
    /// Cells half as large with keys twice as far apart, and the other way round.
    pub const FINER: Self = Self { scale: 1, ..Self::SMALLER };
    pub const COARSER: Self = Self { scale: -1, ..Self::LARGER };
    /// Keys twice as far apart, half as far.
    pub const DOUBLE: Self = Self { scale: 1, ..Self::NONE };
    pub const HALF: Self = Self { scale: -1, ..Self::NONE };
    /// Keys an eighth as far apart, at most one a frame.
    pub const EIGHTH: Self = Self { scale: -3, ..Self::NONE };
    /// Keys a little closer, a little farther apart.
    pub const CLOSER: Self = Self { interval: -1, ..Self::NONE };
    const FARTHER: Self = Self { interval: 1, ..Self::NONE };
    /// A bit worth more, less.
    const DEARER: Self = Self { lambda: 1, ..Self::NONE };
    const CHEAPER: Self = Self { lambda: -1, ..Self::NONE };
    /// The other kind of time, of space.
    const TIME: Self = Self { time: true, ..Self::NONE };
    const SPACE: Self = Self { space: true, ..Self::NONE };

    /// Those of a search that has time, those first that mostly help.
    pub const ALL: [Self; 13] = [
        Self::CLOSER,
        Self::DEARER,
        Self { lambda: 1, ..Self::CLOSER },
        Self::FINER,
        Self::COARSER,
        Self::CHEAPER,
        Self::FARTHER,
        Self { lambda: -1, ..Self::FARTHER },
        Self::SMALLER,
        Self::LARGER,
        Self::TIME,
        Self::SPACE,
        Self { time: true, ..Self::CLOSER },
    ];
}

/// The rung `by` above `value`, which need not be on one; `None` past either end.
fn rung<T: PartialOrd + Copy>(rungs: &[T], value: T, by: i32) -> Option<T> {
    if by == 0 {
        return Some(value);
    }
    let below = rungs.iter().filter(|&&rung| rung < value).count() as i32;
    let stands = rungs.contains(&value);
    let to = below + by - i32::from(by > 0 && !stands);
    rungs.get(usize::try_from(to).ok()?).copied()
}

/// `from` after `step`; `None` where that leads nowhere, or changes what may not change.
fn after(from: &Settings, step: Step, free: &Free) -> Option<Settings> {
    let held = [
        (step.cell != 0, free.cell),
        (step.scale != 0 || step.interval != 0, free.interval),
        (step.lambda != 0, free.lambda),
        (step.time, free.time),
        (step.space, free.space),
    ];
    if held.into_iter().any(|(wanted, allowed)| wanted && !allowed) {
        return None;
    }
    let mut to = *from;
    to.cell = rung(&CELLS, from.cell, step.cell)?;
    let scaled = match step.scale {
        0.. => from.key_interval << step.scale,
        -1 => from.key_interval >> 1,
        // What is meant is close together: of a few frames an eighth is one.
        _ => (from.key_interval >> -step.scale).max(1),
    };
    to.key_interval = rung(&INTERVALS, scaled, step.interval)?;
    if step.lambda != 0 {
        to.coding = from.coding.worth(rung(&LAMBDAS, from.coding.lambda, step.lambda)?);
    }
    let other = |now: u8, [a, b]: [u8; 2]| if now == a { b } else { a };
    to.time = if step.time { other(from.time, [TIME_LINEAR, TIME_CUBIC]) } else { from.time };
    to.space = if step.space { other(from.space, [SPACE_LINEAR, SPACE_CUBIC]) } else { from.space };
    let longest = (free.frames.max(2) - 1).min(LONGEST);
    ((1..=longest).contains(&to.key_interval) || to.key_interval == from.key_interval).then_some(to)
}

/// What tells settings apart here.
fn name(settings: &Settings) -> (u32, u32, u32, u8, u8) {
    (settings.cell, settings.key_interval, settings.coding.lambda.to_bits(), settings.time, settings.space)
}

/// Which of the steps that score more is taken.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Take {
    /// The first, at once.
    First,
    /// The one that scores most: for steps that lead away from each other.
    Most,
}

/// The best settings that `steps` from `start` lead to, with their score: what is taken of them is tried again, and the climb ends where no step scores
/// more or after `most` tries. `score` gives `None` for what cannot be had.
///
/// # Errors
/// Those of `score`.
pub(crate) fn climb(
    start: (Settings, f64),
    free: &Free,
    (take, steps): (Take, &[Step]),
    most: usize,
    mut score: impl FnMut(&Settings) -> Result<Option<f64>, BakeError>,
) -> Result<(Settings, f64), BakeError> {
    let mut best = start;
    let mut seen = vec![name(&start.0)];
    let mut order = steps.to_vec();
    loop {
        let mut found: Option<(usize, (Settings, f64))> = None;
        for (at, &step) in order.iter().enumerate() {
            let Some(next) = after(&best.0, step, free).filter(|next| !seen.contains(&name(next))) else { continue };
            if seen.len() > most {
                break;
            }
            seen.push(name(&next));
            if let Some(worth) = score(&next)?
                && worth > found.map_or(best.1, |(_, (_, worth))| worth) + GAIN
            {
                found = Some((at, (next, worth)));
                if take == Take::First {
                    break;
                }
            }
        }
        let Some((at, next)) = found else { return Ok(best) };
        best = next;
        // What helped once may well help again.
        order[..=at].rotate_right(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Free = Free { cell: true, interval: true, lambda: true, time: true, space: true, frames: 100 };

    #[test]
    fn rungs_are_climbed_from_between_them_too() {
        assert_eq!([rung(&INTERVALS, 8, 1), rung(&INTERVALS, 8, -1), rung(&INTERVALS, 8, 0)], [Some(10), Some(6), Some(8)]);
        assert_eq!([rung(&INTERVALS, 7, 1), rung(&INTERVALS, 7, -1), rung(&INTERVALS, 7, 0)], [Some(8), Some(6), Some(7)]);
        assert_eq!([rung(&INTERVALS, 1, -1), rung(&INTERVALS, 64, 1), rung(&INTERVALS, 200, -1)], [None, None, Some(64)]);
    }

    #[test]
    fn the_top_is_reached_and_what_is_held_stays() {
        // One hill, its top at cells of 4, keys every 3 frames, 0.1, straight time.
        let height = |s: &Settings| {
            let far = |a: f64, b: f64| (a / b).log2().abs();
            let off = far(f64::from(s.cell), 4.0) + far(f64::from(s.key_interval), 3.0) + far(f64::from(s.coding.lambda), 0.1);
            Ok(Some(-off - f64::from(u8::from(s.time != TIME_LINEAR))))
        };
        let start = Settings::default();
        let worth = height(&start).unwrap().unwrap();
        let (top, best) = climb((start, worth), &ALL, (Take::First, &Step::ALL), 60, height).unwrap();
        assert_eq!((name(&top), best > -1e-6), ((4, 3, 0.1f32.to_bits(), TIME_LINEAR, start.space), true));
        let held = Free { cell: false, time: false, ..ALL };
        let (top, _) = climb((start, worth), &held, (Take::First, &Step::ALL), 60, height).unwrap();
        assert_eq!(name(&top), (start.cell, 3, 0.1f32.to_bits(), start.time, start.space));
        // No more tries than allowed, and nothing where nothing is to be had.
        let mut tries = 0;
        let counted = |_: &Settings| {
            tries += 1;
            Ok(None)
        };
        let (same, _) = climb((start, worth), &ALL, (Take::First, &Step::ALL), 5, counted).unwrap();
        assert_eq!((name(&same), tries), (name(&start), 5));
    }

    #[test]
    fn intervals_stay_shorter_than_the_path() {
        let start = Settings { key_interval: 6, ..Settings::default() };
        let longest = |s: &Settings| Ok(Some(f64::from(s.key_interval)));
        let (top, _) = climb((start, 6.0), &Free { frames: 13, cell: false, ..ALL }, (Take::First, &Step::ALL), 60, longest).unwrap();
        assert_eq!(top.key_interval, 12);
    }

    #[test]
    fn of_steps_that_lead_apart_the_better_one_is_taken() {
        // A low hill that the first step leads to, a higher one that the second does.
        let height = |s: &Settings| {
            Ok(Some(match (s.cell, s.key_interval) {
                (16, 4) => 1.0,
                (8, 4) => 2.0,
                (8, 2) => 3.0,
                _ => 0.0,
            }))
        };
        let steps = [Step::COARSER, Step::HALF];
        let top = |take| climb((Settings::default(), 0.0), &ALL, (take, &steps), 4, height).map(|(top, _)| (top.cell, top.key_interval));
        assert_eq!((top(Take::First).unwrap(), top(Take::Most).unwrap()), ((16, 4), (8, 2)));
    }
}
