//! The timeline: from a frame to the keys around it and their weights.
//! Keys stand at frames that the bundle's table gives; on a looping path the first follows the last.

use crate::Bundle;
use crate::fixed::{ONE, WEIGHT_BITS};
use crate::format::{KeyEntry, TIME_CUBIC, TIME_HOLD, TIME_LINEAR};
use crate::record::Place;

/// The weights (Q14, summing to one) of four keys: the one before the interval, its two ends, the one after.
pub type Weights = [i32; 4];

/// The weights by which of the outer keys carry a layer: both; not the first; not the last; neither.
pub type WeightSet = [Weights; 4];

/// A moment between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Moment {
    /// The key interval; key `interval` is at or before the frame.
    pub interval: usize,
    /// The weights of the keys around it.
    pub weights: WeightSet,
    /// How far it is to the end of the interval, Q14.
    pub linear: i32,
    /// Frames since the start of the interval.
    pub passed: u32,
    /// Frames of the interval.
    pub length: u32,
}

/// The weights `passed` frames into an interval of `lengths[1]` frames, between intervals of `lengths[0]` and `lengths[2]`
/// (0: there is none). Held: all of the key at the start, until the end is there. Cubic: a Hermite curve whose tangents are the secants over two
/// intervals (Catmull and Rom 1974, for unequal intervals), or over the one where a key is missing.
#[must_use]
pub fn weights(time: u8, lengths: [u32; 3], passed: u32) -> WeightSet {
    // Q28 inside, rounded once at the end: at keys a power of two apart the weights are exact.
    const INNER: u32 = 28;
    let [before, length, after] = lengths.map(i64::from);
    // Values of at most one in Q28 and lengths below 2^24 multiply to less than 2^54.
    let share = |x: i64, part: i64, whole: i64| x.wrapping_mul(part).checked_div_euclid(whole).unwrap_or(0);
    let one = 1i64 << INNER;
    let t = match share(one, i64::from(passed), length).clamp(0, one) {
        t if t < one && time == TIME_HOLD => 0,
        t => t,
    };
    let rounded = |x: i64| {
        const DROP: u32 = INNER - WEIGHT_BITS;
        (x.wrapping_add(1 << (DROP - 1)) >> DROP) as i32
    };
    if time != TIME_CUBIC {
        let t = rounded(t);
        return [[0, ONE.wrapping_sub(t), t, 0]; 4];
    }
    let square = t.wrapping_mul(t) >> INNER;
    let cube = square.wrapping_mul(t) >> INNER;
    // The Hermite basis: the second value, the two tangents.
    let value = square.wrapping_mul(3).wrapping_sub(cube.wrapping_mul(2));
    let leaving = cube.wrapping_sub(square.wrapping_mul(2)).wrapping_add(t);
    let arriving = cube.wrapping_sub(square);
    let set = |missing: usize| {
        let (first, last) = (missing & 1 == 0, missing & 2 == 0);
        // The secants over two intervals at either end, as shares of the interval's own.
        let leave = |x: i64| share(x, length, before.wrapping_add(length));
        let arrive = |x: i64| share(x, length, length.wrapping_add(after));
        let (w0, w2, w3) = match (first, last) {
            (true, true) => (leave(leaving).wrapping_neg(), value.wrapping_add(leave(leaving)), arrive(arriving)),
            // The missing tangent is the one that makes the curve a parabola through the three keys there are.
            (false, true) => (0, value.wrapping_add(leaving.wrapping_mul(2)), arrive(arriving.wrapping_sub(leaving))),
            (true, false) => {
                let w0 = leave(arriving.wrapping_sub(leaving));
                (w0, value.wrapping_sub(w0).wrapping_add(arriving.wrapping_mul(2)), 0)
            }
            (false, false) => (0, t, 0),
        };
        let (w0, w2, w3) = (rounded(w0), rounded(w2), rounded(w3));
        [w0, ONE.wrapping_sub(w0).wrapping_sub(w2).wrapping_sub(w3), w2, w3]
    };
    [set(0), set(1), set(2), set(3)]
}

