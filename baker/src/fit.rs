//! The fit: positions of all layers such that what playback interpolates comes closest, in the least-squares
//! sense, to the G-buffer. Sheets come from `sheets`; positions go to `encode`.
//!
//! Fitting costs no bytes and gains 2-3 dB over storing what the key rays hit. It also gives ghosts their
//! positions: those that continue the visible part of their sheet best.

use crate::gbuffer::GBuffer;
use crate::sheets::{Chain, KeyGrid, Layers, Sheets, bilinear};
use rayon::prelude::*;

/// Weight of the second differences inside a cell, per pixel: keeps sheets that few pixels pin down flat.
const TWIST: f32 = 1e-4;
/// Weight of the first differences, per pixel: only what nothing else decides.
const GRADIENT: f32 = 1e-7;
/// Conjugate gradient steps. Cells are small and overlap: 50 steps settle below 1/64 texel, half a step of what is stored.
const STEPS: usize = 60;

/// Unknowns of a sheet in a cell and interval: four corners times four keys.
const UNKNOWNS: usize = 16;

/// The normal equations of one sheet in one cell and interval, for two quantities side by side.
struct Element {
    /// The layer of corner c and key k at index 4 c + k; where there is none, one with weight zero.
    layer: [u32; UNKNOWNS],
    matrix: [[f32; UNKNOWNS]; UNKNOWNS],
    right: [[f32; 2]; UNKNOWNS],
    /// Sum of the weights and weighted targets of its pixels.
    seen: [f64; 3],
}

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
    /// The target and weight of a G-buffer pixel for the sheet at a place in the list of its cell (interval times cells plus cell);
    /// `None`: the sheet does not care.
    pub target: T,
}

/// Fitted positions.
#[derive(Clone, Debug)]
pub struct Fit {
    /// u and v of every layer, texels.
    pub uv: Vec<[f32; 2]>,
    /// How much every layer matters: squared texels of error, summed over pixels, for a squared texel of its own.
    pub weight: Vec<f32>,
}

/// The regulariser of a cell of `volume` pixels: squared differences of order one to three over its corners in space and time.
fn regulariser(volume: f32, matrix: &mut [[f32; UNKNOWNS]; UNKNOWNS]) {
    // Corner bits: across, down, in time; the interval's keys are the second and third of each chain.
    let unknown = |corner: usize| (corner & 3) * 4 + 1 + (corner >> 2);
    for difference in 1..8usize {
        let weight = volume * if difference.count_ones() >= 2 { TWIST } else { GRADIENT } / 8.0;
        let sign = |corner: usize| if (corner & difference).count_ones() % 2 == 1 { -1.0 } else { 1.0 };
        for a in 0..8 {
            for b in 0..8 {
                matrix[unknown(a)][unknown(b)] += weight * sign(a) * sign(b);
            }
        }
    }
}

/// Fits the positions of all layers.
#[must_use]
pub fn solve(gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers) -> Fit {
    let target = |index: usize, sheet: usize, pixel: usize| {
        let own = gbuffer.label[pixel] == u16::from(sheets.lists[index][sheet]);
        own.then(|| (gbuffer.uv[pixel], 1.0))
    };
    solve_for(&Problem { grid, sheets, layers, time: grid.time, target })
}

