//! Causes: why cells of the key-ray grid are torn into several sheets.
//! Labels come from the G-buffer, tears from `tears`, sheets from `sheets`; the shares go to the report.

use crate::gbuffer::{GBuffer, Hits, Lens};
use crate::scene::Scene;
use crate::sheets::{KeyGrid, Sheets};
use crate::tears::{DOWN, NEXT, RIGHT};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A surface goes on over a gap of up to this many pixels' footprints.
const FOOTPRINTS: f64 = 3.0;
/// ... and over a wider one that leaves the plane of either face by less than this share.
const LEVEL: f64 = 0.05;

/// Shares of all cells and intervals, %, that are torn, each by the cause that most of its neighbouring pixels tell; one whose pixels tell none is in no
/// share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Causes {
    /// Charts of one surface meet.
    pub seam: f64,
    /// A surface ends before the background.
    pub silhouette: f64,
    /// A surface hides another.
    pub occlusion: f64,
    /// A chart hides a part of itself.
    pub fold: f64,
}

/// One byte a pixel of the G-buffer: [`RIGHT`], [`DOWN`] and [`NEXT`] where the pixel there sees another chart, and the surface goes on.
#[must_use]
pub fn seams(scene: &Scene, hits: &Hits, gbuffer: &GBuffer) -> Vec<u8> {
    let (width, height) = (gbuffer.width as usize, gbuffer.height as usize);
    let mut seams = vec![0u8; gbuffer.label.len()];
    seams.par_chunks_mut(width.max(1)).enumerate().for_each(|(line, out)| {
        let (frame, y) = (line / height, line % height);
        let lens = Lens::new(scene, frame as u32);
        for (x, bits) in out.iter_mut().enumerate() {
            let pixel = line * width + x;
            let others = [
                (RIGHT, pixel + 1, x + 1 < width),
                (DOWN, pixel + width, y + 1 < height),
                (NEXT, pixel + width * height, frame + 1 < gbuffer.frames as usize),
            ];
            for (bit, other, exists) in others {
                if exists && goes_on(scene, hits, gbuffer, &lens, [pixel, other]) {
                    *bits |= bit;
                }
            }
        }
    });
    seams
}

/// Whether two pixels see different charts of a surface that goes on between them.
fn goes_on(scene: &Scene, hits: &Hits, gbuffer: &GBuffer, lens: &Lens, pixels: [usize; 2]) -> bool {
    let labels = pixels.map(|pixel| gbuffer.label[pixel]);
    if labels[0] == labels[1] || labels.contains(&0) {
        return false;
    }
    let [from, to] = pixels.map(|pixel| hits.samples[pixel].point(scene));
    let gap = from.distance(to);
    let off = pixels.map(|pixel| (to - from).dot(hits.samples[pixel].normal(scene)).abs());
    gap < FOOTPRINTS * from.distance(lens.eye) / lens.focal || off[0].min(off[1]) < LEVEL * gap
}

/// Counts the torn cells of `sheets` by cause; `tears` and `seams` have a byte a pixel of the G-buffer.
#[must_use]
pub fn count(gbuffer: &GBuffer, tears: &[u8], seams: &[u8], grid: &KeyGrid, sheets: &Sheets) -> Causes {
    let cells = grid.grid.cells();
    let of = |index: usize| {
        let (interval, cell) = (index / cells, index % cells);
        let mut votes = [0u32; 4];
        let [columns, rows] = grid.pixels(cell);
        let frames = grid.frames_of(interval);
        for frame in frames.clone() {
            grid.each_pixel(frame, cell, |pixel, _| {
                let (x, y) = (pixel % grid.size[0], pixel / grid.size[0] % grid.size[1]);
                let others = [
                    (RIGHT, pixel + 1, x + 1 < columns.end),
                    (DOWN, pixel + grid.size[0], y + 1 < rows.end),
                    (NEXT, pixel + grid.size[0] * grid.size[1], frame + 1 < frames.end),
                ];
                for (bit, other, inside) in others {
                    if !inside {
                        continue;
                    }
                    let labels = [gbuffer.label[pixel], gbuffer.label[other]];
                    if labels[0] == labels[1] {
                        votes[3] += u32::from(tears[pixel] & bit != 0);
                    } else if labels.contains(&0) {
                        votes[1] += 1;
                    } else {
                        votes[if seams[pixel] & bit != 0 { 0 } else { 2 }] += 1;
                    }
                }
            });
        }
        // Of equals the first.
        (0..4).filter(|&cause| votes[cause] > 0).max_by_key(|&cause| (votes[cause], std::cmp::Reverse(cause)))
    };
    let torn = (0..sheets.lists.len()).into_par_iter().filter(|&index| sheets.lists[index].len() > 1).filter_map(of);
    let counts = torn
        .fold(
            || [0u64; 4],
            |mut sum, cause| {
                sum[cause] += 1;
                sum
            },
        )
        .reduce(|| [0; 4], |a, b| [0, 1, 2, 3].map(|k| a[k] + b[k]));
    let [seam, silhouette, occlusion, fold] = counts.map(|count| 100.0 * count as f64 / sheets.lists.len().max(1) as f64);
    Causes { seam, silhouette, occlusion, fold }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{Settings, flatten};
    use crate::scene::builtin;
    use crate::sheets;

    fn causes(name: &str, sky: bool) -> (Causes, f64) {
        let mut scene = builtin::build(name).expect("a built-in scene");
        scene.triangles.retain(|t| sky || t.position.iter().all(|p| p.length() < 100.0));
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (80, 60, 8);
        let settings = Settings::default();
        let flat = flatten(&scene, &settings.atlas, &|_, _| {}).expect("a source image");
        let gbuffer = &flat.atlas.gbuffer;
        let grid = KeyGrid::new(gbuffer, 3, 4, false, [settings.time, settings.space]);
        let sheets = sheets::find(gbuffer, &grid, 1);
        let torn = sheets.lists.iter().filter(|list| list.len() > 1).count();
        (count(gbuffer, &flat.tears, &flat.seams, &grid, &sheets), 100.0 * torn as f64 / sheets.lists.len() as f64)
    }

    #[test]
    fn every_torn_cell_has_one_cause() {
        for name in ["street", "torus", "columns"] {
            let (found, torn) = causes(name, true);
            let sum = found.seam + found.silhouette + found.occlusion + found.fold;
            assert!((sum - torn).abs() < 1e-9, "{name}: {found:?}, but {torn} % are torn");
        }
    }

    #[test]
    fn causes_are_told_apart() {
        // A street's fronts meet in corners and hide each other; columns stand before a wall and a floor.
        let (street, _) = causes("street", true);
        assert!(street.seam > 1.0, "{street:?}");
        let (columns, _) = causes("columns", true);
        assert!(columns.occlusion > columns.silhouette, "{columns:?}");
        let (pyramid, _) = causes("pyramid", true);
        assert!(pyramid.seam > 1.0 && pyramid.silhouette == 0.0 && pyramid.fold == 0.0, "{pyramid:?}");
        // Without its sky it stands before the background.
        let (bare, _) = causes("pyramid", false);
        assert!(bare.silhouette > 1.0 && bare.seam == pyramid.seam, "{bare:?}");
    }
}
