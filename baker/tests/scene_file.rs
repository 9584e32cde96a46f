//! Scene files and heightfields, written here: what is taken, and what the errors say.

use cubist_baker::scene::{Background, Overrides, Scene, Up, load, load_builtin};
use glam::{DVec3, Vec3};
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn scene_with(text: &str, prepare: impl FnOnce(&Path), overrides: &Overrides) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), OBJ).unwrap();
    prepare(folder.path());
    let file = folder.path().join("szene eins.toml");
    std::fs::write(&file, text).unwrap();
    load(&file, overrides).map_err(|e| e.to_string())
}

fn scene(text: &str) -> Result<Scene, String> {
    scene_with(text, |_| {}, &Overrides::default())
}

#[test]
fn a_whole_scene_file() {
    let text = r##"
        [scene]
        model = "a.obj"
        background = "#a8c0d8"
        [camera]
        fov = 50
        orbit = { target = [0, 1, 0], radius = 4, azimuth = [0, 180], elevation = [20, 20] }
        [playback]
        size = [100, 80]
        frames = 11
        fps = 25
        looping = true
        [[light]]
        direction = [0, -2, 0]
        colour = "#ff0000"
        [[light]]
        direction = [1, 0, 0]
        intensity = 0.5
        [effects]
    "##;
    let s = scene(text).unwrap();
    assert_eq!((s.name.as_str(), s.playback.width, s.playback.height, s.playback.frames, s.playback.fps), ("szene eins", 100, 80, 11, 25));
    assert!(s.playback.looping && matches!(s.background, Background::Colour([0xa8, 0xc0, 0xd8])));
    assert_eq!((s.lights[0].direction, s.lights[0].colour, s.lights[1].intensity), (Vec3::NEG_Y, Vec3::X, 0.5));
    let pose = s.camera.pose(0.5);
    let (sin, cos) = 20f64.to_radians().sin_cos();
    assert!((pose.eye - DVec3::new(4.0 * cos, 1.0 + 4.0 * sin, 0.0)).length() < 1e-12 && pose.fov == 50.0);
    let over = Overrides { size: Some((64, 48)), frames: Some(3), fps: Some(10), looping: Some(false), up: None };
    let s = scene_with(text, |_| {}, &over).unwrap();
    assert_eq!((s.playback.width, s.playback.height, s.playback.frames, s.playback.fps, s.playback.looping), (64, 48, 3, 10, false));
    let e = scene_with(text, |_| {}, &Overrides { size: Some((0, 48)), ..over }).unwrap_err();
    assert!(e.contains("--size"), "{e}");
}

#[test]
fn every_kind_of_path() {
    let path = |camera: &str| scene(&format!("[scene]\nmodel = \"a.obj\"\n[camera]\n{camera}\n")).unwrap().camera;
    let line = path("line = { from = [0, 2, 9], to = [0, 2, -9], look = [0, 0, -3] }");
    assert_eq!((line.pose(0.5).eye, line.pose(0.5).forward), (DVec3::new(0.0, 2.0, 0.0), DVec3::NEG_Z));
    let spline = path("spline = { points = [[0, 0, 9], [4, 0, 0], [0, 0, -9]], look_at = [[0, 0, 0], [0, 1, 0]] }");
    assert_eq!(spline.pose(0.5).eye, DVec3::new(4.0, 0.0, 0.0));
    assert_eq!(spline.pose(1.0).eye, DVec3::new(0.0, 0.0, -9.0));
    let still = path("spline = { points = [[0, 0, 9], [0, 0, 5]], look_at = [0, 0, 0] }");
    assert_eq!(still.pose(1.0).forward, DVec3::NEG_Z);
    let pivot = path("pivot = { eye = [0, 2, 0], azimuth = [0, 90] }\nup = [1, 0, 0]");
    assert_eq!((pivot.pose(0.0).forward, pivot.pose(0.0).up), (DVec3::Z, DVec3::X));
    assert_eq!(path("fov = 30").pose(0.0).fov, 30.0);
    let dark = scene("[scene]\nmodel = \"a.obj\"\n").unwrap();
    assert!(dark.warnings.iter().any(|w| w.contains("no light")), "{:?}", dark.warnings);
}

