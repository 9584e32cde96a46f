//! The sky as geometry: a part of a large sphere around the scene, with an island of its own.
//! Linear in azimuth and elevation, so that it behaves as if infinitely far; a scene says how much
//! of it its camera can see, and the triangles go to the `Builder`.

use super::builder::{Builder, Rect};
use super::textures::{self, Texel};
use glam::DVec3;

/// Largest angle a facet spans, radians: bends the mapping by less than a twentieth of a texel at the densities in use.
const FACET: f64 = 0.06;

/// How a sky hangs around a scene.
pub(super) struct Sky {
    /// Where its island is.
    pub rect: Rect,
    /// What the camera sees left and right of -Z, radians.
    pub azimuth: f64,
    /// Elevations of the island's top and bottom edges, radians.
    pub elevation: [f64; 2],
    /// Where the sphere's centre is: the middle of the camera path.
    pub centre: DVec3,
    /// The sphere's radius; the camera's travel must be small against it.
    pub radius: f64,
}

/// Elevations from which clouds are painted by default: a quarter of the picture lies below the horizon,
/// for what shows past the edge of the ground.
pub(super) const ELEVATION: [f64; 2] = [0.8, -0.8 / 3.0];

impl Sky {
    /// Paints the sky with clouds and adds it.
    pub(super) fn hang(self, builder: &mut Builder) {
        let (width, rows) = (f64::from(self.rect.w), f64::from(self.rect.h));
        // The clouds keep their angular size where a scene shows more or less of the sky below the horizon.
        let height = rows * (ELEVATION[0] - ELEVATION[1]) / (self.elevation[0] - self.elevation[1]);
        self.hang_painted(builder, |x, y| textures::sky(x, y, width, height));
    }

    /// Adds the sky with a picture of one's own.
    pub(super) fn hang_painted(self, builder: &mut Builder, paint: impl Fn(f64, f64) -> Texel) {
        let island = builder.island(self.rect, paint);
        let [top, bottom] = self.elevation;
        let facets = |angle: f64| (angle / FACET).ceil() as u32;
        builder.surface(island, facets(2.0 * self.azimuth), facets(top - bottom), |s, t| {
            let (sin, cos) = libm::sincos((2.0 * s - 1.0) * self.azimuth);
            let (up, out) = libm::sincos(top + (bottom - top) * t);
            self.centre + DVec3::new(out * sin, up, -out * cos) * self.radius
        });
    }
}
