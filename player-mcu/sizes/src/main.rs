//! The least player there is: it opens a bundle and draws its frames, row by row. Each feature adds an effect, so that `run` beside this can say
//! what it takes. It is linked and measured, never run.
#![no_std]
#![no_main]

#[cfg(any(feature = "image", feature = "texts"))]
#[path = "../../sum.rs"]
mod sum;

use core::hint::black_box;
use cortex_m_rt::entry;
use cubist_core::{Bundle, Frame, Player};
use panic_never as _;

#[cfg(feature = "any")]
type Texels = cubist_core::AnyTexels;
#[cfg(feature = "four")]
type Texels = cubist_core::Indexed4;
#[cfg(feature = "direct")]
type Texels = cubist_core::Direct565;
#[cfg(feature = "spread")]
type Texels = cubist_core::Spread8;
#[cfg(not(any(feature = "any", feature = "four", feature = "direct", feature = "spread")))]
type Texels = cubist_core::Indexed8;

/// What a bundle is to the compiler: bytes that it knows nothing about.
static BYTES: [u8; 64] = [0; 64];

/// An error as text for people.
#[cfg(feature = "texts")]
fn tell(error: &dyn core::fmt::Display) {
    let mut sum = sum::Sum(0);
    let written = core::fmt::Write::write_fmt(&mut sum, format_args!("{error}"));
    black_box((written.is_ok(), sum.0));
}

fn draw(player: &mut Player<'_, Texels>, y: u32, row: &mut [u16]) {
    player.row(y, row);
    #[cfg(feature = "dithered")]
    player.dithered_row(y, row);
    #[cfg(feature = "smooth")]
    player.smooth_row(y, row);
    #[cfg(feature = "bilinear")]
    player.bilinear_row(y, row);
    #[cfg(feature = "fine")]
    player.fine_row(y, row);
    #[cfg(feature = "probe")]
    {
        let mut probes = [cubist_core::Probe::default(); 8];
        player.probe_row(y, &mut probes);
        black_box(probes);
    }
    black_box(&*row);
}

fn play(memory: &mut [u8], row: &mut [u16]) {
    let bundle = match Bundle::parse(black_box(&BYTES)) {
        Ok(bundle) => bundle,
        #[cfg(feature = "texts")]
        Err(error) => return tell(&error),
        #[cfg(not(feature = "texts"))]
        Err(_) => return,
    };
    let mut place = None;
    let player = match Player::<Texels>::put(&mut place, &bundle, memory) {
        Ok(player) => player,
        #[cfg(feature = "texts")]
        Err(error) => return tell(&error),
        #[cfg(not(feature = "texts"))]
        Err(_) => return,
    };
    #[cfg(feature = "byte-order")]
    player.set_byte_order(black_box(cubist_core::ByteOrder::BigEndian));
    for frame in 0..bundle.frames() {
        player.seek(Frame(frame));
        for y in 0..bundle.size().1 {
            draw(player, y, row);
        }
        #[cfg(feature = "image")]
        {
            use embedded_graphics_core::image::ImageDrawable;
            let mut sum = sum::Sum(0);
            let Ok(()) = player.image(row).draw(&mut sum);
            black_box(sum.0);
        }
    }
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [u8; 64 * 1024] = [0; 64 * 1024];
    static mut ROW: [u16; 320] = [0; 320];
    loop {
        if cfg!(not(feature = "nothing")) {
            play(black_box(MEMORY), black_box(ROW));
        }
    }
}
