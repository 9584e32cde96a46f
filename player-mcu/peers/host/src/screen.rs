//! Pictures as a display of RGB565 shows them, and how like the truth they are. Pixels come from `make` and `decode`.

/// Pixels a row, as the peers have it.
pub const WIDTH: usize = 320;
/// Rows.
pub const HEIGHT: usize = 240;
/// Pixels of a frame.
pub const PIXELS: usize = WIDTH * HEIGHT;

/// Cut to RGB565, as players do for each pixel.
pub fn cut([r, g, b]: [u8; 3]) -> u16 {
    u16::from(r & 0xf8) << 8 | u16::from(g & 0xfc) << 3 | u16::from(b >> 3)
}

/// The nearest of RGB565, for what is stored that way.
pub fn nearest([r, g, b]: [u8; 3]) -> u16 {
    let scale = |value: u8, most: u32| ((u32::from(value) * most * 2 + 255) / 510) as u16;
    scale(r, 31) << 11 | scale(g, 63) << 5 | scale(b, 31)
}

/// R, G, B of a pixel of a display.
fn shown(pixel: u16) -> [u8; 3] {
    let (r, g, b) = (pixel >> 11, pixel >> 5 & 63, pixel & 31);
    [r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2].map(|value| value as u8)
}

/// The sum that a firmware gives of pixels in this order: FNV-1a, a pixel at a time.
pub fn sum(pixels: impl IntoIterator<Item = u16>) -> u32 {
    pixels.into_iter().fold(0x811c_9dc5, |sum, pixel| (sum ^ u32::from(pixel)).wrapping_mul(0x0100_0193))
}

/// PSNR of what a display shows of `picture`, dB, beside the `truth` (R, G, B).
pub fn psnr(picture: &[u16], truth: &[u8]) -> f64 {
    let errors = picture.iter().zip(truth.as_chunks::<3>().0).flat_map(|(&pixel, truth)| {
        let pixel = shown(pixel);
        [0, 1, 2].map(|i| (f64::from(pixel[i]) - f64::from(truth[i])).powi(2))
    });
    let mean = errors.sum::<f64>() / truth.len() as f64;
    10.0 * (255.0 * 255.0 / mean.max(1e-9)).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_stay_and_rounding_beats_cutting() {
        assert_eq!([nearest([255; 3]), nearest([0; 3]), cut([255; 3])], [0xffff, 0, 0xffff]);
        assert_eq!([shown(0xffff), shown(0)], [[255; 3], [0; 3]]);
        let truth: Vec<u8> = (0..=255).flat_map(|value| [value; 3]).collect();
        let picture = |how: fn([u8; 3]) -> u16| truth.as_chunks::<3>().0.iter().map(|&rgb| how(rgb)).collect::<Vec<_>>();
        assert!(psnr(&picture(nearest), &truth) > psnr(&picture(cut), &truth) + 1.0);
    }
}
