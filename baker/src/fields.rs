//! Fields: signed distances on the screen from a sheet's outline, positive where the sheet shows; one number a layer,
//! interpolated like a position. They tell curved silhouettes, where the chart goes on beyond what is seen.
//! Fitted to the G-buffer like positions are, for `settle`; `order` decides where they are used.
//!
//! Things thinner than a few cells are *strips*: two fields, the distances from two opposite sides, both positive inside.

use crate::around::{Around, NONE, Steps, distance as away};
use crate::fit::{self, Problem, Target};
use crate::gbuffer::GBuffer;
use crate::sheets::{KeyGrid, Layers, Sheets};
use cubist_core::fixed::{field_code, field_distance};
use cubist_core::format::SPACE_LINEAR;
use cubist_core::lists::CHART;
use rayon::prelude::*;

/// Distances are told apart up to this many cells.
const REACH: f32 = 1.5;
/// Things thinner than this many cells are strips: both their sides come by in one cell and interval when they move.
const THIN: usize = 3;
/// How fast a pixel's say falls with its distance from the outline, pixels: the outline has to be right, not the middle.
const FALLOFF: f32 = 0.6;

/// Refits after the first fit of distances, and again once the tests are chosen.
const REFITS: usize = 2;
/// How far on its side of the outline a pixel has to be to be left alone by a refit, pixels.
const CONTENT: f32 = 0.4;
/// What such a pixel still weighs, of its weight: the outline is to move no more than others need.
const CALM: f32 = 0.05;
/// The least weight of a pixel that is not.
const URGENT: f32 = 0.25;
/// A pixel farther than this on the wrong side, pixels, is given up: no outline of this shape reaches it.
const LOST: f32 = 3.0;

/// The fields of all layers.
#[derive(Clone, Debug)]
pub struct Fields {
    /// Two distances a layer, pixels, as the player will have them.
    pub distance: Vec<[f32; 2]>,
    /// For every label whether it is a strip, and which way.
    pub thin: Vec<Thin>,
}

/// The distances from a pixel to the nearest change between a sheet and what lies behind it: left, right, up, down, pixels;
/// `None` where there is none within reach.
type Distances = [Option<f32>; 4];

/// Fits the fields of all layers, given the sheets front to back: what `order` chooses the tests by.
#[must_use]
pub fn solve(gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers, labels: usize) -> Fields {
    let thin = thin_labels(gbuffer, grid, sheets, labels);
    let outlines = Outlines { gbuffer, grid, sheets, layers, thin: &thin };
    let distance = outlines.fit(false);
    Fields { distance, thin }
}

impl Fields {
    /// Fits fields anew, now that tests are chosen: those that tests ask for, and none else.
    #[must_use]
    pub fn tested(self, gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers) -> Self {
        let outlines = Outlines { gbuffer, grid, sheets, layers, thin: &self.thin };
        Self { distance: outlines.fit(true), thin: self.thin }
    }

    /// Likewise, on from what they are.
    #[must_use]
    pub fn settled(self, gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers) -> Self {
        let outlines = Outlines { gbuffer, grid, sheets, layers, thin: &self.thin };
        Self { distance: outlines.refit(self.distance, &outlines.sides(true)), thin: self.thin }
    }

    /// Whether a label is a strip.
    #[must_use]
    pub fn strip(&self, label: u8) -> bool {
        self.thin[usize::from(label)] != Thin::No
    }
}

/// The code of a distance, pixels.
pub(crate) fn code(distance: f32) -> i8 {
    field_code(libm::roundf(distance * 256.0) as i32)
}

/// The distance that a code stands for, pixels.
pub(crate) fn distance(code: i8) -> f32 {
    field_distance(code) as f32 / 256.0
}

/// Whether the sheet at a place in the list of a cell and interval is told by its fields.
pub(crate) fn tests_field(sheets: &Sheets, index: usize, sheet: usize) -> bool {
    sheets.test(index, sheet).is_some_and(|test| test != CHART)
}

/// What fields are fitted to.
struct Outlines<'a> {
    gbuffer: &'a GBuffer,
    grid: &'a KeyGrid,
    sheets: &'a Sheets,
    layers: &'a Layers,
    thin: &'a [Thin],
}

/// On which side of a sheet's outline a pixel is, whether it shows the sheet, and how far away; `None`: it does not matter.
type Side = Option<(bool, Steps)>;

