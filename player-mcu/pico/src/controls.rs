//! What people set: two pins choose a mode, a potentiometer a place. Modes go to `tempo`.

use crate::tempo::Mode;
use embedded_hal::digital::InputPin;
use rp2040_hal::adc::{Adc, AdcPin};
use rp2040_hal::gpio::bank0::{Gpio14, Gpio15, Gpio26};
use rp2040_hal::gpio::{FunctionNull, FunctionSio, Pin, PullDown, PullUp, SioInput};

/// An input that is high unless it is tied to ground.
type Switch<P> = Pin<P, FunctionSio<SioInput>, PullUp>;

/// The pins that are read before every frame.
pub struct Controls {
    pub ping_pong: Switch<Gpio14>,
    pub by_hand: Switch<Gpio15>,
    pub adc: Adc,
    pub position: AdcPin<Pin<Gpio26, FunctionNull, PullDown>>,
}

impl Controls {
    /// The mode that is set.
    pub fn mode(&mut self) -> Mode {
        if self.by_hand.is_low() == Ok(true) {
            // A conversion takes 2 us; it fails only where the pin is none of the converter's.
            return Mode::Position(self.adc.read(&mut self.position).unwrap_or(0));
        }
        if self.ping_pong.is_low() == Ok(true) { Mode::PingPong } else { Mode::Loop }
    }
}
