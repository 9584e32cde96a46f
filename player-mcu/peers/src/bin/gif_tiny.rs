//! Plays a GIF by tinygif, which needs no allocator and draws pixel by pixel.
#![no_std]
#![no_main]

use core::convert::Infallible;
use cortex_m_rt::entry;
use cubist_peers::{Display, HEIGHT, WIDTH, clock, content, end, fail, frame};
use embedded_graphics::Pixel;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Size};
use embedded_graphics::image::ImageDrawable;
use embedded_graphics::pixelcolor::{IntoStorage, Rgb565};
use tinygif::Gif;

/// Rows come in whole: a row goes to the display when its last pixel is there.
struct Rows<'a> {
    row: &'a mut [u16; WIDTH],
    display: &'a mut Display,
}

impl OriginDimensions for Rows<'_> {
    fn size(&self) -> Size {
        Size::new(WIDTH as u32, HEIGHT as u32)
    }
}

impl DrawTarget for Rows<'_> {
    type Color = Rgb565;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb565>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, colour) in pixels {
            let x = at.x as usize;
            if let Some(slot) = self.row.get_mut(x) {
                *slot = colour.into_storage();
            }
            if x == WIDTH - 1 {
                self.display.show(self.row);
            }
        }
        Ok(())
    }
}

#[entry]
fn main() -> ! {
    static mut ROW: [u16; WIDTH] = [0; WIDTH];
    let mut clock = clock();
    let Ok(gif) = Gif::<Rgb565>::from_slice(content!("clip.gif")) else { fail("no GIF") };
    for picture in gif.frames() {
        frame(&mut clock, |display| {
            let Ok(()) = picture.draw(&mut Rows { row: ROW, display });
        });
    }
    end(0, 0)
}
