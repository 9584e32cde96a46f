//! Calls everything a firmware calls of the playback core, so that the linker and the disassembler can say
//! what is reachable from it. It is linked and read, never run: `run` beside it states what must hold.
//! Bytes come from a static that the compiler cannot see through, pixels go to a target that only adds them up.
#![no_std]
#![no_main]

#[cfg(feature = "allocates")]
extern crate alloc;

#[path = "../../sum.rs"]
mod sum;

use core::fmt::Write;
use core::hint::black_box;
use cortex_m_rt::entry;
use cubist_core::{Bundle, BundleError, ByteOrder, Frame, MemoryError, Player, Probe, Texels};
use embedded_graphics_core::geometry::{Point, Size};
use embedded_graphics_core::image::ImageDrawable;
use embedded_graphics_core::primitives::Rectangle;
// Its panic handler calls a symbol that does not exist: the link fails if a panic can be reached.
use panic_never as _;
use sum::Sum;

/// What a bundle is to the compiler: bytes that it knows nothing about.
static BYTES: [u8; 64] = [0; 64];

/// What `play` can meet.
enum Trouble {
    Bundle(BundleError),
    Memory(MemoryError),
}

/// Plays `bytes` in every way there is, as texels of the kinds of `T`.
fn play<T: Texels>(bytes: &[u8], memory: &mut [u8], row: &mut [u16], probes: &mut [Probe]) -> Result<u32, Trouble> {
    let bundle = Bundle::parse(bytes).map_err(Trouble::Bundle)?;
    let mut player = Player::<T>::with_texels(&bundle, memory).map_err(Trouble::Memory)?;
    player.set_byte_order(black_box(ByteOrder::BigEndian));
    let mut sum = Sum(0);
    for frame in 0..black_box(3) {
        player.seek(Frame(frame));
        for y in 0..bundle.size().1 {
            player.row(y, row);
            #[cfg(feature = "rows")]
            for way in [Player::smooth_row, Player::dithered_row, Player::bilinear_row, Player::fine_row] {
                way(&mut player, y, row);
                black_box(&*row);
            }
            player.probe_row(y, probes);
            black_box((&*row, &*probes));
        }
        let image = player.image(row);
        let Ok(()) = image.draw(&mut sum);
        let Ok(()) = image.draw_sub_image(&mut sum, &Rectangle::new(black_box(Point::new(-3, 5)), black_box(Size::new(9, 9))));
        black_box(player.work());
    }
    black_box(bundle.sections().map(|section| section.bytes.len()).fold(0, usize::wrapping_add));
    Ok(sum.0)
}

#[cfg(not(feature = "rows"))]
use play as played;

/// Likewise, and with the palette spread.
#[cfg(feature = "rows")]
fn played<T: Texels>(bytes: &[u8], memory: &mut [u8], row: &mut [u16], probes: &mut [Probe]) -> Result<u32, Trouble> {
    play::<cubist_core::Spread8>(bytes, memory, row, probes)?;
    play::<T>(bytes, memory, row, probes)
}

#[cfg(not(feature = "rows"))]
type Kinds = cubist_core::Indexed8;
#[cfg(feature = "rows")]
type Kinds = cubist_core::AnyTexels;

/// What the proofs must catch, one feature each.
fn seeded(bytes: &[u8]) -> u32 {
    #[cfg(feature = "panics")]
    return u32::from(bytes[black_box(9)]);
    #[cfg(feature = "floats")]
    return (f32::from(bytes.len() as u16) * black_box(0.5)) as u32;
    #[cfg(feature = "allocates")]
    return alloc::vec::Vec::from(bytes).iter().map(|&byte| u32::from(byte)).fold(0, u32::wrapping_add);
    #[cfg(not(any(feature = "panics", feature = "floats", feature = "allocates")))]
    return bytes.len() as u32;
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [u8; 192 * 1024] = [0; 192 * 1024];
    static mut ROW: [u16; 320] = [0; 320];
    let mut probes = [Probe::default(); 8];
    loop {
        let bytes = black_box(&BYTES[..]);
        let mut text = Sum(0);
        let written = match played::<Kinds>(bytes, black_box(MEMORY), black_box(ROW), black_box(&mut probes)) {
            Ok(sum) => write!(text, "{sum}"),
            Err(Trouble::Bundle(error)) => write!(text, "{error}"),
            Err(Trouble::Memory(error)) => write!(text, "{error}"),
        };
        black_box((written.is_ok(), text.0));
        black_box(seeded(bytes));
    }
}
