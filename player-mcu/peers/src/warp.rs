//! The bare affine warp: a grid of 40 x 30 cells of 8 pixels over a 256 x 256 texture of one byte a texel with a palette, the nearest texel, and
//! nothing else: no layers, no outlines, no keys. Nodes come from `cubist-beside`, which runs the same code to know the pixels.
//!
//! Both coordinates are in one word, u above v, 8.8 each: one addition steps both. A row of pixels goes on from cell to cell without a new start, and
//! what dividing by eight leaves over goes into the next cell's steps. Steps stay in memory from row to row: taken down a whole cell in
//! registers, positions would be a recurrence of second order, which compiles to more.

/// Nodes of a row: 41 positions.
pub const NODES: usize = 41;

/// Rows of nodes of a frame.
pub const NODE_ROWS: usize = 31;

/// A cell's step to the right, and what a row down adds to it.
#[derive(Clone, Copy, Debug)]
struct Step {
    right: u32,
    twist: u32,
}

/// A row of cells: where its next row of pixels starts, the step down, and the steps of every cell.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    at: u32,
    down: u32,
    steps: [Step; NODES - 1],
}

impl Cells {
    /// Some that stand nowhere.
    pub const NEW: Self = Self { at: 0, down: 0, steps: [Step { right: 0, twist: 0 }; NODES - 1] };
}

/// An eighth of a difference of two positions, each half by itself.
#[inline(always)]
fn eighth(difference: u32) -> u32 {
    // The lower half is signed, and has borrowed from the upper where it is below zero.
    let low = i32::from(difference as i16);
    let high = (difference as i32).wrapping_sub(low) >> 16;
    (((high >> 3) << 16) as u32).wrapping_add((low >> 3) as u32)
}

/// Sets a row of cells up between the nodes above and below.
#[inline(never)]
pub fn set_up(above: &[u32; NODES], below: &[u32; NODES], cells: &mut Cells) {
    cells.at = above[0];
    cells.down = eighth(below[0].wrapping_sub(above[0]));
    // Where the first row of pixels, and the one eight below it, really are.
    let (mut upper, mut lower) = (above[0], above[0].wrapping_add(cells.down << 3));
    for (i, step) in cells.steps.iter_mut().enumerate() {
        let right = eighth(above[i + 1].wrapping_sub(upper));
        let twist = eighth(eighth(below[i + 1].wrapping_sub(lower)).wrapping_sub(right));
        *step = Step { right, twist };
        upper = upper.wrapping_add(right << 3);
        lower = lower.wrapping_add(right.wrapping_add(twist << 3) << 3);
    }
}

/// Draws a row of pixels, two in a word, and moves the cells a row down.
#[inline(never)]
pub fn row(cells: &mut Cells, texels: &[u8; 1 << 16], palette: &[u16; 256], out: &mut [u32; 160]) {
    let colour = |at: u32| u32::from(palette[usize::from(texels[(at >> 24 | at & 0xff00) as usize])]);
    let mut at = cells.at;
    for (step, eight) in cells.steps.iter_mut().zip(out.as_chunks_mut::<4>().0) {
        let right = step.right;
        let mut two = || {
            let first = colour(at);
            at = at.wrapping_add(right);
            let second = colour(at);
            at = at.wrapping_add(right);
            first | second << 16
        };
        // Stored one by one: an array of four would be four registers.
        let [a, b, c, d] = eight;
        *a = two();
        *b = two();
        *c = two();
        *d = two();
        step.right = right.wrapping_add(step.twist);
    }
    cells.at = cells.at.wrapping_add(cells.down);
}
