//! Plays a bundle on a Raspberry Pi Pico with a display on SPI. The bundle comes from `slot`, frame numbers from `tempo`; strips of rows go to
//! `strips`, which sends them by DMA while the next is drawn: there is no frame buffer. README.md of the folder above says how to wire and load it.
//!
//! Two pins tell a logic analyser, or the emulator that tests this, what the processor does: GP21 is high while it works on pixels, and low
//! while it waits for the display or for the time of the next frame; GP22 changes with every frame.
#![no_std]
#![no_main]

mod controls;
mod fault;
mod panel;
mod slot;
mod strips;
mod tempo;

use bytemuck::{cast_slice_mut, try_cast_slice_mut};
use controls::Controls;
use core::cell::Cell;
use cubist_core::{AnyTexels, Bundle, ByteOrder, Frame, Player};
use embedded_hal::digital::{OutputPin, StatefulOutputPin};
use embedded_hal::spi::MODE_3;
use fault::Fault;
use panel::Panel;
use rp2040_hal::adc::{Adc, AdcPin};
use rp2040_hal::clocks::{Clock, init_clocks_and_plls};
use rp2040_hal::dma::DMAExt;
use rp2040_hal::fugit::RateExtU32;
use rp2040_hal::gpio::Pins;
use rp2040_hal::{Sio, Timer, Watchdog, entry, pac};
use strips::{Sender, Strip};
use tempo::Tempo;

/// A player's working memory: what 264 KB have left beside the buffers and 16 KB of stack, of which playing takes 2.
const ROOM: usize = 236 << 10;
/// The widest display there is.
const WIDEST: usize = 320;
/// Rows of a strip: a row of cells, mostly.
const ROWS: u32 = 8;
/// Pixels of a strip.
const PIXELS: usize = WIDEST * ROWS as usize;
/// The crystal of a Pico, Hz.
const CRYSTAL: u32 = 12_000_000;

/// What is shown where there is nothing to play.
static CARD: &[u8] = if cfg!(feature = "ili9341") {
    include_bytes!("../../card/card-320x240.cubist")
} else {
    include_bytes!("../../card/card-240x240.cubist")
};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // Playing has no way to get here: `proof` shows it. Setting up the chip might.
    loop {
        core::hint::spin_loop();
    }
}

/// What every frame needs beside the player.
struct Stage<'b, W, T> {
    panel: Panel<'b>,
    sender: Sender<'b>,
    /// The buffer that is not being sent.
    strip: Strip,
    timer: Timer,
    working: W,
    turn: T,
    /// When the next frame may be shown, microseconds.
    due: u64,
}

impl<W: OutputPin, T: StatefulOutputPin> Stage<'_, W, T> {
    /// Shows `frame`; its last strip may be on its way still.
    fn show(&mut self, player: &mut Player<'_, AnyTexels>, frame: u32) {
        // The chip's own pins cannot fail.
        let _turned = self.turn.toggle();
        let _high = self.working.set_high();
        player.seek(Frame(frame));
        self.draw(player);
    }

    /// Draws the current frame, strip by strip, and sends it. A function of its own: seeking takes the stack deepest, and must not find this there.
    #[inline(never)]
    fn draw(&mut self, player: &mut Player<'_, AnyTexels>) {
        let (width, height) = player.bundle().size();
        for top in (0..height).step_by(ROWS as usize) {
            let rows = ROWS.min(height - top);
            let _high = self.working.set_high();
            // A strip was made of whole pixels, and starts where one may.
            let pixels = try_cast_slice_mut::<u8, u16>(self.strip).unwrap_or(&mut []);
            for (y, row) in (top..top + rows).zip(pixels.chunks_exact_mut(width as usize)) {
                player.row(y, row);
            }
            let _low = self.working.set_low();
            if top == 0 {
                self.begin(player.bundle());
            }
            if rows == ROWS {
                let strip = core::mem::take(&mut self.strip);
                self.strip = self.sender.send(strip);
            } else {
                self.sender.remainder(self.strip.get(..(rows * width * 2) as usize).unwrap_or(&[]));
            }
        }
    }

    /// Waits for the frame's time and the end of the one before it, and makes the display ready for its pixels.
    fn begin(&mut self, bundle: &Bundle<'_>) {
        let now = || self.timer.get_counter().ticks();
        while now() < self.due {}
        // A frame that is late delays those after it: none is left out.
        self.due = now() + 1_000_000 / u64::from(bundle.fps()).max(1);
        self.sender.rest();
        self.panel.open(bundle.size());
    }
}

