//! Which files are models, by what their names end in.
//! The programs and the loaders ask, and messages tell.

/// What the names of models end in.
pub const MODELS: [&str; 5] = ["glb", "gltf", "obj", "ply", "stl"];
/// How messages tell them.
pub(crate) const MODELS_TOLD: &str = ".glb, .gltf, .obj, .ply or .stl";
