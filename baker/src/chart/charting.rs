//! What a charting is: the charts, the faces that each has, and where these lie in it.
//! `mod` and its rooms fill it in; the atlas and the G-buffer ask it where a point of a face lies.

use super::axis::Warp;
use super::observe::Faces;
use glam::DVec3;

/// Charts are flat up to this depth, texels. Playback tells positions on those from the camera, unless they are warped.
pub(super) const FLAT: f64 = 0.5;

/// Octaves that a chart may be coarser, at most, for what its texels take.
pub(super) const COARSER: usize = 3;

/// How a chart is flattened.
#[derive(Clone, Copy, Debug)]
pub enum Projection {
    /// Along the third axis onto the first two; world units.
    Plane([DVec3; 3]),
    /// From a point: eye, axes (right, down, back), and the distance at which flattened units are world units.
    Point(DVec3, [DVec3; 3], f64),
    /// The scene's own texture coordinates; texels of the texture.
    Texture,
    /// The model's texture coordinates, times this matrix (rows); about world units.
    Unwrapped([[f64; 2]; 2]),
}

/// A region of the source image on which the map from the surface is continuous.
#[derive(Clone, Debug)]
pub struct Chart {
    /// The flattening.
    pub projection: Projection,
    /// Texels wanted per unit of flattened length.
    pub density: f64,
    /// The same if bytes did not matter.
    pub finest: f64,
    /// What texels an octave too long cost a pixel that shows it, on the whole: 1 where its colour is then eight levels of 255 off.
    pub loss: f64,
    /// How much longer than a source image it would be as fine as is worth its bytes; below 1 where that fits.
    pub wanted: f64,
    /// Smallest flattened coordinates that are seen.
    pub lo: [f64; 2],
    /// Largest flattened coordinates that are seen.
    pub hi: [f64; 2],
    /// Pixels, over all frames, that see the chart.
    pub hits: u64,
}

impl Chart {
    /// One that is not measured yet: of nothing seen, as fine as it gets.
    pub(crate) const fn new(projection: Projection, density: f64) -> Self {
        Self { projection, density, finest: density, loss: 1.0, wanted: 0.0, lo: [0.0; 2], hi: [0.0; 2], hits: 0 }
    }
}

/// How many texels charts get.
#[derive(Clone, Copy, Debug)]
pub struct Density {
    /// Texels a pixel, at most, where a chart is seen closest.
    pub most: f64,
    /// What detail is worth, bytes: for each pixel of each frame whose colour is eight levels of 255 off since its texel is longer than the pixel, four times as
    /// much where it is sixteen off. Infinite: all charts have `most`.
    pub detail: f64,
    /// What a texel takes, bytes.
    pub texel: f64,
}

/// All charts of a scene.
#[derive(Clone)]
pub struct Charting {
    /// The seen faces.
    pub(crate) faces: Faces,
    /// The chart of each seen face.
    pub(crate) chart_of: Vec<u32>,
    /// Flattened coordinates, depth and scale of each seen face's corners: the first two are to be divided by the last.
    pub(crate) corners: Vec<[[f64; 4]; 3]>,
    /// The charts.
    pub charts: Vec<Chart>,
    /// How each chart is warped; empty where none is.
    pub(crate) warps: Vec<Option<Warp>>,
}

impl Charting {
    /// Flattened coordinates, warped where the chart is, and depth of face `face` at barycentric `[b, c]`.
    #[inline]
    pub(crate) fn flat(&self, face: usize, b: f64, c: f64) -> [f64; 3] {
        let [p, q, r] = &self.corners[face];
        let a = 1.0 - b - c;
        let [x, y, depth, w] = [0, 1, 2, 3].map(|k| a * p[k] + b * q[k] + c * r[k]);
        match self.warps.get(self.chart_of[face] as usize) {
            Some(Some(warp)) => [warp[0].of(x / w), warp[1].of(y / w), depth],
            _ => [x / w, y / w, depth],
        }
    }

    /// Flattened coordinates, not warped, and depth of the corners of face `face`.
    pub(crate) fn outline(&self, face: usize) -> [[f64; 3]; 3] {
        self.corners[face].map(|[x, y, depth, w]| [x / w, y / w, depth])
    }

    /// The barycentric `[b, c]` of the point of face `face` that its flattened triangle shows at barycentric `[b, c]`: another one where the view
    /// is from a point.
    pub(crate) fn weights(&self, face: usize, [b, c]: [f64; 2]) -> [f64; 2] {
        let [p, q, r] = self.corners[face].map(|corner| corner[3]);
        let (a, b, c) = ((1.0 - b - c) / p, b / q, c / r);
        [b / (a + b + c), c / (a + b + c)]
    }

    /// The faces of each chart.
    pub(crate) fn members(&self) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.charts.len()];
        for (face, &chart) in self.chart_of.iter().enumerate() {
            members[chart as usize].push(face as u32);
        }
        members
    }

    /// Pixels, over all frames, that see one of `faces`.
    pub(super) fn seen(&self, faces: &[u32]) -> u64 {
        faces.iter().map(|&face| u64::from(self.faces.list[face as usize].hits)).sum()
    }

    /// Takes `faces` out of chart `chart` into one of their own that is flattened alike: which.
    pub(super) fn take_out(&mut self, chart: u32, faces: &[u32]) -> u32 {
        let other = self.charts.len() as u32;
        self.charts.push(self.charts[chart as usize].clone());
        faces.iter().for_each(|&face| self.chart_of[face as usize] = other);
        other
    }

    /// Those of `faces`, all of them one chart's, whose middles lie beyond a line across one of its flattened coordinates, where that one has this value;
    /// `None` where one side of it has none.
    pub(super) fn beyond(&self, faces: &[u32], (axis, value): (usize, f64)) -> Option<Vec<u32>> {
        let lies_beyond = |face: &u32| self.outline(*face as usize).iter().map(|corner| corner[axis]).sum::<f64>() >= 3.0 * value;
        let far: Vec<u32> = faces.iter().copied().filter(lies_beyond).collect();
        (!far.is_empty() && far.len() < faces.len()).then_some(far)
    }

    /// How far the faces of each chart reach in depth, flattened units; below zero where it has none.
    pub(super) fn deep(&self) -> Vec<f64> {
        let mut range = vec![(f64::INFINITY, f64::NEG_INFINITY); self.charts.len()];
        for (corners, &chart) in self.corners.iter().zip(&self.chart_of) {
            let range = &mut range[chart as usize];
            *range = corners.iter().fold(*range, |range, corner| (range.0.min(corner[2]), range.1.max(corner[2])));
        }
        range.into_iter().map(|(low, high)| high - low).collect()
    }

    /// World units that a flattened unit covers on face `face`, as the side of a square; 1 where the projection tells.
    pub(crate) fn stretch(&self, face: usize) -> f64 {
        let Projection::Unwrapped(_) = self.charts[self.chart_of[face] as usize].projection else { return 1.0 };
        let ([p, q, r], [a, b, c]) = (self.corners[face], self.faces.list[face].position);
        let flat = ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])).abs();
        ((b - a).cross(c - a).length() / flat.max(f64::MIN_POSITIVE)).sqrt()
    }
}
