//! Forms: how a number, a coordinate or a field, goes from pixel to pixel of a cell. Its numbers come from `patch` and `site`; `coverage` and `span` tell
//! by them what shows.

/// How a number goes from pixel to pixel of a patch: x pixels to the right and y down it is
/// `at + y down + y (y - 1) / 2 fall + x (step + y turn) + x (x - 1) / 2 bend`, modulo 2^32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// At the first pixel.
    pub at: i32,
    /// From the first row to the second, in the first column;
    pub down: i32,
    /// how that changes from row to row.
    pub fall: i32,
    /// From the first column to the second, in the first row;
    pub step: i32,
    /// how that changes from row to row,
    pub turn: i32,
    /// and from column to column.
    pub bend: i32,
}

/// y (y - 1) / 2.
#[inline(always)]
const fn triangle(y: u32) -> i32 {
    (y.wrapping_mul(y.wrapping_sub(1)) as i32) >> 1
}

/// What is added so many `quarters` of a pixel on, by a first step and by what changes from step to step: q (q - 4) / 32 of that.
const fn moved(step: i32, change: i32, quarters: i32) -> i32 {
    (step.wrapping_mul(quarters) >> 2).wrapping_add(change.wrapping_mul(quarters.wrapping_mul(quarters.wrapping_sub(4))) >> 5)
}

/// `x` / 2^`log2`, to the nearest, ties up.
#[inline(always)]
pub const fn rounded(x: i32, log2: u32) -> i32 {
    x.wrapping_add(1i32.wrapping_shl(log2) >> 1).wrapping_shr(log2)
}

impl Form {
    /// In a patch of 2^`log2` pixels, given the number at its corners and the sums of its second differences there, across and down.
    #[must_use]
    #[inline(always)]
    pub const fn new([a, b, c, d]: [i32; 4], [across, down]: [i32; 2], log2: u32) -> Self {
        // Mean second differences from pixel to pixel; the first step of a curve is half of them, times its other steps, from the mean one.
        let (bend, fall) = (rounded(across, log2.wrapping_mul(2).wrapping_add(2)), rounded(down, log2.wrapping_mul(2).wrapping_add(2)));
        let others = 1i32.wrapping_shl(log2).wrapping_sub(1);
        let (left, right, above) = (rounded(c.wrapping_sub(a), log2), rounded(d.wrapping_sub(b), log2), rounded(b.wrapping_sub(a), log2));
        Self {
            at: a,
            down: left.wrapping_sub(fall.wrapping_mul(others) >> 1),
            fall,
            step: above.wrapping_sub(bend.wrapping_mul(others) >> 1),
            turn: rounded(right.wrapping_sub(left), log2),
            bend,
        }
    }

    /// The number `x` pixels to the right and `y` down.
    #[must_use]
    #[inline(always)]
    pub const fn at(&self, [x, y]: [u32; 2]) -> i32 {
        self.from([x, y]).at
    }

    /// The same numbers, counted from the pixel `x` to the right and `y` down.
    #[must_use]
    #[inline(always)]
    pub const fn from(&self, [x, y]: [u32; 2]) -> Self {
        let Self { at, down, fall, step, turn, bend } = *self;
        let (right, low) = (x as i32, y as i32);
        let step = step.wrapping_add(turn.wrapping_mul(low));
        let at = at.wrapping_add(down.wrapping_mul(low)).wrapping_add(fall.wrapping_mul(triangle(y)));
        Self {
            at: at.wrapping_add(step.wrapping_mul(right)).wrapping_add(bend.wrapping_mul(triangle(x))),
            down: down.wrapping_add(fall.wrapping_mul(low)).wrapping_add(turn.wrapping_mul(right)),
            step: step.wrapping_add(bend.wrapping_mul(right)),
            ..*self
        }
    }

    /// The same where rows and columns of a patch of 2^`log2` pixels go straight to its middle, and straight on from there, about as far on one side of
    /// the curve as on the other: the numbers along its row `row`, this form's first, by steps of the left half, which change by `bend` for the right one.
    #[must_use]
    pub const fn straightened(&self, row: u32, log2: u32) -> Self {
        let half = 1u32.wrapping_shl(log2) >> 1;
        let into = row & half.wrapping_sub(1);
        // A parabola that is nothing at both ends of a half, r (h - r) / 2 times what changes from step to step.
        let down = self.fall.wrapping_mul(into.wrapping_mul(half.wrapping_sub(into)) as i32) >> 1;
        let more = self.bend.wrapping_mul(half.wrapping_sub(1) as i32) >> 1;
        let aside = self.bend.wrapping_add(self.fall).wrapping_mul(half.wrapping_mul(half) as i32) >> 4;
        Self {
            at: self.at.wrapping_add(down).wrapping_sub(aside),
            step: self.step.wrapping_add(more),
            bend: self.bend.wrapping_mul(half as i32),
            ..*self
        }
    }

