//! Hostile scenes through the built program: a cause and a cure with exit code 1, within five seconds and two gigabytes, or a bundle.
//! Files are written here; what the program says, how long it takes and what it leaves behind is checked.

#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A file of that name and content, beside `a.obj`.
struct File(&'static str, Vec<u8>);

fn text(name: &'static str, content: &str) -> File {
    File(name, content.as_bytes().to_vec())
}

/// Runs the program in `dir` under a limit of two gigabytes of address space, beyond what libraries and stacks take.
fn bake(dir: &Path, arguments: &[&str]) -> (Output, Duration) {
    let start = Instant::now();
    // Threads reserve much more address space than they use: with two of them two gigabytes are two gigabytes.
    let output = Command::new("sh")
        .current_dir(dir)
        .args(["-c", "ulimit -v 2097152; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_cubist-bake")])
        .args(arguments)
        .args(["--threads", "2", "--truth", "none", "-o", "out.cubist"])
        .output()
        .unwrap();
    (output, start.elapsed())
}

fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, 90]))
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

/// A PNG whose header promises `side` x `side` texels and whose data is a few bytes: a bomb.
fn bomb(side: u32) -> Vec<u8> {
    let mut bytes = png(1, 1);
    bytes[16..20].copy_from_slice(&side.to_be_bytes());
    bytes[20..24].copy_from_slice(&side.to_be_bytes());
    let crc = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    bytes
}

/// A sound PNG of `width` x `height` black texels, grey, of `depth` bits each, in a few hundred kilobytes: a bomb that goes off.
fn black(width: u32, height: u32, depth: u8) -> Vec<u8> {
    let length = u64::from(height) * (1 + (u64::from(width) * u64::from(depth)).div_ceil(8));
    // One block of fixed codes: a zero, as often as it takes the 258 bytes before again, the rest one by one.
    let (mut bits, mut count, mut data) = (0u64, 0, vec![0x78, 0x01]);
    let mut put = |code: u64, length: u32| {
        bits |= code << count;
        count += length;
        while count >= 8 {
            data.push(bits as u8);
            (bits, count) = (bits >> 8, count - 8);
        }
    };
    // Codes come with their highest bit first: zero is 0011_0000, a length of 258 1100_0101, a distance of one 00000, the end 000_0000.
    let (zero, again, end) = (0b0000_1100, 0b1010_0011, 0);
    put(0b011, 3);
    put(zero, 8);
    (0..(length - 1) / 258).for_each(|_| put(again, 13));
    (0..(length - 1) % 258).for_each(|_| put(zero, 8));
    put(end, 7);
    put(0, 7);
    data.extend((((length % 65_521) << 16) as u32 + 1).to_be_bytes());
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[depth, 0, 0, 0, 0]].concat();
    for (kind, data) in [(b"IHDR", &header), (b"IDAT", &data), (b"IEND", &Vec::new())] {
        file.extend((data.len() as u32).to_be_bytes());
        let whole = [&kind[..], data].concat();
        file.extend(&whole);
        file.extend(crc(&whole).to_be_bytes());
    }
    file
}

/// The CRC-32 of PNG chunks.
fn crc(bytes: &[u8]) -> u32 {
    !bytes
        .iter()
        .fold(!0u32, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 }))
}

/// A model with a texture: what faces it and which file its library names.
const TEXTURED: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";
const LIBRARY: &str = "newmtl m\nmap_Kd t.png\n";

fn gltf(inside: &str) -> File {
    text("a.gltf", &format!("{{\"asset\":{{\"version\":\"2.0\"}},{inside}}}"))
}

/// One triangle in a buffer that the file carries along.
const MESH: &str = concat!(
    "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],",
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],",
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],",
    "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}]"
);

