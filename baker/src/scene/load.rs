//! The door: a path to a `Scene`, whatever the format.
//! Called by the programs; calls `file` for scene files and `alone` for models.

use super::alone::alone;
use super::endings::MODELS;
use super::overrides::Overrides;
use super::{Scene, SceneError, file};
use std::path::Path;

/// Loads a scene file (.toml) or a model alone (.glb .gltf .obj .ply .stl). A model alone gets a full-circle, looping orbit
/// around its bounding sphere at 20 degrees of elevation, 320 x 240 pixels, 120 frames at 30 frames per second, and one
/// light if most of it has neither textures nor vertex colours.
///
/// # Errors
/// Anything wrong with the file or with what it names: see [`SceneError`].
pub fn load(path: &Path, overrides: &Overrides) -> Result<Scene, SceneError> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("toml") => file::load(path, overrides),
        Some(ending) if MODELS.contains(&ending) => alone(path, overrides),
        other => {
            // What is not there at all is told so first.
            crate::files::open_to_read(path).map_err(|what| SceneError::Read { file: path.to_owned(), what })?;
            let found = other.map_or_else(|| "nothing".to_owned(), |e| format!(".{e}"));
            Err(SceneError::Kind { file: path.to_owned(), found })
        }
    }
}
