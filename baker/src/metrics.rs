//! Measures of likeness: PSNR, SSIM, and percentiles of many small numbers.
//! Pictures come from `verify` as rows of R, G, B bytes; figures go to the report.

/// The PSNR of a picture without any error, dB: a number, so that means stay numbers.
pub const PERFECT: f64 = 99.0;
/// The PSNR that a frame counts in a mean at most, dB: about what rounding to eight bits leaves.
const FINE: f64 = 60.0;
/// Side of an SSIM window, pixels.
const WINDOW: usize = 8;
/// SSIM's two stabilising constants: (0.01 * 255)^2 and (0.03 * 255)^2.
const STABLE: [f64; 2] = [6.5025, 58.5225];

/// The PSNR in dB of a mean squared error of 8-bit components; at most [`PERFECT`].
#[must_use]
pub fn psnr(mse: f64) -> f64 {
    if mse <= 0.0 { PERFECT } else { (10.0 * libm::log10(255.0 * 255.0 / mse)).min(PERFECT) }
}

/// The mean PSNR of frames of these, dB: of those with an error, for frames of nothing but background tell nothing of a bundle, and one frame of a sliver of
/// something as little; [`PERFECT`] where none has any.
#[must_use]
pub fn mean_psnr(frames: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0u32);
    for psnr in frames.into_iter().filter(|&psnr| psnr < PERFECT) {
        sum += psnr.min(FINE);
        count += 1;
    }
    if count == 0 { PERFECT } else { sum / f64::from(count) }
}

/// The mean squared error of a picture of `psnr` dB.
#[must_use]
pub fn mse(psnr: f64) -> f64 {
    255.0 * 255.0 / libm::pow(10.0, 0.1 * psnr)
}

/// What a picture of `psnr` dB for `bytes` is worth, dB, where twice the bytes have to bring `double` dB.
#[must_use]
pub fn worth(psnr: f64, bytes: u64, double: f64) -> f64 {
    psnr - double * libm::log2(bytes.max(1) as f64)
}

/// The mean squared error of two equally long rows of components; 0 for empty ones.
#[must_use]
pub fn mean_squared_error(a: &[u8], b: &[u8]) -> f64 {
    let sum: u64 = a.iter().zip(b).map(|(&a, &b)| u64::from(u32::from(a.abs_diff(b)).pow(2))).sum();
    sum as f64 / a.len().min(b.len()).max(1) as f64
}

/// The mean SSIM of the luma of two RGB pictures of `width` pixels a row, over windows of 8 x 8 pixels side by side; the last
/// column and row of windows are moved inwards to end at the picture's edge. 1: the same picture.
#[must_use]
pub fn ssim(a: &[u8], b: &[u8], width: usize) -> f64 {
    let luma = |picture: &[u8]| -> Vec<f32> {
        picture.as_chunks::<3>().0.iter().map(|&[r, g, b]| 0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)).collect()
    };
    let (a, b) = (luma(a), luma(b));
    let height = a.len().min(b.len()) / width.max(1);
    if width == 0 || height == 0 {
        return 1.0;
    }
    let starts = |length: usize| (0..length.div_ceil(WINDOW)).map(move |i| (i * WINDOW).min(length.saturating_sub(WINDOW)));
    let (mut sum, mut windows) = (0.0, 0u32);
    for y in starts(height) {
        for x in starts(width) {
            let rows = (y..(y + WINDOW).min(height)).map(|row| row * width + x..row * width + (x + WINDOW).min(width));
            sum += window(rows.map(|row| (&a[row.clone()], &b[row])));
            windows += 1;
        }
    }
    sum / f64::from(windows)
}

/// The SSIM of one window, row by row.
fn window<'a>(rows: impl Iterator<Item = (&'a [f32], &'a [f32])>) -> f64 {
    let (mut count, mut sums) = (0usize, [0f32; 5]);
    for (a, b) in rows {
        count += a.len();
        for (&a, &b) in a.iter().zip(b) {
            // At most 64 * 255^2: single precision keeps a relative 1e-7 of it, far below the constants.
            for (sum, term) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                *sum += term;
            }
        }
    }
    let [ma, mb, aa, bb, ab] = sums.map(|s| f64::from(s) / count.max(1) as f64);
    let (va, vb, covariance) = (aa - ma * ma, bb - mb * mb, ab - ma * mb);
    let [c1, c2] = STABLE;
    (2.0 * ma * mb + c1) * (2.0 * covariance + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
}

/// Counts of non-negative numbers by size, a bin every 1/256 of an octave: percentiles to 0.3 % in bounded memory, the
/// same whatever the order the numbers arrive in.
#[derive(Clone, Debug)]
pub struct Histogram {
    bins: Vec<u64>,
    count: u64,
    max: f32,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { bins: vec![0; 1 << 16], count: 0, max: 0.0 }
    }
}

