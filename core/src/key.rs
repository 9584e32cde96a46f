//! One key's layers in the caller's memory, and what their coding is told: the setting they are coded in, what an encoder
//! wants to say. `nodes` lays out the chains; `predict` and `field` code their layers; `row` interpolates between keys.

use crate::coder::Probability;
use crate::fixed::{KEY_MIN, KeyUv, PLAY_BITS, PlayUv, field_distance};
use crate::format::LabelRecord;
use crate::grid::Grid;
use crate::lists::{Lists, Sheets};
use crate::plane::{PLANE_BYTES, View};
use core::ops::Range;

/// No place.
pub const NONE: u16 = u16::MAX;
/// The label of the backdrop, where there is one.
pub const BACKDROP: u16 = 0;

/// Layers of one label at neighbouring nodes of a row, one at each, in caller's memory. They stand side by side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Chain {
    /// The first node, from the left of the grid.
    pub first: u16,
    /// The one after the last.
    pub end: u16,
    /// The first layer; the backdrop has none: the row's first.
    pub at: u16,
    /// Where the fields of the first layer stand; [`NONE`]: no cell tests any of the chain's layers.
    pub field: u16,
    /// The label.
    pub label: u16,
}

impl Chain {
    /// How many layers it has.
    #[must_use]
    pub const fn nodes(&self) -> u16 {
        self.end.wrapping_sub(self.first)
    }

    /// Where its layer at node `column`, which it has, stands.
    #[must_use]
    #[inline(always)]
    pub fn along(&self, column: u16) -> usize {
        self.at.wrapping_add(column.wrapping_sub(self.first)).into()
    }
}

/// One key's layers in caller's memory: row by row of nodes, in a row chain by chain, by label and from left to right.
#[derive(Debug, Default)]
pub struct Key<'m> {
    /// Where each row's chains start; one entry more than rows.
    pub row: &'m mut [u16],
    /// The chains.
    pub chain: &'m mut [Chain],
    /// The layers' positions, [`KeyUv`] each.
    pub uv: &'m mut [u32],
    /// The fields of chains that some cell tests, as codes (see [`field_distance`]); layers that none tests hold zeros.
    pub fields: [&'m mut [i8]; 2],
    /// Layers, and fields, of the rows so far.
    pub(crate) used: [usize; 2],
}

impl<'m> Key<'m> {
    /// A key in this memory: a row more than the grid has rows of nodes, as many chains, layers and tested layers as a key has at most.
    #[must_use]
    pub const fn new(row: &'m mut [u16], chain: &'m mut [Chain], uv: &'m mut [u32], fields: [&'m mut [i8]; 2]) -> Self {
        Self { row, chain, uv, fields, used: [0; 2] }
    }

    /// The chains of row `row`; none outside the grid.
    #[must_use]
    pub fn chains(&self, row: usize) -> &[Chain] {
        of_row(self.row, self.chain, row)
    }

    /// The position of layer `index`; past the last, the least there is.
    #[must_use]
    pub fn uv(&self, index: usize) -> KeyUv {
        self.uv.get(index).map_or(KeyUv::new(KEY_MIN, KEY_MIN), |&uv| KeyUv(uv))
    }

    /// The fields of the `along`-th layer of `chain`, Q8 pixels; 0 where it has none.
    #[must_use]
    pub fn field(&self, chain: &Chain, along: u16) -> [i32; 2] {
        let [a, b] = &self.fields;
        let index = usize::from(chain.field.saturating_add(along));
        let distance = |codes: &[i8]| codes.get(index).filter(|_| chain.field != NONE).map_or(0, |&code| field_distance(code));
        [distance(a), distance(b)]
    }

    /// Layers, and fields, that it holds.
    #[must_use]
    pub const fn held(&self) -> [usize; 2] {
        self.used
    }
}

/// The chains of row `row`, where `rows` start at these of the `chains`.
pub(crate) fn of_row<'k>(rows: &[u16], chains: &'k [Chain], row: usize) -> &'k [Chain] {
    let at = |row: usize| rows.get(row).map(|&at| usize::from(at));
    let range = at(row).zip(at(row.wrapping_add(1)));
    range.and_then(|(from, to)| chains.get(from..to)).unwrap_or(&[])
}

/// The layers of one label in a row, looked up from left to right.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line<'k> {
    /// The chain that is looked at, and those to come.
    chain: Chain,
    rest: &'k [Chain],
}

impl<'k> Line<'k> {
    /// What a row without chains of the label has: it ends past every node, and begins there.
    const NOTHING: Chain = Chain { first: NONE, end: NONE, at: 0, field: NONE, label: 0 };

    /// The layers of `label` among the `chains` of a row.
    #[inline(never)]
    pub fn new(chains: &'k [Chain], label: u8) -> Self {
        let from = chains.partition_point(|chain| chain.label < label.into());
        let rest = chains.get(from..).unwrap_or(&[]);
        let mut line = Self { chain: Chain { label: label.into(), ..Self::NOTHING }, rest };
        line.next();
        line
    }

