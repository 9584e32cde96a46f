//! Pictures: files and embedded bytes to textures, bounded in size; box reduction.
//! Bytes come from the loaders; textures go to `Scene`.

use super::{Texture, Wrap};
use image::{DynamicImage, ImageReader, Limits};
use std::io::Cursor;

/// No side of a picture may be longer, texels.
pub(crate) const MAX_SIDE: u32 = 16_384;
/// No decoded picture may take more memory, bytes.
pub(crate) const MAX_BYTES: u64 = 512 << 20;
/// Decodes a PNG, JPEG or GIF (its first picture) within the size limits.
pub(crate) fn decode(bytes: &[u8]) -> Result<DynamicImage, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() {
        return Err("not a picture; expected PNG, JPEG or GIF: convert it".to_owned());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    reader.decode().map_err(|e| match e {
        image::ImageError::Limits(_) => {
            format!("the picture is too large: at most {MAX_SIDE} texels a side and {} MB decoded: make it smaller", MAX_BYTES >> 20)
        }
        image::ImageError::Unsupported(e) => format!("{e}; expected PNG, JPEG or GIF: convert it"),
        e => format!("the picture is broken ({e}): export it again"),
    })
}

/// Decodes a picture into an RGBA8 texture, top row first.
pub(crate) fn texture(bytes: &[u8], wrap: [Wrap; 2]) -> Result<Texture, String> {
    let rgba = decode(bytes)?.into_rgba8();
    let (width, height) = rgba.dimensions();
    if width == 0 || height == 0 {
        return Err("the picture has no texels".to_owned());
    }
    let (texels, _) = rgba.as_raw().as_chunks::<4>();
    Ok(Texture { width, height, texels: texels.to_vec(), wrap })
}

/// Reduces a texture by the smallest whole factor that brings both sides to at most `max_side`, each new texel the
/// mean of its box. `None`: it is small enough.
pub(crate) fn reduce(texture: &Texture, max_side: u32) -> Option<Texture> {
    let factor = texture.width.max(texture.height).div_ceil(max_side.max(1));
    if factor <= 1 {
        return None;
    }
    let (width, height) = (texture.width.div_ceil(factor), texture.height.div_ceil(factor));
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0u64; 4];
            let mut count = 0;
            for j in y * factor..((y + 1) * factor).min(texture.height) {
                let row = j as usize * texture.width as usize;
                for i in x * factor..((x + 1) * factor).min(texture.width) {
                    let t = texture.texels[row + i as usize];
                    count += 1;
                    for (s, c) in sum.iter_mut().zip(t) {
                        *s += u64::from(c);
                    }
                }
            }
            texels.push(sum.map(|s| ((s + count / 2) / count) as u8));
        }
    }
    Some(Texture { width, height, texels, wrap: texture.wrap })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reduction_averages_boxes() {
        let texels = (0..12).map(|i| [i * 10, 0, 0, 255]).collect();
        let small = reduce(&Texture { width: 4, height: 3, texels, wrap: [Wrap::Clamp; 2] }, 2).unwrap();
        assert_eq!((small.width, small.height), (2, 2));
        assert_eq!(small.texels, [[25, 0, 0, 255], [45, 0, 0, 255], [85, 0, 0, 255], [105, 0, 0, 255]]);
    }

    #[test]
    fn a_picture_bomb_is_an_error() {
        // A PNG header that promises 60000 x 60000 texels.
        let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
        png.extend([0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60, 8, 6, 0, 0, 0]);
        png.extend(crc(&png[12..29]).to_be_bytes());
        png.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e\0\0\0\0IEND\xae\x42\x60\x82");
        let e = decode(&png).unwrap_err();
        assert!(e.contains("too large"), "{e}");
    }

    fn crc(bytes: &[u8]) -> u32 {
        !bytes
            .iter()
            .fold(!0u32, |crc, b| (0..8).fold(crc ^ u32::from(*b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 }))
    }
}