    /// The numbers with the other sign.
    #[must_use]
    #[inline(always)]
    pub const fn negated(&self) -> Self {
        let Self { at, down, fall, step, turn, bend } = *self;
        Self {
            at: at.wrapping_neg(),
            down: down.wrapping_neg(),
            fall: fall.wrapping_neg(),
            step: step.wrapping_neg(),
            turn: turn.wrapping_neg(),
            bend: bend.wrapping_neg(),
        }
    }

    /// Moved by parts of a pixel: `across` and `down` quarters of one.
    #[must_use]
    pub const fn beside(&self, [across, down]: [i32; 2]) -> Self {
        let Self { at, down: below, fall, step, turn, bend } = *self;
        let step = step.wrapping_add(turn.wrapping_mul(down) >> 2);
        Self {
            at: at.wrapping_add(moved(below, fall, down)).wrapping_add(moved(step, bend, across)),
            down: below.wrapping_add(fall.wrapping_mul(down) >> 2).wrapping_add(turn.wrapping_mul(across) >> 2),
            step: step.wrapping_add(bend.wrapping_mul(across) >> 2),
            ..*self
        }
    }

    /// One row further down.
    #[inline(always)]
    pub const fn next_row(&mut self) {
        self.at = self.at.wrapping_add(self.down);
        self.down = self.down.wrapping_add(self.fall);
        self.step = self.step.wrapping_add(self.turn);
    }

    /// The numbers of the first eight columns in less room, if none of them is further from zero than `reach`: rounded to one in 2^14 of that or less.
    #[must_use]
    #[inline(always)]
    pub const fn pairs(&self, reach: u32) -> Pairs {
        let shift = 18u32.saturating_sub(reach.leading_zeros());
        let Self { at, down, fall, step, turn, bend } = *self;
        let less = Self {
            at: 0,
            down: rounded(down, shift),
            fall: rounded(fall, shift),
            step: rounded(step, shift),
            turn: rounded(turn, shift),
            bend: rounded(bend, shift),
        };
        // As it is in the middle, so that what is rounded adds up to least.
        let at = Self { at, ..*self }.middle().wrapping_shr(shift).wrapping_sub(less.middle());
        let Self { down, fall, step, turn, bend, .. } = less;
        // A number in both halves, and one in the upper half only.
        const fn both(x: i32) -> u32 {
            (x as u32).wrapping_add((x as u32).wrapping_shl(16))
        }
        const fn upper(x: i32) -> u32 {
            (x as u32).wrapping_shl(16)
        }
        Pairs {
            at: both(at).wrapping_add(upper(step.wrapping_mul(4).wrapping_add(bend.wrapping_mul(6)))),
            down: both(down).wrapping_add(upper(turn.wrapping_mul(4))),
            fall: both(fall),
            step: both(step).wrapping_add(upper(bend.wrapping_mul(4))),
            turn: both(turn),
            bend: both(bend),
        }
    }

    /// The number at the middle of eight rows of eight pixels, half a pixel off.
    #[inline(always)]
    const fn middle(&self) -> i32 {
        let straight = self.step.wrapping_add(self.down).wrapping_add(self.turn.wrapping_mul(4));
        self.at.wrapping_add(straight.wrapping_mul(4)).wrapping_add(self.bend.wrapping_add(self.fall).wrapping_mul(6))
    }

    /// Which of the next `pixels` pixels of the first row have a number below zero: a bit each.
    #[must_use]
    #[inline(always)]
    pub fn negative(&self, pixels: u32) -> u32 {
        let Self { at: mut value, mut step, bend, .. } = *self;
        // Most often all of a row are on one side: where its ends are, and farther from zero than it bulges in between.
        let last = pixels.wrapping_sub(1);
        let end = value.wrapping_add(step.wrapping_mul(last as i32)).wrapping_add(bend.wrapping_mul(triangle(last)));
        let bulge = bend.unsigned_abs().wrapping_mul(last.wrapping_mul(last)) >> 3;
        // Of four pixels, telling takes as long as they do.
        if pixels > 4 && value ^ end >= 0 && value.unsigned_abs() >= bulge && end.unsigned_abs() >= bulge {
            return if value < 0 { u32::MAX.wrapping_shr(32u32.wrapping_sub(pixels)) } else { 0 };
        }
        // From the last one back: the first one's bit is the lowest.
        (value, step) = (end, step.wrapping_add(bend.wrapping_mul(last.wrapping_sub(1) as i32)));
        let mut below = 0u32;
        let mut back = |below: &mut u32| {
            *below = *below << 1 | value as u32 >> 31;
            (value, step) = (value.wrapping_sub(step), step.wrapping_sub(bend));
        };
        if pixels == 8 {
            (0..8).for_each(|_| back(&mut below));
        } else {
            (0..pixels).for_each(|_| back(&mut below));
        }
        below
    }
}

