//! How the position of a layer is coded: what is already known predicts it, the rest is a residual.
//! Layers come from `nodes`; positions go into the key, what they say about their neighbours into traces.
//!
//! A position is told from the same layer in the two keys before and the same label at the nodes west and north of it.
//! Several predictors compete; the one that was best at those neighbours is used. How wrong they were there chooses the
//! contexts of the residual.

use crate::coder::{self, Bits, NUMBER_CONTEXTS, Probability};
use crate::fixed::{KEY_MAX, KEY_MIN, KeyUv};
use crate::format::{FIXED, LabelRecord};
use crate::grid::Grid;
use crate::key::{Key, Setting, Source, Spot};

/// Competing predictors.
const PREDICTORS: usize = 10;
/// Classes of how wrong the predictions were around a layer.
const NOISE_CLASSES: usize = 9;
/// Classes of how many of the eight cells around a node show the layer's label.
const SUPPORT_CLASSES: usize = 2;
/// Contexts positions are coded with.
pub const CONTEXTS: usize = SUPPORT_CLASSES * NOISE_CLASSES * 2 * NUMBER_CONTEXTS;

/// Codes the position of the layer at `spot` in `contexts` ([`CONTEXTS`] of them): the best prediction, and a residual. `support` of the
/// cells around the node show its label. Its trace joins `traces`.
#[expect(clippy::too_many_arguments, reason = "the key's state, its memory and the layer's place are three different owners")]
pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &Key<'_>,
    traces: &mut [Trace],
    spot: &Spot,
    support: u8,
    source: &mut S,
) -> KeyUv {
    let record = (setting.label)(spot.label);
    if record.flags & FIXED != 0 {
        return fixed(&record, spot, setting.grid.log2, setting.key_bits);
    }
    let neighbours = Neighbours::new(setting.grid, key, traces, spot);
    let candidates = Candidates::new(setting, &neighbours, spot);
    let (predicted, noise) = candidates.choose(&neighbours, &record, setting.key_bits);
    let round = |x: i32| {
        let half = (1i32 << setting.step_log2) >> 1;
        (x.clamp(KEY_MIN, KEY_MAX).wrapping_add(half)) >> setting.step_log2 << setting.step_log2
    };
    let predicted = predicted.map(round);
    let class = usize::from(support < 5).wrapping_mul(NOISE_CLASSES).wrapping_add(noise);
    let at = class.wrapping_mul(2 * NUMBER_CONTEXTS);
    let Some((along_u, rest)) = contexts.get_mut(at..).and_then(|c| c.split_at_mut_checked(NUMBER_CONTEXTS)) else { return KeyUv(0) };
    let Some((along_v, _)) = rest.split_at_mut_checked(NUMBER_CONTEXTS) else { return KeyUv(0) };
    let [u, v] = source.residual(spot.node, spot.label, predicted, [along_u, along_v]);
    let residual = [coder::number(bits, along_u, u), coder::number(bits, along_v, v)];
    let [u, v] = [0, 1].map(|axis: usize| {
        let (predicted, residual) = (predicted.get(axis).copied().unwrap_or(0), residual.get(axis).copied().unwrap_or(0));
        predicted.wrapping_add(residual.wrapping_shl(setting.step_log2))
    });
    let uv = KeyUv::new(u, v);
    let trace = candidates.trace(uv, residual, setting.step_log2);
    if let Some(slot) = trace_index(key, setting.grid, traces.len(), spot.row, spot.layer).and_then(|index| traces.get_mut(index)) {
        *slot = trace;
    }
    uv
}

/// What the coding of a layer leaves behind for its neighbours, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Trace {
    /// How far off each predictor was, steps, saturating.
    error: [u8; PREDICTORS],
    /// Position less temporal prediction, stored units, saturating.
    correction: [i16; 2],
    /// Position less what its plane tells, stored units, saturating.
    offset: [i16; 2],
    /// The residual that was coded, steps, saturating.
    noise: u8,
    /// [`TEMPORAL`] and [`FLAT`].
    known: u8,
}

/// [`Trace::known`]: there was a temporal prediction.
const TEMPORAL: u8 = 1;
/// [`Trace::known`]: there was a plane.
const FLAT: u8 = 2;

