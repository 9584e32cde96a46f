//! Wavefront OBJ and its MTL files, through `tobj`, after a pass over the text that says in which line something is wrong.
//! Files come from `load`; models go back there.

use super::error::{SceneError, Warnings};
use super::model::{MAX_TRIANGLES, Model, too_many};
use super::mtl::{self, Trouble, map_name};
use super::{Material, Texture, Triangle, Wrap, picture, polygon};
use crate::files::{beside, read as read_file};
use glam::{DVec3, Vec2, Vec3};
use std::cell::RefCell;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Loads an .obj file; `texture` serves a file whose materials name none.
pub(crate) fn load(path: &Path, texture: Option<&Path>) -> Result<Model, SceneError> {
    let bytes = read_file(path).map_err(|what| SceneError::Read { file: path.to_owned(), what })?;
    let error = |what| SceneError::Model { file: path.to_owned(), what };
    if bytes.starts_with(b"\xfe\xff") || bytes.starts_with(b"\xff\xfe") {
        return Err(error("text in UTF-16; expected UTF-8: save it as that".to_owned()));
    }
    model(&mtl::text(&bytes), path.parent().unwrap_or(Path::new("")), texture).map_err(error)
}

fn model(text: &str, folder: &Path, fallback: Option<&Path>) -> Result<Model, String> {
    let mut model = Model::default();
    let (clean, origin) = check(text, &mut model.warnings)?;
    let trouble = RefCell::new(Trouble::default());
    let options = tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, single_index: false };
    let library = |name: &Path| mtl::read(name, folder, &mut trouble.borrow_mut());
    let (objects, materials) =
        tobj::load_obj_buf(&mut clean.as_bytes(), &options, library).map_err(|e| format!("{e}: export the file again"))?;
    let Trouble { told, lost } = trouble.into_inner();
    told.into_iter().for_each(|what| model.warnings.add(what));
    let materials = materials.map_err(|e| format!("materials: {e}"))?;
    let known: HashSet<&str> = materials.iter().map(|m| m.name.as_str()).collect();
    let used = clean.lines().filter_map(|line| line.strip_prefix("usemtl "));
    for name in used.filter(|name| !lost && !known.contains(name)) {
        model.warnings.add(format!("material \"{name}\" is in no library: left white"));
    }
    let mut textures = Shelf::default();
    for m in materials {
        let look = look(&m, folder, &mut textures, &mut model.warnings)?;
        model.materials.push(look);
    }
    let plain = model.materials.len();
    model.materials.push(Material::default());
    if let Some(path) = fallback {
        if textures.all.is_empty() {
            let decoded = read_file(path).and_then(|b| picture::texture(&b, [Wrap::Repeat; 2], &[]));
            textures.all.push(decoded.map_err(|e| format!("texture {}: {e}", path.display()))?);
            model.materials.iter_mut().for_each(|m| m.texture = Some(0));
        } else {
            model.warnings.add(format!("texture {} is not used: the model's materials name their own", path.display()));
        }
    }
    model.textures = textures.all;
    if !model.textures.is_empty() && objects.iter().all(|o| o.mesh.texcoords.len() <= 2) {
        model.warnings.add("there are textures but no texture coordinates: each shows the colour of its corner only");
    }
    for object in &objects {
        append(&object.mesh, origin, plain, &mut model);
    }
    Ok(model)
}

/// Vertices farther from the origin than this are told from the first one: `tobj` holds them in 24 bits.
const FAR: f64 = 4096.0;

