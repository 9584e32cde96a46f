//! Wavefront OBJ and its MTL files, through `tobj`, after a pass over the text that says in which line something is wrong.
//! Files come from `loader`; models go back there.

use super::error::Warnings;
use super::model::{MAX_TRIANGLES, Model, too_many};
use super::mtl::{self, Trouble, map_name};
use super::{Material, Texture, Triangle, Wrap, picture, polygon};
use crate::files::{beside, read as read_file};
use glam::{DVec3, Vec2, Vec3};
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Loads an .obj file from `folder`; `texture` serves a file whose materials name none.
pub(crate) fn load(bytes: Vec<u8>, folder: &Path, texture: Option<&Path>) -> Result<Model, String> {
    if bytes.starts_with(b"\xfe\xff") || bytes.starts_with(b"\xff\xfe") {
        return Err("text in UTF-16; expected UTF-8: save it as that".to_owned());
    }
    model(&mtl::text(&bytes), folder, texture)
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

/// What the corners of faces name, in the order in which they do.
const NAMED: [&str; 3] = ["vertices", "texture coordinates", "normals"];

/// Checks every line that matters and hands back a text that `tobj` takes as it is meant: lines joined, extras dropped; and where its vertices are
/// counted from.
fn check(text: &str, warnings: &mut Warnings) -> Result<(String, DVec3), String> {
    let mut checked = Checked::new(text.len());
    let mut lines = text.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let mut line = line.to_owned();
        // A comment goes no further than its line.
        while line.ends_with('\\') && !line.contains('#') {
            line.pop();
            line.push(' ');
            line.push_str(lines.next().map_or("", |l| l.1));
        }
        checked.line(number + 1, line.trim(), warnings)?;
    }
    checked.finished(warnings)
}

/// What was found in the lines of a text that have been checked.
struct Checked {
    /// The lines for `tobj`.
    clean: String,
    /// Those that name libraries, which come before the others: wherever such a line stands, it is about all of the file.
    libraries: String,
    /// Where vertices are counted from.
    origin: DVec3,
    positions: Vec<DVec3>,
    /// How many vertices have colours.
    coloured: i64,
    /// How many there are of each of [`NAMED`].
    counts: [i64; 3],
    /// The highest index into each, and its line. Indices may run ahead of what they name: they are held against the whole file at the end.
    highest: [(i64, usize); 3],
    triangles: usize,
}

impl Checked {
    /// Nothing yet, with room for a text of `length` bytes.
    fn new(length: usize) -> Self {
        let mut clean = String::with_capacity(length);
        // Number 1 of each stands for "none": left to itself, `tobj` gives such corners the ones of the corner before.
        clean.push_str("vt 0 1\nvn 0 0 0\n");
        Self {
            clean,
            libraries: String::new(),
            origin: DVec3::ZERO,
            positions: Vec::new(),
            coloured: 0,
            counts: [0; 3],
            highest: [(0, 0); 3],
            triangles: 0,
        }
    }

    /// Takes `whole`, which begins in line `place`, with its comment.
    fn line(&mut self, place: usize, whole: &str, warnings: &mut Warnings) -> Result<(), String> {
        let line = whole.split('#').next().unwrap_or("").trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let numbers = |least: usize| {
            let number = |word: &str| word.parse::<f64>().ok().filter(|v| (*v as f32).is_finite());
            let all = rest.split_whitespace().map(number).collect::<Option<Vec<f64>>>();
            all.filter(|all| all.len() >= least).ok_or_else(|| format!("line {place}: \"{line}\"; expected at least {least} numbers"))
        };
        match word {
            "v" => self.vertex(&numbers(3)?),
            "vt" => {
                let v = numbers(1)?;
                self.counts[1] += 1;
                self.clean.push_str(&format!("vt {} {}\n", v[0], v.get(1).copied().unwrap_or(0.0)));
            }
            "vn" => {
                let v = numbers(3)?;
                self.counts[2] += 1;
                self.clean.push_str(&format!("vn {} {} {}\n", v[0], v[1], v[2]));
            }
            "f" => self.face(place, rest, warnings)?,
            "l" | "p" => warnings.add("points and lines are not shown: only faces are"),
            "mtllib" | "usemtl" | "o" | "g" => self.named(word, mtl::name(whole)),
            "curv" | "curv2" | "surf" => warnings.add("free-form curves and surfaces are not shown: export polygons"),
            _ => {}
        }
        Ok(())
    }

    /// A vertex: its position and, if there are as many numbers, its colour.
    fn vertex(&mut self, v: &[f64]) {
        self.counts[0] += 1;
        let at = DVec3::from_slice(&v[..3]);
        if self.counts[0] == 1 && at.abs().max_element() > FAR {
            self.origin = at.round();
        }
        let from = (at - self.origin).as_vec3();
        self.positions.push(from.as_dvec3());
        self.clean.push_str(&format!("v {} {} {}", from.x, from.y, from.z));
        if let [_, _, _, r, g, b, ..] = v {
            self.coloured += 1;
            self.clean.push_str(&format!(" {r} {g} {b}"));
        }
        self.clean.push('\n');
    }

