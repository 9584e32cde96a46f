//! Patches: one sheet of a cell in one key interval, with the layers it is interpolated from, as playback does it: every layer in time
//! first, then the cell's edges and its middles in space, then straight lines between those.
//! Layers come from `sheets`; `fit`, `fields` and `order` ask here what the player will show.

use crate::sheets::{Chain, KeyGrid, Layers};
use cubist_core::format::SPACE_CUBIC;

/// Nodes that a patch may look at: four rows of four, the cell's corners in the middle.
pub const NODES: usize = 16;
/// The nodes at the cell's corners: top left, top right, bottom left, bottom right.
pub const CORNERS: [usize; 4] = [5, 6, 9, 10];
/// Points of a patch: three rows of three, the cell's corners, the middles of its edges and its own.
pub const POINTS: usize = 9;

/// The weights of four values in a row in the one halfway between the inner two (`cubist_core::fixed::middle`).
fn halfway(before: bool, after: bool) -> [f32; 4] {
    match (before, after) {
        (true, true) => [-0.0625, 0.5625, 0.5625, -0.0625],
        (true, false) => [-0.125, 0.75, 0.375, 0.0],
        (false, true) => [0.0, 0.375, 0.75, -0.125],
        (false, false) => [0.0, 0.5, 0.5, 0.0],
    }
}

/// How a patch's points follow from its nodes.
#[derive(Clone, Copy, Debug)]
pub struct Stencil {
    /// For every column of nodes, the weights of its rows in the value halfway down the cell; none where there is no such value.
    down: [[f32; 4]; 4],
    /// For the cell's upper edge, halfway down, and its lower edge, the weights of the columns in the value halfway across.
    across: [[f32; 4]; 3],
}

/// A pair of values at every node.
pub type AtNodes = [[f32; 2]; NODES];
/// A pair of values at every point.
pub type AtPoints = [[f32; 2]; POINTS];

fn add(to: &mut [f32; 2], weight: f32, value: [f32; 2]) {
    to[0] += weight * value[0];
    to[1] += weight * value[1];
}

impl Stencil {
    /// The stencil of a patch that is carried at the nodes of `present`, one bit each.
    #[must_use]
    pub fn new(present: u32) -> Self {
        let at = |row: usize, column: usize| present >> (4 * row + column) & 1 == 1;
        let inside = |column: usize| at(1, column) && at(2, column);
        let down = std::array::from_fn(|column| if inside(column) { halfway(at(0, column), at(3, column)) } else { [0.0; 4] });
        let across = [halfway(at(1, 0), at(1, 3)), halfway(inside(0), inside(3)), halfway(at(2, 0), at(2, 3))];
        Self { down, across }
    }

    /// The points, given the nodes.
    #[must_use]
    pub fn points(&self, nodes: &AtNodes) -> AtPoints {
        let mut between = [[0.0; 2]; 4];
        for (column, sum) in between.iter_mut().enumerate() {
            for row in 0..4 {
                add(sum, self.down[column][row], nodes[4 * row + column]);
            }
        }
        let rows = [[nodes[4], nodes[5], nodes[6], nodes[7]], between, [nodes[8], nodes[9], nodes[10], nodes[11]]];
        let mut points = [[0.0; 2]; POINTS];
        for (row, values) in rows.iter().enumerate() {
            points[3 * row] = values[1];
            points[3 * row + 2] = values[2];
            for (&weight, &value) in self.across[row].iter().zip(values) {
                add(&mut points[3 * row + 1], weight, value);
            }
        }
        points
    }

    /// The transpose of [`Stencil::points`].
    #[must_use]
    pub fn transposed(&self, points: &AtPoints) -> AtNodes {
        let mut nodes = [[0.0; 2]; NODES];
        let mut between = [[0.0; 2]; 4];
        for row in 0..3 {
            let mut values = [[0.0; 2], points[3 * row], points[3 * row + 2], [0.0; 2]];
            for (value, &weight) in values.iter_mut().zip(&self.across[row]) {
                add(value, weight, points[3 * row + 1]);
            }
            if row == 1 {
                between = values;
            } else {
                nodes[2 * row + 4..2 * row + 8].copy_from_slice(&values);
            }
        }
        for (column, &value) in between.iter().enumerate() {
            for row in 0..4 {
                add(&mut nodes[4 * row + column], self.down[column][row], value);
            }
        }
        nodes
    }
}

