//! Instructions, counted by SysTick under QEMU's `-icount shift=7`: an instruction is 128 ns of virtual time there, a tick 40 ns,
//! so that instructions are ticks / 3.2, to the nearest, exactly. Measurements go to `main`.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// SysTick counts down from here, 24 bits: 5.2 million instructions.
const TOP: u32 = 0x00ff_ffff;

/// The clock, and what an empty measurement costs.
pub struct Clock {
    timer: SYST,
    empty: u32,
}

impl Clock {
    /// Starts the timer and measures nothing, to know what a measurement costs.
    pub fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TOP);
        timer.clear_current();
        timer.enable_counter();
        let mut clock = Self { timer, empty: 0 };
        // The first one finds the timer just cleared.
        clock.measure(|| ());
        clock.empty = clock.measure(|| ());
        clock
    }

    /// The instructions that `task` takes. What takes longer than the timer counts is a failure, not a number.
    pub fn measure(&mut self, task: impl FnOnce()) -> u32 {
        self.timer.clear_current();
        // Cleared, it stands at zero until its next tick, which counts as having come by zero.
        while SYST::get_current() == 0 {}
        let _cleared = self.timer.has_wrapped();
        let before = SYST::get_current();
        task();
        let after = SYST::get_current();
        if self.timer.has_wrapped() {
            crate::fail("a measurement longer than SysTick counts");
        }
        let ticks = before.wrapping_sub(after) & TOP;
        ((ticks * 10 + 16) / 32).saturating_sub(self.empty)
    }
}
