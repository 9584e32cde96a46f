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
/// Contexts positions are coded with.
pub const CONTEXTS: usize = NOISE_CLASSES * 2 * NUMBER_CONTEXTS;
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
    let Key { row: rows, chain: chains, uv: positions, .. } = key;
    let line = |row: usize| key::of_row(rows, chains, row);
    let half = traces.len() / 2;
    let (even, odd) = traces.split_at_mut(half);
    let (above, here) = if row & 1 == 0 { (&*odd, even) } else { (&*even, odd) };
    let start = line(row).first().map_or(0, |first| first.at);
    let mut known = Known::new(setting, line, row, chain);
    let mut near = known.at(positions, above, chain.first);
    let here = here.get_mut(usize::from(chain.at.wrapping_sub(start))..).unwrap_or(&mut []);
    let mut node = row.wrapping_mul(setting.grid.node_columns()).wrapping_add(chain.first.into());
    for ((trace, layer), column) in here.iter_mut().zip(usize::from(chain.at)..).zip(chain.first..chain.end) {
        near.ahead = known.over(positions, above, column.wrapping_add(1));
        near.far_north = if near.north.there() { known.far_north.layer(column).and_then(|layer| position(positions, layer)) } else { None };
        let sums = near.sums();
        let candidates = Candidates::new(&near, &sums, &mut known, column);
        let predicted = candidates.best(&sums).unwrap_or_else(|| near.guess(&(setting.label)(label), setting.key_bits));
        let round = |x: i32| {
            let half = (1i32 << setting.step_log2) >> 1;
            (x.clamp(KEY_MIN, KEY_MAX).wrapping_add(half)) >> setting.step_log2 << setting.step_log2
        };
        let predicted = predicted.map(round);
        let marks = trace.marks();
        let at = sums.noise_class().wrapping_mul(2 * NUMBER_CONTEXTS);
        let Some((along_u, rest)) = contexts.get_mut(at..).and_then(|c| c.split_at_mut_checked(NUMBER_CONTEXTS)) else { break };
        let Some((along_v, _)) = rest.split_at_mut_checked(NUMBER_CONTEXTS) else { break };
        let [u, v] = source.residual(node, label, predicted, [along_u, along_v]);
        let residual = [coder::number(bits, along_u, u), coder::number(bits, along_v, v)];
        let [[u, v], [du, dv]] = [predicted, residual];
        let uv = KeyUv::new(u.wrapping_add(du.wrapping_shl(setting.step_log2)), v.wrapping_add(dv.wrapping_shl(setting.step_log2)));
        if let Some(slot) = positions.get_mut(layer) {
            *slot = uv.0;
            *trace = candidates.trace(uv, residual, setting.step_log2, marks);
        }
        near.step(pair(uv), *trace);
        node = node.wrapping_add(1);
    }
}

/// What the coding of a layer leaves behind for its neighbours, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Trace {
    /// How far off each predictor was, steps, saturating: a byte each, the first lowest; then how large the residual was, steps, up to [`MOST_NOISE`];
    /// then marks. Sums of four neighbours' are made of all at once.
    bytes: [u32; 2],
    /// Position less temporal prediction, stored units, saturating.
    correction: [i16; 2],
    /// Position less what its plane tells, stored units, saturating.
    offset: [i16; 2],
}

/// Where [`Trace::marks`] begin in the second word: above the last predictor's error.
const MARKS: u32 = 16;
const _: () = assert!(PREDICTORS == 6, "their errors are six bytes of eight");
/// Noise, the lowest bits of the marks: as large a residual as this, of one neighbour of four, makes for the last class.
const MOST_NOISE: i32 = 127;
/// [`Trace::marks`]: some cell tests the layer's fields.
const TESTED: u32 = 1 << 7;
/// [`Trace::marks`]: there was a temporal prediction. In three bits each, up to four of these are counted.
const TEMPORAL: u32 = 1 << 8;
/// [`Trace::marks`]: there was a plane.
const FLAT: u32 = 1 << 11;
/// [`Trace::marks`]: the layer is coded.
const THERE: u32 = 1 << 14;

