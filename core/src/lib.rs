//! Plays Cubist bundles: animations of 3D scenes, with occlusion, on microcontrollers.
//!
//! One straight line, no way back:
//!
//! ```text
//! bytes -> Bundle -> keys in caller's memory -> time -> cell -> coverage -> span -> texel -> row of pixels
//! ```
//!
//! - [`Bundle::parse`] checks the bytes once; afterwards every accessor is total.
//! - [`Bundle::memory_needed`] says how much working memory playback takes, before it starts.
//! - [`Player::new`] takes that memory from the caller; [`Player::seek`] makes any frame the current one, decoding
//!   at most [`format::Limits::seek_keys`] keys; [`Player::row`] renders one row of it.
//!
//! A **key** holds, for every node of a sparse grid over the screen, what the camera ray through it
//! sees: one **layer** (label, u, v) for every surface seen in the cells around the node. Playback
//! interpolates layers in time between two keys, then, over a cell, in space; where a cell shows more than one
//! surface (it is *torn*), the frontmost **sheet** whose chart in the source image covers the
//! position shows. Then the texel is looked up. No triangles, no depth, no floats, no allocation; the
//! cost of a frame does not depend on the scene.
//!
//! The crate is `no_std`, without alloc, without floating point, without unsafe code; no input makes it panic.
//! A frame is a function of the bundle and the frame number alone.
#![no_std]
#![deny(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic
)]

mod atlas;
mod bundle;
mod cell;
pub mod coder;
mod coverage;
mod error;
mod field;
pub mod fixed;
pub mod format;
mod graphics;
pub mod grid;
pub mod key;
pub mod lists;
mod memory;
pub mod nodes;
mod player;
mod predict;
pub mod record;
mod span;
pub mod timeline;

pub use bundle::{Bundle, checksum};
pub use error::{BundleError, MemoryError};
pub use graphics::FrameImage;
pub use player::{ByteOrder, Frame, Player, Probe, Work};
