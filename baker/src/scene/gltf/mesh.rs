//! Meshes of a glTF file: their attributes read and checked once, then placed wherever a node shows them.
//! The document comes from `document`, places from `nodes`, mappings from `material`; triangles go to the model.

use super::accessor::{Data, Numbers};
use super::material::Mapping;
use super::nodes::{self, Nodes};
use crate::scene::Triangle;
use crate::scene::error::Warnings;
use crate::scene::model::{MAX_TRIANGLES, Model, too_many};
use ::gltf::json;
use ::gltf::json::accessor::Type;
use ::gltf::json::mesh::{Mode, Semantic};
use ::gltf::json::validation::Checked;
use glam::{DMat3, DMat4, DVec3, DVec4, Vec2, Vec3};

/// A primitive, as its file has it.
struct Primitive {
    positions: Vec<DVec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colours: Vec<Vec3>,
    /// Joints and weights, a pair of accessors for every four influences.
    influences: Vec<(Numbers, Numbers)>,
    corners: Vec<[u32; 3]>,
    material: usize,
}

impl Primitive {
    /// The same without vertices that are no triangle's: primitives may share a file's vertices, of which each would hold all.
    fn trimmed(mut self) -> Self {
        if 3 * self.corners.len() >= self.positions.len() {
            return self;
        }
        let (mut number, mut used) = (vec![u32::MAX; self.positions.len()], Vec::new());
        for corner in self.corners.as_flattened_mut() {
            let number = &mut number[*corner as usize];
            if *number == u32::MAX {
                *number = used.len() as u32;
                used.push(*corner as usize);
            }
            *corner = *number;
        }
        fn picked<T: Copy>(all: &[T], used: &[usize]) -> Vec<T> {
            used.iter().filter_map(|&i| all.get(i).copied()).collect()
        }
        let Self { positions, normals, uvs, colours, influences, corners, material } = self;
        Self {
            positions: picked(&positions, &used),
            normals: picked(&normals, &used),
            uvs: picked(&uvs, &used),
            colours: picked(&colours, &used),
            influences: influences.iter().map(|(joints, weights)| (joints.picked(&used), weights.picked(&used))).collect(),
            corners,
            material,
        }
    }
}

/// Places every mesh of the scene.
pub(crate) fn load(data: Data<'_>, nodes: &Nodes, mappings: &[Option<Mapping>], model: &mut Model) -> Result<(), String> {
    let root = data.root;
    let mut known: Vec<Option<Vec<Primitive>>> = root.meshes.iter().map(|_| None).collect();
    for &n in &nodes.order {
        let node = &root.nodes[n];
        let Some(index) = node.mesh.map(|m| m.value()) else { continue };
        let place = nodes::name(data, n);
        let mesh = root.meshes.get(index).ok_or_else(|| format!("{place}: mesh {index} of {}", root.meshes.len()))?;
        let what = mesh.name.as_ref().map_or(format!("mesh {index}"), |m| format!("mesh \"{m}\""));
        let slot = &mut known[index];
        if slot.is_none() {
            let mut primitives = Vec::new();
            for (i, p) in mesh.primitives.iter().enumerate() {
                let where_ = format!("{what}: primitive {i}");
                primitives.extend(read(data, p, mappings, &where_, &mut model.warnings).map_err(|e| format!("{where_}: {e}"))?);
            }
            *slot = Some(primitives);
        }
        let skin = match node.skin {
            Some(s) => Some(skin(data, s.value(), nodes).map_err(|e| format!("{place}: skin {s}: {e}"))?),
            None => None,
        };
        for (i, primitive) in slot.iter().flatten().enumerate() {
            if model.triangles.len() + primitive.corners.len() > MAX_TRIANGLES {
                return Err(too_many(model.triangles.len() + primitive.corners.len()));
            }
            let skin = skin.as_deref().filter(|_| !primitive.influences.is_empty());
            if skin.is_some() {
                model.warnings.add("skinned meshes are shown at rest, without animation");
            }
            place_one(primitive, nodes.posed[n], skin, model).map_err(|e| format!("{what}: primitive {i}: {e}"))?;
        }
    }
    Ok(())
}

