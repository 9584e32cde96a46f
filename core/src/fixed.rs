//! Fixed-point numbers: how coordinates are stored in keys, how they are interpolated.
//! Values come from `key`, weights from `timeline`; results go to `cell` and `span`.

/// Fraction bits of a stored coordinate: 1/64 texel.
pub const KEY_BITS: u32 = 6;
/// Fraction bits of a time weight.
pub const WEIGHT_BITS: u32 = 14;
/// A time weight of one.
pub const ONE: i32 = 1 << WEIGHT_BITS;
/// Fraction bits of a coordinate during playback.
pub const PLAY_BITS: u32 = 16;

/// A stored position in the source image: u and v in Q10.6 texels, v in the upper half.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct KeyUv(pub u32);

impl KeyUv {
    /// From u and v in 1/64 texel, clamped to the 16 bits there are.
    #[must_use]
    pub fn new(u: i32, v: i32) -> Self {
        let clamp = |x: i32| u32::from(u16::try_from(x.clamp(0, 0xffff)).unwrap_or(0));
        Self(clamp(v) << 16 | clamp(u))
    }

    /// u in 1/64 texel, 0..=65535.
    #[must_use]
    pub const fn u(self) -> i32 {
        (self.0 & 0xffff) as i32
    }

    /// v in 1/64 texel, 0..=65535.
    #[must_use]
    pub const fn v(self) -> i32 {
        (self.0 >> 16) as i32
    }
}

/// A position in the source image during playback: u and v in Q15.16 texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct PlayUv {
    /// Across, texels in Q15.16.
    pub u: i32,
    /// Down, texels in Q15.16.
    pub v: i32,
}

/// The sum of `values` (Q10.6) times `weights` (Q14, summing to [`ONE`]), in Q15.16, rounded to nearest, ties up;
/// exact where one weight is [`ONE`].
#[must_use]
#[expect(clippy::arithmetic_side_effects, reason = "weights sum to one with magnitudes of at most 1.6: the sum stays below 1.6 * 2^30")]
pub const fn blend([a, b, c, d]: [i32; 4], [e, f, g, h]: [i32; 4]) -> i32 {
    const DROP: u32 = KEY_BITS + WEIGHT_BITS - PLAY_BITS;
    (a * e + b * f + c * g + d * h + (1 << (DROP - 1))) >> DROP
}

/// The value `step` / 2^`log2` of the way from `from` to `to`, rounded down; exact at both ends.
#[must_use]
#[expect(
    clippy::arithmetic_side_effects,
    reason = "the product of a 33-bit difference and step <= 64 fits i64, the sum lies between from and to"
)]
pub const fn part(from: i32, to: i32, step: u32, log2: u32) -> i32 {
    (from as i64 + (((to as i64 - from as i64) * step as i64) >> log2)) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blend_is_exact_at_the_keys_and_keeps_constants() {
        assert_eq!(blend([1, 65_535, 3, 4], [0, ONE, 0, 0]), 65_535 << 10);
        assert_eq!(blend([1, 2, 65_535, 4], [0, 0, ONE, 0]), 65_535 << 10);
        assert_eq!(blend([1234; 4], [-700, ONE - 300, 1700, -700]), 1234 << 10);
    }

    #[test]
    fn part_is_exact_at_both_ends() {
        for log2 in 2..=5 {
            assert_eq!(part(-7, 1_000_003, 0, log2), -7);
            assert_eq!(part(-7, 1_000_003, 1 << log2, log2), 1_000_003);
        }
    }

    #[test]
    fn key_coordinates_saturate() {
        let uv = KeyUv::new(-5, 70_000);
        assert_eq!((uv.u(), uv.v()), (0, 65_535));
    }
}
