//! Clusters: the seen faces shared out among charts to be, how neighbours touch, and what a seam between them costs.
//! `merge` and `refine` share out; `absorb` takes away what is too small.

use super::observe::Faces;
use super::view::View;

/// What a pair of pixels costs that a seam runs between.
const SEAM: f64 = 0.1;

/// What is weighed against seams.
#[derive(Clone, Copy)]
pub(super) struct Weights {
    /// What a pixel costs whose chart is not flat.
    pub bent: f64,
    /// A crease bends the picture in full where both sides are seen at least this many pixels wide.
    pub wide: f64,
}

/// A partition of the seen faces.
pub(crate) struct Clusters {
    /// The cluster of each face.
    pub of: Vec<u32>,
    /// How each cluster is projected.
    pub views: Vec<View>,
}

/// How two neighbours touch.
#[derive(Clone, Copy, Default)]
pub(super) struct Border {
    /// Pairs of pixels.
    pairs: f64,
    /// The same, each counted by how sharp the crease is that it lies across: 1 at a right angle.
    folded: f64,
}

impl Border {
    pub fn add(&mut self, other: Self) {
        self.pairs += other.pairs;
        self.folded += other.folded;
    }

    /// The border of two faces that `pairs` pixels lie across.
    pub fn between(faces: &Faces, a: u32, b: u32, pairs: u32) -> Self {
        let fold = 1.0 - faces.list[a as usize].normal.dot(faces.list[b as usize].normal);
        Self { pairs: f64::from(pairs), folded: f64::from(pairs) * fold.min(1.0) }
    }

    /// What it saves not to have a seam here, if the smaller of both sides is seen by `hits` pixels. Across a crease positions bend, which
    /// no interpolation follows: a seam is no worse there, unless one side is thin.
    pub fn saved(&self, hits: f64, wide: f64) -> f64 {
        if self.pairs > 0.0 { SEAM * (self.pairs - self.folded * (hits / (wide * self.pairs)).min(1.0)) } else { 0.0 }
    }
}