#[test]
fn models_stand_as_they_are_told_to() {
    let text = |up: &str| format!("[scene]\nmodel = \"a.obj\"\n{up}");
    let second = |s: Scene| s.triangles[0].position[2];
    assert_eq!(second(scene(&text("")).unwrap()), DVec3::Y);
    assert_eq!(second(scene(&text("up = \"z\"")).unwrap()), DVec3::NEG_Z);
    // What the command line says comes first; a flat picture of a model need not stay one.
    let over = |up| Overrides { up: Some(up), ..Overrides::default() };
    assert_eq!(second(scene_with(&text("up = \"z\""), |_| {}, &over(Up::MinusY)).unwrap()), DVec3::NEG_Y);
    let e = scene(&text("up = \"up\"")).unwrap_err();
    assert!(e.contains("line 3: scene.up: found \"up\"; expected the model's axis"), "{e}");
    let e = scene("[scene]\nbuiltin = \"arch\"\nup = \"z\"\n").unwrap_err();
    assert!(e.contains("line 3: scene.up: stands beside builtin"), "{e}");
    let e = load_builtin("arch", &over(Up::Z)).err().unwrap().to_string();
    assert!(e.contains("--up: a built-in scene has no model"), "{e}");
    // A camera that is tipped over for a model that lies: there is a better word for it.
    let lying = scene(&text("[camera]\nup = [0, 0, 1]\n")).unwrap();
    assert!(lying.warnings.iter().any(|w| w.contains("give scene.up")), "{:?}", lying.warnings);
    let line = scene(&text("[camera]\nup = [0, 0, 1]\nline = { from = [0, 0, 1], to = [0, 1, 1], look = [0, 1, 0] }\n")).unwrap();
    assert!(line.warnings.iter().all(|w| !w.contains("scene.up")), "{:?}", line.warnings);
}

#[test]
fn errors_name_file_line_key_and_cure() {
    let head = "[scene]\nmodel = \"a.obj\"\n";
    for (text, expected) in [
        (format!("{head}[camera]\nfov = .5\n"), vec!["line 4", "a digit before its point"]),
        (format!("{head}[camera]\norbit = 3\n"), vec!["line 4", "camera.orbit", "expected a table"]),
        (format!("{head}[camera]\nfvo = 45\n"), vec!["szene eins.toml", "line 4", "camera.fvo", "did you mean `fov`"]),
        (format!("{head}[camera]\nfov = 180\n"), vec!["line 4", "camera.fov", "found 180", "between 0 and 180"]),
        (format!("{head}[camera]\nfov = nan\n"), vec!["camera.fov", "NaN"]),
        (format!("{head}[camera]\n\n\norbit = {{ target = [0,0,0], radius = 0 }}\n"), vec!["line 6", "camera.orbit.radius", "above zero"]),
        (
            format!("{head}[camera]\norbit = {{ target = [0,0,0], radius = 1, elevation = [0, 91] }}\n"),
            vec!["camera.orbit.elevation", "found 91"],
        ),
        (format!("{head}[camera]\norbit = {{ target = [0,0], radius = 1 }}\n"), vec!["line 4", "camera.orbit.target"]),
        (format!("{head}[camera]\nline = {{ from = [0,0,0], to = [0,0,inf], look = [0,0,1] }}\n"), vec!["camera.line.to", "finite"]),
        (format!("{head}[camera]\nline = {{ from = [0,0,0], to = [0,0,1] }}\n"), vec!["camera.line", "neither look nor look_at"]),
        (format!("{head}[camera]\nline = {{ from = [0,0,0], to = [0,0,1], look = [0,0,0] }}\n"), vec!["camera.line.look", "direction"]),
        (
            format!("{head}[camera]\nspline = {{ points = [[0,0,0]], look_at = [[0,0,1]] }}\n"),
            vec!["camera.spline.points", "found 1 points"],
        ),
        (
            format!("{head}[camera]\npivot = {{ eye = [0,0,0] }}\norbit = {{ target = [0,0,0], radius = 1 }}\n"),
            vec!["camera.pivot", "one path"],
        ),
        (format!("{head}[camera]\ngltf = \"Camera\"\n"), vec!["line 4", "camera.gltf", "has no camera"]),
        (format!("{head}[camera]\nup = [0, 0, 0]\n"), vec!["camera.up"]),
        (format!("{head}[playback]\nframes = 0\n"), vec!["line 4", "playback.frames", "found 0", "1 to"]),
        (format!("{head}[playback]\nframes = 1.5\n"), vec!["line 4", "playback.frames"]),
        (format!("{head}[playback]\nsize = [320, 4097]\n"), vec!["playback.size", "found 4097", "4096"]),
        (format!("{head}[[light]]\ndirection = [0, 0, 0]\n"), vec!["line 4", "light.0.direction"]),
        (format!("{head}[[light]]\ndirection = [0, 0, 1]\ncolour = \"red\"\n"), vec!["line 5", "light.0.colour", "#rrggbb"]),
        (format!("{head}[light]\ndirection = [0, 0, 1]\n"), vec!["line 3", "[[light]]"]),
        (format!("{head}background = \"#12345\"\n"), vec!["line 3", "scene.background"]),
        (format!("{head}background = \"sky.png\"\n"), vec!["scene.background", "sky.png", "no such file"]),
        (format!("{head}[effects]\nfog = 1\n"), vec!["line 4", "effects.fog", "not supported yet"]),
        (format!("{head}builtin = \"torus\"\n"), vec!["scene.model", "builtin = \"torus\""]),
        ("[scene]\nbuiltin = \"no such thing\"\n".to_owned(), vec!["line 2", "scene.builtin", "no such thing"]),
        ("[scene]\nmodel = \"b.obj\"\n".to_owned(), vec!["line 2", "scene.model", "b.obj", "no such file"]),
        ("[scene]\nmodel = \"szene eins.toml\"\n".to_owned(), vec!["scene.model", "expected a .glb"]),
        ("[scene]\n".to_owned(), vec!["line 1", "names no source"]),
        ("[camera]\n".to_owned(), vec!["missing field `scene`", "add it"]),
        ("[scene\n".to_owned(), vec!["line 1"]),
        ("[scene]\nheightfield = { heights = \"a.obj\", size = [1, -1] }\n".to_owned(), vec!["scene.heightfield.size", "above zero"]),
        ("[scene]\nheightfield = { heights = \"a.obj\", size = [1, 1] }\n".to_owned(), vec!["a.obj", "not a picture"]),
        ("[scene]\nheightfield = { heights = \"a.obj\", size = [1, 1] }\nmodel = \"a.obj\"\n".to_owned(), vec!["exactly one source"]),
    ] {
        let e = scene(&text).err().unwrap_or_else(|| panic!("this loads:\n{text}"));
        for part in expected {
            assert!(e.contains(part), "expected \"{part}\" in \"{e}\" for\n{text}");
        }
    }
}

