//! Charts: which seen faces lie together in the source image, and how each is flattened there.
//! Samples come from the G-buffer; charts go to the atlas, which places and colours them.

mod absorb;
mod apart;
mod axis;
mod blur;
mod charting;
mod clusters;
mod directions;
mod family;
mod flat;
mod fold;
mod islands;
mod labels;
mod long;
mod measure;
mod merge;
mod observe;
mod price;
mod refine;
mod sight;
mod unwrapped;
mod view;
mod warp;

use crate::gbuffer::Hits;
use crate::scene::Scene;
use clusters::Clusters;
use glam::DVec3;
use rayon::prelude::*;
use std::mem;
use view::View;

pub use charting::{Chart, Charting, Density, Projection};
pub use family::{Choice, Family, Trial, reason};
pub use labels::{Labels, assign};
pub(crate) use observe::NONE;
pub(crate) use price::price;
pub(crate) use unwrapped::Islands;
pub use unwrapped::NoIslands;
pub(crate) use warp::rewarp;

/// What takes the place of depth where there is no projection: two surfaces that lie on each other in a texture are seldom level in it.
const OBLIQUE: DVec3 = DVec3::new(0.48, 0.64, 0.6);

/// How the faces are shared out among charts: what a cut changes.
pub(crate) struct Parts {
    chart_of: Vec<u32>,
    charts: Vec<Chart>,
}

impl Charting {
    /// Cuts chart `chart` in two along a line across one of its flattened coordinates, where that one has this value: faces go to the side that their
    /// middles lie on. Returns what was before; `None`, and nothing is done, where one side would have none.
    pub(crate) fn sever(&mut self, hits: &Hits, chart: usize, line: (usize, f64)) -> Option<Parts> {
        let own = (0u32..).zip(&self.chart_of).filter(|(_, of)| **of == chart as u32);
        let faces: Vec<u32> = own.map(|(face, _)| face).collect();
        let far = self.beyond(&faces, line)?;
        let before = Parts { chart_of: self.chart_of.clone(), charts: self.charts.clone() };
        self.take_out(chart as u32, &far);
        measure::bound(hits, self);
        Some(before)
    }

    /// Shares the faces out like this: takes back a cut, or makes it again. Returns how they were shared out.
    pub(crate) fn exchange(&mut self, Parts { chart_of, charts }: Parts) -> Parts {
        Parts { chart_of: mem::replace(&mut self.chart_of, chart_of), charts: mem::replace(&mut self.charts, charts) }
    }

    /// The mean distance of each cluster from its view's eye.
    fn depths(&self, clusters: &Clusters) -> Vec<f64> {
        let mut sums = vec![[0.0; 2]; clusters.views.len()];
        for (face, &c) in self.faces.list.iter().zip(&clusters.of) {
            let view = clusters.views[c as usize];
            let depth = view.eye.map_or(1.0, |eye| (eye - face.middle()).dot(view.back));
            sums[c as usize][0] += depth * f64::from(face.hits);
            sums[c as usize][1] += f64::from(face.hits);
        }
        sums.into_iter().map(|[depth, hits]| (depth / f64::max(hits, 1.0)).max(f64::MIN_POSITIVE)).collect()
    }

    /// Computes the faces' flattened corners from the charts' projections.
    fn flatten(&mut self, scene: &Scene) {
        self.corners = self
            .faces
            .list
            .iter()
            .zip(&self.chart_of)
            .map(|(face, &chart)| match self.charts[chart as usize].projection {
                Projection::Plane(axes) => face.position.map(|p| [axes[0].dot(p), axes[1].dot(p), axes[2].dot(p), 1.0]),
                Projection::Point(eye, axes, near) => face.position.map(|p| {
                    let [x, y, back] = axes.map(|a| a.dot(p - eye));
                    [x, y, back, (-back).max(1e-3 * near) / near]
                }),
                Projection::Texture => {
                    let t = &scene.triangles[(face.surface / 2) as usize];
                    let size = islands::texture_size(scene, t.material);
                    t.uv.map(|uv| [f64::from(uv.x) * size[0], f64::from(uv.y) * size[1], 0.0, 1.0])
                }
                Projection::Unwrapped(map) => {
                    let t = &scene.triangles[(face.surface / 2) as usize];
                    [0, 1, 2].map(|k| {
                        let [x, y] = map.map(|row| row[0] * f64::from(t.uv[k].x) + row[1] * f64::from(t.uv[k].y));
                        [x, y, OBLIQUE.dot(face.position[k]), 1.0]
                    })
                }
            })
            .collect();
    }
}

