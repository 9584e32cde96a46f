//! The range encoder: the other end of `cubist_core::coder::Decoder`.
//! What is coded, and in which context, the core's own description of the stream says.

use cubist_core::coder::{Bits, NUMBER_CONTEXTS, Probability};
use std::sync::LazyLock;

/// Writes bits; `finish` gives the bytes.
#[derive(Debug)]
pub struct Encoder {
    low: u64,
    range: u32,
    /// The byte that a carry may still change, and how many 255s follow it.
    held: Option<u8>,
    run: usize,
    bytes: Vec<u8>,
}

impl Default for Encoder {
    fn default() -> Self {
        Self { low: 0, range: u32::MAX, held: None, run: 0, bytes: Vec::new() }
    }
}

impl Encoder {
    /// Moves the top byte of `low` out, carrying into what is held back.
    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        let top = (self.low >> 24) as u8;
        if carry == 1 || top != 0xff {
            if let Some(held) = self.held {
                self.bytes.push(held.wrapping_add(carry));
            }
            self.bytes.extend(std::iter::repeat_n(0xffu8.wrapping_add(carry), self.run));
            self.run = 0;
            self.held = Some(top);
        } else {
            self.run += 1;
        }
        self.low = (self.low & 0x00ff_ffff) << 8;
    }

    fn normalise(&mut self) {
        if self.range < 1 << 24 {
            self.range <<= 8;
            self.shift();
        }
    }

    /// The bytes. The decoder reads zeros past the end, so trailing zeros are left out, and of all numbers
    /// that would do the one with the most of them is taken.
    #[must_use]
    pub fn finish(mut self) -> Vec<u8> {
        let last = self.low + u64::from(self.range) - 1;
        for zeros in (0..33).rev() {
            let candidate = (last >> zeros) << zeros;
            if candidate >= self.low {
                self.low = candidate;
                break;
            }
        }
        for _ in 0..5 {
            self.shift();
        }
        while self.bytes.last() == Some(&0) {
            self.bytes.pop();
        }
        self.bytes
    }
}

impl Bits for Encoder {
    fn bit(&mut self, probability: &mut Probability, bit: bool) -> bool {
        let bound = (self.range >> 12) * probability.zero();
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        probability.learn(bit);
        self.normalise();
        bit
    }

    fn flat(&mut self, count: u32, value: u32) -> u32 {
        for shift in (0..count).rev() {
            self.range >>= 1;
            if value >> shift & 1 == 1 {
                self.low += u64::from(self.range);
            }
            self.normalise();
        }
        value & 1u32.checked_shl(count).unwrap_or(0).wrapping_sub(1)
    }
}

/// What a 0 and a 1 cost in bits, by P(0) in 1/4096: fits ask for it some hundred million times.
static PRICES: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let price = |part: u32| -libm::log2(f64::from(part) / 4096.0);
    (0..4096).map(|zero| [price(zero), price(4096 - zero)]).collect()
});

/// Counts bits instead of writing them: what a number would cost in contexts as they stand.
struct Price {
    bits: f64,
}

impl Bits for Price {
    fn bit(&mut self, probability: &mut Probability, bit: bool) -> bool {
        self.bits += PRICES[probability.zero() as usize][usize::from(bit)];
        bit
    }

    fn flat(&mut self, count: u32, value: u32) -> u32 {
        self.bits += f64::from(count);
        value
    }
}

/// The price of `value` in `contexts`, bits.
#[must_use]
pub fn price(contexts: &[Probability], value: i32) -> f64 {
    let mut own = [Probability::NEW; NUMBER_CONTEXTS];
    own.copy_from_slice(&contexts[..NUMBER_CONTEXTS]);
    let mut price = Price { bits: 0.0 };
    cubist_core::coder::number(&mut price, &mut own, value);
    price.bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use cubist_core::coder::{Decoder, number};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_goes_in_comes_out(values in prop::collection::vec((-70_000i32..70_000, 0u32..9), 0..300)) {
            let mut contexts = [Probability::NEW; NUMBER_CONTEXTS];
            let mut encoder = Encoder::default();
            for &(value, flat) in &values {
                number(&mut encoder, &mut contexts, value);
                encoder.flat(flat, value as u32);
            }
            let bytes = encoder.finish();
            let mut contexts = [Probability::NEW; NUMBER_CONTEXTS];
            let mut decoder = Decoder::new(&bytes);
            for &(value, flat) in &values {
                prop_assert_eq!(number(&mut decoder, &mut contexts, 0), value);
                prop_assert_eq!(decoder.flat(flat, 0), value as u32 & ((1 << flat) - 1));
            }
        }
    }

    #[test]
    fn carries_run_through_long_rows_of_ones() {
        let mut encoder = Encoder::default();
        for _ in 0..200 {
            encoder.flat(8, 0xff);
        }
        let mut decoder_bytes = encoder.finish();
        decoder_bytes.push(0);
        let mut decoder = Decoder::new(&decoder_bytes);
        for _ in 0..200 {
            assert_eq!(decoder.flat(8, 0), 0xff);
        }
    }
}
