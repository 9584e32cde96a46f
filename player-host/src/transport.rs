//! The transport: which frame shows at a time.
//! Keys and the mouse (`keys`, `window`) and a clock reading come in; a frame number and the time of the next change go out.
//! Nothing here reads a clock or draws, and the arithmetic is exact, so a late picture drops frames and never slows the film.

use std::time::Duration;

/// One frame in phase units: a nanosecond at one frame per second and one eighth speed is one unit.
const FRAME: i128 = 8_000_000_000;
/// The speeds on offer, in eighths.
const SPEEDS: [u16; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Where `SPEEDS` holds normal speed.
const NORMAL: usize = 3;

/// What happens at the ends of the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// It stops on the last picture of its direction.
    Stop,
    /// It goes on at the other end.
    Loop,
    /// It turns round; the end pictures show once.
    PingPong,
}

/// Play state over `frames` frames; all times are readings of one clock that never runs backwards.
#[derive(Clone, Debug)]
pub struct Transport {
    frames: u32,
    fps: u16,
    speed: usize,
    reverse: bool,
    ends: Ends,
    playing: bool,
    held: bool,
    /// Phase at `since`, within the period.
    from: i128,
    since: Duration,
}

impl Transport {
    /// Playing from frame 0 at `now`; zero frames or frames per second count as one.
    pub fn new(frames: u32, fps: u16, ends: Ends, now: Duration) -> Self {
        Self {
            frames: frames.max(1),
            fps: fps.max(1),
            speed: NORMAL,
            reverse: false,
            ends,
            playing: true,
            held: false,
            from: 0,
            since: now,
        }
    }

    /// The frame that shows at `now`.
    pub fn frame(&self, now: Duration) -> u32 {
        let index = self.phase(now) / FRAME;
        let frames = i128::from(self.frames);
        let folded = if index < frames { index } else { self.period() - index };
        u32::try_from(folded).unwrap_or(0)
    }

