//! Which frame comes next: round and round, to and fro, or where the potentiometer points. Modes come from pins, by `controls`; frames go to `main`.

/// How a bundle is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// From the last frame to the first.
    Loop,
    /// To the last frame and back.
    PingPong,
    /// The frame that the potentiometer points at, of 4096 positions.
    Position(u16),
}

/// By so much a potentiometer's readings waver while nobody turns it. A frame that goes back and forth over a key would cost ten.
const SLACK: u16 = 12;

/// The frame that is shown, and which way it goes from there.
#[derive(Clone, Copy, Debug)]
pub struct Tempo {
    frames: u32,
    frame: u32,
    back: bool,
    /// Where the potentiometer was when that last counted.
    position: Option<u16>,
}

impl Tempo {
    /// At the first of `frames` frames.
    pub const fn new(frames: u32) -> Self {
        Self { frames, frame: 0, back: false, position: None }
    }

    /// The frame that is shown.
    pub const fn frame(&self) -> u32 {
        self.frame
    }

    /// Goes on to the next frame.
    pub fn step(&mut self, mode: Mode) {
        let last = self.frames.saturating_sub(1);
        if !matches!(mode, Mode::Position(_)) {
            self.position = None;
        }
        match mode {
            Mode::Loop => {
                self.back = false;
                self.frame = if self.frame < last { self.frame + 1 } else { 0 };
            }
            Mode::PingPong => {
                // Both ends are shown once.
                self.back = if self.back { self.frame > 0 } else { self.frame >= last };
                self.frame = if self.back { self.frame.saturating_sub(1) } else { (self.frame + 1).min(last) };
            }
            // There are fewer than 2^24 frames, and 2^12 positions.
            Mode::Position(position) => {
                self.back = false;
                let held = self.position.filter(|held| held.abs_diff(position) <= SLACK).unwrap_or(position);
                self.position = Some(held);
                self.frame = ((u64::from(self.frames) * u64::from(held)) >> 12).min(u64::from(last)) as u32;
            }
        }
    }
}
