//! Pictures: files and embedded bytes to textures, bounded in size; box reduction.
//! Bytes come from the loaders; textures go to `Scene`.

use super::{Texture, Wrap};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// No side of a picture may be longer, texels.
pub(crate) const MAX_SIDE: u32 = 16_384;
/// No decoded picture may take more memory, bytes.
pub(crate) const MAX_BYTES: u64 = 512 << 20;
/// No picture may have more texels: a file of a few kilobytes can hold as many as the sides allow, and each takes four bytes as it is, as
/// many for trials, and more for the means that it is reduced to.
const MAX_TEXELS: u64 = 1 << 26;
/// Nor all pictures of a scene together.
const MAX_IN_ALL: u64 = 2 * MAX_TEXELS;

/// Says that a picture is too large, and what is not.
fn too_large(texels: u64) -> String {
    format!(
        "the picture is too large: at most {MAX_SIDE} texels a side, {texels} in all and {} MB decoded: make it smaller",
        MAX_BYTES >> 20
    )
}

/// What is read.
const KINDS: &str = "PNG, JPEG, GIF, BMP, TGA, TIFF, DDS or WebP";

/// Whether this may be a TGA: the one kind that does not say what it is. Its header's first bytes have few values, which belong together.
fn is_tga(bytes: &[u8]) -> bool {
    let Some(&[_, map, kind, .., depth, order]) = bytes.first_chunk::<18>() else { return false };
    let colours = matches!(
        (map, kind & !8, depth),
        // With a colour map, without one, and grey; 8 more where runs are coded.
        (1, 1, 8) | (0, 2, 15 | 16 | 24 | 32) | (0 | 1, 3, 8 | 16)
    );
    colours && order & 0xc0 == 0
}

/// A reader of a picture.
fn open(bytes: &[u8]) -> Result<ImageReader<Cursor<&[u8]>>, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() && is_tga(bytes) {
        reader.set_format(ImageFormat::Tga);
    }
    match reader.format() {
        Some(_) => Ok(reader),
        None => Err(format!("not a picture; expected {KINDS}: convert it")),
    }
}

/// What the decoder says, and what to do.
fn broken(error: image::ImageError, texels: u64) -> String {
    match error {
        image::ImageError::Limits(_) => too_large(texels),
        image::ImageError::Unsupported(e) => format!("{e}; expected {KINDS}: convert it"),
        e => format!("the picture is broken ({e}): export it again"),
    }
}

/// Whether a JPEG's last scan is followed by the marker of its end. Neither marker can stand in a scan's data; those of a preview come before it.
fn ends(bytes: &[u8]) -> bool {
    let marker = |kind: u8| move |at: &[u8]| at == [0xff, kind];
    let scan = bytes.windows(2).rposition(marker(0xda)).and_then(|at| bytes.get(at..));
    scan.is_none_or(|scan| scan.windows(2).any(marker(0xd9)))
}

