//! Planes: where a flat surface's chart lies in space, and from where a key looks at it. Both together tell a layer's position, but for what
//! the fit has moved: a plane's picture on the screen is a homography.
//! Both come from the bundle; `predict` tells chains from them that say so.
//!
//! A point of the plane is O + u A + v B; the ray from the eye E through a node goes along D. With C = E - O they meet at
//! u = D (C x B) / D (A x B), v = D (A x C) / D (A x B): for a key that is a linear function of the node's place over another.

/// Bytes of a [`Plane`].
pub const PLANE_BYTES: usize = 38;
/// Bytes of a [`Camera`].
pub const CAMERA_BYTES: usize = 48;

/// A vector in space, in the bundle's own units.
pub type Vector = [i32; 3];

/// Components below 2^24 in size, so that cross products fit 2^52.
const AXIS_BITS: u32 = 24;

/// A flat label: [`PLANE_BYTES`] little-endian bytes in the order of the fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Plane {
    /// The label.
    pub label: u8,
    /// The axes are 2^this times as long as a texel.
    pub shift: u8,
    /// The point of position (0, 0).
    pub origin: Vector,
    /// A texel along u, times 2^shift.
    pub along_u: Vector,
    /// A texel along v, times 2^shift.
    pub along_v: Vector,
}

/// From where a key looks, and through where its nodes: [`CAMERA_BYTES`] little-endian bytes in the order of the fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Camera {
    /// The eye.
    pub eye: Vector,
    /// The direction through the first node; the length of directions does not matter, but below 2^28.
    pub first: Vector,
    /// What a column of nodes further adds.
    pub column: Vector,
    /// What a row of nodes further adds.
    pub row: Vector,
}

/// The next vector of `bytes`.
fn take(bytes: &mut &[u8]) -> Vector {
    core::array::from_fn(|_| {
        let Some((word, rest)) = bytes.split_first_chunk::<4>() else { return 0 };
        *bytes = rest;
        i32::from_le_bytes(*word)
    })
}

fn put(bytes: &mut [u8], words: &[i32]) {
    for (slot, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
        *slot = word.to_le_bytes();
    }
}

impl Plane {
    /// The plane in `bytes`.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; PLANE_BYTES]) -> Self {
        let [label, shift, rest @ ..] = bytes;
        let rest = &mut &rest[..];
        Self { label: *label, shift: *shift, origin: take(rest), along_u: take(rest), along_v: take(rest) }
    }

    /// The plane's bytes.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; PLANE_BYTES] {
        let mut bytes = [0; PLANE_BYTES];
        let [label, shift, rest @ ..] = &mut bytes;
        (*label, *shift) = (self.label, self.shift);
        put(rest, [self.origin, self.along_u, self.along_v].as_flattened());
        bytes
    }
}

impl Camera {
    /// The camera in `bytes`.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; CAMERA_BYTES]) -> Self {
        let rest = &mut &bytes[..];
        Self { eye: take(rest), first: take(rest), column: take(rest), row: take(rest) }
    }

    /// The camera's bytes.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; CAMERA_BYTES] {
        let mut bytes = [0; CAMERA_BYTES];
        put(&mut bytes, [self.eye, self.first, self.column, self.row].as_flattened());
        bytes
    }
}

/// A plane as a key sees it: positions as a homography of columns and rows of nodes, in caller's memory.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct View {
    /// For u, v and what both are divided by: at the first node, a column further, a row further.
    terms: [[i32; 3]; 3],
    /// Stored units are quotients times 2^this.
    scale: i32,
}

fn cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    let ([a, b, c], [d, e, f]) = (a, b);
    let minor = |p: i64, q: i64, r: i64, s: i64| p.wrapping_mul(q).wrapping_sub(r.wrapping_mul(s));
    [minor(b, f, c, e), minor(c, d, a, f), minor(a, e, b, d)]
}

fn dot(a: [i64; 3], b: [i64; 3]) -> i64 {
    a.iter().zip(b).fold(0, |sum, (a, b)| sum.wrapping_add(a.wrapping_mul(b)))
}