/// Checks every line that matters and hands back a text that `tobj` takes as it is meant: lines joined, extras dropped; and where its vertices are
/// counted from.
fn check(text: &str, warnings: &mut Warnings) -> Result<(String, DVec3), String> {
    let (mut libraries, mut origin) = (String::new(), DVec3::ZERO);
    let mut clean = String::with_capacity(text.len());
    // Number 1 of each stands for "none": left to itself, `tobj` gives such corners the ones of the corner before.
    clean.push_str("vt 0 1\nvn 0 0 0\n");
    let (mut vertices, mut coloured, mut uvs, mut normals, mut triangles) = (0i64, 0i64, 0i64, 0i64, 0usize);
    let mut positions = Vec::new();
    let mut lines = text.lines().enumerate();
    // Forward references are allowed: absolute indices are held against the whole file at the end.
    let mut highest = [(0i64, 0usize); 3];
    while let Some((number, line)) = lines.next() {
        let place = number + 1;
        let mut line = line.to_owned();
        // A comment goes no further than its line.
        while line.ends_with('\\') && !line.contains('#') {
            line.pop();
            line.push(' ');
            line.push_str(lines.next().map_or("", |l| l.1));
        }
        let whole = line.trim();
        let line = whole.split('#').next().unwrap_or("").trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let number = |word: &str| word.parse::<f64>().ok().filter(|v| (*v as f32).is_finite());
        let numbers = || rest.split_whitespace().map(number).collect::<Option<Vec<f64>>>();
        match word {
            "v" | "vt" | "vn" => {
                let least = if word == "vt" { 1 } else { 3 };
                let v = numbers()
                    .filter(|v| v.len() >= least)
                    .ok_or_else(|| format!("line {place}: \"{line}\"; expected at least {least} numbers"))?;
                match word {
                    "v" => {
                        vertices += 1;
                        let at = DVec3::from_slice(&v[..3]);
                        if vertices == 1 && at.abs().max_element() > FAR {
                            origin = at.round();
                        }
                        let from = (at - origin).as_vec3();
                        positions.push(from.as_dvec3());
                        coloured += i64::from(v.len() >= 6);
                        clean.push_str(&format!("v {} {} {}", from.x, from.y, from.z));
                        if let [_, _, _, r, g, b, ..] = v[..] {
                            clean.push_str(&format!(" {r} {g} {b}"));
                        }
                    }
                    "vt" => {
                        uvs += 1;
                        clean.push_str(&format!("vt {} {}", v[0], v.get(1).copied().unwrap_or(0.0)));
                    }
                    _ => {
                        normals += 1;
                        clean.push_str(&format!("vn {} {} {}", v[0], v[1], v[2]));
                    }
                }
            }
            "f" => {
                let mut corners = 0;
                let start = clean.len();
                clean.push('f');
                for corner in rest.split_whitespace() {
                    corners += 1;
                    let mut parsed = [0i64; 3];
                    for (i, part) in corner.split('/').enumerate() {
                        let odd = || format!("line {place}: \"{corner}\"; expected v, v/vt, v//vn or v/vt/vn");
                        let (what, count) =
                            [("vertices", vertices), ("texture coordinates", uvs), ("normals", normals)].get(i).copied().ok_or_else(odd)?;
                        if part.is_empty() && i > 0 {
                            continue;
                        }
                        let index: i64 = part.parse().map_err(|_| odd())?;
                        if index == 0 || index < -count {
                            return Err(format!("line {place}: index {index} of {count} {what} so far"));
                        }
                        parsed[i] = if index < 0 { count + 1 + index } else { index };
                        if parsed[i] > highest[i].0 {
                            highest[i] = (parsed[i], place);
                        }
                    }
                    clean.push_str(&format!(" {}/{}/{}", parsed[0], parsed[1].saturating_add(1), parsed[2].saturating_add(1)));
                }
                if corners < 2 {
                    return Err(format!("line {place}: a face of {corners} corners; expected at least 3"));
                }
                // As old exporters write loose edges.
                if corners == 2 {
                    clean.truncate(start);
                    warnings.add("faces of two corners are not shown");
                    continue;
                }
                triangles += corners - 2;
            }
            "l" | "p" => {
                warnings.add("points and lines are not shown: only faces are");
                continue;
            }
            "mtllib" | "usemtl" | "o" | "g" => match (word, mtl::name(whole)) {
                ("mtllib" | "usemtl", "") => continue,
                // Wherever it stands, it is about all of the file.
                ("mtllib", name) => {
                    libraries.push_str(&format!("mtllib {name}\n"));
                    continue;
                }
                (_, "") => clean.push_str(word),
                (_, name) => clean.push_str(&format!("{word} {name}")),
            },
            "curv" | "curv2" | "surf" => {
                warnings.add("free-form curves and surfaces are not shown: export polygons");
                continue;
            }
            _ => continue,
        }
        clean.push('\n');
    }
    for ((highest, line), (count, what)) in highest.iter().zip([(vertices, "vertices"), (uvs, "texture coordinates"), (normals, "normals")])
    {
        if *highest > count {
            return Err(format!("line {line}: index {highest} of {count} {what}"));
        }
    }
    if triangles > MAX_TRIANGLES {
        return Err(too_many(triangles));
    }
    let mut clean = libraries + &cut(&clean, &positions);
    if coloured > 0 && coloured < vertices {
        warnings.add(format!("only {coloured} of {vertices} vertices have colours: they are ignored"));
        clean = clean
            .lines()
            .map(|l| match l.strip_prefix("v ") {
                Some(rest) => format!("v {}\n", rest.split(' ').take(3).collect::<Vec<_>>().join(" ")),
                None => format!("{l}\n"),
            })
            .collect();
    }
    Ok((clean, origin))
}

