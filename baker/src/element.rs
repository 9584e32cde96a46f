//! Elements: what one sheet in one cell and interval asks of its layers, as the normal equations of a least-squares fit, in factors: from layers
//! to a patch's values, and from those to pixels. `fit` sums up the pixels; its conjugate gradients take their products from here.
//!
//! This is where baking spends its time. Keys are mixed as patches' values, of which there are half as many as nodes: once an interval the values of
//! every key, once a frame their mean, and back.

use crate::patch::{self, AtNodes, CORNERS, NODES, Patch, Stencil, Values};

/// Weight of the second differences inside a cell, per pixel: keeps sheets that few pixels pin down flat.
const TWIST: f32 = 1e-4;
/// Weight of the first differences, per pixel: only what nothing else decides.
const GRADIENT: f32 = 1e-7;

/// A layer that is not there: there are fewer.
pub const NOWHERE: u32 = u32::MAX;

/// The weights of the keys at a moment, by which of the outer two are missing ([`crate::sheets::KeyGrid::weights`]).
pub type Weights = [[f32; 4]; 4];

/// A key of nodes whose keys weigh the same.
struct Way {
    /// The set of weights.
    set: u8,
    /// Which of the four keys.
    key: u8,
    /// The layer of every node, [`NOWHERE`] where it has none, or other weights.
    layer: [u32; NODES],
}

/// Ways of an element at most.
const MOST_WAYS: usize = 16;
/// Ways of most elements: all nodes' keys weigh the same.
const USUAL_WAYS: usize = 4;

/// What one sheet in one cell and interval asks of its layers, where its patch has `N` values: [`patch::VALUES`](crate::patch::VALUES), or those at its
/// corners alone where it cannot bend.
pub struct Element<const N: usize> {
    /// The layers of every node's four keys, [`NOWHERE`] where there is none.
    pub layer: [[u32; 4]; NODES],
    /// The interval.
    pub interval: u32,
    /// For every node the set of weights its keys have in time.
    set: [u8; NODES],
    /// The keys that weigh anything, by the sets that nodes have.
    ways: Vec<Way>,
    stencil: Stencil,
    /// Pixels of the cell and interval.
    volume: f32,
    /// None: outlines are asked for by torn cells alone.
    pixels: Option<Pixels<N>>,
}

/// The pixels that an element is fitted to.
enum Pixels<const N: usize> {
    /// The same ones in every frame, and all nodes' keys weigh the same: the products of the keys' weights, summed over the frames.
    Same(Sums<N>, [[f32; 4]; 4]),
    /// Those of each frame.
    Each(Vec<Sums<N>>),
}

/// The products of a patch's shares, summed over pixels: a symmetric matrix, all of it, for half of it takes longer to multiply.
#[derive(Clone, Copy, PartialEq)]
pub struct Sums<const N: usize>([[f32; N]; N]);

impl<const N: usize> Default for Sums<N> {
    fn default() -> Self {
        Self([[0.0; N]; N])
    }
}

impl<const N: usize> Sums<N> {
    /// Adds a pixel with these shares and this weight.
    #[inline]
    pub fn add(&mut self, shares: &[f32; N], weight: f32) {
        for (column, share) in self.0.iter_mut().zip(shares) {
            let weight = weight * share;
            for (sum, share) in column.iter_mut().zip(shares) {
                *sum += weight * share;
            }
        }
    }

    /// The product with a patch's values.
    #[inline]
    fn times(&self, values: &[[f32; 2]; N]) -> [[f32; 2]; N] {
        let mut out = [[0.0; 2]; N];
        for (column, [u, v]) in self.0.iter().zip(values) {
            for (out, sum) in out.iter_mut().zip(column) {
                out[0] += sum * u;
                out[1] += sum * v;
            }
        }
        out
    }

    /// What the pixels' values are in all, squared, where a patch's values are `values`.
    #[must_use]
    pub fn square(&self, values: &[f32; N]) -> f32 {
        let row = |column: &[f32; N]| column.iter().zip(values).map(|(sum, value)| sum * value).sum::<f32>();
        self.0.iter().zip(values).map(|(column, value)| value * row(column)).sum()
    }
}

/// `to` plus `weight` times `values`.
#[inline]
fn add<const N: usize>(to: &mut [[f32; 2]; N], weight: f32, values: &[[f32; 2]; N]) {
    for (to, value) in to.iter_mut().zip(values) {
        to[0] += weight * value[0];
        to[1] += weight * value[1];
    }
}