/// How far numbers have to be shifted to the right so that none is 2^`bits` or more in size.
fn excess<'v>(values: impl Iterator<Item = &'v i64>, bits: u32) -> u32 {
    let used = values.map(|value| 64u32.wrapping_sub(value.unsigned_abs().leading_zeros())).max().unwrap_or(0);
    used.saturating_sub(bits)
}

/// Positions are below this, stored units.
const LIMIT: u32 = 1 << 17;

/// Division by one number of several whose quotients are small: long divisions are slow on small processors.
struct Quotient {
    divisor: u64,
    /// Everything is shifted right by `shift` for a first guess; what `share` is of 2^32 is one over the divisor shifted, and one more if bits were lost,
    /// so that the guess is never too large.
    shift: u32,
    share: u32,
}

impl Quotient {
    /// Division by `divisor`, at least 1.
    const fn new(divisor: u64) -> Self {
        let shift = 49u32.saturating_sub(divisor.leading_zeros());
        let short = (divisor >> shift) as u32;
        let share = u32::MAX.checked_div(if shift == 0 { short } else { short.wrapping_add(1) });
        Self { divisor, shift, share: if let Some(share) = share { share } else { 0 } }
    }

    /// `numerator` (below 2^63) divided, rounded down; `None` if that is far above [`LIMIT`].
    fn of(&self, numerator: u64) -> Option<u32> {
        // Too small by two, or below 2^32 / 2^14 and by a 2^14-th of it more, at most. Several are divided by one number: a product takes less long.
        let short = u32::try_from(numerator >> self.shift).ok()?;
        let guess = (u64::from(short).wrapping_mul(u64::from(self.share)) >> 32) as u32;
        // Far above, it would not fit what it is taken for.
        let mut quotient = Some(guess).filter(|&guess| guess <= LIMIT)?;
        let mut rest = numerator.wrapping_sub(u64::from(quotient).wrapping_mul(self.divisor));
        while rest >= self.divisor && quotient <= LIMIT {
            (rest, quotient) = (rest.wrapping_sub(self.divisor), quotient.wrapping_add(1));
        }
        Some(quotient)
    }
}

impl View {
    /// `plane` seen by `camera`, for coordinates of `key_bits` fraction bits. Whatever the bytes say, there is some answer.
    #[must_use]
    pub fn new(plane: &Plane, camera: &Camera, key_bits: u32) -> Self {
        let wide = |vector: Vector| vector.map(i64::from);
        let axis = |vector: Vector| vector.map(|x| i64::from(x.clamp(-(1 << AXIS_BITS), 1 << AXIS_BITS)));
        let (a, b) = (axis(plane.along_u), axis(plane.along_v));
        // Points are below 2^27: their differences times axes fit 2^53.
        let near = |vector: Vector| vector.map(|x| i64::from(x.clamp(-(1 << 27), 1 << 27)));
        let mut c = [0i64; 3];
        for (c, (eye, origin)) in c.iter_mut().zip(near(camera.eye).into_iter().zip(near(plane.origin))) {
            *c = eye.wrapping_sub(origin);
        }
        let normal = cross(a, b);
        let (for_u, for_v) = (cross(c, b), cross(a, c));
        let directions = [camera.first, camera.column, camera.row].map(wide);
        // Below 2^30 each, times directions below 2^28: sums of three fit 2^60.
        let above = excess(for_u.iter().chain(&for_v), 30);
        let below = excess(normal.iter(), 30);
        // The plane lies ahead of the eye where the divisor has the other sign than this: at most 2^28 times 2^30, three times.
        let flip = if dot(c, normal.map(|x| x.wrapping_shr(below))) < 0 { 1 } else { -1i64 };
        let along = |vector: [i64; 3], shift: u32| {
            let vector = vector.map(|x| x.wrapping_shr(shift).wrapping_mul(flip));
            directions.map(|direction| dot(direction, vector))
        };
        let (u, v, divisor) = (along(for_u, above), along(for_v, above), along(normal, below));
        let (over, under) = (excess(u.iter().chain(&v), 30), excess(divisor.iter(), 30));
        let short = |terms: [i64; 3], shift: u32| terms.map(|term| term.wrapping_shr(shift) as i32);
        // A numerator carries the axes' length once, the divisor twice.
        let up = key_bits.wrapping_add(u32::from(plane.shift)).wrapping_add(above).wrapping_add(over) as i32;
        Self { terms: [short(u, over), short(v, over), short(divisor, under)], scale: up.wrapping_sub(below.wrapping_add(under) as i32) }
    }

