//! OBJ, PLY and STL files, written here: what the loaders make of them.

use cubist_baker::scene::{Overrides, Scene, load};
use glam::{DVec3, Vec2, Vec3};
use std::path::Path;

fn with(files: &[(&str, &[u8])], open: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    load(&folder.path().join(open), &Overrides::default()).map_err(|e| e.to_string())
}

fn save_png(colour: [u8; 3]) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 2, image::Rgb(colour)).write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

const QUAD: &str = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n";

#[test]
fn obj_with_materials_textures_and_quads() {
    let obj = format!("mtllib my mats.mtl\n{QUAD}usemtl red paint\nf 1/1/1 2/2/1 3/3/1 4/4/1\nusemtl wall\nf -4/-4 -3/-3 -2/-2\n");
    let mtl = b"newmtl red paint\nKd 1 0.5 0\nNs odd\nnewmtl wall\nKd 0 0 0\nmap_Kd -s 1 1 1 wall.png\nillum x\n";
    let scene = with(&[("a.obj", obj.as_bytes()), ("my mats.mtl", mtl), ("wall.png", &save_png([9, 8, 7]))], "a.obj").unwrap();
    assert_eq!((scene.triangles.len(), scene.textures.len(), scene.lights.len()), (3, 1, 0));
    let t = &scene.triangles[0];
    assert_eq!(scene.materials[t.material as usize].colour, Vec3::new(1.0, 0.5, 0.0));
    assert_eq!((t.normal[0], t.uv[0], t.uv[2]), (Vec3::Z, Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0)));
    let wall = &scene.materials[scene.triangles[2].material as usize];
    assert_eq!((wall.texture, wall.colour), (Some(0), Vec3::ONE));
    assert_eq!(scene.triangles[2].normal, [Vec3::ZERO; 3]);
    assert!(scene.warnings.iter().any(|w| w.contains("Kd is black")));
}

#[test]
fn a_model_with_a_small_print_gets_a_light() {
    let obj = format!("mtllib m.mtl\n{QUAD}v 9 0 0\nusemtl paint\nf 1 5 3\nusemtl print\nf 1/1 2/2 3/3\n");
    let mtl = b"newmtl paint\nKd 1 0.5 0\nnewmtl print\nmap_Kd wall.png\n";
    let scene = with(&[("a.obj", obj.as_bytes()), ("m.mtl", mtl), ("wall.png", &save_png([9, 8, 7]))], "a.obj").unwrap();
    assert_eq!((scene.textures.len(), scene.lights.len()), (1, 1));
    assert!(scene.warnings.iter().any(|w| w.starts_with("most of the model has neither textures")), "{:?}", scene.warnings);
}

#[test]
fn paths_from_the_root_lead_to_files_beside_the_model() {
    let obj = format!("mtllib C:\\models\\a.mtl\n{QUAD}usemtl wall\nf 1/1 2/2 3/3\n");
    let files: [(&str, &[u8]); 3] =
        [("a.obj", obj.as_bytes()), ("a.mtl", b"newmtl wall\nmap_Kd /home/somebody/wall.png\n"), ("wall.png", &save_png([9, 8, 7]))];
    let scene = with(&files, "a.obj").unwrap();
    assert_eq!(scene.textures[0].texels[0], [9, 8, 7, 255]);
    let error = with(&files[..2], "a.obj").unwrap_err();
    assert!(error.contains("wall.png") && !error.contains("somebody"), "{error}");
}

#[test]
fn obj_without_its_library_is_white_and_says_so() {
    let scene = with(&[("a.obj", format!("mtllib gone.mtl\n{QUAD}usemtl x\nf 1 2 3\nl 1 2\n").as_bytes())], "a.obj").unwrap();
    assert!(scene.warnings.iter().any(|w| w.contains("gone.mtl")), "{:?}", scene.warnings);
    assert!(scene.warnings.iter().any(|w| w.contains("lines are not shown")));
    assert_eq!((scene.materials[0].colour, scene.lights.len()), (Vec3::ONE, 1));
}

