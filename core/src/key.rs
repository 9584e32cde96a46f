//! Keys: which layers each node carries, and their positions in the source image.
//! Described once, for decoder and encoder alike: bits come from (or go to) `coder`, layers go to
//! the caller's memory, where `cell` picks them up.
//!
//! A node carries one layer for every label in the sheet lists of the cells that touch it, in the
//! interval before its key and in the one after. A position is told from what is already known: the
//! same layer in the two keys before, the same label at the nodes west and north of it. Several
//! predictors compete; the one that was best at those neighbours is used.

use crate::coder::{self, Bits, NUMBER_CONTEXTS, Probability};
use crate::fixed::{self, KEY_BITS, KeyUv};
use crate::format::{FIXED, LabelRecord, MAX_NODE_LAYERS, STRIP};
use crate::grid::Grid;
use crate::lists::{CHART, Cursor, Lists, Sheets};
use heapless::Vec;

/// Competing predictors.
const PREDICTORS: usize = 8;
/// Classes of how wrong the predictions were around a layer.
const NOISE_CLASSES: usize = 9;
/// Classes of how many of the eight cells around a node show the layer's label.
const SUPPORT_CLASSES: usize = 2;
/// Contexts the positions are coded with.
const POSITION_CONTEXTS: usize = SUPPORT_CLASSES * NOISE_CLASSES * 2 * NUMBER_CONTEXTS;
/// Ways a field can be told: from time and neighbours, from time, from neighbours, from nothing.
const FIELD_CLASSES: usize = 4;
/// Contexts a key is coded with.
pub const CONTEXTS: usize = POSITION_CONTEXTS + FIELD_CLASSES * NUMBER_CONTEXTS;

/// One key's layers in caller's memory, node by node, labels ascending.
#[derive(Debug, Default)]
pub struct Key<'m> {
    /// Where each node's layers start; one entry more than nodes.
    pub start: &'m mut [u16],
    /// The layers' labels.
    pub label: &'m mut [u8],
    /// The layers' positions, [`KeyUv`] each.
    pub uv: &'m mut [u32],
    /// The layers' fields, as codes (see [`fixed::field_distance`]); empty where the bundle has none. Layers that no cell tests hold zeros.
    pub fields: [&'m mut [i8]; 2],
}

impl Key<'_> {
    /// The index of the first layer of `node` and the labels of its layers.
    #[must_use]
    pub fn node(&self, node: usize) -> (usize, &[u8]) {
        let at = |node: usize| self.start.get(node).map_or(0, |&at| usize::from(at));
        let (from, to) = (at(node), at(node.wrapping_add(1)));
        (from, self.label.get(from..to).unwrap_or(&[]))
    }

    /// The index of the layer of `label` at `node`.
    #[must_use]
    pub fn find(&self, node: usize, label: u8) -> Option<usize> {
        let (from, labels) = self.node(node);
        labels.iter().position(|&l| l == label).map(|i| from.wrapping_add(i))
    }

    /// The position of layer `index`.
    #[must_use]
    pub fn uv(&self, index: usize) -> KeyUv {
        KeyUv(self.uv.get(index).copied().unwrap_or(0))
    }

    /// The fields of layer `index`, Q8 pixels.
    #[must_use]
    pub fn field(&self, index: usize) -> [i32; 2] {
        let [a, b] = &self.fields;
        let distance = |codes: &[i8]| codes.get(index).map_or(0, |&code| fixed::field_distance(code));
        [distance(a), distance(b)]
    }

    fn position(&self, node: usize, label: u8) -> Option<[i32; 2]> {
        self.find(node, label).map(|index| self.uv(index)).map(|uv| [uv.u(), uv.v()])
    }
}

