//! The canvas: everything that is drawn on the window, as tiny-skia pixels.
//! Pictures, shapes (`overlay`) and letters (`text`) come in; a row-major RGB buffer goes out to `window` and `headless`.
//! The only file that names tiny-skia.

use crate::picture::{Picture, expand};
use tiny_skia::{FillRule, Paint, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Transform};

/// Red, green, blue, opacity; not premultiplied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub [u8; 4]);

/// A rectangle in canvas pixels; it may reach outside the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Left edge.
    pub x: i32,
    /// Top edge.
    pub y: i32,
    /// Width, at least 0.
    pub width: i32,
    /// Height, at least 0.
    pub height: i32,
}

impl Area {
    /// Whether the point lies in the area.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let (left, top) = (f64::from(self.x), f64::from(self.y));
        x >= left && x < left + f64::from(self.width) && y >= top && y < top + f64::from(self.height)
    }
}

/// The window's content, width x height opaque pixels.
pub struct Canvas {
    pixels: Pixmap,
}

impl Canvas {
    /// A black canvas; none when a side is 0 or the memory cannot be addressed.
    pub fn new(width: u32, height: u32) -> Option<Self> {
        Some(Self { pixels: Pixmap::new(width, height)? })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.pixels.width(), self.pixels.height())
    }

    /// Covers everything with one opaque colour.
    pub fn clear(&mut self, Colour([red, green, blue, _]): Colour) {
        self.pixels.fill(tiny_skia::Color::from_rgba8(red, green, blue, 255));
    }

    /// Draws `picture` with its top left corner at (`left`, `top`), every pixel a square of `zoom` x `zoom`.
    ///
    /// Copied row by row: at whole zooms that is the nearest filter, without its cost per pixel.
    pub fn picture(&mut self, picture: &Picture, left: i32, top: i32, zoom: u32) {
        let (width, height) = (self.pixels.width() as i32, self.pixels.height() as i32);
        let zoom = zoom.max(1) as i32;
        let (columns, rows) = picture.size();
        let (first_x, last_x) = (left.max(0), (left + columns as i32 * zoom).min(width));
        let (first_y, last_y) = (top.max(0), (top + rows as i32 * zoom).min(height));
        if first_x >= last_x {
            return;
        }
        let pixels = self.pixels.pixels_mut();
        for y in first_y..last_y {
            let (start, end) = ((y * width + first_x) as usize, (y * width + last_x) as usize);
            if y > first_y && (y - top) % zoom != 0 {
                pixels.copy_within(start - width as usize..end - width as usize, start);
                continue;
            }
            let source = picture.row(((y - top) / zoom) as u32);
            for (x, pixel) in (first_x..last_x).zip(&mut pixels[start..end]) {
                let [red, green, blue] = expand(source[((x - left) / zoom) as usize]);
                *pixel = opaque(red, green, blue);
            }
        }
    }

    /// Blends a rectangle over what is there.
    pub fn rect(&mut self, area: Area, colour: Colour) {
        let rect = Rect::from_xywh(area.x as f32, area.y as f32, area.width as f32, area.height as f32);
        if let Some(rect) = rect {
            self.pixels.fill_rect(rect, &paint(colour), Transform::identity(), None);
        }
    }

    /// Blends a rectangle with half-round ends over what is there.
    pub fn pill(&mut self, area: Area, colour: Colour) {
        let radius = area.height as f32 / 2.0;
        let (left, right) = (area.x as f32 + radius, (area.x + area.width) as f32 - radius);
        let middle = area.y as f32 + radius;
        let mut path = PathBuilder::new();
        path.push_circle(left, middle, radius);
        path.push_circle(right.max(left), middle, radius);
        if let Some(rect) = Rect::from_ltrb(left, area.y as f32, right, (area.y + area.height) as f32) {
            path.push_rect(rect);
        }
        self.fill(path, colour);
    }

    /// Blends a disc over what is there.
    pub fn disc(&mut self, x: f32, y: f32, radius: f32, colour: Colour) {
        let mut path = PathBuilder::new();
        path.push_circle(x, y, radius);
        self.fill(path, colour);
    }

    /// Sets a square of `side` pixels, clipped to the canvas: one dot of a letter.
    pub fn dot(&mut self, x: i32, y: i32, side: i32, [red, green, blue]: [u8; 3]) {
        let (width, height) = (self.pixels.width() as i32, self.pixels.height() as i32);
        let pixels = self.pixels.pixels_mut();
        for y in y.max(0)..(y + side).min(height) {
            for x in x.max(0)..(x + side).min(width) {
                pixels[(y * width + x) as usize] = opaque(red, green, blue);
            }
        }
    }

    /// Copies the canvas into `out` as 0x00RRGGBB, as many pixels as both have.
    pub fn present(&self, out: &mut [u32]) {
        for (out, pixel) in out.iter_mut().zip(self.pixels.pixels()) {
            *out = u32::from_be_bytes([0, pixel.red(), pixel.green(), pixel.blue()]);
        }
    }

    /// Red, green and blue of a pixel that must lie on the canvas.
    #[cfg(test)]
    pub fn at(&self, x: u32, y: u32) -> [u8; 3] {
        let pixel = self.pixels.pixel(x, y).unwrap();
        [pixel.red(), pixel.green(), pixel.blue()]
    }

    fn fill(&mut self, path: PathBuilder, colour: Colour) {
        if let Some(path) = path.finish() {
            self.pixels.fill_path(&path, &paint(colour), FillRule::Winding, Transform::identity(), None);
        }
    }
}

