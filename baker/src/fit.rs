//! The fit: positions of all layers such that what playback interpolates comes closest, in the least-squares
//! sense, to the G-buffer. Sheets come from `sheets`, the products of the normal equations from `element`; positions go to `encode`.
//!
//! Fitting costs no bytes and gains 2-3 dB over storing what the key rays hit. It also gives ghosts their
//! positions: those that continue the visible part of their sheet best.

use crate::element::{self, Element, NOWHERE, Sums, Weights};
use crate::gbuffer::GBuffer;
use crate::patch::{self, CORNERS, NODES, Patch, VALUES};
use crate::sheets::{KeyGrid, Layers, Sheets};
use cubist_core::format::SPACE_LINEAR;
use rayon::prelude::*;
use std::ops::Range;

/// Conjugate gradient steps. Cells are small and overlap: 50 steps settle below 1/64 texel, half a step of what is stored.
const STEPS: usize = 60;
/// Products are summed in this many runs of elements, whatever the number of threads.
const RUNS: usize = 8;
/// Layers that a thread adds products up for at a time.
const SUMMED: usize = 1 << 12;

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
    match problem.space {
        SPACE_LINEAR => solve_of::<{ CORNERS.len() }, T>(problem),
        _ => solve_of::<VALUES, T>(problem),
    }
}

