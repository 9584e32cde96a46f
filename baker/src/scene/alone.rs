//! A model without a scene file, and what stands in for whatever a scene file leaves out.
//! The model comes from `loader`; the `Scene` goes to the baker.

use super::error::SceneError;
use super::loader;
use super::model::{Model, bounding_sphere};
use super::overrides::{Overrides, PLAYBACK};
use super::{Background, Light, Playback, Scene};
use crate::camera::Orbit;
use glam::{DVec3, Vec3};
use std::path::Path;
use std::sync::Arc;

/// The vertical field of view unless the scene says otherwise, degrees.
pub(crate) const FOV: f64 = 45.0;
/// The background unless the scene says otherwise.
pub(crate) const BACKGROUND: [u8; 3] = [0x20, 0x28, 0x30];

/// What a scene is called: its file's name without the ending.
pub(crate) fn name(path: &Path) -> String {
    path.file_stem().map_or_else(|| "scene".to_owned(), |s| s.to_string_lossy().into_owned())
}

/// The full circle around all of a model, at 20 degrees of elevation.
pub(crate) fn turntable(model: &Model, playback: &Playback, fov: f64, up: DVec3) -> Orbit {
    let (target, sphere) = bounding_sphere(&model.triangles);
    let aspect = f64::from(playback.width) / f64::from(playback.height);
    let half = fov.to_radians() / 2.0;
    // The narrower of the two fields decides: a sphere fits a cone of half angle a from radius / sin a away.
    let half = half.min(libm::atan(libm::tan(half) * aspect));
    Orbit { target, radius: sphere / libm::sin(half), azimuth: [0.0, 360.0], elevation: [20.0; 2], up, fov }
}

/// A scene of a model and nothing else: seen all round, lit where it needs it.
pub(crate) fn alone(path: &Path, overrides: &Overrides) -> Result<Scene, SceneError> {
    let Some(loaded) = loader::model(path, None, overrides.up) else {
        return Err(SceneError::Kind { file: path.to_owned(), found: "nothing".to_owned() });
    };
    let mut model = loaded?;
    let playback = overrides.apply(Playback { looping: true, ..PLAYBACK })?;
    let camera = Arc::new(turntable(&model, &playback, FOV, DVec3::Y));
    let mut lights = Vec::new();
    if model.mostly_plain() {
        lights.push(Light { direction: Vec3::new(-1.0, -2.0, -1.0).normalize(), colour: Vec3::ONE, intensity: 1.0 });
        let of_it = if model.textures.is_empty() { "the model" } else { "most of the model" };
        model
            .warnings
            .add(format!("{of_it} has neither textures nor vertex colours: one light along [-1, -2, -1] added so that its shape shows"));
    }
    Ok(Scene {
        name: name(path),
        triangles: model.triangles,
        materials: model.materials,
        textures: model.textures.into(),
        background: Background::Colour(BACKGROUND),
        lights,
        camera,
        playback,
        warnings: model.warnings.into_vec(),
    })
}
