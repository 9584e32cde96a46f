//! glTF files, sound and broken, written here byte by byte: what the loader makes of them.

use cubist_baker::scene::{Overrides, Scene, SceneError, Up, Wrap, load};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};
use std::path::Path;

/// A document under construction: binary chunk, buffer views and accessors.
struct Builder {
    json: Value,
    bin: Vec<u8>,
}

impl Builder {
    fn new() -> Self {
        let json = json!({ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
            "buffers": [{ "byteLength": 0 }], "bufferViews": [], "accessors": [], "meshes": [], "nodes": [] });
        Self { json, bin: Vec::new() }
    }

    fn list(&mut self, key: &str) -> &mut Vec<Value> {
        let object = self.json.as_object_mut().unwrap();
        object.entry(key).or_insert_with(|| json!([])).as_array_mut().unwrap()
    }

    fn push(&mut self, key: &str, value: Value) -> usize {
        self.list(key).push(value);
        self.list(key).len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }))
    }

    fn floats(&mut self, values: &[f32], kind: &str, width: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, kind, values.len() / width)
    }

    fn shorts(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5123, "SCALAR", values.len())
    }

    /// A mesh "roof" of one primitive at node 0.
    fn roof(&mut self, primitive: Value) {
        self.push("meshes", json!({ "name": "roof", "primitives": [primitive] }));
        self.push("nodes", json!({ "mesh": 0 }));
    }

    fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["byteLength"] = json!(self.bin.len());
        glb(json.to_string().as_bytes(), &self.bin)
    }

    fn load(&self) -> Result<Scene, SceneError> {
        load_bytes(&self.bytes())
    }

    fn error(&self) -> String {
        self.load().expect_err("a broken file loads").to_string()
    }
}

fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend((12 + 8 + json.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
    for (kind, data) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    out
}

fn load_bytes(bytes: &[u8]) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("village.glb");
    std::fs::write(&path, bytes).unwrap();
    load(&path, &Overrides::default())
}

const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

