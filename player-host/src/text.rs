//! Letters: embedded-graphics' mono fonts on the canvas.
//! Strings come in from `overlay`; dots, each a square of whole canvas pixels, go out to `canvas`.

use crate::canvas::Canvas;
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle, ascii::FONT_6X10, ascii::FONT_8X13};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Baseline, Text};
use std::convert::Infallible;

/// A font and the canvas pixels to one of its dots.
#[derive(Clone, Copy)]
pub struct Face {
    font: &'static MonoFont<'static>,
    scale: i32,
}

impl Face {
    /// The face for a window `width` pixels wide on a display of `ui` pixels to the point: small windows get small letters.
    pub fn fitting(width: i32, ui: i32) -> Self {
        let font = if width < 460 * ui { &FONT_6X10 } else { &FONT_8X13 };
        Self { font, scale: ui }
    }

    /// Width of one letter and height of one line, canvas pixels.
    pub fn cell(&self) -> (i32, i32) {
        let size = self.font.character_size;
        (size.width as i32 * self.scale, size.height as i32 * self.scale)
    }

    /// Writes `text` with its top left corner at (`x`, `y`); what reaches past the canvas is cut off.
    pub fn write(&self, canvas: &mut Canvas, x: i32, y: i32, text: &str, [red, green, blue]: [u8; 3]) {
        let mut target = Dots { canvas, x, y, scale: self.scale };
        let style = MonoTextStyle::new(self.font, Rgb888::new(red, green, blue));
        // Drawing into dots cannot fail: the error type has no value.
        let Ok(_) = Text::with_baseline(text, Point::zero(), style, Baseline::Top).draw(&mut target);
    }
}

/// The canvas as a grid of dots whose origin is (`x`, `y`).
struct Dots<'a> {
    canvas: &'a mut Canvas,
    x: i32,
    y: i32,
    scale: i32,
}

impl Dimensions for Dots<'_> {
    fn bounding_box(&self) -> embedded_graphics::primitives::Rectangle {
        let (width, height) = self.canvas.size();
        embedded_graphics::primitives::Rectangle::new(Point::zero(), Size::new(width, height))
    }
}

impl DrawTarget for Dots<'_> {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(point, colour) in pixels {
            let (x, y) = (self.x + point.x * self.scale, self.y + point.y * self.scale);
            self.canvas.dot(x, y, self.scale, [colour.r(), colour.g(), colour.b()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ascii(canvas: &Canvas) -> Vec<String> {
        let (width, height) = canvas.size();
        (0..height).map(|y| (0..width).map(|x| if canvas.at(x, y) == [0, 0, 0] { '.' } else { '#' }).collect()).collect()
    }

    #[test]
    fn letters_are_the_fonts() {
        let mut canvas = Canvas::new(12, 8).unwrap();
        Face::fitting(100, 1).write(&mut canvas, 0, 0, "1L", [9, 9, 9]);
        let expected = [
            "............",
            "..#...#.....",
            ".##...#.....",
            "#.#...#.....",
            "..#...#.....",
            "..#...#.....",
            "..#...#.....",
            "#####.#####.",
        ];
        assert_eq!(ascii(&canvas), expected);
    }

    #[test]
    fn letters_scale_by_whole_pixels_and_are_cut_at_the_edge() {
        let (mut small, mut large) = (Canvas::new(6, 10).unwrap(), Canvas::new(12, 20).unwrap());
        Face::fitting(100, 1).write(&mut small, 0, 0, "g", [1, 2, 3]);
        Face::fitting(100, 2).write(&mut large, 0, 0, "ggg", [1, 2, 3]);
        for y in 0..20 {
            for x in 0..12 {
                assert_eq!(large.at(x, y), small.at(x / 2, y / 2), "{x}, {y}");
            }
        }
        Face::fitting(100, 1).write(&mut small, -3, -3, "\u{fc}\n", [1, 2, 3]);
    }
}