    /// The position at the node in `column` and `row`, stored units; `None` where the plane is behind the eye, or far out.
    #[must_use]
    pub fn at(&self, column: usize, row: usize) -> Option<[i32; 2]> {
        self.across(column, row).advance()
    }

    /// The positions at the nodes of `row`, from `column` on.
    #[must_use]
    #[inline(never)]
    pub fn across(&self, column: usize, row: usize) -> Across {
        // Terms are below 2^30 and there are at most 1025 nodes in a row: all are below 2^42.
        let place = [1, column as i64, row as i64];
        let [u, v, divisor] = self.terms.map(|terms| dot(terms.map(i64::from), place));
        let [by_u, by_v, by_divisor] = self.terms.map(|[_, column, _]| i64::from(column));
        let (up, down) = match self.scale {
            up @ 0..=20 => (up as u32, 0),
            down @ -20..0 => (0, down.unsigned_abs()),
            // Out of reach: no divisor is above zero.
            _ => return Across { at: [0; 3], step: [0; 3] },
        };
        let scaled = |u: i64, v: i64, divisor: i64| [u.wrapping_shl(up), v.wrapping_shl(up), divisor.wrapping_shl(down)];
        Across { at: scaled(u, v, divisor), step: scaled(by_u, by_v, by_divisor) }
    }
}

/// A plane's positions along a row of nodes.
#[derive(Clone, Copy, Debug)]
pub struct Across {
    /// u and v times the divisor, and this; and what a column further adds.
    at: [i64; 3],
    step: [i64; 3],
}

impl Across {
    /// The position at the next node, stored units; `None` where the plane is behind the eye, or far out.
    #[inline(always)]
    pub fn advance(&mut self) -> Option<[i32; 2]> {
        let [u, v, divisor] = self.at;
        for (at, step) in self.at.iter_mut().zip(self.step) {
            *at = at.wrapping_add(step);
        }
        if divisor <= 0 {
            return None;
        }
        let quotient = Quotient::new(divisor as u64);
        let axis = |numerator: i64| {
            let numerator = numerator.wrapping_add(divisor >> 1);
            // Rounded towards minus infinity.
            let flip = numerator >> 63;
            let position = quotient.of((numerator ^ flip) as u64)? as i32 ^ flip as i32;
            Some(position).filter(|position| position.unsigned_abs() < LIMIT)
        };
        Some([axis(u)?, axis(v)?])
    }
}

#[cfg(test)]
mod tests {
    use super::{LIMIT, Quotient};

    #[test]
    fn quotients_are_those_of_a_long_division() {
        let mut seed = 7u64;
        let mut next = |bits: u32| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            seed >> (64 - bits)
        };
        for round in 0..20_000u32 {
            let divisor = next(1 + round % 45).max(1);
            let exact = next(18);
            let numerator = exact * divisor + next(46) % divisor;
            let quotient = Quotient::new(divisor).of(numerator).filter(|&quotient| quotient < LIMIT);
            assert_eq!(quotient.map(u64::from), Some(exact).filter(|&exact| exact < u64::from(LIMIT)), "{numerator} / {divisor}");
        }
    }

    #[test]
    fn quotients_far_above_the_limit_are_none() {
        for (divisor, numerator) in [(1, u64::from(u32::MAX) - 3), (1, u64::from(LIMIT) + 2), (3, 1 << 33), (1 << 40, 1 << 62)] {
            assert_eq!(Quotient::new(divisor).of(numerator), None, "{numerator} / {divisor}");
        }
    }
}