/// Whether the scene brings a flattening of its own: every triangle has an island.
#[must_use]
pub fn brings_own(scene: &Scene) -> bool {
    !scene.triangles.is_empty() && scene.triangles.iter().all(|t| t.island.is_some())
}

/// Cuts what is seen into charts of this density, for a source image of sides up to `max_side`. The scene's own flattening
/// is kept, at its highest density of its texels, at most all. `Family::Own` is the model's texture for a scene without, and `Family::Planes` where that does
/// not flatten it.
pub fn build(scene: &Scene, hits: &Hits, family: Family, density: &Density, max_side: u32) -> Charting {
    let own = family == Family::Own && brings_own(scene);
    let (faces, links) = observe::observe(scene, hits, !own);
    if own {
        let mut charting = islands::build(scene, hits, faces);
        // The scene's own texels are the finest there are.
        let most = density.most.min(1.0);
        charting.charts.iter_mut().for_each(|chart| (chart.density, chart.finest) = (most, most));
        return charting;
    }
    let islands = if family == Family::Own { Islands::new(scene).ok() } else { None };
    let cut = !islands.as_ref().is_some_and(|islands| islands.hold(&faces));
    let mut candidates: Vec<Clusters> = Vec::new();
    let merging = cut.then(|| merge::Merging::new(scene, &faces, &links, family));
    let merged = |merging: merge::Merging<'_>| -> Vec<Clusters> {
        let by = |&weights| {
            let mut clusters = merging.merge(weights);
            absorb::absorb(&faces, &links, &mut clusters, hits.samples.len());
            clusters
        };
        family.weights().par_iter().map(by).collect()
    };
    for clusters in merging.map(merged).into_iter().flatten() {
        if candidates.iter().all(|c| c.of != clusters.of) {
            candidates.push(clusters);
        }
    }
    let seen = density.detail.is_finite().then(|| blur::Seen::new(scene, hits));
    let measure = |charting: &mut Charting| measure::measure(scene, hits, seen.as_ref(), charting, density, max_side);
    let mut charting = Charting { charts: Vec::new(), chart_of: Vec::new(), corners: Vec::new(), warps: Vec::new(), faces };
    let mut best: Option<(f64, Vec<u32>, Vec<Chart>)> = None;
    for clusters in candidates {
        let chart = |(view, depth): (&View, f64)| Chart::new(view.projection(depth), density.most);
        charting.charts = clusters.views.iter().zip(charting.depths(&clusters)).map(chart).collect();
        charting.chart_of = clusters.of;
        measure(&mut charting);
        let price = price::price(hits, &charting);
        if best.as_ref().is_none_or(|b| price < b.0) {
            best = Some((price, std::mem::take(&mut charting.chart_of), std::mem::take(&mut charting.charts)));
        }
    }
    if let Some((_, chart_of, charts)) = best {
        (charting.chart_of, charting.charts) = (chart_of, charts);
    }
    if let Some(islands) = islands {
        islands.take(scene, &mut charting);
        measure(&mut charting);
    }
    charting.flatten(scene);
    let (folded, parted) = (fold::split(hits, &mut charting, &links), apart::split(scene, hits, &mut charting, &links));
    if folded || parted {
        measure(&mut charting);
    }
    // Where nothing is said of what texels are worth, a plane that runs to the horizon wants any number of them.
    if seen.is_some() {
        for _ in 0..long::CUTS {
            if !long::split(&mut charting) {
                break;
            }
            measure(&mut charting);
        }
    }
    charting
}
