//! How the positions of a chain are coded: what is already known predicts each, the rest is a residual.
//! Chains come from `nodes`; positions go into the key, what they say about their neighbours into traces.
//!
//! A position is told from the same layer in the two keys before and the same label at the nodes west and north of it.
//! Several predictors compete; the one that was best at those neighbours is used. How wrong they were there chooses the
//! contexts of the residual.

use crate::coder::{self, Bits, NUMBER_CONTEXTS, Probability};
use crate::fixed::{KEY_MAX, KEY_MIN, KeyUv};
use crate::format::LabelRecord;
use crate::key::{self, Chain, Key, Line, Setting, Source};
use crate::plane::Across;

/// Competing predictors.
const PREDICTORS: usize = 6;
/// Classes of how wrong the predictions were around a layer.
const NOISE_CLASSES: usize = 9;
/// Classes of how many of the eight cells around a node show the layer's label.
const SUPPORT_CLASSES: usize = 2;
/// Contexts positions are coded with.
pub const CONTEXTS: usize = SUPPORT_CLASSES * NOISE_CLASSES * 2 * NUMBER_CONTEXTS;
/// How far off a predictor counts that had nothing to say, steps.
const SILENT: u32 = 40;

/// Codes the positions of the layers of `chain`, in row `row` of `key`, in `contexts` ([`CONTEXTS`] of them): for each the best
/// prediction, and a residual. Their `traces` have their marks.
#[expect(clippy::too_many_arguments, reason = "the key's state, its memory and the chain's place are three different owners")]
#[inline(never)]
pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &mut Key<'_>,
    traces: &mut [Trace],
    row: usize,
    chain: Chain,
    source: &mut S,
) {
    let label = chain.label as u8;
    let record = (setting.label)(label);
    let Key { row: rows, chain: chains, uv: positions, .. } = key;
    let line = |row: usize| key::of_row(rows, chains, row);
    let half = traces.len() / 2;
    let (even, odd) = traces.split_at_mut(half);
    let (above, here) = if row & 1 == 0 { (&*odd, even) } else { (&*even, odd) };
    let start = line(row).first().map_or(0, |first| first.at);
    let mut known = Known::new(setting, line, row, chain);
    let mut place = usize::from(chain.at.wrapping_sub(start));
    let mut node = row.wrapping_mul(setting.grid.node_columns()).wrapping_add(chain.first.into());
    for (layer, column) in (usize::from(chain.at)..).zip(chain.first..chain.end) {
        let west = if column == chain.first { None } else { here.get(place.wrapping_sub(1)) };
        let around = known.around(positions, above, west, column);
        let Some(marks) = here.get(place).map(|trace| trace.marks) else { break };
        let candidates = known.candidates(&around, column);
        let (predicted, noise) = candidates.choose(&around, &record, setting.key_bits);
        let round = |x: i32| {
            let half = (1i32 << setting.step_log2) >> 1;
            (x.clamp(KEY_MIN, KEY_MAX).wrapping_add(half)) >> setting.step_log2 << setting.step_log2
        };
        let predicted = predicted.map(round);
        let class = usize::from(marks & SUPPORTED == 0).wrapping_mul(NOISE_CLASSES).wrapping_add(noise);
        let at = class.wrapping_mul(2 * NUMBER_CONTEXTS);
        let Some((along_u, rest)) = contexts.get_mut(at..).and_then(|c| c.split_at_mut_checked(NUMBER_CONTEXTS)) else { break };
        let Some((along_v, _)) = rest.split_at_mut_checked(NUMBER_CONTEXTS) else { break };
        let [u, v] = source.residual(node, label, predicted, [along_u, along_v]);
        let residual = [coder::number(bits, along_u, u), coder::number(bits, along_v, v)];
        let [[u, v], [du, dv]] = [predicted, residual];
        let uv = KeyUv::new(u.wrapping_add(du.wrapping_shl(setting.step_log2)), v.wrapping_add(dv.wrapping_shl(setting.step_log2)));
        if let Some((slot, trace)) = positions.get_mut(layer).zip(here.get_mut(place)) {
            *slot = uv.0;
            *trace = candidates.trace(uv, residual, setting.step_log2, marks);
        }
        known.step(uv);
        (place, node) = (place.wrapping_add(1), node.wrapping_add(1));
    }
}

