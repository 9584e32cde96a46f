//! Colouring: what each texel shows, and what lies between the charts.
//! Places come from the packing, colours from [`Shader`]; the coloured image goes to the palette.

use super::footprint::fine;
use super::grid::Grid;
use super::pack::Layout;
use super::place::Place;
use crate::chart::{Charting, NONE, Projection};
use crate::gbuffer::{Hits, Sample};
use crate::scene::Scene;
use crate::shade::{Shader, is_hole};
use glam::Vec3;
use rayon::prelude::*;

/// Rounds by which colours are continued beyond their charts, a texel each.
const BEYOND: usize = 8;
/// How far beyond an edge, as a barycentric weight, a colour sample still is the face's.
const EDGE: f64 = 1e-9;
/// The cosine that faces without a projection are taken to be seen at.
const OBLIQUE: f64 = 0.3;

/// Which samples fall into each texel.
pub(super) struct Seen {
    /// How many.
    pub count: Vec<u32>,
    /// The first of them; `u32::MAX` if there is none.
    pub first: Vec<u32>,
}

/// The image before its colours are reduced.
pub(super) struct Filled {
    /// 0..=255 a component, row-major.
    pub colours: Vec<[u8; 3]>,
    /// Which texels show a surface.
    pub covered: Vec<bool>,
}

/// What one colour sample of a texel shows: of several faces the one in front.
#[derive(Clone, Copy)]
struct Spot {
    face: u32,
    bary: [f64; 2],
    depth: f64,
}

/// What the camera sees of a texel: its first sample, and how deep that is.
struct Reference {
    sample: Sample,
    depth: f64,
}

/// Colours all charts and the background, and continues them into the gutters.
pub(super) fn fill(scene: &Scene, shader: &Shader<'_>, hits: &Hits, charting: &Charting, layout: &Layout, seen: &Seen) -> Filled {
    let patches: Vec<Vec<Option<Vec3>>> = charting
        .members()
        .par_iter()
        .enumerate()
        .map(|(c, faces)| Patch { scene, shader, hits, charting, layout, seen, chart: c, place: layout.places[c] }.colour(faces))
        .collect();
    let mut image: Vec<Option<Vec3>> = vec![None; (layout.width * layout.height) as usize];
    let mut paste = |rect: [u32; 4], patch: &[Option<Vec3>]| {
        let row = (rect[2] - rect[0]) as usize;
        for (y, texels) in (rect[1]..rect[3]).zip(patch.chunks(row.max(1))) {
            let start = (y * layout.width + rect[0]) as usize;
            // Others' texels may lie in the rectangle too.
            image[start..start + row].iter_mut().zip(texels).filter(|(_, new)| new.is_some()).for_each(|(old, new)| *old = *new);
        }
    };
    for (place, patch) in layout.places.iter().zip(&patches) {
        paste(place.rect, patch);
    }
    let [x0, y0, x1, y1] = layout.backdrop;
    let pixels = [f64::from(hits.width) / f64::from(x1 - x0), f64::from(hits.height) / f64::from(y1 - y0)];
    let centres = (0..y1 - y0).flat_map(|y| (0..x1 - x0).map(move |x| (f64::from(x) + 0.5, f64::from(y) + 0.5)));
    let backdrop: Vec<_> = centres.map(|(x, y)| Some(shader.background(x * pixels[0], y * pixels[1]))).collect();
    paste(layout.backdrop, &backdrop);
    let covered = image.iter().map(Option::is_some).collect();
    for _ in 0..BEYOND {
        image = continued(&image, layout.width as usize);
    }
    // What is too far from any chart to be seen costs least as one colour.
    let rest = shader.background(0.0, 0.0);
    let colours = image.iter().map(|t| t.unwrap_or(rest).to_array().map(|v| (v + 0.5).clamp(0.0, 255.0) as u8)).collect();
    Filled { colours, covered }
}