fn square() -> Builder {
    let mut b = Builder::new();
    let positions = b.floats(&SQUARE, "VEC3", 3);
    let indices = b.shorts(&[0, 1, 2, 0, 2, 3]);
    b.roof(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    b
}

fn png(pixels: &[[u8; 4]], width: u32) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(width, pixels.len() as u32 / width, pixels.concat()).unwrap();
    let mut out = std::io::Cursor::new(Vec::new());
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

fn area(scene: &Scene) -> DVec3 {
    scene.triangles.iter().map(|t| (t.position[1] - t.position[0]).cross(t.position[2] - t.position[0]) / 2.0).sum()
}

#[test]
fn lists_strips_and_fans_cover_the_same_square_facing_the_same_way() {
    for (mode, order) in [(4, [0u16, 1, 2, 0, 2, 3].as_slice()), (5, &[0, 1, 3, 2]), (6, &[0, 1, 2, 3])] {
        let mut b = Builder::new();
        let positions = b.floats(&SQUARE, "VEC3", 3);
        let indices = b.shorts(order);
        b.roof(json!({ "attributes": { "POSITION": positions }, "indices": indices, "mode": mode }));
        let scene = b.load().unwrap();
        assert_eq!(scene.triangles.len(), 2, "mode {mode}");
        assert!((area(&scene) - DVec3::Z).length() < 1e-12, "mode {mode}: {}", area(&scene));
    }
}

#[test]
fn fronts_show_alone_unless_both_sides_are_asked_for_and_stay_fronts_in_a_mirror() {
    for (material, front) in [(json!({}), true), (json!({ "doubleSided": true }), false)] {
        let mut b = square();
        b.push("materials", material);
        b.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        let scene = b.load().unwrap();
        let shown: Vec<bool> = scene.triangles.iter().map(|t| scene.materials[t.material as usize].front).collect();
        assert_eq!(shown, [front; 2]);
    }
    // Mirrored left to right, the square faces the same way; turned around, the other.
    for (node, facing) in [(json!({ "mesh": 0, "scale": [-1, 1, 1] }), 1.0), (json!({ "mesh": 0, "rotation": [0, 1, 0, 0] }), -1.0)] {
        let mut b = square();
        b.json["nodes"][0] = node;
        assert!((area(&b.load().unwrap()).z - facing).abs() < 1e-12);
    }
}

#[test]
fn a_model_alone_gets_an_orbit_that_shows_all_of_it_and_a_light() {
    let scene = square().load().unwrap();
    assert_eq!((scene.playback.width, scene.playback.height, scene.playback.frames, scene.playback.fps), (320, 240, 120, 30));
    assert!(scene.playback.looping);
    assert_eq!(scene.lights.len(), 1);
    for s in [0.0, 0.3, 0.8] {
        let pose = scene.camera.pose(s);
        assert!((pose.forward.y + 20f64.to_radians().sin()).abs() < 1e-12);
        for corner in scene.triangles.iter().flat_map(|t| t.position) {
            let d = corner - pose.eye;
            assert!(d.dot(pose.up).abs() / d.dot(pose.forward) < 22.5f64.to_radians().tan());
        }
    }
}

#[test]
fn masks_blends_and_wrap_modes() {
    let mut b = Builder::new();
    let positions = b.floats(&SQUARE, "VEC3", 3);
    let uvs = b.floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0], "VEC2", 2);
    let picture = png(&[[255, 0, 0, 255], [0, 255, 0, 10]], 2);
    let view = b.view(&picture);
    b.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
    b.push("samplers", json!({ "wrapS": 33071, "wrapT": 33648 }));
    b.push("textures", json!({ "source": 0, "sampler": 0 }));
    let texture = json!({ "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0.0], "scale": [2.0, 1.0] } } });
    b.push(
        "materials",
        json!({ "alphaMode": "MASK", "alphaCutoff": 0.25,
        "pbrMetallicRoughness": { "baseColorTexture": texture, "baseColorFactor": [0.5, 1.0, 0.25, 0.75] } }),
    );
    b.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    b.roof(json!({ "attributes": { "POSITION": positions, "TEXCOORD_0": uvs }, "mode": 6, "material": 0 }));
    let scene = b.load().unwrap();
    let m = &scene.materials[scene.triangles[0].material as usize];
    assert_eq!((m.alpha_cutoff, m.alpha, m.texture, m.colour), (Some(0.25), 0.75, Some(0), Vec3::new(0.5, 1.0, 0.25)));
    let t = &scene.textures[0];
    assert_eq!((t.wrap, t.texels.as_slice()), ([Wrap::Clamp, Wrap::Mirror], [[255, 0, 0, 255], [0, 255, 0, 10]].as_slice()));
    // The fan starts with corners 1 and 2: (1, 1) goes to (2.5, 1).
    assert_eq!(scene.triangles[0].uv[0].to_array(), [2.5, 1.0]);
    assert!(scene.lights.is_empty());

    b.json["materials"][0]["alphaMode"] = json!("BLEND");
    let scene = b.load().unwrap();
    assert_eq!(scene.materials[0].alpha_cutoff, Some(0.5));
    assert_eq!(scene.warnings.iter().filter(|w| w.contains("BLEND")).count(), 1, "{:?}", scene.warnings);
}

#[test]
fn colours_of_every_kind_and_emission() {
    let mut b = Builder::new();
    let positions = b.floats(&SQUARE, "VEC3", 3);
    let bytes: Vec<u8> = [[0u16, 65535, 32768, 65535]; 4].concat().iter().flat_map(|v| v.to_le_bytes()).collect();
    let colours = b.accessor(&bytes, 5123, "VEC4", 4);
    b.list("accessors")[colours]["normalized"] = json!(true);
    b.push("materials", json!({ "emissiveFactor": [0.25, 0.5, 1.0], "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] } }));
    b.push("materials", json!({ "extensions": { "KHR_materials_unlit": {}, "KHR_materials_pbrSpecularGlossiness": { "diffuseFactor": [0.1, 0.2, 0.3, 1] } } }));
    // No mesh has this one: how it blends is no matter.
    b.push("materials", json!({ "alphaMode": "BLEND" }));
    let primitive = |material: u32| json!({ "attributes": { "POSITION": positions, "COLOR_0": colours }, "mode": 6, "material": material });
    b.push("meshes", json!({ "primitives": [primitive(1), primitive(0)] }));
    b.push("nodes", json!({ "mesh": 0 }));
    let scene = b.load().unwrap();
    assert!(!scene.warnings.iter().any(|warning| warning.contains("BLEND")), "{:?}", scene.warnings);
    let t = &scene.triangles[0];
    assert!((t.colour[0] - Vec3::new(0.0, 1.0, 0.5)).length() < 1e-4);
    assert_eq!((scene.materials[0].colour, scene.materials[0].unlit), (Vec3::new(0.25, 0.5, 1.0), true));
    assert_eq!((scene.materials[1].colour, scene.materials[1].unlit), (Vec3::new(0.1, 0.2, 0.3), true));
    assert!(scene.lights.is_empty(), "vertex colours need no light");
}

#[test]
fn instances_sparse_accessors_and_quantised_positions() {
    let mut b = Builder::new();
    // Corners as signed bytes, 0..=127 for 0..=1, padded to four bytes; corner 2 moved by a sparse substitute.
    let view = b.view(&[0, 0, 0, 0, 127, 0, 0, 0, 127, 127, 0, 0, 0, 127, 0, 0]);
    b.list("bufferViews")[view]["byteStride"] = json!(4);
    let (at, with) = (b.view(&[2]), b.view(&[127, 127, 127]));
    b.push(
        "accessors",
        json!({ "bufferView": view, "componentType": 5120, "normalized": true, "type": "VEC3", "count": 4,
        "sparse": { "count": 1, "indices": { "bufferView": at, "componentType": 5121 }, "values": { "bufferView": with } } }),
    );
    b.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    b.push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 6 }] }));
    b.push("nodes", json!({ "children": [1, 2], "translation": [10, 0, 0] }));
    b.push("nodes", json!({ "mesh": 0, "scale": [2, 2, 2] }));
    b.push("nodes", json!({ "mesh": 0, "rotation": [0, FRAC_1_SQRT_2, 0, FRAC_1_SQRT_2] }));
    let scene = b.load().unwrap();
    assert_eq!(scene.triangles.len(), 4);
    let near = |a: DVec3, b: [f64; 3]| assert!((a - DVec3::from_array(b)).length() < 1e-6, "{a} is not {b:?}");
    // A fan's first triangle is corners 1, 2, 0.
    near(scene.triangles[0].position[0], [12.0, 0.0, 0.0]);
    near(scene.triangles[0].position[1], [12.0, 2.0, 2.0]);
    near(scene.triangles[2].position[0], [10.0, 0.0, -1.0]);
}