impl<const N: usize> Element<N> {
    /// What `patch` asks in an interval where its cell has `volume` pixels, before any of them is known.
    #[must_use]
    pub fn new(patch: &Patch, interval: usize, volume: f32) -> Self {
        let layer = patch.chains.map(|chain| chain.map_or([NOWHERE; 4], |chain| chain.layer.map(|at| at.map_or(NOWHERE, |at| at as u32))));
        let set = patch.chains.map(|chain| chain.map_or(0, |chain| chain.set() as u8));
        let carried = |set: usize| patch.chains.iter().flatten().find(move |chain| chain.set() == set);
        let ways = (0..4).filter_map(|set| Some((set, carried(set)?.layer)));
        let ways = ways.flat_map(|(set, keys)| (0..4).filter(move |&key| keys[key].is_some()).map(move |key| (set as u8, key)));
        let at = |node: usize, of: u8, key: usize| if set[node] == of { layer[node][key] } else { NOWHERE };
        let way = |(set, key): (u8, usize)| Way { set, key: key as u8, layer: std::array::from_fn(|node| at(node, set, key)) };
        let ways = ways.map(way).collect();
        Self { layer, interval: interval as u32, set, ways, stencil: patch.stencil, volume, pixels: None }
    }

    /// What a weight of one at every node alone gives to the patch's values.
    #[must_use]
    pub fn shares(&self) -> [[f32; N]; NODES] {
        std::array::from_fn(|node| {
            let mut one = [[0.0; 2]; NODES];
            one[node][0] = 1.0;
            self.values(&one).map(|value| value[0])
        })
    }

    /// The patch's values, given its nodes.
    #[inline]
    fn values(&self, nodes: &AtNodes) -> [[f32; 2]; N] {
        if N == CORNERS.len() { std::array::from_fn(|corner| nodes[CORNERS[corner]]) } else { patch::first(&self.stencil.values(nodes)) }
    }

    /// What sums over pixels times shares in the patch's values come to at its nodes.
    #[must_use]
    #[inline]
    pub fn at_nodes(&self, values: &[[f32; 2]; N]) -> AtNodes {
        let mut all = Values::default();
        all[..N].copy_from_slice(values);
        self.stencil.transposed(&all)
    }

    /// The weights of a node's keys.
    #[must_use]
    pub fn weights(&self, node: usize, weights: &Weights) -> [f32; 4] {
        weights[usize::from(self.set[node])]
    }

    /// Keeps the sums of every frame, in the smallest form; `frames` tells the keys' weights in each.
    pub fn fill(&mut self, sums: Vec<Sums<N>>, frames: &[Weights]) {
        let first = self.ways.first().map_or(0, |way| way.set);
        let alike = self.ways.iter().all(|way| way.set == first) && sums.windows(2).all(|pair| pair[0] == pair[1]);
        self.pixels = match sums.first() {
            _ if sums.iter().all(|&sums| sums == Sums::default()) => None,
            Some(&same) if alike => {
                let mut products = [[0.0; 4]; 4];
                for weights in frames.iter().map(|weights| weights[usize::from(first)]) {
                    for (row, a) in products.iter_mut().zip(weights) {
                        for (entry, b) in row.iter_mut().zip(weights) {
                            *entry += a * b;
                        }
                    }
                }
                Some(Pixels::Same(same, products))
            }
            _ => Some(Pixels::Each(sums)),
        };
    }

    /// Adds the element's share of the product A x to `y`, given the keys' weights in every frame of its interval.
    pub fn multiply(&self, weights: &[Weights], x: &[[f32; 2]], y: &mut [[f64; 2]]) {
        match &self.pixels {
            None => (),
            Some(pixels) if self.ways.len() <= USUAL_WAYS => self.multiply_pixels::<USUAL_WAYS>(pixels, weights, x, y),
            Some(pixels) => self.multiply_pixels::<MOST_WAYS>(pixels, weights, x, y),
        }
        let corner = |bits: usize| self.layer[CORNERS[bits & 3]][1 + (bits >> 2)];
        let held = regularised(self.volume, &std::array::from_fn(|bits| value(x, corner(bits))));
        held.into_iter().enumerate().for_each(|(bits, value)| give(y, corner(bits), value));
    }

