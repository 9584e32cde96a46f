//! The scene's own flattening, kept: one chart an island, one texel a texel of the texture.
//! Built-in scenes bring it; charts go to the atlas like any other.

use super::charting::{Chart, Charting, Projection};
use super::measure;
use super::observe::{Faces, NONE};
use crate::gbuffer::Hits;
use crate::scene::Scene;

/// The size of a material's texture; 1 x 1 without one.
pub(super) fn texture_size(scene: &Scene, material: u32) -> [f64; 2] {
    let texture = scene.materials.get(material as usize).and_then(|m| scene.textures.get(m.texture? as usize));
    texture.map_or([1.0, 1.0], |t| [f64::from(t.width), f64::from(t.height)])
}

/// One chart for each island that is seen.
pub(super) fn build(scene: &Scene, hits: &Hits, faces: Faces) -> Charting {
    let mut number = vec![NONE; usize::from(u16::MAX) + 1];
    let mut charts = Vec::new();
    let chart_of = faces
        .list
        .iter()
        .map(|face| {
            let island = scene.triangles[(face.surface / 2) as usize].island.unwrap_or(0);
            let number = &mut number[usize::from(island)];
            if *number == NONE {
                *number = charts.len() as u32;
                charts.push(Chart::new(Projection::Texture, 1.0));
            }
            *number
        })
        .collect();
    let mut charting = Charting { faces, chart_of, corners: Vec::new(), warps: Vec::new(), charts };
    charting.flatten(scene);
    measure::bound(hits, &mut charting);
    // Whole texels, so that the texture's texels are the source image's.
    for chart in &mut charting.charts {
        chart.lo = chart.lo.map(|v| (v + 1e-3).floor());
        chart.hi = [0, 1].map(|k| (chart.hi[k] - 1e-3).ceil().max(chart.lo[k] + 1.0));
    }
    charting
}
