//! Bakes scenes into Cubist bundles: one straight line from a scene file to bytes.
//!
//! ```text
//! scene file -> Scene -> G-buffer -> charts, source image -> sheets -> fitted layers -> coded keys -> bytes
//! ```
mod around;
pub mod atlas;
pub mod bake;
mod baked;
pub mod bends;
mod brinks;
mod budget;
pub mod camera;
pub mod cast;
pub mod causes;
pub mod chart;
pub mod choose;
mod climb;
mod cuts;
mod element;
pub mod encode;
mod fewer;
pub mod fields;
pub mod files;
mod finer;
pub mod fit;
pub mod folds;
pub mod gbuffer;
pub mod halves;
pub mod inspect;
pub mod job;
mod joins;
mod kinks;
mod made;
pub mod metrics;
pub mod options;
pub mod order;
pub mod outlines;
pub mod patch;
pub mod planes;
pub mod polish;
mod prune;
mod quality;
pub mod ram;
pub mod repaint;
pub mod report;
mod samples;
pub mod scene;
mod seen;
pub mod settle;
pub mod shade;
pub mod sheets;
mod spare;
pub mod straight;
pub mod tears;
pub mod terminal;
pub mod throughput;
pub mod timing;
pub mod trace;
pub mod truth;
pub mod tune;
mod usual;
pub mod verify;
mod walls;

pub use job::bake_scene;
pub use options::{Goal, Options, TruthFrames};
pub use report::Report;
