//! STL, binary or text, through `stl_io`. It knows triangles alone: no colours, no smooth normals, no units.
//! Files come from `loader`; models go back there.

use super::model::{MAX_TRIANGLES, Model, too_many};
use super::{Material, Triangle};
use glam::{DVec3, Vec2, Vec3};
use std::io::Cursor;
use std::path::Path;

/// Bytes before the first triangle of a binary file, and of each.
const HEAD: usize = 84;
const EACH: usize = 50;

/// Loads an .stl file, which names no others; a `texture` is of no use to it, and that is told.
pub(crate) fn load(bytes: Vec<u8>, _folder: &Path, texture: Option<&Path>) -> Result<Model, String> {
    let mut model = model(bytes)?;
    if let Some(texture) = texture {
        model.warnings.add(format!("texture {} is not used: STL has no texture coordinates", texture.display()));
    }
    Ok(model)
}

fn model(bytes: Vec<u8>) -> Result<Model, String> {
    let mut model = Model { materials: vec![Material::default()], ..Model::default() };
    if is_text(&bytes) {
        for solid in solids(&String::from_utf8_lossy(&bytes)) {
            append(solid.into_bytes(), &mut model)?;
        }
    } else {
        append(checked(bytes)?, &mut model)?;
    }
    Ok(model)
}

/// Whether a file is text. Many binary files begin with the same word, but their number of triangles has a zero byte.
fn is_text(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !bytes.iter().take(HEAD).any(|b| *b == 0)
}

/// A binary file, whole, with a head that `stl_io` does not take for text.
fn checked(mut bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let length = bytes.len();
    let (Some(count), Some(head)) = (bytes.get(80..HEAD).and_then(|b| b.try_into().ok()), bytes.get_mut(..5)) else {
        return Err(format!("{length} bytes; expected {HEAD} at least, or a text that begins with \"solid\": export the file again"));
    };
    head.fill(0);
    let count = u32::from_le_bytes(count) as usize;
    let needed = HEAD as u64 + EACH as u64 * count as u64;
    if (length as u64) < needed {
        return Err(format!(
            "{count} triangles need {needed} bytes, but the file has {length}: it is cut short, or no STL: fetch or export it again"
        ));
    }
    Ok(bytes)
}

/// The solids of a text, each as a text of its own in the words that `stl_io` knows.
fn solids(text: &str) -> Vec<String> {
    let mut solids: Vec<String> = Vec::new();
    for line in text.lines().map(|line| line.trim().to_ascii_lowercase()) {
        if line == "solid" || line.starts_with("solid ") {
            solids.push("solid \n".to_owned());
        } else if let Some(solid) = solids.last_mut() {
            solid.push_str(&line);
            solid.push('\n');
        }
    }
    solids
}

fn append(solid: Vec<u8>, model: &mut Model) -> Result<(), String> {
    let mut from = Cursor::new(solid);
    let triangles = stl_io::create_stl_reader(&mut from).map_err(|e| e.to_string())?;
    for triangle in triangles {
        let number = model.triangles.len();
        if number == MAX_TRIANGLES {
            return Err(too_many(number + 1));
        }
        let triangle = triangle.map_err(|e| format!("triangle {number}: {e}: export the file again"))?;
        model.triangles.push(Triangle {
            position: triangle.vertices.map(|v| DVec3::from_array(v.0.map(f64::from))),
            // Those of files are often wrong, and say no more than the corners.
            normal: [Vec3::ZERO; 3],
            uv: [Vec2::ZERO; 3],
            colour: [Vec3::ONE; 3],
            material: 0,
            island: None,
        });
    }
    Ok(())
}
