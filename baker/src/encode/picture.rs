//! Packed pictures: the mask and the texels of a source image, coded, and back.
//! The core describes the stream (`cubist_core::pack`); `encode` puts the bytes into bundles, `inspect` and the search ask for them.

use super::range::Encoder;
use crate::atlas::{SourceImage, Storage, Tiled};
use cubist_core::Bundle;
use cubist_core::coder::{Bits, Decoder, Probability};
use cubist_core::format::{LABEL_BYTES, TexelKind};
use cubist_core::mask::{Block, Mask, Shape, Tile};
use cubist_core::pack::{self, CONTEXTS, INDICES, Picture, Scratch, WAYS};

/// The texels of an image as a bundle holds them raw.
pub(super) fn texels(image: &SourceImage) -> Vec<u8> {
    match image.kind {
        TexelKind::Indexed8 => image.texels.iter().map(|&texel| texel as u8).collect(),
        // Rows are of an even number of texels.
        TexelKind::Indexed4 => image.texels.as_chunks::<2>().0.iter().map(|&[low, high]| (low | high << 4) as u8).collect(),
        TexelKind::Direct565 => {
            let colours: Vec<u16> = image.palette.iter().map(|&colour| rgb565(colour)).collect();
            image.texels.iter().flat_map(|&texel| colours.get(usize::from(texel)).copied().unwrap_or(0).to_le_bytes()).collect()
        }
    }
}

/// The outline of an image as a bundle holds it; none if no label asks for it.
pub(super) fn tiled(image: &SourceImage) -> Option<Tiled> {
    let masked = image.labels.iter().any(|label| label.masked);
    image.outline.tiled(image.width).filter(|_| masked)
}

/// The same as bytes.
pub(super) fn mask(image: &SourceImage) -> Vec<u8> {
    tiled(image).map_or_else(Vec::new, |Tiled { tiles, blocks }| [tiles.into_flattened(), blocks.into_flattened()].concat())
}

fn code<B: Bits>(bits: &mut B, kind: TexelKind, mut picture: Picture<'_>) {
    let (mut contexts, mut recent) = (vec![Probability::NEW; CONTEXTS], vec![[0; WAYS]; INDICES]);
    let mut rows = vec![0; pack::row_bytes(picture.shape.width_log2)];
    let scratch = Scratch { contexts: &mut contexts, recent: &mut recent, rows: &mut rows };
    match kind {
        TexelKind::Indexed8 => pack::code(bits, scratch, &mut picture),
        TexelKind::Indexed4 => pack::code_nibbles(bits, scratch, &mut picture),
        TexelKind::Direct565 => pack::code_direct(bits, scratch, &mut picture),
    }
}

/// The coded mask and texels of `image`, as an `ATLS` section holds them packed.
#[must_use]
pub fn packed(image: &SourceImage) -> Vec<u8> {
    let Tiled { mut tiles, mut blocks } = tiled(image).unwrap_or_else(|| Tiled { tiles: Vec::new(), blocks: Vec::new() });
    let shape = Shape { width_log2: image.width.trailing_zeros(), height: image.height, finer: image.outline.finer };
    let (mut texels, mut encoder) = (texels(image), Encoder::default());
    code(&mut encoder, image.kind, Picture { shape, texels: &mut texels, tiles: &mut tiles, blocks: &mut blocks });
    encoder.finish()
}

/// A bundle's source image, unpacked where it is packed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unpacked {
    /// Texels as a raw one has them.
    pub texels: Vec<u8>,
    /// The mask's tiles and blocks; none if no label asks for one.
    pub tiles: Vec<Tile>,
    /// Likewise.
    pub blocks: Vec<Block>,
    /// Its size.
    pub shape: Shape,
}

impl Unpacked {
    /// Its bytes, raw.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.texels.len() + self.tiles.as_flattened().len() + self.blocks.as_flattened().len()
    }
}

/// The source image of a bundle, unpacked where it is packed.
#[must_use]
pub fn unpacked(bundle: &Bundle<'_>) -> Unpacked {
    let Mask { tiles, blocks, shape } = bundle.mask();
    let Some(packed) = bundle.packed() else {
        return Unpacked { texels: bundle.atlas().texels.to_vec(), tiles: tiles.to_vec(), blocks: blocks.to_vec(), shape };
    };
    let mut texels = vec![0; bundle.texel_kind().bytes(bundle.texel_count())];
    let mut tiles = vec![Tile::default(); bundle.mask_tiles()];
    let mut blocks = vec![Block::default(); bundle.mask_blocks()];
    let picture = Picture { shape, texels: &mut texels, tiles: &mut tiles, blocks: &mut blocks };
    code(&mut Decoder::new(packed), bundle.texel_kind(), picture);
    Unpacked { texels, tiles, blocks, shape }
}

/// Bytes of the texels and the mask of `image`, raw.
#[must_use]
pub fn raw_bytes(image: &SourceImage) -> usize {
    image.kind.bytes(image.texels.len()) + mask(image).len()
}

/// Bytes that `image` takes in a bundle: texels, palette, labels and mask.
#[must_use]
pub fn image_bytes(image: &SourceImage, storage: Storage) -> usize {
    let stored = match storage {
        Storage::Raw => raw_bytes(image),
        Storage::Packed => packed(image).len(),
    };
    let entries = image.palette.len().min(image.kind.colours());
    stored + 2 * entries + LABEL_BYTES * image.labels.len()
}

