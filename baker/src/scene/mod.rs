//! A scene in memory: world-space triangles, materials, textures, lights, a camera path, playback.
//! Every loader ends here; everything after it starts here.

mod alone;
pub mod builtin;
mod endings;
mod error;
mod file;
mod gltf;
mod heightfield;
mod keys;
mod load;
mod loader;
mod model;
mod mtl;
mod obj;
mod overrides;
mod picture;
mod ply;
mod polygon;
mod split;
mod stl;
mod turned;
mod up;

pub use builtin::load_builtin;
pub use endings::MODELS;
pub use error::SceneError;
pub use load::load;
pub use overrides::Overrides;
pub(crate) use split::split;
pub use turned::turned;
pub use up::Up;

use crate::camera::Path;
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

/// One triangle in world space.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Corners, world space.
    pub position: [DVec3; 3],
    /// Shading normals at the corners, unit length as loaded, straight between; all zero: use the face's own.
    pub normal: [Vec3; 3],
    /// Texture coordinates of the base colour texture, in texture widths and heights, v down from the top row.
    pub uv: [Vec2; 3],
    /// Vertex colours, display-referred, 0..=1; white where the model has none.
    pub colour: [Vec3; 3],
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// The island of the scene's own flattening that the triangle belongs to, if the scene brings one
    /// (built-in scenes do): `uv` is then continuous and injective within an island.
    pub island: Option<u16>,
}

/// How a surface looks.
#[derive(Clone, Debug)]
pub struct Material {
    /// Base colour factor, display-referred, 0..=1.
    pub colour: Vec3,
    /// Index into [`Scene::textures`].
    pub texture: Option<u32>,
    /// Only the counterclockwise side shows: rays pass through from behind.
    pub front: bool,
    /// Texels whose alpha is below this are holes that rays pass through; `None`: opaque.
    pub alpha_cutoff: Option<f32>,
    /// Alpha of the base colour factor: multiplies the texture's. That of vertices is ignored.
    pub alpha: f32,
    /// Shown as it is, whatever lights there are.
    pub unlit: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self { colour: Vec3::ONE, texture: None, front: false, alpha_cutoff: None, alpha: 1.0, unlit: false }
    }
}

/// How texture coordinates outside 0..1 are brought back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub enum Wrap {
    /// Repeat.
    #[default]
    Repeat,
    /// Repeat, every other copy mirrored.
    Mirror,
    /// The edge texel.
    Clamp,
}

/// A texture: RGBA8 rows, top row first.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Texels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` texels, R G B A.
    pub texels: Vec<[u8; 4]>,
    /// Wrap modes along u and v.
    pub wrap: [Wrap; 2],
}

/// What rays that hit nothing see; fixed to the screen.
#[derive(Clone, Debug)]
pub enum Background {
    /// One colour.
    Colour([u8; 3]),
    /// A picture stretched over the whole screen.
    Image(Texture),
}

/// A directional light.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Unit vector along which the light travels.
    pub direction: Vec3,
    /// Display-referred colour, 0..=1.
    pub colour: Vec3,
    /// Factor on the diffuse term.
    pub intensity: f32,
}

/// What the display shows and how fast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Playback {
    /// Screen width, pixels.
    pub width: u32,
    /// Screen height, pixels.
    pub height: u32,
    /// Number of frames.
    pub frames: u32,
    /// Frames per second.
    pub fps: u16,
    /// Whether frame 0 follows the last frame.
    pub looping: bool,
}

impl Playback {
    /// The path parameter of frame `frame`: f / (N - 1), on a looping path f / N.
    pub fn parameter(&self, frame: f64) -> f64 {
        let last = if self.looping { self.frames } else { self.frames.saturating_sub(1) };
        if last == 0 { 0.0 } else { frame / f64::from(last) }
    }
}

/// Everything the baker needs to know.
#[derive(Clone)]
pub struct Scene {
    /// What reports call it.
    pub name: String,
    /// All triangles, instances flattened.
    pub triangles: Vec<Triangle>,
    /// Materials; at least one.
    pub materials: Vec<Material>,
    /// Base colour textures.
    pub textures: Arc<[Texture]>,
    /// Behind everything.
    pub background: Background,
    /// No light: everything is unlit.
    pub lights: Vec<Light>,
    /// The camera path.
    pub camera: Arc<dyn Path>,
    /// The playback.
    pub playback: Playback,
    /// What the loader wants the user to know.
    pub warnings: Vec<String>,
}

impl std::fmt::Debug for Scene {
    /// Counts, not contents: a scene has millions of numbers.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("name", &self.name)
            .field("triangles", &self.triangles.len())
            .field("materials", &self.materials.len())
            .field("textures", &self.textures.len())
            .field("lights", &self.lights)
            .field("playback", &self.playback)
            .field("warnings", &self.warnings)
            .finish_non_exhaustive()
    }
}
