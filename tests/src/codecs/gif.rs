//! GIF as it can be had without ffmpeg: every frame whole, in its own 256 colours.
//! Frames come from `codecs`; bytes and the frames as decoded go back.

use super::clip::Shape;
use anyhow::{Context, Result};
use image::codecs::gif::{GifDecoder, GifEncoder};
use image::{AnimationDecoder, Frame, RgbaImage};
use std::io::Cursor;

/// Encodes and decodes the frames `rgb`; the bytes of the file, and R, G, B of what it shows.
pub fn round_trip(shape: Shape, rgb: &[u8]) -> Result<(u64, Vec<u8>)> {
    let mut file = Vec::new();
    let mut encoder = GifEncoder::new_with_speed(&mut file, 10);
    for frame in rgb.chunks_exact(shape.frame_bytes()) {
        let rgba: Vec<u8> = frame.as_chunks::<3>().0.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        let picture = RgbaImage::from_raw(shape.width, shape.height, rgba).context("a frame of another size than the clip's")?;
        encoder.encode_frame(Frame::new(picture)).context("encode a GIF")?;
    }
    drop(encoder);
    let mut decoded = Vec::with_capacity(rgb.len());
    for frame in GifDecoder::new(Cursor::new(&file)).context("decode a GIF")?.into_frames() {
        let picture = frame.context("decode a GIF")?.into_buffer();
        decoded.extend(picture.pixels().flat_map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2]]));
    }
    Ok((file.len() as u64, decoded))
}
