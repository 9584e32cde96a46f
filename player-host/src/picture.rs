//! A picture as the device shows it: RGB565 pixels from the playback core, and the same pixels with 8 bits a channel.
//! Filled from a `Player` row by row; read by `canvas` for the window and by `render` for files.

use cubist_core::{AnyTexels, Frame, Work};
use image::RgbImage;

/// The desktop's player: of texels of every kind.
pub type Player<'a> = cubist_core::Player<'a, AnyTexels>;

/// One of the player's ways to draw a row.
pub type Draw = fn(&mut Player<'_>, u32, &mut [u16]);

/// Width x height RGB565 pixels, row 0 on top.
pub struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<u16>,
    /// How the player draws a row.
    draw: Draw,
}

impl Picture {
    /// A black picture of `width` x `height` pixels.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![0; width as usize * height as usize], draw: |player, y, row| player.row(y, row) }
    }

    /// The same picture, drawn in another way from now on.
    pub fn drawn_by(self, draw: Draw) -> Self {
        Self { draw, ..self }
    }

    /// Plays `frame` into the picture, which has the bundle's size; what that took comes back.
    pub fn play(&mut self, player: &mut Player<'_>, frame: u32) -> Work {
        player.seek(Frame(frame));
        for y in 0..self.height {
            (self.draw)(player, y, self.row_mut(y));
        }
        player.work()
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Row `y`, which must lie in the picture.
    pub fn row(&self, y: u32) -> &[u16] {
        let start = y as usize * self.width as usize;
        &self.pixels[start..start + self.width as usize]
    }

    fn row_mut(&mut self, y: u32) -> &mut [u16] {
        let start = y as usize * self.width as usize;
        &mut self.pixels[start..start + self.width as usize]
    }

    /// The picture with 8 bits a channel, every pixel a square of `scale` x `scale`.
    pub fn to_rgb(&self, scale: u32) -> RgbImage {
        let scale = scale.max(1);
        RgbImage::from_fn(self.width * scale, self.height * scale, |x, y| image::Rgb(expand(self.row(y / scale)[(x / scale) as usize])))
    }

    /// A picture with the pixels that `at(x, y)` gives.
    #[cfg(test)]
    pub fn from_fn(width: u32, height: u32, at: impl Fn(u32, u32) -> u16) -> Self {
        let mut picture = Self::new(width, height);
        for y in 0..height {
            for (x, pixel) in (0u32..).zip(picture.row_mut(y)) {
                *pixel = at(x, y);
            }
        }
        picture
    }
}

/// Red, green and blue of an RGB565 pixel; the high bits repeat below, so that black and white stay black and white.
pub fn expand(pixel: u16) -> [u8; 3] {
    let [red, green, blue] = [pixel >> 11, (pixel >> 5) & 63, pixel & 31];
    [(red << 3 | red >> 2) as u8, (green << 2 | green >> 4) as u8, (blue << 3 | blue >> 2) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_expand_to_their_full_range() {
        assert_eq!(expand(0), [0, 0, 0]);
        assert_eq!(expand(0xffff), [255, 255, 255]);
        assert_eq!(expand(16 << 11 | 1 << 5 | 1), [132, 4, 8]);
        assert_eq!(expand(32 << 5 | 16), [0, 130, 132]);
    }

    #[test]
    fn scaling_repeats_pixels() {
        let picture = Picture::from_fn(2, 1, |x, _| if x == 0 { 0xf800 } else { 0x001f });
        let rgb = picture.to_rgb(2);
        assert_eq!(rgb.dimensions(), (4, 2));
        let row: Vec<_> = rgb.rows().nth(1).unwrap().map(|p| p.0).collect();
        assert_eq!(row, [[255, 0, 0], [255, 0, 0], [0, 0, 255], [0, 0, 255]]);
    }
}
