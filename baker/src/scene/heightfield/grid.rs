//! A grid of heights, thinned by averaging.
//! Heights come from `read`; meshes are made of grids by the heightfield's loader.

/// No file may have more posts: each takes eight bytes until they are thinned. An elevation model of 10812 posts a side is a usual one.
pub(super) const MAX_POSTS: u64 = 1 << 27;

/// Posts in rows, north first; not a number: a hole.
pub(crate) struct Grid {
    pub width: u32,
    pub height: u32,
    pub values: Vec<f64>,
    /// How many posts the file had along each side.
    pub original: [u32; 2],
}

impl Grid {
    pub fn new(width: u32, height: u32, values: Vec<f64>) -> Self {
        Self { width, height, values, original: [width, height] }
    }

    /// The stored value of a post; `None`: a hole.
    pub fn at(&self, x: u32, y: u32) -> Option<f64> {
        self.values.get(y as usize * self.width as usize + x as usize).copied().filter(|v| v.is_finite())
    }

    /// The smallest and the largest stored value; `None`: nothing but holes.
    pub fn extremes(&self) -> Option<(f64, f64)> {
        let there = || self.values.iter().copied().filter(|v| v.is_finite());
        let low = there().reduce(f64::min)?;
        Some((low, there().reduce(f64::max)?))
    }

    /// Where column `x` lies in a picture that covers the posts texel by texel, 0..1.
    pub fn across(&self, x: u32) -> f64 {
        centre(x, self.width, self.original[0])
    }

    /// Where row `y` lies in such a picture, 0..1.
    pub fn down(&self, y: u32) -> f64 {
        centre(y, self.height, self.original[1])
    }

    /// The grid with at most `most` posts a side, each the mean of the area around it; `None`: it is small enough. The
    /// outermost posts stay where they are.
    pub fn thinned(&self, most: u32) -> Option<Self> {
        let longest = self.width.max(self.height);
        if longest <= most {
            return None;
        }
        let side = |n: u32| (((u64::from(n) - 1) * (u64::from(most) - 1) / (u64::from(longest) - 1)) as u32 + 1).max(2);
        let (width, height) = (side(self.width), side(self.height));
        let window = |i: u32, n: u32, from: u32| {
            let ratio = f64::from(from - 1) / f64::from(n - 1);
            let centre = f64::from(i) * ratio;
            let low = (centre - ratio / 2.0 + 0.5).floor().max(0.0) as u32;
            let high = (centre + ratio / 2.0 + 0.5).floor().max(1.0) as u32;
            low.min(from - 1)..high.clamp(low + 1, from.max(low + 1))
        };
        let mut values = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut there, mut all) = (0.0, 0u32, 0u32);
                for j in window(y, height, self.height) {
                    for i in window(x, width, self.width) {
                        all += 1;
                        if let Some(v) = self.at(i, j) {
                            sum += v;
                            there += 1;
                        }
                    }
                }
                // A post that is mostly hole is a hole.
                values.push(if there > 0 && 2 * there >= all { sum / f64::from(there) } else { f64::NAN });
            }
        }
        Some(Self { width, height, values, original: self.original })
    }
}

fn centre(i: u32, n: u32, original: u32) -> f64 {
    (f64::from(i) * f64::from(original - 1) / f64::from(n - 1) + 0.5) / f64::from(original)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_shape_of_a_slope_and_the_size_of_a_hole() {
        let (w, h) = (401, 201);
        let value = |x: u32, y: u32| if x < 40 && y < 40 { f64::NAN } else { f64::from(x) + 10.0 * f64::from(y) };
        let values = (0..h).flat_map(|y| (0..w).map(move |x| value(x, y))).collect();
        let thin = Grid::new(w, h, values).thinned(101).unwrap();
        assert_eq!((thin.width, thin.height), (101, 51));
        // Away from the border a window is centred on its post, and the mean of a plane is its middle.
        let (x, y) = (50u32, 25u32);
        assert!((thin.at(x, y).unwrap() - (200.0 + 1000.0)).abs() <= 0.5 + 5.0, "{:?}", thin.at(x, y));
        assert_eq!(thin.at(3, 3), None);
        assert!(thin.at(15, 15).is_some());
        assert!((thin.across(0) - 0.5 / 401.0).abs() < 1e-12 && (thin.across(100) - 400.5 / 401.0).abs() < 1e-12);
    }

    #[test]
    fn a_small_grid_is_left_alone() {
        assert!(Grid::new(2, 2, vec![0.0; 4]).thinned(256).is_none());
    }
}