#[test]
fn what_is_wrong_is_said_with_place_and_cure() {
    let long: &[&str] = &["a.toml"];
    let cases: Vec<(Vec<File>, &[&str], Vec<&str>)> = vec![
        // A graph that bites its tail, directly and around.
        (
            vec![gltf(&format!(
                "{MESH},\"scenes\":[{{\"nodes\":[0]}}],\"scene\":0,\"nodes\":[{{\"mesh\":0,\"children\":[1]}},{{\"children\":[0]}}]"
            ))],
            &["a.gltf"],
            vec!["a.gltf", "node", "ancestor"],
        ),
        // Twice as many nodes every time: 2^60 of them without a bound.
        (
            vec![{
                let nodes: Vec<String> = (1..61).map(|child| format!("{{\"children\":[{child},{child}]}}")).collect();
                gltf(&format!("{MESH},\"scenes\":[{{\"nodes\":[0]}}],\"scene\":0,\"nodes\":[{},{{\"mesh\":0}}]", nodes.join(",")))
            }],
            &["a.gltf"],
            vec!["a.gltf", "node"],
        ),
        (
            vec![gltf(&format!(
                "{MESH},\"extensionsRequired\":[\"EXT_from_the_future\"],\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}]"
            ))],
            &["a.gltf"],
            vec!["a.gltf", "EXT_from_the_future"],
        ),
        (
            vec![gltf("\"buffers\":[{\"byteLength\":36,\"uri\":\"https://example.com/a.bin\"}],\"scenes\":[{\"nodes\":[]}]")],
            &["a.gltf"],
            vec!["a.gltf", "https://example.com/a.bin", "never fetched"],
        ),
        (vec![gltf("\"scenes\":[{\"nodes\":[]}],\"scene\":0")], &["a.gltf"], vec!["a.gltf", "no triangles"]),
        (vec![text("b.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")], &["b.obj"], vec!["b.obj"]),
        (vec![text("b.obj", "v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")], &["b.obj"], vec!["b.obj"]),
        (vec![text("b.obj", "v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")], &["b.obj"], vec!["b.obj"]),
        (vec![text("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")], &["b.obj"], vec!["b.obj: line 4", "index 4 of 3"]),
        (vec![text("b.obj", "")], &["b.obj"], vec!["b.obj", "no triangles"]),
        (vec![text("b.obj", "glTF\u{2}\0\0\0")], &["b.obj"], vec!["b.obj", "a binary glTF", "rename it to .glb"]),
        (vec![text("b.glb", "ply\nformat ascii 1.0\n")], &["b.glb"], vec!["b.glb", "a PLY", "rename it to .ply"]),
        (vec![File("t.png", bomb(60_000)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)], &["b.obj"], vec!["t.png"]),
        (vec![File("t.png", bomb(2_000)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)], &["b.obj"], vec!["t.png"]),
        // As large as its sides may be, and really there: two hundred kilobytes for a gigabyte.
        (
            vec![File("t.png", black(16_384, 16_384, 1)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)],
            &["b.obj"],
            vec!["material \"m\"", "t.png", "too large"],
        ),
        (vec![text("b.obj", TEXTURED), text("a.mtl", LIBRARY)], &["b.obj"], vec!["material \"m\"", "t.png", "no such file"]),
        (vec![text("b.obj", TEXTURED), text("a.mtl", "newmtl m\nmap_Kd .\n")], &["b.obj"], vec!["material \"m\"", "is a directory"]),
        (
            vec![File("t.png", png(100_000, 1)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)],
            &["b.obj"],
            vec!["material \"m\"", "t.png", "too large", "16384"],
        ),
        (
            vec![File("t.png", b"no picture".to_vec()), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)],
            &["b.obj"],
            vec!["t.png", "not a picture"],
        ),
        (vec![], &["https://example.com/a.glb"], vec!["https://example.com/a.glb", "download it"]),
        (vec![], &["none.glb"], vec!["none.glb", "no such file", "check the path"]),
        (vec![], &["."], vec![".", "directory"]),
        (
            vec![text("a.toml", "[scene]\nmodel = \"a.obj\"\n[camera]\nfov = 0\n")],
            long,
            vec!["a.toml", "line 4", "camera.fov", "between 0 and 180"],
        ),
        (vec![text("a.toml", "[scene]\nmodel = \"a.obj\"\n[camera]\nfov = 180.0\n")], long, vec!["line 4", "camera.fov", "found 180"]),
        (vec![text("a.toml", "[scene]\nmodel = \"a.obj\"\n[playback]\nframes = 0\n")], long, vec!["line 4", "playback.frames", "found 0"]),
        (
            vec![text("a.toml", "[scene]\nmodel = \"a.obj\"\n[playback]\nsize = [0, 10]\n")],
            long,
            vec!["line 4", "playback.size", "found 0"],
        ),
        (
            vec![text(
                "a.toml",
                "[scene]\nmodel = \"a.obj\"\n[camera]\nline = { from = [0, 0, 5], to = [1, 0, 5], look = [0, 0, 1] }\n[playback]\nsize = [16, 12]\nframes = 3\n",
            )],
            long,
            vec!["a.toml", "the camera sees nothing", "check the camera's place"],
        ),
    ];
    for (files, arguments, expected) in cases {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.obj"), TRIANGLE).unwrap();
        let mut names = vec!["a.obj".to_owned()];
        for File(name, content) in files {
            std::fs::write(dir.path().join(name), content).unwrap();
            names.push(name.to_owned());
        }
        let (output, took) = bake(dir.path(), arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}, {expected:?}: {said}");
        assert!(expected.iter().all(|part| said.contains(part)), "expected {expected:?} in: {said}");
        assert!(said.starts_with("error: ") && !said.contains("panicked"), "{said}");
        assert!(took < Duration::from_secs(5), "{took:?} for: {said}");
        let mut left: Vec<_> =
            std::fs::read_dir(dir.path()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        left.sort();
        names.sort();
        assert_eq!(left, names, "nothing is left behind by: {said}");
    }
}

