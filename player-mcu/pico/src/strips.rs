//! Strips of rows on their way to the display: one is sent by DMA while the next is drawn into the other of two buffers. Strips come from `main`;
//! the bus is shared with `panel`, which sends commands between frames.

use crate::panel::{Bus, Spi, write};
use rp2040_hal::dma::single_buffer::{Config, Transfer};
use rp2040_hal::dma::{CH0, Channel};

/// Pixels of a strip, as bytes in the order in which they go out. They are never moved, so that DMA can read them.
pub type Strip = &'static mut [u8];

enum State {
    Idle(Channel<CH0>, Strip),
    Busy(Transfer<Channel<CH0>, Strip, Spi>),
}

/// Sends strips one after the other.
pub struct Sender<'b> {
    bus: &'b Bus,
    state: Option<State>,
}

impl<'b> Sender<'b> {
    /// A sender that keeps `spare`, to be handed out for the first strip.
    pub fn new(bus: &'b Bus, channel: Channel<CH0>, spare: Strip) -> Self {
        Self { bus, state: Some(State::Idle(channel, spare)) }
    }

    /// Waits until the last strip has left; then the bus is free for commands.
    pub fn rest(&mut self) {
        self.state = self.state.take().map(|state| {
            let (channel, strip) = self.idle(state);
            State::Idle(channel, strip)
        });
    }

    /// Starts sending `strip`, once the one before it has left, and hands out the one before it. Where the bus is lost, that is `strip` itself.
    pub fn send(&mut self, strip: Strip) -> Strip {
        let Some(state) = self.state.take() else { return strip };
        let (channel, spare) = self.idle(state);
        let Some(spi) = self.bus.take() else {
            self.state = Some(State::Idle(channel, spare));
            return strip;
        };
        self.state = Some(State::Busy(Config::new(channel, strip, spi).start()));
        spare
    }

    /// Sends `pixels` the slow way: what is left of a frame when it is no whole strip.
    pub fn remainder(&mut self, pixels: &[u8]) {
        self.rest();
        if let Some(mut spi) = self.bus.take() {
            write(&mut spi, pixels);
            self.bus.set(Some(spi));
        }
    }

    fn idle(&self, state: State) -> (Channel<CH0>, Strip) {
        match state {
            State::Idle(channel, strip) => (channel, strip),
            State::Busy(transfer) => {
                let (channel, strip, spi) = transfer.wait();
                // DMA is done when the last bytes are in the FIFO; the data pin may change only when they have left that too.
                while spi.is_busy() {}
                self.bus.set(Some(spi));
                (channel, strip)
            }
        }
    }
}