/// The position of a screen-fixed layer at a node: an affine function of the screen position.
fn fixed(record: &LabelRecord, spot: &Spot, log2: u32, key_bits: u32) -> KeyUv {
    let along = |origin: u16, step: u16, index: usize| {
        // index << log2 <= 4096 + 32 pixels, step < 2^16 of 1/16384 texel: the product fits 2^29.
        let offset = (index as i32).wrapping_shl(log2).wrapping_mul(i32::from(step)) >> 14u32.wrapping_sub(key_bits);
        i32::from(origin).wrapping_add(offset)
    };
    KeyUv::new(along(record.origin_u, record.step_u, spot.column), along(record.origin_v, record.step_v, spot.row))
}

/// Traces of even rows of nodes are in the first half, those of odd rows in the second.
fn trace_index(key: &Key<'_>, grid: Grid, length: usize, row: usize, layer: usize) -> Option<usize> {
    let first = key.start.get(row.wrapping_mul(grid.node_columns())).map(|&at| usize::from(at))?;
    Some(layer.wrapping_sub(first).wrapping_add(if row & 1 == 1 { length / 2 } else { 0 }))
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
    fn new(grid: Grid, key: &Key<'_>, traces: &'t [Trace], spot: &Spot) -> Self {
        let width = grid.node_columns();
        let near = |node: usize, row: usize| {
            let layer = key.find(node, spot.label)?;
            let uv = key.uv(layer);
            let trace = traces.get(trace_index(key, grid, traces.len(), row, layer)?)?;
            Some(Neighbour { uv: [uv.u(), uv.v()], trace })
        };
        let far = |node: usize| key.position(node, spot.label);
        let (node, left, up) = (spot.node, spot.column > 0, spot.row > 0);
        let (north, above) = (node.wrapping_sub(width), spot.row.wrapping_sub(1));
        let west = if left { near(node.wrapping_sub(1), spot.row) } else { None };
        let [north_east, north_west] = [
            if up && spot.column.wrapping_add(1) < width { near(north.wrapping_add(1), above) } else { None },
            if up && left { near(north.wrapping_sub(1), above) } else { None },
        ];
        let direct = if up { near(north, above) } else { None };
        // Those further on count with the ones before them alone.
        Self {
            far_west: if west.is_some() && spot.column > 1 { far(node.wrapping_sub(2)) } else { None },
            far_north: if direct.is_some() && spot.row > 1 { far(north.wrapping_sub(width)) } else { None },
            near: [west, direct, north_east, north_west],
        }
    }

    fn all(&self) -> impl Iterator<Item = &Neighbour<'t>> {
        self.near.iter().flatten()
    }
}

/// The predictors' answers.
struct Candidates {
    uv: [Option<[i32; 2]>; PREDICTORS],
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
    count: u32,
}

impl Sum {
    fn add(&mut self, value: [i32; 2]) {
        (self.sum, self.count) = (plus(self.sum, value), self.count.wrapping_add(1));
    }

    /// The mean, rounded towards minus infinity. Divisions are by known numbers: not every processor has another.
    fn mean(self) -> Option<[i32; 2]> {
        match self.count {
            0 => None,
            1 => Some(self.sum),
            2 => Some(self.sum.map(|x| x >> 1)),
            3 => Some(self.sum.map(|x| x.div_euclid(3))),
            _ => Some(self.sum.map(|x| x >> 2)),
        }
    }
}

