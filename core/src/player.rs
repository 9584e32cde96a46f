//! The player: new, seek, row, draw.
use crate::{Bundle, MemoryError};

/// A frame number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame(pub u32);

/// The order of the two bytes of a pixel in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ByteOrder {
    /// The number as the machine writes it.
    #[default]
    Native,
    /// Most significant byte first, as most SPI panels want it.
    BigEndian,
    /// Least significant byte first.
    LittleEndian,
}

/// Work done since the last `seek`, for figures and overlays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Work {
    /// Keys decoded by the last seek.
    pub keys: u32,
    /// Node layers interpolated in time.
    pub layers: u32,
    /// Pixels drawn in smooth cells.
    pub smooth_pixels: u32,
    /// Pixels drawn in torn cells.
    pub torn_pixels: u32,
    /// Coverage tests made for them.
    pub coverage_tests: u32,
}

/// Plays one bundle from memory the caller owns.
pub struct Player<'a> {
    bundle: &'a Bundle<'a>,
    _memory: &'a mut [u8],
}

impl<'a> Player<'a> {
    /// A player over `memory`, which must hold [`Bundle::memory_needed`] bytes.
    pub fn new(bundle: &'a Bundle<'a>, memory: &'a mut [u8]) -> Result<Self, MemoryError> {
        Ok(Self { bundle, _memory: memory })
    }
    /// The bundle that plays.
    pub fn bundle(&self) -> &'a Bundle<'a> {
        self.bundle
    }
    /// Pixels come in this byte order from now on.
    pub fn set_byte_order(&mut self, _order: ByteOrder) {}
    /// Makes `frame` the current frame; past the end it wraps on a looping bundle, else shows the last.
    pub fn seek(&mut self, _frame: Frame) {}
    /// The current frame.
    pub fn frame(&self) -> Frame {
        Frame(0)
    }
    /// Renders row `y` of the current frame as RGB565 into `out`; at most `out.len()` and the bundle's width pixels.
    pub fn row(&mut self, _y: u32, _out: &mut [u16]) {}
    /// Work done since the last `seek`.
    pub fn work(&self) -> Work {
        Work::default()
    }
    /// The current frame as an embedded-graphics `ImageDrawable`.
    pub fn image(&mut self) -> FrameImage<'_, 'a> {
        FrameImage { _player: self }
    }
}

/// The current frame as an embedded-graphics image.
pub struct FrameImage<'p, 'a> {
    _player: &'p mut Player<'a>,
}