/// The same text with polygons that are no fans cut into triangles: `tobj` makes fans of all.
fn cut(text: &str, positions: &[DVec3]) -> String {
    let mut whole = String::with_capacity(text.len());
    for line in text.lines() {
        let corners: Vec<&str> = line.strip_prefix("f ").map_or(Vec::new(), |corners| corners.split(' ').collect());
        let position =
            |corner: &&str| corner.split('/').next()?.parse::<usize>().ok().and_then(|v| positions.get(v.checked_sub(1)?)).copied();
        let triangles = match corners.len() {
            // Most faces are triangles.
            0..4 => Vec::new(),
            _ => polygon::triangles(&corners.iter().filter_map(position).collect::<Vec<_>>()),
        };
        if triangles.iter().enumerate().all(|(at, triangle)| *triangle == [0, at + 1, at + 2]) {
            whole.extend([line, "\n"]);
            continue;
        }
        for triangle in triangles {
            let [a, b, c] = triangle.map(|at| corners[at]);
            whole.push_str(&format!("f {a} {b} {c}\n"));
        }
    }
    whole
}

/// The textures decoded so far, by what names them.
#[derive(Default)]
struct Shelf {
    all: Vec<Texture>,
    names: Vec<(PathBuf, Option<PathBuf>)>,
}

impl Shelf {
    fn get(&mut self, colour: PathBuf, mask: Option<PathBuf>) -> Result<u32, String> {
        let key = (colour, mask);
        if let Some(i) = self.names.iter().position(|n| *n == key) {
            return Ok(i as u32);
        }
        let read = |path: &Path| {
            let decoded = read_file(path).and_then(|b| picture::texture(&b, [Wrap::Repeat; 2], &self.all));
            decoded.map_err(|e| format!("texture {}: {e}", path.display()))
        };
        let mut texture = read(&key.0)?;
        match &key.1 {
            // One picture for both: the mask is its alpha, if it has any.
            Some(mask) if *mask == key.0 => {}
            Some(mask) => {
                let mask = read(mask)?;
                for y in 0..texture.height {
                    for x in 0..texture.width {
                        let (i, j) = (
                            x as u64 * u64::from(mask.width) / u64::from(texture.width),
                            y as u64 * u64::from(mask.height) / u64::from(texture.height),
                        );
                        let from = mask.texels[(j * u64::from(mask.width) + i) as usize];
                        texture.texels[y as usize * texture.width as usize + x as usize][3] = from[0];
                    }
                }
            }
            None => {}
        }
        self.all.push(texture);
        self.names.push(key);
        Ok(self.all.len() as u32 - 1)
    }
}

fn look(m: &tobj::Material, folder: &Path, textures: &mut Shelf, warnings: &mut Warnings) -> Result<Material, String> {
    let mut out = Material { colour: m.diffuse.map_or(Vec3::ONE, Vec3::from), ..Material::default() };
    let name = &m.name;
    if let Some(statement) = &m.diffuse_texture {
        let mask = m.dissolve_texture.as_ref().map(|s| beside(map_name(s), folder));
        let has_mask = mask.is_some();
        out.texture = Some(textures.get(beside(map_name(statement), folder), mask).map_err(|e| format!("material \"{name}\": {e}"))?);
        if has_mask {
            out.alpha_cutoff = Some(0.5);
        }
        if out.colour == Vec3::ZERO {
            warnings.add(format!("material \"{name}\": its Kd is black under a texture: taken as white"));
            out.colour = Vec3::ONE;
        }
    } else if m.dissolve_texture.is_some() {
        warnings.add(format!("material \"{name}\": map_d without map_Kd is ignored"));
    }
    if let Some(glow) = m.emissive.map(Vec3::from).filter(|g| out.texture.is_none() && g.max_element() > 0.0 && g.cmpge(out.colour).all()) {
        out.colour = glow;
        out.unlit = true;
    }
    let transparency = m.unknown_param.get("Tr").and_then(|t| t.trim().parse::<f32>().ok());
    let alpha = m.dissolve.or(transparency.map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0);
    if alpha < 1.0 {
        warnings.add(format!("material \"{name}\": its transparency is treated as a mask at 0.5"));
        out.alpha = alpha;
        out.alpha_cutoff = Some(0.5);
    }
    out.colour = out.colour.clamp(Vec3::ZERO, Vec3::ONE);
    Ok(out)
}