/// The matrices that take a skinned vertex from its bind pose to the world, joint by joint.
fn skin(data: Data<'_>, index: usize, nodes: &Nodes) -> Result<Vec<DMat4>, String> {
    let skin = data.root.skins.get(index).ok_or_else(|| format!("not among the file's {}", data.root.skins.len()))?;
    let bind = match skin.inverse_bind_matrices {
        Some(a) => {
            let numbers = data.read(a.value(), &[Type::Mat4])?;
            if numbers.count < skin.joints.len() {
                return Err(format!("{} inverse bind matrices for {} joints", numbers.count, skin.joints.len()));
            }
            (0..skin.joints.len()).map(|i| DMat4::from_cols_array(&numbers.element::<16>(i))).collect()
        }
        None => vec![DMat4::IDENTITY; skin.joints.len()],
    };
    let joint = |(j, bind): (&json::Index<json::Node>, DMat4)| {
        let rest = nodes.rest.get(j.value()).ok_or_else(|| format!("joint node {j} of {}", nodes.rest.len()))?;
        Ok(*rest * bind)
    };
    skin.joints.iter().zip(bind).map(joint).collect()
}

/// Reads a primitive; `None` if it has no triangles to show.
fn read(
    data: Data<'_>,
    p: &json::mesh::Primitive,
    mappings: &[Option<Mapping>],
    place: &str,
    warnings: &mut Warnings,
) -> Result<Option<Primitive>, String> {
    let Checked::Valid(mode) = p.mode else { return Err("unknown mode; expected 0 to 6".to_owned()) };
    if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
        warnings.add(format!("{place}: {mode:?} are not shown: only triangles are"));
        return Ok(None);
    }
    if p.targets.as_ref().is_some_and(|t| !t.is_empty()) {
        warnings.add("morph targets are ignored: meshes keep their base shape");
    }
    let attribute = |semantic: Semantic, shapes: &[Type]| match p.attributes.get(&Checked::Valid(semantic.clone())) {
        Some(a) => data.read(a.value(), shapes).map(Some).map_err(|e| format!("{}: {e}", attribute_name(&semantic))),
        None => Ok(None),
    };
    let Some(positions) = attribute(Semantic::Positions, &[Type::Vec3])? else {
        warnings.add(format!("{place}: has no POSITION and is not shown"));
        return Ok(None);
    };
    if let Some(i) = positions.first_bad() {
        return Err(format!("position {i} is {:?}; expected numbers", positions.element::<3>(i)));
    }
    let count = positions.count;
    let same = |what: &str, n: &Numbers| match n.count {
        c if c < count => Err(format!("{what}: {c} elements for {count} vertices")),
        _ => match n.first_bad() {
            Some(i) => Err(format!("{what}: element {i} is not a number")),
            None => Ok(()),
        },
    };
    let material = p.material.map_or(mappings.len() - 1, |m| m.value());
    if material >= mappings.len() {
        return Err(format!("material {material} of {}", mappings.len() - 1));
    }
    let normals = match attribute(Semantic::Normals, &[Type::Vec3])? {
        // A broken normal is not worth the model: the face's own serves.
        Some(n) if n.count >= count => (0..count).map(|i| DVec3::from_array(n.element::<3>(i)).as_vec3()).collect(),
        Some(n) => return Err(format!("NORMAL: {} elements for {count} vertices", n.count)),
        None => Vec::new(),
    };
    let uvs = match mappings[material] {
        Some(mapping) => match attribute(Semantic::TexCoords(mapping.set), &[Type::Vec2])? {
            Some(uv) => {
                same(&format!("TEXCOORD_{}", mapping.set), &uv)?;
                let map = |i| mapping.transform.transform_point2(Vec2::from(uv.element::<2>(i).map(|v| v as f32)));
                (0..count).map(map).collect()
            }
            None => {
                warnings
                    .add(format!("{place}: has a texture but no TEXCOORD_{}: it shows the colour of the texture's corner", mapping.set));
                Vec::new()
            }
        },
        None => Vec::new(),
    };
    let colours = match attribute(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])? {
        Some(c) => {
            same("COLOR_0", &c)?;
            if c.width == 4 && (0..count).any(|i| c.element::<4>(i)[3] < 0.999) {
                warnings.add(format!("{place}: the alpha of its vertex colours is ignored"));
            }
            let clamp = |i| DVec3::from_array(c.element::<3>(i)).clamp(DVec3::ZERO, DVec3::ONE).as_vec3();
            (0..count).map(clamp).collect()
        }
        None => Vec::new(),
    };
    let mut influences = Vec::new();
    for set in 0..4 {
        let (joints, weights) = (attribute(Semantic::Joints(set), &[Type::Vec4])?, attribute(Semantic::Weights(set), &[Type::Vec4])?);
        let (Some(joints), Some(weights)) = (joints, weights) else { break };
        same(&format!("JOINTS_{set}"), &joints)?;
        same(&format!("WEIGHTS_{set}"), &weights)?;
        influences.push((joints, weights));
    }
    let indices = match p.indices {
        Some(a) => {
            let n = data.read_indices(a.value()).map_err(|e| format!("indices: {e}"))?;
            if let Some(bad) = n.values.iter().find(|v| !(**v >= 0.0 && **v < count as f64)) {
                return Err(format!("index {bad} of {count} vertices: export the file again"));
            }
            n.values.iter().map(|v| *v as u32).collect()
        }
        None => (0..count as u32).collect::<Vec<_>>(),
    };
    let corners = corners(&indices, mode);
    if mode == Mode::Triangles && !indices.len().is_multiple_of(3) {
        warnings.add(format!("{place}: {} indices are not whole triangles: the rest is left out", indices.len()));
    }
    let positions = (0..count).map(|i| DVec3::from_array(positions.element::<3>(i))).collect();
    Ok(Some(Primitive { positions, normals, uvs, colours, influences, corners, material }.trimmed()))
}

