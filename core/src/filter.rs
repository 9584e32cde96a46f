//! How the texels around a position become a pixel: the nearest, one of the nearest by turns, or a mean of four.
//! Positions come from `span`, colours of texels from `texels`, which says what a player calls these.

use crate::atlas::Texture;
use crate::fixed::{PLAY_BITS, PlayUv};
use crate::span::{self, Packed};
use crate::window::{self, Line, fraction};
use core::marker::PhantomData;

/// A way of looking texels up. `colour` gives that of a texel, by its index: in the window, or in the whole picture.
pub trait Filter: Copy {
    /// What it mixes.
    type Colour: Copy;

    /// How far it reaches beyond a position, Q16 texels.
    const REACH: i32;
    /// Its code is so short that loops over a few pixels are written out.
    const SHORT: bool;

    /// What is added to positions packed into windows 2^`width_log2` texels wide before [`Filter::packed`] gets them, at even and at odd pixels of a
    /// row.
    fn offsets(self, width_log2: u32) -> [u32; 2];

    /// Paints `pixels` along a line of a window; `make` turns a position, which has its offset, into one.
    fn along<T, const WIDTH: u32, const ROWS: u32>(self, pixels: &mut [T], line: Line<'_>, make: impl Fn(Packed<WIDTH, ROWS>) -> T);

    /// The pixel at `at`, which has its offset, in a window of 2^ROWS rows of 2^WIDTH texels.
    fn packed<const WIDTH: u32, const ROWS: u32>(self, at: Packed<WIDTH, ROWS>, colour: impl Fn(usize) -> Self::Colour) -> u16;

    /// The pixel at `uv`, which is inside the picture.
    fn at(self, uv: PlayUv, x: usize, texture: &Texture<'_>, colour: impl Fn(usize) -> Self::Colour) -> u16;
}

/// The texel that a position is in.
#[derive(Clone, Copy, Debug)]
pub struct Nearest;

impl Filter for Nearest {
    type Colour = u16;
    const REACH: i32 = 0;
    const SHORT: bool = true;

    #[inline(always)]
    fn offsets(self, _: u32) -> [u32; 2] {
        [0; 2]
    }

    #[inline(always)]
    fn along<T, const WIDTH: u32, const ROWS: u32>(self, pixels: &mut [T], line: Line<'_>, make: impl Fn(Packed<WIDTH, ROWS>) -> T) {
        span::along(pixels, line, make);
    }

    #[inline(always)]
    fn packed<const WIDTH: u32, const ROWS: u32>(self, at: Packed<WIDTH, ROWS>, colour: impl Fn(usize) -> u16) -> u16 {
        colour(at.texel())
    }

    #[inline(always)]
    fn at(self, uv: PlayUv, _: usize, texture: &Texture<'_>, colour: impl Fn(usize) -> u16) -> u16 {
        colour(texture.index(uv))
    }
}

/// The texel that a position is in once it is moved by up to 3/8 of a texel, in a pattern of two by two pixels: from some way off the mean of
/// four, for the price of one.
#[derive(Clone, Copy, Debug)]
pub struct Dither {
    /// Eighths of a texel across and down, for even pixels of a row: odd ones move as far the other way.
    eighths: [i32; 2],
}

impl Dither {
    /// That of row `y`.
    pub const fn new(y: u32) -> Self {
        // Along either axis the four are -3, -1, 1, 3: a threshold in each quarter.
        Self { eighths: if y & 1 == 0 { [-1, -3] } else { [3, 1] } }
    }

    #[inline(always)]
    const fn of(self, x: usize) -> [i32; 2] {
        let [across, down] = self.eighths;
        if x & 1 == 0 { [across, down] } else { [across.wrapping_neg(), down.wrapping_neg()] }
    }
}

impl Filter for Dither {
    type Colour = u16;
    const REACH: i32 = 3 << (PLAY_BITS - 3);
    const SHORT: bool = true;

    #[inline(always)]
    fn offsets(self, width_log2: u32) -> [u32; 2] {
        let [u, v] = self.eighths;
        let (across, down) = (u.wrapping_shl(29u32.wrapping_sub(width_log2)), v.wrapping_shl(fraction(width_log2).wrapping_sub(3)));
        let even = across.wrapping_add(down) as u32;
        [even, even.wrapping_neg()]
    }

    #[inline(always)]
    fn along<T, const WIDTH: u32, const ROWS: u32>(self, pixels: &mut [T], line: Line<'_>, make: impl Fn(Packed<WIDTH, ROWS>) -> T) {
        span::by_turns(pixels, line, self.offsets(WIDTH), make);
    }

    #[inline(always)]
    fn packed<const WIDTH: u32, const ROWS: u32>(self, at: Packed<WIDTH, ROWS>, colour: impl Fn(usize) -> u16) -> u16 {
        colour(at.texel())
    }

    #[inline(always)]
    fn at(self, uv: PlayUv, x: usize, texture: &Texture<'_>, colour: impl Fn(usize) -> u16) -> u16 {
        let [u, v] = self.of(x).map(|eighths| eighths.wrapping_shl(PLAY_BITS - 3));
        colour(texture.index(texture.clamp(PlayUv { u: uv.u.wrapping_add(u), v: uv.v.wrapping_add(v) })))
    }
}

/// A colour as means are made of it.
pub trait Mixed: Copy {
    /// It, as [`spread`] has it; SWAPPED: where it has two bytes, they are in the other order than the machine's.
    fn spread<const SWAPPED: bool>(self) -> u32;
}

impl Mixed for u16 {
    #[inline(always)]
    fn spread<const SWAPPED: bool>(self) -> u32 {
        spread(native::<SWAPPED>(self))
    }
}

/// That is done already.
impl Mixed for u32 {
    #[inline(always)]
    fn spread<const SWAPPED: bool>(self) -> u32 {
        self
    }
}

/// A colour in the machine's byte order, or back in the other.
#[inline(always)]
const fn native<const SWAPPED: bool>(colour: u16) -> u16 {
    if SWAPPED { colour.swap_bytes() } else { colour }
}

/// The mean of the four texels around a position, weighted by how close their centres are, in steps of 1/32. SWAPPED: pixels, and colours of two bytes,
/// are in the other byte order than the machine's.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bilinear<C, const SWAPPED: bool>(PhantomData<C>);

/// Fraction bits of a weight.
const SHARE_BITS: u32 = 5;

impl<C: Mixed, const SWAPPED: bool> Bilinear<C, SWAPPED> {
    /// The mean of `four` colours, above and below from left to right, `across` and `down` 32nds of the way between them.
    #[inline(always)]
    fn mean(four: [C; 4], across: u32, down: u32) -> u16 {
        // Weights are of whole 32nds, and sum to 32.
        let last = across.wrapping_mul(down) >> SHARE_BITS;
        let (right, below) = (across.wrapping_sub(last), down.wrapping_sub(last));
        let first = (1u32 << SHARE_BITS).wrapping_sub(across).wrapping_sub(below);
        let [a, b, c, d] = four.map(C::spread::<SWAPPED>);
        let sum = a
            .wrapping_mul(first)
            .wrapping_add(b.wrapping_mul(right))
            .wrapping_add(c.wrapping_mul(below))
            .wrapping_add(d.wrapping_mul(last));
        native::<SWAPPED>(gather(sum, SHARE_BITS))
    }
}

impl<C: Mixed, const SWAPPED: bool> Filter for Bilinear<C, SWAPPED> {
    type Colour = C;
    const REACH: i32 = window::BESIDE;
    const SHORT: bool = false;

    #[inline(always)]
    fn offsets(self, width_log2: u32) -> [u32; 2] {
        // From centre to centre; the window has room for half a texel all around.
        let half = 1u32.wrapping_shl(31u32.wrapping_sub(width_log2)).wrapping_add(1u32.wrapping_shl(fraction(width_log2).wrapping_sub(1)));
        [half.wrapping_neg(); 2]
    }

    #[inline(always)]
    fn along<T, const WIDTH: u32, const ROWS: u32>(self, pixels: &mut [T], line: Line<'_>, make: impl Fn(Packed<WIDTH, ROWS>) -> T) {
        let [offset, _] = self.offsets(WIDTH);
        span::along(pixels, Line { at: line.at.wrapping_add(offset), ..line }, make);
    }

    #[inline(always)]
    fn packed<const WIDTH: u32, const ROWS: u32>(self, at: Packed<WIDTH, ROWS>, colour: impl Fn(usize) -> C) -> u16 {
        let share = |shift: u32| at.0.wrapping_shr(shift.wrapping_sub(SHARE_BITS)) & ((1 << SHARE_BITS) - 1);
        let (across, down) = (share(32u32.wrapping_sub(WIDTH)), share(fraction(WIDTH)));
        let first = at.texel();
        let below = first.wrapping_add(1 << WIDTH);
        Self::mean([colour(first), colour(first.wrapping_add(1)), colour(below), colour(below.wrapping_add(1))], across, down)
    }

    #[inline(always)]
    fn at(self, uv: PlayUv, _: usize, texture: &Texture<'_>, colour: impl Fn(usize) -> C) -> u16 {
        let beside = |u: i32, v: i32| texture.clamp(PlayUv { u: uv.u.wrapping_add(u), v: uv.v.wrapping_add(v) });
        const HALF: i32 = 1 << (PLAY_BITS - 1);
        let (first, last) = (beside(-HALF, -HALF), beside(HALF, HALF));
        let share = |x: i32| (x.wrapping_sub(HALF) as u32).wrapping_shr(PLAY_BITS - SHARE_BITS) & ((1 << SHARE_BITS) - 1);
        let four = [(first.u, first.v), (last.u, first.v), (first.u, last.v), (last.u, last.v)];
        Self::mean(four.map(|(u, v)| colour(texture.index(PlayUv { u, v }))), share(uv.u), share(uv.v))
    }
}

/// An RGB565 colour with red and blue apart from green, so that sums have room: bits 0..5, 11..16, and 21..27.
pub const fn spread(colour: u16) -> u32 {
    let colour = colour as u32;
    (colour | colour << 16) & 0x07e0_f81f
}

/// The RGB565 colour that a sum of 2^`log2` spread colours is the mean of, at most 2^5, rounded to nearest, halves up.
const fn gather(sum: u32, log2: u32) -> u16 {
    let half = 1u32.wrapping_shl(log2) >> 1;
    let mean = sum.wrapping_add(half | half << 11 | half << 21).wrapping_shr(log2) & 0x07e0_f81f;
    (mean | mean >> 16) as u16
}

/// The mean of four RGB565 colours, rounded to nearest, halves up.
#[must_use]
pub const fn mean([a, b, c, d]: [u16; 4]) -> u16 {
    gather(spread(a).wrapping_add(spread(b)).wrapping_add(spread(c)).wrapping_add(spread(d)), 2)
}

#[cfg(test)]
mod tests {
    use super::{Bilinear, Dither, Filter, Nearest, mean};
    use crate::atlas::Texture;
    use crate::fixed::PlayUv;
    use crate::span::Packed;
    use crate::window::fraction;

    fn colour([r, g, b]: [u16; 3]) -> u16 {
        r << 11 | g << 5 | b
    }

    /// Colours that differ in all of their parts.
    fn colours() -> impl FnMut() -> [u16; 3] {
        let mut seed = 7u32;
        let mut next = move |below: u16| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((seed >> 16) as u16).checked_rem(below).unwrap_or(0)
        };
        move || [next(32), next(64), next(32)]
    }

    #[test]
    fn means_are_those_of_each_component() {
        let mut next = colours();
        for _ in 0..2000 {
            let parts: [[u16; 3]; 4] = core::array::from_fn(|_| next());
            let part = |get: fn([u16; 3]) -> u16| (parts.map(get).iter().sum::<u16>() + 2) >> 2;
            let [r, g, b] = [part(|[r, _, _]| r), part(|[_, g, _]| g), part(|[_, _, b]| b)];
            assert_eq!(mean(parts.map(colour)), colour([r, g, b]));
        }
        assert_eq!(mean([u16::MAX; 4]), u16::MAX);
    }

    #[test]
    fn bilinear_means_are_within_a_step_of_the_exact_ones_and_keep_constants() {
        let mut next = colours();
        for round in 0..4096u32 {
            let (across, down) = (round & 31, round >> 5 & 31);
            let parts: [[u16; 3]; 4] = core::array::from_fn(|_| next());
            let played = Bilinear::<u16, false>::mean(parts.map(colour), across, down);
            let weights = [(32 - across) * (32 - down), across * (32 - down), (32 - across) * down, across * down];
            let parted = [0, 1, 2].map(|part: usize| parts.map(|colour| colour.get(part).copied().unwrap_or(0)));
            for (parts, (shift, mask)) in parted.into_iter().zip([(11, 31u16), (5, 63), (0, 31)]) {
                let exact: u32 = parts.iter().zip(weights).map(|(part, weight)| u32::from(*part) * weight).sum();
                let off = f64::from(played >> shift & mask) - f64::from(exact) / 1024.0;
                // Half a step from rounding, and weights that are off by up to a 32nd: as much more of two as less of the others.
                assert!(off.abs() <= 0.5 + f64::from(mask) * 2.0 / 32.0, "{parts:?} {across} {down}: {off}");
            }
            let same = colour(next());
            assert_eq!(Bilinear::<u16, false>::mean([same; 4], across, down), same);
            assert_eq!(Bilinear::<u16, true>::mean(parts.map(|part| colour(part).swap_bytes()), across, down), played.swap_bytes());
        }
    }

    /// Holds the pixel at u and v, 512ths of a texel, in a window against that at the same position in a picture of the window's size.
    fn same<F: Filter<Colour = u16>, const WIDTH: u32, const ROWS: u32>(filter: F, [u, v]: [u32; 2], x: usize) {
        let texture = Texture { width_log2: WIDTH, height: 1 << ROWS, ..Texture::default() };
        let colour = |index: usize| (index as u16).wrapping_mul(40_503);
        let [even, odd] = filter.offsets(WIDTH);
        let at = u << fraction(WIDTH).wrapping_add(ROWS) | v;
        let moved = Packed::<WIDTH, ROWS>(at.wrapping_add(if x == 0 { even } else { odd }));
        let uv = PlayUv { u: (u << 7) as i32, v: (v << 7) as i32 };
        assert_eq!(filter.packed(moved, colour), filter.at(uv, x, &texture, colour), "{uv:?}");
    }

    fn same_by_all<const WIDTH: u32, const ROWS: u32>(position: [u32; 2]) {
        for x in 0..2 {
            for y in 0..2 {
                same::<_, WIDTH, ROWS>(Dither::new(y), position, x);
            }
            same::<_, WIDTH, ROWS>(Bilinear::<u16, false>::default(), position, x);
            same::<_, WIDTH, ROWS>(Nearest, position, x);
        }
    }

    #[test]
    fn a_position_gives_the_same_pixel_in_a_window_and_in_the_picture() {
        let mut next = colours();
        for _ in 0..2000 {
            let [a, b, c] = next().map(u32::from);
            // On whole 512ths of a texel, as packed positions of these windows are.
            same_by_all::<9, 5>([(a * 8 + 1) * 512 + b * 8, (c.min(29) + 1) * 512 + b * 8 + a / 4]);
            same_by_all::<7, 7>([(a + 1) * 512 + b * 8, (c * 3 + 1) * 512 + b * 8 + a / 4]);
        }
    }
}