/// What the coding of a layer leaves behind for its neighbours, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Trace {
    /// How far off each predictor was, steps, saturating: a byte each, four in a word, the first lowest.
    error: [u32; WORDS],
    /// Position less temporal prediction, stored units, saturating.
    correction: [i16; 2],
    /// Position less what its plane tells, stored units, saturating.
    offset: [i16; 2],
    /// The residual that was coded, steps, saturating.
    noise: u16,
    /// [`TEMPORAL`], [`FLAT`], [`SUPPORTED`] and [`TESTED`].
    marks: u16,
}

/// Words of predictors' errors.
const WORDS: usize = PREDICTORS.div_ceil(4);
/// [`Trace::marks`]: there was a temporal prediction.
const TEMPORAL: u16 = 1;
/// [`Trace::marks`]: there was a plane.
const FLAT: u16 = 2;
/// [`Trace::marks`]: most cells around the node show the label.
const SUPPORTED: u16 = 4;
/// [`Trace::marks`]: some cell tests the layer's fields.
const TESTED: u16 = 8;

impl Trace {
    /// What sheet lists say of a layer: `support` cells around its node show its label, and some cell `tested` its fields.
    pub(crate) const fn marks(support: u8, tested: bool) -> u16 {
        (if support >= 5 { SUPPORTED } else { 0 }) | if tested { TESTED } else { 0 }
    }

    /// The trace of a layer that is not coded yet.
    pub(crate) fn marked(marks: u16) -> Self {
        Self { marks, ..Self::default() }
    }

    /// Some cell tests the layer's fields.
    pub(crate) const fn tested(&self) -> bool {
        self.marks & TESTED != 0
    }
}

/// What is known of a chain's label as its nodes are walked.
struct Known<'k> {
    /// The key before, and the one before that with how far things move on from there (see [`Setting::before_that`]).
    held: Option<(Line<'k>, &'k [u32])>,
    older: Option<(Line<'k>, &'k [u32], i32)>,
    /// The row above, where its layers start, and the row above that.
    north: Line<'k>,
    start: usize,
    far_north: Line<'k>,
    /// The layers north-west and north of the node.
    behind: Option<usize>,
    over: Option<usize>,
    /// The positions one and two nodes to the west.
    west: [Option<[i32; 2]>; 2],
    /// Where the label's plane is seen.
    plane: Option<Across>,
}

/// A layer of the same label at a neighbouring node.
#[derive(Clone, Copy)]
struct Neighbour<'t> {
    uv: [i32; 2],
    trace: &'t Trace,
}

/// The neighbours that are already coded: west, north, north-east, north-west, and one further west and north.
struct Neighbours<'t> {
    near: [Option<Neighbour<'t>>; 4],
    far_west: Option<[i32; 2]>,
    far_north: Option<[i32; 2]>,
}

impl<'t> Neighbours<'t> {
    fn all(&self) -> impl Iterator<Item = &Neighbour<'t>> {
        self.near.iter().flatten()
    }

    /// Where a layer may be that no predictor has an answer for: the mean of its neighbours, or without any the middle of its chart.
    #[inline(never)]
    fn guess(&self, record: &LabelRecord, key_bits: u32) -> [i32; 2] {
        let mut positions = Sum::default();
        self.all().for_each(|n| positions.add(n.uv));
        positions.mean().unwrap_or_else(|| {
            let middle = |a: u16, b: u16| i32::from(a).wrapping_add(i32::from(b)).wrapping_shl(key_bits) >> 1;
            [middle(record.left, record.right), middle(record.top, record.bottom)]
        })
    }
}

fn pair(uv: KeyUv) -> [i32; 2] {
    [uv.u(), uv.v()]
}

impl<'k> Known<'k> {
    fn new<L>(setting: &Setting<'k, '_, L>, line: impl Fn(usize) -> &'k [Chain], row: usize, chain: Chain) -> Self {
        let label = chain.label as u8;
        let above = row.checked_sub(1).map_or(&[][..], &line);
        let mut north = Line::new(above, label);
        let behind = chain.first.checked_sub(1).and_then(|column| north.layer(column));
        let over = north.layer(chain.first);
        let plane = setting.planes.binary_search_by_key(&label, |[label, ..]| *label).ok().and_then(|plane| setting.views.get(plane));
        Self {
            held: setting.before.map(|key| (Line::new(key.chains(row), label), &*key.uv)),
            older: setting.before_that.map(|(key, ratio)| (Line::new(key.chains(row), label), &*key.uv, ratio)),
            north,
            start: above.first().map_or(0, |first| first.at.into()),
            far_north: Line::new(row.checked_sub(2).map_or(&[][..], &line), label),
            behind,
            over,
            west: [None; 2],
            plane: plane.map(|view| view.across(chain.first.into(), row)),
        }
    }