impl Histogram {
    /// Bits of a single-precision number below its first eight of mantissa.
    const DROPPED: u32 = 15;

    /// Counts `value`; what is negative or no number counts as 0.
    #[inline]
    pub fn add(&mut self, value: f32) {
        let value = value.max(0.0);
        // The bits of non-negative floats ascend with their value.
        self.bins[(value.to_bits() >> Self::DROPPED) as usize & 0xffff] += 1;
        self.count += 1;
        self.max = self.max.max(value);
    }

    /// Adds all that `other` counted.
    pub fn merge(&mut self, other: &Self) {
        for (bin, &more) in self.bins.iter_mut().zip(&other.bins) {
            *bin += more;
        }
        self.count += other.count;
        self.max = self.max.max(other.max);
    }

    /// The largest number counted, exactly; 0 if there is none.
    #[must_use]
    pub fn max(&self) -> f64 {
        f64::from(self.max)
    }

    /// The number that a share of `share` (0..=1) of all numbers does not exceed; 0 if there is none.
    #[must_use]
    pub fn percentile(&self, share: f64) -> f64 {
        let wanted = ((self.count as f64 * share).ceil() as u64).max(1);
        let mut seen = 0;
        for (bin, &count) in self.bins.iter().enumerate() {
            seen += count;
            if seen >= wanted {
                let middle = if bin == 0 { 0 } else { (bin as u32) << Self::DROPPED | 1 << (Self::DROPPED - 1) };
                return f64::from(f32::from_bits(middle).min(self.max));
            }
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_of_known_errors() {
        assert_eq!(psnr(0.0), PERFECT);
        assert_eq!(psnr(1e-9), PERFECT);
        assert_eq!(mean_psnr([PERFECT, 30.0, PERFECT, 40.0]), 35.0);
        assert_eq!(mean_psnr([90.0, 30.0]), 45.0);
        assert_eq!([mean_psnr([PERFECT; 2]), mean_psnr([])], [PERFECT; 2]);
        assert_eq!(psnr(255.0 * 255.0), 0.0);
        // Every component one off: 20 log10(255).
        let (a, b) = (vec![10u8; 300], vec![11u8; 300]);
        assert!((psnr(mean_squared_error(&a, &b)) - 48.130_803_6).abs() < 1e-6);
        assert_eq!(mean_squared_error(&[0, 10], &[0, 6]), 8.0);
        assert_eq!(mean_squared_error(&[], &[]), 0.0);
    }

    fn noise(seed: u32, length: usize) -> Vec<u8> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        (0..length).map(|_| next()).collect()
    }

    #[test]
    fn ssim_of_known_pictures() {
        let (width, height) = (20, 13);
        let a = noise(1, width * height * 3);
        assert!((ssim(&a, &a, width) - 1.0).abs() < 1e-6);
        // Flat pictures have no structure: only the means count.
        let (dark, light) = (vec![100u8; width * height * 3], vec![150u8; width * height * 3]);
        let expected = (2.0 * 100.0 * 150.0 + STABLE[0]) / (100.0 * 100.0 + 150.0 * 150.0 + STABLE[0]);
        assert!((ssim(&dark, &light, width) - expected).abs() < 1e-4);
        // Inverted noise is anticorrelated, independent noise is not correlated.
        let inverted: Vec<u8> = a.iter().map(|v| 255 - v).collect();
        assert!(ssim(&a, &inverted, width) < -0.5);
        assert!(ssim(&a, &noise(2, width * height * 3), width).abs() < 0.3);
        assert_eq!(ssim(&[], &[], 0), 1.0);
    }

    #[test]
    fn ssim_sees_the_last_rows_and_columns() {
        let (width, height) = (20, 13);
        let a = noise(3, width * height * 3);
        let mut b = a.clone();
        b[(width * height - 1) * 3 + 1] ^= 0xff;
        assert!(ssim(&a, &b, width) < 1.0 - 1e-4);
    }

    #[test]
    fn percentiles_are_those_of_the_sorted_numbers() {
        let mut whole = Histogram::default();
        let (mut odd, mut even) = (Histogram::default(), Histogram::default());
        for i in 0..1000u32 {
            let value = (i * 7 % 1000) as f32 * 0.01;
            whole.add(value);
            if i % 2 == 0 { even.add(value) } else { odd.add(value) }
        }
        even.merge(&odd);
        assert_eq!(even.bins, whole.bins);
        for (share, expected) in [(0.5, 4.99), (0.99, 9.89), (1.0, 9.99)] {
            assert!((even.percentile(share) / expected - 1.0).abs() < 0.003, "{share}: {}", even.percentile(share));
        }
        assert_eq!(even.max(), f64::from(9.99f32));
        assert_eq!(Histogram::default().percentile(0.5), 0.0);
    }
}
