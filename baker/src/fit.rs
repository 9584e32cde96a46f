//! The fit: positions of all layers such that what playback interpolates comes closest, in the least-squares
//! sense, to the G-buffer. Sheets come from `sheets`; positions go to `encode`.
//!
//! Fitting costs no bytes and gains 2-3 dB over storing what the key rays hit. It also gives ghosts their
//! positions: those that continue the visible part of their sheet best.

use crate::gbuffer::GBuffer;
use crate::patch::{self, AtNodes, AtPoints, CORNERS, NODES, POINTS, Patch, Stencil};
use crate::sheets::{KeyGrid, Layers, Sheets};
use rayon::prelude::*;

/// Weight of the second differences inside a cell, per pixel: keeps sheets that few pixels pin down flat.
const TWIST: f32 = 1e-4;
/// Weight of the first differences, per pixel: only what nothing else decides.
const GRADIENT: f32 = 1e-7;
/// Conjugate gradient steps. Cells are small and overlap: 50 steps settle below 1/64 texel, half a step of what is stored.
const STEPS: usize = 60;
/// Products are summed in this many runs of elements, whatever the number of threads.
const RUNS: usize = 8;

/// How much a layer's place on its plane counts, in pixels: it costs no bytes to be there, and where few pixels see a layer nothing else
/// tells where it should be.
const PRIOR: f64 = 0.5;

/// A pixel this far off in the fit before, texels, counts half: it shows the wrong texel by now, and no worse where it is farther off, which
/// it is where surfaces are seen at grazing angles or bend inside a cell. (Iteratively reweighted least squares, Cauchy's weights.)
const ROBUST: f32 = 1.0;
/// Fits with such weights after the first.
const REFITS: usize = 2;
/// Steps of each: they start near where they end.
const REFIT_STEPS: usize = 25;

/// A layer that is not there.
const NOWHERE: u32 = u32::MAX;

/// What one sheet in one cell and interval asks of its layers: the normal equations, in factors.
struct Element {
    /// The layers of every node's four keys, [`NOWHERE`] where there is none.
    layer: [[u32; 4]; NODES],
    /// For every node the set of weights its keys have in time.
    set: [u8; NODES],
    stencil: Stencil,
    interval: u32,
    /// Pixels of the cell and interval.
    volume: f32,
    pixels: Pixels,
}

/// The pixels that an element is fitted to.
enum Pixels {
    /// The same ones in every frame, and all nodes' keys weigh the same: the squares of the keys' weights, summed over the frames.
    Same(Sums, [[f32; 4]; 4]),
    /// Those of each frame.
    Each(Vec<Sums>),
}

/// The products of the four points' weights, summed over pixels, for every quarter of a cell in one frame: the upper half of a symmetric
/// matrix, row by row.
#[derive(Clone, Copy, Default, PartialEq)]
struct Sums([[f32; 10]; 4]);

impl Sums {
    fn add(&mut self, quarter: usize, weights: [f32; 4], weight: f32) {
        let sums = &mut self.0[quarter];
        let mut at = 0;
        for a in 0..4 {
            for b in a..4 {
                sums[at] += weight * weights[a] * weights[b];
                at += 1;
            }
        }
    }

    /// The product with the points' values.
    fn times(&self, points: &AtPoints) -> AtPoints {
        let mut out = [[0.0; 2]; POINTS];
        for (quarter, m) in self.0.iter().enumerate() {
            let first = quarter / 2 * 3 + quarter % 2;
            let at = [first, first + 1, first + 3, first + 4];
            let [a, b, c, d] = at.map(|point| points[point]);
            for axis in 0..2 {
                let (a, b, c, d) = (a[axis], b[axis], c[axis], d[axis]);
                out[at[0]][axis] += m[0] * a + m[1] * b + m[2] * c + m[3] * d;
                out[at[1]][axis] += m[1] * a + m[4] * b + m[5] * c + m[6] * d;
                out[at[2]][axis] += m[2] * a + m[5] * b + m[7] * c + m[8] * d;
                out[at[3]][axis] += m[3] * a + m[6] * b + m[8] * c + m[9] * d;
            }
        }
        out
    }
}

