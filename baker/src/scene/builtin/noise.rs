//! Lattice noise: what gives the built-in scenes' textures and terrain their grain.
//! Coordinates and a seed come in; values in 0..1 go to the pictures on scenes' surfaces. Integer hashing and
//! plain arithmetic only, so every host computes the same bits.

/// A pseudo-random value in 0..1 for the lattice point (`x`, `y`) of the lattice `seed`.
pub(super) fn hash(x: i32, y: i32, seed: u32) -> f64 {
    let mut h = x.cast_unsigned().wrapping_mul(0x9E37_79B1) ^ y.cast_unsigned().wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297A_2D39);
    h ^= h >> 15;
    f64::from(h & 0xFF_FFFF) / 16_777_216.0
}

/// Value noise at (`x`, `y`): the hashed lattice values, blended by smoothstep; 0..1, continuous.
pub(super) fn value(x: f64, y: f64, seed: u32) -> f64 {
    let (column, row) = (x.floor(), y.floor());
    let (fx, fy) = (x - column, y - row);
    let (sx, sy) = (fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy));
    let (i, j) = (column as i32, row as i32);
    let (a, b) = (hash(i, j, seed), hash(i + 1, j, seed));
    let (c, d) = (hash(i, j + 1, seed), hash(i + 1, j + 1, seed));
    (a + (b - a) * sx) * (1.0 - sy) + (c + (d - c) * sx) * sy
}

/// Fractal noise: `octaves` layers of [`value`], each half as strong and 2.03 times as fine as the one
/// before (not 2: the lattices must not line up); normalised to 0..1.
pub(super) fn fractal(x: f64, y: f64, octaves: u32, seed: u32) -> f64 {
    let (mut sum, mut weight, mut total, mut frequency) = (0.0, 0.5, 0.0, 1.0);
    for octave in 0..octaves {
        sum += weight * value(x * frequency, y * frequency, seed + octave);
        total += weight;
        weight *= 0.5;
        frequency *= 2.03;
    }
    sum / total
}

#[cfg(test)]
mod tests {
    use super::{fractal, hash, value};

    #[test]
    fn values_stay_in_range_and_meet_the_lattice() {
        for k in 0..500 {
            let (x, y) = (f64::from(k) * 0.37 - 60.0, f64::from(k) * -0.91 + 80.0);
            assert!((0.0..1.0).contains(&fractal(x, y, 5, 3)), "at {x}, {y}");
        }
        assert!((value(7.0, -4.0, 9) - hash(7, -4, 9)).abs() < 1e-12);
    }

    #[test]
    fn neighbours_and_seeds_differ() {
        assert!((hash(1, 2, 3) - hash(2, 1, 3)).abs() > 1e-6);
        assert!((hash(1, 2, 3) - hash(1, 2, 4)).abs() > 1e-6);
    }
}