/// What the coding of a layer leaves behind for its neighbours.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Trace {
    /// How far off each predictor was, steps, saturating.
    error: [u8; PREDICTORS],
    /// Position less temporal prediction, 1/32 texel, saturating.
    correction: [i16; 2],
    /// The residual that was coded, steps, saturating.
    noise: u8,
    /// 1: there was a temporal prediction.
    temporal: u8,
    /// The trace keeps a multiple of its alignment.
    unused: [u8; 2],
}

/// What an encoder knows; a decoder's [`Nothing`] gives answers that are ignored.
pub trait Source {
    /// The sheets of `cell` in the interval that starts (`ahead`) or ends at the key.
    fn sheets(&mut self, ahead: bool, cell: usize) -> Sheets;

    /// The residual to code, in steps along u and v, for the layer of `label` at `node` whose `predicted` position is in
    /// 1/32 texel. `contexts` tell what residuals cost.
    fn residual(&mut self, node: usize, label: u8, predicted: [i32; 2], contexts: [&[Probability]; 2]) -> [i32; 2];

    /// The code of field `which` for the layer of `label` at `node`.
    fn field(&mut self, node: usize, label: u8, which: usize) -> i8;
}

/// The source of a decoder: the bits say it all.
#[derive(Clone, Copy, Debug)]
pub struct Nothing;

impl Source for Nothing {
    fn sheets(&mut self, _: bool, _: usize) -> Sheets {
        Sheets::default()
    }

    fn residual(&mut self, _: usize, _: u8, _: [i32; 2], _: [&[Probability]; 2]) -> [i32; 2] {
        [0, 0]
    }

    fn field(&mut self, _: usize, _: u8, _: usize) -> i8 {
        0
    }
}

/// What a key is coded with besides bits and contexts.
#[derive(Debug)]
pub struct Setting<'s, 'm, L> {
    /// The grid.
    pub grid: Grid,
    /// The record of a label.
    pub label: L,
    /// Coordinates are coded in steps of 2^this / 32 texel.
    pub step_log2: u32,
    /// The key before, unless this one is independent.
    pub before: Option<&'s Key<'m>>,
    /// The key before that one, and the length of the coming interval over that between the two, Q8.
    pub before_that: Option<(&'s Key<'m>, i32)>,
    /// The sheet lists of the intervals that end and start at this key.
    pub lists: [Option<&'s Lists<'m>>; 2],
}

/// Codes one key's layers into `target`. `traces` holds two rows of nodes' worth of [`Trace`]s, half of it each.
pub fn code<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    target: &mut Key<'_>,
    traces: &mut [Trace],
    source: &mut S,
) {
    let grid = setting.grid;
    let (mut node, mut layer) = (0usize, 0usize);
    for row in 0..grid.node_rows() {
        let mut around = Corner::new(setting.lists, row);
        let row_start = layer;
        for column in 0..grid.node_columns() {
            if let Some(start) = target.start.get_mut(node) {
                *start = layer as u16;
            }
            let mut labels: Vec<Found, MAX_NODE_LAYERS> = Vec::new();
            around.labels(setting.lists, column < grid.columns, &mut labels);
            let end = layer.wrapping_add(labels.len());
            // A node that breaks the key's bound carries nothing.
            let fits = end <= target.label.len() && end.wrapping_sub(row_start) <= traces.len() / 2;
            if !fits {
                labels.clear();
            }
            for (index, found) in (layer..).zip(&labels) {
                if let Some(slot) = target.label.get_mut(index) {
                    *slot = found.label;
                }
            }
            if let Some(start) = target.start.get_mut(node.wrapping_add(1)) {
                *start = layer.wrapping_add(labels.len()) as u16;
            }
            for found in &labels {
                let place = Place { node, row, column, label: found.label, layer };
                let coded = code_layer(bits, contexts, setting, target, traces, &place, found.support, source);
                if let Some(slot) = target.uv.get_mut(layer) {
                    *slot = coded.0;
                }
                code_fields(bits, contexts, setting, target, &place, found.tested, source);
                layer = layer.wrapping_add(1);
            }
            node = node.wrapping_add(1);
        }
    }
}

