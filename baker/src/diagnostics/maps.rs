//! Maps of the source image: what was never seen, and where it is too coarse or too fine.
//! Figures come from `texels`; pictures go to `diagnostics`, which writes them.

use super::picture::{Picture, SIDE};
use super::texels::Seen;
use cubist_baker::atlas::SourceImage;

/// The colour of texels that no pixel falls on; nothing else in its picture is as bright.
pub const NEVER: [u8; 3] = [255, 0, 255];
/// Octaves from the middle of the scale to its ends.
const OCTAVES: f64 = 2.0;
/// Colours from too coarse to too fine; the middle is what was asked for.
const SCALE: [[u8; 3]; 5] = [[33, 102, 172], [146, 197, 222], [247, 247, 247], [244, 165, 130], [178, 24, 43]];
/// Seen, but too narrow to tell how finely.
const UNKNOWN: [u8; 3] = [96, 96, 96];
/// Covered, but never seen.
const UNSEEN: [u8; 3] = [48, 48, 48];
/// Rows of the legend.
pub const LEGEND: u32 = 56;
/// What stands at the ticks: texels a pixel, over what was asked for.
const TICKS: [&str; 5] = ["1/4", "1/2", "1", "2", "4"];
/// Pixels of a dot of a glyph.
const DOT: u32 = 3;

/// The source image at half brightness, nothing where it is not covered, and what was never seen in [`NEVER`].
pub fn never_seen(image: &SourceImage, never: &[bool]) -> Picture {
    let texel = |i: usize| match (never[i], image.covered[i]) {
        (true, _) => NEVER,
        (false, true) => image.colour(image.texels[i]).map(|v| v / 2),
        (false, false) => [0; 3],
    };
    Picture::enlarged(&(0..image.texels.len()).map(texel).collect::<Vec<_>>(), image.width)
}

/// The texels that pixels cover, over the `density` asked for: blue where there are too few, white where they are right, red where there are
/// more than needed; grey where nothing is known. A legend lies below.
pub fn density(image: &SourceImage, seen: &[Seen], density: f64) -> Picture {
    let texel = |i: usize| match seen[i] {
        Some(size) if size.is_finite() => colour(libm::log2((size / density).max(1e-6))),
        Some(_) => UNKNOWN,
        None if image.covered[i] => UNSEEN,
        None => [0; 3],
    };
    let mut picture = Picture::enlarged(&(0..image.texels.len()).map(texel).collect::<Vec<_>>(), image.width);
    let top = picture.height();
    picture.pixels.resize(picture.pixels.len() + (SIDE * LEGEND) as usize, [0; 3]);
    let (left, right) = (SIDE / 8, SIDE - SIDE / 8);
    for x in left..right {
        let octave = (f64::from(x - left) / f64::from(right - left - 1) * 2.0 - 1.0) * OCTAVES;
        picture.fill([x, top + 8, x + 1, top + 28], colour(octave));
    }
    for (i, text) in (0..).zip(TICKS) {
        let x = left + (right - left - 1) * i / (TICKS.len() as u32 - 1);
        picture.fill([x - 1, top + 28, x + 1, top + 33], [255; 3]);
        let width = text.len() as u32 * 4 * DOT - DOT;
        write(&mut picture, text, [x - width / 2, top + 36]);
    }
    picture
}

/// The colour of so many octaves above what was asked for.
fn colour(octaves: f64) -> [u8; 3] {
    let at = ((octaves / OCTAVES).clamp(-1.0, 1.0) + 1.0) * 0.5 * (SCALE.len() - 1) as f64;
    let i = (at as usize).min(SCALE.len() - 2);
    let share = at - i as f64;
    std::array::from_fn(|k| (f64::from(SCALE[i][k]) * (1.0 - share) + f64::from(SCALE[i + 1][k]) * share + 0.5) as u8)
}

/// Writes digits and strokes, three dots wide and five high.
fn write(picture: &mut Picture, text: &str, [x, y]: [u32; 2]) {
    for (i, letter) in (0..).zip(text.chars()) {
        let rows: [u32; 5] = match letter {
            '1' => [0b010, 0b110, 0b010, 0b010, 0b111],
            '2' => [0b110, 0b001, 0b010, 0b100, 0b111],
            '4' => [0b101, 0b101, 0b111, 0b001, 0b001],
            _ => [0b001, 0b001, 0b010, 0b100, 0b100],
        };
        for (row, bits) in (0..).zip(rows) {
            for column in (0..3).filter(|column| bits >> (2 - column) & 1 == 1) {
                let [x, y] = [x + (4 * i + column) * DOT, y + row * DOT];
                picture.fill([x, y, x + DOT, y + DOT], [255; 3]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_tell_coarse_from_fine() {
        assert_eq!((colour(0.0), colour(-9.0), colour(9.0)), (SCALE[2], SCALE[0], SCALE[4]));
        let [blue, red] = [colour(-1.3), colour(1.3)];
        assert!(blue[2] > blue[0] && red[0] > red[2], "{blue:?} {red:?}");
    }
}