/// Where a layer is known to be, texels, and how sure that is, 0..=1; `None` where nothing is known.
pub type Prior = Option<([f32; 2], f32)>;

/// What a sheet asks of a pixel: a value there and its weight; `None`: it does not care.
pub type Target = Option<([f32; 2], f32)>;

/// The target and weight of a pixel, given the value it has, its own target and its weight.
pub type Refit = fn([f32; 2], [f32; 2], f32) -> ([f32; 2], f32);

/// What one fit is about.
pub struct Problem<'a, T> {
    /// The grid.
    pub grid: &'a KeyGrid,
    /// The sheets to fit.
    pub sheets: &'a Sheets,
    /// The layers they share.
    pub layers: &'a Layers,
    /// How layers are interpolated in time.
    pub time: u8,
    /// How they are interpolated in space.
    pub space: u8,
    /// What layers are held to where pixels say little: a position for each; `None`: nothing.
    pub prior: Option<&'a [Prior]>,
    /// Values that a fit has already: pixels that are far from them count less. `None`: all count the same.
    pub known: Option<&'a [[f32; 2]]>,
    /// What a fit after the first asks of a pixel.
    pub refit: Refit,
    /// Writes what the sheets in the list of a cell (interval times cells plus cell) ask of its pixels in a frame: for every pixel, in the order of
    /// [`KeyGrid::each_pixel`], all sheets. Nothing where no sheet asks anything.
    pub targets: T,
}

/// Fitted positions.
#[derive(Clone, Debug)]
pub struct Fit {
    /// u and v of every layer, texels.
    pub uv: Vec<[f32; 2]>,
    /// How much every layer matters: squared texels of error, summed over pixels, for a squared texel of its own.
    pub weight: Vec<f32>,
}

/// Fits the positions of all layers.
#[must_use]
pub fn solve(gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers, prior: &[Prior]) -> Fit {
    let targets = |index: usize, frame: u32, targets: &mut Vec<Target>| {
        grid.each_pixel(frame, index % grid.grid.cells(), |pixel, _| {
            let own = |&label: &u8| (gbuffer.label[pixel] == u16::from(label)).then(|| (gbuffer.uv[pixel], 1.0));
            targets.extend(sheets.lists[index].iter().map(own));
        });
    };
    let problem =
        Problem { grid, sheets, layers, time: grid.time, space: grid.space, prior: Some(prior), known: None, refit: robust, targets };
    let mut fit = solve_for(&problem);
    for _ in 0..REFITS {
        fit = solve_for(&Problem { known: Some(&fit.uv), targets, ..problem });
    }
    fit
}

/// Cauchy's weights: see [`ROBUST`].
fn robust([a, b]: [f32; 2], [u, v]: [f32; 2], weight: f32) -> ([f32; 2], f32) {
    ([u, v], weight / (1.0 + ((a - u) * (a - u) + (b - v) * (b - v)) / (ROBUST * ROBUST)))
}

