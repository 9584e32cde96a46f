//! Materials and textures of a glTF file, reduced to what is shown: one colour, one texture, holes, lit or not.
//! The document and its bytes come from `document` and `buffers`; looks go to `mesh` and to the model.

use super::accessor::Data;
use super::buffers;
use super::document::NO_IMAGE;
use crate::scene::model::Model;
use crate::scene::{Material, Wrap, picture};
use ::gltf::json;
use ::gltf::json::material::AlphaMode;
use ::gltf::json::texture::WrappingMode;
use ::gltf::json::validation::Checked;
use glam::{Affine2, Mat2, Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Which texture coordinates a material wants, and what it does to them.
#[derive(Clone, Copy)]
pub(crate) struct Mapping {
    /// The number of the TEXCOORD set.
    pub set: u32,
    /// KHR_texture_transform.
    pub transform: Affine2,
}

/// Appends every material of the file to `model`, and one more for primitives without; those that no mesh has are left plain, and nothing is said of
/// them. A material's mapping has the same index; `None`: no texture.
pub(crate) fn load(data: Data<'_>, folder: &Path, fallback: Option<&Path>, model: &mut Model) -> Result<Vec<Option<Mapping>>, String> {
    let mut shelf = Shelf { data, folder, known: HashMap::new(), lowest: Vec::new() };
    let mut mappings = Vec::new();
    let primitives = data.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let used: HashSet<usize> = primitives.filter_map(|primitive| Some(primitive.material?.value())).collect();
    for (i, material) in data.root.materials.iter().enumerate() {
        if !used.contains(&i) {
            model.materials.push(Material::default());
            mappings.push(None);
            continue;
        }
        let name = material.name.as_ref().map_or(format!("material {i}"), |n| format!("material \"{n}\""));
        mappings.push(one(&mut shelf, material, &name, model).map_err(|e| format!("{name}: {e}"))?);
    }
    model.materials.push(Material::default());
    mappings.push(None);
    if let Some(path) = fallback {
        if mappings.iter().any(Option::is_some) {
            model.warnings.add(format!("texture {} is not used: the model's materials name their own", path.display()));
        } else {
            let texture = crate::files::read(path)
                .and_then(|b| picture::texture(&b, [Wrap::Repeat; 2], &[]))
                .map_err(|e| format!("texture {}: {e}", path.display()))?;
            model.textures.push(texture);
            for (material, mapping) in model.materials.iter_mut().zip(&mut mappings) {
                material.texture = Some(0);
                *mapping = Some(Mapping { set: 0, transform: Affine2::IDENTITY });
            }
        }
    }
    Ok(mappings)
}

fn one(shelf: &mut Shelf<'_>, m: &json::Material, name: &str, model: &mut Model) -> Result<Option<Mapping>, String> {
    let extensions = m.extensions.as_ref();
    let gloss = extensions.and_then(|e| e.pbr_specular_glossiness.as_ref());
    let (mut factor, mut info) = match gloss {
        Some(g) => (g.diffuse_factor.0, g.diffuse_texture.as_ref()),
        None => (m.pbr_metallic_roughness.base_color_factor.0, m.pbr_metallic_roughness.base_color_texture.as_ref()),
    };
    let mut unlit = extensions.is_some_and(|e| e.unlit.is_some());
    let glow = m.emissive_factor.0;
    if glow.iter().any(|c| *c > 0.0) && !unlit {
        let black = factor[..3].iter().all(|c| *c <= 0.0);
        let outshone = info.is_none() && m.emissive_texture.is_none() && glow.iter().zip(factor).all(|(g, f)| *g >= f);
        if black || outshone {
            factor[..3].copy_from_slice(&glow);
            info = m.emissive_texture.as_ref();
            unlit = true;
        } else {
            model.warnings.add(format!("{name}: its emission is ignored beside its base colour"));
        }
    }
    let cutoff = match m.alpha_mode {
        Checked::Valid(AlphaMode::Opaque) => None,
        Checked::Valid(AlphaMode::Mask) => Some(m.alpha_cutoff.map_or(0.5, |c| c.0)),
        Checked::Valid(AlphaMode::Blend) => {
            model.warnings.add(format!("{name}: BLEND is treated as MASK at 0.5"));
            Some(0.5)
        }
        Checked::Invalid => return Err("unknown alphaMode; expected OPAQUE, MASK or BLEND".to_owned()),
    };
    let texture = match info {
        Some(info) => shelf.texture(info.index.value(), model)?,
        None => None,
    };
    let alpha = factor[3].clamp(0.0, 1.0);
    let cutoff = cutoff.filter(|c| {
        let lowest = texture.and_then(|t| shelf.lowest.get(t as usize)).copied().unwrap_or(255);
        // A mask without holes costs every later stage a test for nothing.
        alpha * f32::from(lowest) / 255.0 < *c
    });
    let colour = Vec3::new(factor[0], factor[1], factor[2]).clamp(Vec3::ZERO, Vec3::ONE);
    model.materials.push(Material { colour, texture, front: !m.double_sided, alpha_cutoff: cutoff, alpha, unlit });
    Ok(info.filter(|_| texture.is_some()).map(mapping))
}

fn mapping(info: &json::texture::Info) -> Mapping {
    let Some(t) = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref()) else {
        return Mapping { set: info.tex_coord, transform: Affine2::IDENTITY };
    };
    // Counter-clockwise as seen in a picture whose v runs down: the opposite sign of the usual matrix.
    let (sin, cos) = (libm::sinf(t.rotation.0), libm::cosf(t.rotation.0));
    let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
    let matrix = turn * Mat2::from_diagonal(Vec2::from(t.scale.0));
    Mapping { set: t.tex_coord.unwrap_or(info.tex_coord), transform: Affine2::from_mat2_translation(matrix, Vec2::from(t.offset.0)) }
}

