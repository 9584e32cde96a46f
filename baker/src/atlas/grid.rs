//! Grids: where a chart's colour samples lie, in the coordinates that its faces are triangles in.
//! Charts and places come in; `footprint` and `fill` go through the samples that a face covers.

use super::place::Place;
use crate::chart::Charting;

/// The samples of a chart's rectangle.
pub(super) struct Grid {
    place: Place,
    /// Samples a texel in each direction.
    fine: f64,
    /// Where the columns lie, and the rows, and how far apart, ascending or descending: in samples, or in flattened coordinates if the chart is warped.
    at: [Vec<f64>; 2],
    warped: bool,
}

impl Grid {
    pub fn new(charting: &Charting, chart: usize, place: Place, fine: u32) -> Self {
        let rect = place.rect;
        let warp = charting.warps.get(chart).and_then(Option::as_ref);
        let at = [0, 1].map(|k| {
            let along = k ^ usize::from(place.swap);
            let centres = (0..(rect[k + 2] - rect[k]) * fine).map(|i| f64::from(i) + 0.5);
            match warp {
                None => centres.collect(),
                Some(warp) => centres
                    .map(|at| warp[along].back((f64::from(rect[k]) + at / f64::from(fine) - place.origin[k]) / place.step[k]))
                    .collect(),
            }
        });
        Self { place, fine: f64::from(fine), at, warped: warp.is_some() }
    }

    /// Flattened lengths that a texel covers around a sample, as the side of a square.
    pub fn texel(&self, sample: [usize; 2]) -> f64 {
        if !self.warped {
            return self.place.texel();
        }
        let step = |k: usize| match self.at[k].as_slice() {
            [_, .., _] => {
                let at = &self.at[k];
                let (a, b) = (sample[k].saturating_sub(1), (sample[k] + 1).min(at.len() - 1));
                (at[b] - at[a]).abs() / (b - a) as f64 * self.fine
            }
            _ => 1.0 / self.place.step[k].abs(),
        };
        (step(0) * step(1)).sqrt()
    }

    /// Calls `f` with the column, the row and the barycentric weights of every sample that lies in face `face` or at most `edge` of it beyond.
    pub fn each_sample(&self, charting: &Charting, face: usize, edge: f64, mut f: impl FnMut(u32, u32, [f64; 2])) {
        let [p, q, r] = charting.outline(face).map(|c| {
            if self.warped {
                return if self.place.swap { [c[1], c[0]] } else { [c[0], c[1]] };
            }
            let at = self.place.at(c);
            [0, 1].map(|k| (at[k] - f64::from(self.place.rect[k])) * self.fine)
        });
        let det = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        let long = [0, 1].map(|k| p[k].max(q[k]).max(r[k]) - p[k].min(q[k]).min(r[k]));
        if det.abs() < if self.warped { 1e-12 * long[0] * long[1] } else { 1e-12 } {
            return;
        }
        let range = |k: usize| {
            let (lo, hi, room) = (p[k].min(q[k]).min(r[k]), p[k].max(q[k]).max(r[k]), edge * long[k]);
            let (at, down) = (&self.at[k], self.at[k].first() > self.at[k].last());
            let first = at.partition_point(|&x| if down { x > hi + room } else { x < lo - room });
            let end = at.partition_point(|&x| if down { x >= lo - room } else { x <= hi + room });
            first..end
        };
        let columns = range(0);
        for j in range(1) {
            for i in columns.clone() {
                let at = [self.at[0][i] - p[0], self.at[1][j] - p[1]];
                let b = (at[0] * (r[1] - p[1]) - at[1] * (r[0] - p[0])) / det;
                let c = ((q[0] - p[0]) * at[1] - (q[1] - p[1]) * at[0]) / det;
                if b.min(c).min(1.0 - b - c) >= -edge {
                    f(i as u32, j as u32, [b, c]);
                }
            }
        }
    }
}
