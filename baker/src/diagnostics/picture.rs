//! A picture of the source image, enlarged, that figures and rays are drawn on.
//! Texels come from `maps` and `rays`; a PNG file goes out.

use anyhow::Result;
use cubist_baker::files::write_png;
use std::path::Path;

/// Width of enlarged pictures of the source image, pixels: a whole number for a texel.
pub const SIDE: u32 = 1024;

/// A picture [`SIDE`] pixels wide.
pub struct Picture {
    /// Red, green, blue, row by row.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// Texels of a source image of `width` texels a row, each as a square.
    pub fn enlarged(texels: &[[u8; 3]], width: u32) -> Self {
        let scale = (SIDE / width) as usize;
        let row = |row: &[[u8; 3]]| -> Vec<[u8; 3]> { row.iter().flat_map(|&texel| std::iter::repeat_n(texel, scale)).collect() };
        Self { pixels: texels.chunks(width as usize).flat_map(|texels| row(texels).repeat(scale)).collect() }
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.pixels.len() as u32 / SIDE
    }

    /// Fills a rectangle: left, top, right, bottom.
    pub fn fill(&mut self, [left, top, right, bottom]: [u32; 4], colour: [u8; 3]) {
        for y in top..bottom {
            self.pixels[(y * SIDE + left) as usize..(y * SIDE + right) as usize].fill(colour);
        }
    }

    /// Writes it as a PNG file.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_png(path, SIDE, self.pixels.as_flattened())
    }
}
