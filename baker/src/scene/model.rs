//! What a model's loader hands over: triangles in world space and how they look; and the last checks on them.
//! Filled by the loaders of glTF, OBJ, PLY, STL and heightfields; goes to `alone` and `file`.

use super::error::Warnings;
use super::{Material, Texture, Triangle, Up};
use crate::camera::Animated;
use glam::DVec3;

/// More triangles than this are refused: they would not fit in the memory of an ordinary machine once traced.
pub(crate) const MAX_TRIANGLES: usize = 8_000_000;

/// A camera that a model brings.
pub(crate) struct ModelCamera {
    /// The names it answers to: its own and its node's.
    pub names: Vec<String>,
    /// Its path with the model's field of view, or why it has none.
    pub path: Result<Animated, String>,
}

/// A loaded model.
#[derive(Default)]
pub(crate) struct Model {
    pub triangles: Vec<Triangle>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub warnings: Warnings,
    pub cameras: Vec<ModelCamera>,
    /// Whether any vertex has a colour of its own.
    pub coloured: bool,
    /// Which axis pointed up in the file; the cameras are still as they were there.
    pub up: Up,
}

/// The centre and the radius of a sphere around all triangles: the middle of their bounding box, and the farthest corner.
pub(crate) fn bounding_sphere(triangles: &[Triangle]) -> (DVec3, f64) {
    let corners = || triangles.iter().flat_map(|t| t.position);
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let centre = if low.is_finite() && high.is_finite() { (low + high) / 2.0 } else { DVec3::ZERO };
    (centre, corners().map(|c| (c - centre).length_squared()).fold(0.0, f64::max).sqrt())
}

impl Model {
    /// The last checks, the same for every format: corners are numbers, triangles have area, something is left; triangles
    /// that their material hides altogether are dropped.
    pub(crate) fn finish(mut self) -> Result<Self, String> {
        if self.triangles.is_empty() {
            return Err("no triangles: nothing to show; expected at least one triangle".to_owned());
        }
        if self.triangles.len() > MAX_TRIANGLES {
            return Err(too_many(self.triangles.len()));
        }
        if let Some(i) = self.triangles.iter().position(|t| t.position.iter().any(|c| !c.is_finite() || c.abs().max_element() > 1e15)) {
            return Err(format!("triangle {i}: a corner is not a number or beyond 1e15: check transforms and scales"));
        }
        let before = self.triangles.len();
        self.triangles.retain(|t| !is_degenerate(&t.position));
        if self.triangles.is_empty() {
            return Err(format!("all {before} triangles are degenerate (no area): check the scale and the indices"));
        }
        if self.triangles.len() < before {
            self.warnings.add(format!("{} degenerate triangles (no area) left out", before - self.triangles.len()));
        }
        let invisible: Vec<bool> =
            self.materials.iter().map(|m| m.texture.is_none() && m.alpha_cutoff.is_some_and(|cutoff| m.alpha < cutoff)).collect();
        let before = self.triangles.len();
        self.triangles.retain(|t| !invisible.get(t.material as usize).copied().unwrap_or(false));
        if self.triangles.is_empty() {
            return Err(format!("all {before} triangles are transparent: raise the alpha of their materials"));
        }
        if self.triangles.len() < before {
            self.warnings.add(format!("{} triangles of transparent materials left out", before - self.triangles.len()));
        }
        for m in &mut self.materials {
            if m.texture.is_none() {
                m.alpha_cutoff = None;
            }
        }
        Ok(self)
    }

    /// Turns it such that its axis `up` points up.
    pub(crate) fn stand(mut self, up: Up) -> Self {
        if up != Up::Y {
            for t in &mut self.triangles {
                (t.position, t.normal) = (t.position.map(|v| up.turn(v)), t.normal.map(|v| up.turn_normal(v)));
            }
        }
        Self { up, ..self }
    }

    /// Whether more than three quarters of its surface would show nothing but its outline without light.
    pub(crate) fn mostly_plain(&self) -> bool {
        let textured = |t: &Triangle| self.materials.get(t.material as usize).is_some_and(|m| m.texture.is_some());
        let area = |of: &dyn Fn(&Triangle) -> bool| self.triangles.iter().filter(|t| of(t)).map(|t| area(&t.position)).sum::<f64>();
        !self.coloured && area(&textured) < area(&|_| true) / 4.0
    }

    /// The path of the camera called `name`.
    pub(crate) fn camera(&self, name: &str) -> Result<Animated, String> {
        if let Some(camera) = self.cameras.iter().find(|c| c.names.iter().any(|n| n == name)) {
            return camera.path.clone();
        }
        let names: Vec<String> = self.cameras.iter().filter_map(|c| c.names.first()).map(|n| format!("\"{n}\"")).collect();
        Err(match names.len() {
            0 => format!("the model has no camera \"{name}\": it has none at all; use orbit, line, spline or pivot"),
            _ => format!("the model has no camera \"{name}\"; it has {}", names.join(", ")),
        })
    }
}

/// The message for a model that is too large.
pub(crate) fn too_many(found: usize) -> String {
    format!("{found} triangles; at most {MAX_TRIANGLES} are taken: simplify the model")
}

/// Twice a triangle's area.
fn area(p: &[DVec3; 3]) -> f64 {
    (p[1] - p[0]).cross(p[2] - p[0]).length()
}

/// Whether a triangle's height is below a millionth of a millionth of its longest side: no ray can be said to hit it.
fn is_degenerate(p: &[DVec3; 3]) -> bool {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    let longest = a.length_squared().max(b.length_squared()).max((b - a).length_squared());
    area(p) <= 1e-12 * longest
}