/// The pixels of a window buffer (0x00RRGGBB, `width` to a row) as an image; missing pixels are black.
pub fn to_image(buffer: &[u32], width: u32, height: u32) -> image::RgbImage {
    image::RgbImage::from_fn(width, height, |x, y| {
        let pixel = buffer.get(y as usize * width as usize + x as usize).copied().unwrap_or(0);
        let [_, red, green, blue] = pixel.to_be_bytes();
        image::Rgb([red, green, blue])
    })
}

fn paint(Colour([red, green, blue, alpha]): Colour) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(red, green, blue, alpha);
    paint
}

fn opaque(red: u8, green: u8, blue: u8) -> PremultipliedColorU8 {
    tiny_skia::ColorU8::from_rgba(red, green, blue, 255).premultiply()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The canvas in letters: red, green, blue, else a dot.
    fn ascii(canvas: &Canvas) -> Vec<String> {
        let (width, height) = canvas.size();
        let letter = |x, y| match canvas.at(x, y) {
            [255, 0, 0] => 'r',
            [0, 255, 0] => 'g',
            [0, 0, 255] => 'b',
            _ => '.',
        };
        (0..height).map(|y| (0..width).map(|x| letter(x, y)).collect()).collect()
    }

    fn stripes() -> Picture {
        Picture::from_fn(3, 2, |x, y| if y == 1 { 0x001f } else { [0xf800, 0x07e0, 0x001f][x as usize] })
    }

    #[test]
    fn a_picture_is_scaled_by_whole_pixels() {
        let mut canvas = Canvas::new(8, 6).unwrap();
        canvas.picture(&stripes(), 1, 1, 2);
        assert_eq!(ascii(&canvas), ["........", ".rrggbb.", ".rrggbb.", ".bbbbbb.", ".bbbbbb.", "........"]);
    }

    #[test]
    fn a_picture_is_clipped_on_every_side() {
        let mut canvas = Canvas::new(4, 2).unwrap();
        canvas.picture(&stripes(), -1, -1, 2);
        assert_eq!(ascii(&canvas), ["rggb", "bbbb"]);
        canvas.picture(&stripes(), -50, 0, 2);
        canvas.picture(&stripes(), 50, 50, 2);
        assert_eq!(ascii(&canvas), ["rggb", "bbbb"]);
    }

    #[test]
    fn presented_pixels_are_the_canvas() {
        let mut canvas = Canvas::new(2, 1).unwrap();
        canvas.clear(Colour([1, 2, 3, 255]));
        canvas.dot(1, 0, 5, [4, 5, 6]);
        let mut out = [0; 2];
        canvas.present(&mut out);
        assert_eq!(out, [0x0001_0203, 0x0004_0506]);
        assert_eq!(to_image(&out, 2, 1).get_pixel(1, 0).0, [4, 5, 6]);
    }

    #[test]
    fn shapes_with_no_extent_draw_nothing() {
        let mut canvas = Canvas::new(2, 2).unwrap();
        canvas.rect(Area { x: 0, y: 0, width: 0, height: 2 }, Colour([255, 0, 0, 255]));
        canvas.pill(Area { x: 0, y: 0, width: 0, height: 0 }, Colour([255, 0, 0, 255]));
        assert_eq!(ascii(&canvas), ["..", ".."]);
        assert!(Canvas::new(0, 5).is_none());
    }
}
