//! glTF 2.0, .gltf and .glb: the only folder that names the `gltf` crate, and of it only the document's types.
//! Every index, offset and length is checked here before it is used, hence none of the crate's own readers.
//! Files come from `loader`; models go back there.

mod accessor;
mod buffers;
mod cameras;
mod document;
mod material;
mod mesh;
mod nodes;

use super::model::Model;
use accessor::Data;
use std::path::Path;

/// Loads a .gltf or .glb file from `folder`; `texture` serves a file whose materials name none.
pub(crate) fn load(bytes: Vec<u8>, folder: &Path, texture: Option<&Path>) -> Result<Model, String> {
    let mut model = Model::default();
    let shell = document::parse(&bytes, &mut model.warnings)?;
    drop(bytes);
    let buffers = buffers::Buffers::load(&shell.root, shell.blob, folder)?;
    let data = Data { root: &shell.root, buffers: &buffers };
    check_images(data, folder)?;
    let nodes = nodes::load(data, &mut model.warnings)?;
    let mappings = material::load(data, folder, texture, &mut model)?;
    mesh::load(data, &nodes, &mappings, &mut model)?;
    cameras::load(data, &nodes, &mut model)?;
    let moving = nodes.order.iter().any(|&n| !nodes.links[n].channels.is_empty() && shell.root.nodes[n].camera.is_none());
    if moving {
        model.warnings.add("animated nodes stand where their first keys put them; only a camera moves");
    }
    if shell.animated_cameras {
        model.warnings.add("the animation of a camera's lens is ignored: its field of view stays as it is");
    }
    Ok(model)
}

/// Files that images name must be there, used or not: a missing file is the likeliest fault of a moved model.
fn check_images(data: Data<'_>, folder: &Path) -> Result<(), String> {
    for (i, image) in data.root.images.iter().enumerate() {
        let Some(uri) = &image.uri else { continue };
        match buffers::locate(uri, folder).map_err(|e| format!("image {i}: {e}"))? {
            buffers::Location::File(path) if !path.is_file() => {
                return Err(format!("image {i}: {}: no such file: check the path", path.display()));
            }
            _ => {}
        }
    }
    Ok(())
}
