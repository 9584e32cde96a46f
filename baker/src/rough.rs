//! Roughness: whether surfaces bend between the corners of cells in ways that no curve through rays follows. Where they do, straight space shows as much,
//! and there is no need to try both. The G-buffer comes in from `job`, which starts with straight space then.

use crate::gbuffer::GBuffer;
use rayon::prelude::*;

/// Frames looked at: every so many.
const EVERY: usize = 4;
/// A place that is farther than this from where a straight line has it is on another part of the surface, texels.
const FAR: f32 = 16.0;
/// Surfaces are rough where curves leave at least this share of the squared error of straight lines. On land and among leaves they leave .97 to 1.2, in rooms
/// and on most models .0 to .8. Between these a scene gains up to .3 dB from curves, or nothing.
const LEFT: f64 = 0.97;
/// Less than this share of all cells does not tell.
const FEW: f64 = 0.01;

/// Squared errors, texels squared, of positions between nodes, and the cells they were told in.
#[derive(Clone, Copy, Default)]
struct Errors {
    straight: f64,
    curved: f64,
    whole: u32,
    cells: u32,
}

impl Errors {
    fn add(self, other: Self) -> Self {
        Self {
            straight: self.straight + other.straight,
            curved: self.curved + other.curved,
            whole: self.whole + other.whole,
            cells: self.cells + other.cells,
        }
    }
}

/// Whether what is seen in cells of `cell` pixels is rough.
#[must_use]
pub(crate) fn rough(gbuffer: &GBuffer, cell: u32) -> bool {
    let frames: Vec<usize> = (0..gbuffer.frames as usize).step_by(EVERY).collect();
    let parts: Vec<Errors> = frames.into_par_iter().map(|frame| of(gbuffer, cell as usize, frame)).collect();
    // In the order of the frames: the same sum on any number of threads.
    let all = parts.into_iter().fold(Errors::default(), Errors::add);
    f64::from(all.whole) > FEW * f64::from(all.cells) && all.straight > 0.0 && all.curved >= LEFT * all.straight
}

/// The errors in one frame: of cells that show one surface, as those around them do.
fn of(gbuffer: &GBuffer, cell: usize, frame: usize) -> Errors {
    let [width, height] = [gbuffer.width, gbuffer.height].map(|side| side as usize);
    let mut all = Errors::default();
    for y in (0..height.saturating_sub(3 * cell)).step_by(cell) {
        for x in (0..width.saturating_sub(3 * cell)).step_by(cell) {
            let at = |across: usize, down: usize| (frame * height + y + down) * width + x + across;
            let label = gbuffer.label[at(0, 0)];
            let row = |down: usize| &gbuffer.label[at(0, down)..=at(3 * cell, down)];
            let whole = label != 0 && (0..=3 * cell).all(|down| row(down).iter().all(|&other| other == label));
            let found = if whole { errors(cell, |across, down| gbuffer.uv[at(across, down)]) } else { None };
            let [straight, curved] = found.unwrap_or_default();
            all = all.add(Errors { straight, curved, whole: u32::from(found.is_some()), cells: 1 });
        }
    }
    all
}

/// The squared errors in a cell, straight and curved, of positions told by `at`, from the corner of the cell before it on; `None` where some are far off.
fn errors(cell: usize, at: impl Fn(usize, usize) -> [f32; 2]) -> Option<[f64; 2]> {
    let nodes: [[[f32; 2]; 4]; 4] = std::array::from_fn(|j| std::array::from_fn(|i| at(i * cell, j * cell)));
    let turned: [[[f32; 2]; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| nodes[j][i]));
    if nodes.iter().chain(&turned).flat_map(|line| line.windows(3)).any(jump) {
        return None;
    }
    let mut sums = [0.0; 2];
    for down in 0..cell {
        for across in 0..cell {
            let [a, b] = [across, down].map(|pixels| pixels as f32 / cell as f32);
            let exact = at(cell + across, cell + down);
            let off = |way: fn([f32; 4], f32) -> f32| {
                let [u, v] = [0, 1].map(|k| exact[k] - way(nodes.map(|row| way(row.map(|node| node[k]), a)), b));
                u * u + v * v
            };
            let [straight, curved] = [off(line), off(curve)];
            if straight > FAR * FAR {
                return None;
            }
            sums = [sums[0] + f64::from(straight), sums[1] + f64::from(curved)];
        }
    }
    Some(sums)
}

/// Whether one of three nodes in a line is on another part of the surface.
fn jump(three: &[[f32; 2]]) -> bool {
    (0..2).any(|k| (three[0][k] - 2.0 * three[1][k] + three[2][k]).abs() > FAR)
}

/// Straight between the two in the middle.
fn line([_, b, c, _]: [f32; 4], t: f32) -> f32 {
    b + t * (c - b)
}

/// On the curve through all four (E. Catmull and R. Rom, "A class of local interpolating splines", 1974).
fn curve([a, b, c, d]: [f32; 4], t: f32) -> f32 {
    b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
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
        assert!(!rough(&seen(96, |x, y| 0.02 * x * x + 0.01 * x * y), 8), "a slant");
        assert!(!rough(&seen(96, |x, _| 0.01 * x * x + if x < 32.0 { 0.0 } else { 100.0 }), 8), "one with a fold, which is no bend");
        assert!(!rough(&seen(96, |x, _| x), 8), "none");
        assert!(!rough(&seen(96, waves), 2), "waves of three cells");
        assert!(rough(&seen(96, waves), 8), "waves of less than a cell");
    }

    #[test]
    fn where_little_is_whole_nothing_is_rough() {
        assert!(!rough(&seen(16, waves), 8), "charts of two cells");
        assert!(!rough(&seen(96, |x, y| x + 50.0 * waves(x, y)), 8), "so far off that it is another part of the surface");
    }
}
