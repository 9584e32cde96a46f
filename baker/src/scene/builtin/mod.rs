//! The built-in scenes: geometry, textures and camera paths made by code, for tests, comparisons and the demo.
//! A scene file's `builtin = "name"` comes in, a [`Scene`] goes to the baker like one from any loader.
//!
//! | name | what it stands for |
//! |---|---|
//! | `cone-orbit`, `cone-translate` | an object with an infinite aspect graph, on an easy and on a hard path |
//! | `street` | buildings: many planes that hide each other; the demo |
//! | `terrain` | one sheet that hides itself, 131,072 triangles |
//! | `arch` | a loop: a wall with a hole |
//! | `torus` | a closed surface of genus one |
//! | `columns`, `round-columns` | occluders thinner than a cell |
//! | `pyramid` | an object with a finite aspect graph |
//! | `pivot` | a fixed focal point, whatever the depths |
//! | `wing` | data on a surface: a scalar field under a colour map |
//! | `mirrors` | mirrors as virtual geometry behind openings |
//!
//! Every scene brings its own flattening: one texture whose islands hold each surface point once.

mod arch;
mod builder;
mod columns;
mod cone;
mod mirrors;
mod noise;
mod pivot;
mod pyramid;
mod sky;
mod street;
mod terrain;
#[cfg(test)]
mod tests;
mod textures;
mod torus;
mod wing;

use super::Scene;
use super::error::{SceneError, nearest};
use super::overrides::Overrides;

/// The names that [`build`] knows.
pub const NAMES: &[&str] = &[
    "cone-orbit",
    "cone-translate",
    "street",
    "terrain",
    "arch",
    "torus",
    "columns",
    "round-columns",
    "pyramid",
    "pivot",
    "wing",
    "mirrors",
];

/// Builds the built-in scene `name`, with its camera path and playback (128 frames of 320 x 240, 30 a second);
/// `None`: no scene of that name.
pub fn build(name: &str) -> Option<Scene> {
    Some(match name {
        "cone-orbit" => cone::orbiting(),
        "cone-translate" => cone::translating(),
        "street" => street::build(),
        "terrain" => terrain::build(),
        "arch" => arch::build(),
        "torus" => torus::build(),
        "columns" => columns::square(),
        "round-columns" => columns::round(),
        "pyramid" => pyramid::build(),
        "pivot" => pivot::build(),
        "wing" => wing::build(),
        "mirrors" => mirrors::build(),
        _ => return None,
    })
}

/// Builds the built-in scene `name`, one of [`NAMES`], with `overrides` over its playback.
///
/// # Errors
/// An unknown name, or an override out of range.
pub fn load_builtin(name: &str, overrides: &Overrides) -> Result<Scene, SceneError> {
    overrides.no_model("a built-in scene")?;
    let mut scene = build(name).ok_or_else(|| SceneError::Builtin {
        name: name.to_owned(),
        near: nearest(name, NAMES.iter().copied()).map(str::to_owned),
        names: NAMES.join(", "),
    })?;
    scene.playback = overrides.apply(scene.playback)?;
    Ok(scene)
}
