//! Patches: one sheet of a cell in one key interval, with the layers it is made of, as playback makes it (FORMAT.md, Space): every layer in time
//! first, then one smooth patch in space, which bends evenly across and evenly down, by as much as the nodes around say.
//! Layers come from `sheets`; `fit`, `fields` and `order` ask here what the player will show.

use crate::sheets::{Chain, KeyGrid, Layers, bilinear};
use cubist_core::format::SPACE_CUBIC;

/// Nodes that a patch may look at: the cell's corners, and the ones before and after them on the rows and columns that they stand in; row by row,
/// two, four, four and two.
pub const NODES: usize = 12;
/// The nodes at the cell's corners: top left, top right, bottom left, bottom right.
pub const CORNERS: [usize; 4] = [3, 4, 7, 8];
/// Values of a patch: those at its corners, and what it has at its middle beyond their mean, for it bends across and for it bends down.
pub const VALUES: usize = 6;

/// Column and row of every node, counted from those before the cell's.
const PLACES: [[usize; 2]; NODES] = [[1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [3, 1], [0, 2], [1, 2], [2, 2], [3, 2], [1, 3], [2, 3]];
/// The nodes that tell how a patch bends across, and those that tell how it bends down: the first of each two neighbours.
const PAIRS: [[usize; 4]; 2] = [[2, 4, 6, 8], [0, 3, 7, 10]];

/// A pair of numbers at every node.
pub type AtNodes = [[f32; 2]; NODES];
/// A pair of numbers for every value.
pub type Values = [[f32; 2]; VALUES];

/// The weights of four nodes in a row in what the edge between the inner two gives to the middle of a patch: -1/32 of the second differences that
/// the edge takes, of which a patch has four.
fn bend(before: bool, after: bool) -> [f32; 4] {
    match (before, after) {
        (true, true) => [-1.0, 1.0, 1.0, -1.0],
        (true, false) => [-2.0, 4.0, -2.0, 0.0],
        (false, true) => [0.0, -2.0, 4.0, -2.0],
        (false, false) => [0.0; 4],
    }
    .map(|weight| weight / 32.0)
}

fn add(to: &mut [f32; 2], weight: f32, value: [f32; 2]) {
    to[0] += weight * value[0];
    to[1] += weight * value[1];
}

/// How a patch's values follow from its nodes.
#[derive(Clone, Copy, Debug)]
pub struct Stencil {
    /// The weights of the nodes of [`PAIRS`] in the last two values.
    bends: [[[f32; 2]; 4]; 2],
}

impl Stencil {
    /// The stencil of a patch that is carried at the nodes of `present`, one bit each; at the corners it always is.
    #[must_use]
    pub fn new(present: u32) -> Self {
        let at = |node: usize| present >> node & 1 == 1;
        let [[a, b, c, d], [e, f, g, h]] = [bend(at(2), at(5)), bend(at(6), at(9))];
        let [left, right] = [bend(at(0), at(10)), bend(at(1), at(11))];
        Self { bends: [[[a, b], [c, d], [e, f], [g, h]], [0, 1, 2, 3].map(|row: usize| [left[row], right[row]])] }
    }

    /// The values, given the nodes.
    #[must_use]
    pub fn values(&self, nodes: &AtNodes) -> Values {
        let bent = [0, 1].map(|way: usize| {
            let mut sums = [[0.0; 2]; 2];
            for (&pair, weights) in PAIRS[way].iter().zip(&self.bends[way]) {
                add(&mut sums[0], weights[0], nodes[pair]);
                add(&mut sums[1], weights[1], nodes[pair + 1]);
            }
            [sums[0][0] + sums[1][0], sums[0][1] + sums[1][1]]
        });
        let [a, b, c, d] = CORNERS.map(|node| nodes[node]);
        [a, b, c, d, bent[0], bent[1]]
    }

    /// The transpose of [`Stencil::values`].
    #[must_use]
    pub fn transposed(&self, values: &Values) -> AtNodes {
        let mut nodes = [[0.0; 2]; NODES];
        for (node, &value) in CORNERS.into_iter().zip(values) {
            nodes[node] = value;
        }
        for (way, &value) in values[CORNERS.len()..].iter().enumerate() {
            for (&pair, weights) in PAIRS[way].iter().zip(&self.bends[way]) {
                add(&mut nodes[pair], weights[0], value);
                add(&mut nodes[pair + 1], weights[1], value);
            }
        }
        nodes
    }
}

/// The shares of a patch's values at a position in its cell (across and down, 0..=1).
#[must_use]
pub fn shares([x, y]: [f32; 2]) -> [f32; VALUES] {
    let [a, b, c, d] = bilinear([x, y]);
    [a, b, c, d, 4.0 * x * (1.0 - x), 4.0 * y * (1.0 - y)]
}

/// The first ones of a patch's values or their shares: all of them, or those of its corners, which are all that one which does not bend has.
#[must_use]
#[inline]
pub fn first<const N: usize, T: Copy>(all: &[T; VALUES]) -> [T; N] {
    std::array::from_fn(|value| all[value])
}

/// What a patch shows where its `values` have these `shares`: all of them, or the [`first`] ones.
#[must_use]
#[inline]
pub fn value<const N: usize>(values: &[[f32; 2]; N], shares: &[f32; N]) -> [f32; 2] {
    let mut sum = [0.0; 2];
    for (&value, &share) in values.iter().zip(shares) {
        add(&mut sum, share, value);
    }
    sum
}

/// One sheet of a cell in one interval.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The layers of every node that carries the sheet.
    pub chains: [Option<Chain>; NODES],
    /// How its values follow from them.
    pub stencil: Stencil,
}