/// Likewise, where patches have `N` values.
fn solve_of<const N: usize, T>(problem: &Problem<'_, T>) -> Fit
where
    T: Fn(usize, u32, &mut Vec<Target>) + Sync,
{
    let weights = weights(problem);
    let System { elements, mut right, mut diagonal, mut start } = assemble::<N, T>(problem, &weights);
    if let Some(known) = problem.known {
        start = known.iter().map(|uv| uv.map(f64::from)).collect();
    }
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
    let runs = runs(&elements);
    let product = |x: &[[f64; 2]], y: &mut [[f64; 2]]| {
        let lower: Vec<[f32; 2]> = x.iter().map(|x| x.map(|x| x as f32)).collect();
        multiply(&runs, &weights, &lower, y);
        for ((y, x), held) in y.iter_mut().zip(x).zip(&held) {
            y[0] += held * x[0];
            y[1] += held * x[1];
        }
    };
    let steps = if problem.known.is_some() { REFIT_STEPS } else { STEPS };
    let uv = conjugate_gradients(&product, &right, &diagonal, start, steps);
    Fit { uv: uv.iter().map(|uv| uv.map(|x| x as f32)).collect(), weight: diagonal.iter().map(|&d| d as f32).collect() }
}

/// For every interval the weights of the keys in each of its frames.
fn weights<T>(problem: &Problem<'_, T>) -> Vec<Vec<Weights>> {
    let grid = problem.grid;
    let of = |interval| grid.frames_of(interval).map(|frame| grid.weights(interval, frame, problem.time)).collect();
    (0..grid.intervals()).map(of).collect()
}

/// What is to be solved.
struct System<const N: usize> {
    elements: Vec<Element<N>>,
    right: Vec<[f64; 2]>,
    diagonal: Vec<f64>,
    /// Every layer at the mean of its sheets' targets, to start from.
    start: Vec<[f64; 2]>,
}

/// An element with its right-hand side.
struct Assembled<const N: usize> {
    element: Element<N>,
    /// What each node gives to the patch's values.
    shares: [[f32; N]; NODES],
    right: [[[f32; 2]; 4]; NODES],
    diagonal: [[f32; 4]; NODES],
    /// Sum of the weights and weighted targets of its pixels.
    seen: [f64; 3],
}

fn assemble<const N: usize, T>(problem: &Problem<'_, T>, weights: &[Vec<Weights>]) -> System<N>
where
    T: Fn(usize, u32, &mut Vec<Target>) + Sync,
{
    let cells = problem.grid.grid.cells();
    let layers = problem.layers.label.len();
    let mut system = System { elements: Vec::new(), right: vec![[0.0; 2]; layers], diagonal: vec![1e-9; layers], start: Vec::new() };
    let mut means = vec![[0.0f64; 3]; layers];
    // An interval at a time: right-hand sides are large.
    for lists in (0..problem.sheets.lists.len()).step_by(cells) {
        let assembled: Vec<Vec<Assembled<N>>> =
            (lists..lists + cells).into_par_iter().map(|index| assemble_cell(problem, weights, index)).collect();
        for Assembled { element, right, diagonal, seen, .. } in assembled.into_iter().flatten() {
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
fn assemble_cell<const N: usize, T>(problem: &Problem<'_, T>, weights: &[Vec<Weights>], index: usize) -> Vec<Assembled<N>>
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
    let mut assembled: Vec<Assembled<N>> = patches.iter().map(|patch| Assembled::new(patch, place[0], volume)).collect();
    let mut sums = vec![Vec::with_capacity(frames.len()); list.len()];
    let mut targets = Vec::new();
    for (frame, weights) in frames.zip(&weights[place[0]]) {
        targets.clear();
        (problem.targets)(index, frame, &mut targets);
        let mut targets = targets.chunks_exact(list.len());
        let known: Option<Vec<[[f32; 2]; N]>> =
            problem.known.map(|known| patches.iter().map(|patch| patch::first(&patch.values(known, weights))).collect());
        let mut frame_sums = vec![(Sums::<N>::default(), [[0.0f32; 2]; N], [0.0f32; 3]); list.len()];
        grid.each_pixel(frame, place[1], |_, at| {
            let Some(targets) = targets.next() else { return };
            let shares: [f32; N] = patch::first(&patch::shares(at));
            for (sheet, ((sums, right, seen), target)) in frame_sums.iter_mut().zip(targets).enumerate() {
                let Some(([mut u, mut v], mut weight)) = *target else { continue };
                if let Some(known) = &known {
                    ([u, v], weight) = (problem.refit)(patch::value(&known[sheet], &shares), [u, v], weight);
                }
                sums.add(&shares, weight);
                for (right, share) in right.iter_mut().zip(shares) {
                    right[0] += weight * share * u;
                    right[1] += weight * share * v;
                }
                *seen = [seen[0] + weight * u, seen[1] + weight * v, seen[2] + weight];
            }
        });
        for (sheet, (frame_sums, right, seen)) in frame_sums.into_iter().enumerate() {
            assembled[sheet].add(&frame_sums, &right, seen, weights);
            sums[sheet].push(frame_sums);
        }
    }
    for (assembled, sums) in assembled.iter_mut().zip(sums) {
        assembled.element.fill(sums, &weights[place[0]]);
    }
    assembled
}

impl<const N: usize> Assembled<N> {
    fn new(patch: &Patch, interval: usize, volume: f32) -> Self {
        let element = Element::new(patch, interval, volume);
        let (shares, mut diagonal) = (element.shares(), [[0.0; 4]; NODES]);
        for node in CORNERS {
            for key in [1, 2] {
                diagonal[node][key] = element::regulariser_diagonal(volume);
            }
        }
        Self { element, shares, right: [[[0.0; 2]; 4]; NODES], diagonal, seen: [0.0; 3] }
    }

    fn add(&mut self, sums: &Sums<N>, right: &[[f32; 2]; N], seen: [f32; 3], weights: &Weights) {
        if seen[2] == 0.0 {
            return;
        }
        let at_nodes = self.element.at_nodes(right);
        for (node, [u, v]) in at_nodes.into_iter().enumerate() {
            if self.element.layer[node][1] == NOWHERE {
                continue;
            }
            let square = sums.square(&self.shares[node]);
            for (key, weight) in self.element.weights(node, weights).into_iter().enumerate() {
                self.diagonal[node][key] += weight * weight * square;
                self.right[node][key][0] += weight * u;
                self.right[node][key][1] += weight * v;
            }
        }
        for (sum, seen) in self.seen.iter_mut().zip(seen) {
            *sum += f64::from(seen);
        }
    }
}

/// Elements side by side, and the layers that they have.
struct Run<'e, const N: usize> {
    elements: &'e [Element<N>],
    layers: Range<usize>,
}

/// The elements in runs of their order, which is that of their layers but for those that a looping path begins and ends with.
fn runs<const N: usize>(elements: &[Element<N>]) -> Vec<Run<'_, N>> {
    let of = |elements: &[Element<N>]| {
        let layers = elements.iter().flat_map(|element| element.layer.as_flattened()).filter(|&&layer| layer != NOWHERE);
        let (first, end) = layers.fold((usize::MAX, 0), |(first, end), &layer| (first.min(layer as usize), end.max(layer as usize + 1)));
        first..end
    };
    let run = |elements| Run { elements, layers: of(elements) };
    elements.chunks(elements.len().div_ceil(RUNS).max(1)).map(run).collect()
}

/// y = A x: runs of elements side by side, each in a fixed order, added up in a fixed order: the same sums on any number of threads.
fn multiply<const N: usize>(runs: &[Run<'_, N>], weights: &[Vec<Weights>], x: &[[f32; 2]], y: &mut [[f64; 2]]) {
    let product = |run: &Run<'_, N>| {
        let mut y = vec![[0.0; 2]; run.layers.end];
        run.elements.iter().for_each(|element| element.multiply(&weights[element.interval as usize], x, &mut y));
        y
    };
    let products: Vec<Vec<[f64; 2]>> = runs.par_iter().map(product).collect();
    y.par_iter_mut().with_min_len(SUMMED).enumerate().for_each(|(layer, y)| {
        let own = runs.iter().zip(&products).filter(|(run, _)| run.layers.contains(&layer));
        *y = own.fold([0.0; 2], |[u, v], (_, product)| [u + product[layer][0], v + product[layer][1]]);
    });
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
