//! Which surface shows where, decided in other ways than the player's: as in 1998, and perfectly. What they lose is what coverage gains.
//! The G-buffer of a bake comes in, for the perfect one the bundle too; scores go to the coverage table.
//!
//! The baselines have a ray at every node and key, as it hits: nothing is fitted, nothing is coded, all is f64.

use crate::figures::{charts, psnr};
use crate::reference::{Reference, Weights};
use anyhow::Result;
use cubist_baker::atlas::{Atlas, SourceImage};
use cubist_baker::sheets::KeyGrid;
use cubist_core::Bundle;

/// The last position inside the source image is this far from its right and its lower edge, texels.
const EDGE: f64 = 1.0 / 65_536.0;

/// How near a way of playing comes to exact rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Mean of the frames' PSNR, dB; a frame without error counts as 99.
    pub psnr_mean: f64,
    /// Pixels that show another surface than the ray sees, percent.
    pub wrong_surface_percent: f64,
}

/// What a pixel shows: a position in the source image, texels, and whether it is the right surface.
type Shown = ([f64; 2], bool);

/// Compares what `show` says of the pixels of each frame, row by row, with exact rays.
fn compare(atlas: &Atlas, mut show: impl FnMut(u32) -> Vec<Shown>) -> Score {
    let (image, gbuffer) = (&atlas.image, &atlas.gbuffer);
    let size = gbuffer.width as usize * gbuffer.height as usize;
    let (mut sum, mut wrong) = (0.0, 0u64);
    for (frame, exact) in (0..gbuffer.frames).zip(gbuffer.uv.chunks(size.max(1))) {
        let mut squares = 0u64;
        for ((at, right), exact) in show(frame).into_iter().zip(exact) {
            let pairs = colour(image, at).into_iter().zip(colour(image, exact.map(f64::from)));
            squares += pairs.map(|(a, b)| u64::from(a.abs_diff(b)).pow(2)).sum::<u64>();
            wrong += u64::from(!right);
        }
        sum += psnr(squares, 3 * size);
    }
    Score {
        psnr_mean: sum / f64::from(gbuffer.frames.max(1)),
        wrong_surface_percent: 100.0 * wrong as f64 / gbuffer.label.len().max(1) as f64,
    }
}

/// The index of the texel nearest to a position.
fn texel(image: &SourceImage, [u, v]: [f64; 2]) -> usize {
    let inside = |x: f64, size: u32| x.clamp(0.0, f64::from(size) - EDGE) as usize;
    inside(v, image.height) * image.width as usize + inside(u, image.width)
}

fn colour(image: &SourceImage, at: [f64; 2]) -> [u8; 3] {
    image.palette[usize::from(image.texels[texel(image, at)])]
}

/// Whether the chart of `label` covers a position.
fn covers(image: &SourceImage, label: u16, at: [f64; 2]) -> bool {
    let label = &image.labels[usize::from(label)];
    let [left, top, right, bottom] = label.rect.map(f64::from);
    let inside = (left..right).contains(&at[0]) && (top..bottom).contains(&at[1]);
    inside && (!label.masked || image.covered_at(at.map(|x| x as f32)))
}

/// A ray at one of the eight nodes around a pixel.
#[derive(Clone, Copy)]
struct Node {
    label: u16,
    /// Where it hits, texels.
    at: [f64; 2],
    /// Its trilinear weight.
    weight: f64,
}

/// The nodes around the pixel (`x`, `y`) of `frame` in `interval`. A node beyond the screen's edge, where the G-buffer has no ray,
/// stands at the last pixel before it.
fn nodes(atlas: &Atlas, grid: &KeyGrid, interval: usize, frame: u32, [x, y]: [usize; 2]) -> [Node; 8] {
    let gbuffer = &atlas.gbuffer;
    // The two nodes before and after a place on an axis, and how far from one to the other it is.
    let around = |at: usize, size: usize| {
        let from = at >> grid.grid.log2 << grid.grid.log2;
        let to = (from + (1 << grid.grid.log2)).min(size - 1);
        ([from, to], if to > from { (at - from) as f64 / (to - from) as f64 } else { 0.0 })
    };
    let (columns, right) = around(x, grid.size[0]);
    let (rows, down) = around(y, grid.size[1]);
    let keys = [interval, grid.second_key(interval)].map(|key| grid.keys[key]);
    let length = grid.length(interval as isize);
    let passed = if length > 0 { f64::from(frame - keys[0]) / f64::from(length) } else { 0.0 };
    std::array::from_fn(|node| {
        let bits = [node & 1, node >> 1 & 1, node >> 2];
        let pixel = (keys[bits[2]] as usize * grid.size[1] + rows[bits[1]]) * grid.size[0] + columns[bits[0]];
        let weight = bits.iter().zip([right, down, passed]).map(|(&bit, share)| if bit == 1 { share } else { 1.0 - share }).product();
        Node { label: gbuffer.label[pixel], at: gbuffer.uv[pixel].map(f64::from), weight }
    })
}

/// The weighted mean position of the nodes that `take` lets in.
fn mean(nodes: &[Node; 8], take: impl Fn(&Node) -> bool) -> [f64; 2] {
    let taken = || nodes.iter().filter(|node| take(node));
    let total: f64 = taken().map(|node| node.weight).sum();
    [0, 1].map(|axis: usize| taken().map(|node| node.at[axis] * node.weight).sum::<f64>() / total)
}