#[test]
fn skins_stand_where_their_joints_are_at_rest() {
    let mut b = Builder::new();
    let positions = b.floats(&SQUARE, "VEC3", 3);
    let joints = b.accessor(&[[1u8, 0, 0, 0]; 4].concat(), 5121, "VEC4", 4);
    let weights = b.floats(&[[0.5f32, 0.0, 0.0, 0.0]; 4].concat(), "VEC4", 4);
    b.push(
        "meshes",
        json!({ "primitives": [{ "attributes": { "POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights }, "mode": 6 }] }),
    );
    b.push("nodes", json!({ "mesh": 0, "skin": 0, "translation": [100, 0, 0], "children": [1] }));
    b.push("nodes", json!({ "translation": [0, 5, 0] }));
    b.push("skins", json!({ "joints": [0, 1] }));
    let scene = b.load().unwrap();
    // The node's own transform does not count twice: joint 1 is at (100, 5, 0).
    assert_eq!(scene.triangles[0].position[2], DVec3::new(100.0, 5.0, 0.0));
    assert!(scene.warnings.iter().any(|w| w.contains("skinned")));
    b.json["skins"][0]["joints"] = json!([0]);
    assert!(b.error().contains("mesh 0: primitive 0: vertex 0: joint 1 of 1"), "{}", b.error());
}

#[test]
fn a_camera_follows_its_animated_parent_through_a_scene_file() {
    let mut b = square();
    let times = b.floats(&[1.0, 3.0], "SCALAR", 1);
    let places = b.floats(&[0.0, 0.0, 4.0, 8.0, 0.0, 4.0], "VEC3", 3);
    b.json["scenes"][0]["nodes"] = json!([0, 1]);
    b.push("cameras", json!({ "name": "Flight", "type": "perspective", "perspective": { "yfov": FRAC_PI_4, "znear": 0.1 } }));
    b.push("nodes", json!({ "name": "Rig", "children": [2] }));
    b.push("nodes", json!({ "name": "Lens", "camera": 0, "translation": [0, 1, 0] }));
    b.push("animations", json!({ "channels": [
        { "sampler": 0, "target": { "node": 1, "path": "translation" } },
        { "sampler": 0, "target": { "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": "/cameras/0/perspective/yfov" } } } },
    ], "samplers": [{ "input": times, "output": places }] }));
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("flug über.glb"), b.bytes()).unwrap();
    let file = folder.path().join("scene.toml");
    let write = |camera: &str| std::fs::write(&file, format!("[scene]\nmodel = \"flug über.glb\"\n[camera]\n{camera}\n")).unwrap();
    for name in ["Flight", "Lens"] {
        write(&format!("gltf = \"{name}\""));
        let scene = load(&file, &Overrides::default()).unwrap();
        let pose = scene.camera.pose(0.25);
        assert_eq!(pose.eye, DVec3::new(2.0, 1.0, 4.0));
        assert_eq!(pose.forward, DVec3::NEG_Z);
        assert!((pose.fov - 45.0).abs() < 1e-5);
        assert!(scene.warnings.iter().any(|w| w.contains("/cameras/0/perspective/yfov")), "{:?}", scene.warnings);
    }
    // A model that is stood up takes its cameras along.
    let over = Overrides { up: Some(Up::Z), ..Overrides::default() };
    let pose = load(&file, &over).unwrap().camera.pose(0.25);
    assert_eq!((pose.eye, pose.forward, pose.right), (DVec3::new(2.0, 4.0, -1.0), DVec3::NEG_Y, DVec3::X));
    write("gltf = \"Nobody\"");
    let e = load(&file, &Overrides::default()).err().unwrap().to_string();
    assert!(e.contains("line 4") && e.contains("camera.gltf") && e.contains("\"Flight\""), "{e}");
}

#[test]
fn nodes_stand_at_their_first_key() {
    let mut b = square();
    let times = b.floats(&[0.0, 1.0], "SCALAR", 1);
    let places = b.floats(&[0.0, 7.0, 0.0, 8.0, 0.0, 4.0], "VEC3", 3);
    b.push(
        "animations",
        json!({ "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        "samplers": [{ "input": times, "output": places, "interpolation": "STEP" }] }),
    );
    let scene = b.load().unwrap();
    assert_eq!(scene.triangles[0].position[0].y, 7.0);
    assert!(scene.warnings.iter().any(|w| w.contains("first keys")));
}

#[test]
fn an_index_out_of_range_names_mesh_primitive_and_index() {
    let mut b = Builder::new();
    let positions = b.floats(&SQUARE, "VEC3", 3);
    let indices = b.shorts(&[0, 1, 99]);
    b.roof(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    assert!(b.error().ends_with("village.glb: mesh \"roof\": primitive 0: index 99 of 4 vertices: export the file again"), "{}", b.error());
}

#[test]
fn every_kind_of_damage_is_an_error_that_says_so() {
    let bad = |change: &dyn Fn(&mut Builder), expected: &str| {
        let mut b = square();
        change(&mut b);
        let e = b.error();
        assert!(e.contains(expected) && e.contains("village.glb"), "expected \"{expected}\" in: {e}");
    };
    bad(&|b| b.bin[16..20].copy_from_slice(&f32::NAN.to_le_bytes()), "position 1 is");
    bad(&|b| b.list("accessors")[0]["count"] = json!(5), "accessor 0: 5 elements need 60 bytes");
    bad(&|b| b.list("accessors")[0]["count"] = json!(u64::MAX), "accessor 0: count");
    bad(&|b| b.json["accessors"][0] = json!({ "componentType": 5126, "type": "VEC3", "count": 40_000_000 }), "accessor 0: count");
    bad(
        &|b| b.json["accessors"][1] = json!({ "bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": 3 }),
        "indices: componentType",
    );
    bad(&|b| b.list("accessors")[0]["byteOffset"] = json!(u64::MAX), "accessor 0");
    bad(&|b| b.list("accessors")[0]["type"] = json!("VEC2"), "expected [Vec3]");
    bad(&|b| b.list("accessors")[0]["componentType"] = json!(7), "unknown type or componentType");
    bad(&|b| b.list("bufferViews")[0]["byteStride"] = json!(4), "byteStride 4 is shorter");
    bad(&|b| b.list("bufferViews")[0]["byteLength"] = json!(4000), "bufferView 0");
    bad(&|b| b.list("bufferViews")[0]["byteOffset"] = json!(u64::MAX), "bufferView 0");
    bad(&|b| b.list("bufferViews")[0]["buffer"] = json!(3), "buffer 3 of 1");
    bad(&|b| b.list("meshes")[0]["primitives"][0]["attributes"]["POSITION"] = json!(77), "accessor 77");
    bad(&|b| b.list("meshes")[0]["primitives"][0]["indices"] = json!(78), "accessor 78");
    bad(&|b| b.list("meshes")[0]["primitives"][0]["material"] = json!(3), "material 3 of 0");
    bad(&|b| b.list("meshes")[0]["primitives"][0]["mode"] = json!(9), "unknown mode");
    bad(&|b| b.list("nodes")[0]["mesh"] = json!(5), "mesh 5 of 1");
    bad(&|b| b.list("nodes")[0]["children"] = json!([9]), "child 9 of 1 nodes");
    bad(&|b| b.list("nodes")[0]["children"] = json!([0]), "its own ancestor");
    bad(&|b| b.list("nodes")[0]["skin"] = json!(0), "skin 0: not among");
    bad(&|b| b.json["scene"] = json!(4), "scene 4 of 1");
    bad(&|b| b.json["scenes"][0]["nodes"] = json!([7]), "node 7 of 1");
    bad(&|b| b.json["scenes"][0]["nodes"] = json!([]), "no triangles");
    bad(&|b| b.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression");
    bad(&|b| b.json["asset"]["version"] = json!("1.0"), "asset.version");
    bad(&|b| b.json["nodes"] = json!("none"), "not a valid glTF");
    bad(&|b| b.list("nodes")[0]["scale"] = json!([0, 0, 0]), "all 2 triangles are degenerate");
    bad(&|b| b.list("nodes")[0]["scale"] = json!([1e30, 1e30, 1e30]), "not a number or beyond");
    bad(&|b| b.json["images"] = json!([{ "uri": "no%20roof.png" }]), "no roof.png: no such file");
    bad(&|b| b.json["images"] = json!([{ "uri": "https://example.com/roof.png" }]), "never fetched");
    bad(&|b| b.list("buffers").push(json!({ "uri": "walls.bin", "byteLength": 4 })), "walls.bin: no such file");
    bad(&|b| b.list("buffers").push(json!({ "uri": "data:;base64,AAAA", "byteLength": 4 })), "3 bytes; byteLength promises 4");
    bad(
        &|b| {
            b.push("animations", json!({ "channels": [{ "sampler": 0, "target": { "node": 8, "path": "scale" } }], "samplers": [] }));
        },
        "node 8 of 1",
    );
    bad(
        &|b| {
            b.push("animations", json!({ "channels": [{ "sampler": 1, "target": { "node": 0, "path": "scale" } }], "samplers": [] }));
        },
        "sampler 1 of 0",
    );
    bad(
        &|b| {
            let sparse = json!({ "count": 1, "indices": { "bufferView": 1, "byteOffset": 4, "componentType": 5123 }, "values": { "bufferView": 0 } });
            b.list("accessors")[0]["sparse"] = sparse;
            b.bin[52] = 200;
        },
        "sparse: index 200 of 4 elements",
    );
}

#[test]
fn broken_textures_name_their_material() {
    let mut b = square();
    let view = b.view(b"this is no picture");
    b.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
    b.push("textures", json!({ "source": 0 }));
    b.push("materials", json!({ "name": "tiles", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    b.list("meshes")[0]["primitives"][0]["material"] = json!(0);
    assert!(b.error().contains("material \"tiles\": image 0: not a picture"), "{}", b.error());
    b.json["textures"][0]["source"] = json!(9);
    assert!(b.error().contains("image 9 of 1"), "{}", b.error());
    // Without a picture we read, the model still shows, and says what is missing.
    b.json["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
    let scene = b.load().unwrap();
    assert!(scene.warnings.iter().any(|w| w.contains("no PNG, JPEG or WebP")), "{:?}", scene.warnings);
}

#[test]
fn pictures_may_be_webp() {
    let mut b = square();
    let mut webp = std::io::Cursor::new(Vec::new());
    image::DynamicImage::new_rgb8(4, 2).write_to(&mut webp, image::ImageFormat::WebP).unwrap();
    let view = b.view(webp.get_ref());
    b.push("images", json!({ "bufferView": view, "mimeType": "image/webp" }));
    b.push("textures", json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } }));
    b.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    b.list("meshes")[0]["primitives"][0]["material"] = json!(0);
    b.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
    b.json["extensionsUsed"] = json!(["EXT_texture_webp"]);
    let scene = b.load().unwrap();
    assert!(scene.textures.iter().any(|t| (t.width, t.height) == (4, 2)));
    assert!(scene.warnings.iter().all(|w| !w.contains("picture") && !w.contains("webp")), "{:?}", scene.warnings);
}

#[test]
fn truncation_anywhere_and_any_single_damaged_byte_never_panic() {
    let bytes = square().bytes();
    for end in 0..bytes.len() {
        assert!(load_bytes(&bytes[..end]).is_err(), "{end} bytes of {} load", bytes.len());
    }
    for at in (0..bytes.len()).step_by(3) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        // It may still be a file; it may not be a panic.
        let _ = load_bytes(&damaged);
    }
    for (bytes, expected) in [
        (b"glTF\x02\0\0\0\x0c\0\0\0".to_vec(), "no JSON chunk"),
        (b"glTF\x02\0\0\0\x05\0\0\0".to_vec(), "no JSON chunk"),
        (b"glTF\x02\0\0\0\x14\0\0\0\0\0\0\0UNKN".to_vec(), "the first chunk is \"UNKN\""),
        (b"glTF\x01\0\0\0\x0c\0\0\0".to_vec(), "version 1"),
        (glb(b"{]", b""), "the JSON cannot be read"),
        (glb(b"{\"asset\":{\"version\":\"2.0\"}}", b""), "no triangles"),
        (Vec::new(), "the file is empty"),
    ] {
        let e = load_bytes(&bytes).err().unwrap().to_string();
        assert!(e.contains(expected), "expected \"{expected}\" in: {e}");
    }
}

#[test]
fn files_beside_the_model_are_found_under_encoded_names() {
    let folder = tempfile::tempdir().unwrap();
    let b = square();
    let mut json = b.json.clone();
    json["buffers"][0] = json!({ "uri": "data%20%C3%A9.bin", "byteLength": b.bin.len() });
    std::fs::write(folder.path().join("data é.bin"), &b.bin).unwrap();
    let path = folder.path().join("m.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    assert_eq!(load(&path, &Overrides::default()).unwrap().triangles.len(), 2);
    // A folder of models beside one of their data is usual. A path from the root is another machine's.
    std::fs::create_dir(folder.path().join("models")).unwrap();
    let (below, absolute) = (folder.path().join("models/m.gltf"), folder.path().join("data é.bin"));
    for (uri, read) in [("../data%20%C3%A9.bin", true), (absolute.to_str().unwrap(), false)] {
        json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&below, json.to_string()).unwrap();
        match load(&below, &Overrides::default()) {
            Ok(scene) => assert!(read && scene.triangles.len() == 2, "{uri}"),
            Err(e) => assert!(!read && e.to_string().contains("an absolute path is not read"), "{uri}: {e}"),
        }
    }
    let e = load(folder.path().join("none.glb").as_path(), &Overrides::default()).err().unwrap().to_string();
    assert!(e.contains("none.glb: no such file"), "{e}");
    std::fs::create_dir(folder.path().join("dir.glb")).unwrap();
    let e = load(Path::new(&folder.path().join("dir.glb")), &Overrides::default()).err().unwrap().to_string();
    assert!(e.contains("is a directory"), "{e}");
}