impl<'a> Outlines<'a> {
    /// To fit fields that put pixels on these `sides`.
    fn problem<'s>(
        &'s self,
        known: Option<&'s [[f32; 2]]>,
        sides: &'s [Vec<Side>],
    ) -> Problem<'s, impl Fn(usize, u32, &mut Vec<Target>) + Sync + use<'s, 'a>> {
        let &Outlines { grid, sheets, layers, .. } = self;
        let targets = |index: usize, frame: u32, targets: &mut Vec<Target>| self.targets(index, frame, &sides[index], targets);
        Problem { grid, sheets, layers, time: grid.field_time(), space: SPACE_LINEAR, prior: None, known, refit: hinge, targets }
    }

    /// The fields of those sheets that are tested by them, or of all, from nothing.
    fn fit(&self, tested: bool) -> Vec<[f32; 2]> {
        let sides = self.sides(tested);
        self.refit(fit::solve_for(&self.problem(None, &sides)).uv, &sides)
    }

    /// `fields` after a few refits, as the player will have them.
    fn refit(&self, mut fields: Vec<[f32; 2]>, sides: &[Vec<Side>]) -> Vec<[f32; 2]> {
        for _ in 0..REFITS {
            let fit = fit::solve_for(&self.problem(Some(&fields), sides));
            fields = fit.uv;
        }
        fields.iter().map(|pair| pair.map(|field| distance(code(field)))).collect()
    }

    /// On which sides pixels are of the outlines of those sheets that are tested by their fields, or of all: for every cell and interval, where some are,
    /// frame by frame and pixel by pixel, as [`KeyGrid::each_pixel`] has them, of all sheets of its list.
    fn sides(&self, tested: bool) -> Vec<Vec<Side>> {
        let &Outlines { gbuffer, grid, sheets, .. } = self;
        let cells = grid.grid.cells();
        let of = |index: usize| {
            let list = &sheets.lists[index];
            let asked: Vec<u8> = (0..).take(list.len()).filter(|&sheet| !tested || tests_field(sheets, index, sheet.into())).collect();
            let mut sides = Vec::new();
            if list.len() < 2 || asked.is_empty() {
                return sides;
            }
            for frame in grid.frames_of(index / cells) {
                let (around, first) = (Around::new(gbuffer, grid, list, self.reach(), frame, index % cells), sides.len());
                sides.resize(first + around.shown().count() * list.len(), None);
                for &sheet in &asked {
                    let places = sides[first..].iter_mut().skip(sheet.into()).step_by(list.len());
                    // What is hidden by a sheet further in front does not matter, nor what no sheet shows.
                    let pixels =
                        places.zip(around.shown().zip(around.steps(sheet))).filter(|(_, (shown, _))| *shown != NONE && *shown >= sheet);
                    pixels.for_each(|(place, (shown, steps))| *place = Some((shown == sheet, steps)));
                }
            }
            sides
        };
        (0..sheets.lists.len()).into_par_iter().map(of).collect()
    }

    /// How far around a pixel is looked, pixels.
    fn reach(&self) -> usize {
        (REACH * (1u32 << self.grid.grid.log2) as f32) as usize
    }

    /// What the sheets of a cell and interval ask of its pixels in a frame, given no targets and the `sides` that they are on.
    fn targets(&self, index: usize, frame: u32, sides: &[Side], targets: &mut Vec<Target>) {
        let (list, frames) = (&self.sheets.lists[index], self.grid.frames_of(index / self.grid.grid.cells()));
        let (reach, each) = (self.reach(), sides.len() / frames.len().max(1));
        let own = (frame - frames.start) as usize * each;
        for (side, &label) in sides[own..own + each].iter().zip(list.iter().cycle()) {
            targets.push(side.and_then(|(inside, steps)| {
                let distances = steps.map(|steps| away(steps, reach));
                match self.thin[usize::from(label)] {
                    Thin::No => Some(signed(distances, inside, reach as f32)),
                    Thin::Across => strip(distances[0], distances[1], inside, reach as f32),
                    Thin::Down => strip(distances[2], distances[3], inside, reach as f32),
                }
            }));
        }
    }
}

