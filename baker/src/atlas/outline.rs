//! Outlines: what of the image belongs to a chart, in bits of a texel's size, or of a half or a quarter of it.
//! Places come from the packing, pixels from the G-buffer; the player's chart test asks it, and outlines thinner than a texel want finer bits than texels.

use super::grid::Grid;
use super::pack::Layout;
use crate::chart::Charting;
use crate::gbuffer::GBuffer;
use crate::scene::Scene;
use crate::shade::is_hole;
use cubist_core::format::MOST_BLOCKS;
use cubist_core::mask::{BLOCK_LOG2, Block, PLAIN, Tile};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// How far beyond an edge, as a barycentric weight, a bit's middle still is the face's.
const EDGE: f64 = 1e-9;

/// Which bits show a surface rather than continue one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outline {
    /// 2^this bits are as wide and as high as a texel: 0..=[`cubist_core::format::MOST_FINER`].
    pub finer: u32,
    /// Row by row.
    pub bits: Arc<[bool]>,
}

/// An outline as a bundle holds it: see [`cubist_core::mask`].
pub struct Tiled {
    /// Which block stands where, row by row.
    pub tiles: Vec<Tile>,
    /// The plain ones, then others in the order in which they first stand there.
    pub blocks: Vec<Block>,
}

impl Outline {
    /// Bits a texel in each direction.
    #[must_use]
    pub const fn bits_a_texel(&self) -> u32 {
        1 << self.finer
    }

    /// What a bundle makes of the outline of an image `width` texels wide; `None` if it is more than that can hold.
    #[must_use]
    pub fn tiled(&self, width: u32) -> Option<Tiled> {
        let (row, side) = ((width << self.finer) as usize, 1 << BLOCK_LOG2);
        let (mut tiles, mut blocks) = (Vec::new(), PLAIN.to_vec());
        let mut known: HashMap<Block, usize> = PLAIN.into_iter().zip(0..).collect();
        for rows in self.bits.chunks(row * side) {
            for left in (0..row).step_by(side) {
                let mut block = PLAIN[1];
                for (bits, line) in block.iter_mut().zip(rows.chunks(row)) {
                    *bits = line[left..left + side].iter().enumerate().fold(0, |byte, (at, &bit)| byte | u8::from(bit) << at);
                }
                let number = *known.entry(block).or_insert(blocks.len());
                if number == blocks.len() {
                    blocks.push(block);
                }
                tiles.push((number as u16).to_le_bytes());
            }
        }
        (blocks.len() <= MOST_BLOCKS as usize).then_some(Tiled { tiles, blocks })
    }
}