impl Bundle<'_> {
    /// Key intervals: one between each two keys; a looping path has one more, back to the first key; a single key has one.
    #[must_use]
    pub fn intervals(&self) -> usize {
        if self.looping() { self.key_count() } else { self.key_count().saturating_sub(1).max(1) }
    }

    /// The frame at which interval `interval` starts; that past the last key is the end of the path.
    fn interval_start(&self, interval: usize) -> u32 {
        if interval < self.key_count() { self.key(interval).frame } else { self.frames() }
    }

    /// Frames of interval `interval`, counted around the loop of a looping path; 0 where there is none.
    #[must_use]
    #[inline(never)]
    pub fn interval_length(&self, interval: isize) -> u32 {
        let count = self.intervals() as isize;
        let index = if self.looping() { interval.checked_rem_euclid(count).unwrap_or(0) } else { interval };
        if !(0..count).contains(&index) {
            return 0;
        }
        let index = index as usize;
        self.interval_start(index.saturating_add(1)).saturating_sub(self.interval_start(index))
    }

    /// The moment of `frame`, which is below [`Bundle::frames`].
    #[must_use]
    pub fn moment(&self, frame: u32) -> Moment {
        let (keys, _) = self.path().table.as_chunks();
        let after = keys.partition_point(|bytes| KeyEntry::from_bytes(bytes).frame <= frame);
        let interval = after.saturating_sub(1).min(self.intervals().saturating_sub(1));
        let at = interval as isize;
        let length = self.interval_length(at);
        let lengths = [self.interval_length(at.wrapping_sub(1)), length, self.interval_length(at.wrapping_add(1))];
        let passed = frame.saturating_sub(self.interval_start(interval));
        let time = self.path().time;
        let [[_, _, linear, _], ..] = weights(time.min(TIME_LINEAR), lengths, passed);
        Moment { interval, weights: weights(time, lengths, passed), linear, passed, length }
    }

    /// The place of key `key`'s record, `run` records after the last independent one.
    #[must_use]
    pub fn place(&self, key: usize, run: u32) -> Place {
        let at = key as isize;
        Place {
            independent: self.key(key).independent,
            run,
            has_before: key > 0 || self.looping(),
            has_after: key < self.intervals(),
            lengths: [self.interval_length(at.wrapping_sub(1)), self.interval_length(at.wrapping_sub(2))],
            camera: self.camera(key),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_are_exact_at_both_keys() {
        for time in [TIME_HOLD, TIME_LINEAR, TIME_CUBIC] {
            for lengths in [[8, 8, 8], [8, 7, 3], [0, 5, 0], [1, 200, 9]] {
                for passed in 0..=lengths[1] {
                    for set in weights(time, lengths, passed) {
                        assert_eq!(set.iter().sum::<i32>(), ONE);
                    }
                }
                assert_eq!(weights(time, lengths, 0), [[0, ONE, 0, 0]; 4]);
                assert_eq!(weights(time, lengths, lengths[1]), [[0, 0, ONE, 0]; 4]);
                assert!(time != TIME_HOLD || weights(time, lengths, lengths[1] - 1) == [[0, ONE, 0, 0]; 4]);
            }
        }
    }

    #[test]
    fn cubic_weights_follow_straight_motion() {
        // Positions on a line at the frames of unequal keys come back as that line.
        let lengths = [8, 5, 3];
        let positions = [-8, 0, 5, 8].map(|x| x * 1000);
        for passed in 0..=5 {
            for (missing, set) in weights(TIME_CUBIC, lengths, passed).iter().enumerate() {
                let sum: i64 = set.iter().zip(positions).map(|(&w, x)| i64::from(w) * x).sum();
                let exact = i64::from(passed) * 1000;
                assert!(((sum >> 14) - exact).abs() <= 2, "{missing} {passed}: {} {exact}", sum >> 14);
            }
        }
    }
}
