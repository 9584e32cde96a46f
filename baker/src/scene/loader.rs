//! Models by their endings, each through the loader of its format.
//! Paths come from `file` and `alone`; models go back there.

use super::error::SceneError;
use super::model::Model;
use super::{Up, gltf, obj, ply, stl};
use std::io::Read;
use std::path::Path;

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
