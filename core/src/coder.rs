//! Entropy coding: a binary range coder with adaptive contexts, and how numbers become bits.
//! Bytes come from a bundle's key records and packed picture; `lists`, `predict`, `field` and `pack` describe what is coded, through
//! [`Bits`], which the baker's encoder implements too: one description of the stream for both.
//!
//! The range decoder is LZMA's (Igor Pavlov): 32-bit range, 12-bit probabilities; how fast they adapt is our own.

/// Bits go in (encoder) or come out (decoder); what is coded, and in which context, is said once.
pub trait Bits {
    /// Codes one bit in the adaptive context `probability`. An encoder writes `bit` and returns it; a decoder
    /// ignores `bit` and returns what it read.
    fn bit(&mut self, probability: &mut Probability, bit: bool) -> bool;

    /// Codes the low `count` bits of `value`, each with probability one half.
    fn flat(&mut self, count: u32, value: u32) -> u32;
}

/// An adaptive probability: twelve bits of P(0) and a count of what it has seen, in 16 bits,
/// so that a slice of caller's memory can hold them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Probability(u16);

/// Adaptation: the n-th bit moves the probability by 2^-RATE[n]; fast first, then steady.
const RATE: [u8; 16] = [1, 2, 2, 3, 3, 3, 4, 4, 4, 4, 4, 5, 5, 5, 5, 5];

impl Probability {
    /// One half, nothing seen.
    pub const NEW: Self = Self(0x800 << 4);

    /// P(0) in 1/4096, 32..=4064.
    #[must_use]
    #[inline(always)]
    pub const fn zero(self) -> u32 {
        (self.0 >> 4) as u32
    }

    /// Learns that `bit` came.
    #[inline(always)]
    #[expect(clippy::arithmetic_side_effects, reason = "p stays in 32..=4064 and the count in 0..16 by construction")]
    pub fn learn(&mut self, bit: bool) {
        let (p, seen) = (self.zero(), self.0 & 15);
        let rate = RATE.get(usize::from(seen)).copied().unwrap_or(5);
        // The floor keeps the price of a surprise at seven bits; rounding keeps the ceiling.
        let p = if bit { (p - (p >> rate)).max(32) } else { p + ((4095 - p) >> rate) };
        self.0 = (p << 4) as u16 | (seen + u16::from(seen < 15));
    }
}

/// Reads bits from a key record. Past the end it reads zeros: a broken record decodes to
/// something, never to a fault.
#[derive(Clone, Debug)]
pub struct Decoder<'a> {
    bytes: core::slice::Iter<'a, u8>,
    range: u32,
    code: u32,
}

impl<'a> Decoder<'a> {
    /// A decoder at the start of `bytes`.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { bytes: bytes.iter(), range: u32::MAX, code: 0 };
        for _ in 0..4 {
            decoder.code = decoder.code << 8 | decoder.next();
        }
        decoder
    }

    /// Bytes that are not read yet.
    #[must_use]
    pub fn left(&self) -> usize {
        self.bytes.len()
    }

    fn next(&mut self) -> u32 {
        u32::from(self.bytes.next().copied().unwrap_or(0))
    }

    fn normalise(&mut self) {
        if self.range < 1 << 24 {
            self.range <<= 8;
            self.code = self.code << 8 | self.next();
        }
    }
}

impl Bits for Decoder<'_> {
    #[expect(clippy::arithmetic_side_effects, reason = "bound <= range by construction; code is compared before it is reduced")]
    fn bit(&mut self, probability: &mut Probability, _: bool) -> bool {
        // (2^32 >> 12) * 4064 < 2^32.
        let bound = (self.range >> 12) * probability.zero();
        let bit = self.code >= bound;
        if bit {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        probability.learn(bit);
        self.normalise();
        bit
    }

    #[expect(clippy::arithmetic_side_effects, reason = "code is compared before it is reduced")]
    fn flat(&mut self, count: u32, _: u32) -> u32 {
        let mut value = 0;
        for _ in 0..count.min(32) {
            self.range >>= 1;
            let bit = self.code >= self.range;
            if bit {
                self.code -= self.range;
            }
            value = value << 1 | u32::from(bit);
            self.normalise();
        }
        value
    }
}

/// Contexts of one signed number: is it zero, its sign, its magnitude class in unary, the bit after the leading one.
pub const NUMBER_CONTEXTS: usize = 2 + 2 * CLASSES;
/// Magnitude classes with contexts of their own; larger ones, which are rare, share the last one's. The first has no bit after the leading one: one
/// context of a number is never used.
const CLASSES: usize = 10;
/// Bits of a magnitude, at most.
const MOST_BITS: u32 = 17;

/// Codes a signed number of at most 17 bits of magnitude in `contexts` ([`NUMBER_CONTEXTS`] of them): zero flag, sign, the
/// magnitude's bit length in unary, then the bits after the leading one, the first of them adaptive.
pub fn number<B: Bits>(bits: &mut B, contexts: &mut [Probability], value: i32) -> i32 {
    let Some((contexts, _)) = contexts.split_first_chunk_mut::<NUMBER_CONTEXTS>() else { return 0 };
    let [zero, sign, rest @ ..] = contexts;
    if bits.bit(zero, value == 0) {
        return 0;
    }
    let negative = bits.bit(sign, value < 0);
    let magnitude = value.unsigned_abs().clamp(1, (1 << MOST_BITS) - 1);
    let (unary, next) = rest.split_at_mut(CLASSES);
    let own = |class: u32| (class as usize).min(CLASSES - 1);
    let wanted = magnitude.ilog2();
    let mut class = 0u32;
    // The last class needs no flag that it is.
    while class < MOST_BITS - 1
        && let Some(context) = unary.get_mut(own(class))
        && bits.bit(context, class < wanted)
    {
        class = class.wrapping_add(1);
    }
    let mut decoded = 1u32;
    if class > 0 {
        let below = class.wrapping_sub(1);
        let first = next.get_mut(own(class)).map_or(0, |context| u32::from(bits.bit(context, magnitude >> below & 1 == 1)));
        let tail = bits.flat(below, magnitude & (1u32 << below).wrapping_sub(1));
        decoded = (2 | first) << below | tail;
    }
    let decoded = i32::try_from(decoded).unwrap_or(i32::MAX);
    if negative { decoded.wrapping_neg() } else { decoded }
}

#[cfg(test)]
mod tests {
    use super::Probability;

    #[test]
    fn whatever_comes_probabilities_keep_away_from_certainty() {
        // By state, whether it can be reached.
        let mut reached = [false; 1 << 16];
        let mark = |state: u16, reached: &mut [bool]| reached.get_mut(usize::from(state)).map(|slot| !core::mem::replace(slot, true));
        let mut more = mark(Probability::NEW.0, &mut reached);
        while more == Some(true) {
            more = Some(false);
            for state in 0..=u16::MAX {
                if reached.get(usize::from(state)) != Some(&true) {
                    continue;
                }
                assert!((32..=4064).contains(&Probability(state).zero()), "{state:x}");
                for bit in [false, true] {
                    let mut to = Probability(state);
                    to.learn(bit);
                    more = more.max(mark(to.0, &mut reached));
                }
            }
        }
        assert!(reached.iter().filter(|&&reached| reached).count() > 1000);
    }
}
