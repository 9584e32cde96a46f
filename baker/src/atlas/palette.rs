//! The palette: the few colours of the source image, each one a display's RGB565 value.
//! The coloured image comes from `fill`; indices and palette go into the bundle.

use quantette::PaletteSize;
use quantette::deps::palette::Srgb;
use quantette::wu::{BinnerU8x3, WuU8x3};
use rayon::prelude::*;

/// Rounds of k-means after Wu's partition.
const ROUNDS: usize = 8;

/// The RGB565 value nearest to a colour, widened by repeating its leading bits.
pub(crate) fn widened([r, g, b]: [u8; 3]) -> [u8; 3] {
    let five = |v: u8| {
        let q = ((u16::from(v) * 31 + 127) / 255) as u8;
        (q << 3) | (q >> 2)
    };
    let q = ((u16::from(g) * 63 + 127) / 255) as u8;
    [five(r), (q << 2) | (q >> 4), five(b)]
}

fn distance(a: [u8; 3], b: [u8; 3]) -> u32 {
    a.iter().zip(b).map(|(&a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}

/// The nearest entry, the first of equals.
fn nearest(palette: &[[u8; 3]], colour: [u8; 3]) -> usize {
    (0..palette.len()).min_by_key(|&i| distance(palette[i], colour)).unwrap_or(0)
}

/// Palette indices and a palette of at most `size` (2..=256) colours for `colours`; a texel weighs as much as the
/// pixels that see it (`seen`).
pub(super) fn reduce(colours: &[[u8; 3]], seen: &[u32], size: usize) -> (Vec<u8>, Vec<[u8; 3]>) {
    let mut sorted: Vec<([u8; 3], u64)> = colours.iter().zip(seen).map(|(&c, &n)| (c, u64::from(n) + 1)).collect();
    sorted.par_sort_unstable();
    let mut weighted: Vec<([u8; 3], u64)> = Vec::new();
    for (colour, weight) in sorted {
        match weighted.last_mut() {
            Some(last) if last.0 == colour => last.1 += weight,
            _ => weighted.push((colour, weight)),
        }
    }
    let mut palette: Vec<[u8; 3]> = weighted.iter().map(|w| widened(w.0)).collect();
    tidy(&mut palette);
    if palette.len() > size {
        palette = cluster(&weighted, size);
    }
    let table: Vec<u8> = weighted.par_iter().map(|w| nearest(&palette, w.0) as u8).collect();
    let index = |c: &[u8; 3]| weighted.binary_search_by_key(c, |w| w.0).map_or(0, |i| table[i]);
    (colours.par_iter().map(index).collect(), palette)
}

/// Sorts by brightness, so that near indices are near colours, and drops duplicates.
fn tidy(palette: &mut Vec<[u8; 3]>) {
    palette.sort_by_key(|&[r, g, b]| (2 * u32::from(r) + 5 * u32::from(g) + u32::from(b), [r, g, b]));
    palette.dedup();
}

fn cluster(weighted: &[([u8; 3], u64)], size: usize) -> Vec<[u8; 3]> {
    let total: u64 = weighted.iter().map(|w| w.1).sum();
    // Wu's method counts colours: the weights become repetitions.
    let unit = (total / 400_000).max(1);
    let repeated: Vec<Srgb<u8>> =
        weighted.iter().flat_map(|&([r, g, b], n)| std::iter::repeat_n(Srgb::new(r, g, b), (n / unit).clamp(1, 4096) as usize)).collect();
    let colours = PaletteSize::try_from(size as u16).unwrap_or(PaletteSize::MAX);
    let mut palette: Vec<[u8; 3]> = match WuU8x3::run_slice(&repeated, BinnerU8x3::rgb()) {
        Ok(wu) => wu.palette(colours).into_vec().into_iter().map(|c| [c.red, c.green, c.blue]).collect(),
        Err(_) => weighted.iter().step_by(weighted.len().div_ceil(size).max(1)).map(|w| w.0).collect(),
    };
    for _ in 0..ROUNDS {
        let near: Vec<usize> = weighted.par_iter().map(|w| nearest(&palette, w.0)).collect();
        let mut sums = vec![[0u64; 4]; palette.len()];
        for (&(colour, weight), &i) in weighted.iter().zip(&near) {
            for (sum, c) in sums[i].iter_mut().zip(colour) {
                *sum += u64::from(c) * weight;
            }
            sums[i][3] += weight;
        }
        for (entry, [r, g, b, n]) in palette.iter_mut().zip(sums).filter(|(_, s)| s[3] > 0) {
            *entry = [r, g, b].map(|v| ((v + n / 2) / n) as u8);
        }
    }
    palette.iter_mut().for_each(|c| *c = widened(*c));
    tidy(&mut palette);
    // Rounding makes entries equal: the freed ones go where they help most.
    for _ in 0..ROUNDS {
        if palette.len() >= size {
            break;
        }
        let mut gains: Vec<([u8; 3], u64)> = weighted
            .par_iter()
            .map(|&(colour, weight)| {
                let (now, then) = (palette[nearest(&palette, colour)], widened(colour));
                (then, weight * u64::from(distance(now, colour).saturating_sub(distance(then, colour))))
            })
            .filter(|g| g.1 > 0)
            .collect();
        gains.par_sort_unstable();
        gains.dedup_by(|next, kept| {
            next.0 == kept.0 && {
                kept.1 += next.1;
                true
            }
        });
        gains.sort_by_key(|g| (std::cmp::Reverse(g.1), g.0));
        // Half of them at a time, since each changes what the others gain.
        let room = size - palette.len();
        palette.extend(gains.iter().take(room.div_ceil(2)).map(|g| g.0));
        tidy(&mut palette);
    }
    palette
}
