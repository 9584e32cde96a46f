//! The palette: the few colours of the source image, each one a display's RGB565 value.
//! The coloured image comes from `fill`; indices and palette go into the bundle.
//!
//! Colours are clustered where distances are about as they are seen: in Oklab (Björn Ottosson, "A perceptual color space for image
//! processing"), by k-means, every colour weighing as many pixels as see it. Wu's partition is where it starts.

use quantette::PaletteSize;
use quantette::deps::palette::Srgb;
use quantette::wu::{BinnerU8x3, WuU8x3};
use rayon::prelude::*;

/// The most rounds of k-means after Wu's partition; most pictures settle earlier.
const ROUNDS: usize = 24;
/// Rounds by which entries that became equal are given away.
const REFILLS: usize = 8;
/// How much more than in Oklab a difference in hue or chroma counts. About what makes a step along each axis move red, green and blue by as
/// much at mid grey: figures of quality count these, and plain Oklab costs them a little.
const CHROMA: f64 = 1.25;

/// The RGB565 value nearest to a colour, widened by repeating its leading bits.
#[must_use]
pub fn widened([r, g, b]: [u8; 3]) -> [u8; 3] {
    let five = |v: u8| {
        let q = ((u16::from(v) * 31 + 127) / 255) as u8;
        (q << 3) | (q >> 2)
    };
    let q = ((u16::from(g) * 63 + 127) / 255) as u8;
    [five(r), (q << 2) | (q >> 4), five(b)]
}

/// A colour in Oklab: lightness, and the two axes of chroma times [`CHROMA`].
type Seen = [f32; 3];

/// From bytes of sRGB to Oklab and back. Powers and roots are libm's own, the same on every host.
struct Space {
    /// Linear light, 0..=1, by byte.
    linear: [f64; 256],
}

impl Space {
    fn new() -> Self {
        let light = |byte: usize| {
            let v = byte as f64 / 255.0;
            if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
        };
        Self { linear: std::array::from_fn(light) }
    }

    fn seen(&self, rgb: [u8; 3]) -> Seen {
        let [r, g, b] = rgb.map(|v| self.linear[usize::from(v)]);
        let l = libm::cbrt(0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b);
        let m = libm::cbrt(0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b);
        let s = libm::cbrt(0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b);
        [
            0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
            CHROMA * (1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s),
            CHROMA * (0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s),
        ]
        .map(|v| v as f32)
    }

    /// The nearest bytes.
    fn bytes(&self, seen: Seen) -> [u8; 3] {
        let [light, a, b] = seen.map(f64::from);
        let (a, b) = (a / CHROMA, b / CHROMA);
        let cube = |v: f64| v * v * v;
        let l = cube(light + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
        let m = cube(light - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
        let s = cube(light - 0.089_484_177_5 * a - 1.291_485_548_0 * b);
        [
            4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
            -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
            -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
        ]
        .map(|v: f64| {
            let v = v.clamp(0.0, 1.0);
            let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::pow(v, 1.0 / 2.4) - 0.055 };
            (255.0 * v + 0.5) as u8
        })
    }
}

fn distance(a: Seen, b: Seen) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

/// Entries by lightness, each with its index.
struct Entries(Vec<(Seen, usize)>);

impl Entries {
    fn new(palette: impl IntoIterator<Item = Seen>) -> Self {
        let mut entries: Vec<(Seen, usize)> = palette.into_iter().zip(0..).collect();
        entries.sort_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]));
        Self(entries)
    }

    /// The index of the nearest one, the first of equals, and how far away it is. Of those that differ more in lightness alone none is asked.
    fn nearest(&self, colour: Seen) -> (usize, f32) {
        let (darker, lighter) = self.0.split_at(self.0.partition_point(|(entry, _)| entry[0] < colour[0]));
        let (mut best, mut least) = (usize::MAX, f32::INFINITY);
        let mut ask = |&(entry, index): &(Seen, usize)| {
            let (light, apart) = (entry[0] - colour[0], distance(entry, colour));
            if apart < least || (apart == least && index < best) {
                (best, least) = (index, apart);
            }
            light * light <= least
        };
        let _ = darker.iter().rev().all(&mut ask);
        let _ = lighter.iter().all(ask);
        (best, least)
    }
}

/// A colour of the picture.
#[derive(Clone, Copy)]
struct Weighted {
    rgb: [u8; 3],
    seen: Seen,
    weight: f64,
}

