//! Axes: how texels move along one direction of a chart. `warp` makes them; a charting, and through it the atlas, asks them for warped coordinates and for the
//! way back.

/// Pieces of a direction.
pub(super) const PIECES: usize = 16;

/// A growing function of one flattened coordinate; its slope runs straight from knot to knot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    lo: f64,
    /// Length of a piece.
    step: f64,
    /// The slope at each knot; greater than 0.
    slope: [f64; PIECES + 1],
    /// The value at each knot.
    at: [f64; PIECES + 1],
}

impl Axis {
    /// The function from `lo` to `hi` with these slopes at even knots; it is 0 at `lo`.
    pub(super) fn new([lo, hi]: [f64; 2], slope: [f64; PIECES + 1]) -> Self {
        let step = (hi - lo) / PIECES as f64;
        let mut at = [0.0; PIECES + 1];
        for i in 0..PIECES {
            at[i + 1] = at[i] + 0.5 * step * (slope[i] + slope[i + 1]);
        }
        Self { lo, step, slope, at }
    }

    /// The value, continued straight beyond the ends.
    #[inline]
    pub fn of(&self, x: f64) -> f64 {
        let t = x - self.lo;
        let i = (t / self.step).clamp(0.0, (PIECES - 1) as f64) as usize;
        let t = t - i as f64 * self.step;
        if t < 0.0 {
            return self.at[i] + t * self.slope[i];
        }
        if t > self.step {
            return self.at[i + 1] + (t - self.step) * self.slope[i + 1];
        }
        self.at[i] + t * (self.slope[i] + 0.5 * t / self.step * (self.slope[i + 1] - self.slope[i]))
    }

    /// The coordinate that has the value `y`.
    pub fn back(&self, y: f64) -> f64 {
        let i = self.at[1..PIECES].partition_point(|&at| at <= y);
        let (y, a, b) = (y - self.at[i], self.slope[i], self.slope[i + 1]);
        let knot = self.lo + i as f64 * self.step;
        let whole = self.at[i + 1] - self.at[i];
        if y < 0.0 {
            return knot + y / a;
        }
        if y > whole {
            return knot + self.step + (y - whole) / b;
        }
        // a t + (b - a) t^2 / (2 step) = y, in the form that holds for a = b.
        knot + 2.0 * y / (a + (a * a + 2.0 * y * (b - a) / self.step).max(0.0).sqrt())
    }
}

/// How a chart is warped: along its two directions.
pub(crate) type Warp = [Axis; 2];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_back_leads_back() {
        let slope = std::array::from_fn(|i| [0.25, 3.0, 1.0, 1.0, 0.1][i % 5]);
        let axis = Axis::new([-2.0, 6.0], slope);
        let mut last = f64::NEG_INFINITY;
        for i in -40..=140 {
            let x = -2.0 + f64::from(i) * 0.08;
            let y = axis.of(x);
            assert!(y > last && (axis.back(y) - x).abs() < 1e-9, "{x} {y} {}", axis.back(y));
            last = y;
        }
    }
}