/// Why `bundle` cannot be played here, if so.
fn misfit(bundle: &Bundle<'_>, screen: (u32, u32)) -> Option<Fault> {
    let (width, height) = bundle.size();
    if width > screen.0 || height > screen.1 {
        return Some(Fault::Size);
    }
    (bundle.memory_needed() > ROOM).then_some(Fault::Memory)
}

/// What there is to play, in its place, or the test card and what kept that from being played.
fn find(place: &'static mut Option<Bundle<'static>>, screen: (u32, u32)) -> (Option<&'static Bundle<'static>>, Option<Fault>) {
    let fault = match slot::open(place) {
        Ok(()) => place.as_ref().and_then(|bundle| misfit(bundle, screen)),
        Err(error) => Some(error.into()),
    };
    // The card fits: the emulator shows it with every change.
    if fault.is_some() && slot::parse(place, CARD).is_err() {
        *place = None;
    }
    (place.as_ref(), fault)
}

/// Makes a player in its place.
#[inline(never)]
fn make(
    place: &'static mut Option<Player<'static, AnyTexels>>,
    bundle: &'static Bundle<'static>,
    memory: &'static mut [u8],
) -> Option<&'static mut Player<'static, AnyTexels>> {
    Player::put(place, bundle, memory).ok()
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [u8; ROOM] = [0; ROOM];
    static mut BUNDLE: Option<Bundle<'static>> = None;
    static mut PLAYER: Option<Player<'static, AnyTexels>> = None;
    static mut STRIPS: [[u16; PIXELS]; 2] = [[0; PIXELS]; 2];

    // Nothing has taken them, and nothing can be told before there are any.
    let Some(mut pac) = pac::Peripherals::take() else { panic!() };
    let mut watchdog = Watchdog::new(pac.WATCHDOG);
    let clocks = init_clocks_and_plls(CRYSTAL, pac.XOSC, pac.CLOCKS, pac.PLL_SYS, pac.PLL_USB, &mut pac.RESETS, &mut watchdog);
    let Ok(clocks) = clocks else { panic!() };
    let mut timer = Timer::new(pac.TIMER, &mut pac.RESETS, &clocks);
    let sio = Sio::new(pac.SIO);
    let pins = Pins::new(pac.IO_BANK0, pac.PADS_BANK0, sio.gpio_bank0, &mut pac.RESETS);
    let mut light = pins.gpio25.into_push_pull_output();

    // The display is alone on the bus: selected for good. Mode 3 suits panels that have no such pin, too.
    let mut select = pins.gpio17.into_push_pull_output();
    let _low = select.set_low();
    let spi = rp2040_hal::Spi::new(pac.SPI0, (pins.gpio19.into_function(), pins.gpio18.into_function()));
    let spi = spi.init(&mut pac.RESETS, clocks.peripheral_clock.freq(), panel::CLOCK.Hz(), MODE_3);
    let bus = Cell::new(Some(spi));
    let (data, reset) = (pins.gpio16.into_push_pull_output(), pins.gpio20.into_push_pull_output());
    let Some(panel) = Panel::new(&bus, data, reset, &mut timer) else { Fault::Display.flash(&mut light, &mut timer) };

    let (bundle, fault) = find(BUNDLE, panel.size());
    let Some(bundle) = bundle else { Fault::Broken.flash(&mut light, &mut timer) };
    let Some(player) = make(PLAYER, bundle, MEMORY) else { Fault::Memory.flash(&mut light, &mut timer) };
    player.set_byte_order(ByteOrder::BigEndian);

    let [first, second] = STRIPS.each_mut().map(|strip| {
        let pixels = strip.get_mut(..(bundle.size().0 * ROWS) as usize);
        cast_slice_mut(pixels.unwrap_or(&mut []))
    });
    let mut stage = Stage {
        panel,
        sender: Sender::new(&bus, pac.DMA.split(&mut pac.RESETS).ch0, first),
        strip: second,
        timer,
        working: pins.gpio21.into_push_pull_output(),
        turn: pins.gpio22.into_push_pull_output(),
        due: 0,
    };
    let mut controls = Controls {
        ping_pong: pins.gpio14.into_pull_up_input(),
        by_hand: pins.gpio15.into_pull_up_input(),
        adc: Adc::new(pac.ADC, &mut pac.RESETS),
        position: match AdcPin::new(pins.gpio26.reconfigure()) {
            Ok(pin) => pin,
            Err(_) => panic!(),
        },
    };
    let mut tempo = Tempo::new(bundle.frames());
    stage.show(player, tempo.frame());
    if let Some(fault) = fault {
        fault.flash(&mut light, &mut timer);
    }
    loop {
        tempo.step(controls.mode());
        stage.show(player, tempo.frame());
    }
}