impl Trace {
    /// The trace of a layer that is not coded yet; some cell `tested` its fields.
    pub(crate) fn of(tested: bool) -> Self {
        Self { bytes: [0, if tested { TESTED << MARKS } else { 0 }], ..Self::default() }
    }

    /// Some cell tests the layer's fields.
    pub(crate) const fn tested(&self) -> bool {
        self.marks() & TESTED != 0
    }

    #[inline(always)]
    const fn marks(&self) -> u32 {
        let [_, last] = self.bytes;
        last >> MARKS
    }
}

/// What is known of a chain's label as its nodes are walked.
struct Known<'k> {
    /// The key before, and the one before that with how far things move on from there (see [`Setting::before_that`]).
    held: (Line<'k>, &'k [u32]),
    older: (Line<'k>, &'k [u32]),
    ratio: i32,
    /// The row above, where its layers start, and the row above that.
    north: Line<'k>,
    start: usize,
    far_north: Line<'k>,
    /// Where the label's plane is seen.
    plane: Option<Across>,
}

/// A layer of the same label at a neighbouring node; one that has left no trace is not there.
#[derive(Clone, Copy)]
struct Neighbour<'t> {
    uv: [i32; 2],
    trace: &'t Trace,
}

impl Neighbour<'_> {
    const NONE: Self = Self { uv: [0; 2], trace: &Trace { bytes: [0; 2], correction: [0; 2], offset: [0; 2] } };

    #[inline(always)]
    const fn there(&self) -> bool {
        self.trace.marks() & THERE != 0
    }
}

/// The neighbours that are already coded, and one further west and north.
struct Neighbours<'t> {
    /// Where the one to the west is, and its trace.
    west: ([i32; 2], Trace),
    north: Neighbour<'t>,
    /// To the north-east.
    ahead: Neighbour<'t>,
    /// To the north-west.
    behind: Neighbour<'t>,
    far_west: Option<[i32; 2]>,
    far_north: Option<[i32; 2]>,
}

fn pair(uv: KeyUv) -> [i32; 2] {
    [uv.u(), uv.v()]
}

#[inline(always)]
fn position(positions: &[u32], layer: usize) -> Option<[i32; 2]> {
    positions.get(layer).map(|&uv| pair(KeyUv(uv)))
}

impl<'k> Known<'k> {
    fn new<L>(setting: &Setting<'k, '_, L>, line: impl Fn(usize) -> &'k [Chain], row: usize, chain: Chain) -> Self {
        let label = chain.label as u8;
        let above = row.checked_sub(1).map_or(&[][..], &line);
        let of =
            |key: Option<&'k Key<'_>>| key.map_or((Line::new(&[], label), &[][..]), |key| (Line::new(key.chains(row), label), &*key.uv));
        let plane = setting.planes.binary_search_by_key(&label, |[label, ..]| *label).ok().and_then(|plane| setting.views.get(plane));
        Self {
            held: of(setting.before),
            older: of(setting.before_that.map(|(key, _)| key)),
            ratio: setting.before_that.map_or(0, |(_, ratio)| ratio),
            north: Line::new(above, label),
            start: above.first().map_or(0, |first| first.at.into()),
            far_north: Line::new(row.checked_sub(2).map_or(&[][..], &line), label),
            plane: plane.map(|view| view.across(chain.first.into(), row)),
        }
    }

    /// The layer north of the node in `column`, given the key's `positions` and the traces of the row `above`.
    #[inline(always)]
    fn over<'t>(&mut self, positions: &[u32], above: &'t [Trace], column: u16) -> Neighbour<'t> {
        let Some(layer) = self.north.layer(column) else { return Neighbour::NONE };
        let trace = above.get(layer.wrapping_sub(self.start));
        trace.zip(position(positions, layer)).map_or(Neighbour::NONE, |(trace, uv)| Neighbour { uv, trace })
    }

    /// The neighbours of the first node, in `column`.
    #[inline(never)]
    fn at<'t>(&mut self, positions: &[u32], above: &'t [Trace], column: u16) -> Neighbours<'t> {
        let behind = column.checked_sub(1).map_or(Neighbour::NONE, |column| self.over(positions, above, column));
        let north = self.over(positions, above, column);
        Neighbours { west: ([0; 2], Trace::default()), north, ahead: Neighbour::NONE, behind, far_west: None, far_north: None }
    }
}

