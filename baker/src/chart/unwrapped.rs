//! A model's texture coordinates as a flattening: islands are faces joined along edges that they share in space and in the texture.
//! Triangles come from the scene; charts go through `measure` and `fold` like those of other families.

use super::charting::{Chart, Charting, Projection};
use super::observe::{Faces, NONE};
use crate::joins::root;
use crate::scene::{Scene, Triangle};
use glam::DVec2;
use rayon::prelude::*;
use thiserror::Error;

/// The share of the surface that may lie without area in the texture: such faces are cut and flattened otherwise.
const WITHOUT: f64 = 0.5;
/// The least area of a triangle in the texture, in parts of its longest side squared: less is a line.
const LINE: f64 = 1e-6;

/// Why a model's texture coordinates do not flatten it.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum NoIslands {
    /// No triangle has any.
    #[error(
        "--charts own: expected texture coordinates, found none on any of {triangles} triangles; unwrap the model, or use --charts auto"
    )]
    None {
        /// Triangles of the scene.
        triangles: usize,
    },
    /// More than half of the surface is without area there.
    #[error(
        "--charts own: expected texture coordinates that give most of the surface an area, found {found} of {triangles} triangles without, the \
         first of them triangle {first} with material {material}; unwrap them, or use --charts auto"
    )]
    Area {
        /// Triangles whose coordinates enclose no area or are not numbers.
        found: usize,
        /// Triangles of the scene.
        triangles: usize,
        /// The first of those found, by its place in the scene.
        first: usize,
        /// Its material, by its place in the scene.
        material: u32,
    },
}

/// The islands of a scene.
pub(crate) struct Islands {
    /// The island of each triangle; [`NONE`] for those without area.
    of: Vec<u32>,
    /// How many there are.
    pub count: usize,
}

/// The texture coordinates of a triangle's corners, in textures; `None` if they enclose no area.
fn coordinates(t: &Triangle) -> Option<[DVec2; 3]> {
    let [p, q, r] = t.uv.map(|uv| uv.as_dvec2());
    let longest = (q - p).length_squared().max((r - p).length_squared()).max((r - q).length_squared());
    let area = (q - p).perp_dot(r - p).abs();
    (area.is_finite() && area > LINE * longest).then_some([p, q, r])
}

fn area(t: &Triangle) -> f64 {
    0.5 * (t.position[1] - t.position[0]).cross(t.position[2] - t.position[0]).length()
}

