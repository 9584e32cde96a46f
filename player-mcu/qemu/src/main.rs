//! Plays the bundle that is linked in, frame by frame, and counts what it takes. It runs in QEMU with `-icount shift=7`, where SysTick
//! tells instructions exactly; a line of JSON for each frame goes out by semihosting, to `cubist-mcu`.
//!
//! Every frame is drawn twice. The first time seek and rows are measured as a whole. The second time each row is measured on its own and
//! the pixels are summed: the first rows of rows of blocks, cells or parts of larger ones, cost what loading takes on top of what the
//! others cost, and over those the pixels of smooth and torn cells tell what each costs, by least squares (the sums go out).
#![no_std]
#![no_main]

mod clock;
mod text;

use clock::Clock;
use core::hint::black_box;
use cortex_m::peripheral::Peripherals;
use cortex_m_rt::entry;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE};
use cubist_core::{Bundle, Frame, Player, Work};
use text::Line;

/// What the firmware plays: what the bundle has.
#[cfg(not(any(feature = "spread", texels = "4", texels = "565")))]
type Texels = cubist_core::Indexed8;
#[cfg(feature = "spread")]
type Texels = cubist_core::Spread8;
#[cfg(all(texels = "4", not(feature = "spread")))]
type Texels = cubist_core::Indexed4;
#[cfg(all(texels = "565", not(feature = "spread")))]
type Texels = cubist_core::Direct565;

/// Room for a player's working memory; what is not asked for stays untouched.
const ROOM: usize = 1 << 20;
/// The widest screen there is.
const WIDEST: usize = 4096;

/// As an ELF has it: at an address that any number type can be read from.
#[repr(align(4))]
struct Aligned<T: ?Sized>(T);
static BUNDLE: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!(env!("OUT_DIR"), "/bundle.cubist")));

/// Draws row `y` as the firmware's feature says.
fn draw(player: &mut Player<'_, Texels>, y: u32, row: &mut [u16]) {
    #[cfg(feature = "dithered")]
    player.dithered_row(y, row);
    #[cfg(feature = "bilinear")]
    player.bilinear_row(y, row);
    #[cfg(feature = "smooth")]
    player.smooth_row(y, row);
    #[cfg(feature = "fine")]
    player.fine_row(y, row);
    #[cfg(not(any(feature = "dithered", feature = "bilinear", feature = "smooth", feature = "fine")))]
    player.row(y, row);
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    fail("a panic")
}

