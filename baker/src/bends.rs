//! Bends: which kind of space suits surfaces, told beforehand by how they bend between the corners of cells.
//! The G-buffer comes from `job`; the answer goes to `straight`.
//!
//! Where surfaces are so rough that no curve follows them, straight lines show as much as curves. Where curves follow them and straight lines are
//! far off, straight lines show less. In between nothing is told, and both are tried.

use crate::camera::segment;
use crate::gbuffer::GBuffer;
use glam::DVec2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Frames looked at: every so many.
const EVERY: usize = 4;
/// A place that is farther than this from where a straight line has it is on another part of the surface, texels.
const FAR: f64 = 16.0;
/// Surfaces are rough where curves leave at least this share of the squared error of straight lines. On land and among leaves they leave .97 to 1.2, in rooms
/// and on most models .0 to .8. Between these a scene gains up to .3 dB from curves, or nothing.
const ROUGH: f64 = 0.97;
/// They are smooth where curves leave at most this share of it,
const SMOOTH: f64 = 0.05;
/// straight lines are this far off, texels, the mean of such cells as tell,
const OFF: f64 = 0.05;
/// and these are this share of all. It is most built-in scenes and rooms, which lose .4 dB or more by straight lines; a room that lost nothing had a mean of .033.
const MANY: f64 = 0.15;
/// Less than this share of all cells does not tell that they are rough.
const FEW: f64 = 0.01;

/// How surfaces bend between nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bends {
    /// So that no curve follows them.
    Rough,
    /// So that curves follow them, and no straight lines.
    Smooth,
}

/// What positions between nodes are off by, and in how many cells that is known.
#[derive(Clone, Copy, Default)]
struct Errors {
    /// From straight lines, and from curves: squared, texels squared, the mean of a cell's pixels.
    squared: [f64; 2],
    /// From straight lines, texels, the mean of a cell's pixels; a texel counts most.
    off: f64,
    /// Cells that show one surface, as those around them do.
    whole: u32,
    cells: u32,
}

impl Errors {
    fn add(self, other: Self) -> Self {
        Self {
            squared: [0, 1].map(|k| self.squared[k] + other.squared[k]),
            off: self.off + other.off,
            whole: self.whole + other.whole,
            cells: self.cells + other.cells,
        }
    }
}

/// How what is seen bends in cells of `cell` pixels; `None`: somewhere in between.
#[must_use]
pub(crate) fn of(gbuffer: &GBuffer, cell: u32) -> Option<Bends> {
    let frames: Vec<usize> = (0..gbuffer.frames as usize).step_by(EVERY).collect();
    let parts: Vec<Errors> = frames.into_par_iter().map(|frame| frame_errors(gbuffer, cell as usize, frame)).collect();
    // In the order of the frames: the same sum on any number of threads.
    let Errors { squared: [straight, curved], off, whole, cells } = parts.into_iter().fold(Errors::default(), Errors::add);
    let [whole, cells] = [whole, cells].map(f64::from);
    if whole > FEW * cells && straight > 0.0 && curved >= ROUGH * straight {
        Some(Bends::Rough)
    } else if whole > MANY * cells && off >= OFF * whole && curved <= SMOOTH * straight {
        Some(Bends::Smooth)
    } else {
        None
    }
}

/// Those of one frame.
fn frame_errors(gbuffer: &GBuffer, cell: usize, frame: usize) -> Errors {
    let [width, height] = [gbuffer.width, gbuffer.height].map(|side| side as usize);
    let mut all = Errors::default();
    for y in (0..height.saturating_sub(3 * cell)).step_by(cell) {
        for x in (0..width.saturating_sub(3 * cell)).step_by(cell) {
            let at = |across: usize, down: usize| (frame * height + y + down) * width + x + across;
            let label = gbuffer.label[at(0, 0)];
            let row = |down: usize| &gbuffer.label[at(0, down)..=at(3 * cell, down)];
            let whole = label != 0 && (0..=3 * cell).all(|down| row(down).iter().all(|&other| other == label));
            let found =
                if whole { cell_errors(cell, |across, down| DVec2::from(gbuffer.uv[at(across, down)].map(f64::from))) } else { None };
            all = all.add(Errors { cells: 1, ..found.unwrap_or_default() });
        }
    }
    all
}