/// How two numbers go from pixel to pixel, one in each half of a word: as a [`Form`]'s, the upper one's pixels four to the right of the lower one's.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    at: u32,
    down: u32,
    fall: u32,
    step: u32,
    turn: u32,
    bend: u32,
}

impl Pairs {
    /// Which of the first row's eight pixels have a number below zero, a bit each in the uppermost byte, the leftmost lowest. One row further down.
    #[inline(always)]
    pub const fn next_negative(&mut self) -> u32 {
        const SIGNS: u32 = 0x8000_8000;
        let Self { at: first, down, fall, step, turn, bend } = *self;
        let second = first.wrapping_add(step);
        let step_on = step.wrapping_add(bend);
        let third = second.wrapping_add(step_on);
        let fourth = third.wrapping_add(step_on).wrapping_add(bend);
        // Nibbles of both halves' signs, the last pixel's uppermost.
        let mut signs = first & SIGNS;
        signs = second & SIGNS | signs >> 1;
        signs = third & SIGNS | signs >> 1;
        signs = fourth & SIGNS | signs >> 1;
        *self = Self { at: first.wrapping_add(down), down: down.wrapping_add(fall), step: step.wrapping_add(turn), ..*self };
        (signs | signs << 12) & 0xff00_0000
    }
}

#[cfg(test)]
mod tests {
    use super::Form;

    /// Numbers around zero, below half of what is asked for either way.
    fn random(mut seed: u32) -> impl FnMut(u32) -> i32 {
        move |below| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(seed).wrapping_mul(below.into()) >> 32) as i32).wrapping_sub((below / 2) as i32)
        }
    }

    #[test]
    fn forms_go_through_their_corners_and_are_what_their_formula_says() {
        let mut next = random(5);
        for log2 in 2..=5 {
            let n = 1u32 << log2;
            for _ in 0..500 {
                let corners = [(); 4].map(|()| next(1 << 24));
                let (across, down) = (next(1 << 20), next(1 << 20));
                let form = Form::new(corners, [across, down], log2);
                // Rounded are a step for each pixel on either way, and how steps change, for each pixel.
                let off = i64::from(n * n / 2 + n * n / 4 + n);
                for (corner, at) in corners.into_iter().zip([[0, 0], [n, 0], [0, n], [n, n]]) {
                    assert!(i64::from(form.at(at)).abs_diff(corner.into()) as i64 <= off, "{form:?} {at:?} {corner}");
                }
                let exact = |x: f64, y: f64| {
                    let [a, b, c, d] = corners.map(f64::from);
                    let bilinear = (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y;
                    bilinear - f64::from(across) / 8.0 * x * (1.0 - x) - f64::from(down) / 8.0 * y * (1.0 - y)
                };
                let mut row = form;
                for y in 0..n {
                    for x in 0..n {
                        let value = exact(f64::from(x) / f64::from(n), f64::from(y) / f64::from(n));
                        assert!((f64::from(form.at([x, y])) - value).abs() <= off as f64);
                        assert_eq!(row.at([x, 0]), form.at([x, y]));
                        let from = form.from([x, y]);
                        assert_eq!((from.at([3, 2]), from.at([0, 1])), (form.at([x + 3, y + 2]), form.at([x, y + 1])));
                    }
                    let bits = (0..n).fold(0, |bits, x| bits | u32::from(form.at([x, y]) < 0) << x);
                    assert_eq!(row.negative(n), bits, "{form:?} {y}");
                    row.next_row();
                }
            }
        }
    }

    #[test]
    fn pairs_tell_signs_but_where_a_number_is_next_to_nothing() {
        let mut next = random(7);
        let (mut wrong, mut below, mut all) = (0, 0, 0);
        for round in 0..4000u32 {
            let (size, bent) = (1 << (10 + round % 16), if round % 3 == 0 { 0 } else { 1 << (8 + round % 14) });
            let corners = [(); 4].map(|()| next(size));
            let form = Form::new(corners, [next(bent + 1), next(bent + 1)], 3);
            let places = || (0..8).flat_map(|y| (0..8).map(move |x| [x, y]));
            let reach = places().fold(0, |reach, at| form.at(at).unsigned_abs().max(reach));
            let mut pairs = form.pairs(reach);
            let mut row = 0;
            for [x, y] in places() {
                row = if x == 0 { pairs.next_negative() } else { row };
                let (number, told) = (form.at([x, y]), row >> (24 + x) & 1 == 1);
                // Half a unit for each number rounded, times how often it counts, and a unit for the other half of the word.
                assert!(told == (number < 0) || number.unsigned_abs() <= 40 * (reach >> 13) + 40, "{form:?} {reach} {x} {y} {number}");
                (wrong, below, all) = (wrong + u32::from(told != (number < 0)), below + u32::from(told), all + 1);
            }
        }
        assert!(wrong < all / 1000 && below > all / 4 && below < all * 3 / 4, "{wrong} and {below} of {all}");
    }
}
