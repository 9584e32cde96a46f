//! Plays JPEG pictures by tjpgdec-rs, which needs no allocator and gives blocks of 8 x 8 pixels (of 4:4:4 pictures) as R, G, B.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cubist_peers::{clock, content, end, fail, frame, pictures, rgb565};
use tjpgdec_rs::{JpegDecoder, MemoryPool};

/// Bytes for its tables, and to spare.
const POOL: usize = 32 << 10;

/// It puts words into its bytes.
#[repr(align(8))]
struct Pool([u8; POOL]);

#[entry]
fn main() -> ! {
    static mut MEMORY: Pool = Pool([0; POOL]);
    static mut COEFFICIENTS: [i16; 3 * 64] = [0; 3 * 64];
    static mut BLOCK: [u8; 3 * 64] = [0; 3 * 64];
    static mut PIXELS: [u16; 64] = [0; 64];
    let mut clock = clock();
    let mut asked = 0;
    for picture in pictures(content!("clip.mjpeg")) {
        frame(&mut clock, |display| {
            let mut pool = MemoryPool::new(&mut MEMORY.0);
            let mut decoder = JpegDecoder::new();
            if decoder.prepare(picture, &mut pool).is_err() {
                fail("no JPEG");
            }
            asked = pool.used();
            let done = decoder.decompress(picture, 0, COEFFICIENTS, BLOCK, &mut |_, rgb, area| {
                let count = usize::from(area.width()) * usize::from(area.height());
                for (pixel, &rgb) in PIXELS.iter_mut().zip(rgb.as_chunks().0) {
                    *pixel = rgb565(rgb);
                }
                display.show(PIXELS.get(..count).unwrap_or_default());
                Ok(true)
            });
            if done.is_err() {
                fail("a JPEG that does not decode");
            }
        });
    }
    end(asked, POOL)
}
