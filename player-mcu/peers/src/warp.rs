//! The bare affine warp: a grid of 40 x 30 cells of 8 pixels over a 256 x 256 texture of one byte a texel with a palette, the nearest texel, and
//! nothing else: no layers, no outlines, no keys. Nodes come from `cubist-beside`, which runs the same code to know the pixels.
//!
//! Both coordinates are in one word, v above u, 8.8 each: one addition steps both. Cells keep where they stand in memory from row to row: taken
//! across a whole cell in registers, positions would be a recurrence of second order, which compiles to more.

/// Nodes of a row: 41 positions.
pub const NODES: usize = 41;

/// Rows of nodes of a frame.
pub const NODE_ROWS: usize = 31;

/// Where a cell stands: position, step to the right, step down, and what a row down adds to the step to the right.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    at: u32,
    right: u32,
    down: u32,
    twist: u32,
}

impl Cell {
    /// One that stands nowhere.
    pub const NEW: Self = Self { at: 0, right: 0, down: 0, twist: 0 };
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
pub fn set_up(above: &[u32; NODES], below: &[u32; NODES], cells: &mut [Cell; 40]) {
    let mut left = eighth(below[0].wrapping_sub(above[0]));
    for (i, cell) in cells.iter_mut().enumerate() {
        let next = eighth(below[i + 1].wrapping_sub(above[i + 1]));
        let right = eighth(above[i + 1].wrapping_sub(above[i]));
        *cell = Cell { at: above[i], right, down: left, twist: eighth(next.wrapping_sub(left)) };
        left = next;
    }
}

/// Draws a row of pixels, two in a word, and moves the cells a row down.
#[inline(never)]
pub fn row(cells: &mut [Cell; 40], texels: &[u8; 1 << 16], palette: &[u16; 256], out: &mut [u32; 160]) {
    let colour = |at: u32| u32::from(palette[usize::from(texels[(at >> 24 | at & 0xff00) as usize])]);
    for (cell, eight) in cells.iter_mut().zip(out.as_chunks_mut::<4>().0) {
        let (mut at, right) = (cell.at, cell.right);
        let mut two = || {
            let first = colour(at);
            at = at.wrapping_add(right);
            let second = colour(at);
            at = at.wrapping_add(right);
            first | second << 16
        };
        *eight = [two(), two(), two(), two()];
        cell.at = cell.at.wrapping_add(cell.down);
        cell.right = cell.right.wrapping_add(cell.twist);
    }
}
