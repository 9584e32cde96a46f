//! One key's layers in the caller's memory, and what their coding is told: the setting they are coded in, what an encoder
//! wants to say. `nodes` walks the layers; `predict` and `field` code them; `cell` interpolates between two keys.

use crate::coder::Probability;
use crate::fixed::{KeyUv, field_distance};
use crate::grid::Grid;
use crate::lists::{Lists, Sheets};
use crate::plane::{PLANE_BYTES, View};

/// One key's layers in caller's memory, node by node, labels ascending.
#[derive(Debug, Default)]
pub struct Key<'m> {
    /// Where each node's layers start; one entry more than nodes.
    pub start: &'m mut [u16],
    /// The layers' labels.
    pub label: &'m mut [u8],
    /// The layers' positions, [`KeyUv`] each.
    pub uv: &'m mut [u32],
    /// The layers' fields, as codes (see [`field_distance`]); empty where the bundle has none. Layers that no cell tests hold zeros.
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

    /// The position of layer `index`; past the last, the least there is.
    #[must_use]
    pub fn uv(&self, index: usize) -> KeyUv {
        KeyUv(self.uv.get(index).copied().unwrap_or(0))
    }

    /// The fields of layer `index`, Q8 pixels; 0 where it has none.
    #[must_use]
    pub fn field(&self, index: usize) -> [i32; 2] {
        let [a, b] = &self.fields;
        let distance = |codes: &[i8]| codes.get(index).map_or(0, |&code| field_distance(code));
        [distance(a), distance(b)]
    }

    /// u and v of the layer of `label` at `node`, stored units.
    pub(crate) fn position(&self, node: usize, label: u8) -> Option<[i32; 2]> {
        self.find(node, label).map(|index| self.uv(index)).map(|uv| [uv.u(), uv.v()])
    }
}

/// What an encoder knows; a decoder's [`Nothing`] gives answers that are ignored.
pub trait Source {
    /// The sheets of `cell` in the interval that starts (`ahead`) or ends at the key.
    fn sheets(&mut self, ahead: bool, cell: usize) -> Sheets;

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
    /// The key before that one, and the length of the coming interval over that between the two, Q8.
    pub before_that: Option<(&'s Key<'m>, i32)>,
    /// The sheet lists of the intervals that end and start at this key.
    pub lists: [Option<&'s Lists<'m>>; 2],
    /// The planes that positions are told from, labels ascending.
    pub planes: &'s [[u8; PLANE_BYTES]],
    /// How this key sees each plane.
    pub views: &'s [View],
}

/// Where a layer stands.
pub(crate) struct Spot {
    /// The node's index, row and column.
    pub node: usize,
    pub row: usize,
    pub column: usize,
    /// The layer's label, and its index in the key.
    pub label: u8,
    pub layer: usize,
}