/// What a refit asks of a pixel, given the fields it has and should have: only their signs count, so a pixel that is well on its side may
/// stay where it is, and one that is not is to get there. (A squared hinge loss, minimised by Newton steps: Keerthi, DeCoste 2005.)
fn hinge(known: [f32; 2], target: [f32; 2], weight: f32) -> ([f32; 2], f32) {
    let settled = |axis: usize| {
        let side = known[axis] * target[axis].signum();
        target[axis] == 0.0 || !(-LOST..CONTENT).contains(&side)
    };
    let wanted = [0, 1].map(|axis| if settled(axis) { known[axis] } else { CONTENT * target[axis].signum() });
    (wanted, if settled(0) && settled(1) { weight * CALM } else { weight.max(URGENT) })
}

/// The target and weight of one field: the distance from the outline, from those along the two axes.
fn signed([left, right, up, down]: Distances, inside: bool, reach: f32) -> ([f32; 2], f32) {
    let nearest = |a: Option<f32>, b: Option<f32>| match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (one, other) => one.or(other),
    };
    // A straight outline d away cuts the axes at d / cos and d / sin.
    let distance = match (nearest(left, right), nearest(up, down)) {
        (Some(x), Some(y)) => x * y / (x * x + y * y).sqrt(),
        (one, other) => one.or(other).unwrap_or(reach),
    };
    let weight = 1.0 / (1.0 + (distance / FALLOFF) * (distance / FALLOFF));
    ([if inside { distance } else { -distance }, 0.0], weight)
}

/// The targets and weight of a strip's two fields, which go on linearly outside.
fn strip(before: Option<f32>, after: Option<f32>, inside: bool, reach: f32) -> Option<([f32; 2], f32)> {
    let pair = if inside {
        [before.unwrap_or(reach), after.unwrap_or(reach)]
    } else {
        // Outside, what is near is an edge of the strip: the one that faces the pixel.
        match (before, after) {
            (Some(before), after) if after.is_none_or(|after| before <= after) => [reach, -before],
            (_, Some(after)) => [-after, reach],
            _ => return None,
        }
    };
    let nearest = pair[0].abs().min(pair[1].abs());
    Some((pair, 1.0 / (1.0 + (nearest / FALLOFF) * (nearest / FALLOFF))))
}

/// Whether a label's runs of pixels are short, and along which axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thin {
    /// No: one field tells it.
    No,
    /// Across: its sides are to the left and right.
    Across,
    /// Down: its sides are above and below.
    Down,
}

/// Finds the labels that are thin in most of the torn cells they are seen in.
fn thin_labels(gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, labels: usize) -> Vec<Thin> {
    let size = 1usize << grid.grid.log2;
    let cells = grid.grid.cells();
    // Per label: torn cells it is seen in, those where it is thin across, and down.
    let counts: Vec<[u32; 3]> = (0..sheets.lists.len())
        .into_par_iter()
        .filter(|&index| sheets.lists[index].len() > 1)
        .fold(
            || vec![[0u32; 3]; labels],
            |mut counts, index| {
                let (interval, cell) = (index / cells, index % cells);
                let frames = grid.frames_of(interval);
                let frame = frames.start + (frames.end - frames.start) / 2;
                let mut shown = Vec::new();
                grid.each_pixel(frame, cell, |pixel, _| shown.push(gbuffer.label[pixel]));
                let mut found: Vec<u8> = shown.iter().filter_map(|&label| u8::try_from(label).ok()).collect();
                found.sort_unstable();
                found.dedup();
                for label in found {
                    let around = Around::new(gbuffer, grid, &[label], THIN * size, frame, cell);
                    let run = |a: u8, b: u8| away(a, THIN * size).zip(away(b, THIN * size)).map_or(f32::INFINITY, |(a, b)| a + b);
                    let own = around.shown().zip(around.steps(0)).filter(|&(shown, _)| shown == 0);
                    // The longest runs across and down.
                    let runs = own.fold([0.0f32; 2], |most, (_, [left, right, up, down])| {
                        [most[0].max(run(left, right)), most[1].max(run(up, down))]
                    });
                    let count = &mut counts[usize::from(label)];
                    count[0] += 1;
                    count[1] += u32::from(runs[0] < (THIN * size) as f32);
                    count[2] += u32::from(runs[1] < (THIN * size) as f32);
                }
                counts
            },
        )
        .reduce(
            || vec![[0; 3]; labels],
            |mut a, b| {
                for (a, b) in a.iter_mut().zip(b) {
                    *a = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
                }
                a
            },
        );
    let kind = |[all, across, down]: [u32; 3]| {
        if across.max(down) * 2 <= all {
            Thin::No
        } else if across >= down {
            Thin::Across
        } else {
            Thin::Down
        }
    };
    counts.into_iter().map(kind).collect()
}