/// The textures decoded so far.
struct Shelf<'a> {
    data: Data<'a>,
    folder: &'a Path,
    /// The index in the model of each image with its wrap modes.
    known: HashMap<(usize, [Wrap; 2]), u32>,
    /// The least alpha of each texture of the model: many materials may ask for it.
    lowest: Vec<u8>,
}

impl Shelf<'_> {
    /// The model's index of texture `index`, decoded if it is new; `None`: it has no picture that can be read.
    fn texture(&mut self, index: usize, model: &mut Model) -> Result<Option<u32>, String> {
        let root = self.data.root;
        let texture = root.textures.get(index).ok_or_else(|| format!("texture {index} of {}", root.textures.len()))?;
        let source = texture.source.value();
        if source as u64 == NO_IMAGE {
            return Ok(None);
        }
        let wrap = match texture.sampler {
            Some(s) => {
                let sampler =
                    root.samplers.get(s.value()).ok_or_else(|| format!("texture {index}: sampler {s} of {}", root.samplers.len()))?;
                [wrap(&sampler.wrap_s), wrap(&sampler.wrap_t)]
            }
            None => [Wrap::Repeat; 2],
        };
        if let Some(&known) = self.known.get(&(source, wrap)) {
            return Ok(Some(known));
        }
        let image = root.images.get(source).ok_or_else(|| format!("texture {index}: image {source} of {}", root.images.len()))?;
        let what = image.name.as_ref().map_or(format!("image {source}"), |n| format!("image \"{n}\""));
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => buffers::fetch(uri, self.folder),
            (None, Some(view)) => self.data.buffers.view(root, view.value()).map(|v| v.0.to_vec()),
            (None, None) => Err("names neither a uri nor a bufferView: data are missing".to_owned()),
        };
        let decoded = bytes.and_then(|b| picture::texture(&b, wrap, &model.textures)).map_err(|e| format!("{what}: {e}"))?;
        let at = model.textures.len() as u32;
        self.lowest.push(decoded.texels.iter().map(|texel| texel[3]).min().unwrap_or(255));
        model.textures.push(decoded);
        self.known.insert((source, wrap), at);
        Ok(Some(at))
    }
}

fn wrap(mode: &Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}
