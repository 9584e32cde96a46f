//! Plays a GIF by weezl, the LZW decoder of the `gif` crate, which needs an allocator for its table; what is around the LZW data is read here:
//! `gif` itself needs std. Whole frames without transparency or interlacing, as `cubist-beside` writes them.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cubist_peers::{Display, WIDTH, clock, content, end, fail, frame, rgb565};
use emballoc::Allocator;
use weezl::{BitOrder, decode::Decoder};

/// Bytes for its tables: the least, in steps of 1 KB, that it plays with.
const ARENA: usize = 29 << 10;

#[global_allocator]
static HEAP: Allocator<ARENA> = Allocator::new();

/// A frame in the file.
struct Picture<'a> {
    colours: &'a [[u8; 3]],
    code_size: u8,
    /// Blocks of up to 255 bytes, each behind its length.
    blocks: &'a [u8],
}

/// The first block of `data`, and what comes behind it; none at the one of no length.
fn block(data: &[u8]) -> Option<(&[u8], &[u8])> {
    let (&length, rest) = data.split_first()?;
    if length == 0 { None } else { rest.split_at_checked(length.into()) }
}

/// What comes behind all blocks of `data`.
fn behind(mut data: &[u8]) -> &[u8] {
    while let Some((_, rest)) = block(data) {
        data = rest;
    }
    data.get(1..).unwrap_or_default()
}

/// The colours that `flags` say there are, and what comes behind them.
fn colours(flags: u8, data: &[u8]) -> Option<(&[[u8; 3]], &[u8])> {
    let count = if flags & 0x80 == 0 { 0 } else { 2 << (flags & 7) };
    let (colours, rest) = data.split_at_checked(3 * count)?;
    Some((colours.as_chunks().0, rest))
}

/// The next frame of `data`, and what comes behind it.
fn next<'a>(mut data: &'a [u8], global: &'a [[u8; 3]]) -> Option<(Picture<'a>, &'a [u8])> {
    loop {
        match data.split_first()? {
            // An extension, and its label.
            (0x21, rest) => data = behind(rest.get(1..)?),
            (0x2c, rest) => {
                let (descriptor, rest) = rest.split_first_chunk::<9>()?;
                let (own, rest) = colours(descriptor[8], rest)?;
                let (&code_size, blocks) = rest.split_first()?;
                return Some((Picture { colours: if own.is_empty() { global } else { own }, code_size, blocks }, behind(blocks)));
            }
            _ => return None,
        }
    }
}

/// Plays a frame row by row.
fn play(picture: &Picture<'_>, decoder: &mut Decoder, indices: &mut [u8; WIDTH], row: &mut [u16; WIDTH], display: &mut Display) {
    // Looked up for each pixel, as no code is shorter.
    let mut palette = [0; 256];
    palette.iter_mut().zip(picture.colours).for_each(|(slot, &colour)| *slot = rgb565(colour));
    decoder.reset();
    let (mut data, mut blocks) = (&[][..], picture.blocks);
    let mut filled = 0;
    loop {
        let done = decoder.decode_bytes(data, indices.get_mut(filled..).unwrap_or_default());
        if done.status.is_err() {
            fail("LZW data that are none");
        }
        data = data.get(done.consumed_in..).unwrap_or_default();
        filled += done.consumed_out;
        if filled == WIDTH {
            row.iter_mut().zip(&*indices).for_each(|(pixel, &index)| *pixel = palette[usize::from(index)]);
            display.show(row);
            filled = 0;
        } else if data.is_empty() {
            let Some((next, rest)) = block(blocks) else { return };
            (data, blocks) = (next, rest);
        }
    }
}

#[entry]
fn main() -> ! {
    static mut INDICES: [u8; WIDTH] = [0; WIDTH];
    static mut ROW: [u16; WIDTH] = [0; WIDTH];
    let mut clock = clock();
    let file: &'static [u8] = content!("clip.gif");
    let Some((header, rest)) = file.split_first_chunk::<13>() else { fail("no GIF") };
    let Some((global, mut data)) = colours(header[10], rest) else { fail("no GIF") };
    let mut decoder = Decoder::new(BitOrder::Lsb, 8);
    while let Some((picture, rest)) = next(data, global) {
        if picture.code_size != 8 {
            fail("not 256 colours");
        }
        frame(&mut clock, |display| play(&picture, &mut decoder, INDICES, ROW, display));
        data = rest;
    }
    end(0, 0)
}