impl Islands {
    /// The islands of the scene's texture coordinates.
    ///
    /// # Errors
    /// [`NoIslands`] where more than half of the surface has none.
    pub fn new(scene: &Scene) -> Result<Self, NoIslands> {
        let triangles = &scene.triangles;
        let usable: Vec<bool> = triangles.par_iter().map(|t| coordinates(t).is_some()).collect();
        let found = usable.iter().filter(|&&usable| !usable).count();
        if found == triangles.len() {
            return Err(NoIslands::None { triangles: found });
        }
        let without: f64 = triangles.iter().zip(&usable).filter(|(_, usable)| !**usable).map(|(t, _)| area(t)).sum();
        let all: f64 = triangles.iter().map(area).sum();
        if let Some(first) = usable.iter().position(|&usable| !usable).filter(|_| without > WITHOUT * all) {
            return Err(NoIslands::Area { found, triangles: triangles.len(), first, material: triangles[first].material });
        }
        let mut parent: Vec<u32> = (0..triangles.len() as u32).collect();
        for sharing in edges(triangles, &usable).chunk_by(|a, b| a.ends == b.ends) {
            // Only what lies on both sides of an edge goes on across it: mirrored halves lie on one side.
            let [above, below] = [true, false].map(|above| sharing.iter().filter(move |edge| edge.above == above));
            for (one, other) in above.zip(below) {
                let (a, b) = (root(&mut parent, one.triangle), root(&mut parent, other.triangle));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
        let mut number = vec![NONE; triangles.len()];
        let mut count = 0;
        let mut of = vec![NONE; triangles.len()];
        for (t, of) in of.iter_mut().enumerate().filter(|(t, _)| usable[*t]) {
            let number = &mut number[root(&mut parent, t as u32) as usize];
            if *number == NONE {
                *number = count;
                count += 1;
            }
            *of = *number;
        }
        Ok(Self { of, count: count as usize })
    }

    /// Whether all faces lie on islands.
    pub fn hold(&self, faces: &Faces) -> bool {
        faces.list.iter().all(|face| self.of[(face.surface / 2) as usize] != NONE)
    }

    /// Makes a chart of each island and side that is seen; what is on none stays in the chart that it has. A flattened unit is about a world unit:
    /// what the texture stretches or squeezes in one direction all over an island is undone.
    pub fn take(&self, scene: &Scene, charting: &mut Charting) {
        let (mut number, mut kept) = (vec![NONE; 2 * self.count], vec![NONE; charting.charts.len()]);
        let mut charts: Vec<Chart> = Vec::new();
        let mut chart_of = Vec::new();
        for (f, face) in charting.faces.list.iter().enumerate() {
            let island = self.of[(face.surface / 2) as usize];
            let (number, chart) = if island == NONE {
                let old = charting.chart_of[f] as usize;
                (&mut kept[old], charting.charts[old].clone())
            } else {
                let projection = Projection::Unwrapped([[1.0, 0.0], [0.0, 1.0]]);
                let chart = Chart::new(projection, 1.0);
                (&mut number[(2 * island + (face.surface & 1)) as usize], chart)
            };
            if *number == NONE {
                *number = charts.len() as u32;
                charts.push(chart);
            }
            chart_of.push(*number);
        }
        (charting.chart_of, charting.charts) = (chart_of, charts);
        straighten(scene, charting);
    }
}

/// Gives every unwrapped chart the map from the texture that comes closest to keeping lengths, pixel by pixel.
fn straighten(scene: &Scene, charting: &mut Charting) {
    // Sums of the lengths' squares (of a step along u, of one along v, and mixed), as if areas were kept; of octaves that they are not; of pixels.
    let mut sums = vec![[0.0; 5]; charting.charts.len()];
    for (face, &chart) in charting.faces.list.iter().zip(&charting.chart_of) {
        let Some([p, q, r]) = coordinates(&scene.triangles[(face.surface / 2) as usize]) else { continue };
        let (d, e) = (q - p, r - p);
        let (x, y) = (face.position[1] - face.position[0], face.position[2] - face.position[0]);
        let determinant = d.perp_dot(e);
        let (along_u, along_v) = ((x * e.y - y * d.y) / determinant, (y * d.x - x * e.x) / determinant);
        let (area, hits) = (along_u.cross(along_v).length(), f64::from(face.hits));
        if area > 0.0 {
            let figures = [along_u.dot(along_u) / area, along_v.dot(along_v) / area, along_u.dot(along_v) / area, libm::log2(area), 1.0];
            sums[chart as usize].iter_mut().zip(figures).for_each(|(sum, figure)| *sum += hits * figure);
        }
    }
    for (chart, [uu, vv, mixed, octaves, hits]) in charting.charts.iter_mut().zip(sums) {
        let determinant = uu * vv - mixed * mixed;
        if let (Projection::Unwrapped(map), true) = (&mut chart.projection, determinant > 0.0) {
            // The square root of a symmetric matrix, and the scale that the mean area asks for.
            let root = determinant.sqrt();
            let scale = libm::exp2(0.5 * octaves / hits) / (root * (uu + vv + 2.0 * root)).sqrt();
            *map = [[(uu + root) * scale, mixed * scale], [mixed * scale, (vv + root) * scale]];
        }
    }
}

/// An edge of a triangle, by its ends in space and in the texture.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [u32; 2],
    triangle: u32,
    /// Whether the triangle lies to the left of it, in the texture.
    above: bool,
}

/// The edges of all usable triangles, equal ones next to each other.
fn edges(triangles: &[Triangle], usable: &[bool]) -> Vec<Edge> {
    // Adding zero makes one of both zeros.
    let key = |corner: u32| {
        let (t, k) = (&triangles[corner as usize / 3], corner as usize % 3);
        (t.position[k].to_array().map(|x| (x + 0.0).to_bits()), t.uv[k].to_array().map(|x| (x + 0.0).to_bits()))
    };
    let mut corners: Vec<u32> = (0..3 * triangles.len() as u32).filter(|&corner| usable[corner as usize / 3]).collect();
    corners.par_sort_unstable_by_key(|&corner| (key(corner), corner));
    let mut id = vec![NONE; 3 * triangles.len()];
    for same in corners.chunk_by(|&a, &b| key(a) == key(b)) {
        same.iter().for_each(|&corner| id[corner as usize] = same[0]);
    }
    let mut edges: Vec<Edge> = (0..triangles.len() as u32)
        .filter(|&t| usable[t as usize])
        .flat_map(|t| {
            let uv = triangles[t as usize].uv.map(|uv| uv.as_dvec2());
            let left = (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]) > 0.0;
            let id = &id;
            (0..3).map(move |k| {
                let [a, b] = [0, 1].map(|next| id[(3 * t + (k + next) % 3) as usize]);
                Edge { ends: [a.min(b), a.max(b)], triangle: t, above: left == (a < b) }
            })
        })
        .collect();
    edges.par_sort_unstable();
    edges
}