/// The outline with 2^`finer` bits a texel in each direction: those whose middle a face of a chart covers, or in texels that have none the ones that pixels
/// fall on; of `covered` texels alone, since others may be another chart's. `None` where a bundle cannot hold it.
pub(super) fn outline(
    scene: &Scene,
    charting: &Charting,
    layout: &Layout,
    gbuffer: &GBuffer,
    covered: &[bool],
    finer: u32,
) -> Option<Outline> {
    let row = (layout.width << finer) as usize;
    let drawn = |(chart, faces): (usize, &Vec<u32>)| {
        let place = layout.places[chart];
        let grid = Grid::new(charting, chart, place, 1 << finer);
        let [left, top] = [0, 1].map(|k| place.rect[k] << finer);
        let mut drawn = Vec::new();
        for &face in faces {
            let surface = charting.faces.list[face as usize].surface;
            grid.each_sample(charting, face as usize, EDGE, |x, y, shares| {
                if !is_hole(scene, surface / 2, charting.weights(face as usize, shares)) {
                    drawn.push((top + y) as usize * row + (left + x) as usize);
                }
            });
        }
        drawn
    };
    let drawn: Vec<Vec<usize>> = charting.members().par_iter().enumerate().map(drawn).collect();
    let mut bits = vec![false; covered.len() << (2 * finer)];
    drawn.into_iter().flatten().for_each(|bit| bits[bit] = true);
    // What is too thin for any bit's middle is where pixels fall on it.
    let texel = |bit: usize| ((bit / row) >> finer) * layout.width as usize + ((bit % row) >> finer);
    let mut drawn = vec![false; covered.len()];
    bits.iter().enumerate().filter(|(_, bit)| **bit).for_each(|(at, _)| drawn[texel(at)] = true);
    let scale = (1 << finer) as f32;
    for &[u, v] in gbuffer.uv.iter() {
        let bit = (v * scale) as usize * row + (u * scale) as usize;
        bits[bit] |= !drawn[texel(bit)];
    }
    let [x0, y0, x1, y1] = layout.backdrop.map(|texel| (texel << finer) as usize);
    (y0..y1).for_each(|y| bits[y * row + x0..y * row + x1].fill(true));
    bits.iter_mut().enumerate().for_each(|(at, bit)| *bit &= covered[texel(at)]);
    let outline = Outline { finer, bits: bits.into() };
    outline.tiled(layout.width).is_some().then_some(outline)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::{Settings, SourceImage, build};
    use crate::cast::Cast;
    use crate::gbuffer::BACKGROUND;
    use crate::scene::builtin;
    use cubist_core::fixed::PlayUv;
    use cubist_core::mask::{Mask, Shape};

    fn image(name: &str, outline: u32) -> (SourceImage, f64) {
        let mut scene = builtin::build(name).unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (128, 96, 9);
        let cast = Cast::new(&scene, &|_, _| {});
        let atlas = build(&scene, &cast.hits, &Settings { outline: Some(outline), ..Settings::default() }, &|_, _| {}).unwrap();
        let surface = cast.hits.samples.iter().zip(atlas.gbuffer.uv.iter()).filter(|(sample, _)| sample.surface != BACKGROUND);
        let outside = surface.clone().filter(|&(_, &uv)| !atlas.image.covered_at(uv)).count();
        (atlas.image, 100.0 * outside as f64 / surface.count() as f64)
    }

    #[test]
    fn what_pixels_see_is_inside_and_finer_outlines_are_closer() {
        for name in ["round-columns", "mirrors"] {
            let [whole, half, quarter] = [0, 1, 2].map(|finer| image(name, finer));
            let area = |image: &SourceImage| {
                let Outline { finer, bits } = &image.outline;
                bits.iter().filter(|&&bit| bit).count() as f64 / f64::from(1u32 << (2 * finer))
            };
            assert_eq!((whole.1, whole.0.outline.bits == whole.0.covered), (0.0, true), "{name}");
            // Pixels that fall between a face and the middle of a bit beside it.
            assert!(half.1 < 2.0 && quarter.1 < 1.0, "{name}: {} % and {} % outside", half.1, quarter.1);
            let areas = [&whole, &half, &quarter].map(|(image, _)| area(image));
            assert!(areas[1] < areas[0] && areas[2] < areas[0], "{name}: {areas:?} texels");
        }
    }

    #[test]
    fn players_find_the_bits_that_are_there() {
        for finer in [0, 1, 2] {
            let (image, _) = image("round-columns", finer);
            let Tiled { tiles, blocks } = image.outline.tiled(image.width).expect("not as many blocks as that");
            let shape = Shape { width_log2: image.width.trailing_zeros(), height: image.height, finer };
            assert!(tiles.len() == shape.tiles() && blocks.len() < tiles.len() && blocks[..2] == PLAIN);
            let mask = Mask { tiles: &tiles, blocks: &blocks, shape };
            let row = image.width << finer;
            for (at, &bit) in (0..).zip(image.outline.bits.iter()) {
                let [u, v] = [at % row, at / row].map(|k| ((2 * k + 1) << 15 >> finer) as i32);
                assert_eq!(mask.covers(PlayUv { u, v }), bit, "{at}");
            }
        }
    }

    #[test]
    fn outlines_of_too_many_blocks_are_none() {
        // A number in every block.
        let (width, blocks) = (4096usize, MOST_BLOCKS as usize);
        let bits = (0..width * 8 * blocks.div_ceil(width / 8)).map(|at| {
            let (x, y) = (at % width, at / width);
            let number = y / 8 * (width / 8) + x / 8;
            number >> (8 * (y % 8) + x % 8).min(63) & 1 == 1
        });
        let outline = Outline { finer: 2, bits: bits.collect() };
        assert!(outline.tiled(1024).is_none());
    }
}