/// A colour in the display's 5, 6 and 5 bits.
#[must_use]
pub fn rgb565([r, g, b]: [u8; 3]) -> u16 {
    u16::from(r >> 3) << 11 | u16::from(g >> 2) << 5 | u16::from(b >> 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::Outline;
    use proptest::prelude::*;

    /// A picture 2^`width_log2` texels wide, as code takes it.
    fn picture<'p>(width_log2: u32, texels: &'p mut [u8], Tiled { tiles, blocks }: &'p mut Tiled, finer: u32) -> Picture<'p> {
        Picture { shape: Shape { width_log2, height: texels.len() as u32 >> width_log2, finer }, texels, tiles, blocks }
    }

    /// What `texels` and `outline` become packed; they have to come back the same, whatever the memory they come back to holds.
    fn there_and_back(width_log2: u32, texels: &[u8], outline: Option<&Outline>) -> Vec<u8> {
        // The same bytes as texels of any kind.
        for kind in [TexelKind::Indexed4, TexelKind::Direct565] {
            there_and_back_as(kind, width_log2, texels, outline);
        }
        there_and_back_as(TexelKind::Indexed8, width_log2, texels, outline)
    }

    fn there_and_back_as(kind: TexelKind, width_log2: u32, texels: &[u8], outline: Option<&Outline>) -> Vec<u8> {
        let finer = outline.map_or(0, |outline| outline.finer);
        let tiled = || {
            let none = || Tiled { tiles: Vec::new(), blocks: Vec::new() };
            outline.map_or_else(none, |outline| outline.tiled(1 << width_log2).expect("not as many blocks as that"))
        };
        let (mut encoder, mut own, mut wanted) = (Encoder::default(), texels.to_vec(), tiled());
        code(&mut encoder, kind, picture(width_log2, &mut own, &mut wanted, finer));
        let bytes = encoder.finish();
        let (mut texels_back, mut back) = (vec![0x5a; texels.len()], tiled());
        back.tiles.fill([0xc3; 2]);
        back.blocks.fill([0x3c; 8]);
        code(&mut Decoder::new(&bytes), kind, picture(width_log2, &mut texels_back, &mut back, finer));
        let wanted = tiled();
        assert!(
            texels_back == texels && back.tiles == wanted.tiles && back.blocks == wanted.blocks,
            "what is unpacked is not what was packed"
        );
        bytes
    }

    /// A round chart, with a gradient and some noise.
    fn disc(side: usize, noise: u8) -> (Vec<u8>, Vec<bool>) {
        let mut seed = 1u32;
        let mut random = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u8
        };
        let places = || (0..side * side).map(|i| (i % side, i / side));
        let inside = |(x, y): (usize, usize)| (2 * x).abs_diff(side).pow(2) + (2 * y).abs_diff(side).pow(2) < side * side;
        let texel = |place: (usize, usize)| {
            if inside(place) { ((70 * (place.0 + place.1) / side) as u8).wrapping_add(random() % noise) } else { 0 }
        };
        (places().map(texel).collect(), places().map(inside).collect())
    }

    #[test]
    fn pictures_of_all_sizes_come_back() {
        for log2 in [4, 6, 7, 8, 9, 10] {
            for noise in [1, 7, 100] {
                let (texels, covered) = disc(1 << log2, noise);
                there_and_back(log2, &texels, Some(&Outline { finer: 0, bits: covered.into() }));
                there_and_back(log2, &texels[..4 << log2], None);
            }
        }
    }

    #[test]
    fn plain_pictures_become_small() {
        let (texels, covered) = disc(256, 1);
        let disc_of = Outline { finer: 0, bits: covered.into() };
        let outline = there_and_back(8, &vec![0; texels.len()], Some(&disc_of)).len();
        let whole = there_and_back(8, &texels, Some(&disc_of)).len();
        // Less than a tenth of a bit a texel for the mask, half a bit for texels of a gradient.
        assert!(outline < texels.len() / 80 && whole < texels.len() / 16, "{outline} {whole}");
    }

    proptest! {
        #[test]
        fn noise_comes_back(
            log2 in 4u32..8,
            finer in 0u32..3,
            texels in prop::collection::vec(any::<u8>(), 1024),
            bits in prop::collection::vec(any::<bool>(), 16 << 10),
        ) {
            // Rows in which all is covered between those of noise.
            let row = 1 << (log2 + finer);
            let bits = bits.into_iter().take(1024 << (2 * finer)).enumerate().map(|(at, bit)| bit || at / row / 8 % 2 == 0).collect();
            there_and_back(log2, &texels, Some(&Outline { finer, bits }));
            there_and_back(log2, &texels, None);
        }

        #[test]
        fn any_bytes_unpack(bytes in prop::collection::vec(any::<u8>(), 0..3000), log2 in 4u32..11) {
            for kind in [TexelKind::Indexed8, TexelKind::Indexed4, TexelKind::Direct565] {
                let filled = |fill: u8| {
                    let shape = Shape { width_log2: log2, height: 2048 >> log2, finer: 1 };
                    let (mut texels, mut tiles, mut blocks) = (vec![fill; 2048], vec![[fill; 2]; shape.tiles()], vec![[fill; 8]; 5]);
                    code(&mut Decoder::new(&bytes), kind, Picture { shape, texels: &mut texels, tiles: &mut tiles, blocks: &mut blocks });
                    (texels, tiles, blocks)
                };
                prop_assert!(filled(0) == filled(0xff), "what is unpacked depends on what the memory held");
            }
        }
    }
}