    fn next(&mut self) {
        let label = self.chain.label;
        self.chain = match self.rest.split_first() {
            Some((&chain, rest)) if chain.label == label => {
                self.rest = rest;
                chain
            }
            _ => Chain { label, ..Self::NOTHING },
        };
    }

    /// How far along its chain the layer at node `column` is.
    #[inline(always)]
    fn along(&mut self, column: u16) -> Option<u16> {
        while column >= self.chain.end && self.chain.end != NONE {
            self.next();
        }
        column.checked_sub(self.chain.first)
    }

    /// The layer at node `column`, which is not to the left of the last one that was asked for.
    #[inline(always)]
    pub fn layer(&mut self, column: u16) -> Option<usize> {
        let along = self.along(column)?;
        Some(usize::from(self.chain.at).wrapping_add(usize::from(along)))
    }

    /// Likewise where its fields stand.
    #[inline(always)]
    pub fn field(&mut self, column: u16) -> Option<usize> {
        let along = self.along(column)?;
        (self.chain.field != NONE).then(|| usize::from(self.chain.field).wrapping_add(usize::from(along)))
    }

    /// The first layer at nodes of these `columns`, none of which is to the left of the last one that was asked for.
    #[inline(always)]
    pub fn first_in(&mut self, columns: Range<u16>) -> Option<usize> {
        self.along(columns.start);
        let column = columns.start.max(self.chain.first);
        if column < columns.end { self.layer(column) } else { None }
    }
}

/// What the positions of a chain are told from. A layer that this has no answer for is told from those around it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Base {
    /// The layers to the west and north.
    #[default]
    Around,
    /// Where the camera sees the plane of the label.
    Plane,
    /// The same, and how far off that was around.
    PlaneCorrected,
    /// Where the layers were in the two keys before.
    Time,
    /// The same, and how far off that was around.
    TimeCorrected,
}

impl Base {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Around, Self::Plane, Self::PlaneCorrected, Self::Time, Self::TimeCorrected];
}

/// What an encoder knows; a decoder's [`Nothing`] gives answers that are ignored.
pub trait Source {
    /// The sheets of `cell` in the interval that starts (`ahead`) or ends at the key.
    fn sheets(&mut self, ahead: bool, cell: usize) -> Sheets;

    /// What to tell the positions of a chain from; `expected` is the cheapest to say. `trial` goes through them as told from some base, asking for their
    /// residuals, and writes nothing.
    fn base(&mut self, expected: Base, trial: impl FnMut(&mut Self, Base)) -> Base;

    /// The residual to code, in steps along u and v, for the layer of `label` at `node` whose `predicted` position is in
    /// stored units. `contexts` tell what residuals cost.
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

    fn base(&mut self, expected: Base, _: impl FnMut(&mut Self, Base)) -> Base {
        expected
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
    /// Fraction bits of coordinates.
    pub key_bits: u32,
    /// Coordinates are coded in steps of 2^this of their units.
    pub step_log2: u32,
    /// The key before, unless this one is independent.
    pub before: Option<&'s Key<'m>>,
    /// The key before that one; and the length of the interval that ends at this key over that of the one before it, Q8.
    pub before_that: Option<(&'s Key<'m>, i32)>,
    /// The sheet lists of the intervals that end and start at this key.
    pub lists: [Option<&'s Lists<'m>>; 2],
    /// The planes that positions are told from, labels ascending.
    pub planes: &'s [[u8; PLANE_BYTES]],
    /// How this key sees each plane.
    pub views: &'s [View],
}

impl<L: Fn(u8) -> LabelRecord> Setting<'_, '_, L> {
    /// The first label is the backdrop.
    pub(crate) fn backdrop(&self) -> bool {
        (self.label)(BACKDROP as u8).fixed()
    }
}

/// Where the backdrop is at the node in `column` and `row` of a grid of cells of 2^`log2` pixels, rounded to stored units of `key_bits` fraction bits.
#[must_use]
// Most backdrops are one position: what others take is not worth its code twice.
#[inline(never)]
pub fn backdrop(record: &LabelRecord, [column, row]: [u16; 2], log2: u32, key_bits: u32) -> PlayUv {
    let along = |origin: u16, step: u16, index: u16| {
        // index << log2 <= 4096 + 32 pixels, step < 2^16 of 1/16384 texel: the product fits 2^29.
        let offset = i32::from(index).wrapping_shl(log2).wrapping_mul(i32::from(step)) >> 14u32.wrapping_sub(key_bits);
        i32::from(origin).wrapping_add(offset)
    };
    let uv = KeyUv::new(along(record.origin_u, record.step_u, column), along(record.origin_v, record.step_v, row));
    let play = |x: i32| x.wrapping_shl(PLAY_BITS.wrapping_sub(key_bits));
    PlayUv { u: play(uv.u()), v: play(uv.v()) }
}
