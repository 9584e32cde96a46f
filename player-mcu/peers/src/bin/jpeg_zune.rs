//! Plays JPEG pictures by zune-jpeg, which needs an allocator and a whole picture of R, G, B.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cubist_peers::{HEIGHT, WIDTH, clock, content, end, fail, frame, pictures, rgb565};
use emballoc::Allocator;
use zune_core::bytestream::ZCursor;
use zune_jpeg::JpegDecoder;

/// Bytes for what it asks for: the least, in steps of 2 KB, that pictures of this size play with.
const ARENA: usize = 22 << 10;

#[global_allocator]
static HEAP: Allocator<ARENA> = Allocator::new();

#[entry]
fn main() -> ! {
    static mut PICTURE: [u8; WIDTH * HEIGHT * 3] = [0; WIDTH * HEIGHT * 3];
    static mut ROW: [u16; WIDTH] = [0; WIDTH];
    let mut clock = clock();
    for picture in pictures(content!("clip.mjpeg")) {
        frame(&mut clock, |display| {
            if JpegDecoder::new(ZCursor::new(picture)).decode_into(PICTURE).is_err() {
                fail("a JPEG that does not decode");
            }
            for rgb in PICTURE.as_chunks::<3>().0.chunks_exact(WIDTH) {
                ROW.iter_mut().zip(rgb).for_each(|(pixel, &rgb)| *pixel = rgb565(rgb));
                display.show(ROW);
            }
        });
    }
    end(0, 0)
}