/// Fits two quantities of all layers to the targets of `problem`.
#[must_use]
pub fn solve_for<T>(problem: &Problem<'_, T>) -> Fit
where
    T: Fn(usize, u32, &mut Vec<Target>) + Sync,
{
    let System { elements, mut right, mut diagonal, mut start } = assemble(problem);
    if let Some(known) = problem.known {
        start = known.iter().map(|uv| uv.map(f64::from)).collect();
    }
    let weights = Weights::new(problem);
    let mut held = vec![0.0f64; right.len()];
    for (layer, prior) in problem.prior.into_iter().flatten().enumerate() {
        if let Some((prior, sure)) = prior {
            let weight = PRIOR * f64::from(*sure);
            held[layer] = weight;
            diagonal[layer] += weight;
            for (right, prior) in right[layer].iter_mut().zip(prior) {
                *right += weight * f64::from(*prior);
            }
        }
    }
    let product = |x: &[[f64; 2]], y: &mut [[f64; 2]]| {
        multiply(&elements, &weights, x, y);
        for ((y, x), held) in y.iter_mut().zip(x).zip(&held) {
            y[0] += held * x[0];
            y[1] += held * x[1];
        }
    };
    let steps = if problem.known.is_some() { REFIT_STEPS } else { STEPS };
    let uv = conjugate_gradients(&product, &right, &diagonal, start, steps);
    Fit { uv: uv.iter().map(|uv| uv.map(|x| x as f32)).collect(), weight: diagonal.iter().map(|&d| d as f32).collect() }
}

/// The weights of the keys at every frame.
struct Weights(Vec<Vec<[[f32; 4]; 4]>>);

impl Weights {
    fn new<T>(problem: &Problem<'_, T>) -> Self {
        let grid = problem.grid;
        let of = |interval| grid.frames_of(interval).map(|frame| grid.weights(interval, frame, problem.time)).collect();
        Self((0..grid.intervals()).map(of).collect())
    }
}

/// What is to be solved.
struct System {
    elements: Vec<Element>,
    right: Vec<[f64; 2]>,
    diagonal: Vec<f64>,
    /// Every layer at the mean of its sheets' targets, to start from.
    start: Vec<[f64; 2]>,
}

/// An element with its right-hand side.
struct Assembled {
    element: Element,
    right: [[[f32; 2]; 4]; NODES],
    diagonal: [[f32; 4]; NODES],
    /// Sum of the weights and weighted targets of its pixels.
    seen: [f64; 3],
}

fn assemble<T>(problem: &Problem<'_, T>) -> System
where
    T: Fn(usize, u32, &mut Vec<Target>) + Sync,
{
    let cells = problem.grid.grid.cells();
    let layers = problem.layers.label.len();
    let mut system = System { elements: Vec::new(), right: vec![[0.0; 2]; layers], diagonal: vec![1e-9; layers], start: Vec::new() };
    let mut means = vec![[0.0f64; 3]; layers];
    // An interval at a time: right-hand sides are large.
    for lists in (0..problem.sheets.lists.len()).step_by(cells) {
        let assembled: Vec<Vec<Assembled>> = (lists..lists + cells).into_par_iter().map(|index| assemble_cell(problem, index)).collect();
        for Assembled { element, right, diagonal, seen } in assembled.into_iter().flatten() {
            for (layers, (right, diagonal)) in element.layer.iter().zip(right.iter().zip(&diagonal)) {
                for (&layer, (right, diagonal)) in layers.iter().zip(right.iter().zip(diagonal)).filter(|&(&layer, _)| layer != NOWHERE) {
                    let layer = layer as usize;
                    system.diagonal[layer] += f64::from(*diagonal);
                    system.right[layer][0] += f64::from(right[0]);
                    system.right[layer][1] += f64::from(right[1]);
                }
            }
            for &layer in CORNERS.iter().flat_map(|&node| &element.layer[node]).filter(|&&layer| layer != NOWHERE) {
                for (sum, seen) in means[layer as usize].iter_mut().zip(seen) {
                    *sum += seen;
                }
            }
            system.elements.push(element);
        }
    }
    system.start = means.iter().map(|[u, v, n]| [u / n.max(1e-9), v / n.max(1e-9)]).collect();
    system
}

/// The elements of all sheets of one cell and interval.
fn assemble_cell<T>(problem: &Problem<'_, T>, index: usize) -> Vec<Assembled>
where
    T: Fn(usize, u32, &mut Vec<Target>) + Sync,
{
    let grid = problem.grid;
    let place = [index / grid.grid.cells(), index % grid.grid.cells()];
    let list = &problem.sheets.lists[index];
    let [columns, rows] = grid.pixels(place[1]);
    let frames = grid.frames_of(place[0]);
    let volume = (columns.len() * rows.len() * frames.len()) as f32;
    let patch = |&label: &u8| Patch::new(grid, problem.layers, place, label, [problem.time, problem.space]);
    let patches: Vec<Patch> = list.iter().map(patch).collect();
    let mut assembled: Vec<Assembled> = patches.iter().map(|patch| Assembled::new(patch, place[0], volume)).collect();
    let mut sums = vec![Vec::with_capacity(frames.len()); list.len()];
    let mut targets = Vec::new();
    for frame in frames {
        targets.clear();
        (problem.targets)(index, frame, &mut targets);
        let mut targets = targets.chunks_exact(list.len());
        let weights = grid.weights(place[0], frame, problem.time);
        let known: Option<Vec<AtPoints>> = problem.known.map(|known| patches.iter().map(|patch| patch.points(known, &weights)).collect());
        let mut frame_sums = vec![(Sums::default(), [[0.0f32; 2]; POINTS], [0.0f32; 3]); list.len()];
        grid.each_pixel(frame, place[1], |_, at| {
            let Some(targets) = targets.next() else { return };
            let (points, shares) = patch::around(at);
            for (sheet, ((sums, right, seen), target)) in frame_sums.iter_mut().zip(targets).enumerate() {
                let Some(([mut u, mut v], mut weight)) = *target else { continue };
                if let Some(known) = &known {
                    ([u, v], weight) = (problem.refit)(patch::value(&known[sheet], (points, shares)), [u, v], weight);
                }
                sums.add(points[0] / 3 * 2 + points[0] % 3, shares, weight);
                for (point, share) in points.into_iter().zip(shares) {
                    right[point][0] += weight * share * u;
                    right[point][1] += weight * share * v;
                }
                *seen = [seen[0] + weight * u, seen[1] + weight * v, seen[2] + weight];
            }
        });
        for (sheet, (frame_sums, right, seen)) in frame_sums.into_iter().enumerate() {
            assembled[sheet].add(&frame_sums, &right, seen, &weights);
            sums[sheet].push(frame_sums);
        }
    }
    for (assembled, sums) in assembled.iter_mut().zip(sums) {
        assembled.finish(sums, problem);
    }
    assembled
}

impl Assembled {
    fn new(patch: &Patch, interval: usize, volume: f32) -> Self {
        let layer = patch.chains.map(|chain| chain.map_or([NOWHERE; 4], |chain| chain.layer.map(|at| at.map_or(NOWHERE, |at| at as u32))));
        let set = patch.chains.map(|chain| chain.map_or(0, |chain| chain.set() as u8));
        let pixels = Pixels::Each(Vec::new());
        let element = Element { layer, set, stencil: patch.stencil, interval: interval as u32, volume, pixels };
        let mut assembled = Self { element, right: [[[0.0; 2]; 4]; NODES], diagonal: [[0.0; 4]; NODES], seen: [0.0; 3] };
        for node in CORNERS {
            for key in [1, 2] {
                assembled.diagonal[node][key] += regulariser_diagonal(volume);
            }
        }
        assembled
    }

    fn add(&mut self, sums: &Sums, right: &AtPoints, seen: [f32; 3], weights: &[[f32; 4]; 4]) {
        if seen[2] == 0.0 {
            return;
        }
        let stencil = &self.element.stencil;
        let at_nodes = stencil.transposed(right);
        for node in 0..NODES {
            if self.element.layer[node][1] == NOWHERE {
                continue;
            }
            // The diagonal of the points' matrix, seen from the node.
            let mut one = [[0.0; 2]; NODES];
            one[node] = [1.0, 0.0];
            let points = stencil.points(&one);
            let product = sums.times(&points);
            let square: f32 = points.iter().zip(&product).map(|(a, b)| a[0] * b[0]).sum();
            for (key, weight) in weights[usize::from(self.element.set[node])].into_iter().enumerate() {
                self.diagonal[node][key] += weight * weight * square;
                self.right[node][key][0] += weight * at_nodes[node][0];
                self.right[node][key][1] += weight * at_nodes[node][1];
            }
        }
        for (sum, seen) in self.seen.iter_mut().zip(seen) {
            *sum += f64::from(seen);
        }
    }

    /// Keeps what the products need, in the smallest form.
    fn finish<T>(&mut self, sums: Vec<Sums>, problem: &Problem<'_, T>) {
        let element = &mut self.element;
        let mut sets = element.set.iter().zip(&element.layer).filter(|(_, layer)| layer[1] != NOWHERE).map(|(&set, _)| set);
        let first = sets.next().unwrap_or(0);
        if sets.all(|set| set == first) && sums.iter().all(|other| *other == sums[0]) {
            let interval = element.interval as usize;
            let mut squares = [[0.0; 4]; 4];
            for frame in problem.grid.frames_of(interval) {
                let weights = problem.grid.weights(interval, frame, problem.time)[usize::from(first)];
                for (row, a) in squares.iter_mut().zip(weights) {
                    for (entry, b) in row.iter_mut().zip(weights) {
                        *entry += a * b;
                    }
                }
            }
            element.pixels = Pixels::Same(sums[0], squares);
        } else {
            element.pixels = Pixels::Each(sums);
        }
    }
}

/// The diagonal of the regulariser.
fn regulariser_diagonal(volume: f32) -> f32 {
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

impl Element {
    /// Adds the element's share of the product A x to `y`.
    fn multiply(&self, weights: &[[[f32; 4]; 4]], x: &[[f64; 2]], y: &mut [[f64; 2]]) {
        let value = |layer: u32| if layer == NOWHERE { [0.0; 2] } else { x[layer as usize].map(|x| x as f32) };
        // Key by key: what follows is the same for all nodes, and for both axes.
        let at: [AtNodes; 4] = std::array::from_fn(|key| self.layer.map(|layers| value(layers[key])));
        let mut out = [[[0.0f32; 2]; NODES]; 4];
        match &self.pixels {
            Pixels::Same(sums, squares) => {
                let products = at.map(|nodes| sums.times(&self.stencil.points(&nodes)));
                for (out, squares) in out.iter_mut().zip(squares) {
                    let mut mixed = [[0.0; 2]; POINTS];
                    for (product, weight) in products.iter().zip(squares) {
                        for (sum, value) in mixed.iter_mut().zip(product) {
                            sum[0] += weight * value[0];
                            sum[1] += weight * value[1];
                        }
                    }
                    *out = self.stencil.transposed(&mixed);
                }
            }
            Pixels::Each(frames) => {
                let masks = self.masks();
                for (sums, weights) in frames.iter().zip(weights) {
                    let spread = spread(&masks, weights);
                    let mut nodes = [[0.0; 2]; NODES];
                    for (i, node) in nodes.as_flattened_mut().iter_mut().enumerate() {
                        let [a, b, c, d]: [f32; 4] = std::array::from_fn(|key| spread[key][i] * at[key].as_flattened()[i]);
                        *node = a + b + c + d;
                    }
                    let back = self.stencil.transposed(&sums.times(&self.stencil.points(&nodes)));
                    for (out, weights) in out.iter_mut().zip(&spread) {
                        for ((out, weight), value) in out.as_flattened_mut().iter_mut().zip(weights).zip(back.as_flattened()) {
                            *out += weight * value;
                        }
                    }
                }
            }
        }
        let corner = |bits: usize| (CORNERS[bits & 3], 1 + (bits >> 2));
        let held = regularised(self.volume, &std::array::from_fn(|bits| at[corner(bits).1][corner(bits).0]));
        for (bits, value) in held.iter().enumerate() {
            let (node, key) = corner(bits);
            out[key][node][0] += value[0];
            out[key][node][1] += value[1];
        }
        for (node, layers) in self.layer.iter().enumerate() {
            for (&layer, out) in layers.iter().zip(&out).filter(|&(&layer, _)| layer != NOWHERE) {
                y[layer as usize][0] += f64::from(out[node][0]);
                y[layer as usize][1] += f64::from(out[node][1]);
            }
        }
    }

    /// For each set of weights, all bits where a node has it: a number for either axis of every node.
    fn masks(&self) -> [[u32; 2 * NODES]; 4] {
        std::array::from_fn(|set| std::array::from_fn(|i| if usize::from(self.set[i / 2]) == set { u32::MAX } else { 0 }))
    }
}

/// What each key weighs at a moment, for either axis of every node. Masks, for what is looked up one by one cannot be computed side by side.
fn spread(masks: &[[u32; 2 * NODES]; 4], weights: &[[f32; 4]; 4]) -> [[f32; 2 * NODES]; 4] {
    let mut spread = [[0.0; 2 * NODES]; 4];
    for (key, spread) in spread.iter_mut().enumerate() {
        let [a, b, c, d] = weights.map(|set| set[key].to_bits());
        for (i, weight) in spread.iter_mut().enumerate() {
            *weight = f32::from_bits(masks[0][i] & a | masks[1][i] & b | masks[2][i] & c | masks[3][i] & d);
        }
    }
    spread
}

/// y = A x: runs of elements side by side, each in a fixed order, added up in a fixed order: the same sums on any number of threads.
fn multiply(elements: &[Element], weights: &Weights, x: &[[f64; 2]], y: &mut [[f64; 2]]) {
    let run = elements.len().div_ceil(RUNS).max(1);
    let partial: Vec<Vec<[f64; 2]>> = elements
        .par_chunks(run)
        .map(|elements| {
            let mut y = vec![[0.0; 2]; x.len()];
            for element in elements {
                element.multiply(&weights.0[element.interval as usize], x, &mut y);
            }
            y
        })
        .collect();
    y.fill([0.0; 2]);
    for partial in partial {
        for (y, partial) in y.iter_mut().zip(partial) {
            y[0] += partial[0];
            y[1] += partial[1];
        }
    }
}

fn dot(a: &[[f64; 2]], b: &[[f64; 2]]) -> [f64; 2] {
    a.iter().zip(b).fold([0.0; 2], |[u, v], (a, b)| [u + a[0] * b[0], v + a[1] * b[1]])
}

/// Writes the product of a matrix with the first vector into the second.
type Product<'a> = &'a dyn Fn(&[[f64; 2]], &mut [[f64; 2]]);

/// Conjugate gradients with a diagonal preconditioner, u and v side by side.
fn conjugate_gradients(multiply: Product<'_>, right: &[[f64; 2]], diagonal: &[f64], start: Vec<[f64; 2]>, steps: usize) -> Vec<[f64; 2]> {
    let scaled = |r: &[[f64; 2]]| -> Vec<[f64; 2]> { r.iter().zip(diagonal).map(|(r, d)| [r[0] / d, r[1] / d]).collect() };
    let mut x = start;
    let mut product = vec![[0.0; 2]; x.len()];
    multiply(&x, &mut product);
    let mut residual: Vec<[f64; 2]> = right.iter().zip(&product).map(|(b, a)| [b[0] - a[0], b[1] - a[1]]).collect();
    let mut z = scaled(&residual);
    let mut direction = z.clone();
    let mut rz = dot(&residual, &z);
    let ratio = |a: f64, b: f64| if b.abs() > 1e-30 { a / b } else { 0.0 };
    for _ in 0..steps {
        multiply(&direction, &mut product);
        let curvature = dot(&direction, &product);
        let step = [ratio(rz[0], curvature[0]), ratio(rz[1], curvature[1])];
        for ((x, r), (d, p)) in x.iter_mut().zip(&mut residual).zip(direction.iter().zip(&product)) {
            for axis in 0..2 {
                x[axis] += step[axis] * d[axis];
                r[axis] -= step[axis] * p[axis];
            }
        }
        z = scaled(&residual);
        let next = dot(&residual, &z);
        let keep = [ratio(next[0], rz[0]), ratio(next[1], rz[1])];
        rz = next;
        for (d, z) in direction.iter_mut().zip(&z) {
            *d = [z[0] + keep[0] * d[0], z[1] + keep[1] * d[1]];
        }
    }
    x
}