    /// The neighbours of the node in `column`, given the key's `positions`, the traces of the row `above` and of the node to the `west`.
    #[inline(always)]
    fn around<'t>(&mut self, positions: &[u32], above: &'t [Trace], west: Option<&'t Trace>, column: u16) -> Neighbours<'t> {
        let ahead = self.north.layer(column.wrapping_add(1));
        let position = |layer: usize| Some(pair(KeyUv(*positions.get(layer)?)));
        let near = |layer: Option<usize>| {
            let trace = above.get(layer?.wrapping_sub(self.start))?;
            Some(Neighbour { uv: position(layer?)?, trace })
        };
        let [west_uv, far_west] = self.west;
        let west = west_uv.zip(west).map(|(uv, trace)| Neighbour { uv, trace });
        let near = [west, near(self.over), near(ahead), near(self.behind)];
        let far_north = if self.over.is_some() { self.far_north.layer(column).and_then(position) } else { None };
        (self.behind, self.over) = (self.over, ahead);
        Neighbours { near, far_west, far_north }
    }

    /// On to the next node, from one whose layer is at `uv`.
    #[inline(always)]
    fn step(&mut self, uv: KeyUv) {
        let [west, _] = self.west;
        self.west = [Some(pair(uv)), west];
    }

    /// What the predictors say of the node in `column`.
    #[inline(always)]
    fn candidates(&mut self, around: &Neighbours<'_>, column: u16) -> Candidates {
        let at = |(line, uv): (&mut Line<'_>, &[u32])| Some(pair(KeyUv(*uv.get(line.layer(column)?)?)));
        let held = self.held.as_mut().and_then(|(line, uv)| at((line, uv)));
        let older = self.older.as_mut().and_then(|(line, uv, ratio)| Some((at((line, uv))?, *ratio)));
        let flat = self.plane.as_mut().and_then(Across::advance);
        Candidates::new(around, held, older, flat)
    }
}

/// The predictors' answers.
struct Candidates {
    uv: [[i32; 2]; PREDICTORS],
    /// Which of them there are, a bit each.
    known: u32,
    temporal: Option<[i32; 2]>,
    flat: Option<[i32; 2]>,
}

fn plus(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    let ([a, b], [c, d]) = (a, b);
    [a.wrapping_add(c), b.wrapping_add(d)]
}

fn minus(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    let ([a, b], [c, d]) = (a, b);
    [a.wrapping_sub(c), b.wrapping_sub(d)]
}

/// A sum of up to four values.
#[derive(Clone, Copy, Default)]
struct Sum {
    sum: [i32; 2],
    first: [i32; 2],
    count: u32,
}

impl Sum {
    #[inline(always)]
    fn add(&mut self, value: [i32; 2]) {
        if self.count == 0 {
            self.first = value;
        }
        (self.sum, self.count) = (plus(self.sum, value), self.count.wrapping_add(1));
    }

    /// The mean, rounded towards minus infinity; of three values the first counts twice, since small processors do not divide.
    #[inline(always)]
    fn mean(self) -> Option<[i32; 2]> {
        match self.count {
            0 => None,
            1 => Some(self.sum),
            2 => Some(self.sum.map(|x| x >> 1)),
            3 => Some(plus(self.sum, self.first).map(|x| x >> 2)),
            _ => Some(self.sum.map(|x| x >> 2)),
        }
    }
}

impl Candidates {
    #[inline(always)]
    fn new(around: &Neighbours<'_>, held: Option<[i32; 2]>, older: Option<([i32; 2], i32)>, flat: Option<[i32; 2]>) -> Self {
        let temporal = held.map(|held| match older {
            // Positions differ by less than 2^16 and the ratio is at most 2^12: the product fits 2^28.
            Some((older, ratio)) => plus(held, minus(held, older).map(|d| d.wrapping_mul(ratio) >> 8)),
            None => held,
        });
        let [west, north, _, north_west] = &around.near;
        let (mut corrections, mut offsets) = (Sum::default(), Sum::default());
        for n in around.all() {
            if n.trace.marks & TEMPORAL != 0 {
                corrections.add(n.trace.correction.map(i32::from));
            }
            if n.trace.marks & FLAT != 0 {
                offsets.add(n.trace.offset.map(i32::from));
            }
        }
        let mut answers = Self { uv: [[0; 2]; PREDICTORS], known: 0, temporal, flat };
        // Of equally good predictions the first is taken: what a plane tells is best where nothing else is known.
        if let Some(flat) = flat {
            answers.set::<0>(flat);
            if let Some(offset) = offsets.mean() {
                answers.set::<1>(plus(flat, offset));
            }
        }
        if let Some(temporal) = temporal {
            answers.set::<2>(temporal);
            if let Some(correction) = corrections.mean() {
                answers.set::<3>(plus(temporal, correction));
            }
        }
        if let (Some(w), Some(n), Some(nw)) = (west, north, north_west) {
            answers.set::<4>(minus(plus(w.uv, n.uv), nw.uv));
        }
        let mut lines = Sum::default();
        for (near, far) in [(west, around.far_west), (north, around.far_north)] {
            if let (Some(near), Some(far)) = (near, far) {
                lines.add(minus(plus(near.uv, near.uv), far));
            }
        }
        if let Some(line) = lines.mean() {
            answers.set::<5>(line);
        }
        answers
    }

