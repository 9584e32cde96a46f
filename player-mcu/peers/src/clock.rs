//! Instructions, counted by SysTick under QEMU's `-icount shift=7`: an instruction is 128 ns of virtual time there, a tick 40 ns. The timer's
//! 24 bits are 5.2 million instructions, less than a frame takes here: an interrupt counts the times it comes round.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::exception;

/// SysTick counts down from here.
const TOP: u32 = 0x00ff_ffff;

static ROUNDS: AtomicU32 = AtomicU32::new(0);

#[exception]
fn SysTick() {
    // Nobody else writes it.
    ROUNDS.store(ROUNDS.load(Relaxed) + 1, Relaxed);
}

/// The clock, and what an empty measurement costs.
#[derive(Debug)]
pub struct Clock {
    empty: u64,
}

impl Clock {
    /// Starts the timer and measures nothing, to know what a measurement costs.
    #[must_use]
    pub fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TOP);
        timer.clear_current();
        timer.enable_interrupt();
        timer.enable_counter();
        let mut clock = Self { empty: 0 };
        clock.measure(|| ());
        clock.empty = clock.measure(|| ());
        clock
    }

    /// The instructions that `task` takes: exact, but for some twenty for every 5.2 million, by which the interrupt adds to them.
    pub fn measure(&mut self, task: impl FnOnce()) -> u64 {
        let before = now();
        task();
        let ticks = now() - before;
        ((ticks * 10 + 16) / 32).saturating_sub(self.empty)
    }
}

/// Ticks since the start.
fn now() -> u64 {
    loop {
        let rounds = ROUNDS.load(Relaxed);
        let current = SYST::get_current();
        // At zero the timer has come round, and its interrupt may be pending yet.
        if current != 0 && ROUNDS.load(Relaxed) == rounds {
            return u64::from(rounds) * u64::from(TOP + 1) + u64::from(TOP - current);
        }
    }
}
