//! Plays Cubist bundles.
#![no_std]

mod error;
mod player;
mod bundle;

pub use bundle::Bundle;
pub use error::{BundleError, MemoryError};
pub use player::{ByteOrder, Frame, FrameImage, Player, Work};
