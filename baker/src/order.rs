//! Order: the sheets of every torn cell, front to back, and the coverage test of each, such that what the player shows differs least from
//! what is seen. A wrong sheet of nearly the right colour does little harm: of two orders that get as many pixels wrong, the one that shows
//! it less is better. Positions come from `fit`, fields from `fields`; the ordered lists go back to `settle`.

use crate::atlas::SourceImage;
use crate::fields::Fields;
use crate::fit::Fit;
use crate::gbuffer::GBuffer;
use crate::patch::{self, CORNERS, Patch, Values};
use crate::sheets::{KeyGrid, Layers, Sheets, bilinear};
use cubist_core::format::{MAX_SHEETS, SPACE_LINEAR, TIME_LINEAR};
use cubist_core::lists::{BOTH, CHART, FIELD};
use rayon::prelude::*;

/// Up to this many sheets every order is tried; more are ordered greedily, front to back.
const EXHAUSTIVE: usize = 5;

/// What a pixel costs that shows the wrong sheet in the right colour, in parts of one that is plainly wrong.
const HIDDEN: u32 = 64;
/// The units of [`Cost`] in a pixel that is plainly wrong.
const PIXEL: u32 = 256;
/// The squared difference of such a pixel's colours, the sum of three channels: forty levels each.
const PLAIN: u32 = 3 * 40 * 40;
/// No pixel costs more than this many plainly wrong ones.
const MOST: u32 = 4;

/// The coverage tests that torn cells may use: all of them, or one alone to see what it is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coverage {
    /// Charts, fields, and both at once, whichever tells best in each cell.
    #[default]
    All,
    /// Charts alone: no fields are stored.
    Chart,
    /// Fields alone.
    Field,
}

/// What the sheets are ordered by.
pub struct Evidence<'a> {
    /// What is really seen.
    pub gbuffer: &'a GBuffer,
    /// The grid.
    pub grid: &'a KeyGrid,
    /// Where the charts lie.
    pub image: &'a SourceImage,
    /// The layers.
    pub layers: &'a Layers,
    /// Their positions.
    pub fit: &'a Fit,
    /// A field has to save this many pixels in a cell and interval to be worth its bytes.
    pub field_price: u32,
    /// The tests to choose from.
    pub coverage: Coverage,
}

/// What shows wrong, in parts of [`PIXEL`].
type Cost = u64;

/// A test that a sheet may have, and what it costs.
type Candidate = (u16, Cost);

impl Evidence<'_> {
    /// The tests to choose from: before the `fields` are known only the chart's.
    fn candidates(&self, fields: Option<&Fields>) -> Vec<Candidate> {
        let price = Cost::from(self.field_price * PIXEL);
        match (fields, self.coverage) {
            (None, _) | (_, Coverage::Chart) => vec![(CHART, 0)],
            (_, Coverage::Field) => vec![(FIELD, price)],
            (_, Coverage::All) => vec![(CHART, 0), (FIELD, price), (BOTH, price)],
        }
    }
}

/// Pixels of a torn cell that see the same.
struct Group {
    /// The sheet that should show; [`NO_SHEET`] where it was left out.
    sheet: usize,
    /// The sheets whose chart covers the pixel, one bit each, and from bit 16 on those whose fields do.
    covering: u32,
    /// What it costs to show each sheet.
    cost: [Cost; MAX_SHEETS],
}

/// The sheet of a pixel whose own was left out.
const NO_SHEET: usize = MAX_SHEETS;

impl Group {
    fn covers(&self, sheet: usize, test: u16) -> bool {
        let (chart, field) = (self.covering >> sheet & 1 == 1, self.covering >> (16 + sheet) & 1 == 1);
        match test {
            CHART => chart,
            FIELD => field,
            _ => chart && field,
        }
    }
}

/// An order with its tests.
struct Choice {
    order: Vec<usize>,
    tests: u16,
    /// What shows wrong, plus what the fields cost.
    cost: Cost,
}

/// What the pixels of a torn cell and interval see of its sheets where these are fitted to, whatever fields say.
#[derive(Default)]
struct Look {
    /// The sheets in the order that they had then.
    list: Vec<u8>,
    /// Every pixel, as [`KeyGrid::each_pixel`] has them, frame by frame.
    pixels: Vec<Pixel>,
    /// What it costs every pixel to show each sheet.
    costs: Vec<u16>,
}

/// One pixel of it.
struct Pixel {
    /// The sheet that should show; [`NO_SHEET`] where it was left out.
    sheet: u8,
    /// The sheets whose chart covers the pixel, one bit each.
    covering: u16,
}

