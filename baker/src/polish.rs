//! Polish: the last word on outlines. Fields come from `fields`, fitted by distances and rounded to codes; here codes are moved by a step
//! or two where that brings pixels to their side of an outline. One code at a time is set to the best of a few (coordinate descent).

use crate::fields::{Fields, code, distance, tests_field};
use crate::gbuffer::GBuffer;
use crate::patch::{self, Patch};
use crate::sheets::{KeyGrid, Layers, Sheets, bilinear};
use cubist_core::fixed::MAX_FIELD;
use cubist_core::format::{SPACE_LINEAR, TIME_LINEAR};
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Rounds over all codes: a third changes next to nothing.
const ROUNDS: usize = 2;
/// Pixels that another code has to save: it may cost a bit.
const PRICE: i32 = 1;
/// Steps that are tried.
const STEPS: [i8; 4] = [-1, 1, -2, 2];
/// Pixels farther than this from the outline, pixels, are not brought across it by such steps.
const NEAR: f32 = 2.5;

/// A pixel close to an outline.
struct Spot {
    /// How far inside the sheet it is, pixels, by the codes as they are.
    field: f32,
    /// Its place in the cell, row by row.
    place: u16,
    /// Its frame in the interval.
    frame: u16,
    /// It should show the sheet.
    inside: bool,
}

impl Spot {
    fn wrong(&self, change: f32) -> bool {
        (self.field + change > 0.0) != self.inside
    }
}

/// A sheet that is told by one field, in one cell and interval.
struct Element {
    spots: Vec<Spot>,
    wrong: i32,
}

/// Where the code of a layer shows: an element of an interval, as one of its four corners, at one end of the interval.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    layer: usize,
    interval: usize,
    element: usize,
    corner: usize,
    end: usize,
}

/// The elements of the intervals that a key touches, opened for change.
type Opened<'w> = Vec<(usize, MutexGuard<'w, Vec<Element>>)>;

/// `fields` with polished codes, given the sheets front to back with their tests. Strips stay as they are.
#[must_use]
pub fn polish(fields: Fields, gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers) -> Fields {
    let mut work = Work::new(&fields, gbuffer, grid, sheets, layers);
    for _ in 0..ROUNDS {
        work.round();
    }
    let distance = fields.distance.iter().zip(&work.codes).map(|(pair, &code)| [distance(code), pair[1]]).collect();
    Fields { distance, ..fields }
}

struct Work<'a> {
    grid: &'a KeyGrid,
    /// The shares of a cell's corners in the field at each of its places.
    shares: Vec<[f32; 4]>,
    /// What the end of an interval weighs in each of its frames.
    linear: Vec<Vec<f32>>,
    intervals: Vec<Mutex<Vec<Element>>>,
    /// For every key the uses of its layers' codes, those of a layer side by side.
    uses: Vec<Vec<Use>>,
    codes: Vec<i8>,
}

impl<'a> Work<'a> {
    fn new(fields: &Fields, gbuffer: &GBuffer, grid: &'a KeyGrid, sheets: &Sheets, layers: &Layers) -> Self {
        let codes = fields.distance.iter().map(|&[field, _]| code(field)).collect();
        let size = 1usize << grid.grid.log2;
        let share = |place: usize| bilinear([place % size, place / size].map(|at| at as f32 / size as f32));
        let weight = |interval, frame| grid.weights(interval, frame, grid.field_time())[3][2];
        let linear = (0..grid.intervals()).map(|i| grid.frames_of(i).map(|frame| weight(i, frame)).collect()).collect();
        let shares = (0..size * size).map(share).collect();
        let mut work = Self { grid, shares, linear, intervals: Vec::new(), uses: vec![Vec::new(); grid.keys.len()], codes };
        let cells = grid.grid.cells();
        for interval in 0..grid.intervals() {
            let of_cell = |cell: usize| {
                let index = interval * cells + cell;
                let listed = sheets.lists[index].iter().enumerate();
                let told = listed.filter(|&(sheet, &label)| tests_field(sheets, index, sheet) && !fields.strip(label));
                told.filter_map(|(sheet, _)| work.element(gbuffer, sheets, layers, [interval, cell], sheet)).collect::<Vec<_>>()
            };
            let found: Vec<_> = (0..cells).into_par_iter().map(of_cell).collect();
            let mut elements = Vec::new();
            for (element, corners) in found.into_iter().flatten() {
                for (corner, ends) in corners.into_iter().enumerate() {
                    for (end, (layer, key)) in ends.into_iter().zip([interval, grid.second_key(interval)]).enumerate() {
                        work.uses[key].push(Use { layer, interval, element: elements.len(), corner, end });
                    }
                }
                elements.push(element);
            }
            work.intervals.push(Mutex::new(elements));
        }
        work.uses.iter_mut().for_each(|uses| uses.sort_unstable());
        work
    }