#[test]
fn a_file_that_may_not_be_read_is_said() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    use std::os::unix::process::CommandExt;
    /// Who may do nothing.
    const NOBODY: u32 = 65_534;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    std::fs::write(&path, TRIANGLE).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o000)).unwrap();
    // Who may do anything may read it. So it is asked by one who may not, by a program that lies where all may come.
    let program = dir.path().join("cubist-bake");
    std::fs::copy(env!("CARGO_BIN_EXE_cubist-bake"), &program).unwrap();
    std::fs::set_permissions(dir.path(), std::fs::Permissions::from_mode(0o777)).unwrap();
    let mut command = Command::new(&program);
    command.current_dir(dir.path()).args(["a.obj", "--size", "16x12", "--frames", "2", "--truth", "none", "-o", "out.cubist"]);
    if std::fs::metadata(dir.path()).unwrap().uid() == 0 {
        command.uid(NOBODY).gid(NOBODY);
    }
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("a.obj") && said.contains("check its permissions"), "{said}");
    assert!(!dir.path().join("out.cubist").exists());
}

/// Files, the scene among them, arguments, the least PSNR of a frame in dB, the most wrong pixels in percent.
type Odd<'a> = (Vec<File>, &'a str, &'a [&'a str], f64, f64);

#[test]
fn what_is_odd_but_right_bakes() {
    let cases: Vec<Odd<'_>> = vec![
        (
            vec![File("t.png", png(1, 1)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)],
            "b.obj",
            &["--size", "32x24", "--frames", "3"],
            23.0,
            3.0,
        ),
        (
            vec![File("t.png", png(16_384, 1)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)],
            "b.obj",
            &["--size", "32x24", "--frames", "3"],
            23.0,
            3.0,
        ),
        (
            vec![File("t.png", png(1, 16_384)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)],
            "b.obj",
            &["--size", "32x24", "--frames", "3"],
            23.0,
            3.0,
        ),
        (
            vec![File("t.png", black(8_192, 4_096, 1)), text("b.obj", TEXTURED), text("a.mtl", LIBRARY)],
            "b.obj",
            &["--size", "32x24", "--frames", "3"],
            23.0,
            3.0,
        ),
        (vec![], "a.obj", &["--size", "1x1", "--frames", "1"], 23.0, 3.0),
        (vec![], "a.obj", &["--size", "2000x2000", "--frames", "1"], 23.0, 3.0),
        (vec![], "a.obj", &["--size", "37x23", "--frames", "5"], 23.0, 3.0),
        (
            vec![text("größer als ein Dorf 🏠.obj", TRIANGLE)],
            "größer als ein Dorf 🏠.obj",
            &["--size", "32x24", "--frames", "2"],
            23.0,
            3.0,
        ),
        (
            vec![
                text("szene eins.toml", "[scene]\nmodel = \"größer als ein Dorf.obj\"\n[playback]\nsize = [24, 16]\nframes = 2\n"),
                text("größer als ein Dorf.obj", TRIANGLE),
            ],
            "szene eins.toml",
            &[],
            // Of 384 pixels eight are wrong; beside the antialiased scene it is 21.3 dB, and was 21.0 where four were.
            22.0,
            3.0,
        ),
        // Round in three frames, a third of a circle each: the one in the middle is hardly to be interpolated.
        (
            vec![text("a.toml", "[scene]\nmodel = \"a.obj\"\n[camera]\nfov = 170\n[playback]\nsize = [32, 24]\nframes = 3\n")],
            "a.toml",
            &[],
            9.0,
            8.0,
        ),
        (
            vec![text("a.toml", "[scene]\nmodel = \"a.obj\"\n[camera]\nfov = 1\n[playback]\nsize = [32, 24]\nframes = 3\n")],
            "a.toml",
            &[],
            9.0,
            8.0,
        ),
    ];
    for (files, scene, arguments, psnr, wrong) in cases {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.obj"), TRIANGLE).unwrap();
        for File(name, content) in files {
            std::fs::write(dir.path().join(name), content).unwrap();
        }
        let (output, took) = bake(dir.path(), &[&[scene, "--report", "report.json"], arguments].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{scene}, {arguments:?}: {said}");
        // It is the right picture: against exact rays, and of a triangle that is seen.
        let report: serde_json::Value = serde_json::from_slice(&std::fs::read(dir.path().join("report.json")).unwrap()).unwrap();
        let quality = |key: &str| report["quality"][key].as_f64().unwrap();
        println!("{scene}, {arguments:?}: {} dB, {} % wrong, {took:?}", quality("psnr_min"), quality("wrong_surface_percent"));
        assert!(quality("psnr_min") >= psnr, "{scene}, {arguments:?}: {}", report["quality"]);
        assert!(quality("wrong_surface_percent") <= wrong, "{scene}, {arguments:?}: {}", report["quality"]);
        let bytes = std::fs::read(dir.path().join("out.cubist")).unwrap();
        let bundle = cubist_core::Bundle::parse(&bytes).unwrap();
        assert!(bundle.label_count() > 1, "{scene}: the triangle is seen");
        assert!(took < Duration::from_secs(60), "{scene}: {took:?}");
    }
}