    /// A face with these corners.
    fn face(&mut self, place: usize, corners: &str, warnings: &mut Warnings) -> Result<(), String> {
        let (mut count, mut line) = (0, "f".to_owned());
        for corner in corners.split_whitespace() {
            let [v, vt, vn] = self.corner(place, corner)?;
            line.push_str(&format!(" {v}/{}/{}", vt.saturating_add(1), vn.saturating_add(1)));
            count += 1;
        }
        match count {
            0 | 1 => return Err(format!("line {place}: a face of {count} corners; expected at least 3")),
            // As old exporters write loose edges.
            2 => warnings.add("faces of two corners are not shown"),
            _ => {
                self.triangles += count - 2;
                self.clean.extend([&line, "\n"]);
            }
        }
        Ok(())
    }

    /// What a corner names, counted from 1; 0 for what it leaves out.
    fn corner(&mut self, place: usize, corner: &str) -> Result<[i64; 3], String> {
        let odd = || format!("line {place}: \"{corner}\"; expected v, v/vt, v//vn or v/vt/vn");
        let mut indices = [0; 3];
        for (i, part) in corner.split('/').enumerate() {
            let count = *self.counts.get(i).ok_or_else(odd)?;
            if part.is_empty() && i > 0 {
                continue;
            }
            let index: i64 = part.parse().map_err(|_| odd())?;
            if index == 0 || index < -count {
                return Err(format!("line {place}: index {index} of {count} {} so far", NAMED[i]));
            }
            indices[i] = if index < 0 { count + 1 + index } else { index };
            if indices[i] > self.highest[i].0 {
                self.highest[i] = (indices[i], place);
            }
        }
        Ok(indices)
    }

    /// A line whose first word comes before a name, which may be missing.
    fn named(&mut self, word: &str, name: &str) {
        match (word, name) {
            ("mtllib" | "usemtl", "") => {}
            ("mtllib", name) => self.libraries.push_str(&format!("mtllib {name}\n")),
            (word, "") => self.clean.extend([word, "\n"]),
            (word, name) => self.clean.push_str(&format!("{word} {name}\n")),
        }
    }

    /// The whole text, and where its vertices are counted from.
    fn finished(self, warnings: &mut Warnings) -> Result<(String, DVec3), String> {
        for (((highest, line), count), what) in self.highest.into_iter().zip(self.counts).zip(NAMED) {
            if highest > count {
                return Err(format!("line {line}: index {highest} of {count} {what}"));
            }
        }
        if self.triangles > MAX_TRIANGLES {
            return Err(too_many(self.triangles));
        }
        let clean = self.libraries + &cut(&self.clean, &self.positions);
        let (coloured, vertices) = (self.coloured, self.counts[0]);
        if coloured > 0 && coloured < vertices {
            warnings.add(format!("only {coloured} of {vertices} vertices have colours: they are ignored"));
            return Ok((without_colours(&clean), self.origin));
        }
        Ok((clean, self.origin))
    }
}

/// The same text, vertices without their colours.
fn without_colours(text: &str) -> String {
    let plain = |line: &str| match line.strip_prefix("v ") {
        Some(numbers) => format!("v {}\n", numbers.split(' ').take(3).collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    };
    text.lines().map(plain).collect()
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

/// The textures decoded so far, and which of them a colour's file and a mask's make.
#[derive(Default)]
struct Shelf {
    all: Vec<Texture>,
    known: HashMap<(PathBuf, Option<PathBuf>), u32>,
}

impl Shelf {
    fn get(&mut self, colour: PathBuf, mask: Option<PathBuf>) -> Result<u32, String> {
        let key = (colour, mask);
        if let Some(&known) = self.known.get(&key) {
            return Ok(known);
        }
        let read = |path: &Path| {
            let decoded = read_file(path).and_then(|b| picture::texture(&b, [Wrap::Repeat; 2], &self.all));
            decoded.map_err(|e| format!("texture {}: {e}", path.display()))
        };
        let mut texture = read(&key.0)?;
        // One picture for both: the mask is its alpha, if it has any.
        if let Some(mask) = key.1.as_ref().filter(|mask| **mask != key.0) {
            cut_out(&mut texture, &read(mask)?);
        }
        let at = self.all.len() as u32;
        self.all.push(texture);
        self.known.insert(key, at);
        Ok(at)
    }
}

/// Takes the alpha of `texture` from the red of `mask`, which may be of another size.
fn cut_out(texture: &mut Texture, mask: &Texture) {
    let [width, height, across, down] = [texture.width, texture.height, mask.width, mask.height].map(u64::from);
    let places = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    for (texel, [x, y]) in texture.texels.iter_mut().zip(places) {
        texel[3] = mask.texels[(y * down / height * across + x * across / width) as usize][0];
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