#[inline(never)]
fn fail(what: &str) -> ! {
    let mut line = Line::new();
    line.word("{\"error\": \"").word(what).word("\"}").end();
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

/// What the rows of a frame say about smooth and torn pixels: the sums of the least-squares fit of `cost = a * smooth + b * torn`.
#[derive(Default)]
struct Fit {
    smooth_smooth: u64,
    smooth_torn: u64,
    torn_torn: u64,
    smooth_cost: u64,
    torn_cost: u64,
}

impl Fit {
    fn add(&mut self, smooth: u32, torn: u32, cost: u32) {
        let product = |a: u32, b: u32| u64::from(a) * u64::from(b);
        self.smooth_smooth += product(smooth, smooth);
        self.smooth_torn += product(smooth, torn);
        self.torn_torn += product(torn, torn);
        self.smooth_cost += product(smooth, cost);
        self.torn_cost += product(torn, cost);
    }
}

/// Rows drawn one by one: what each costs, and what the pixels are.
struct Rows {
    checksum: u32,
    loading: u32,
    fit: Fit,
}

#[inline(never)]
fn rows(player: &mut Player<'_, Texels>, row: &mut [u16], clock: &mut Clock) -> Rows {
    let (height, cell) = (player.bundle().size().1, 1u32 << player.bundle().path().cell_log2);
    let mut found = Rows { checksum: 0x811c_9dc5, loading: 0, fit: Fit::default() };
    // There is something to work out for each row of blocks: cells, or parts of larger ones.
    let strip = cell.min(8);
    for top in (0..height).step_by(strip as usize) {
        let (mut first, mut others) = (0, 0);
        let bottom = height.min(top + strip);
        for y in top..bottom {
            let before = player.work();
            let cost = clock.measure(|| draw(player, y, row));
            let after = player.work();
            // FNV-1a, a pixel at a time.
            found.checksum = row.iter().fold(found.checksum, |sum, &pixel| (sum ^ u32::from(pixel)).wrapping_mul(0x0100_0193));
            if y == top {
                first = cost;
            } else {
                others += cost;
                found.fit.add(after.smooth_pixels - before.smooth_pixels, after.torn_pixels - before.torn_pixels, cost);
            }
        }
        // A strip has two rows at least, unless the screen's edge cuts it.
        if let Some(mean) = others.checked_div(bottom - top - 1) {
            found.loading += first.saturating_sub(mean);
        }
    }
    found
}

/// Parses the bundle into its place. A function of its own, and so the next: what they take of the stack is free again when frames are played.
#[inline(never)]
fn parse(place: &'static mut Option<Bundle<'static>>) -> &'static Bundle<'static> {
    let Ok(bundle) = Bundle::parse(&BUNDLE.0) else { fail("no bundle that this player knows") };
    place.insert(bundle)
}

/// Makes a player in its place.
#[inline(never)]
fn make(
    place: &'static mut Option<Player<'static, Texels>>,
    bundle: &'static Bundle<'static>,
    memory: &'static mut [u8],
) -> &'static mut Player<'static, Texels> {
    let Ok(player) = Player::put(place, bundle, memory) else { fail("too little memory") };
    player
}

#[inline(never)]
fn play(player: &mut Player<'_, Texels>, row: &mut [u16], clock: &mut Clock) {
    let bundle = player.bundle();
    let (width, height) = bundle.size();
    let Some(row) = row.get_mut(..width as usize) else { fail("a wide screen") };
    // The keys that playback starts from; a jump, and longer than the clock counts.
    player.seek(Frame(0));
    for frame in 0..bundle.frames() {
        let seek = clock.measure(|| player.seek(Frame(frame)));
        // The clock counts a few million: that may be less than a frame.
        let parts = (0..16).map(|part| height * part / 16..height * (part + 1) / 16);
        let drawing: u32 = parts
            .map(|part| {
                clock.measure(|| {
                    for y in part {
                        draw(player, y, row);
                        black_box(&mut *row);
                    }
                })
            })
            .sum();
        let work = player.work();
        player.seek(Frame(frame));
        let Rows { checksum, loading, fit } = rows(player, row, clock);
        report(frame, [seek, drawing, loading], &work, &fit, checksum);
    }
}

/// Prints a frame's line. A function of its own, so that its text does not count as the player's stack.
#[inline(never)]
fn report(frame: u32, [seek, drawing, loading]: [u32; 3], work: &Work, fit: &Fit, checksum: u32) {
    let mut line = Line::new();
    line.word("{\"frame\": ").number(frame.into());
    for (name, value) in [
        ("instructions", u64::from(seek + drawing)),
        ("seek", seek.into()),
        ("rows", drawing.into()),
        ("loading", loading.into()),
        ("smooth_pixels", work.smooth_pixels.into()),
        ("torn_pixels", work.torn_pixels.into()),
        ("coverage_tests", work.coverage_tests.into()),
        ("layers", work.layers.into()),
        ("record_bytes", work.record_bytes.into()),
        ("smooth_smooth", fit.smooth_smooth),
        ("smooth_torn", fit.smooth_torn),
        ("torn_torn", fit.torn_torn),
        ("smooth_cost", fit.smooth_cost),
        ("torn_cost", fit.torn_cost),
        ("checksum", checksum.into()),
    ] {
        line.word(", \"").word(name).word("\": ").number(value);
    }
    line.word("}").end();
}

/// Prints the last line.
#[inline(never)]
fn end(memory: usize) {
    let mut line = Line::new();
    line.word("{\"memory_bytes\": ").number(memory as u64).word(", \"player_bytes\": ").number(size_of::<Player<'_, Texels>>() as u64);
    line.word("}").end();
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [u8; ROOM] = [0; ROOM];
    static mut ROW: [u16; WIDEST] = [0; WIDEST];
    static mut PARSED: Option<Bundle<'static>> = None;
    static mut PLAYER: Option<Player<'static, Texels>> = None;
    let Some(peripherals) = Peripherals::take() else { fail("no peripherals") };
    let mut clock = Clock::start(peripherals.SYST);
    let bundle = parse(PARSED);
    let needed = Player::<Texels>::memory_needed(bundle);
    let Some(memory) = MEMORY.get_mut(..needed) else { fail("too little memory") };
    play(make(PLAYER, bundle, memory), ROW, &mut clock);
    end(needed);
    loop {
        // The painted stack is read from outside, then the emulator is told to quit.
        cortex_m::asm::nop();
    }
}