/// Where a layer stands.
struct Place {
    node: usize,
    row: usize,
    column: usize,
    label: u8,
    layer: usize,
}

/// A label in the cells around a node.
struct Found {
    label: u8,
    /// How many of the cells show it.
    support: u8,
    /// Some cell tests its fields.
    tested: bool,
}

/// The cells around a node as a row of nodes is walked: above and below, in the interval before and after.
struct Corner {
    /// The cells to the left of the node, and those to the right.
    left: [Option<Cursor>; 4],
    right: [Option<Cursor>; 4],
}

impl Corner {
    fn new(lists: [Option<&Lists<'_>>; 2], row: usize) -> Self {
        let mut right = [None; 4];
        for (slot, (list, above)) in right.iter_mut().zip(lists.iter().flat_map(|&list| [(list, true), (list, false)])) {
            *slot = list.and_then(|list| if above { row.checked_sub(1).map(|row| list.row(row)) } else { Some(list.row(row)) });
        }
        Self { left: [None; 4], right }
    }

    /// Collects the labels of the cells around the node, ascending; then moves on.
    fn labels(&mut self, lists: [Option<&Lists<'_>>; 2], inside: bool, found: &mut Vec<Found, MAX_NODE_LAYERS>) {
        let [before, after] = lists;
        let owners = [before, before, after, after];
        if !inside {
            self.right = [None; 4];
        }
        for (cursors, owner) in self.left.iter().zip(&self.right).zip(owners) {
            let Some(owner) = owner else { continue };
            for cursor in [cursors.0, cursors.1].into_iter().flatten() {
                let sheets = owner.sheets(*cursor);
                for (index, &label) in sheets.labels.iter().enumerate() {
                    let tested = sheets.test(index) != CHART;
                    let at = found.partition_point(|other| other.label < label);
                    match found.get_mut(at) {
                        Some(other) if other.label == label => {
                            other.support = other.support.saturating_add(1);
                            other.tested |= tested;
                        }
                        // Labels past the bound of a node are left out; its cells do without them.
                        _ => drop(found.insert(at, Found { label, support: 1, tested })),
                    }
                }
            }
        }
        self.left = self.right;
        for (cursor, owner) in self.right.iter_mut().zip(owners) {
            *cursor = cursor.zip(owner).map(|(cursor, owner)| cursor.next(owner));
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "the key's state, its memory and the layer's place are three different owners")]
fn code_layer<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &Key<'_>,
    traces: &mut [Trace],
    place: &Place,
    support: u8,
    source: &mut S,
) -> KeyUv {
    let record = (setting.label)(place.label);
    if record.flags & FIXED != 0 {
        return fixed(&record, place, setting.grid.log2);
    }
    let neighbours = Neighbours::new(setting.grid, key, traces, place);
    let candidates = Candidates::new(setting, key, &neighbours, place);
    let (predicted, noise) = candidates.choose(&neighbours, &record);
    let round = |x: i32| {
        let half = (1i32 << setting.step_log2) >> 1;
        (x.clamp(fixed::KEY_MIN, fixed::KEY_MAX).wrapping_add(half)) >> setting.step_log2 << setting.step_log2
    };
    let predicted = predicted.map(round);
    let class = usize::from(support < 5).wrapping_mul(NOISE_CLASSES).wrapping_add(noise);
    let at = class.wrapping_mul(2 * NUMBER_CONTEXTS);
    let Some((along_u, rest)) = contexts.get_mut(at..).and_then(|c| c.split_at_mut_checked(NUMBER_CONTEXTS)) else { return KeyUv(0) };
    let Some((along_v, _)) = rest.split_at_mut_checked(NUMBER_CONTEXTS) else { return KeyUv(0) };
    let [u, v] = source.residual(place.node, place.label, predicted, [along_u, along_v]);
    let residual = [coder::number(bits, along_u, u), coder::number(bits, along_v, v)];
    let [u, v] = [0, 1].map(|axis: usize| {
        let (predicted, residual) = (predicted.get(axis).copied().unwrap_or(0), residual.get(axis).copied().unwrap_or(0));
        predicted.wrapping_add(residual.wrapping_shl(setting.step_log2))
    });
    let uv = KeyUv::new(u, v);
    let trace = candidates.trace(uv, residual, setting.step_log2);
    if let Some(slot) = trace_index(key, setting.grid, traces.len(), place.row, place.layer).and_then(|index| traces.get_mut(index)) {
        *slot = trace;
    }
    uv
}

/// Codes the fields of a layer, or clears them where no cell `tested` them.
fn code_fields<B: Bits, S: Source, L: Fn(u8) -> LabelRecord>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &mut Key<'_>,
    place: &Place,
    tested: bool,
    source: &mut S,
) {
    let strip = (setting.label)(place.label).flags & STRIP != 0;
    for which in 0..2usize {
        let wanted = tested && (which == 0 || strip);
        let code = if wanted { code_field(bits, contexts, setting, key, place, which, source) } else { 0 };
        if let Some(slot) = key.fields.get_mut(which).and_then(|codes| codes.get_mut(place.layer)) {
            *slot = code;
        }
    }
}

/// Codes one field of a layer, told from the key before and how the same field changed at the nodes west and north of it.
fn code_field<B: Bits, S: Source, L>(
    bits: &mut B,
    contexts: &mut [Probability],
    setting: &Setting<'_, '_, L>,
    key: &Key<'_>,
    place: &Place,
    which: usize,
    source: &mut S,
) -> i8 {
    let width = setting.grid.node_columns();
    // A field of zero is one that nothing is known about: its layer was not tested.
    let known = |key: &Key<'_>, node: Option<usize>| {
        let distance = key.field(key.find(node?, place.label)?).get(which).copied()?;
        (distance != 0).then_some(distance)
    };
    let west = (place.column > 0).then(|| place.node.wrapping_sub(1));
    let north = (place.row > 0).then(|| place.node.wrapping_sub(width));
    let north_west = west.and(north).map(|node| node.wrapping_sub(1));
    let before = |node: Option<usize>| setting.before.and_then(|key| known(key, node));
    let held = before(Some(place.node));
    let change = |node: Option<usize>| known(key, node).zip(before(node)).map(|(now, then)| now.wrapping_sub(then));
    let average = |a: Option<i32>, b: Option<i32>| match (a, b) {
        (Some(a), Some(b)) => Some(a.wrapping_add(b) >> 1),
        (one, other) => one.or(other),
    };
    let moved = average(change(west), change(north));
    let beside = match (known(key, west), known(key, north), known(key, north_west)) {
        (Some(w), Some(n), Some(nw)) => Some(w.wrapping_add(n).wrapping_sub(nw)),
        (w, n, _) => average(w, n),
    };
    let (predicted, class) = match (held, moved, beside) {
        (Some(held), Some(moved), _) => (held.wrapping_add(moved), 0usize),
        (Some(held), None, _) => (held, 1),
        (None, _, Some(beside)) => (beside, 2),
        (None, _, None) => (0, 3),
    };
    let predicted = i32::from(fixed::field_code(predicted));
    let wanted = i32::from(source.field(place.node, place.label, which));
    let at = class.wrapping_mul(NUMBER_CONTEXTS).wrapping_add(POSITION_CONTEXTS);
    let Some(contexts) = contexts.get_mut(at..) else { return 0 };
    let code = predicted.wrapping_add(coder::number(bits, contexts, wanted.wrapping_sub(predicted)));
    code.clamp(-fixed::MAX_FIELD, fixed::MAX_FIELD) as i8
}

