//! Brinks: positions that lie close by the edge of a chart, and how much depends on each.
//! Lists with their order and tests come from `settle`; weights go to `encode`.
//!
//! In a torn cell the chart test shows a sheet as far as its chart reaches. A pixel whose position lies close by that edge, on either side, shows another
//! surface as soon as an error moves the position across. So positions matter to more pixels than those that see their sheet. That counts most for a sheet
//! that few pixels see: coded as coarsely as these few bear, it could show in the whole cell.

use crate::atlas::SourceImage;
use crate::order::{self, Chart, Evidence};
use crate::patch::{self, CORNERS, Patch};
use crate::sheets::{Sheets, bilinear};
use cubist_core::lists::CHART;
use rayon::prelude::*;

/// How far from the edge is looked, texels.
const FAR: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
/// What it matters to cross the edge where that is plainly wrong: so many squared texels that a pixel of the sheet's own is off. Four times as much made
/// a tenth more bytes of keys for .02 dB.
const CROSSING: f32 = 1.0;

/// How much more every layer matters: as [`Fit::weight`](crate::fit::Fit::weight) has it.
#[must_use]
pub fn weights(evidence: &Evidence<'_>, sheets: &Sheets) -> Vec<f32> {
    let parts: Vec<Vec<(usize, f32)>> = (0..sheets.lists.len()).into_par_iter().map(|index| cell(evidence, sheets, index)).collect();
    let mut weights = vec![0.0; evidence.fit.weight.len()];
    parts.into_iter().flatten().for_each(|(layer, weight)| weights[layer] += weight);
    weights
}

/// The layers of a cell and interval that matter more.
fn cell(evidence: &Evidence<'_>, sheets: &Sheets, index: usize) -> Vec<(usize, f32)> {
    let &Evidence { gbuffer, grid, image, fit, layers, .. } = evidence;
    let (interval, cell) = (index / grid.grid.cells(), index % grid.grid.cells());
    let list = &sheets.lists[index];
    let mut out = Vec::new();
    for place in (0..list.len()).filter(|&place| sheets.test(index, place) == Some(CHART)) {
        let (label, chart) = (list[place], Chart::new(image, list[place]));
        let patch = Patch::new(grid, layers, [interval, cell], label, [grid.time, grid.space]);
        for frame in grid.frames_of(interval) {
            let in_time = grid.weights(interval, frame, grid.time);
            let values = patch.values(&fit.uv, &in_time);
            let mut sums = [0.0f32; CORNERS.len()];
            grid.each_pixel(frame, cell, |pixel, at| {
                let own = list.iter().position(|&label| u16::from(label) == gbuffer.label[pixel]).unwrap_or(list.len());
                // What a sheet in front covers does not depend on it.
                if own < place {
                    return;
                }
                let uv = patch::value(&values, &patch::shares(at));
                // What is wrong already does not get worse.
                let Some(far) = to_edge(image, &chart, uv, own == place) else { return };
                let off = if own == place { 1.0 } else { order::off(image.colour_at(gbuffer.uv[pixel]), image.colour_at(uv)) };
                // So that an error as large as the way to the edge costs what crossing it does.
                let weight = CROSSING * off / (far * far);
                sums.iter_mut().zip(bilinear(at)).for_each(|(sum, share)| *sum += weight * share * share);
            });
            if sums == [0.0; CORNERS.len()] {
                continue;
            }
            for (node, sum) in CORNERS.into_iter().zip(sums) {
                let Some(chain) = &patch.chains[node] else { continue };
                for (layer, weight) in chain.layer.into_iter().zip(chain.weights(&in_time)) {
                    out.extend(layer.map(|layer| (layer, sum * weight * weight)));
                }
            }
        }
    }
    out
}

/// How far a position that should be `inside` a chart, or outside of it, and is, lies from its edge, texels; `None`: farther than matters, or on the wrong
/// side.
fn to_edge(image: &SourceImage, chart: &Chart, [u, v]: [f32; 2], inside: bool) -> Option<f32> {
    let crossed = |far: &f32| {
        let around = [[u - far, v], [u + far, v], [u, v - far], [u, v + far]];
        around.into_iter().any(|uv| chart.covers(image, uv) != inside)
    };
    FAR.into_iter().find(crossed).filter(|_| chart.covers(image, [u, v]) == inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::{Label, Outline};
    use crate::fit::Fit;
    use crate::gbuffer::GBuffer;
    use crate::order::Coverage;
    use crate::sheets::{self, KeyGrid, Layers};
    use cubist_core::format::{SPACE_LINEAR, TIME_LINEAR, TexelKind};

    /// The weights of a cell of 8 x 8 pixels in two frames, of which the upper left one shows the last column of chart 1, 16 texels wide, the others chart 2;
    /// the fitted positions of chart 1 are all so many texels `beyond` its edge.
    fn weights_of(beyond: f32, test: u16) -> Vec<f32> {
        let own = |i: usize| i.is_multiple_of(64);
        let uv: Vec<[f32; 2]> = (0..128).map(|i| if own(i) { [15.5, 4.5] } else { [20.5 + (i % 8) as f32, 4.5] }).collect();
        let gbuffer =
            GBuffer { width: 8, height: 8, frames: 2, label: (0..128).map(|i| if own(i) { 1 } else { 2 }).collect(), uv: uv.into() };
        let grid = KeyGrid::new(&gbuffer, 3, 8, false, [TIME_LINEAR, SPACE_LINEAR]);
        let label = |rect| Label { rect, masked: false, fixed: None };
        let image = SourceImage {
            width: 64,
            height: 16,
            kind: TexelKind::Indexed8,
            texels: (0..64 * 16).map(|at| u16::from(at % 64 >= 20)).collect(),
            palette: vec![[0; 3], [255; 3]],
            covered: vec![true; 64 * 16].into(),
            outline: Outline { finer: 0, bits: vec![true; 64 * 16].into() },
            labels: vec![label([60, 0, 64, 4]), label([0, 0, 16, 16]), label([20, 0, 28, 8])],
        };
        let mut sheets = sheets::find(&gbuffer, &grid, 1);
        (sheets.lists[0], sheets.tests[0]) = (vec![1, 2], test);
        let layers = Layers::of(&grid, &sheets);
        let of = |&label: &u8| if label == 1 { [16.0 + beyond, 4.5] } else { [24.0, 4.5] };
        let fit = Fit { uv: layers.label.iter().map(of).collect(), weight: vec![0.0; layers.label.len()] };
        let evidence =
            Evidence { gbuffer: &gbuffer, grid: &grid, image: &image, layers: &layers, fit: &fit, field_price: 4, coverage: Coverage::All };
        let weights = weights(&evidence, &sheets);
        assert!(weights.iter().zip(&layers.label).all(|(&weight, &label)| label == 1 || weight == 0.0), "what is last is not tested");
        weights
    }

    #[test]
    fn positions_by_an_edge_matter_for_what_lies_across_it() {
        let all = |beyond: f32, test: u16| weights_of(beyond, test).iter().sum::<f32>();
        let (close, near, far) = (all(0.5, CHART), all(3.0, CHART), all(9.0, CHART));
        assert!(close > 0.0 && (close / near - 16.0).abs() < 1e-3, "{close}, {near}: four times as far off a sixteenth");
        assert_eq!(far, 0.0, "no error is as large");
        // Inside, the others are wrong already, and its own pixel has far more at stake than nothing.
        let inside = all(-0.5, CHART);
        assert!(inside > 0.0 && inside < close / 16.0, "{inside}");
        assert_eq!(all(0.5, cubist_core::lists::FIELD), 0.0, "fields do not look at positions");
    }
}
