//! Why a bundle does not play, told by the Pico's own light: so many flashes, a pause, and again, while the display shows the test card.

use cubist_core::BundleError;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;

/// Why a bundle does not play; the numbers are those of the flashes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// There is none.
    NoBundle = 1,
    /// It is damaged, or of another version of the format.
    Broken = 2,
    /// It needs more working memory than there is.
    Memory = 3,
    /// Its frames are larger than the display.
    Size = 4,
    /// The display's driver refuses its settings: a fault of the firmware.
    Display = 5,
}

impl From<BundleError> for Fault {
    fn from(error: BundleError) -> Self {
        if error == BundleError::NotABundle { Self::NoBundle } else { Self::Broken }
    }
}

impl Fault {
    /// Flashes until the power goes.
    pub fn flash(self, light: &mut impl OutputPin, timer: &mut impl DelayNs) -> ! {
        loop {
            for _ in 0..self as u8 {
                // The pin is one of the chip's own, and cannot fail.
                let _lit = light.set_high();
                timer.delay_ms(150);
                let _dark = light.set_low();
                timer.delay_ms(250);
            }
            timer.delay_ms(1200);
        }
    }
}