    #[inline(always)]
    fn set<const PREDICTOR: usize>(&mut self, answer: [i32; 2]) {
        if let Some(slot) = self.uv.get_mut(PREDICTOR) {
            *slot = answer;
            self.known |= 1 << PREDICTOR;
        }
    }

    /// The candidate that was best at the neighbours, and the class of how noisy they were.
    #[inline(always)]
    fn choose(&self, around: &Neighbours<'_>, record: &LabelRecord, key_bits: u32) -> ([i32; 2], usize) {
        // Errors of up to four neighbours: sums of bytes two by two, in halves of words.
        const HALVES: u32 = 0x00ff_00ff;
        let (mut even, mut odd) = ([0u32; WORDS], [0u32; WORDS]);
        let (mut noise, mut count) = (0u32, 0u32);
        for n in around.all() {
            for ((even, odd), error) in even.iter_mut().zip(&mut odd).zip(n.trace.error) {
                *even = even.wrapping_add(error & HALVES);
                *odd = odd.wrapping_add(error >> 8 & HALVES);
            }
            (noise, count) = (noise.wrapping_add(n.trace.noise.into()), count.wrapping_add(1));
        }
        let sums = even.iter().zip(&odd).flat_map(|(even, odd)| [even & 0xffff, odd & 0xffff, even >> 16, odd >> 16]);
        let mut best: Option<(u32, [i32; 2])> = None;
        for (index, (candidate, error)) in self.uv.iter().zip(sums).enumerate() {
            let known = self.known.wrapping_shr(index as u32) & 1 != 0;
            if known && best.is_none_or(|(least, _)| error < least) {
                best = Some((error, *candidate));
            }
        }
        // Twice the mean noise is at least a limit where twice the noise is at least as many times the limit.
        let class = match count {
            0 => NOISE_CLASSES - 1,
            _ => [1, 2, 4, 8, 14, 26, 60].iter().take_while(|&&limit| noise.wrapping_mul(2) >= count.wrapping_mul(limit)).count(),
        };
        (best.map_or_else(|| around.guess(record, key_bits), |(_, uv)| uv), class)
    }

    #[inline(always)]
    fn trace(&self, uv: KeyUv, residual: [i32; 2], step_log2: u32, marks: u16) -> Trace {
        let actual = pair(uv);
        let size = |[a, b]: [i32; 2]| a.unsigned_abs().saturating_add(b.unsigned_abs());
        let mut error = [0u32; WORDS];
        for (index, candidate) in self.uv.iter().enumerate() {
            let known = self.known.wrapping_shr(index as u32) & 1 != 0;
            let off = if known { (size(minus(actual, *candidate)) >> step_log2).min(255) } else { SILENT };
            if let Some(word) = error.get_mut(index >> 2) {
                *word |= off.wrapping_shl((index as u32 & 3) << 3);
            }
        }
        let from = |known: Option<[i32; 2]>| known.map_or([0, 0], |t| minus(actual, t)).map(|x| x.clamp(-32_768, 32_767) as i16);
        let known = if self.temporal.is_some() { TEMPORAL } else { 0 } | if self.flat.is_some() { FLAT } else { 0 };
        let noise = size(residual).min(255) as u16;
        Trace { error, correction: from(self.temporal), offset: from(self.flat), noise, marks: marks | known }
    }
}