impl Candidates {
    fn new<L>(setting: &Setting<'_, '_, L>, around: &Neighbours<'_>, spot: &Spot) -> Self {
        let held = setting.before.and_then(|k| k.position(spot.node, spot.label));
        let older = setting.before_that.and_then(|(k, ratio)| Some((k.position(spot.node, spot.label)?, ratio)));
        let temporal = held.map(|held| match older {
            // Positions differ by less than 2^16 and the ratio is at most 2^12: the product fits 2^28.
            Some((older, ratio)) => plus(held, minus(held, older).map(|d| d.wrapping_mul(ratio) >> 8)),
            None => held,
        });
        let [west, north, _, north_west] = &around.near;
        let (mut corrections, mut offsets, mut positions) = (Sum::default(), Sum::default(), Sum::default());
        for n in around.all() {
            positions.add(n.uv);
            if n.trace.known & TEMPORAL != 0 {
                corrections.add(n.trace.correction.map(i32::from));
            }
            if n.trace.known & FLAT != 0 {
                offsets.add(n.trace.offset.map(i32::from));
            }
        }
        let correction = |n: &Neighbour<'_>| (n.trace.known & TEMPORAL != 0).then(|| n.trace.correction.map(i32::from));
        let corrected = temporal.zip(corrections.mean());
        let plane = |w: [i32; 2], n: [i32; 2], nw: [i32; 2]| minus(plus(w, n), nw);
        let corner = west.as_ref().zip(north.as_ref()).zip(north_west.as_ref());
        let corner_correction = corner.and_then(|((w, n), nw)| Some(plane(correction(w)?, correction(n)?, correction(nw)?)));
        let mut lines = Sum::default();
        for (near, far) in [(west, around.far_west), (north, around.far_north)] {
            if let (Some(near), Some(far)) = (near, far) {
                lines.add(minus(plus(near.uv, near.uv), far));
            }
        }
        let view = setting.planes.binary_search_by_key(&spot.label, |[label, ..]| *label).ok().and_then(|plane| setting.views.get(plane));
        let flat = view.and_then(|view| view.at(spot.column, spot.row));
        // Of equally good predictions the first is taken: what a plane tells is best where nothing else is known.
        let uv = [
            flat,
            flat.zip(offsets.mean()).map(|(f, o)| plus(f, o)),
            temporal,
            corrected.map(|(t, c)| plus(t, c)),
            corrected.map(|(t, c)| plus(t, c.map(|x| x >> 1))),
            temporal.zip(corner_correction).map(|(t, c)| plus(t, c)),
            corner.map(|((w, n), nw)| plane(w.uv, n.uv, nw.uv)),
            lines.mean(),
            positions.mean(),
            older.and(held),
        ];
        Self { uv, temporal, flat }
    }

    /// The candidate that was best at the neighbours, and the class of how noisy they were.
    fn choose(&self, around: &Neighbours<'_>, record: &LabelRecord, key_bits: u32) -> ([i32; 2], usize) {
        let (mut errors, mut noise, mut count) = ([0u32; PREDICTORS], 0u32, 0u32);
        for n in around.all() {
            for (sum, &error) in errors.iter_mut().zip(&n.trace.error) {
                *sum = sum.wrapping_add(error.into());
            }
            (noise, count) = (noise.wrapping_add(n.trace.noise.into()), count.wrapping_add(1));
        }
        let mut best: Option<(u32, [i32; 2])> = None;
        for (candidate, error) in self.uv.iter().zip(errors) {
            let Some(candidate) = candidate else { continue };
            if best.is_none_or(|(least, _)| error < least) {
                best = Some((error, *candidate));
            }
        }
        // Twice the mean noise is at least a limit where twice the noise is at least as many times the limit.
        let class = match count {
            0 => NOISE_CLASSES - 1,
            _ => [1, 2, 4, 8, 14, 26, 60].iter().take_while(|&&limit| noise.wrapping_mul(2) >= count.wrapping_mul(limit)).count(),
        };
        let centre = || {
            let middle = |a: u16, b: u16| i32::from(a).wrapping_add(i32::from(b)).wrapping_shl(key_bits) >> 1;
            [middle(record.left, record.right), middle(record.top, record.bottom)]
        };
        (best.map_or_else(centre, |(_, uv)| uv), class)
    }

    fn trace(&self, uv: KeyUv, residual: [i32; 2], step_log2: u32) -> Trace {
        let actual = [uv.u(), uv.v()];
        let size = |d: [i32; 2]| d.iter().map(|x| x.unsigned_abs()).fold(0u32, u32::saturating_add);
        let byte = |x: u32| x.min(255) as u8;
        let error = self.uv.map(|candidate| candidate.map_or(40, |c| byte(size(minus(actual, c)) >> step_log2)));
        let from = |known: Option<[i32; 2]>| known.map_or([0, 0], |t| minus(actual, t)).map(|x| x.clamp(-32_768, 32_767) as i16);
        let known = if self.temporal.is_some() { TEMPORAL } else { 0 } | if self.flat.is_some() { FLAT } else { 0 };
        Trace { error, correction: from(self.temporal), offset: from(self.flat), noise: byte(size(residual)), known }
    }
}