impl Patch {
    /// The patch of `label` in `cell` and `interval`, interpolated in `time` and `space`: where space is linear it looks at its corners alone.
    #[must_use]
    pub fn new(grid: &KeyGrid, layers: &Layers, [interval, cell]: [usize; 2], label: u8, [time, space]: [u8; 2]) -> Self {
        let keys = grid.keys_around(interval, time);
        let (columns, rows, nodes) = (grid.grid.node_columns(), grid.grid.node_rows(), grid.grid.nodes());
        let (column, row) = (cell % grid.grid.columns, cell / grid.grid.columns);
        let chains = std::array::from_fn(|node| {
            if space != SPACE_CUBIC && !CORNERS.contains(&node) {
                return None;
            }
            let [across, down] = PLACES[node];
            let column = (column + across).checked_sub(1).filter(|&column| column < columns)?;
            let row = (row + down).checked_sub(1).filter(|&row| row < rows)?;
            let layer = keys.map(|key| layers.find(key? * nodes + row * columns + column, label));
            // What is not carried at both ends of the interval is not there during it.
            (layer[1].is_some() && layer[2].is_some()).then_some(Chain { layer })
        });
        let present = chains.iter().enumerate().fold(0, |bits, (node, chain)| bits | u32::from(chain.is_some()) << node);
        Self { chains, stencil: Stencil::new(present) }
    }

    /// The patch's values at a moment, given all layers' positions or distances `of` and the keys' weights.
    #[must_use]
    pub fn values(&self, of: &[[f32; 2]], weights: &[[f32; 4]; 4]) -> Values {
        self.stencil.values(&self.chains.map(|chain| chain.map_or([0.0; 2], |chain| chain.value(of, weights))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All sets of nodes that may carry a patch.
    fn carried() -> impl Iterator<Item = u32> {
        let corners = CORNERS.iter().fold(0, |bits, node| bits | 1 << node);
        (0..1 << NODES).filter(move |present| present & corners == corners)
    }

    /// What `surface` is at the nodes of `present`, by their places, the cell's corners at 0 and 1; nonsense elsewhere.
    fn sampled(present: u32, surface: impl Fn(f32, f32) -> [f32; 2]) -> AtNodes {
        std::array::from_fn(|node| {
            let [x, y] = PLACES[node].map(|at| at as f32 - 1.0);
            if present >> node & 1 == 1 { surface(x, y) } else { [99.0; 2] }
        })
    }

    /// Places all over a cell, in eighths.
    fn places() -> impl Iterator<Item = [f32; 2]> {
        (0..81).map(|at| [at % 9, at / 9].map(|at| at as f32 / 8.0))
    }

    #[test]
    fn values_and_their_transpose_agree() {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 - 0.5
        };
        for present in carried() {
            let stencil = Stencil::new(present);
            let nodes: AtNodes = std::array::from_fn(|_| [random(), random()]);
            let values: Values = std::array::from_fn(|_| [random(), random()]);
            let dot = |a: &[[f32; 2]], b: &[[f32; 2]]| a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum::<f32>();
            let (one, other) = (dot(&stencil.values(&nodes), &values), dot(&nodes, &stencil.transposed(&values)));
            assert!((one - other).abs() < 1e-5, "{present:x}: {one} {other}");
        }
    }

    #[test]
    fn planes_stay_planes_whatever_is_carried() {
        let plane = |x: f32, y: f32| [3.0 + 5.0 * x - 2.0 * y, 7.0 * y - x];
        for present in carried() {
            let values = Stencil::new(present).values(&sampled(present, plane));
            for [x, y] in places() {
                assert_eq!(value(&values, &shares([x, y])), plane(x, y), "{present:x}");
            }
        }
    }

    #[test]
    fn what_bends_evenly_is_met_exactly() {
        let bent = |x: f32, y: f32| [1.0 + 2.0 * x - y + 3.0 * x * y + 4.0 * x * x - 6.0 * y * y, x * x + x * y];
        // With a node before or after every edge, or both.
        let edges = [[2, 5], [6, 9], [0, 10], [1, 11]];
        let enough = |present: &u32| edges.iter().all(|nodes| nodes.iter().any(|node| present >> node & 1 == 1));
        for present in carried().filter(enough) {
            let values = Stencil::new(present).values(&sampled(present, bent));
            for [x, y] in places() {
                assert_eq!(value(&values, &shares([x, y])), bent(x, y), "{present:x}");
            }
        }
        assert_eq!(carried().filter(enough).count(), 81);
    }

    #[test]
    fn an_edge_has_its_middle_where_four_points_say() {
        // Both edges of a surface that is the same all the way down: 9/16 of the inner two less 1/16 of the outer ones; without one of these 6/8 of
        // the node next to the other, 3/8 of the farther one, less 1/8 of the other; the mean without both.
        let line = |x: f32| [7.0, -5.0, 11.0, 64.0][(x + 1.0) as usize];
        let all = carried().last().expect("there are such");
        let (before, after) = (1 << 2 | 1 << 6, 1 << 5 | 1 << 9);
        for (left, middle) in [(0, -17.0 / 16.0), (before, -13.0 / 8.0), (after, -0.5), (before | after, 3.0)] {
            let present = all & !left;
            let values = Stencil::new(present).values(&sampled(present, |x, _| [line(x), 0.0]));
            for y in [0.0, 0.5, 1.0] {
                assert_eq!(value(&values, &shares([0.5, y])), [middle, 0.0], "{present:x}");
            }
        }
    }
}