#[test]
fn a_model_of_an_unknown_ending_is_refused_unread() {
    let start = Instant::now();
    // Sparse: to read it thirty times would take half a minute.
    let long = |folder: &Path| File::create(folder.join("a.fbx")).unwrap().set_len(1 << 30).unwrap();
    for _ in 0..30 {
        let e = scene_with("[scene]\nmodel = \"a.fbx\"\n", long, &Overrides::default()).unwrap_err();
        let (file, rest) = e.split_once(": line 2: scene.model: ").unwrap_or_else(|| panic!("{e}"));
        assert!(file.ends_with("szene eins.toml"), "{e}");
        assert_eq!(rest, "found \"a.fbx\"; expected a .glb, .gltf, .obj, .ply or .stl file: convert the model");
    }
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    // Its first bytes may tell of a better cure.
    let binary = |folder: &Path| std::fs::write(folder.join("a.vrm"), "glTF\u{2}\0\0\0").unwrap();
    let e = scene_with("[scene]\nmodel = \"a.vrm\"\n", binary, &Overrides::default()).unwrap_err();
    assert!(e.contains("the name ends in .vrm, and this is a binary glTF: rename it to .glb"), "{e}");
}

#[test]
fn a_16_bit_png_is_centred_and_mapped_to_its_range() {
    let text = "[scene]\nheightfield = { heights = \"h.png\", colour = \"c.png\", size = [10, 4], range = [100, 200] }\n";
    let prepare = |folder: &Path| {
        let raw = vec![1000u16, 1001, 1002, 3000, 1000, 1000];
        image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, raw).unwrap().save(folder.join("h.png")).unwrap();
        image::RgbImage::from_pixel(3, 2, image::Rgb([5, 6, 7])).save(folder.join("c.png")).unwrap();
    };
    let s = scene_with(text, prepare, &Overrides::default()).unwrap();
    assert_eq!((s.triangles.len(), s.textures.len()), (4, 1));
    let corners: Vec<DVec3> = s.triangles.iter().flat_map(|t| t.position).collect();
    let find = |x: f64, z: f64| corners.iter().find(|c| c.x == x && c.z == z).unwrap().y;
    assert_eq!((find(-5.0, -2.0), find(-5.0, 2.0)), (100.0, 200.0));
    assert!((find(0.0, -2.0) - 100.05).abs() < 1e-9, "16 bits are kept");
    let (t, i) = s
        .triangles
        .iter()
        .flat_map(|t| [(t, 0), (t, 1), (t, 2)])
        .find(|(t, i)| t.position[*i].x == 5.0 && t.position[*i].z == 2.0)
        .unwrap();
    assert!((t.uv[i] - glam::Vec2::new(2.5 / 3.0, 0.75)).length() < 1e-6);
    assert!(t.normal[i].y > 0.0 && (t.normal[i].length() - 1.0).abs() < 1e-6);
}