/// Palette indices and a palette of at most `size` (2..=256) colours for `colours`; a texel weighs as much as the
/// pixels that see it (`seen`).
pub(super) fn reduce(colours: &[[u8; 3]], seen: &[u32], size: usize) -> (Vec<u16>, Vec<[u8; 3]>) {
    let mut sorted: Vec<([u8; 3], u64)> = colours.iter().zip(seen).map(|(&c, &n)| (c, u64::from(n) + 1)).collect();
    sorted.par_sort_unstable();
    let mut counted: Vec<([u8; 3], u64)> = Vec::new();
    for (colour, weight) in sorted {
        match counted.last_mut() {
            Some(last) if last.0 == colour => last.1 += weight,
            _ => counted.push((colour, weight)),
        }
    }
    let space = Space::new();
    let mut palette: Vec<[u8; 3]> = counted.iter().map(|c| widened(c.0)).collect();
    tidy(&mut palette);
    let weighted: Vec<Weighted> = counted.par_iter().map(|&(rgb, n)| Weighted { rgb, seen: space.seen(rgb), weight: n as f64 }).collect();
    if palette.len() > size {
        palette = cluster(&space, &counted, &weighted, size);
    }
    let entries = Entries::new(palette.iter().map(|&rgb| space.seen(rgb)));
    let table: Vec<u16> = weighted.par_iter().map(|w| entries.nearest(w.seen).0 as u16).collect();
    let index = |c: &[u8; 3]| weighted.binary_search_by_key(c, |w| w.rgb).map_or(0, |i| table[i]);
    (colours.par_iter().map(index).collect(), palette)
}

/// Indices and palette of a picture that keeps all colours that RGB565 tells apart.
pub(super) fn direct(colours: &[[u8; 3]]) -> (Vec<u16>, Vec<[u8; 3]>) {
    let mut palette: Vec<[u8; 3]> = colours.par_iter().map(|&c| widened(c)).collect();
    palette.par_sort_unstable();
    palette.dedup();
    let index = |c: &[u8; 3]| palette.binary_search(&widened(*c)).map_or(0, |i| i as u16);
    (colours.par_iter().map(index).collect(), palette)
}

/// Sorts by brightness, so that near indices are near colours, and drops duplicates.
fn tidy(palette: &mut Vec<[u8; 3]>) {
    palette.sort_by_key(|&[r, g, b]| (2 * u32::from(r) + 5 * u32::from(g) + u32::from(b), [r, g, b]));
    palette.dedup();
}

/// Wu's partition of the colours into at most `size`.
fn start(counted: &[([u8; 3], u64)], size: usize) -> Vec<[u8; 3]> {
    let total: u64 = counted.iter().map(|c| c.1).sum();
    // Wu's method counts colours: the weights become repetitions.
    let unit = (total / 400_000).max(1);
    let repeated: Vec<Srgb<u8>> =
        counted.iter().flat_map(|&([r, g, b], n)| std::iter::repeat_n(Srgb::new(r, g, b), (n / unit).clamp(1, 4096) as usize)).collect();
    let colours = PaletteSize::try_from(size as u16).unwrap_or(PaletteSize::MAX);
    match WuU8x3::run_slice(&repeated, BinnerU8x3::rgb()) {
        Ok(wu) => wu.palette(colours).into_vec().into_iter().map(|c| [c.red, c.green, c.blue]).collect(),
        Err(_) => counted.iter().step_by(counted.len().div_ceil(size).max(1)).map(|c| c.0).collect(),
    }
}

fn cluster(space: &Space, counted: &[([u8; 3], u64)], weighted: &[Weighted], size: usize) -> Vec<[u8; 3]> {
    let mut entries: Vec<Seen> = start(counted, size).into_iter().map(|rgb| space.seen(rgb)).collect();
    let mut before: Vec<usize> = Vec::new();
    for _ in 0..ROUNDS {
        let sorted = Entries::new(entries.iter().copied());
        let near: Vec<usize> = weighted.par_iter().map(|w| sorted.nearest(w.seen).0).collect();
        if near == before {
            break;
        }
        // One after the other: sums of floats depend on their order.
        let mut sums = vec![[0f64; 4]; entries.len()];
        for (colour, &i) in weighted.iter().zip(&near) {
            for (sum, v) in sums[i].iter_mut().zip(colour.seen) {
                *sum += f64::from(v) * colour.weight;
            }
            sums[i][3] += colour.weight;
        }
        for (entry, [x, y, z, n]) in entries.iter_mut().zip(sums).filter(|(_, s)| s[3] > 0.0) {
            *entry = [x, y, z].map(|v| (v / n) as f32);
        }
        before = near;
    }
    let mut palette: Vec<[u8; 3]> = entries.into_iter().map(|entry| widened(space.bytes(entry))).collect();
    tidy(&mut palette);
    // Rounding makes entries equal: the freed ones go where they help most.
    for _ in 0..REFILLS {
        if palette.len() >= size {
            break;
        }
        let gains = gains(space, weighted, &palette);
        // Half of them at a time, since each changes what the others gain.
        let room = size - palette.len();
        palette.extend(gains.into_iter().take(room.div_ceil(2)));
        tidy(&mut palette);
    }
    palette
}