/// Those of one cell of positions that `at` tells, from the corner of the cell before it on; `None` where some are far off.
fn cell_errors(cell: usize, at: impl Fn(usize, usize) -> DVec2) -> Option<Errors> {
    let nodes: [[DVec2; 4]; 4] = std::array::from_fn(|j| std::array::from_fn(|i| at(i * cell, j * cell)));
    let turned: [[DVec2; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| nodes[j][i]));
    if nodes.iter().chain(&turned).flat_map(|line| line.windows(3)).any(jump) {
        return None;
    }
    let (mut squared, mut off) = ([0.0; 2], 0.0);
    for down in 0..cell {
        for across in 0..cell {
            let [a, b] = [across, down].map(|pixels| pixels as f64 / cell as f64);
            let exact = at(cell + across, cell + down);
            let error = |way: fn([DVec2; 4], f64) -> DVec2| exact.distance_squared(way(nodes.map(|row| way(row, a)), b));
            let [straight, curved] = [error(line), error(segment)];
            if straight > FAR * FAR {
                return None;
            }
            squared = [squared[0] + straight, squared[1] + curved];
            off += straight.sqrt().min(1.0);
        }
    }
    let pixels = (cell * cell) as f64;
    Some(Errors { squared: squared.map(|sum| sum / pixels), off: off / pixels, whole: 1, ..Errors::default() })
}

/// Why one kind of space was not tried, in a line.
#[must_use]
pub fn reason(bends: Bends) -> &'static str {
    match bends {
        Bends::Rough => "surfaces are rough: curves between nodes would follow them no better, and were not tried",
        Bends::Smooth => "surfaces bend smoothly: straight lines between nodes would be far off, and were not tried",
    }
}

/// Whether one of three nodes in a line is on another part of the surface.
fn jump(three: &[DVec2]) -> bool {
    (three[0] - 2.0 * three[1] + three[2]).abs().max_element() > FAR
}

/// Straight between the two in the middle.
fn line([_, b, c, _]: [DVec2; 4], t: f64) -> DVec2 {
    b.lerp(c, t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Charts as wide as this, of which pixels see these positions.
    fn seen(wide: usize, position: fn(f32, f32) -> f32) -> GBuffer {
        let (width, height) = (96usize, 48usize);
        let pixels = || (0..width * height).map(|at| (at % width, at / width));
        let uv: Vec<[f32; 2]> = pixels().map(|(x, y)| [position(x as f32, y as f32), y as f32]).collect();
        let label = pixels().map(|(x, _)| 1 + (x / wide) as u16).collect();
        GBuffer { width: width as u32, height: height as u32, frames: 1, label, uv: uv.into() }
    }

    fn waves(x: f32, y: f32) -> f32 {
        x + libm::sinf(1.1 * x + 0.7 * y)
    }

    #[test]
    fn curves_follow_what_is_smooth() {
        assert_eq!(of(&seen(96, |x, y| 0.02 * x * x + 0.01 * x * y), 8), Some(Bends::Smooth), "a slant");
        assert_eq!(
            of(&seen(96, |x, _| 0.02 * x * x + if x < 32.0 { 0.0 } else { 100.0 }), 8),
            Some(Bends::Smooth),
            "with a fold, which is no bend"
        );
        assert_eq!(of(&seen(96, |x, _| 0.001 * x * x), 8), None, "one that no straight line is far from");
        assert_eq!(of(&seen(96, |x, _| x), 8), None, "no bend at all");
        assert_eq!(of(&seen(96, waves), 2), None, "waves of three cells");
        assert_eq!(of(&seen(96, waves), 8), Some(Bends::Rough), "waves of less than a cell");
    }

    #[test]
    fn where_little_is_whole_nothing_is_known() {
        assert_eq!(of(&seen(16, waves), 8), None, "charts of two cells");
        assert_eq!(of(&seen(96, |x, y| x + 50.0 * waves(x, y)), 8), None, "so far off that it is another part of the surface");
    }
}