/// The position of a screen-fixed layer at a node: an affine function of the screen position.
fn fixed(record: &LabelRecord, place: &Place, log2: u32) -> KeyUv {
    let along = |origin: u16, step: u16, index: usize| {
        // index << log2 <= 4096 + 32 pixels, step < 2^16 of 1/16384 texel: the product fits 2^29.
        let offset = (index as i32).wrapping_shl(log2).wrapping_mul(i32::from(step)) >> (14 - KEY_BITS);
        i32::from(origin).wrapping_add(offset)
    };
    KeyUv::new(along(record.origin_u, record.step_u, place.column), along(record.origin_v, record.step_v, place.row))
}

/// Traces of even rows of nodes are in the first half, those of odd rows in the second.
fn trace_index(key: &Key<'_>, grid: Grid, length: usize, row: usize, layer: usize) -> Option<usize> {
    let first = key.start.get(row.wrapping_mul(grid.node_columns())).map(|&at| usize::from(at))?;
    Some(layer.wrapping_sub(first).wrapping_add(if row & 1 == 1 { length / 2 } else { 0 }))
}

/// A layer of the same label at a neighbouring node.
#[derive(Clone, Copy)]
struct Neighbour {
    uv: [i32; 2],
    trace: Trace,
}

/// The neighbours that are already coded: west, north, north-east, north-west, and one further west and north.
struct Neighbours {
    west: Option<Neighbour>,
    north: Option<Neighbour>,
    north_east: Option<Neighbour>,
    north_west: Option<Neighbour>,
    far_west: Option<[i32; 2]>,
    far_north: Option<[i32; 2]>,
}

