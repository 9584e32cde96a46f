//! The outer shell of glTF: GLB chunks, the JSON, which extensions the file needs.
//! Bytes come from the file; the typed document goes to the other files of this folder, which check every index they use.

use crate::scene::error::Warnings;
use ::gltf::json::Root;
use serde_json::Value;

/// Extensions that a file may require: shown, or without influence on what is shown.
const TAKEN: &[&str] =
    &["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization", "KHR_materials_pbrSpecularGlossiness", "EXT_texture_webp"];
/// Extensions whose part of the look is dropped, with a warning.
const DROPPED: &[&str] = &[
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_clearcoat",
    "KHR_materials_sheen",
    "KHR_materials_iridescence",
    "KHR_materials_anisotropy",
    "KHR_materials_dispersion",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_variants",
    "KHR_lights_punctual",
    "KHR_animation_pointer",
    "KHR_node_visibility",
    "KHR_xmp_json_ld",
];
/// What a texture without a picture we read refers to: no image has this index.
pub(crate) const NO_IMAGE: u64 = u32::MAX as u64;

/// A parsed file.
pub(crate) struct Shell {
    pub root: Root,
    /// The GLB's binary chunk.
    pub blob: Option<Vec<u8>>,
    /// Whether a KHR_animation_pointer channel drives a camera.
    pub animated_cameras: bool,
}

/// Splits and parses the bytes of a .glb or a .gltf file; whichever it is shows in its first bytes.
pub(crate) fn parse(bytes: &[u8], warnings: &mut Warnings) -> Result<Shell, String> {
    if bytes.is_empty() {
        return Err("the file is empty".to_owned());
    }
    let (json, blob) = if bytes.starts_with(b"glTF") { split(bytes)? } else { (bytes, None) };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let mut value: Value = serde_json::from_slice(json).map_err(|e| format!("the JSON cannot be read: {e}: export the file again"))?;
    if !value.is_object() {
        return Err("the JSON is not an object; expected a glTF 2.0 document".to_owned());
    }
    check_version(&value)?;
    check_extensions(&value, warnings)?;
    let animated_cameras = drop_pointers(&mut value, warnings);
    for (i, texture) in array(&mut value, "textures").into_iter().flatten().enumerate() {
        if let Some(t) = texture.as_object_mut().filter(|t| !t.contains_key("source")) {
            let webp = t.get("extensions").and_then(|e| e.pointer("/EXT_texture_webp/source")).cloned();
            if webp.is_none() {
                warnings.add(format!("texture {i} has no PNG, JPEG or WebP picture: drawn without it"));
            }
            t.insert("source".to_owned(), webp.unwrap_or(Value::from(NO_IMAGE)));
        }
    }
    // Read from text: sixty types read from values would make a twelfth of this crate's code. The text is not the user's, nor is a place in it.
    let root = Root::from_str(&value.to_string()).map_err(|e| {
        let cause = e.to_string();
        format!("not a valid glTF 2.0 document: {}", cause.rsplit_once(" at line ").map_or(cause.as_str(), |(cause, _)| cause))
    })?;
    Ok(Shell { root, blob, animated_cameras })
}

/// The JSON and the binary chunk of a GLB.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<Vec<u8>>), String> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(format!("GLB header: {} bytes; expected 12: the file is cut short: fetch or export it again", bytes.len()));
    };
    if version != 2 {
        return Err(format!("GLB version {version}; expected 2: export as glTF 2.0"));
    }
    let length = length as usize;
    if length > bytes.len() {
        return Err(format!(
            "GLB header: length {length}, but the file has {} bytes: it is cut short: fetch or export it again",
            bytes.len()
        ));
    }
    let (mut at, mut json, mut blob) = (12, None, None);
    while at < length {
        let (Some(size), Some(kind)) = (word(at), bytes.get(at + 4..at + 8)) else {
            return Err(format!("GLB chunk at byte {at}: its header is cut short: fetch or export it again"));
        };
        let name = String::from_utf8_lossy(kind).trim_end_matches('\0').to_owned();
        let Some(data) = bytes.get(at + 8..).and_then(|rest| rest.get(..size as usize)).filter(|_| at + 8 + size as usize <= length) else {
            let left = length.saturating_sub(at + 8);
            return Err(format!(
                "GLB chunk \"{name}\" at byte {at}: length {size}, but {left} bytes are left: the file is cut short: fetch or export it again"
            ));
        };
        match kind {
            b"JSON" if json.is_none() => json = Some(data),
            _ if json.is_none() => return Err(format!("GLB: the first chunk is \"{name}\"; expected JSON: export the file again")),
            b"BIN\0" if blob.is_none() => blob = Some(data.to_vec()),
            // The standard wants unknown chunks ignored.
            _ => {}
        }
        at += 8 + size as usize;
    }
    json.map(|j| (j, blob)).ok_or_else(|| "GLB: no JSON chunk: the file is cut short: fetch or export it again".to_owned())
}

fn check_version(value: &Value) -> Result<(), String> {
    match value.get("asset").and_then(|a| a.get("version")).and_then(Value::as_str) {
        Some(v) if v.starts_with("2.") => Ok(()),
        Some(v) => Err(format!("asset.version: found \"{v}\"; expected \"2.0\": export as glTF 2.0")),
        None => Err("asset.version is missing; expected \"2.0\": this is not a glTF 2.0 file".to_owned()),
    }
}

fn check_extensions(value: &Value, warnings: &mut Warnings) -> Result<(), String> {
    let names = |key: &str| value.get(key).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
    let lacking: Vec<&str> = names("extensionsRequired").filter(|n| !TAKEN.contains(n) && !DROPPED.contains(n)).collect();
    if !lacking.is_empty() {
        let cure = if lacking.iter().any(|n| n.contains("compression")) { "export without compression" } else { "export without it" };
        return Err(format!("the file requires {}, which is not supported: {cure}", lacking.join(", ")));
    }
    for name in names("extensionsUsed").filter(|n| !TAKEN.contains(n)) {
        warnings.add(match name {
            "KHR_lights_punctual" => "the model's own lights are ignored (KHR_lights_punctual): use [[light]]".to_owned(),
            "KHR_materials_transmission" | "KHR_materials_volume" => format!("transmission is ignored ({name}): glass is opaque"),
            _ => format!("the extension {name} is ignored"),
        });
    }
    Ok(())
}

/// Takes out the animation channels that point elsewhere than at a node: the typed document has no words for them.
/// True if one of them drives a camera.
fn drop_pointers(value: &mut Value, warnings: &mut Warnings) -> bool {
    let mut cameras = false;
    for animation in array(value, "animations").into_iter().flatten() {
        let Some(channels) = array(animation, "channels") else { continue };
        channels.retain(|channel| {
            let target = channel.get("target");
            let path = target.and_then(|t| t.get("path")).and_then(Value::as_str);
            if path != Some("pointer") {
                // A channel without a node is to be ignored, says the standard.
                return target.is_none_or(|t| t.get("node").is_some());
            }
            let pointer =
                target.and_then(|t| t.pointer("/extensions/KHR_animation_pointer/pointer")).and_then(Value::as_str).unwrap_or("?");
            cameras |= pointer.starts_with("/cameras/");
            warnings.add(format!("the animation of {pointer} is ignored (KHR_animation_pointer): it keeps its value at rest"));
            false
        });
    }
    cameras
}

/// A member that should be an array; where it is something else, the typed document will name it.
fn array<'a>(value: &'a mut Value, key: &str) -> Option<&'a mut Vec<Value>> {
    value.get_mut(key)?.as_array_mut()
}
