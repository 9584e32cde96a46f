//! The built-in scenes, by name; they go to `load_builtin`.
use super::Scene;

/// The names of the built-in scenes.
pub const NAMES: &[&str] = &[];

/// The built-in scene `name`; `None` if there is none of that name.
pub fn build(_name: &str) -> Option<Scene> {
    None
}