    /// Adds the share of its pixels, where it has at most `W` ways.
    #[inline]
    fn multiply_pixels<const W: usize>(&self, pixels: &Pixels<N>, weights: &[Weights], x: &[[f32; 2]], y: &mut [[f64; 2]]) {
        let (mut values, mut back) = ([[[0.0; 2]; N]; W], [[[0.0; 2]; N]; W]);
        for (values, way) in values.iter_mut().zip(&self.ways) {
            *values = self.values(&way.layer.map(|layer| value(x, layer)));
        }
        match pixels {
            Pixels::Same(sums, products) => {
                for (back, to) in back.iter_mut().zip(&self.ways) {
                    let mut mixed = [[0.0; 2]; N];
                    for (values, from) in values.iter().zip(&self.ways) {
                        add(&mut mixed, products[usize::from(to.key)][usize::from(from.key)], values);
                    }
                    *back = sums.times(&mixed);
                }
            }
            Pixels::Each(frames) => {
                for (sums, weights) in frames.iter().zip(weights) {
                    let weight = |way: &Way| weights[usize::from(way.set)][usize::from(way.key)];
                    let mut now = [[0.0; 2]; N];
                    for (values, way) in values.iter().zip(&self.ways) {
                        add(&mut now, weight(way), values);
                    }
                    let product = sums.times(&now);
                    for (back, way) in back.iter_mut().zip(&self.ways) {
                        add(back, weight(way), &product);
                    }
                }
            }
        }
        for (back, way) in back.iter().zip(&self.ways) {
            if N == CORNERS.len() {
                CORNERS.iter().zip(back).for_each(|(&node, &value)| give(y, way.layer[node], value));
            } else {
                self.at_nodes(back).into_iter().zip(way.layer).for_each(|(value, layer)| give(y, layer, value));
            }
        }
    }
}

/// What `x` has of a layer; zeros where there is none.
#[inline]
fn value(x: &[[f32; 2]], layer: u32) -> [f32; 2] {
    x.get(layer as usize).copied().unwrap_or_default()
}

/// Adds to what `y` has of a layer, if there is one.
#[inline]
fn give(y: &mut [[f64; 2]], layer: u32, [u, v]: [f32; 2]) {
    if let Some(y) = y.get_mut(layer as usize) {
        *y = [y[0] + f64::from(u), y[1] + f64::from(v)];
    }
}

/// The diagonal of the regulariser of an element of `volume` pixels, at each of its corners at both ends of the interval.
#[must_use]
pub fn regulariser_diagonal(volume: f32) -> f32 {
    let weight = |difference: usize| if difference.count_ones() >= 2 { TWIST } else { GRADIENT };
    (1..8).map(|difference| volume * weight(difference) / 8.0).sum()
}