/// The same for all cells and intervals: looked up once for all sorts.
pub struct Looks(Vec<Look>);

impl Looks {
    /// What is seen of `sheets`.
    #[must_use]
    pub fn new(evidence: &Evidence<'_>, sheets: &Sheets) -> Self {
        let of = |(index, list): (usize, &Vec<u8>)| if list.len() > 1 { look(evidence, index, list) } else { Look::default() };
        Self(sheets.lists.par_iter().enumerate().map(of).collect())
    }
}

/// Sorts the sheets of every cell front to back and chooses their tests, given their `fields` once these are known.
pub fn sort(evidence: &Evidence<'_>, looks: &Looks, fields: Option<&Fields>, sheets: &mut Sheets) {
    let candidates = &evidence.candidates(fields);
    let cells = sheets.lists.par_iter_mut().zip(&mut sheets.tests).zip(&looks.0).enumerate();
    cells.filter(|(_, ((list, _), _))| list.len() > 1).for_each(|(index, ((list, tests), look))| {
        let groups = observe(evidence, look, fields, index, list);
        let choose = if list.len() <= EXHAUSTIVE { best } else { greedy };
        let choice = choose(&groups, list.len(), candidates);
        *list = choice.order.iter().map(|&sheet| list[sheet]).collect();
        *tests = choice.tests;
    });
}

/// The patches of the sheets of a cell and interval, interpolated in some ways.
fn patches(evidence: &Evidence<'_>, place: [usize; 2], list: &[u8], ways: [u8; 2]) -> Vec<Patch> {
    list.iter().map(|&label| Patch::new(evidence.grid, evidence.layers, place, label, ways)).collect()
}

/// Looks at the pixels of a cell and interval.
fn look(evidence: &Evidence<'_>, index: usize, list: &[u8]) -> Look {
    let &Evidence { gbuffer, grid, image, fit, .. } = evidence;
    let (interval, cell) = (index / grid.grid.cells(), index % grid.grid.cells());
    let patches = patches(evidence, [interval, cell], list, [grid.time, grid.space]);
    let charts: Vec<Chart> = list.iter().map(|&label| Chart::new(image, label)).collect();
    let mut look = Look { list: list.to_vec(), ..Look::default() };
    for frame in grid.frames_of(interval) {
        let weights = grid.weights(interval, frame, grid.time);
        let positions: Vec<Values> = patches.iter().map(|patch| patch.values(&fit.uv, &weights)).collect();
        grid.each_pixel(frame, cell, |pixel, at| {
            let sheet = list.iter().position(|&label| u16::from(label) == gbuffer.label[pixel]).unwrap_or(NO_SHEET);
            let (right, shares) = (image.colour_at(gbuffer.uv[pixel]), patch::shares(at));
            let mut covering = 0;
            for (place, (values, chart)) in positions.iter().zip(&charts).enumerate() {
                let uv = patch::value(values, &shares);
                covering |= u16::from(chart.covers(image, uv)) << place;
                look.costs.push(if place == sheet { 0 } else { cost(right, image.colour_at(uv)) });
            }
            look.pixels.push(Pixel { sheet: sheet as u8, covering });
        });
    }
    look
}

/// Sums up the pixels of a cell and interval by what they see and what would cover them.
fn observe(evidence: &Evidence<'_>, look: &Look, fields: Option<&Fields>, index: usize, list: &[u8]) -> Vec<Group> {
    let grid = evidence.grid;
    let (interval, cell) = (index / grid.grid.cells(), index % grid.grid.cells());
    let patches = patches(evidence, [interval, cell], list, [TIME_LINEAR, SPACE_LINEAR]);
    let strips: Vec<bool> = list.iter().map(|&label| fields.is_some_and(|fields| fields.strip(label))).collect();
    // Which sheet of the look each one of the list is.
    let then: Vec<usize> = list.iter().filter_map(|label| look.list.iter().position(|then| then == label)).collect();
    let (mut seen, mut pixels) = (Seen::default(), look.pixels.iter().zip(look.costs.chunks_exact(list.len())));
    for frame in grid.frames_of(interval) {
        let linear = grid.weights(interval, frame, grid.field_time());
        // Fields do not bend.
        let of = |fields: &Fields| patches.iter().map(|patch| patch::first(&patch.values(&fields.distance, &linear))).collect();
        let distances: Vec<[[f32; 2]; CORNERS.len()]> = fields.map(of).unwrap_or_default();
        grid.each_pixel(frame, cell, |_, at| {
            let Some((pixel, costs)) = pixels.next() else { return };
            let mut covering = then.iter().enumerate().fold(0, |all, (place, then)| all | u32::from(pixel.covering >> then & 1) << place);
            let shares = bilinear(at);
            for (place, (values, &strip)) in distances.iter().zip(&strips).enumerate() {
                let [a, b] = patch::value(values, &shares);
                covering |= u32::from(a > 0.0 && (!strip || b > 0.0)) << (16 + place);
            }
            let sheet = then.iter().position(|&then| then == usize::from(pixel.sheet)).unwrap_or(NO_SHEET);
            let sums = seen.group(sheet, covering);
            sums.iter_mut().zip(&then).for_each(|(sum, &then)| *sum += Cost::from(costs[then]));
        });
    }
    seen.groups
}

