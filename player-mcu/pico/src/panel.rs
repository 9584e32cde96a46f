//! The display: its controller is set up by `mipidsi`, then takes a window of pixels for every frame. The bus between them is lent to `strips`,
//! which fills the window by DMA.

use core::cell::Cell;
use core::iter;
use embedded_graphics_core::draw_target::DrawTarget;
use embedded_graphics_core::pixelcolor::{Rgb565, RgbColor};
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiBus;
use mipidsi::interface::{Interface, InterfaceKind};
use mipidsi::options::{ColorInversion, ColorOrder, Orientation, Rotation};
use mipidsi::{Builder, Display};
use rp2040_hal::gpio::bank0::{Gpio16, Gpio18, Gpio19, Gpio20};
use rp2040_hal::gpio::{FunctionSio, FunctionSpi, Pin, PullDown, SioOutput};
use rp2040_hal::pac::SPI0;
use rp2040_hal::spi::Enabled;
use rp2040_hal::timer::Timer;

#[cfg(not(feature = "ili9341"))]
mod model {
    pub use mipidsi::models::ST7789 as Model;
    /// What the panel itself counts as width and height.
    pub const PANEL: (u16, u16) = (240, 240);
    /// The fastest clock that the controller is specified for, Hz: the RP2040's, too.
    pub const CLOCK: u32 = 62_500_000;
}
#[cfg(feature = "ili9341")]
mod model {
    pub use mipidsi::models::ILI9341Rgb565 as Model;
    /// What the panel itself counts as width and height.
    pub const PANEL: (u16, u16) = (240, 320);
    /// Three times what the controller is specified for, Hz, as is usual; half of what the RP2040 can do.
    pub const CLOCK: u32 = 31_250_000;
}
pub use model::CLOCK;

/// How the panel is mounted. An ILI9341 stands upright by itself, as seen from behind; here it lies on its side, seen from the front.
const ORIENTATION: Orientation =
    if cfg!(feature = "ili9341") { Orientation::new().rotate(Rotation::Deg90).flip_vertical() } else { Orientation::new() };
/// IPS panels, as nearly all with an ST7789 are, show a colour's opposite.
const INVERSION: ColorInversion = if cfg!(feature = "ili9341") { ColorInversion::Normal } else { ColorInversion::Inverted };
/// Which of red and blue comes first: what a panel's maker soldered.
const ORDER: ColorOrder = if cfg!(feature = "ili9341") { ColorOrder::Bgr } else { ColorOrder::Rgb };

/// An output pin.
type Output<P> = Pin<P, FunctionSio<SioOutput>, PullDown>;
/// The bus: data out and clock. Nothing comes back.
pub type Spi = rp2040_hal::Spi<Enabled, SPI0, (Pin<Gpio19, FunctionSpi, PullDown>, Pin<Gpio18, FunctionSpi, PullDown>), 8>;
/// Where the bus is while no strip is being sent.
pub type Bus = Cell<Option<Spi>>;

/// Commands and what belongs to them, by way of the bus that is shared.
pub struct Wire<'b> {
    bus: &'b Bus,
    data: Output<Gpio16>,
}

/// A command while DMA has the bus.
#[derive(Clone, Copy, Debug)]
pub struct Busy;

impl Wire<'_> {
    /// Sends bytes while `with` holds the bus.
    fn with(&mut self, send: impl FnOnce(&mut Spi, &mut Output<Gpio16>)) -> Result<(), Busy> {
        let mut spi = self.bus.take().ok_or(Busy)?;
        send(&mut spi, &mut self.data);
        self.bus.set(Some(spi));
        Ok(())
    }
}

/// Sends `bytes`, and waits until they have left.
pub fn write(spi: &mut Spi, bytes: &[u8]) {
    let Ok(()) = spi.write(bytes);
    // `write` counts bytes that came in, of which DMA has left some: it is no sign that the last one is out.
    let Ok(()) = SpiBus::<u8>::flush(spi);
}

impl Interface for Wire<'_> {
    type Word = u8;
    type Error = Busy;
    const KIND: InterfaceKind = InterfaceKind::Serial4Line;

    fn send_command(&mut self, command: u8, args: &[u8]) -> Result<(), Busy> {
        self.with(|spi, data| {
            let Ok(()) = data.set_low();
            write(spi, &[command]);
            let Ok(()) = data.set_high();
            write(spi, args);
        })
    }

    fn send_pixels<const N: usize>(&mut self, pixels: impl IntoIterator<Item = [u8; N]>) -> Result<(), Busy> {
        self.with(|spi, _| pixels.into_iter().for_each(|pixel| write(spi, &pixel)))
    }

    fn send_repeated_pixel<const N: usize>(&mut self, pixel: [u8; N], count: u32) -> Result<(), Busy> {
        // Many at a time: the display is cleared this way.
        let mut some = [[0; N]; 32];
        some.fill(pixel);
        self.with(|spi, _| {
            let mut left = count as usize;
            while left > 0 {
                let sent = some.get(..left).unwrap_or(&some);
                write(spi, sent.as_flattened());
                left -= sent.len();
            }
        })
    }
}

/// The display, lit and black.
pub struct Panel<'b> {
    display: Display<Wire<'b>, model::Model, Output<Gpio20>>,
    size: (u32, u32),
}

impl<'b> Panel<'b> {
    /// Sets the display up; that takes a third of a second. `None`: its driver refuses the settings above.
    pub fn new(bus: &'b Bus, data: Output<Gpio16>, reset: Output<Gpio20>, timer: &mut Timer) -> Option<Self> {
        let (width, height) = model::PANEL;
        let mut display = Builder::new(model::Model, Wire { bus, data })
            .display_size(width, height)
            .orientation(ORIENTATION)
            .invert_colors(INVERSION)
            .color_order(ORDER)
            .reset_pin(reset)
            .init(timer)
            .ok()?;
        display.clear(Rgb565::BLACK).ok()?;
        let (width, height) = (u32::from(width), u32::from(height));
        let size = if ORIENTATION.rotation.is_vertical() { (height, width) } else { (width, height) };
        Some(Self { display, size })
    }

    /// Width and height as it is mounted, pixels.
    pub const fn size(&self) -> (u32, u32) {
        self.size
    }

    /// From now on pixels fill a window of this size in the middle of the display, row by row from its top left.
    pub fn open(&mut self, (width, height): (u32, u32)) {
        let (left, top) = (self.size.0.saturating_sub(width) / 2, self.size.1.saturating_sub(height) / 2);
        let (right, bottom) = (left + width.saturating_sub(1), top + height.saturating_sub(1));
        // The bus is free: `main` has waited for it. All of these are less than the panel's size.
        let _opened = self.display.set_pixels(left as u16, top as u16, right as u16, bottom as u16, iter::empty());
    }
}
