//! Plays Cubist bundles: animations of 3D scenes, with occlusion, on microcontrollers.
//!
//! One straight line, no way back:
//!
//! ```text
//! bytes -> Bundle -> keys in caller's memory -> time -> space -> coverage -> span -> texel -> row of pixels
//! ```
//!
//! - [`Bundle::parse`] checks the bytes once; afterwards every accessor is total.
//! - [`Bundle::memory_needed`] says how much working memory playback takes, before it starts.
//! - [`Player::new`] takes that memory from the caller; [`Player::seek`] makes any frame the current one, decoding
//!   at most [`format::Limits::seek_keys`] keys, and from frame to frame a part of one; [`Player::row`] renders one row of it.
//!
//! ```
//! use cubist_core::{Bundle, Frame, MemoryError, Player};
//!
//! fn play(bundle: &Bundle<'_>, memory: &mut [u8], line: &mut [u16]) -> Result<(), MemoryError> {
//!     let mut player = Player::new(bundle, memory)?;
//!     for frame in 0..bundle.frames() {
//!         player.seek(Frame(frame));
//!         for y in 0..bundle.size().1 {
//!             player.row(y, line);
//!             // ... and off to the display with it.
//!         }
//!     }
//!     Ok(())
//! }
//! ```
//!
//! A firmware wants no more than [`Bundle`], [`Player`], [`Frame`], [`ByteOrder`], a kind of [`Texels`] and the two errors. The modules, [`Window`] and
//! [`checksum`] are for those who write bundles.
//!
//! # What is stored
//!
//! One **source image** has every surface that the camera ever sees, each part once, in flat **charts**. A chart's number is
//! its **label**. What remains of the scene is where in that image each pixel of each frame looks.
//!
//! That is known at the **nodes** of a sparse grid over the screen, at the corners of **cells** of 4 to 32 pixels, and at sparse
//! frames, the **keys** ([`key`]). At a key a node carries one **layer** (a label and a position u, v in texels) for every surface
//! seen in the cells around it, also for those that its own ray does not hit: such a *ghost* is where its surface would be if it
//! went on. For the interval between two keys, every cell lists its **sheets**: the labels seen in it, front to back
//! ([`lists`]). A cell with one sheet is *smooth*; one with more is *torn*: outlines run through it.
//!
//! # How a pixel comes about
//!
//! 1. **Time** ([`timeline`]). Every layer of the rows of nodes around a row of cells is interpolated between the
//!    interval's two keys: held, straight, or along a Catmull-Rom curve that takes the key before and the one after into account
//!    where these carry the layer too.
//! 2. **Space.** Where space is *linear*, each sheet's position is bilinear between its cell's four corners. Where it is *cubic*, it bends
//!    between them besides, evenly across and evenly down: by the mean second differences of positions at the corners, told from the nodes
//!    around as far as these carry the layer (the four-point rule: Dyn, Levin, Gregory 1987). Nearly as good as cells half as large, at no bytes. Where
//!    a colour is looked up it goes straight to the middle of a tile of at most 8 by 8 pixels and straight on from there, about as far on one side of
//!    the curve as on the other: one addition a pixel.
//! 3. **Coverage.** In a torn cell the frontmost sheet that covers a pixel shows; the last covers whatever is left. A sheet covers
//!    a pixel by one of three tests, which its list names. The *chart* test: its position lies inside its label's rectangle, and in
//!    the mask if the chart does not fill that. The *field* test, for outlines that no chart has, such as a cone's silhouette: a
//!    **field**, the signed distance on the screen from the outline, is above zero; layers carry it, and it is interpolated like a
//!    position, in time always straight. Or both. What is so thin that both its sides pass through one cell is a **strip**: its
//!    layers carry two fields, the distances from either side, and both have to be above zero.
//! 4. **Colour.** One texel, and where it is an index, one palette entry.
//!
//! No triangles, no depth, and no division for a pixel: perspective is in the keys. What a frame costs follows from the screen and the
//! bundle's [`format::Limits`], not from how many triangles the scene had.
//!
//! # How keys are read
//!
//! A key's **record** ([`record`]) is told from the one or two keys before it ([`coder`], [`nodes`]), and from where its camera sees the
//! planes that flat labels lie in ([`plane`]). An *independent* key is told from no other; decoding starts there. Decoded keys live in a ring in the caller's memory: those that the interval needs (for
//! cubic time the one before it, its two ends and the one after, else its two ends), and the next one, which is decoded while the
//! interval plays: every frame does its share of it, some **slices**, so that none pays for a whole key. In a key, and in a row of nodes that is
//! interpolated, layers of one label at neighbouring nodes are a **chain** ([`key::Chain`]) and stand side by side: what is the same for all of
//! them is looked up once. The sheet lists of the
//! intervals that start at them are in another ring. In playback the next key is complete when it is needed, and the one after it takes
//! the place of the oldest. A seek to any other place decodes from the last independent key before it, unless going on from where
//! the ring stands takes fewer keys. On a looping path the first key follows the last, so that the ring simply goes on.
//!
//! The source image's texels are read where the bundle lies, in flash, or, where the bundle holds them packed ([`pack`]), from the
//! caller's memory, where [`Player::new`] unpacks them. A texel is an index of a palette, of eight bits or four, or a colour
//! ([`format::TexelKind`]); a player's type names those that it plays ([`Texels`]), and a firmware links the code of no others.
//!
//! # What holds
//!
//! The crate is `no_std`, without alloc, without floating point, without unsafe code; no input makes it panic. A frame is a
//! function of the bundle and the frame number alone, whatever was shown before. The bytes are described in FORMAT.md.
//! The same description of records and packed pictures serves the baker's encoder, which is why [`coder`], [`lists`], [`nodes`],
//! [`record`] and [`pack`] are public.
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
mod bounds;
mod bundle;
pub mod coder;
mod colours;
mod coverage;
mod draw;
mod error;
mod field;
mod filter;
pub mod fixed;
mod form;
pub mod format;
mod graphics;
pub mod grid;
pub mod key;
pub mod lists;
pub mod mask;
mod memory;
pub mod nodes;
pub mod pack;
mod patch;
mod plan;
pub mod plane;
mod player;
mod playing;
mod predict;
pub mod record;
mod row;
mod sheet;
mod site;
mod span;
mod texels;
pub mod timeline;
mod torn;
mod window;
mod work;

pub use bundle::{Bundle, checksum};
pub use error::{BundleError, MemoryError};
pub use graphics::{DrawRow, FrameImage};
pub use player::Player;
pub use playing::{ByteOrder, Frame};
pub use texels::{AnyTexels, Direct565, Indexed4, Indexed8, Spread8, Texels};
pub use window::Window;
pub use work::{Probe, Work};
