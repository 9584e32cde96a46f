//! The door: a path or a built-in name to a `Scene`, whatever the format.
//! Called by the programs; calls the loader the ending asks for.

use super::error::nearest;
use super::model::{Model, bounding_sphere};
use super::{Background, Light, Playback, Scene, SceneError, Up, builtin, file, gltf, obj, ply, stl};
use crate::camera::Orbit;
use glam::{DVec3, Vec3};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// What the command line says about the scene and its playback, over what the scene says.
#[derive(Clone, Copy, Debug, Default)]
pub struct Overrides {
    /// Screen width and height, pixels, 1..=4096 each.
    pub size: Option<(u32, u32)>,
    /// Number of frames, 1..=65535.
    pub frames: Option<u32>,
    /// Frames per second, 1..=1000.
    pub fps: Option<u16>,
    /// Whether frame 0 follows the last frame.
    pub looping: Option<bool>,
    /// The model's axis that points up.
    pub up: Option<Up>,
}

/// What the names of models end in,
pub const MODELS: [&str; 5] = ["glb", "gltf", "obj", "ply", "stl"];
/// and how messages tell them.
pub(crate) const MODELS_TOLD: &str = ".glb, .gltf, .obj, .ply or .stl";
/// The longest side of a screen, pixels.
pub(crate) const MAX_SCREEN: u32 = 4096;
/// The most frames.
pub(crate) const MAX_FRAMES: u32 = 65_535;
/// The most frames per second.
pub(crate) const MAX_FPS: u16 = 1000;
/// What a scene plays as unless it says otherwise.
pub(crate) const PLAYBACK: Playback = Playback { width: 320, height: 240, frames: 120, fps: 30, looping: false };
/// The vertical field of view unless the scene says otherwise, degrees.
pub(crate) const FOV: f64 = 45.0;
/// The background unless the scene says otherwise.
pub(crate) const BACKGROUND: [u8; 3] = [0x20, 0x28, 0x30];

impl Overrides {
    /// An error if they are about a model, which `what` has not.
    pub(crate) fn no_model(&self, what: &str) -> Result<(), SceneError> {
        let error = SceneError::Override { option: "--up", what: format!("{what} has no model to turn: remove it") };
        self.up.map_or(Ok(()), |_| Err(error))
    }

    /// The playback with the overrides applied; an override out of range is an error.
    pub(crate) fn apply(&self, mut playback: Playback) -> Result<Playback, SceneError> {
        let error = |option, what| Err(SceneError::Override { option, what });
        if let Some((width, height)) = self.size {
            if !(1..=MAX_SCREEN).contains(&width) || !(1..=MAX_SCREEN).contains(&height) {
                return error("--size", format!("found {width}x{height}; expected 1 to {MAX_SCREEN} pixels a side"));
            }
            (playback.width, playback.height) = (width, height);
        }
        if let Some(frames) = self.frames {
            if !(1..=MAX_FRAMES).contains(&frames) {
                return error("--frames", format!("found {frames}; expected 1 to {MAX_FRAMES}"));
            }
            playback.frames = frames;
        }
        if let Some(fps) = self.fps {
            if !(1..=MAX_FPS).contains(&fps) {
                return error("--fps", format!("found {fps}; expected 1 to {MAX_FPS}"));
            }
            playback.fps = fps;
        }
        playback.looping = self.looping.unwrap_or(playback.looping);
        Ok(playback)
    }
}

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

/// Builds the built-in scene `name`, one of [`builtin::NAMES`].
///
/// # Errors
/// An unknown name, or an override out of range.
pub fn load_builtin(name: &str, overrides: &Overrides) -> Result<Scene, SceneError> {
    overrides.no_model("a built-in scene")?;
    let mut scene = builtin::build(name).ok_or_else(|| SceneError::Builtin {
        name: name.to_owned(),
        near: nearest(name, builtin::NAMES.iter().copied()).map(str::to_owned),
        names: builtin::NAMES.join(", "),
    })?;
    scene.playback = overrides.apply(scene.playback)?;
    Ok(scene)
}

/// Makes a model of a file's bytes, of the folder that the files it names lie in, and of a texture for where it names none. Errors tell the place in the
/// file, and what to do.
type Loader = fn(Vec<u8>, &Path, Option<&Path>) -> Result<Model, String>;

/// Loads a model by its ending; `None`, unread, if it is no model's. `texture` is for a model whose file names none; `up` is Z in STL files unless given,
/// else Y.
pub(crate) fn model(path: &Path, texture: Option<&Path>, up: Option<Up>) -> Option<Result<Model, SceneError>> {
    let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
    let at_fault = |what| SceneError::Model { file: path.to_owned(), what };
    let loader: Loader = match ending.as_str() {
        "glb" | "gltf" => gltf::load,
        "obj" => obj::load,
        "ply" => ply::load,
        "stl" => stl::load,
        _ => return misnamed(&head(path)?, &ending).map(|what| Err(at_fault(what))),
    };
    let bytes = match crate::files::read(path) {
        Ok(bytes) => bytes,
        Err(what) => return Some(Err(SceneError::Read { file: path.to_owned(), what })),
    };
    if let Some(what) = misnamed(&bytes, &ending) {
        return Some(Err(at_fault(what)));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let up = up.unwrap_or(if ending == "stl" { Up::Z } else { Up::Y });
    let loaded = loader(bytes, folder, texture).and_then(Model::finish);
    Some(loaded.map(|model| model.stand(up)).map_err(at_fault))
}

/// The first bytes of a file, if it has as many: they tell binary glTF and PLY from all else.
fn head(path: &Path) -> Option<[u8; 4]> {
    let (mut file, _) = crate::files::open_to_read(path).ok()?;
    let mut bytes = [0; 4];
    file.read_exact(&mut bytes).ok()?;
    Some(bytes)
}

/// What is wrong with a model's name, if its first bytes are another format's.
fn misnamed(bytes: &[u8], ending: &str) -> Option<String> {
    let (kind, is) = match bytes {
        [b'g', b'l', b'T', b'F', ..] => ("a binary glTF", "glb"),
        [b'p', b'l', b'y', b'\n' | b'\r', ..] => ("a PLY", "ply"),
        _ => return None,
    };
    // The glTF loader tells its two kinds apart itself.
    (ending != is && (is, ending) != ("glb", "gltf")).then(|| format!("the name ends in .{ending}, and this is {kind}: rename it to .{is}"))
}

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

fn alone(path: &Path, overrides: &Overrides) -> Result<Scene, SceneError> {
    let Some(loaded) = model(path, None, overrides.up) else {
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