    /// The time at which the frame changes next; none while paused or held.
    pub fn deadline(&self, now: Duration) -> Option<Duration> {
        if !self.moving() {
            return None;
        }
        let within = self.phase(now) % FRAME;
        let left = if self.reverse { within + 1 } else { FRAME - within };
        let nanos = (left + self.rate() - 1) / self.rate();
        Some(now + Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX)))
    }

    /// Lets a film that stops at its ends stop there; call it before asking for the frame.
    pub fn tick(&mut self, now: Duration) {
        let raw = self.raw(now);
        if self.moving() && self.ends == Ends::Stop && (raw < 0 || raw >= self.period() * FRAME) {
            self.anchor(now);
            self.playing = false;
        }
    }

    /// Plays or pauses; a film stopped at its end starts over.
    pub fn toggle_play(&mut self, now: Duration) {
        self.anchor(now);
        self.playing = !self.playing;
        let last = if self.reverse { 0 } else { self.frames - 1 };
        if self.playing && self.ends == Ends::Stop && self.frame(now) == last {
            self.place(self.frames - 1 - last, now);
        }
    }

    /// Turns the direction round, on the spot.
    pub fn toggle_reverse(&mut self, now: Duration) {
        self.anchor(now);
        self.reverse = !self.reverse;
        if !self.playing {
            self.place(self.frame(now), now);
        }
    }

    /// Goes from stop to loop to ping-pong and round again, keeping the frame and the direction of travel.
    pub fn next_ends(&mut self, now: Duration) {
        self.anchor(now);
        self.place(self.frame(now), now);
        self.ends = match self.ends {
            Ends::Stop => Ends::Loop,
            Ends::Loop => Ends::PingPong,
            Ends::PingPong => Ends::Stop,
        };
    }

    /// One speed up or down the list, as far as it goes.
    pub fn change_speed(&mut self, faster: bool, now: Duration) {
        self.anchor(now);
        self.speed = if faster { (self.speed + 1).min(SPEEDS.len() - 1) } else { self.speed.saturating_sub(1) };
    }

    /// Pauses and moves `by` frames; round the end on a loop, else as far as the end. The direction of travel stays.
    pub fn step(&mut self, by: i32, now: Duration) {
        self.anchor(now);
        self.playing = false;
        let target = i64::from(self.frame(now)) + i64::from(by);
        let frames = i64::from(self.frames);
        let target = if self.ends == Ends::Loop { target.rem_euclid(frames) } else { target.clamp(0, frames - 1) };
        self.place(u32::try_from(target).unwrap_or(0), now);
    }

    /// Jumps to `frame`, at most the last; playing goes on from there in the same direction.
    pub fn jump(&mut self, frame: u32, now: Duration) {
        self.anchor(now);
        self.place(frame.min(self.frames - 1), now);
    }

    /// A hand takes the timeline: time stands still until [`Transport::release`].
    pub fn grab(&mut self, now: Duration) {
        self.anchor(now);
        self.held = true;
    }

    /// The hand lets go; playing goes on if it was on.
    pub fn release(&mut self, now: Duration) {
        self.anchor(now);
        self.held = false;
    }

    /// Whether a hand holds the timeline.
    pub fn held(&self) -> bool {
        self.held
    }
    /// Whether the film runs (a held one counts as running).
    pub fn playing(&self) -> bool {
        self.playing
    }
    /// Number of frames, at least 1.
    pub fn frames(&self) -> u32 {
        self.frames
    }
    /// Speed in eighths: 8 is normal.
    pub fn speed_eighths(&self) -> u16 {
        SPEEDS[self.speed]
    }
    /// What happens at the ends.
    pub fn ends(&self) -> Ends {
        self.ends
    }
    /// Whether the frame numbers fall at `now`.
    pub fn backwards(&self, now: Duration) -> bool {
        let back_leg = self.ends == Ends::PingPong && self.phase(now) / FRAME >= i128::from(self.frames);
        self.reverse != back_leg
    }

    fn moving(&self) -> bool {
        self.playing && !self.held
    }

    /// Phase units per nanosecond.
    fn rate(&self) -> i128 {
        i128::from(self.fps) * i128::from(SPEEDS[self.speed])
    }

    /// Frames until the film repeats itself.
    fn period(&self) -> i128 {
        let frames = i128::from(self.frames);
        if self.ends == Ends::PingPong { (2 * (frames - 1)).max(1) } else { frames }
    }

    /// Phase at `now`, not yet brought into the period: below 2^64 ns x 2^16 x 2^6, hence i128.
    fn raw(&self, now: Duration) -> i128 {
        if !self.moving() {
            return self.from;
        }
        let elapsed = i128::try_from(now.saturating_sub(self.since).as_nanos()).unwrap_or(0) * self.rate();
        if self.reverse { self.from - elapsed } else { self.from + elapsed }
    }

    fn phase(&self, now: Duration) -> i128 {
        let end = self.period() * FRAME;
        let raw = self.raw(now);
        if self.ends == Ends::Stop { raw.clamp(0, end - 1) } else { raw.rem_euclid(end) }
    }

    /// On the way back of a ping-pong, at the anchor.
    fn returning(&self) -> bool {
        self.ends == Ends::PingPong && self.from / FRAME >= i128::from(self.frames)
    }

    fn anchor(&mut self, now: Duration) {
        self.from = self.phase(now);
        self.since = now;
    }

    /// Puts `frame` at its beginning, seen in the direction of travel, which stays, so that it shows for its whole time. The anchor is where it comes from.
    fn place(&mut self, frame: u32, now: Duration) {
        // It is put on the way out, where the way back is the other direction.
        if self.returning() {
            self.reverse = !self.reverse;
        }
        let start = i128::from(frame) * FRAME;
        self.from = if self.reverse { start + FRAME - 1 } else { start };
        self.since = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ZERO: Duration = Duration::ZERO;

    /// The frames seen by following the deadlines `count` times.
    fn follow(transport: &mut Transport, mut now: Duration, count: usize) -> Vec<u32> {
        let mut seen = vec![transport.frame(now)];
        for _ in 0..count {
            let Some(next) = transport.deadline(now) else { break };
            assert_eq!(
                transport.frame(next - Duration::from_nanos(1)),
                transport.frame(now),
                "the frame changes at its deadline, not before"
            );
            now = next;
            transport.tick(now);
            seen.push(transport.frame(now));
        }
        seen
    }

    #[test]
    fn each_deadline_is_one_frame_on_at_any_rate() {
        for fps in [1, 24, 25, 30, 60, 144, 1000] {
            let mut transport = Transport::new(5, fps, Ends::Loop, Duration::from_nanos(7));
            assert_eq!(follow(&mut transport, Duration::from_nanos(7), 11), [0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1], "{fps} fps");
        }
    }

    #[test]
    fn a_late_reading_drops_frames() {
        let transport = Transport::new(100, 30, Ends::Loop, ZERO);
        assert_eq!(transport.frame(Duration::from_millis(500)), 15);
        assert_eq!(transport.frame(Duration::from_secs(3600 * 24)), (3600 * 24 * 30 % 100) as u32);
    }

    #[test]
    fn stop_plays_the_last_frame_out_and_starts_over() {
        let mut transport = Transport::new(3, 10, Ends::Stop, ZERO);
        assert_eq!(follow(&mut transport, ZERO, 9), [0, 1, 2, 2]);
        assert!(!transport.playing());
        let now = Duration::from_secs(1);
        transport.toggle_play(now);
        assert_eq!(transport.frame(now), 0);
        transport.toggle_play(now);
        transport.jump(0, now);
        transport.toggle_reverse(now);
        transport.toggle_play(now);
        assert_eq!(follow(&mut transport, now, 9), [2, 1, 0, 0]);
    }

    #[test]
    fn ping_pong_shows_the_ends_once() {
        let mut transport = Transport::new(4, 30, Ends::PingPong, ZERO);
        assert_eq!(follow(&mut transport, ZERO, 8), [0, 1, 2, 3, 2, 1, 0, 1, 2]);
        transport.jump(2, ZERO);
        transport.toggle_reverse(ZERO);
        let mut still = Transport::new(1, 30, Ends::PingPong, ZERO);
        assert_eq!(follow(&mut still, ZERO, 2), [0, 0, 0]);
    }

    #[test]
    fn leaving_ping_pong_on_the_way_back_keeps_the_direction() {
        let mut transport = Transport::new(4, 10, Ends::PingPong, ZERO);
        let now = Duration::from_millis(450);
        assert_eq!((transport.frame(now), transport.backwards(now)), (2, true));
        transport.next_ends(now);
        assert_eq!((transport.ends(), transport.frame(now), transport.backwards(now)), (Ends::Stop, 2, true));
        assert_eq!(follow(&mut transport, now, 9), [2, 1, 0, 0]);
    }

    #[test]
    fn the_way_back_of_a_ping_pong_is_kept_unless_it_is_turned() {
        let now = Duration::from_millis(450);
        let on_the_way_back = || Transport::new(4, 10, Ends::PingPong, ZERO);
        let mut paused = on_the_way_back();
        paused.toggle_play(now);
        assert_eq!((paused.frame(now), paused.backwards(now)), (2, true));
        paused.toggle_reverse(now);
        assert_eq!((paused.frame(now), paused.backwards(now)), (2, false));
        paused.toggle_reverse(now);
        assert_eq!((paused.frame(now), paused.backwards(now)), (2, true));
        let mut stepped = on_the_way_back();
        stepped.step(-1, now);
        assert_eq!((stepped.frame(now), stepped.backwards(now)), (1, true));
        let mut dragged = on_the_way_back();
        dragged.grab(now);
        dragged.jump(2, now);
        dragged.release(now);
        assert_eq!((dragged.frame(now), dragged.backwards(now)), (2, true));
    }

    #[test]
    fn reverse_turns_round_in_mid_frame() {
        let mut transport = Transport::new(10, 10, Ends::Loop, ZERO);
        let now = Duration::from_millis(250);
        transport.toggle_reverse(now);
        assert_eq!(transport.frame(now), 2);
        assert_eq!(transport.frame(Duration::from_millis(350)), 1);
        assert_eq!(follow(&mut transport, now, 4), [2, 1, 0, 9, 8]);
    }

    #[test]
    fn speed_changes_without_a_jump() {
        let mut transport = Transport::new(1000, 10, Ends::Loop, ZERO);
        let now = Duration::from_secs(1);
        transport.change_speed(true, now);
        assert_eq!((transport.speed_eighths(), transport.frame(now)), (16, 10));
        assert_eq!(transport.frame(Duration::from_secs(2)), 30);
        for _ in 0..20 {
            transport.change_speed(false, Duration::from_secs(2));
        }
        assert_eq!((transport.speed_eighths(), transport.frame(Duration::from_secs(10))), (1, 40));
    }

    #[test]
    fn steps_pause_and_wrap_only_on_a_loop() {
        let mut transport = Transport::new(3, 10, Ends::Loop, ZERO);
        transport.step(-1, ZERO);
        assert_eq!((transport.playing(), transport.frame(Duration::from_secs(9))), (false, 2));
        transport.step(2, ZERO);
        assert_eq!(transport.frame(ZERO), 1);
        transport.next_ends(ZERO);
        transport.step(9, ZERO);
        assert_eq!((transport.ends(), transport.frame(ZERO)), (Ends::PingPong, 2));
    }

    #[test]
    fn scrubbing_holds_time_and_lets_it_go_on() {
        let mut transport = Transport::new(100, 10, Ends::Loop, ZERO);
        let now = Duration::from_secs(1);
        transport.grab(now);
        transport.jump(50, now);
        let later = Duration::from_secs(5);
        assert_eq!((transport.frame(later), transport.deadline(later)), (50, None));
        transport.release(later);
        assert_eq!(transport.frame(later + Duration::from_secs(1)), 60);
        transport.jump(1000, later);
        assert_eq!(transport.frame(later), 99);
    }

    #[test]
    fn an_empty_film_is_one_still_frame() {
        let transport = Transport::new(0, 0, Ends::Loop, ZERO);
        assert_eq!((transport.frames(), transport.frame(Duration::from_secs(7))), (1, 0));
    }
}