/// Groups of pixels, as they come.
#[derive(Default)]
struct Seen {
    groups: Vec<Group>,
    /// That of the pixel before: most see what their neighbours see.
    last: usize,
}

impl Seen {
    /// The costs of the group of such pixels.
    fn group(&mut self, sheet: usize, covering: u32) -> &mut [Cost; MAX_SHEETS] {
        let same = |group: &Group| group.sheet == sheet && group.covering == covering;
        if !self.groups.get(self.last).is_some_and(same) {
            self.last = self.groups.iter().position(same).unwrap_or(self.groups.len());
            if self.last == self.groups.len() {
                self.groups.push(Group { sheet, covering, cost: [0; MAX_SHEETS] });
            }
        }
        &mut self.groups[self.last].cost
    }
}

/// What it costs to show a colour of a wrong sheet.
fn cost(right: [u8; 3], shown: [u8; 3]) -> u16 {
    let square = |k: usize| u32::from(right[k].abs_diff(shown[k])).pow(2);
    let off = square(0) + square(1) + square(2);
    (HIDDEN + (PIXEL - HIDDEN) * off / PLAIN).min(MOST * PIXEL) as u16
}

/// The same in pixels that are plainly wrong.
pub(crate) fn off(right: [u8; 3], shown: [u8; 3]) -> f32 {
    f32::from(cost(right, shown)) / PIXEL as f32
}

/// The rectangle of a chart, texels, and whether its outline tells more.
pub(crate) struct Chart {
    rect: [f32; 4],
    masked: bool,
}

impl Chart {
    pub fn new(image: &SourceImage, label: u8) -> Self {
        let label = &image.labels[usize::from(label)];
        Self { rect: label.rect.map(f32::from), masked: label.masked }
    }

    /// The player's chart test.
    pub fn covers(&self, image: &SourceImage, [u, v]: [f32; 2]) -> bool {
        let [left, top, right, bottom] = self.rect;
        u >= left && u < right && v >= top && v < bottom && (!self.masked || image.covered_at([u, v]))
    }
}

/// The tests and the cost of an order: each sheet's test is chosen of `candidates` in turn, front to back.
fn weigh(groups: &[Group], order: &[usize], candidates: &[Candidate]) -> Choice {
    let mut choice = Choice { order: order.to_vec(), tests: 0, cost: 0 };
    let mut left: Vec<&Group> = groups.iter().collect();
    for (place, &sheet) in order[..order.len() - 1].iter().enumerate() {
        let behind = &order[place + 1..];
        let tried = candidates.iter().map(|&(test, price)| (price + wrong(&left, sheet, test, behind), price, test));
        let (_, price, test) = tried.min_by_key(|&(cost, _, _)| cost).unwrap_or((0, 0, CHART));
        choice.tests |= test << (2 * place);
        choice.cost += price;
        // What it covers is settled.
        left.retain(|group| {
            let covered = group.covers(sheet, test);
            choice.cost += if covered { group.cost[sheet] } else { 0 };
            !covered
        });
    }
    let back = order[order.len() - 1];
    choice.cost += left.iter().map(|group| group.cost[back]).sum::<Cost>();
    choice
}

/// What a test of a sheet gets wrong: what it covers, and what it does not but should, which at best shows the least wrong of those `behind`.
fn wrong(left: &[&Group], sheet: usize, test: u16, behind: &[usize]) -> Cost {
    let of = |group: &&Group| {
        if group.covers(sheet, test) {
            group.cost[sheet]
        } else if group.sheet == sheet || group.sheet == NO_SHEET {
            behind.iter().map(|&other| group.cost[other]).min().unwrap_or(0)
        } else {
            0
        }
    };
    left.iter().map(of).sum()
}

