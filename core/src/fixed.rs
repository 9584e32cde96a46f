//! Fixed-point numbers: how coordinates are stored in keys, how they are interpolated.
//! `key`, `timeline`, `row` and what draws share them.
//!
//! A number's unit goes with its place: stored positions count 1/32 to 1/128 texel, as the bundle says, playback's are Q15.16 texels; time weights are Q14;
//! a field is a code from -37 to 37 where it is stored, Q8 pixels in a key, Q16 pixels during playback.

/// Fraction bits that a stored coordinate can have: 5 reach from 512 texels outside the picture to 1536, each more halves that.
pub const KEY_BITS: core::ops::RangeInclusive<u8> = 5..=7;
/// The least stored coordinate: outside the picture, because ghosts are extrapolated.
pub const KEY_MIN: i32 = -16_384;
/// The largest stored coordinate.
pub const KEY_MAX: i32 = KEY_MIN + 0xffff;
/// Fraction bits of a time weight.
pub const WEIGHT_BITS: u32 = 14;
/// A time weight of one.
pub const ONE: i32 = 1 << WEIGHT_BITS;
/// Fraction bits of a coordinate during playback.
pub const PLAY_BITS: u32 = 16;

/// The middle of stored coordinates.
pub const KEY_MIDDLE: i32 = KEY_MIN + 0x8000;

/// A stored position in the source image: u and v in stored units from [`KEY_MIDDLE`] on, signed, 16 bits each, v in the upper half.
// Halves of a word with a sign are what processors multiply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct KeyUv(pub u32);

impl KeyUv {
    /// From u and v in stored units, clamped to the range there is.
    #[must_use]
    pub fn new(u: i32, v: i32) -> Self {
        let stored = |x: i32| x.clamp(KEY_MIN, KEY_MAX).wrapping_sub(KEY_MIDDLE) as u16;
        Self(u32::from(stored(v)) << 16 | u32::from(stored(u)))
    }

    /// u in stored units, [`KEY_MIN`]..=[`KEY_MAX`].
    #[must_use]
    pub const fn u(self) -> i32 {
        (self.0 as i16 as i32).wrapping_add(KEY_MIDDLE)
    }

    /// v in stored units, [`KEY_MIN`]..=[`KEY_MAX`].
    #[must_use]
    pub const fn v(self) -> i32 {
        (self.0 as i32 >> 16).wrapping_add(KEY_MIDDLE)
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

impl PlayUv {
    /// The position `step` further.
    #[must_use]
    #[inline(always)]
    pub const fn plus(self, step: Self) -> Self {
        Self { u: self.u.wrapping_add(step.u), v: self.v.wrapping_add(step.v) }
    }

    /// How far it is from `other` on.
    #[must_use]
    #[inline(always)]
    pub const fn less(self, other: Self) -> Self {
        Self { u: self.u.wrapping_sub(other.u), v: self.v.wrapping_sub(other.v) }
    }
}

/// The largest size of a field code, which stands for 128 pixels.
pub const MAX_FIELD: i32 = 37;

/// What the field codes from -[`MAX_FIELD`] to [`MAX_FIELD`] stand for.
static DISTANCES: [i32; 2 * MAX_FIELD as usize + 1] = {
    let mut distances = [0; _];
    let mut rest = distances.as_mut_slice();
    let mut code = -MAX_FIELD;
    while let Some((slot, more)) = rest.split_first_mut() {
        *slot = distance(code);
        (code, rest) = (code.wrapping_add(1), more);
    }
    distances
};

/// 64 * 2^(i / 4) of code i + 1, negative of negative ones.
const fn distance(code: i32) -> i32 {
    let Some(index) = code.unsigned_abs().checked_sub(1) else { return 0 };
    let step: i32 = match index & 3 {
        0 => 64,
        1 => 76,
        2 => 91,
        _ => 108,
    };
    let distance = step.wrapping_shl(index >> 2);
    if code < 0 { distance.wrapping_neg() } else { distance }
}

/// The distance that field code `code` stands for, Q8 pixels: four steps an octave from 1/4 pixel, with a sign; 0 is 0, and so is what is no code.
#[must_use]
#[inline(always)]
pub fn field_distance(code: i8) -> i32 {
    let place = i32::from(code).wrapping_add(MAX_FIELD) as usize;
    DISTANCES.get(place).copied().unwrap_or(0)
}

/// The field code closest to `distance`, Q8 pixels.
#[must_use]
pub fn field_code(distance: i32) -> i8 {
    let size = distance.unsigned_abs().min(1 << 20);
    // An octave has four codes: those below the distance's own are too small.
    let mut code = size.checked_ilog2().map_or(0, |log2| log2.saturating_sub(6).wrapping_mul(4)).min(MAX_FIELD as u32) as i8;
    // The codes' distances grow: stop at the first whose midpoint to the next is not passed.
    while i32::from(code) < MAX_FIELD {
        let (low, high) = (field_distance(code), field_distance(code.wrapping_add(1)));
        if (size as i32).wrapping_mul(2) < low.wrapping_add(high) {
            break;
        }
        code = code.wrapping_add(1);
    }
    if distance < 0 { code.wrapping_neg() } else { code }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_codes_come_back() {
        for code in -37..=37i8 {
            assert_eq!(field_code(field_distance(code)), code);
        }
        assert_eq!(field_distance(37), 128 << 8);
        assert_eq!((field_code(1 << 30), field_code(-(1 << 30)), field_code(20)), (37, -37, 0));
        assert_eq!((field_distance(38), field_distance(-128)), (0, 0));
        for distance in 0..40_000 {
            let closest = (0..37).find(|&code| 2 * distance < field_distance(code) + field_distance(code + 1)).unwrap_or(37);
            assert_eq!((field_code(distance), field_code(-distance)), (closest, -closest), "{distance}");
        }
    }

    #[test]
    fn key_coordinates_saturate() {
        let uv = KeyUv::new(-70_000, 70_000);
        assert_eq!((uv.u(), uv.v()), (KEY_MIN, KEY_MAX));
        let uv = KeyUv::new(-5, 32_000);
        assert_eq!((uv.u(), uv.v()), (-5, 32_000));
    }
}