/// The product of the regulariser with the values at a cell's corners at both ends of the interval (bits: across, down, in time):
/// squared differences of order one to three.
fn regularised(volume: f32, values: &[[f32; 2]; 8]) -> [[f32; 2]; 8] {
    // The Walsh-Hadamard transform takes all differences at once, and back.
    let transform = |mut values: [[f32; 2]; 8]| {
        for bit in [1, 2, 4] {
            for low in (0..8).filter(|at| at & bit == 0) {
                let ([a, b], [c, d]) = (values[low], values[low | bit]);
                (values[low], values[low | bit]) = ([a + c, b + d], [a - c, b - d]);
            }
        }
        values
    };
    let mut differences = transform(*values);
    for (difference, value) in differences.iter_mut().enumerate() {
        let weight = match difference.count_ones() {
            0 => 0.0,
            1 => GRADIENT,
            _ => TWIST,
        };
        *value = value.map(|x| x * volume * weight / 8.0);
    }
    transform(differences)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gbuffer::GBuffer;
    use crate::patch::VALUES;
    use crate::sheets::{self, KeyGrid, Layers};
    use cubist_core::format::{SPACE_CUBIC, SPACE_LINEAR, TIME_CUBIC, TIME_LINEAR};

    /// Numbers from -1/2 to 1/2.
    struct Random(u32);

    impl Random {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.0 >> 8) as f32 / 16_777_216.0 - 0.5
        }
    }

    #[test]
    fn products_are_sums_over_pixels() {
        // Five by three cells of 4 pixels, in keys every three frames a diagonal edge that moves: labels are carried here at all keys, there at some.
        let (width, height, frames) = (20, 12, 13);
        let label = |at: u32| u16::from(at % width + at / width % height > 2 * (at / (width * height)));
        let labels: Vec<u16> = (0..width * height * frames).map(label).collect();
        let gbuffer = GBuffer { width, height, frames, uv: vec![[0.0; 2]; labels.len()].into(), label: labels };
        let mut random = Random(1);
        let (mut same, mut each, mut mixed) = (0, 0, 0);
        for ways @ [time, _] in [[TIME_CUBIC, SPACE_CUBIC], [TIME_CUBIC, SPACE_LINEAR], [TIME_LINEAR, SPACE_CUBIC]] {
            let grid = KeyGrid::new(&gbuffer, 2, 3, false, ways);
            let found = sheets::find(&gbuffer, &grid, 1);
            let layers = Layers::of(&grid, &found);
            for (index, list) in found.lists.iter().enumerate() {
                let place = [index / grid.grid.cells(), index % grid.grid.cells()];
                let weights: Vec<Weights> = grid.frames_of(place[0]).map(|frame| grid.weights(place[0], frame, time)).collect();
                for (&label, varied) in list.iter().flat_map(|label| [(label, false), (label, true)]) {
                    let patch = Patch::new(&grid, &layers, place, label, ways);
                    let mut element = Element::<VALUES>::new(&patch, place[0], 0.0);
                    let [x, y] = [0; 2].map(|_| layers.label.iter().map(|_| [random.next(), random.next()]).collect::<Vec<[f32; 2]>>());
                    let (mut sums, mut exact) = (Vec::new(), [0.0f64; 2]);
                    for (frame, weights) in grid.frames_of(place[0]).zip(&weights) {
                        let values = [&x, &y].map(|of| patch.values(of, weights));
                        let (mut of_frame, mut pixels) = (Sums::default(), 0);
                        grid.each_pixel(frame, place[1], |_, at| {
                            pixels += 1;
                            let weight = if varied { 0.5 + random.next() } else { (pixels % 5) as f32 };
                            let shares = patch::shares(at);
                            of_frame.add(&shares, weight);
                            let [a, b] = values.map(|values| patch::value(&values, &shares));
                            (0..2).for_each(|axis| exact[axis] += f64::from(weight * a[axis] * b[axis]));
                        });
                        sums.push(of_frame);
                    }
                    element.fill(sums, &weights);
                    let mut product = vec![[0.0; 2]; x.len()];
                    element.multiply(&weights, &x, &mut product);
                    for axis in 0..2 {
                        let found: f64 = product.iter().zip(&y).map(|(a, b)| a[axis] * f64::from(b[axis])).sum();
                        assert!((found - exact[axis]).abs() < 1e-4, "{place:?}, {label}: {found}, exactly {}", exact[axis]);
                    }
                    let kind = if matches!(element.pixels, Some(Pixels::Same(..))) { &mut same } else { &mut each };
                    *kind += 1;
                    mixed += u32::from(element.ways.iter().any(|way| way.set != element.ways[0].set));
                }
            }
        }
        assert!(same > 50 && each > 50 && mixed > 20, "all kinds belong to the test: {same}, {each}, {mixed}");
    }

    #[test]
    fn squares_are_what_products_say() {
        let (mut random, mut sums) = (Random(2), Sums::default());
        for _ in 0..40 {
            sums.add(&patch::shares([0.5 + random.next(), 0.5 + random.next()]), 1.0);
        }
        for _ in 0..40 {
            let values: [f32; VALUES] = std::array::from_fn(|_| random.next());
            let product = sums.times(&values.map(|value| [value, 0.0]));
            let expected: f32 = product.iter().zip(values).map(|(product, value)| product[0] * value).sum();
            assert!((sums.square(&values) - expected).abs() < 1e-4, "{} {expected}", sums.square(&values));
        }
    }

    #[test]
    fn the_regulariser_is_no_force_on_what_does_not_change() {
        assert_eq!(regularised(64.0, &[[3.0, -5.0]; 8]), [[0.0; 2]; 8]);
        for corner in 0..8 {
            let mut one = [[0.0; 2]; 8];
            one[corner][0] = 1.0;
            let found = regularised(64.0, &one)[corner][0];
            assert!((found / regulariser_diagonal(64.0) - 1.0).abs() < 1e-5, "corner {corner}: {found}");
        }
    }
}