fn attribute_name(semantic: &Semantic) -> String {
    match semantic {
        Semantic::Positions => "POSITION".to_owned(),
        Semantic::Normals => "NORMAL".to_owned(),
        Semantic::Colors(i) => format!("COLOR_{i}"),
        Semantic::TexCoords(i) => format!("TEXCOORD_{i}"),
        Semantic::Joints(i) => format!("JOINTS_{i}"),
        Semantic::Weights(i) => format!("WEIGHTS_{i}"),
        other => format!("{other:?}"),
    }
}

/// Lists, strips and fans to triangles, front faces kept.
fn corners(indices: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect(),
        Mode::TriangleFan => indices.get(1..).unwrap_or(&[]).windows(2).map(|w| [w[0], w[1], indices[0]]).collect(),
        _ => indices.as_chunks::<3>().0.to_vec(),
    }
}

fn place_one(p: &Primitive, world: DMat4, skin: Option<&[DMat4]>, model: &mut Model) -> Result<(), String> {
    // The cofactors transform normals as the inverse transpose does, and exist for flat scales too.
    let cofactors = |m: DMat4| {
        let (x, y, z) = (m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate());
        DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
    };
    let turn = |n: &Vec3, m: DMat3| (m * n.as_dvec3()).try_normalize().map_or(Vec3::ZERO, |n| n.as_vec3());
    let matrix = |i: usize| Ok::<_, String>(skin.map_or(Ok(None), |joints| blend(p, i, joints))?.unwrap_or(world));
    let still = cofactors(world);
    // Where vertex `i` is, and its normal.
    let vertex = |i: usize| {
        let m = matrix(i)?;
        let normal = p.normals.get(i).map(|n| turn(n, if skin.is_some() { cofactors(m) } else { still }));
        Ok::<_, String>((m.transform_point3(p.positions[i]), normal.unwrap_or(Vec3::ZERO)))
    };
    if p.corners.is_empty() {
        return Ok(());
    }
    let vertices = (0..p.positions.len()).map(vertex).collect::<Result<Vec<_>, _>>()?;
    // A mirror turns what goes around to the left: the front stays in front.
    let mirrored = matrix(0)?.determinant() < 0.0;
    model.coloured |= !p.colours.is_empty();
    for c in &p.corners {
        let [a, b, c] = c.map(|i| i as usize);
        let at = if mirrored { [a, c, b] } else { [a, b, c] };
        let placed = at.map(|i| vertices[i]);
        let normal = placed.map(|(_, normal)| normal);
        model.triangles.push(Triangle {
            position: placed.map(|(position, _)| position),
            normal: if normal.contains(&Vec3::ZERO) { [Vec3::ZERO; 3] } else { normal },
            uv: at.map(|i| p.uvs.get(i).copied().unwrap_or(Vec2::ZERO)),
            colour: at.map(|i| p.colours.get(i).copied().unwrap_or(Vec3::ONE)),
            material: p.material as u32,
            island: None,
        });
    }
    Ok(())
}

/// The weighted mean of the joint matrices of vertex `i`; `None`: it has no weight at all.
fn blend(p: &Primitive, i: usize, joints: &[DMat4]) -> Result<Option<DMat4>, String> {
    let mut sum = DMat4::ZERO;
    let mut total = 0.0;
    for (numbers, weights) in &p.influences {
        for (j, w) in numbers.element::<4>(i).into_iter().zip(DVec4::from_array(weights.element::<4>(i)).to_array()) {
            if w > 0.0 {
                let joint = joints.get(j as usize).ok_or_else(|| format!("vertex {i}: joint {j} of {}", joints.len()))?;
                sum += *joint * w;
                total += w;
            }
        }
    }
    Ok((total > 0.0).then(|| sum * (1.0 / total)))
}
