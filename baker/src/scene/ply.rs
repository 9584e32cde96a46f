//! PLY, ASCII or binary of either byte order, with vertex colours, through `ply-rs-bw`.
//! Files come from `loader`; models go back there.

use super::model::{MAX_TRIANGLES, Model, too_many};
use super::{Material, Triangle, Wrap, picture, polygon};
use crate::files::{beside, read as read_file};
use glam::{DVec3, Vec2, Vec3};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};
use std::path::Path;

/// Loads a .ply file from `folder`; `texture` serves a file that names none.
pub(crate) fn load(bytes: Vec<u8>, folder: &Path, texture: Option<&Path>) -> Result<Model, String> {
    model(&bytes, folder, texture)
}

/// A vertex, with whatever properties the file gives it.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    position: DVec3,
    normal: Vec3,
    uv: Vec2,
    colour: Vec3,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: DVec3::ZERO, normal: Vec3::ZERO, uv: Vec2::ZERO, colour: Vec3::ONE }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some((value, full)) = scalar(&property) else { return PropertyAccessResult::Ignored };
        match name {
            "x" => self.position.x = value,
            "y" => self.position.y = value,
            "z" => self.position.z = value,
            "nx" => self.normal.x = value as f32,
            "ny" => self.normal.y = value as f32,
            "nz" => self.normal.z = value as f32,
            "u" | "s" | "texture_u" | "tx" => self.uv.x = value as f32,
            // v runs up in PLY files, down in ours.
            "v" | "t" | "texture_v" | "ty" => self.uv.y = 1.0 - value as f32,
            "red" | "r" | "diffuse_red" => self.colour.x = (value / full) as f32,
            "green" | "g" | "diffuse_green" => self.colour.y = (value / full) as f32,
            "blue" | "b" | "diffuse_blue" => self.colour.z = (value / full) as f32,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// A face, or a strip of them.
#[derive(Clone, Debug)]
struct Face {
    corners: Vec<i64>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self { corners: Vec::new() }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match property {
            Property::ListChar(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUChar(v) => v.into_iter().map(i64::from).collect(),
            Property::ListShort(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUShort(v) => v.into_iter().map(i64::from).collect(),
            Property::ListInt(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUInt(v) => v.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// Elements that are read past.
struct Nothing;

impl PropertyAccess for Nothing {
    fn new() -> Self {
        Self
    }
}

/// A number, and what its type's full intensity is.
fn scalar(p: &Property) -> Option<(f64, f64)> {
    Some(match *p {
        Property::Char(v) => (f64::from(v), 127.0),
        Property::UChar(v) => (f64::from(v), 255.0),
        Property::Short(v) => (f64::from(v), 32_767.0),
        Property::UShort(v) => (f64::from(v), 65_535.0),
        Property::Int(v) => (f64::from(v), 255.0),
        Property::UInt(v) => (f64::from(v), 255.0),
        Property::Float(v) => (f64::from(v), 1.0),
        Property::Double(v) => (v, 1.0),
        _ => return None,
    })
}

fn size(t: &ScalarType) -> u64 {
    match t {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// The header may promise billions of elements: the file must be long enough for the shortest of them.
fn check_count(e: &ElementDef, header: &Header, length: u64) -> Result<(), String> {
    let ascii = header.encoding == Encoding::Ascii;
    let least: u64 = e
        .properties
        .values()
        .map(|p| match &p.data_type {
            _ if ascii => 2,
            PropertyType::Scalar(t) | PropertyType::List(t, _) => size(t),
        })
        .sum();
    if e.count > 0 && least == 0 {
        return Err(format!("element {}: {} of them without properties: the header is damaged", e.name, e.count));
    }
    let needed = (e.count as u64).saturating_mul(least);
    // The last line of an ASCII file need not end.
    if needed > length + 1 {
        return Err(format!(
            "element {}: {} of them need at least {needed} bytes, but the file has {length}: it is cut short: fetch or export it again",
            e.name, e.count
        ));
    }
    Ok(())
}

fn model(bytes: &[u8], folder: &Path, fallback: Option<&Path>) -> Result<Model, String> {
    let mut model = Model::default();
    let mut reader = Reader::new(bytes);
    let flat = |e: ply_rs_bw::parser::ParseError| {
        let told = e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        // What its grammar was about to read is of no use.
        told.split(" Error: ParseError").next().unwrap_or_default().chars().take(300).collect::<String>()
    };
    let header = Parser::<Nothing>::new().read_header(&mut reader).map_err(|e| format!("header: {}: expected a PLY file", flat(e)))?;
    let (mut vertices, mut faces, mut strips) = (Vec::new(), Vec::new(), Vec::new());
    for e in header.elements.values() {
        check_count(e, &header, bytes.len() as u64)?;
        let error = |x| format!("element {}: {}", e.name, flat(x));
        match e.name.as_str() {
            "vertex" => {
                if let Some(lacking) = ["x", "y", "z"].iter().find(|n| !e.properties.contains_key(**n)) {
                    return Err(format!("element vertex: no property {lacking}; expected x, y and z"));
                }
                vertices = Parser::<Vertex>::new().read_payload_for_element(&mut reader, e, &header).map_err(error)?;
            }
            "face" => faces = Parser::<Face>::new().read_payload_for_element(&mut reader, e, &header).map_err(error)?,
            "tristrips" => strips = Parser::<Face>::new().read_payload_for_element(&mut reader, e, &header).map_err(error)?,
            _ => drop(Parser::<Nothing>::new().read_payload_for_element(&mut reader, e, &header).map_err(error)?),
        }
    }
    if faces.is_empty() && strips.is_empty() {
        return Err(format!(
            "no faces ({} vertices only); expected an element face: a point cloud cannot be shown, mesh it first",
            vertices.len()
        ));
    }
    look(&mut model, &header, folder, fallback)?;
    if let Some(i) = vertices.iter().position(|v| !v.position.is_finite() || !v.uv.is_finite() || !v.colour.is_finite()) {
        return Err(format!("vertex {i}: a number is infinite or none; expected numbers"));
    }
    surface(&mut model, &vertices, &faces, &strips)?;
    Ok(model)
}

/// What a file says about colours and its texture; `fallback` serves a file that names none.
fn look(model: &mut Model, header: &Header, folder: &Path, fallback: Option<&Path>) -> Result<(), String> {
    const RED: [&str; 3] = ["red", "r", "diffuse_red"];
    let has_of =
        |element: &str, names: &[&str]| header.elements.get(element).is_some_and(|e| names.iter().any(|n| e.properties.contains_key(*n)));
    let has = |names: &[&str]| has_of("vertex", names);
    model.coloured = has(&RED);
    if has_of("face", &RED) {
        model.warnings.add("the colours of faces are not shown: only those of vertices are");
    }
    let texture = header.comments.iter().find_map(|c| c.trim().strip_prefix("TextureFile")).map(|n| beside(n.trim(), folder));
    let texture = texture.or_else(|| fallback.map(Path::to_owned));
    let mut material = Material::default();
    if let Some(path) = texture {
        let decoded = read_file(&path)
            .and_then(|b| picture::texture(&b, [Wrap::Repeat; 2], &[]))
            .map_err(|e| format!("texture {}: {e}", path.display()))?;
        if has(&["u", "s", "texture_u", "tx"]) {
            model.textures.push(decoded);
            material.texture = Some(0);
        } else {
            model.warnings.add(format!("texture {} is not used: the vertices have no texture coordinates", path.display()));
        }
    }
    model.materials.push(material);
    Ok(())
}

/// The triangles of faces and strips.
fn surface(model: &mut Model, vertices: &[Vertex], faces: &[Face], strips: &[Face]) -> Result<(), String> {
    for (i, face) in faces.iter().enumerate() {
        let corners = indices(&face.corners, vertices.len()).map_err(|e| format!("face {i}: {e}"))?;
        if corners.len() < 3 {
            model.warnings.add("faces of fewer than three corners are not shown");
        }
        // Most faces are triangles.
        if let &[a, b, c] = &corners[..] {
            push(model, [a, b, c], vertices)?;
            continue;
        }
        let positions: Vec<DVec3> = corners.iter().map(|&corner| vertices[corner].position).collect();
        for triangle in polygon::triangles(&positions) {
            push(model, triangle.map(|at| corners[at]), vertices)?;
        }
    }
    for (i, strip) in strips.iter().enumerate() {
        for run in strip.corners.split(|c| *c < 0) {
            let corners = indices(run, vertices.len()).map_err(|e| format!("tristrips {i}: {e}"))?;
            for (k, w) in corners.windows(3).enumerate() {
                push(model, if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] }, vertices)?;
            }
        }
    }
    Ok(())
}

fn indices(corners: &[i64], count: usize) -> Result<Vec<usize>, String> {
    let one = |c: &i64| {
        usize::try_from(*c).ok().filter(|i| *i < count).ok_or_else(|| format!("index {c} of {count} vertices: export the file again"))
    };
    corners.iter().map(one).collect()
}

fn push(model: &mut Model, corners: [usize; 3], vertices: &[Vertex]) -> Result<(), String> {
    if model.triangles.len() == MAX_TRIANGLES {
        return Err(too_many(MAX_TRIANGLES + 1));
    }
    let v = corners.map(|i| vertices[i]);
    let normal = v.map(|v| v.normal.try_normalize().unwrap_or(Vec3::ZERO));
    model.triangles.push(Triangle {
        position: v.map(|v| v.position),
        normal: if normal.contains(&Vec3::ZERO) { [Vec3::ZERO; 3] } else { normal },
        uv: v.map(|v| v.uv),
        colour: v.map(|v| v.colour.clamp(Vec3::ZERO, Vec3::ONE)),
        material: 0,
        island: None,
    });
    Ok(())
}
