//! What the tests and the tables share: scenes made small, bundles played whole, the f64 player, figures and goldens; and the tables
//! themselves.
//! Scenes come from the baker, bundles go through the core's player; the files beside `src` assert.

pub mod codecs;
pub mod figures;
pub mod golden;
pub mod hard;
pub mod mutate;
pub mod partitions;
pub mod play;
pub mod random;
pub mod reference;
pub mod scenes;
pub mod survive;
pub mod synthetic;
pub mod tables;
pub mod tamper;

/// The README's code compiles.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
