//! What the tests and the tables share: scenes made small, bundles played whole, the f64 player, figures and goldens.
//! Scenes come from the baker, bundles go through the core's player; the files beside `src` assert.

pub mod figures;
pub mod golden;
pub mod play;
pub mod reference;
pub mod scenes;

/// The README's code compiles.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