impl Neighbours {
    fn new(grid: Grid, key: &Key<'_>, traces: &[Trace], place: &Place) -> Self {
        let width = grid.node_columns();
        let at = |left: usize, up: usize| {
            let inside = place.column >= left && place.row >= up;
            inside.then(|| place.node.wrapping_sub(left).wrapping_sub(up.wrapping_mul(width)))
        };
        let near = |node: Option<usize>, row: usize| {
            let layer = key.find(node?, place.label)?;
            let uv = key.uv(layer);
            let trace = traces.get(trace_index(key, grid, traces.len(), row, layer)?).copied()?;
            Some(Neighbour { uv: [uv.u(), uv.v()], trace })
        };
        let far = |node: Option<usize>| key.position(node?, place.label);
        let above = place.row.wrapping_sub(1);
        let east = (place.row > 0 && place.column.wrapping_add(1) < width).then(|| place.node.wrapping_sub(width).wrapping_add(1));
        Self {
            west: near(at(1, 0), place.row),
            north: near(at(0, 1), above),
            north_east: near(east, above),
            north_west: near(at(1, 1), above),
            far_west: far(at(2, 0)),
            far_north: far(at(0, 2)),
        }
    }

    fn all(&self) -> impl Iterator<Item = &Neighbour> {
        [&self.west, &self.north, &self.north_east, &self.north_west].into_iter().flatten()
    }
}

/// The predictors' answers.
struct Candidates {
    uv: [Option<[i32; 2]>; PREDICTORS],
    temporal: Option<[i32; 2]>,
}

fn plus(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    let ([a, b], [c, d]) = (a, b);
    [a.wrapping_add(c), b.wrapping_add(d)]
}

fn minus(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    let ([a, b], [c, d]) = (a, b);
    [a.wrapping_sub(c), b.wrapping_sub(d)]
}

/// The mean of up to four values, rounded towards minus infinity.
fn mean(values: impl Iterator<Item = [i32; 2]>) -> Option<[i32; 2]> {
    let (sum, count) = values.fold(([0, 0], 0i32), |(sum, count), value| (plus(sum, value), count.wrapping_add(1)));
    (count > 0).then(|| sum.map(|x| x.checked_div_euclid(count).unwrap_or(0)))
}