/// The colours that `palette` would gain by, the most first.
fn gains(space: &Space, weighted: &[Weighted], palette: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let entries = Entries::new(palette.iter().map(|&rgb| space.seen(rgb)));
    let gain = |w: &Weighted| {
        let then = widened(w.rgb);
        let (now, after) = (entries.nearest(w.seen).1, distance(space.seen(then), w.seen));
        (then, w.weight * f64::from(now - after))
    };
    let mut gains: Vec<([u8; 3], f64)> = weighted.par_iter().map(gain).filter(|g| g.1 > 0.0).collect();
    // Of one colour as they came: sums of floats depend on their order.
    gains.par_sort_by_key(|g| g.0);
    gains.dedup_by(|next, kept| {
        next.0 == kept.0 && {
            kept.1 += next.1;
            true
        }
    });
    gains.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    gains.into_iter().map(|g| g.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_go_there_and_back() {
        let space = Space::new();
        for i in 0..4096u32 {
            let rgb = [(i & 15) * 17, (i >> 4 & 15) * 17, (i >> 8) * 17].map(|v| v as u8);
            assert_eq!(space.bytes(space.seen(rgb)), rgb);
        }
        let [light, a, b] = space.seen([255; 3]);
        assert!((light - 1.0).abs() < 1e-4 && a.abs() < 1e-4 && b.abs() < 1e-4, "{light} {a} {b}");
        // Ottosson's own figure for pure red, within what his rounded matrices leave.
        let [light, a, b] = space.seen([255, 0, 0]);
        let chroma = [a, b].map(|v| f64::from(v) / CHROMA);
        assert!((f64::from(light) - 0.628).abs() < 1e-3 && (chroma[0] - 0.225).abs() < 1e-3 && (chroma[1] - 0.126).abs() < 1e-3);
    }

    /// The nearest entry, the first of equals, all asked one after the other.
    fn nearest(palette: &[Seen], colour: Seen) -> usize {
        let apart = |&i: &usize| distance(palette[i], colour);
        (0..palette.len()).min_by(|i, j| apart(i).total_cmp(&apart(j))).unwrap()
    }

    /// A smooth picture: green to the right, blue down, the red of their difference.
    fn smooth() -> Vec<[u8; 3]> {
        (0..64 * 64u32).map(|i| [i % 64, i / 64]).map(|[x, y]| [(128 + x - y) as u8, 4 * x as u8, 4 * y as u8]).collect()
    }

    /// The mean squared error of those of `colours` that `part` names.
    fn error(colours: &[[u8; 3]], reduced: &(Vec<u16>, Vec<[u8; 3]>), part: impl Fn(usize) -> bool) -> f64 {
        let of = |i: usize| {
            let entry = reduced.1[usize::from(reduced.0[i])];
            entry.iter().zip(colours[i]).map(|(a, b)| f64::from(a.abs_diff(b)).powi(2)).sum::<f64>()
        };
        let chosen: Vec<usize> = (0..colours.len()).filter(|&i| part(i)).collect();
        chosen.iter().map(|&i| of(i)).sum::<f64>() / chosen.len() as f64
    }

    #[test]
    fn what_is_seen_most_is_kept_best() {
        let colours = smooth();
        // A corner of the picture is seen a thousand times as often.
        let often = |i: usize| i % 64 >= 40 && i / 64 < 24;
        let seen: Vec<u32> = (0..colours.len()).map(|i| if often(i) { 1000 } else { 0 }).collect();
        let (even, weighted) = (reduce(&colours, &vec![1; colours.len()], 16), reduce(&colours, &seen, 16));
        assert!(weighted.1.len() <= 16 && even.1.len() <= 16);
        let (before, after, rest) =
            (error(&colours, &even, often), error(&colours, &weighted, often), error(&colours, &weighted, |i| !often(i)));
        assert!(after * 3.0 < before && after * 3.0 < rest, "{before} {after} {rest}");
    }

    #[test]
    fn palettes_are_of_rgb565_and_of_the_size_asked_for() {
        let colours = smooth();
        for size in [2, 3, 16, 100, 256] {
            let (texels, palette) = reduce(&colours, &vec![1; colours.len()], size);
            assert!(palette.len() <= size && palette.len() * 10 >= size * 9, "{} of {size}", palette.len());
            assert!(palette.iter().all(|&c| widened(c) == c) && texels.iter().all(|&t| usize::from(t) < palette.len()));
            // Where clusters meet is where entries are equally near.
            let space = Space::new();
            let entries: Vec<Seen> = palette.iter().map(|&c| space.seen(c)).collect();
            assert!(colours.iter().zip(&texels).all(|(&c, &t)| nearest(&entries, space.seen(c)) == usize::from(t)));
        }
    }

    #[test]
    fn direct_colours_are_the_nearest_of_rgb565() {
        let colours = smooth();
        let (texels, palette) = direct(&colours);
        assert!(colours.iter().zip(&texels).all(|(&c, &t)| palette[usize::from(t)] == widened(c)));
        let all = error(&colours, &(texels, palette), |_| true);
        let few = error(&colours, &reduce(&colours, &vec![1; colours.len()], 256), |_| true);
        assert!(all * 2.0 < few, "{all} {few}");
    }
}
