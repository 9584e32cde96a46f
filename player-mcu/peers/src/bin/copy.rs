//! Copies raw RGB565 frames row by row: the least that any player does.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use cubist_peers::{HEIGHT, WIDTH, clock, content, end, frame};

#[entry]
fn main() -> ! {
    static mut ROW: [u32; WIDTH / 2] = [0; WIDTH / 2];
    let mut clock = clock();
    let pixels: &[u32] = bytemuck::cast_slice(content!("frames.raw"));
    for picture in pixels.chunks_exact(WIDTH / 2 * HEIGHT) {
        frame(&mut clock, |display| {
            for from in picture.chunks_exact(WIDTH / 2) {
                // Sixteen pixels at a time, of which loads and stores of several registers are made; said so that no one makes a call of it,
                // which is slower.
                for (to, from) in ROW.as_chunks_mut::<8>().0.iter_mut().zip(from.as_chunks::<8>().0) {
                    *to = *from;
                    black_box(&*to);
                }
                display.show(bytemuck::must_cast_slice(ROW));
            }
        });
    }
    end(0, 0)
}
