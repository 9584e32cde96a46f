//! Plays a bundle and gives a checksum for every frame. The programs in `device`, `wasm` and `host` bring the bundle's bytes and memory, and
//! hand the checksums on; what lies between is this, the same sources for every target, so that other pixels are other arithmetic.
#![no_std]

use cubist_core::{AnyTexels, Bundle, BundleError, Frame, MemoryError, Player, checksum};

/// Room for a bundle, bytes: what those of the goldens need, and to spare.
pub const BUNDLE_ROOM: usize = 512 << 10;
/// Room for a player's working memory, bytes.
pub const MEMORY_ROOM: usize = 512 << 10;
/// Room for a frame, pixels.
pub const PICTURE_ROOM: usize = 320 * 240;

/// Why a bundle does not play.
#[derive(Debug)]
pub enum Trouble {
    /// The bytes are no bundle.
    Bundle(BundleError),
    /// The memory is too small.
    Memory(MemoryError),
    /// So many pixels has a frame, more than the picture given.
    Picture(usize),
}

impl core::fmt::Display for Trouble {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Bundle(error) => write!(out, "{error}"),
            Self::Memory(error) => write!(out, "{error}"),
            Self::Picture(pixels) => write!(out, "a frame has {pixels} pixels, there is room for {PICTURE_ROOM}; bake it smaller"),
        }
    }
}

/// Plays every frame of the bundle `bytes` from `memory`, and says its number and the CRC-32 of its pixels to `frame`: RGB565, little-endian,
/// row by row, as the goldens have it. `picture` is overwritten.
///
/// # Errors
/// The bytes are no bundle, or one that needs more memory or pixels.
pub fn play(bytes: &[u8], memory: &mut [u8], picture: &mut [u16], mut frame: impl FnMut(u32, u32)) -> Result<(), Trouble> {
    let bundle = Bundle::parse(bytes).map_err(Trouble::Bundle)?;
    let (width, height) = bundle.size();
    let pixels = width as usize * height as usize;
    let picture = picture.get_mut(..pixels).ok_or(Trouble::Picture(pixels))?;
    let mut player = Player::<AnyTexels>::with_texels(&bundle, memory).map_err(Trouble::Memory)?;
    for number in 0..bundle.frames() {
        player.seek(Frame(number));
        for (y, row) in (0..).zip(picture.chunks_exact_mut(width as usize)) {
            player.row(y, row);
            row.iter_mut().for_each(|pixel| *pixel = pixel.to_le());
        }
        frame(number, checksum(bytemuck::must_cast_slice(picture)));
    }
    Ok(())
}