/// Compares what `show` makes of the nodes around each pixel and the label its ray sees.
fn from_nodes(atlas: &Atlas, grid: &KeyGrid, show: impl Fn(&[Node; 8], u16) -> Shown) -> Score {
    let [width, height] = grid.size;
    compare(atlas, |frame| {
        let interval = (0..grid.intervals()).rev().find(|&interval| grid.keys[interval] <= frame).unwrap_or(0);
        let labels = &atlas.gbuffer.label[frame as usize * width * height..];
        let pixels = (0..width * height).map(|pixel| (pixel, [pixel % width, pixel / width]));
        pixels.map(|(pixel, at)| show(&nodes(atlas, grid, interval, frame, at), labels[pixel])).collect()
    })
}

/// As in 1998 (Hanson and Wernert): positions go straight from node to node and key to key, whatever surfaces those hit. A pixel counts as
/// wrong where the position is outside the chart of the surface that its ray sees.
#[must_use]
pub fn naive(atlas: &Atlas, grid: &KeyGrid) -> Score {
    from_nodes(atlas, grid, |nodes, label| {
        let at = mean(nodes, |_| true);
        (at, covers(&atlas.image, label, at))
    })
}

/// Each pixel takes the surface that the nearest of its eight nodes sees, and interpolates between those nodes that see it too.
#[must_use]
pub fn nearest(atlas: &Atlas, grid: &KeyGrid) -> Score {
    from_nodes(atlas, grid, |nodes, label| {
        // The nearest weighs most; of equally near ones the first.
        let near = nodes.iter().rev().max_by(|a, b| a.weight.total_cmp(&b.weight)).map_or(label, |node| node.label);
        (mean(nodes, |node| node.label == near), near == label)
    })
}

/// The right surface everywhere, at the position that the layers of the bundle `bytes` give it, the nearest to the ray's where the cell has
/// several sheets of it; at the ray's own where the cell has none.
///
/// # Errors
/// The bundle does not parse.
pub fn perfect(bytes: &[u8], atlas: &Atlas) -> Result<Score> {
    let bundle = Bundle::parse(bytes)?;
    let (charts, reference) = (charts(&bundle, atlas), Reference::new(&bundle));
    let gbuffer = &atlas.gbuffer;
    let size = gbuffer.width as usize * gbuffer.height as usize;
    Ok(compare(atlas, |frame| {
        let start = frame as usize * size;
        let rays = gbuffer.label[start..].iter().zip(&gbuffer.uv[start..]);
        let mut shown = Vec::with_capacity(size);
        for (sheets, (&label, exact)) in reference.candidates(frame, Weights::Player).into_iter().zip(rays) {
            let exact = exact.map(f64::from);
            let off = |at: &[f64; 2]| (at[0] - exact[0]).abs().max((at[1] - exact[1]).abs());
            let own = sheets.into_iter().filter(|&(sheet, _)| charts[usize::from(sheet)] == usize::from(label)).map(|(_, at)| at);
            shown.push((own.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(exact), true));
        }
        shown
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{figures, scenes};
    use cubist_baker::bake::{self, Settings};
    use cubist_baker::order::Coverage;

    #[test]
    fn better_partitions_play_better() {
        let scene = scenes::reduced("cone-orbit", [96, 72], 16).unwrap();
        let (flat, encoded) = scenes::bake(&scene, &Settings::default()).unwrap();
        let all = figures::quality(&encoded.bundle, &flat.atlas).unwrap();
        let perfect = perfect(&encoded.bundle, &flat.atlas).unwrap();
        let (naive, nearest) = (naive(&flat.atlas, &encoded.grid), nearest(&flat.atlas, &encoded.grid));
        assert!(perfect.psnr_mean >= all.psnr_mean, "{perfect:?} {all:?}");
        assert!(all.psnr_mean > nearest.psnr_mean + 1.0, "{all:?} {nearest:?}");
        assert!(nearest.psnr_mean > naive.psnr_mean, "{nearest:?} {naive:?}");
        assert_eq!(perfect.wrong_surface_percent, 0.0);
        assert!(all.wrong_surface_percent < nearest.wrong_surface_percent, "{all:?} {nearest:?}");
        assert!(nearest.wrong_surface_percent < 50.0 && naive.wrong_surface_percent > 0.0, "{naive:?} {nearest:?}");
        // One test alone does not tell better than the choice of all.
        for coverage in [Coverage::Chart, Coverage::Field] {
            let settings = Settings { coverage, ..Settings::default() };
            let alone = bake::encode(&scene, &flat, &settings, &|_, _| {}).unwrap();
            let alone = figures::quality(&alone.bundle, &flat.atlas).unwrap();
            assert!(alone.wrong_surface_percent > all.wrong_surface_percent, "{coverage:?} {alone:?} {all:?}");
        }
    }

    #[test]
    fn baselines_are_exact_where_every_pixel_has_a_node() {
        // One frame, and between the nodes nothing but a plane's interpolation: at the nodes themselves it is exact.
        let scene = scenes::reduced("pyramid", [33, 25], 1).unwrap();
        let (flat, encoded) = scenes::bake(&scene, &Settings::default()).unwrap();
        for (x, y) in [(0, 0), (8, 16), (32, 24), (24, 24)] {
            let nodes = nodes(&flat.atlas, &encoded.grid, 0, 0, [x, y]);
            let exact = flat.atlas.gbuffer.uv[y * 33 + x].map(f64::from);
            assert_eq!(mean(&nodes, |_| true), exact, "{x} {y}");
        }
    }
}