#[test]
fn a_disk_that_fills_up_leaves_the_old_bundle_whole() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("out.cubist"), "the old one").unwrap();
    // No file may grow beyond a block of 512 bytes: writing fails as on a full disk. Without a handler the signal for it would end the program.
    let output = Command::new("sh")
        .current_dir(dir.path())
        .args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_cubist-bake")])
        .args(["builtin:pyramid", "--size", "64x48", "--frames", "3", "--truth", "none", "-o", "out.cubist"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("out.cubist: writing failed: File too large"), "{said}");
    assert_eq!(std::fs::read_to_string(dir.path().join("out.cubist")).unwrap(), "the old one");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "nothing half written is left");
}

#[test]
fn an_interrupted_bake_leaves_the_old_bundle_whole() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("out.cubist"), "the old one").unwrap();
    for signal in ["-INT", "-TERM"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_cubist-bake"))
            .current_dir(dir.path())
            .args(["builtin:street", "--frames", "2000", "-o", "out.cubist", "--report", "new/report.json"])
            .spawn()
            .unwrap();
        // The folder is made after the handler is set.
        while !dir.path().join("new").exists() {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        assert!(!child.wait().unwrap().success());
        assert_eq!(std::fs::read_to_string(dir.path().join("out.cubist")).unwrap(), "the old one");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "{signal}: nothing half written is left");
    }
}