/// Sums over a node's neighbours: two errors each, in halves of words; in the last two words' upper halves noise and marks.
struct Sums([u32; 4]);

impl Sums {
    #[inline(always)]
    const fn noise(&self) -> u32 {
        let [.., noise, _] = self.0;
        noise >> 16
    }

    /// How many neighbours have such a `mark`.
    #[inline(always)]
    const fn count(&self, mark: u32) -> u32 {
        let [.., marks] = self.0;
        // Marks are counted without the noise below them, three bits each.
        marks >> MARKS.wrapping_add(mark.trailing_zeros()).wrapping_sub(8) & 7
    }

    /// The class of how noisy the neighbours were.
    #[inline(always)]
    fn noise_class(&self) -> usize {
        let (noise, count) = (self.noise(), self.count(THERE));
        // Twice the mean noise is at least a limit where twice the noise is at least as many times the limit.
        match count {
            0 => NOISE_CLASSES - 1,
            _ => [1, 2, 4, 8, 14, 26, 60].iter().take_while(|&&limit| noise.wrapping_mul(2) >= count.wrapping_mul(limit)).count(),
        }
    }
}

impl Neighbours<'_> {
    #[inline(always)]
    fn traces(&self) -> [&Trace; 4] {
        [&self.west.1, self.north.trace, self.ahead.trace, self.behind.trace]
    }

    #[inline(always)]
    fn sums(&self) -> Sums {
        const HALVES: u32 = 0x00ff_00ff;
        let mut sums = [0u32; 4];
        for trace in self.traces() {
            let ([a, b, c, d], [first, last]) = (sums, trace.bytes);
            // The highest bit of noise's byte is another mark.
            let noise = last & (HALVES ^ TESTED << MARKS);
            sums = [
                a.wrapping_add(first & HALVES),
                b.wrapping_add(first >> 8 & HALVES),
                c.wrapping_add(noise),
                d.wrapping_add(last >> 8 & HALVES),
            ];
        }
        Sums(sums)
    }

    /// Where a layer may be that no predictor has an answer for: the mean of its neighbours, or without any the middle of its chart.
    #[inline(never)]
    fn guess(&self, record: &LabelRecord, key_bits: u32) -> [i32; 2] {
        let (west, trace) = &self.west;
        let near = [Neighbour { uv: *west, trace }, self.north, self.ahead, self.behind];
        let mut positions = Sum::default();
        near.iter().filter(|neighbour| neighbour.there()).for_each(|neighbour| positions.add(neighbour.uv));
        positions.mean().unwrap_or_else(|| {
            let middle = |a: u16, b: u16| i32::from(a).wrapping_add(i32::from(b)).wrapping_shl(key_bits) >> 1;
            [middle(record.left, record.right), middle(record.top, record.bottom)]
        })
    }

    /// On to the next node, from one whose layer is at `uv` and has left `trace`.
    #[inline(always)]
    fn step(&mut self, uv: [i32; 2], trace: Trace) {
        let (west, before) = self.west;
        self.far_west = (before.marks() & THERE != 0).then_some(west);
        self.west = (uv, trace);
        (self.behind, self.north) = (self.north, self.ahead);
    }
}

/// The predictors' answers.
struct Candidates {
    uv: [[i32; 2]; PREDICTORS],
    /// Which of them there are, a bit each.
    known: u32,
}