#[test]
fn obj_vertex_colours_and_the_texture_of_a_scene_file() {
    let scene = with(&[("c.obj", b"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n")], "c.obj").unwrap();
    assert_eq!(scene.triangles[0].colour, [Vec3::X, Vec3::Y, Vec3::Z]);
    assert!(scene.lights.is_empty());
    let toml = b"[scene]\nmodel = \"a.obj\"\ntexture = \"skin.png\"\n";
    let files: [(&str, &[u8]); 3] =
        [("s.toml", toml), ("a.obj", &[QUAD.as_bytes(), b"f 1/1 2/2 3/3"].concat()), ("skin.png", &save_png([1, 2, 3]))];
    let scene = with(&files, "s.toml").unwrap();
    assert_eq!(scene.textures[scene.materials[0].texture.unwrap() as usize].texels[0], [1, 2, 3, 255]);
    let e = with(&files[..2], "s.toml").unwrap_err();
    assert!(e.contains("line 3: scene.texture: no such file"), "{e}");
}

#[test]
fn obj_faults_name_file_and_line() {
    for (text, expected) in [
        ("v 0 0 0\nf 1 2 3\n", "a.obj: line 2: index 3 of 1 vertices"),
        ("v 0 0\n", "a.obj: line 1"),
        ("v 0 0 0\nf 1\n", "a.obj: line 2: a face of 1 corners"),
        ("# nothing\n", "no triangles"),
        ("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", "all 1 triangles are degenerate"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", "a.obj: line 2"),
    ] {
        let e = with(&[("a.obj", text.as_bytes())], "a.obj").unwrap_err();
        assert!(e.contains(expected), "expected \"{expected}\" in: {e}");
    }
    for utf16 in [b"\xff\xfe\x00v", b"\xfe\xff\x00v"] {
        let e = with(&[("a.obj", utf16)], "a.obj").unwrap_err();
        assert!(e.contains("a.obj: text in UTF-16; expected UTF-8"), "{e}");
    }
    assert!(with(&[("a.obj", b"\xff\x00v")], "a.obj").is_err());
}

const HEAD: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

fn binary(big: bool) -> Vec<u8> {
    let mut out = format!("ply\nformat binary_{}_endian 1.0\n{HEAD}", if big { "big" } else { "little" }).into_bytes();
    let corners = [[0f32, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
    for (i, [x, y]) in corners.into_iter().enumerate() {
        let z = i as f64 / 4.0;
        if big {
            out.extend(x.to_be_bytes());
            out.extend(y.to_be_bytes());
            out.extend(z.to_be_bytes());
        } else {
            out.extend(x.to_le_bytes());
            out.extend(y.to_le_bytes());
            out.extend(z.to_le_bytes());
        }
        out.extend([255, 51, 0]);
    }
    out.push(4);
    for i in 0..4i32 {
        out.extend(if big { i.to_be_bytes() } else { i.to_le_bytes() });
    }
    out
}

#[test]
fn ply_ascii_and_binary_agree() {
    let ascii = format!("ply\nformat ascii 1.0\n{HEAD}0 0 0 255 51 0\n2 0 0.25 255 51 0\n2 1 0.5 255 51 0\n0 1 0.75 255 51 0\n4 0 1 2 3\n");
    for bytes in [ascii.into_bytes(), binary(false), binary(true)] {
        let scene = with(&[("a.ply", &bytes)], "a.ply").unwrap();
        assert_eq!(scene.triangles.len(), 2);
        assert_eq!(scene.triangles[1].position, [DVec3::ZERO, DVec3::new(2.0, 1.0, 0.5), DVec3::new(0.0, 1.0, 0.75)]);
        assert!((scene.triangles[0].colour[1] - Vec3::new(1.0, 0.2, 0.0)).length() < 1e-6);
        assert!(scene.lights.is_empty());
    }
}

#[test]
fn colours_of_ply_faces_are_told() {
    let head = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty uchar red\n";
    let text = format!("ply\nformat ascii 1.0\n{head}end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255\n");
    let scene = with(&[("a.ply", text.as_bytes())], "a.ply").unwrap();
    assert!(scene.warnings.iter().any(|w| w.starts_with("the colours of faces")), "{:?}", scene.warnings);
}

#[test]
fn ply_faults_are_errors() {
    let ascii = |head: &str, body: &str| format!("ply\nformat ascii 1.0\n{head}end_header\n{body}").into_bytes();
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let many = format!("ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n{xyz}{face}end_header\n").into_bytes();
    let empty = format!("ply\nformat binary_little_endian 1.0\nelement junk 4000000000\nelement vertex 0\n{xyz}end_header\n").into_bytes();
    for (bytes, expected) in [
        (ascii(&format!("element vertex 1\n{xyz}"), "0 0 0\n"), "no faces"),
        (ascii(&format!("element vertex 1\n{xyz}{face}"), "0 0 0\n3 0 0 7\n"), "face 0: index 7 of 1 vertices"),
        (ascii(&format!("element vertex 1\n{xyz}{face}"), "0 0 0\n3 0 0 -1\n"), "face 0: index -1 of 1 vertices"),
        (ascii(&format!("element vertex 1\n{xyz}{face}"), "0 nan 0\n3 0 0 0\n"), "element vertex: Line 10"),
        (ascii(&format!("element vertex 2\n{xyz}{face}"), "0 0 0\n"), "element vertex"),
        (ascii("element vertex 1\nproperty float x\n", "0\n"), "no property y"),
        (many, "need at least"),
        (empty, "without properties"),
        (ascii("made by a tool\n", ""), "header: Line 3: Couldn't parse line. String: 'made by a tool ': expected a PLY file"),
        (b"plx\n".to_vec(), "header"),
        (Vec::new(), "header"),
    ] {
        let e = with(&[("a.ply", &bytes)], "a.ply").unwrap_err();
        assert!(e.contains("a.ply") && e.contains(expected), "expected \"{expected}\" in: {e}");
    }
    let whole = binary(false);
    let mut damaged = whole.clone();
    let at = damaged.windows(10).position(|w| w == b"end_header").unwrap() + 11;
    damaged[at..at + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(with(&[("a.ply", &damaged)], "a.ply").unwrap_err().contains("vertex 0"));
    for end in 0..whole.len() {
        assert!(with(&[("a.ply", &whole[..end])], "a.ply").is_err(), "{end} bytes load");
    }
}

#[test]
fn an_unknown_ending_is_told_what_is_expected() {
    let e = with(&[("a.fbx", b"Kaydara")], "a.fbx").unwrap_err();
    assert!(e.contains(".fbx") && e.contains(".glb") && e.contains(".stl"), "{e}");
    let e = load(Path::new("/no/such/file"), &Overrides::default()).err().unwrap().to_string();
    assert!(e.contains("no such file"), "{e}");
}

/// Two triangles that stand on the plane of x and y, Z up, as a binary STL file.
fn stl(head: &str) -> Vec<u8> {
    let mut out = format!("{head:80}").into_bytes();
    out.extend(2u32.to_le_bytes());
    for last in [[0f32, 0.0, 3.0], [0.0, -1.0, 3.0]] {
        // Its normal says nothing true.
        for number in [9.0, 9.0, 9.0].into_iter().chain([0.0, 0.0, 0.0, 2.0, 0.0, 0.0]).chain(last) {
            out.extend(number.to_le_bytes());
        }
        out.extend([0, 0]);
    }
    out
}

const STL: &str = "solid a b\r\nfacet normal 0 0 0\r\n outer loop\r\n  vertex 0 0 0\r\n  vertex 2 0 0\r\n  vertex 0 0 3e0\r\n endloop\r\nendfacet\r\nendsolid a b\r\n\
                   SOLID\nFACET NORMAL 0 0 0\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 2.0E+0 0 0\nVERTEX 0 -1 3\nENDLOOP\nENDFACET\n\nENDSOLID\n";

#[test]
fn stl_binary_and_text_agree_and_stand_up() {
    for bytes in [stl("by hand"), stl("solid, says the head"), STL.as_bytes().to_vec(), [&stl(""), &b"left over"[..]].concat()] {
        let scene = with(&[("a.stl", &bytes)], "a.stl").unwrap();
        let positions: Vec<_> = scene.triangles.iter().map(|t| t.position[2]).collect();
        assert_eq!(positions, [DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.0, 3.0, 1.0)]);
        assert_eq!((scene.triangles[0].position[1], scene.triangles[0].normal), (DVec3::X * 2.0, [Vec3::ZERO; 3]));
        assert_eq!(scene.lights.len(), 1);
    }
}

#[test]
fn stl_faults_say_what_is_wrong() {
    let text = |end: usize| STL.as_bytes()[..end].to_vec();
    for (bytes, expected) in [
        (stl("")[..183].to_vec(), "2 triangles need 184 bytes, but the file has 183"),
        (Vec::new(), "0 bytes; expected 84 at least"),
        (b"STLF or so".to_vec(), "10 bytes"),
        (text(100), "triangle 0"),
        (text(STL.len() - 20), "triangle 1"),
        (b"solid\nendsolid\n".to_vec(), "no triangles"),
    ] {
        let e = with(&[("a.stl", &bytes)], "a.stl").unwrap_err();
        assert!(e.contains("a.stl: ") && e.contains(expected), "expected \"{expected}\" in: {e}");
    }
}
