//! Views: the virtual cameras that charts may be projected by, along parallel rays or from a point.
//! `directions` makes them, `merge` and `refine` choose among them; a chart is flattened as its view sees it.

use super::charting::Projection;
use super::measure;
use super::observe::Face;
use glam::DVec3;

/// The least cosine between a point's ray and the middle of what a view from a point shows: 63 degrees.
const WIDEST: f64 = 0.45;

/// A virtual camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Unit vector towards the viewer: of every ray, or, from a point, of the one in the middle.
    pub back: DVec3,
    /// Where the rays meet; parallel without.
    pub eye: Option<DVec3>,
}

impl View {
    /// A view along parallel rays; `back` is a unit vector towards the viewer.
    pub const fn along(back: DVec3) -> Self {
        Self { back, eye: None }
    }

    /// Unit vector towards the viewer from `point`.
    pub fn towards(&self, point: DVec3) -> DVec3 {
        self.eye.map_or(self.back, |eye| (eye - point).normalize_or(self.back))
    }

    /// The flattening; `depth`: how far away flattened units are world units.
    pub fn projection(&self, depth: f64) -> Projection {
        let axes = measure::axes(self.back);
        self.eye.map_or(Projection::Plane(axes), |eye| Projection::Point(eye, axes, depth))
    }

    /// How much of a face shows: the cosine of the angle it is seen at, negative from behind; `None` where it is out of view.
    pub fn cosine(&self, face: &Face) -> Option<f64> {
        let Some(eye) = self.eye else { return Some(face.normal.dot(self.back)) };
        let ahead = |p: &DVec3| (eye - *p).dot(self.back) > WIDEST * eye.distance(*p);
        face.position.iter().all(ahead).then(|| face.normal.dot(self.towards(face.middle())))
    }
}