#[test]
fn a_float_tiff_has_holes_where_it_has_no_data() {
    let text = "[scene]\nheightfield = { heights = \"h.tif\", size = [3, 3] }\n";
    let prepare = |folder: &Path| {
        let mut data = vec![2.0f32; 16];
        (data[0], data[15], data[5]) = (-9999.0, f32::NAN, 7.5);
        let mut encoder = TiffEncoder::new(std::fs::File::create(folder.join("h.tif")).unwrap()).unwrap();
        let mut image = encoder.new_image::<colortype::Gray32Float>(4, 4).unwrap();
        image.encoder().write_tag(Tag::Unknown(42_113), "-9999").unwrap();
        image.write_data(&data).unwrap();
    };
    let s = scene_with(text, prepare, &Overrides::default()).unwrap();
    let corners: Vec<DVec3> = s.triangles.iter().flat_map(|t| t.position).collect();
    // Without a range stored values are heights.
    assert_eq!(corners.iter().map(|c| c.y).fold(f64::MIN, f64::max), 7.5);
    assert!(!corners.iter().any(|c| c.x == -1.5 && c.z == -1.5) && !corners.iter().any(|c| c.x == 1.5 && c.z == 1.5));
    assert!((16..18).contains(&s.triangles.len()), "{}", s.triangles.len());
    assert!(s.warnings.iter().any(|w| w.contains("2 of 16 posts are nodata")), "{:?}", s.warnings);
    assert!(s.warnings.iter().any(|w| w.contains("tinted by height")));
}

#[test]
fn large_grids_and_pictures_are_averaged_down_with_a_warning() {
    let text = "[scene]\nheightfield = { heights = \"h.png\", colour = \"c.png\", size = [1, 1], range = [0, 1] }\n[playback]\nsize = [100, 100]\n";
    let prepare = |folder: &Path| {
        image::GrayImage::from_fn(600, 301, |x, _| image::Luma([(x / 3) as u8])).save(folder.join("h.png")).unwrap();
        image::RgbImage::new(4100, 10).save(folder.join("c.png")).unwrap();
    };
    let s = scene_with(text, prepare, &Overrides::default()).unwrap();
    assert_eq!(s.triangles.len(), 255 * 127 * 2);
    assert_eq!((s.textures[0].width, s.textures[0].height), (1367, 4));
    assert!(s.warnings.iter().any(|w| w.contains("600 x 301 posts averaged down to 256 x 128")), "{:?}", s.warnings);
    assert!(s.warnings.iter().any(|w| w.contains("4100 x 10 texels averaged down")));
    let extent = s.triangles.iter().flat_map(|t| t.position).fold(DVec3::ZERO, |m, p| m.max(p.abs()));
    assert!((extent.x - 0.5).abs() < 1e-12 && (extent.z - 0.5).abs() < 1e-12);
}

#[test]
fn damaged_tiffs_are_errors() {
    let text = "[scene]\nheightfield = { heights = \"h.tif\", size = [3, 3], range = [0, 1] }\n";
    let mut whole = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut whole).unwrap().write_image::<colortype::Gray16>(3, 3, &[1, 2, 3, 4, 5, 6, 7, 8, 9]).unwrap();
    let whole = whole.into_inner();
    let try_bytes = |bytes: &[u8]| scene_with(text, |folder| std::fs::write(folder.join("h.tif"), bytes).unwrap(), &Overrides::default());
    assert_eq!(try_bytes(&whole).unwrap().triangles.len(), 8);
    for end in 0..whole.len() - 4 {
        assert!(try_bytes(&whole[..end]).is_err(), "{end} of {} bytes load", whole.len());
    }
    for at in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x81;
        let _ = try_bytes(&damaged);
    }
}
