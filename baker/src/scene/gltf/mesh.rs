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
use glam::{Affine2, DMat3, DMat4, DVec3, DVec4, Vec2, Vec3};
use std::collections::HashMap;
use std::rc::Rc;

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

/// The vertices that `corners` name, of `count`; corners then name places among these. Primitives may share a file's vertices, of which each would hold all.
fn used(corners: &mut [[u32; 3]], count: usize) -> Vec<usize> {
    if 3 * corners.len() >= count {
        return (0..count).collect();
    }
    let (mut places, mut used) = (HashMap::new(), Vec::new());
    for corner in corners.as_flattened_mut() {
        let vertex = *corner as usize;
        *corner = *places.entry(vertex).or_insert_with(|| {
            used.push(vertex);
            used.len() as u32 - 1
        });
    }
    used
}

/// Places every mesh of the scene.
pub(crate) fn load(data: Data<'_>, nodes: &Nodes, mappings: &[Option<Mapping>], model: &mut Model) -> Result<(), String> {
    let root = data.root;
    let mut reader = Reader { data, mappings, shared: Vec::new() };
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
                primitives.extend(reader.read(p, &where_, &mut model.warnings).map_err(|e| format!("{where_}: {e}"))?);
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

/// The numbers of an accessor that primitives may share.
type Shared = Rc<Numbers>;

/// Reads primitives, one after the other.
struct Reader<'a> {
    data: Data<'a>,
    mappings: &'a [Option<Mapping>],
    /// What the last primitive named, as what, and the numbers there: in many files one accessor has the vertices of all. What a primitive does not name is
    /// dropped before it is read, so that there is never more in memory than one names.
    shared: Vec<(Semantic, usize, Shared)>,
}