/// The points around a position in a cell (across and down, 0..1), and their weights.
#[must_use]
pub fn around([x, y]: [f32; 2]) -> ([usize; 4], [f32; 4]) {
    let (right, lower) = (usize::from(x >= 0.5), usize::from(y >= 0.5));
    let first = 3 * lower + right;
    let weights = crate::sheets::bilinear([2.0 * x - right as f32, 2.0 * y - lower as f32]);
    ([first, first + 1, first + 3, first + 4], weights)
}

/// One sheet of a cell in one interval.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The layers of every node that carries the sheet.
    pub chains: [Option<Chain>; NODES],
    /// How its points follow from them.
    pub stencil: Stencil,
}

impl Patch {
    /// The patch of `label` in `cell` and `interval`, interpolated in `time` and `space`.
    #[must_use]
    pub fn new(grid: &KeyGrid, layers: &Layers, [interval, cell]: [usize; 2], label: u8, [time, space]: [u8; 2]) -> Self {
        let keys = grid.keys_around(interval, time);
        let (columns, rows, nodes) = (grid.grid.node_columns(), grid.grid.node_rows(), grid.grid.nodes());
        let (column, row) = (cell % grid.grid.columns, cell / grid.grid.columns);
        let chains = std::array::from_fn(|node| {
            if space != SPACE_CUBIC && !CORNERS.contains(&node) {
                return None;
            }
            let column = (column + node % 4).checked_sub(1).filter(|&column| column < columns)?;
            let row = (row + node / 4).checked_sub(1).filter(|&row| row < rows)?;
            let layer = keys.map(|key| layers.find(key? * nodes + row * columns + column, label));
            // What is not carried at both ends of the interval is not there during it.
            (layer[1].is_some() && layer[2].is_some()).then_some(Chain { layer })
        });
        let present = chains.iter().enumerate().fold(0, |bits, (node, chain)| bits | u32::from(chain.is_some()) << node);
        Self { chains, stencil: Stencil::new(present) }
    }

    /// The patch's points at a moment, given all layers' `values` and the keys' weights.
    #[must_use]
    pub fn points(&self, values: &[[f32; 2]], weights: &[[f32; 4]; 4]) -> AtPoints {
        self.stencil.points(&self.chains.map(|chain| chain.map_or([0.0; 2], |chain| chain.value(values, weights))))
    }
}

/// The value at a position in a cell, given the patch's points.
#[must_use]
pub fn value(points: &AtPoints, (corners, weights): ([usize; 4], [f32; 4])) -> [f32; 2] {
    let mut sum = [0.0; 2];
    for (corner, weight) in corners.into_iter().zip(weights) {
        add(&mut sum, weight, points[corner]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_their_transpose_agree() {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 - 0.5
        };
        for outer in [0u32, 0xffff, 0x1234, 0x9a51, 0x0f00] {
            let stencil = Stencil::new(outer | CORNERS.iter().fold(0, |bits, node| bits | 1 << node));
            let nodes: AtNodes = std::array::from_fn(|_| [random(), random()]);
            let points: AtPoints = std::array::from_fn(|_| [random(), random()]);
            let dot = |a: &[[f32; 2]], b: &[[f32; 2]]| a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum::<f32>();
            let (one, other) = (dot(&stencil.points(&nodes), &points), dot(&nodes, &stencil.transposed(&points)));
            assert!((one - other).abs() < 1e-5, "{outer:x}: {one} {other}");
        }
    }

    #[test]
    fn planes_stay_planes_whatever_is_carried() {
        let nodes: AtNodes = std::array::from_fn(|node| [(node % 4) as f32, (node / 4) as f32]);
        for outer in 0..1u32 << 16 {
            let present = outer | CORNERS.iter().fold(0, |bits, node| bits | 1 << node);
            let carried: AtNodes = std::array::from_fn(|node| if present >> node & 1 == 1 { nodes[node] } else { [99.0; 2] });
            let points = Stencil::new(present).points(&carried);
            for (point, value) in points.iter().enumerate() {
                let exact = [1.0 + 0.5 * (point % 3) as f32, 1.0 + 0.5 * (point / 3) as f32];
                assert_eq!(*value, exact, "{present:x}");
            }
        }
    }
}
