//! Flatness: whether faces lie in one plane. Playback tells positions on flat charts from the camera alone.
//! Faces come from `observe`; `merge` and `refine` ask.

use super::observe::Face;
use glam::DVec3;

/// Faces are in one plane if their normals differ by less than this, as a cosine: a quarter of a degree.
const PARALLEL: f64 = 0.99999;
/// ... and if they are off each other's plane by less than this, in parts of the smaller one's size.
const LEVEL: f64 = 0.003;

/// Something flat, and how far it reaches.
#[derive(Clone, Copy)]
pub(super) struct Flat {
    normal: DVec3,
    lo: DVec3,
    hi: DVec3,
}

impl Flat {
    pub fn new(face: &Face) -> Self {
        let [a, b, c] = face.position;
        Self { normal: face.normal, lo: a.min(b).min(c), hi: a.max(b).max(c) }
    }

    /// Both in one, if they lie in one plane.
    pub fn with(&self, other: &Self) -> Option<Self> {
        let joined = Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi), ..*self };
        let off = (0.5 * (other.lo + other.hi) - 0.5 * (self.lo + self.hi)).dot(self.normal).abs();
        let size = self.lo.distance(self.hi).min(other.lo.distance(other.hi));
        (self.normal.dot(other.normal) > PARALLEL && off < LEVEL * size).then_some(joined)
    }
}
