//! Plays a Cubist bundle, from its first frame to its last.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cubist_core::{Bundle, Frame, Player};
use cubist_peers::{HEIGHT, WIDTH, clock, content, end, fail, frame};

/// Room for a player's working memory.
const ROOM: usize = 1 << 20;

#[entry]
fn main() -> ! {
    static mut MEMORY: [u8; ROOM] = [0; ROOM];
    static mut ROW: [u16; WIDTH] = [0; WIDTH];
    let mut clock = clock();
    let parsed = Bundle::parse(content!("clip.cubist"));
    let Ok(bundle) = &parsed else { fail("no bundle that this player knows") };
    let needed = bundle.memory_needed();
    let Some(memory) = MEMORY.get_mut(..needed) else { fail("too little memory") };
    let mut place: Option<Player<'_>> = None;
    let Ok(player) = Player::put(&mut place, bundle, memory) else { fail("a bundle of other texels") };
    for number in 0..bundle.frames() {
        // Shown again, a frame decodes nothing: the first time is measured.
        frame(&mut clock, |display| {
            player.seek(Frame(number));
            for y in 0..HEIGHT as u32 {
                player.row(y, ROW);
                display.show(ROW);
            }
        });
    }
    end(needed, ROOM)
}