impl Candidates {
    fn new<L>(setting: &Setting<'_, '_, L>, key: &Key<'_>, around: &Neighbours, place: &Place) -> Self {
        let _ = key;
        let held = setting.before.and_then(|k| k.position(place.node, place.label));
        let older = setting.before_that.and_then(|(k, ratio)| Some((k.position(place.node, place.label)?, ratio)));
        let temporal = held.map(|held| match older {
            // Positions are below 2^16 and the ratio is Q8 below 2^14: the product fits.
            Some((older, ratio)) => plus(held, minus(held, older).map(|d| d.wrapping_mul(ratio) >> 8)),
            None => held,
        });
        let correction = |n: &Neighbour| (n.trace.temporal == 1).then(|| n.trace.correction.map(i32::from));
        let corrected = temporal.zip(mean(around.all().filter_map(correction)));
        let plane = |w: [i32; 2], n: [i32; 2], nw: [i32; 2]| minus(plus(w, n), nw);
        let corner = around.west.as_ref().zip(around.north.as_ref()).zip(around.north_west.as_ref());
        let corner_correction = corner.and_then(|((w, n), nw)| Some(plane(correction(w)?, correction(n)?, correction(nw)?)));
        let line = |near: Option<Neighbour>, far: Option<[i32; 2]>| near.zip(far).map(|(near, far)| minus(plus(near.uv, near.uv), far));
        let lines = [line(around.west, around.far_west), line(around.north, around.far_north)];
        let uv = [
            temporal,
            corrected.map(|(t, c)| plus(t, c)),
            corrected.map(|(t, c)| plus(t, c.map(|x| x >> 1))),
            temporal.zip(corner_correction).map(|(t, c)| plus(t, c)),
            corner.map(|((w, n), nw)| plane(w.uv, n.uv, nw.uv)),
            mean(lines.into_iter().flatten()),
            mean(around.all().map(|n| n.uv)),
            older.and(held),
        ];
        Self { uv, temporal }
    }

    /// The candidate that was best at the neighbours, and the class of how noisy they were.
    fn choose(&self, around: &Neighbours, record: &LabelRecord) -> ([i32; 2], usize) {
        let mut best: Option<(u32, [i32; 2])> = None;
        for (index, candidate) in self.uv.iter().enumerate() {
            let Some(candidate) = candidate else { continue };
            let error = around.all().map(|n| u32::from(n.trace.error.get(index).copied().unwrap_or(255))).fold(0u32, u32::wrapping_add);
            if best.is_none_or(|(least, _)| error < least) {
                best = Some((error, *candidate));
            }
        }
        let (noise, count) = around.all().fold((0u32, 0u32), |(sum, n), x| (sum.wrapping_add(u32::from(x.trace.noise)), n.wrapping_add(1)));
        let class = match (noise.wrapping_mul(2)).checked_div(count) {
            None => NOISE_CLASSES - 1,
            Some(twice) => [1, 2, 4, 8, 14, 26, 60].iter().take_while(|&&limit| twice >= limit).count(),
        };
        let centre = || {
            let middle = |a: u16, b: u16| i32::from(a).wrapping_add(i32::from(b)).wrapping_shl(KEY_BITS) >> 1;
            [middle(record.left, record.right), middle(record.top, record.bottom)]
        };
        (best.map_or_else(centre, |(_, uv)| uv), class)
    }

    fn trace(&self, uv: KeyUv, residual: [i32; 2], step_log2: u32) -> Trace {
        let actual = [uv.u(), uv.v()];
        let size = |d: [i32; 2]| d.iter().map(|x| x.unsigned_abs()).fold(0u32, u32::saturating_add);
        let byte = |x: u32| x.min(255) as u8;
        let error = self.uv.map(|candidate| candidate.map_or(40, |c| byte(size(minus(actual, c)) >> step_log2)));
        let correction = self.temporal.map_or([0, 0], |t| minus(actual, t)).map(|x| x.clamp(-32_768, 32_767) as i16);
        Trace { error, correction, noise: byte(size(residual)), temporal: u8::from(self.temporal.is_some()), unused: [0; 2] }
    }
}
