//! Plays the bare warp of `warp.rs`: texture, palette and nodes come from flash.
#![no_std]
#![no_main]

#[path = "../warp.rs"]
mod warp;

use cortex_m_rt::entry;
use cubist_peers::{clock, content, end, fail, frame};
use warp::{Cells, NODE_ROWS, NODES, row, set_up};

#[entry]
fn main() -> ! {
    static mut CELLS: Cells = Cells::NEW;
    static mut ROW: [u32; 160] = [0; 160];
    let mut clock = clock();
    let content: &'static [u8] = content!("warp.raw");
    let Some((texels, rest)) = content.split_first_chunk::<{ 1 << 16 }>() else { fail("nothing to play") };
    let Some((palette, nodes)) = rest.split_first_chunk::<512>() else { fail("nothing to play") };
    // Little-endian, as the device is.
    let palette: &[u16; 256] = bytemuck::must_cast_ref(bytemuck::from_bytes::<[u16; 256]>(palette));
    let rows = bytemuck::cast_slice::<u8, u32>(nodes).as_chunks::<NODES>().0;
    for rows in rows.chunks_exact(NODE_ROWS) {
        frame(&mut clock, |display| {
            for pair in rows.windows(2) {
                let [above, below] = pair else { continue };
                set_up(above, below, CELLS);
                for _ in 0..8 {
                    row(CELLS, texels, palette, ROW);
                    display.show(bytemuck::must_cast_slice(ROW));
                }
            }
        });
    }
    end(0, 0)
}
