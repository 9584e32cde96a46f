//! Packed pictures: the mask and the texels of a source image, coded, and back.
//! The core describes the stream (`cubist_core::pack`); `encode` puts the bytes into bundles, `inspect` and the search ask for them.

use super::range::Encoder;
use super::rgb565;
use crate::atlas::{SourceImage, Storage};
use cubist_core::Bundle;
use cubist_core::coder::{Bits, Decoder, Probability};
use cubist_core::format::{LABEL_BYTES, MASK, TexelKind};
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

/// The mask of an image, one bit a texel, least significant first; empty if no label asks for it.
pub(super) fn mask(image: &SourceImage) -> Vec<u8> {
    let masked = image.labels.iter().any(|label| label.masked);
    if masked { image.covered.chunks(8).map(bits).collect() } else { Vec::new() }
}

/// Eight flags in a byte, the first in the lowest bit.
fn bits(flags: &[bool]) -> u8 {
    flags.iter().enumerate().fold(0, |byte, (at, &flag)| byte | u8::from(flag) << at)
}

fn code<B: Bits>(bits: &mut B, kind: TexelKind, width_log2: u32, texels: &mut [u8], mask: &mut [u8]) {
    let (mut contexts, mut recent) = (vec![Probability::NEW; CONTEXTS], vec![[0; WAYS]; INDICES]);
    let mut rows = vec![0; pack::row_bytes(width_log2)];
    let scratch = Scratch { contexts: &mut contexts, recent: &mut recent, rows: &mut rows };
    let mut picture = Picture { width_log2, texels, mask };
    match kind {
        TexelKind::Indexed8 => pack::code(bits, scratch, &mut picture),
        TexelKind::Indexed4 => pack::code_nibbles(bits, scratch, &mut picture),
        TexelKind::Direct565 => pack::code_direct(bits, scratch, &mut picture),
    }
}

/// The coded mask and texels of `image`, as an `ATLS` section holds them packed.
#[must_use]
pub fn packed(image: &SourceImage) -> Vec<u8> {
    let (mut texels, mut mask, mut encoder) = (texels(image), mask(image), Encoder::default());
    code(&mut encoder, image.kind, image.width.trailing_zeros(), &mut texels, &mut mask);
    encoder.finish()
}

/// The texels and the mask of a bundle's source image, unpacked where it is packed: texels as a raw one has them, and one bit each, least
/// significant first; no mask if no label asks for one.
#[must_use]
pub fn unpacked(bundle: &Bundle<'_>) -> (Vec<u8>, Vec<u8>) {
    let mask_bytes = if bundle.masked() { bundle.texel_count() / 8 } else { 0 };
    let Some(packed) = bundle.packed() else {
        let mask = bundle.sections().find(|section| section.tag == MASK && mask_bytes > 0).map_or(&[][..], |section| section.bytes);
        return (bundle.atlas().texels.to_vec(), mask.to_vec());
    };
    let (mut texels, mut mask) = (vec![0; bundle.texel_kind().bytes(bundle.texel_count())], vec![0; mask_bytes]);
    code(&mut Decoder::new(packed), bundle.texel_kind(), bundle.atlas().width_log2.into(), &mut texels, &mut mask);
    (texels, mask)
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mask_of(covered: &[bool]) -> Vec<u8> {
        covered.chunks(8).map(bits).collect()
    }

    /// What `texels` and `mask` become packed; they have to come back the same, whatever the memory they come back to holds.
    fn there_and_back(width_log2: u32, texels: &[u8], mask: &[u8]) -> Vec<u8> {
        // The same bytes as texels of any kind.
        for kind in [TexelKind::Indexed4, TexelKind::Direct565] {
            there_and_back_as(kind, width_log2, texels, mask);
        }
        there_and_back_as(TexelKind::Indexed8, width_log2, texels, mask)
    }

    fn there_and_back_as(kind: TexelKind, width_log2: u32, texels: &[u8], mask: &[u8]) -> Vec<u8> {
        let mut encoder = Encoder::default();
        code(&mut encoder, kind, width_log2, &mut texels.to_vec(), &mut mask.to_vec());
        let bytes = encoder.finish();
        let (mut texels_back, mut mask_back) = (vec![0x5a; texels.len()], vec![0xc3; mask.len()]);
        code(&mut Decoder::new(&bytes), kind, width_log2, &mut texels_back, &mut mask_back);
        assert!(texels_back == texels && mask_back == mask, "what is unpacked is not what was packed");
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
                there_and_back(log2, &texels, &mask_of(&covered));
                there_and_back(log2, &texels[..4 << log2], &[]);
            }
        }
    }

    #[test]
    fn plain_pictures_become_small() {
        let (texels, covered) = disc(256, 1);
        let outline = there_and_back(8, &vec![0; texels.len()], &mask_of(&covered)).len();
        let whole = there_and_back(8, &texels, &mask_of(&covered)).len();
        // Less than a tenth of a bit a texel for the mask, half a bit for texels of a gradient.
        assert!(outline < texels.len() / 80 && whole < texels.len() / 16, "{outline} {whole}");
    }

    proptest! {
        #[test]
        fn noise_comes_back(log2 in 4u32..8, texels in prop::collection::vec(any::<u8>(), 1024), mask in prop::collection::vec(any::<u8>(), 128)) {
            there_and_back(log2, &texels, &mask);
            there_and_back(log2, &texels, &[]);
        }

        #[test]
        fn any_bytes_unpack(bytes in prop::collection::vec(any::<u8>(), 0..3000), log2 in 4u32..11) {
            for kind in [TexelKind::Indexed8, TexelKind::Indexed4, TexelKind::Direct565] {
                let (mut texels, mut mask) = (vec![0; 2048], vec![0; 256]);
                code(&mut Decoder::new(&bytes), kind, log2, &mut texels, &mut mask);
                let (mut again, mut mask_again) = (vec![0xff; 2048], vec![0xff; 256]);
                code(&mut Decoder::new(&bytes), kind, log2, &mut again, &mut mask_again);
                prop_assert!(texels == again && mask == mask_again, "what is unpacked depends on what the memory held");
            }
        }
    }
}
