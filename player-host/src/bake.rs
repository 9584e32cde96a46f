//! The one place where the player calls the baker.
//! A scene comes in from `input`; bundle bytes and rows for the table go back.

use anyhow::{Result, bail};
use std::path::Path;

/// What to bake.
#[derive(Clone, Copy, Debug)]
pub enum Scene<'a> {
    /// A built-in scene by its name.
    Builtin(&'a str),
    /// A scene file or a model.
    File(&'a Path),
}

/// A bundle, and rows of name and value for the table.
pub type Baked = (Vec<u8>, Vec<(String, String)>);

/// Bakes `scene`; `progress` hears the stage by name and how much of everything is done, 0 to 1.
pub fn bake(scene: Scene<'_>, progress: &dyn Fn(&str, f32)) -> Result<Baked> {
    progress("bake", 0.0);
    match scene {
        Scene::Builtin(name) => bail!("built-in scene \"{name}\": baking is wired in later"),
        Scene::File(path) => bail!("{}: baking is wired in later", path.display()),
    }
}
