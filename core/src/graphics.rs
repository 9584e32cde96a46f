//! embedded-graphics: the current frame as an image.
//!
//! ```
//! # use cubist_core::Player;
//! # use embedded_graphics_core::{draw_target::DrawTarget, pixelcolor::Rgb565, image::ImageDrawable};
//! fn show<D: DrawTarget<Color = Rgb565>>(player: &mut Player<'_>, row: &mut [u16], display: &mut D) -> Result<(), D::Error> {
//!     player.image(row).draw(display)
//! }
//! ```

use crate::{Bundle, Indexed8, Player, Texels};
use core::cell::RefCell;
use embedded_graphics_core::draw_target::DrawTarget;
use embedded_graphics_core::geometry::{OriginDimensions, Point, Size};
use embedded_graphics_core::image::ImageDrawable;
use embedded_graphics_core::pixelcolor::Rgb565;
use embedded_graphics_core::pixelcolor::raw::RawU16;
use embedded_graphics_core::primitives::Rectangle;

/// A way to draw row `y` of a player's current frame: [`Player::row`], say, or [`Player::fine_row`]. A list of ways for more than one player is of closures,
/// `|player, y, row| player.fine_row(y, row)`: the lifetime of a method's name is that of one player's memory.
pub type DrawRow<'a, T> = fn(&mut Player<'a, T>, u32, &mut [u16]);

/// The current frame of a player, drawn row by row: those rows, from their left ends on, that the target shows some of.
#[derive(Debug)]
pub struct FrameImage<'p, 'a, T = Indexed8> {
    /// Drawing takes `&self` in embedded-graphics; the player's row state lives in its memory.
    state: RefCell<(&'p mut Player<'a, T>, &'p mut [u16])>,
    draw_row: DrawRow<'a, T>,
    size: Size,
}

impl<'a, T: Texels> Player<'a, T> {
    /// The current frame as an embedded-graphics image; `row` is a buffer of at least the screen's
    /// width (pixels past a shorter one are not drawn). Its colours are right whatever the player's byte order is.
    pub fn image<'p>(&'p mut self, row: &'p mut [u16]) -> FrameImage<'p, 'a, T> {
        self.image_by(row, Self::row)
    }

    /// Likewise, its rows drawn by another way than [`Player::row`]: `player.image_by(&mut row, Player::fine_row)`.
    pub fn image_by<'p>(&'p mut self, row: &'p mut [u16], draw_row: DrawRow<'a, T>) -> FrameImage<'p, 'a, T> {
        let size = self.bundle().size_of_screen();
        FrameImage { state: RefCell::new((self, row)), draw_row, size }
    }
}

impl Bundle<'_> {
    fn size_of_screen(&self) -> Size {
        let (width, height) = self.size();
        Size::new(width, height)
    }
}

impl OriginDimensions for Bundle<'_> {
    fn size(&self) -> Size {
        self.size_of_screen()
    }
}

impl<T> OriginDimensions for FrameImage<'_, '_, T> {
    fn size(&self) -> Size {
        self.size
    }
}

impl<T: Texels> ImageDrawable for FrameImage<'_, '_, T> {
    type Color = Rgb565;

    fn draw<D: DrawTarget<Color = Rgb565>>(&self, target: &mut D) -> Result<(), D::Error> {
        self.draw_sub_image(target, &Rectangle::new(Point::zero(), self.size))
    }

    fn draw_sub_image<D: DrawTarget<Color = Rgb565>>(&self, target: &mut D, area: &Rectangle) -> Result<(), D::Error> {
        // Held only while drawing, which nothing can enter twice.
        let Ok(mut state) = self.state.try_borrow_mut() else { return Ok(()) };
        let (player, buffer) = &mut *state;
        let area = area.intersection(&Rectangle::new(Point::zero(), self.size));
        // What of it the target shows, which gets the area's left upper corner at its origin.
        let seen = Rectangle::new(Point::zero(), area.size).intersection(&target.bounding_box());
        let (corner, shown) = (area.top_left, seen.top_left);
        let (left, top) = (corner.x.saturating_add(shown.x).max(0) as usize, corner.y.saturating_add(shown.y).max(0) as u32);
        let drawn = buffer.len().min(left.saturating_add(seen.size.width as usize));
        let Some(row) = buffer.get_mut(..drawn) else { return Ok(()) };
        let swapped = player.swapped();
        let native = |raw: u16| if swapped { raw.swap_bytes() } else { raw };
        for down in 0..seen.size.height {
            (self.draw_row)(player, top.wrapping_add(down), row);
            let colours = row.iter().skip(left).map(|&raw| Rgb565::from(RawU16::new(native(raw))));
            let line = Rectangle::new(Point::new(shown.x, shown.y.saturating_add(down as i32)), Size::new(colours.len() as u32, 1));
            target.fill_contiguous(&line, colours)?;
        }
        Ok(())
    }
}