/// Appends the triangles of `mesh`, whose positions are counted from `origin`; `plain` is the material of faces without one.
fn append(mesh: &tobj::Mesh, origin: DVec3, plain: usize, model: &mut Model) {
    let vec3 = |from: &[f32], i: u32| from.get(3 * i as usize..3 * i as usize + 3).map(Vec3::from_slice);
    let uv = |i: u32| mesh.texcoords.get(2 * i as usize..2 * i as usize + 2).map(|t| Vec2::new(t[0], 1.0 - t[1]));
    model.coloured |= !mesh.vertex_color.is_empty();
    for (t, corners) in mesh.indices.as_chunks::<3>().0.iter().enumerate() {
        let of = |indices: &[u32], k: usize| indices.get(3 * t + k).copied();
        let normal = [0, 1, 2]
            .map(|k| of(&mesh.normal_indices, k).and_then(|i| vec3(&mesh.normals, i)).and_then(Vec3::try_normalize).unwrap_or(Vec3::ZERO));
        model.triangles.push(Triangle {
            position: corners.map(|i| origin + vec3(&mesh.positions, i).map_or(DVec3::ZERO, Vec3::as_dvec3)),
            normal: if normal.contains(&Vec3::ZERO) { [Vec3::ZERO; 3] } else { normal },
            uv: [0, 1, 2].map(|k| of(&mesh.texcoord_indices, k).and_then(uv).unwrap_or(Vec2::ZERO)),
            colour: corners.map(|i| vec3(&mesh.vertex_color, i).map_or(Vec3::ONE, |c| c.clamp(Vec3::ZERO, Vec3::ONE))),
            material: mesh.material_id.filter(|m| *m < plain).unwrap_or(plain) as u32,
            island: None,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_name_their_line() {
        let check = |t: &str| check(t, &mut Warnings::default()).map(|(text, _)| text);
        assert_eq!(check("v 0 0 0\nv 1 0 0\nf 1 2 9\n").unwrap_err(), "line 3: index 9 of 2 vertices");
        assert!(check("v 0 0 0\nf 1 1 6148914691236517205\n").unwrap_err().starts_with("line 2: index"));
        assert!(check("v 0 0 0\nf 1/x 1 1\n").unwrap_err().starts_with("line 2: \"1/x\""));
        assert!(check("v 0 nan 0\n").unwrap_err().starts_with("line 1"));
        assert!(check("v 0 0 0\nf -1 -2 -1\n").unwrap_err().contains("index -2 of 1 vertices so far"));
        assert!(check("v 0 0 0\nf 1\n").unwrap_err().starts_with("line 2: a face of 1 corners"));
        assert_eq!(check("v 0 0 0 1 # w\nv 1 0 \\\n0\nf 1 2 -1\n").unwrap(), "vt 0 1\nvn 0 0 0\nv 0 0 0\nv 1 0 0\nf 1/1/1 2/1/1 2/1/1\n");
    }

    #[test]
    fn faces_of_two_corners_are_left_out() {
        let mut warnings = Warnings::default();
        let (text, _) = check("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\n", &mut warnings).unwrap();
        assert!(!text.contains("f 1/1/1 2/1/1\n") && text.ends_with("f 1/1/1 2/1/1 3/1/1\n"), "{text}");
        assert_eq!(warnings.into_vec(), ["faces of two corners are not shown"]);
    }

    #[test]
    fn comments_names_and_libraries_are_told_apart() {
        let text = "# from C:\\models\\\nusemtl Material #25\nv 0 0 0 # one\nmtllib a#b.mtl # two\nusemtl wall #three\n";
        let (text, _) = check(text, &mut Warnings::default()).unwrap();
        assert_eq!(text, "mtllib a#b.mtl\nvt 0 1\nvn 0 0 0\nusemtl Material #25\nv 0 0 0\nusemtl wall\n");
    }

    #[test]
    fn vertices_far_from_the_origin_keep_their_places() {
        let far = |[x, y]: [f64; 2]| format!("v {} {} 7\n", 392_000.25 + x, -5_820_000.75 + y);
        let corners = [[0.0, 0.0], [0.125, 0.0], [0.0, 0.0625]];
        let text = corners.map(far).concat() + "f 1 2 3\n";
        let placed = model(&text, Path::new(""), None).unwrap().triangles[0].position;
        assert_eq!(placed, corners.map(|[x, y]| DVec3::new(392_000.25 + x, -5_820_000.75 + y, 7.0)));
    }

    #[test]
    fn notches_of_polygons_stay_open() {
        let ell = "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\n";
        let area = |faces: &str| {
            let model = model(&format!("{ell}{faces}"), Path::new(""), None).unwrap();
            let areas = model.triangles.iter().map(|t| (t.position[1] - t.position[0]).cross(t.position[2] - t.position[0]).length() / 2.0);
            areas.sum::<f64>()
        };
        assert_eq!([area("f 1 2 3 4 5 6\n"), area("f 3 4 5 6 1 2\n"), area("f 6 5 4 3 2 1\n")], [5.0; 3]);
    }
}