/// The order with the least cost; of equal ones the first in lexical order.
fn best(groups: &[Group], count: usize, candidates: &[Candidate]) -> Choice {
    let mut order: Vec<usize> = (0..count).collect();
    let mut found = weigh(groups, &order, candidates);
    while next_permutation(&mut order) {
        let choice = weigh(groups, &order, candidates);
        if choice.cost < found.cost {
            found = choice;
        }
    }
    found
}

/// Steps to the next permutation in lexical order; false after the last.
fn next_permutation(order: &mut [usize]) -> bool {
    let Some(pivot) = (1..order.len()).rev().find(|&i| order[i - 1] < order[i]) else { return false };
    let Some(swap) = (pivot..order.len()).rev().find(|&i| order[i] > order[pivot - 1]) else { return false };
    order.swap(pivot - 1, swap);
    order[pivot..].reverse();
    true
}

/// Front to back, always the sheet that gets the fewest of the pixels still to come wrong.
fn greedy(groups: &[Group], count: usize, candidates: &[Candidate]) -> Choice {
    let mut rest: Vec<usize> = (0..count.min(MAX_SHEETS)).collect();
    let mut order = Vec::with_capacity(count);
    let mut left: Vec<&Group> = groups.iter().collect();
    while !rest.is_empty() {
        let tried = (0..rest.len()).flat_map(|at| candidates.iter().map(move |&(test, _)| (at, test)));
        let cost = |&(at, test): &(usize, u16)| {
            let behind: Vec<usize> = rest.iter().copied().filter(|&other| other != rest[at]).collect();
            wrong(&left, rest[at], test, &behind)
        };
        let Some((at, test)) = tried.min_by_key(cost) else { break };
        let sheet = rest.remove(at);
        order.push(sheet);
        left.retain(|group| !group.covers(sheet, test));
    }
    weigh(groups, &order, candidates)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_permutation_comes_once() {
        let mut order = vec![0, 1, 2, 3];
        let mut count = 1;
        while next_permutation(&mut order) {
            count += 1;
        }
        assert_eq!((count, order), (24, vec![3, 2, 1, 0]));
    }

    /// So many pixels of a sheet, all plainly wrong where another one shows.
    fn group(sheet: usize, covering: u32, pixels: u32) -> Group {
        let mut cost = [Cost::from(pixels * PIXEL); MAX_SHEETS];
        cost[sheet] = 0;
        Group { sheet, covering, cost }
    }

    #[test]
    fn the_sheet_that_covers_everything_goes_to_the_back() {
        let groups = [group(0, 0b01, 10), group(1, 0b11, 5)];
        for choice in [best(&groups, 2, &[(CHART, 0)]), greedy(&groups, 2, &[(CHART, 0)])] {
            assert_eq!((choice.order, choice.tests, choice.cost), (vec![1, 0], CHART, 0));
        }
    }

    #[test]
    fn a_field_is_used_where_charts_cannot_tell() {
        // Both charts cover everything; the field of the first tells.
        let groups = [group(0, 0x1_0003, 30), group(1, 0b11, 20)];
        let price = |pixels: u32| Cost::from(pixels * PIXEL);
        let all = |pixels: u32| [(CHART, 0), (FIELD, price(pixels)), (BOTH, price(pixels))];
        let choice = best(&groups, 2, &all(4));
        assert_eq!((choice.order, choice.tests, choice.cost), (vec![0, 1], FIELD, price(4)));
        // Not where it costs more than it saves.
        assert_eq!(best(&groups, 2, &all(50)).tests, CHART);
        // Unless there is nothing else to choose.
        assert_eq!(best(&groups, 2, &[(FIELD, price(50))]).tests, FIELD);
    }

    #[test]
    fn what_shows_less_wrong_is_preferred() {
        // Two sheets that cover everything: the one seen more would win, were it not of nearly the same colour as the other is there.
        let (most, least) = (group(0, 0b11, 30), group(1, 0b11, 20));
        assert_eq!(best(&[most, least], 2, &[(CHART, 0)]).order[0], 0);
        let mut most = group(0, 0b11, 30);
        most.cost[1] /= 2;
        assert_eq!(best(&[most, group(1, 0b11, 20)], 2, &[(CHART, 0)]).order[0], 1);
        let cost = |right, shown| u32::from(cost(right, shown));
        assert!(cost([10, 20, 30], [11, 20, 30]) < PIXEL / 2 && cost([0; 3], [255; 3]) == MOST * PIXEL);
    }
}