    /// The element of a sheet, and the layers of its corners at both ends of the interval.
    fn element(
        &self,
        gbuffer: &GBuffer,
        sheets: &Sheets,
        layers: &Layers,
        [interval, cell]: [usize; 2],
        sheet: usize,
    ) -> Option<(Element, [[usize; 2]; 4])> {
        let grid = self.grid;
        let list = &sheets.lists[interval * grid.grid.cells() + cell];
        let patch = Patch::new(grid, layers, [interval, cell], list[sheet], [TIME_LINEAR, SPACE_LINEAR]);
        let mut corners = [[0; 2]; 4];
        for (corner, node) in corners.iter_mut().zip(patch::CORNERS) {
            let layer = patch.chains[node]?.layer;
            *corner = [layer[1]?, layer[2]?];
        }
        let size = 1usize << grid.grid.log2;
        let mut spots = Vec::new();
        for ((frame, time), &linear) in grid.frames_of(interval).zip(0u16..).zip(&self.linear[interval]) {
            let value = corners.map(|[from, to]| distance(self.codes[from]) * (1.0 - linear) + distance(self.codes[to]) * linear);
            grid.each_pixel(frame, cell, |pixel, at| {
                let seen = list.iter().position(|&label| gbuffer.label[pixel] == u16::from(label));
                // As in the fit: what is hidden by a sheet further in front does not matter, nor what no sheet shows.
                let Some(seen) = seen.filter(|&seen| seen >= sheet) else { return };
                let [x, y] = at.map(|at| (at * size as f32) as usize);
                let field: f32 = value.iter().zip(self.shares[y * size + x]).map(|(value, share)| value * share).sum();
                if field.abs() < NEAR {
                    spots.push(Spot { field, place: (y * size + x) as u16, frame: time, inside: seen == sheet });
                }
            });
        }
        let wrong = spots.iter().filter(|spot| spot.wrong(0.0)).count() as i32;
        Some((Element { spots, wrong }, corners))
    }

    /// Sets every code once. Those of every other key share no element: they are set side by side, and the same on any number of threads.
    fn round(&mut self) {
        let keys = self.grid.keys.len();
        // Around a loop of an odd number of keys the last one is a neighbour of the first.
        let turn = |key: usize| if self.grid.looping && key + 1 == keys && keys % 2 == 1 { 2 } else { key % 2 };
        for now in 0..3 {
            let chosen: Vec<usize> = (0..keys).filter(|&key| turn(key) == now).collect();
            let changes: Vec<Vec<(usize, i8)>> = chosen.into_par_iter().map(|key| self.key(key)).collect();
            for (layer, code) in changes.into_iter().flatten() {
                self.codes[layer] = code;
            }
        }
    }

    /// Sets the codes of one key; returns those that change.
    fn key(&self, key: usize) -> Vec<(usize, i8)> {
        let mut touched: Vec<usize> = self.uses[key].iter().map(|each| each.interval).collect();
        touched.sort_unstable();
        touched.dedup();
        let open = |interval: usize| self.intervals[interval].lock().unwrap_or_else(PoisonError::into_inner);
        let mut opened: Opened<'_> = touched.into_iter().map(|interval| (interval, open(interval))).collect();
        let mut changes = Vec::new();
        for uses in self.uses[key].chunk_by(|a, b| a.layer == b.layer) {
            if uses.iter().all(|each| find(&mut opened, each).wrong == 0) {
                continue;
            }
            let (layer, code) = (uses[0].layer, self.codes[uses[0].layer]);
            let mut best = (0, code);
            // Zero is the code of layers that nothing is known about.
            for other in STEPS.map(|step| code + step).into_iter().filter(|&other| other != 0 && i32::from(other).abs() <= MAX_FIELD) {
                let change = distance(other) - distance(code);
                let more = |each: &Use, element: &Element| {
                    let wrong = element.spots.iter().filter(|spot| spot.wrong(self.share(spot, each) * change)).count() as i32;
                    wrong - element.wrong
                };
                let cost = PRICE + uses.iter().map(|each| more(each, find(&mut opened, each))).sum::<i32>();
                if cost < best.0 {
                    best = (cost, other);
                }
            }
            if best.1 != code {
                let change = distance(best.1) - distance(code);
                for each in uses {
                    let element = find(&mut opened, each);
                    element.spots.iter_mut().for_each(|spot| spot.field += self.share(spot, each) * change);
                    element.wrong = element.spots.iter().filter(|spot| spot.wrong(0.0)).count() as i32;
                }
                changes.push((layer, best.1));
            }
        }
        changes
    }

    /// How much of a code shows at a spot.
    fn share(&self, spot: &Spot, each: &Use) -> f32 {
        let linear = self.linear[each.interval][usize::from(spot.frame)];
        self.shares[usize::from(spot.place)][each.corner] * if each.end == 0 { 1.0 - linear } else { linear }
    }
}

/// The element of a use, among those of the intervals that its key touches: two at most.
fn find<'o>(opened: &'o mut Opened<'_>, each: &Use) -> &'o mut Element {
    let at = usize::from(opened[0].0 != each.interval);
    &mut opened[at].1[each.element]
}