/// Places of two of them.
const PLANE: usize = 0;
const TIME: usize = 2;

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
    fn new(near: &Neighbours<'_>, sums: &Sums, known: &mut Known<'_>, column: u16) -> Self {
        let mut answers = Self { uv: [[0; 2]; PREDICTORS], known: 0 };
        // Of equally good predictions the first is taken: what a plane tells is best where nothing else is known.
        if let Some(flat) = known.plane.as_mut().and_then(Across::advance) {
            answers.set::<PLANE>(flat);
            if let Some(offset) = near.mean(sums, FLAT, |trace| trace.offset) {
                answers.set::<{ PLANE + 1 }>(plus(flat, offset));
            }
        }
        let at = |(line, uv): &mut (Line<'_>, &[u32])| position(uv, line.layer(column)?);
        let (held, older) = (at(&mut known.held), at(&mut known.older));
        if let Some(held) = held {
            let temporal = match older {
                // Positions differ by less than 2^16 and the ratio is at most 2^12: the product fits 2^28.
                Some(older) => plus(held, minus(held, older).map(|d| d.wrapping_mul(known.ratio) >> 8)),
                None => held,
            };
            answers.set::<TIME>(temporal);
            if let Some(correction) = near.mean(sums, TEMPORAL, |trace| trace.correction) {
                answers.set::<{ TIME + 1 }>(plus(temporal, correction));
            }
        }
        let (west, trace) = &near.west;
        let west = Neighbour { uv: *west, trace };
        if west.there() && near.north.there() && near.behind.there() {
            answers.set::<4>(minus(plus(west.uv, near.north.uv), near.behind.uv));
        }
        let mut lines = Sum::default();
        for (near, far) in [(west, near.far_west), (near.north, near.far_north)] {
            if let Some(far) = far {
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

    #[inline(always)]
    fn knows(&self, predictor: usize) -> bool {
        self.known & 1u32.wrapping_shl(predictor as u32) != 0
    }

    /// The candidate that was best at the neighbours.
    #[inline(always)]
    fn best(&self, sums: &Sums) -> Option<[i32; 2]> {
        let ([a, b, c, d, e, f], [first, second, third, fourth]) = (self.uv, sums.0);
        let (mut least, mut best) = (u32::MAX, [0; 2]);
        // One after the other, since a loop over six is not unrolled.
        let mut compare = |predictor: usize, candidate: [i32; 2], error: u32| {
            if self.knows(predictor) && error < least {
                (least, best) = (error, candidate);
            }
        };
        compare(0, a, first & 0xffff);
        compare(1, b, second & 0xffff);
        compare(2, c, first >> 16);
        compare(3, d, second >> 16);
        compare(4, e, third & 0xffff);
        compare(5, f, fourth & 0xffff);
        (self.known != 0).then_some(best)
    }

    #[inline(always)]
    fn trace(&self, uv: KeyUv, residual: [i32; 2], step_log2: u32, marks: u32) -> Trace {
        let (actual, [a, b, c, d, e, f]) = (pair(uv), self.uv);
        // Differences are below 2^29: sums of two fit. Signed, so that one instruction bounds them.
        let size = |[a, b]: [i32; 2]| a.wrapping_abs().wrapping_add(b.wrapping_abs());
        let off = |predictor: usize, candidate: [i32; 2]| {
            let off = (size(minus(actual, candidate)) >> step_log2).clamp(0, 255) as u32;
            (if self.knows(predictor) { off } else { SILENT }).wrapping_shl((predictor as u32 & 3) << 3)
        };
        let (first, last) = (off(0, a) | off(1, b) | off(2, c) | off(3, d), off(4, e) | off(5, f));
        let short = |predictor: usize, candidate: [i32; 2]| {
            let short = minus(actual, candidate).map(|x| x.clamp(-32_768, 32_767) as i16);
            if self.knows(predictor) { short } else { [0; 2] }
        };
        let flat = if self.knows(PLANE) { FLAT } else { 0 };
        let temporal = if self.knows(TIME) { TEMPORAL } else { 0 };
        let marks = marks & TESTED | THERE | flat | temporal | size(residual).clamp(0, MOST_NOISE) as u32;
        Trace { bytes: [first, last | marks << MARKS], correction: short(TIME, c), offset: short(PLANE, a) }
    }
}

impl Neighbours<'_> {
    /// The mean of what those neighbours' traces say that have such a `mark`; the others say nothing.
    #[inline(always)]
    fn mean(&self, sums: &Sums, mark: u32, of: impl Fn(&Trace) -> [i16; 2]) -> Option<[i32; 2]> {
        let wide = |trace: &Trace| of(trace).map(i32::from);
        let [west, north, ahead, behind] = self.traces();
        let first = if west.marks() & mark != 0 { west } else { north };
        let sum = plus(plus(wide(west), wide(north)), plus(wide(ahead), wide(behind)));
        Sum { sum, first: wide(first), count: sums.count(mark) }.mean()
    }
}