/// Fits two quantities of all layers to the targets of `problem`.
#[must_use]
pub fn solve_for<T>(problem: &Problem<'_, T>) -> Fit
where
    T: Fn(usize, usize, usize) -> Option<([f32; 2], f32)> + Sync,
{
    let elements = assemble(problem);
    let start = initial(&elements, problem.layers.label.len());
    conjugate_gradients(&elements, start)
}

fn assemble<T>(problem: &Problem<'_, T>) -> Vec<Element>
where
    T: Fn(usize, usize, usize) -> Option<([f32; 2], f32)> + Sync,
{
    let grid = problem.grid;
    let cells = grid.grid.cells();
    let per_cell: Vec<Vec<Element>> = problem
        .sheets
        .lists
        .par_iter()
        .enumerate()
        .map(|(index, list)| {
            let (interval, cell) = (index / cells, index % cells);
            let [columns, rows] = grid.pixels(cell);
            let volume = (columns.len() * rows.len() * grid.frames_of(interval).len()) as f32;
            let chains: Vec<[Chain; 4]> =
                list.iter().map(|&label| problem.layers.chains(grid, interval, cell, label, problem.time)).collect();
            let mut elements: Vec<Element> = chains.iter().map(|chains| Element::new(chains, volume)).collect();
            for frame in grid.frames_of(interval) {
                let weights = grid.weights(interval, frame, problem.time);
                // Within a frame only the corners' weights change from pixel to pixel: the keys' come in once.
                let mut sums = vec![FrameSums::default(); list.len()];
                grid.each_pixel(frame, cell, |pixel, at| {
                    let corner = bilinear(at);
                    for (sheet, sums) in sums.iter_mut().enumerate() {
                        if let Some((target, weight)) = (problem.target)(index, sheet, pixel) {
                            sums.add(corner, target, weight);
                        }
                    }
                });
                for ((element, sums), chains) in elements.iter_mut().zip(&sums).zip(&chains) {
                    element.add(sums, &chains.map(|chain| chain.weights(&weights)));
                }
            }
            elements
        })
        .collect();
    per_cell.into_iter().flatten().collect()
}

/// Sums over the pixels that a sheet shows in one frame of a cell, by corners.
#[derive(Clone, Copy, Default)]
struct FrameSums {
    matrix: [[f32; 4]; 4],
    right: [[f32; 2]; 4],
    seen: [f32; 3],
}

impl FrameSums {
    fn add(&mut self, corner: [f32; 4], [u, v]: [f32; 2], weight: f32) {
        for (a, (row, right)) in self.matrix.iter_mut().zip(&mut self.right).enumerate() {
            let scaled = weight * corner[a];
            for (entry, b) in row.iter_mut().zip(corner) {
                *entry += scaled * b;
            }
            right[0] += scaled * u;
            right[1] += scaled * v;
        }
        self.seen = [self.seen[0] + weight * u, self.seen[1] + weight * v, self.seen[2] + weight];
    }
}

impl Element {
    fn new(chains: &[Chain; 4], volume: f32) -> Self {
        let mut layer = [u32::MAX; UNKNOWNS];
        for (corner, chain) in chains.iter().enumerate() {
            // The sheet lists made the layers: the inner two are there.
            let some = chain.layer[1].or(chain.layer[2]).unwrap_or(0);
            for (key, index) in chain.layer.iter().enumerate() {
                layer[corner * 4 + key] = index.unwrap_or(some) as u32;
            }
        }
        let mut matrix = [[0.0; UNKNOWNS]; UNKNOWNS];
        regulariser(volume, &mut matrix);
        Self { layer, matrix, right: [[0.0; 2]; UNKNOWNS], seen: [0.0; 3] }
    }

    fn add(&mut self, sums: &FrameSums, keys: &[[f32; 4]; 4]) {
        if sums.seen[2] == 0.0 {
            return;
        }
        for (a, (row, right)) in self.matrix.iter_mut().zip(&mut self.right).enumerate() {
            let weight = keys[a / 4][a % 4];
            if weight == 0.0 {
                continue;
            }
            for (b, entry) in row.iter_mut().enumerate() {
                *entry += weight * keys[b / 4][b % 4] * sums.matrix[a / 4][b / 4];
            }
            right[0] += weight * sums.right[a / 4][0];
            right[1] += weight * sums.right[a / 4][1];
        }
        for (sum, seen) in self.seen.iter_mut().zip(sums.seen) {
            *sum += f64::from(seen);
        }
    }
}

/// Every layer at the mean of its sheets' targets, to start from.
fn initial(elements: &[Element], layers: usize) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0f64; 3]; layers];
    for element in elements {
        for &layer in &element.layer {
            for (sum, seen) in sums[layer as usize].iter_mut().zip(element.seen) {
                *sum += seen;
            }
        }
    }
    sums.iter().map(|[u, v, n]| [u / n.max(1e-9), v / n.max(1e-9)]).collect()
}

/// y = A x, element by element in a fixed order: the same sums on any number of threads.
fn multiply(elements: &[Element], x: &[[f64; 2]], y: &mut [[f64; 2]]) {
    y.fill([0.0; 2]);
    for element in elements {
        let at = element.layer.map(|layer| x[layer as usize]);
        for (row, &layer) in element.matrix.iter().zip(&element.layer) {
            let mut sum = [0.0; 2];
            for (&entry, value) in row.iter().zip(&at) {
                sum[0] += f64::from(entry) * value[0];
                sum[1] += f64::from(entry) * value[1];
            }
            y[layer as usize][0] += sum[0];
            y[layer as usize][1] += sum[1];
        }
    }
}

fn dot(a: &[[f64; 2]], b: &[[f64; 2]]) -> [f64; 2] {
    a.iter().zip(b).fold([0.0; 2], |[u, v], (a, b)| [u + a[0] * b[0], v + a[1] * b[1]])
}

/// Conjugate gradients with a diagonal preconditioner, u and v side by side.
fn conjugate_gradients(elements: &[Element], start: Vec<[f64; 2]>) -> Fit {
    let layers = start.len();
    let mut diagonal = vec![1e-9f64; layers];
    let mut right = vec![[0.0f64; 2]; layers];
    for element in elements {
        for (corner, &layer) in element.layer.iter().enumerate() {
            diagonal[layer as usize] += f64::from(element.matrix[corner][corner]);
            right[layer as usize][0] += f64::from(element.right[corner][0]);
            right[layer as usize][1] += f64::from(element.right[corner][1]);
        }
    }
    let scaled = |r: &[[f64; 2]]| -> Vec<[f64; 2]> { r.iter().zip(&diagonal).map(|(r, d)| [r[0] / d, r[1] / d]).collect() };
    let mut x = start;
    let mut product = vec![[0.0; 2]; layers];
    multiply(elements, &x, &mut product);
    let mut residual: Vec<[f64; 2]> = right.iter().zip(&product).map(|(b, a)| [b[0] - a[0], b[1] - a[1]]).collect();
    let mut z = scaled(&residual);
    let mut direction = z.clone();
    let mut rz = dot(&residual, &z);
    let ratio = |a: f64, b: f64| if b.abs() > 1e-30 { a / b } else { 0.0 };
    for _ in 0..STEPS {
        multiply(elements, &direction, &mut product);
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
    Fit { uv: x.iter().map(|uv| [uv[0] as f32, uv[1] as f32]).collect(), weight: diagonal.iter().map(|&d| d as f32).collect() }
}
