//! What the players have in common: the clock, the display, and the lines that go out. Each player is a program of its own in `bin`, so that
//! code and memory are its alone; what it plays is linked in by `build.rs`, and what it prints goes to `cubist-beside`.
//!
//! Every frame is played twice: once to be measured, and once for the sum of its pixels, which the host knows too.
#![no_std]

mod clock;
#[path = "../../qemu/src/text.rs"]
mod text;

pub use clock::Clock;

use core::hint::black_box;
use cortex_m::peripheral::Peripherals;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE};
use text::Line;

/// Pixels a row.
pub const WIDTH: usize = 320;
/// Rows.
pub const HEIGHT: usize = 240;

/// Bytes of `file` of what is played, at an address that any number type can be read from, as an ELF has it.
#[macro_export]
macro_rules! content {
    ($file:literal) => {{
        #[repr(align(4))]
        struct Aligned<T: ?Sized>(T);
        static CONTENT: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!(env!("OUT_DIR"), "/", $file)));
        &CONTENT.0
    }};
}

/// Where pixels go: it takes them as a display does, in stretches or blocks, and keeps none.
#[derive(Debug, Default)]
pub struct Display {
    /// Whether it adds them up.
    summing: bool,
    sum: u32,
}

impl Display {
    /// Takes pixels.
    #[inline(always)]
    pub fn show(&mut self, pixels: &[u16]) {
        black_box(pixels);
        if self.summing {
            self.add(pixels);
        }
    }

    /// FNV-1a, a pixel at a time.
    #[inline(never)]
    fn add(&mut self, pixels: &[u16]) {
        self.sum = pixels.iter().fold(self.sum, |sum, &pixel| (sum ^ u32::from(pixel)).wrapping_mul(0x0100_0193));
    }
}

/// The clock, once.
#[must_use]
pub fn clock() -> Clock {
    let Some(peripherals) = Peripherals::take() else { fail("no peripherals") };
    Clock::start(peripherals.SYST)
}

/// Plays a frame twice by `play`, and prints what it takes and the sum of its pixels.
pub fn frame(clock: &mut Clock, mut play: impl FnMut(&mut Display)) {
    let mut quiet = Display::default();
    let instructions = clock.measure(|| play(&mut quiet));
    let mut display = Display { summing: true, sum: 0x811c_9dc5 };
    play(&mut display);
    report(instructions, display.sum);
}

/// Prints a frame's line. A function of its own, so that its text does not count as the player's stack.
#[inline(never)]
fn report(instructions: u64, sum: u32) {
    let mut line = Line::new();
    line.word("{\"instructions\": ").number(instructions).word(", \"sum\": ").number(sum.into()).word("}").end();
}

/// Prints the last line: bytes of memory that the player was given as it asked at run time, of a static arena with so many bytes. Never comes
/// back: the painted stack is read from outside, then the emulator is told to quit.
pub fn end(asked: usize, arena: usize) -> ! {
    last(asked, arena);
    loop {
        cortex_m::asm::nop();
    }
}

#[inline(never)]
fn last(asked: usize, arena: usize) {
    let mut line = Line::new();
    line.word("{\"asked\": ").number(asked as u64).word(", \"arena\": ").number(arena as u64).word("}").end();
}

/// Says what went wrong, and ends.
#[inline(never)]
pub fn fail(what: &str) -> ! {
    let mut line = Line::new();
    line.word("{\"error\": \"").word(what).word("\"}").end();
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

/// RGB565 of R, G, B.
#[inline(always)]
#[must_use]
pub fn rgb565([r, g, b]: [u8; 3]) -> u16 {
    u16::from(r & 0xf8) << 8 | u16::from(g & 0xfc) << 3 | u16::from(b >> 3)
}

/// The pictures of `content`, each behind its length in four bytes, little-endian.
pub fn pictures(mut content: &[u8]) -> impl Iterator<Item = &[u8]> {
    core::iter::from_fn(move || {
        let (length, rest) = content.split_first_chunk::<4>()?;
        let (picture, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        content = rest;
        Some(picture)
    })
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    fail("a panic")
}
