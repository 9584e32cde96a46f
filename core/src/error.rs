//! What can go wrong at the two doors: parsing a bundle, giving a player its memory.

/// Why bytes are not a bundle this player can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BundleError {
    /// The bytes do not start with a bundle envelope.
    NotABundle,
}

impl core::fmt::Display for BundleError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("not a bundle")
    }
}
impl core::error::Error for BundleError {}

/// Why a player cannot use the memory it was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryError {
    /// Fewer bytes than [`crate::Bundle::memory_needed`] says.
    TooSmall {
        /// Bytes needed.
        needed: usize,
        /// Bytes given.
        given: usize,
    },
}

impl core::fmt::Display for MemoryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("too small")
    }
}
impl core::error::Error for MemoryError {}
