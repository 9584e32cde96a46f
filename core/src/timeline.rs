//! The timeline: from a frame to the two keys around it and the weight between them.
//! Keys stand at frames that the bundle's table gives; on a looping path the first follows the last.

use crate::Bundle;
use crate::fixed::ONE;
use crate::format::{KeyEntry, TIME_HOLD};
use crate::record::Place;

/// A moment between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moment {
    /// The key interval; key `interval` is at or before the frame.
    pub interval: usize,
    /// How far it is to key `interval + 1`, Q14.
    pub weight: i32,
}

impl Bundle<'_> {
    /// Key intervals: one between each two keys; a looping path has one more, back to the first key; a single key has one.
    #[must_use]
    pub fn intervals(&self) -> usize {
        if self.looping() { self.key_count() } else { self.key_count().saturating_sub(1).max(1) }
    }

    /// The frame at which key `position` stands; positions past the last key stand at the end of the path.
    #[must_use]
    pub fn key_frame(&self, position: usize) -> u32 {
        if position < self.key_count() { self.key(position).frame } else { self.frames() }
    }

    /// The moment of `frame`, which is below [`Bundle::frames`].
    #[must_use]
    pub fn moment(&self, frame: u32) -> Moment {
        let (keys, _) = self.path().table.as_chunks();
        let after = keys.partition_point(|bytes| KeyEntry::from_bytes(bytes).frame <= frame);
        let interval = after.saturating_sub(1).min(self.intervals().saturating_sub(1));
        let start = self.key_frame(interval);
        let length = self.key_frame(interval.saturating_add(1)).saturating_sub(start);
        let passed = frame.saturating_sub(start);
        // Frames are below 2^24, intervals short: 64 bits hold the product, the quotient is at most ONE.
        let weight = (u64::from(passed).wrapping_mul(ONE as u64).wrapping_add(u64::from(length / 2))).checked_div(u64::from(length));
        let weight = if self.path().time == TIME_HOLD { 0 } else { weight.unwrap_or(0).min(ONE as u64) as i32 };
        Moment { interval, weight }
    }

    /// The place of the record at `position` of the timeline, given the position and run of the last one coded.
    #[must_use]
    pub fn place(&self, position: usize, last: Option<(usize, u32)>) -> Place {
        let index = position.checked_rem(self.key_count()).unwrap_or(0);
        let independent = self.key(index).independent;
        let run = match last {
            Some((last, run)) if !independent && last.wrapping_add(1) == position => run.saturating_add(1),
            _ => 0,
        };
        let length = |back: usize| {
            let from = position.saturating_sub(back);
            self.key_frame(from.saturating_add(1)).saturating_sub(self.key_frame(from))
        };
        Place {
            position,
            independent,
            run,
            has_before: index > 0 || self.looping(),
            has_after: index < self.intervals(),
            lengths: [length(1), length(2)],
        }
    }
}
