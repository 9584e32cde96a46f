//! What the programs that are linked and never run share: a display, and a reader of texts, that only add up what they are shown.

use core::convert::Infallible;
use core::fmt::{self, Write};
use embedded_graphics_core::Pixel;
use embedded_graphics_core::draw_target::DrawTarget;
use embedded_graphics_core::geometry::{OriginDimensions, Size};
use embedded_graphics_core::pixelcolor::{IntoStorage, Rgb565};

/// A display that forgets what it is shown.
pub struct Sum(pub u32);

impl OriginDimensions for Sum {
    fn size(&self) -> Size {
        Size::new(320, 240)
    }
}

impl DrawTarget for Sum {
    type Color = Rgb565;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb565>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(_, colour) in pixels {
            self.0 = self.0.wrapping_add(u32::from(colour.into_storage()));
        }
        Ok(())
    }
}

impl Write for Sum {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0 = text.bytes().map(u32::from).fold(self.0, u32::wrapping_add);
        Ok(())
    }
}