/// One round of continuation: empty texels take the mean of their coloured neighbours.
fn continued(image: &[Option<Vec3>], width: usize) -> Vec<Option<Vec3>> {
    let height = image.len() / width.max(1);
    let of = |i: usize| {
        if image[i].is_some() {
            return image[i];
        }
        let (x, y) = (i % width, i / width);
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for j in y.saturating_sub(1)..(y + 2).min(height) {
            for k in x.saturating_sub(1)..(x + 2).min(width) {
                if let Some(colour) = image[j * width + k] {
                    sum += colour;
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    };
    (0..image.len()).into_par_iter().map(of).collect()
}

/// One chart and everything its colours depend on.
struct Patch<'a> {
    scene: &'a Scene,
    shader: &'a Shader<'a>,
    hits: &'a Hits,
    charting: &'a Charting,
    layout: &'a Layout,
    seen: &'a Seen,
    chart: usize,
    place: Place,
}

impl Patch<'_> {
    /// World units a texel covers around a colour sample; 0 for a texture copied texel by texel.
    fn texel_size(&self, grid: &Grid, column: u32, row: u32) -> f64 {
        match self.charting.charts[self.chart].projection {
            Projection::Plane(_) | Projection::Point(..) | Projection::Unwrapped(_) => grid.texel([column as usize, row as usize]),
            Projection::Texture => 0.0,
        }
    }

    /// The first sample that falls into a texel, if it is one of the chart.
    fn first(&self, x: u32, y: u32) -> Option<Reference> {
        let texel = ((self.place.rect[1] + y) * self.layout.width + self.place.rect[0] + x) as usize;
        let sample = *self.hits.samples.get(self.seen.first[texel] as usize)?;
        let face = *self.charting.faces.of.get(sample.surface as usize)?;
        let own = face != NONE && self.charting.chart_of[face as usize] as usize == self.chart;
        own.then(|| Reference { sample, depth: self.charting.flat(face as usize, f64::from(sample.b), f64::from(sample.c))[2] })
    }

    /// Colour samples a texel has in each direction.
    fn fine(&self) -> u32 {
        fine(&self.charting.charts[self.chart].projection, self.layout.scale)
    }

    /// The chart's texels, row-major; `None` where it shows nothing.
    fn colour(&self, faces: &[u32]) -> Vec<Option<Vec3>> {
        let [x0, y0, x1, y1] = self.place.rect;
        let (width, height) = (x1 - x0, y1 - y0);
        let references: Vec<_> = (0..height).flat_map(|y| (0..width).map(move |x| self.first(x, y))).collect();
        let fine = self.fine();
        let mut spots = vec![Spot { face: NONE, bary: [0.0; 2], depth: f64::NEG_INFINITY }; (width * height * fine * fine) as usize];
        let grid = Grid::new(self.charting, self.chart, self.place, fine);
        for &face in faces {
            self.draw(&grid, face, width, &references, &mut spots);
        }
        let finish = |(i, reference): (usize, &Option<Reference>)| {
            let (x, y) = (i as u32 % width * fine, i as u32 / width * fine);
            let size = self.texel_size(&grid, x, y);
            let (mut sum, mut count) = (Vec3::ZERO, 0.0);
            for j in 0..fine {
                for k in 0..fine {
                    let spot = &spots[((y + j) * width * fine + x + k) as usize];
                    if spot.face != NONE {
                        sum += self.shader.shade(self.charting.faces.list[spot.face as usize].surface, spot.bary, size / f64::from(fine));
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 {
                return Some(sum / count);
            }
            // Too thin for a sample of its own, but seen.
            reference.as_ref().map(|r| self.shader.shade(r.sample.surface, [f64::from(r.sample.b), f64::from(r.sample.c)], size))
        };
        references.iter().enumerate().map(finish).collect()
    }

    /// Lays one face over the samples it is in front of.
    fn draw(&self, grid: &Grid, face: u32, width: u32, references: &[Option<Reference>], spots: &mut [Spot]) {
        let fine = self.fine();
        let surface = self.charting.faces.list[face as usize].surface;
        let cosine = match self.charting.charts[self.chart].projection {
            Projection::Plane(axes) | Projection::Point(_, axes, _) => {
                self.charting.faces.list[face as usize].normal.dot(axes[2]).abs().max(0.2)
            }
            Projection::Unwrapped(_) => OBLIQUE,
            Projection::Texture => 1.0,
        };
        let reach = 3.0 + 3.0 * (1.0 / (cosine * cosine) - 1.0).sqrt();
        grid.each_sample(self.charting, face as usize, EDGE, |i, j, shares| {
            let [b, c] = self.charting.weights(face as usize, shares);
            if is_hole(self.scene, surface / 2, [b, c]) {
                return;
            }
            let depth = self.charting.flat(face as usize, b, c)[2];
            // What the camera sees decides; where it sees nothing, what lies in front. Of equals the first, as in
            // ray casting.
            let seen = references[(j / fine * width + i / fine) as usize].as_ref();
            let spot = &mut spots[(j * width * fine + i) as usize];
            if seen.is_none_or(|r| (depth - r.depth).abs() <= reach * self.texel_size(grid, i, j))
                && depth > spot.depth + 1e-9 * depth.abs()
            {
                *spot = Spot { face, bary: [b, c], depth };
            }
        });
    }
}
