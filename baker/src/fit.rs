//! The fit: positions of all layers such that what playback interpolates comes closest, in the least-squares
//! sense, to the G-buffer. Sheets come from `sheets`; positions go to `encode`.
//!
//! Fitting costs no bytes and gains 2-3 dB over storing what the key rays hit. It also gives ghosts their
//! positions: those that continue the visible part of their sheet best.

use crate::gbuffer::GBuffer;
use crate::sheets::{KeyGrid, Layers, Sheets};
use rayon::prelude::*;

/// Weight of the second differences inside a cell, per pixel: keeps sheets that few pixels pin down flat.
const TWIST: f32 = 1e-4;
/// Weight of the first differences, per pixel: only what nothing else decides.
const GRADIENT: f32 = 1e-7;
/// Conjugate gradient steps. Cells are small and overlap: 50 steps settle below 1/64 texel.
const STEPS: usize = 60;

/// A cell's corner weights: index bit 0 across, bit 1 down, bit 2 in time.
type Corners<T> = [T; 8];

/// The normal equations of one sheet in one cell and interval.
struct Element {
    layer: Corners<u32>,
    matrix: Corners<Corners<f32>>,
    right: Corners<[f32; 2]>,
}

/// Fitted positions.
#[derive(Clone, Debug)]
pub struct Fit {
    /// u and v of every layer, texels.
    pub uv: Vec<[f32; 2]>,
    /// How much every layer matters: squared texels of error, summed over pixels, for a squared texel of its own.
    pub weight: Vec<f32>,
}

/// Trilinear weights of the corners at a position in a cell.
fn hat([x, y, t]: [f32; 3]) -> Corners<f32> {
    std::array::from_fn(|corner| {
        let side = |bit: usize, at: f32| if corner & bit != 0 { at } else { 1.0 - at };
        side(1, x) * side(2, y) * side(4, t)
    })
}

/// The regulariser of a cell of `volume` pixels: squared differences of order one to three over its corners.
fn regulariser(volume: f32) -> Corners<Corners<f32>> {
    let mut matrix = [[0.0; 8]; 8];
    for difference in 1..8usize {
        let weight = volume * if difference.count_ones() >= 2 { TWIST } else { GRADIENT } / 8.0;
        let sign = |corner: usize| if (corner & difference).count_ones() % 2 == 1 { -1.0 } else { 1.0 };
        for (a, row) in matrix.iter_mut().enumerate() {
            for (b, entry) in row.iter_mut().enumerate() {
                *entry += weight * sign(a) * sign(b);
            }
        }
    }
    matrix
}

/// Fits all layers.
#[must_use]
pub fn solve(gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers) -> Fit {
    let elements = assemble(gbuffer, grid, sheets, layers);
    let start = initial(&elements, layers.label.len());
    conjugate_gradients(&elements, start)
}

fn assemble(gbuffer: &GBuffer, grid: &KeyGrid, sheets: &Sheets, layers: &Layers) -> Vec<Element> {
    let (cells, nodes) = (grid.grid.cells(), grid.grid.nodes());
    let per_cell: Vec<Vec<Element>> = sheets
        .lists
        .par_iter()
        .enumerate()
        .map(|(index, list)| {
            let (interval, cell) = (index / cells, index % cells);
            let [columns, rows] = grid.pixels(cell);
            let volume = columns.len() * rows.len() * grid.frames_of(interval).len();
            let corners = grid.corners(cell);
            let mut elements: Vec<Element> = list
                .iter()
                .map(|&label| Element {
                    layer: std::array::from_fn(|corner| {
                        let key = if corner & 4 == 0 { interval } else { grid.second_key(interval) };
                        let layer = layers.find(key * nodes + corners[corner & 3], label);
                        layer.map_or(u32::MAX, |layer| layer as u32)
                    }),
                    matrix: regulariser(volume as f32),
                    right: [[0.0; 2]; 8],
                })
                .collect();
            grid.each_pixel(interval, cell, |pixel, at| {
                let label = gbuffer.label[pixel] as u8;
                let Some(element) = list.iter().position(|&l| l == label).map(|sheet| &mut elements[sheet]) else { return };
                let (weights, uv) = (hat(at), gbuffer.uv[pixel]);
                for (a, row) in element.matrix.iter_mut().enumerate() {
                    for (b, entry) in row.iter_mut().enumerate() {
                        *entry += weights[a] * weights[b];
                    }
                    element.right[a][0] += weights[a] * uv[0];
                    element.right[a][1] += weights[a] * uv[1];
                }
            });
            elements
        })
        .collect();
    per_cell.into_iter().flatten().collect()
}

/// Every layer at the mean of its sheets' seen positions, to start from.
fn initial(elements: &[Element], layers: usize) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0f64; 3]; layers];
    for element in elements {
        // The corner weights of a pixel sum to one: so do the columns of the matrix, regulariser aside.
        let seen: f32 = element.matrix.iter().flatten().sum();
        let total = |axis: usize| element.right.iter().map(|r| f64::from(r[axis])).sum::<f64>();
        let sum = [total(0), total(1), f64::from(seen)];
        for &layer in &element.layer {
            for (a, b) in sums[layer as usize].iter_mut().zip(sum) {
                *a += b;
            }
        }
    }
    sums.iter().map(|[u, v, n]| [u / n.max(1e-9), v / n.max(1e-9)]).collect()
}

/// y = A x, element by element in a fixed order: the same sums on any number of threads.
fn multiply(elements: &[Element], x: &[[f64; 2]], y: &mut [[f64; 2]]) {
    y.fill([0.0; 2]);
    for element in elements {
        let at: Corners<[f64; 2]> = element.layer.map(|layer| x[layer as usize]);
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
