//! Places: where a chart lies in the source image, and the map that takes it there.
//! The packing makes them; the G-buffer and the colouring ask them for texels.

/// How far inside its chart's rectangle a coordinate stays, texels.
const INSIDE: f32 = 1.0 / 128.0;

/// Where a chart lies and how it gets there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// x0, y0, x1, y1, the ends exclusive.
    pub rect: [u32; 4],
    /// Texel coordinates of the flattened origin.
    pub origin: [f64; 2],
    /// Texels a unit of the flattened coordinate that runs along x, and of the one along y; negative where it runs backwards.
    pub step: [f64; 2],
    /// The second flattened coordinate runs along x, the first along y.
    pub swap: bool,
}

impl Place {
    /// What is seen of a chart, `lo`..`hi` in flattened coordinates, stretched over `rect` after `turns` quarter turns: each takes what lies
    /// right to below.
    pub fn new(rect: [u32; 4], lo: [f64; 2], hi: [f64; 2], turns: u8) -> Self {
        let swap = turns % 2 == 1;
        let (mut origin, mut step) = ([0.0; 2], [0.0; 2]);
        for k in 0..2 {
            let along = k ^ usize::from(swap);
            let length = (hi[along] - lo[along]).max(1e-12 * hi[along].abs()).max(f64::MIN_POSITIVE);
            let size = f64::from(rect[k + 2] - rect[k]) / length;
            let back = [[false, false], [true, false], [true, true], [false, true]][usize::from(turns % 4)][k];
            step[k] = if back { -size } else { size };
            origin[k] = f64::from(rect[if back { k + 2 } else { k }]) - lo[along] * step[k];
        }
        Self { rect, origin, step, swap }
    }

    /// Texel coordinates of flattened coordinates, wherever they are.
    #[inline]
    pub fn at(&self, flat: [f64; 3]) -> [f64; 2] {
        let [x, y] = if self.swap { [flat[1], flat[0]] } else { [flat[0], flat[1]] };
        [self.origin[0] + x * self.step[0], self.origin[1] + y * self.step[1]]
    }

    /// Texel coordinates of flattened coordinates, within the rectangle.
    #[inline]
    pub fn uv(&self, flat: [f64; 3]) -> [f32; 2] {
        let at = self.at(flat);
        [0, 1].map(|k| (at[k] as f32).clamp(self.rect[k] as f32 + INSIDE, self.rect[k + 2] as f32 - INSIDE))
    }

    /// The chart's size before it was turned, texels.
    pub fn size(&self) -> [u32; 2] {
        let [x0, y0, x1, y1] = self.rect;
        if self.swap { [y1 - y0, x1 - x0] } else { [x1 - x0, y1 - y0] }
    }

    /// Flattened lengths a texel covers, as the side of a square.
    pub fn texel(&self) -> f64 {
        1.0 / (self.step[0] * self.step[1]).abs().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::mask::Mask;

    #[test]
    fn turned_places_agree_with_turned_masks() {
        let (lo, hi, size) = ([-2.0, 3.0], [1.5, 5.5], [7, 5]);
        let straight = Place::new([0, 0, 7, 5], lo, hi, 0);
        for turns in 0..4 {
            let [w, h] = if turns % 2 == 1 { [5, 7] } else { size };
            let place = Place::new([20, 30, 20 + w, 30 + h], lo, hi, turns);
            for i in 0..35 {
                let flat = [lo[0] + 0.5 * (f64::from(i % 7) + 0.3), lo[1] + 0.5 * (f64::from(i / 7) + 0.6), 0.0];
                let [x, y] = straight.uv(flat).map(|v| v as u32);
                let mut mask = Mask::new(7, 5);
                mask.set(x, y);
                let turned = (0..turns).fold(mask, |mask, _| mask.turned());
                let [u, v] = place.uv(flat).map(|v| v as u32);
                assert!(turned.has(u - 20, v - 30), "{turns} turns: texel {x}, {y} is said to lie at {u}, {v}");
            }
        }
    }
}
