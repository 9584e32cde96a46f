//! The same decoders on the host: what a player must show of an encoded picture. Pictures come from `make`, pixels go back to it.

use crate::screen::{PIXELS, WIDTH, cut};
use anyhow::{Context, Result, anyhow, ensure};
use image::AnimationDecoder;
use image::codecs::gif::GifDecoder;
use std::io::Cursor;
use tjpgdec_rs::{JpegDecoder, MemoryPool};
use zune_core::bytestream::ZCursor;

/// R, G, B of every frame of a GIF.
pub fn gif(file: &[u8]) -> Result<Vec<Vec<[u8; 3]>>> {
    let frames = GifDecoder::new(Cursor::new(file)).context("decode a GIF")?.into_frames();
    let picture = |frame: image::ImageResult<image::Frame>| -> Result<Vec<[u8; 3]>> {
        Ok(frame.context("decode a GIF")?.into_buffer().pixels().map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2]]).collect())
    };
    frames.map(picture).collect()
}

/// What tjpgdec-rs makes of a JPEG: the pixels in the order that they come in, and as they lie on the screen.
pub fn tjpgd(file: &[u8]) -> Result<[Vec<u16>; 2]> {
    // A word aligned as its tables want it.
    let mut memory = vec![0u64; 8 << 10];
    let mut pool = MemoryPool::new(bytemuck::cast_slice_mut(&mut memory));
    let mut decoder = JpegDecoder::new();
    let told = |error: tjpgdec_rs::Error| anyhow!("decode a JPEG: {}", error.as_str());
    decoder.prepare(file, &mut pool).map_err(told)?;
    let (mut coefficients, mut block) = (vec![0; decoder.mcu_buffer_size()], vec![0; decoder.work_buffer_size()]);
    ensure!(block.len() == 3 * 64, "a JPEG whose colours are not sampled 4:4:4, which the firmware has room for");
    let (mut stream, mut picture) = (Vec::with_capacity(PIXELS), vec![0; PIXELS]);
    let done = decoder.decompress(file, 0, &mut coefficients, &mut block, &mut |_, rgb, area| {
        let width = usize::from(area.width());
        for (i, &rgb) in rgb.as_chunks().0.iter().take(width * usize::from(area.height())).enumerate() {
            stream.push(cut(rgb));
            picture[(usize::from(area.top) + i / width) * WIDTH + usize::from(area.left) + i % width] = cut(rgb);
        }
        Ok(true)
    });
    done.map_err(told)?;
    Ok([stream, picture])
}

/// What zune-jpeg makes of a JPEG.
pub fn zune(file: &[u8]) -> Result<Vec<u16>> {
    let rgb = zune_jpeg::JpegDecoder::new(ZCursor::new(file)).decode().map_err(|error| anyhow!("decode a JPEG: {error:?}"))?;
    ensure!(rgb.len() == 3 * PIXELS, "a JPEG of {} bytes of R, G, B", rgb.len());
    Ok(rgb.as_chunks().0.iter().map(|&rgb| cut(rgb)).collect())
}