/// Decodes a picture (the first, if there are several) of at most `texels` texels, within the limits of sides and bytes.
pub(crate) fn decode(bytes: &[u8], texels: u64) -> Result<DynamicImage, String> {
    // As it says of itself, before room is made for it.
    let (width, height) = open(bytes)?.into_dimensions().map_err(|e| broken(e, texels))?;
    if u64::from(width) * u64::from(height) > texels {
        return Err(too_large(texels));
    }
    let mut reader = open(bytes)?;
    // The decoder fills with grey what a JPEG that was cut short lacks.
    if reader.format() == Some(ImageFormat::Jpeg) && !ends(bytes) {
        return Err("the picture is broken (the file ends early): export it again".to_owned());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    reader.decode().map_err(|e| broken(e, texels))
}

/// Decodes a picture into an RGBA8 texture, top row first; `beside` are those that the scene has already.
pub(crate) fn texture(bytes: &[u8], wrap: [Wrap; 2], beside: &[Texture]) -> Result<Texture, String> {
    let there: u64 = beside.iter().map(|texture| texture.texels.len() as u64).sum();
    let (width, height) = open(bytes)?.into_dimensions().map_err(|e| broken(e, MAX_TEXELS))?;
    if there + (u64::from(width) * u64::from(height)).min(MAX_TEXELS) > MAX_IN_ALL {
        return Err(format!("all pictures together have more than {MAX_IN_ALL} texels: make them smaller"));
    }
    let rgba = decode(bytes, MAX_TEXELS)?.into_rgba8();
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
    fn every_kind_is_known_by_its_bytes() {
        let picture = DynamicImage::ImageRgba8(image::RgbaImage::from_fn(8, 4, |x, y| image::Rgba([x as u8 * 30, y as u8 * 60, 7, 255])));
        let read = |kind: ImageFormat, picture: &DynamicImage| {
            let mut bytes = Cursor::new(Vec::new());
            picture.write_to(&mut bytes, kind).unwrap();
            texture(bytes.get_ref(), [Wrap::Clamp; 2], &[])
                .map(|texture| ((texture.width, texture.height), texture.texels, bytes.into_inner()))
        };
        let (size, texels, _) = read(ImageFormat::Png, &picture).unwrap();
        let opaque = picture.to_rgb8().into();
        for kind in [ImageFormat::Bmp, ImageFormat::Tga, ImageFormat::Tiff, ImageFormat::WebP] {
            let (same_size, same_texels, bytes) = read(kind, &opaque).unwrap();
            assert_eq!((same_size, same_texels), (size, texels.clone()), "{kind:?}");
            let short = texture(&bytes[..bytes.len() / 2], [Wrap::Clamp; 2], &[]);
            assert!(short.unwrap_err().contains("broken"), "{kind:?}");
        }
        let (_, grey, _) = read(ImageFormat::Tga, &picture.grayscale()).unwrap();
        assert!(grey.iter().all(|&[r, g, b, _]| r == g && g == b));
        let text = texture(b"v 1 2 3 and other lines of text", [Wrap::Clamp; 2], &[]);
        assert!(text.unwrap_err().contains("not a picture; expected PNG, JPEG, GIF, BMP, TGA, TIFF, DDS or WebP"));
    }

    /// A DDS of one block of 4 x 4 texels, red above blue (DXT1).
    fn dds() -> Vec<u8> {
        const FLAGS: u32 = 0x1007;
        let mut header = [0u32; 32];
        header[0] = u32::from_le_bytes(*b"DDS ");
        (header[1], header[2], header[3], header[4]) = (124, FLAGS, 4, 4);
        (header[19], header[20], header[21]) = (32, 4, u32::from_le_bytes(*b"DXT1"));
        let block = [0xf800_u16.to_le_bytes(), 0x001f_u16.to_le_bytes(), [0, 0], [0x55, 0x55]];
        header.iter().flat_map(|word| word.to_le_bytes()).chain(block.into_iter().flatten()).collect()
    }

    #[test]
    fn blocks_of_texels_are_read() {
        let read = texture(&dds(), [Wrap::Clamp; 2], &[]).unwrap();
        assert_eq!((read.width, read.height, read.texels[0], read.texels[15]), (4, 4, [255, 0, 0, 255], [0, 0, 255, 255]));
    }

    #[test]
    fn damaged_pictures_are_errors_or_show_something() {
        let picture = DynamicImage::ImageRgb8(image::RgbImage::from_fn(9, 5, |x, y| image::Rgb([x as u8 / 3 * 90, y as u8 * 50, 7])));
        let written = |kind: ImageFormat| {
            let mut whole = Cursor::new(Vec::new());
            picture.write_to(&mut whole, kind).unwrap();
            (whole.into_inner(), kind)
        };
        let kinds = [
            ImageFormat::Png,
            ImageFormat::Jpeg,
            ImageFormat::Gif,
            ImageFormat::Bmp,
            ImageFormat::Tga,
            ImageFormat::Tiff,
            ImageFormat::WebP,
        ];
        for (whole, kind) in kinds.into_iter().map(written).chain([(dds(), ImageFormat::Dds)]) {
            let mut refused = 0;
            for at in 0..whole.len() {
                refused += u32::from(decode(&whole[..at], 1 << 12).is_err());
                for value in [0, 1, 0x7f, 0x80, 0xff, !whole[at]] {
                    let mut damaged = whole.clone();
                    damaged[at] = value;
                    refused += u32::from(decode(&damaged, 1 << 12).is_err());
                }
            }
            assert!(refused > 0, "{kind:?}");
        }
    }

    #[test]
    fn a_jpeg_that_was_cut_short_is_refused() {
        let mut bytes = Cursor::new(Vec::new());
        let noise = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([((x * 37) ^ (y * 91)) as u8, (x * y) as u8, (x + y) as u8]));
        noise.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
        let bytes = bytes.into_inner();
        assert!(decode(&bytes, MAX_TEXELS).is_ok());
        for part in [bytes.len() - 1, bytes.len() / 2] {
            let error = decode(&bytes[..part], MAX_TEXELS).unwrap_err();
            assert!(error.contains("broken"), "{part} of {}: {error}", bytes.len());
        }
    }

    #[test]
    fn pictures_fill_up_what_there_is_for_all() {
        let mut png = Cursor::new(Vec::new());
        DynamicImage::new_luma8(4, 2).write_to(&mut png, image::ImageFormat::Png).unwrap();
        let png = png.into_inner();
        assert_eq!(texture(&png, [Wrap::Clamp; 2], &[]).unwrap().texels, [[0, 0, 0, 255]; 8]);
        let large = Texture { width: 1, height: 1, texels: vec![[0; 4]; MAX_IN_ALL as usize - 8], wrap: [Wrap::Clamp; 2] };
        assert!(texture(&png, [Wrap::Clamp; 2], std::slice::from_ref(&large)).is_ok());
        let e = texture(&png, [Wrap::Clamp; 2], &[large, texture(&png, [Wrap::Clamp; 2], &[]).unwrap()]).unwrap_err();
        assert!(e.contains("all pictures together"), "{e}");
    }

    #[test]
    fn a_picture_bomb_is_an_error() {
        // A PNG header that promises 60000 x 60000 texels.
        let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
        png.extend([0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60, 8, 6, 0, 0, 0]);
        png.extend(cubist_core::checksum(&png[12..29]).to_be_bytes());
        png.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e\0\0\0\0IEND\xae\x42\x60\x82");
        let e = decode(&png, MAX_TEXELS).unwrap_err();
        assert!(e.contains("too large"), "{e}");
    }
}