impl Reader<'_> {
    /// Reads a primitive; `None` if it has no triangles to show.
    fn read(&mut self, p: &json::mesh::Primitive, place: &str, warnings: &mut Warnings) -> Result<Option<Primitive>, String> {
        let Checked::Valid(mode) = p.mode else { return Err("unknown mode; expected 0 to 6".to_owned()) };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            warnings.add(format!("{place}: {mode:?} are not shown: only triangles are"));
            return Ok(None);
        }
        if p.targets.as_ref().is_some_and(|t| !t.is_empty()) {
            warnings.add("morph targets are ignored: meshes keep their base shape");
        }
        self.shared.retain(|(semantic, index, _)| named(p, semantic) == Some(*index));
        let Some(positions) = self.attribute(p, Semantic::Positions, &[Type::Vec3])? else {
            warnings.add(format!("{place}: has no POSITION and is not shown"));
            return Ok(None);
        };
        if let Some(i) = positions.bad {
            return Err(format!("position {i} is {:?}; expected numbers", positions.element::<3>(i)));
        }
        let count = positions.count;
        let material = p.material.map_or(self.mappings.len() - 1, |m| m.value());
        if material >= self.mappings.len() {
            return Err(format!("material {material} of {}", self.mappings.len() - 1));
        }
        let normals = self.attribute(p, Semantic::Normals, &[Type::Vec3])?;
        // A broken normal is not worth the model: the face's own serves.
        if let Some(normals) = normals.as_ref().filter(|normals| normals.count < count) {
            return Err(format!("NORMAL: {} elements for {count} vertices", normals.count));
        }
        let uvs = self.uvs(p, material, count, place, warnings)?;
        let colours = self.whole(p, Semantic::Colors(0), &[Type::Vec3, Type::Vec4], count)?;
        let influences = self.influences(p, count)?;
        let mut corners = self.corners(p, mode, count, place, warnings)?;
        let used = used(&mut corners, count);
        if colours.as_ref().is_some_and(|c| c.width == 4 && used.iter().any(|&i| c.element::<4>(i)[3] < 0.999)) {
            warnings.add(format!("{place}: the alpha of its vertex colours is ignored"));
        }
        let of = |all: Option<Shared>| all.into_iter().flat_map(|all| used.iter().map(move |&i| DVec3::from_array(all.element::<3>(i))));
        Ok(Some(Primitive {
            positions: of(Some(positions)).collect(),
            normals: of(normals).map(|normal| normal.as_vec3()).collect(),
            colours: of(colours).map(|colour| colour.clamp(DVec3::ZERO, DVec3::ONE).as_vec3()).collect(),
            uvs: match uvs {
                Some((uvs, map)) => {
                    let uv = |&i: &usize| map.transform_point2(Vec2::from(uvs.element::<2>(i).map(|v| v as f32)));
                    used.iter().map(uv).collect()
                }
                None => Vec::new(),
            },
            influences: influences.iter().map(|(joints, weights)| (joints.picked(&used), weights.picked(&used))).collect(),
            corners,
            material,
        }))
    }

    /// What `p` names as `semantic`, which must be of one of `shapes`; `None` where it names nothing.
    fn attribute(&mut self, p: &json::mesh::Primitive, semantic: Semantic, shapes: &[Type]) -> Result<Option<Shared>, String> {
        let Some(index) = named(p, &semantic) else { return Ok(None) };
        if let Some((.., numbers)) = self.shared.iter().find(|(other, ..)| *other == semantic) {
            return Ok(Some(numbers.clone()));
        }
        let numbers = self.data.read(index, shapes).map_err(|e| format!("{}: {e}", attribute_name(&semantic)))?;
        let numbers = Rc::new(numbers);
        self.shared.push((semantic, index, numbers.clone()));
        Ok(Some(numbers))
    }

    /// The same, with a number for each of `count` vertices.
    fn whole(&mut self, p: &json::mesh::Primitive, semantic: Semantic, shapes: &[Type], count: usize) -> Result<Option<Shared>, String> {
        let what = attribute_name(&semantic);
        let Some(numbers) = self.attribute(p, semantic, shapes)? else { return Ok(None) };
        if numbers.count < count {
            return Err(format!("{what}: {} elements for {count} vertices", numbers.count));
        }
        match numbers.bad {
            Some(i) => Err(format!("{what}: element {i} is not a number")),
            None => Ok(Some(numbers)),
        }
    }

    /// The texture coordinates that `material` wants, if any, and what it does to them.
    fn uvs(
        &mut self,
        p: &json::mesh::Primitive,
        material: usize,
        count: usize,
        place: &str,
        warnings: &mut Warnings,
    ) -> Result<Option<(Shared, Affine2)>, String> {
        let Some(Mapping { set, transform }) = self.mappings[material] else { return Ok(None) };
        let uvs = self.whole(p, Semantic::TexCoords(set), &[Type::Vec2], count)?;
        if uvs.is_none() {
            warnings.add(format!("{place}: has a texture but no TEXCOORD_{set}: it shows the colour of the texture's corner"));
        }
        Ok(uvs.map(|uvs| (uvs, transform)))
    }

    /// Joints and weights, four a vertex in each pair.
    fn influences(&mut self, p: &json::mesh::Primitive, count: usize) -> Result<Vec<(Shared, Shared)>, String> {
        let mut influences = Vec::new();
        for set in 0..4 {
            if named(p, &Semantic::Joints(set)).is_none() || named(p, &Semantic::Weights(set)).is_none() {
                break;
            }
            let joints = self.whole(p, Semantic::Joints(set), &[Type::Vec4], count)?;
            let weights = self.whole(p, Semantic::Weights(set), &[Type::Vec4], count)?;
            influences.extend(joints.zip(weights));
        }
        Ok(influences)
    }

    /// The corners of the triangles, numbers of vertices.
    fn corners(
        &self,
        p: &json::mesh::Primitive,
        mode: Mode,
        count: usize,
        place: &str,
        warnings: &mut Warnings,
    ) -> Result<Vec<[u32; 3]>, String> {
        let indices = match p.indices {
            Some(a) => {
                let n = self.data.read_indices(a.value()).map_err(|e| format!("indices: {e}"))?;
                if let Some(bad) = n.values.iter().find(|v| !(**v >= 0.0 && **v < count as f64)) {
                    return Err(format!("index {bad} of {count} vertices: export the file again"));
                }
                n.values.iter().map(|v| *v as u32).collect()
            }
            None => (0..count as u32).collect::<Vec<_>>(),
        };
        if mode == Mode::Triangles && !indices.len().is_multiple_of(3) {
            warnings.add(format!("{place}: {} indices are not whole triangles: the rest is left out", indices.len()));
        }
        Ok(corners(&indices, mode))
    }
}

/// The accessor that `p` names as `semantic`.
fn named(p: &json::mesh::Primitive, semantic: &Semantic) -> Option<usize> {
    p.attributes.get(&Checked::Valid(semantic.clone())).map(|accessor| accessor.value())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_shared_vertices_those_are_kept_that_corners_name() {
        let mut corners = [[90, 7, 50], [7, 90, 8]];
        assert_eq!(used(&mut corners, 100), [90, 7, 50, 8]);
        assert_eq!(corners, [[0, 1, 2], [1, 0, 3]], "the same ones in the same order");
        // Where most are named, all stay where they are.
        let mut corners = [[2, 1, 0], [1, 2, 4]];
        assert_eq!(used(&mut corners, 5), [0, 1, 2, 3, 4]);
        assert_eq!(corners, [[2, 1, 0], [1, 2, 4]]);
        assert!(used(&mut [], 3).is_empty(), "no triangle, no vertex");
    }
}
