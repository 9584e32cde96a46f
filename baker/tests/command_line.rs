//! The program from outside: what it refuses, with which exit code, and what it leaves behind.
//! A triangle written here goes in through the built program; messages, exit codes and files are checked.

use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A folder that holds `a.obj`.
fn folder() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a.obj"), TRIANGLE).unwrap();
    dir
}

fn program(dir: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cubist-bake"));
    command.current_dir(dir).args(arguments);
    command
}

/// Bakes `scene` small.
fn bake(dir: &Path, scene: &str, arguments: &[&str]) -> Output {
    program(dir, &[scene, "--size", "16x12", "--frames", "2", "--truth", "none"]).args(arguments).output().unwrap()
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[track_caller]
fn refused(output: &Output, code: i32, message: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(text.contains(message), "{text}");
}

#[test]
fn the_scene_and_the_bundle_are_never_written_over() {
    let dir = folder();
    refused(&bake(dir.path(), "a.obj", &["-o", "./a.obj"]), 2, "that is the scene");
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--report", "./a.cubist"]), 2, "that is the bundle");
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--report", "a.obj"]), 2, "that is the scene");
    refused(&bake(dir.path(), "a.obj", &["-o", "Wall.PNG"]), 2, "so a scene's own files are called");
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--report", "b.obj"]), 2, "so a scene's own files are called");
    assert_eq!(std::fs::read_to_string(dir.path().join("a.obj")).unwrap(), TRIANGLE);
    assert_eq!(names(dir.path()), ["a.obj"]);
}

#[test]
fn what_cannot_be_written_is_said_before_the_work() {
    let dir = folder();
    std::fs::write(dir.path().join("plain"), "x").unwrap();
    refused(&bake(dir.path(), "a.obj", &["-o", "new/"]), 1, "expected a file's name");
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--diagnostics", "plain"]), 1, "plain: the folder cannot be made");
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--report", "plain/a.json"]), 1, "plain: the folder cannot be made");
    assert_eq!(names(dir.path()), ["a.obj", "plain"]);
}

#[test]
fn a_bake_that_fails_leaves_only_folders_that_were_there_or_hold_something() {
    let dir = folder();
    std::fs::create_dir_all(dir.path().join("old/pictures")).unwrap();
    let written = ["-o", "new/far/a.cubist", "--report", "old/new/a.json", "--diagnostics"];
    // A scene that cannot be loaded; one that cannot be baked; a folder that cannot be made, beside others that can.
    refused(&bake(dir.path(), "none.obj", &[&written[..], &["pictures"]].concat()), 1, "no such file");
    refused(&bake(dir.path(), "a.obj", &[&written[..], &["old/pictures", "--ram", "1K"]].concat()), 1, "--ram: expected room for ");
    refused(&bake(dir.path(), "a.obj", &[&written[..], &["a.obj"]].concat()), 1, "a.obj: the folder cannot be made");
    assert_eq!((names(dir.path()), names(&dir.path().join("old"))), (vec!["a.obj".into(), "old".into()], vec!["pictures".into()]));
    let output = bake(dir.path(), "a.obj", &[&written[..], &["new/pictures"]].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert_eq!(names(&dir.path().join("new")), ["far", "pictures"]);
}

#[test]
fn a_folder_of_diagnostics_shows_one_bake() {
    let dir = folder();
    let pictures = dir.path().join("pictures");
    std::fs::create_dir(&pictures).unwrap();
    for name in ["frame-0007-exact.png", "frame-0000-played.png", "frame-0007-mine.png", "frame-7-rays.png"] {
        std::fs::write(pictures.join(name), "earlier").unwrap();
    }
    assert_eq!(bake(dir.path(), "a.obj", &["-o", "a.cubist", "--diagnostics", "pictures"]).status.code(), Some(0));
    let frames: Vec<String> =
        names(&pictures).into_iter().filter(|name| !name.starts_with("frame-0000") && !name.starts_with("frame-0001")).collect();
    assert_eq!(frames, ["density.png", "frame-0007-mine.png", "frame-7-rays.png", "mask.png", "never-seen.png", "source-image.png"]);
    assert_ne!(std::fs::read(pictures.join("frame-0000-played.png")).unwrap(), b"earlier");
}

#[test]
fn what_was_found_can_be_had_without_trials() {
    let dir = folder();
    let told = |options: &[&str]| String::from_utf8(bake(dir.path(), "a.obj", &[&["-o", "a.cubist"], options].concat()).stdout).unwrap();
    let wanted = |text: &str, name: &str| text.lines().find(|line| line.starts_with(name)).map(str::to_owned);
    let tried = told(&[]);
    let found = wanted(&tried, "sooner").unwrap();
    let (_, options) = found.split_once("not given yet: ").unwrap();
    let again = told(&options.split(' ').collect::<Vec<_>>());
    assert_eq!(wanted(&again, "sooner"), None, "there is nothing left to try");
    assert_eq!(wanted(&told(&["--ram", "1M"]), "sooner"), None, "a goal may ask for more than options can say");
    assert_eq!(["grid", "PSNR"].map(|name| wanted(&again, name)), ["grid", "PSNR"].map(|name| wanted(&tried, name)));
}

#[test]
fn memory_is_kept_to_or_what_it_takes_is_said() {
    let dir = folder();
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--ram", "1K"]), 1, "--ram: expected room for ");
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--ram", "1K", "--time", "cubic"]), 1, "or leave --time to the search");
    refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", "--psnr", "30", "--budget", "9K"]), 2, "cannot be used with");
    refused(
        &bake(dir.path(), "a.obj", &["-o", "a.cubist", "--ram", "1K", "--budget", "9K"]),
        1,
        "--budget and --ram: expected a bundle of",
    );
    refused(&bake(dir.path(), "a.obj", &["b.obj", "-o", "a.cubist"]), 2, "expected one input, found \"b.obj\" too");
    for (option, wanted) in [("--ram", "a number of bytes"), ("--budget", "a number of bytes"), ("--psnr", "expected")] {
        refused(&bake(dir.path(), "a.obj", &["-o", "a.cubist", option, "-5"]), 2, wanted);
    }
    assert_eq!(names(dir.path()), ["a.obj"]);
    // Without --ram finer cells are tried too, and take more: this is the most that nothing has to be given up for.
    let output = bake(dir.path(), "a.obj", &["-o", "a.cubist", "--report", "a.json", "--ram", "1M"]);
    assert_eq!(output.status.code(), Some(0));
    let report = || serde_json::from_slice::<serde_json::Value>(&std::fs::read(dir.path().join("a.json")).unwrap()).unwrap();
    let least = (report()["memory"]["workspace"].as_u64().unwrap() - 1).to_string();
    let output = bake(dir.path(), "a.obj", &["-o", "a.cubist", "--report", "a.json", "--ram", &least]);
    let said = format!("--ram {least}: to fit, the bundle has ");
    assert!(String::from_utf8_lossy(&output.stderr).contains(&said), "{output:?}");
    assert!(report()["warnings"].as_array().unwrap().iter().any(|warning| warning.as_str().unwrap().starts_with(&said)));
    assert!(report()["memory"]["workspace"].as_u64().unwrap() < least.parse().unwrap());
}

#[cfg(unix)]
#[test]
fn devices_are_no_scenes_and_stay_devices() {
    let dir = folder();
    refused(&bake(dir.path(), "/dev/zero", &["-o", "a.cubist"]), 1, "load /dev/zero: is a device or a pipe");
    refused(&program(dir.path(), &["inspect", "/dev/zero"]).output().unwrap(), 1, "/dev/zero: is a device or a pipe");
    std::os::unix::fs::symlink("/dev/zero", dir.path().join("endless.glb")).unwrap();
    refused(&bake(dir.path(), "endless.glb", &["-o", "a.cubist"]), 1, "is a device or a pipe");
    if Path::new("/dev/full").exists() {
        refused(&bake(dir.path(), "a.obj", &["-o", "/dev/full"]), 1, "/dev/full: writing failed: No space left");
    }
    assert_eq!(bake(dir.path(), "a.obj", &["-o", "/dev/null"]).status.code(), Some(0));
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    assert_eq!(names(dir.path()), ["a.obj", "endless.glb"]);
}

#[cfg(unix)]
#[test]
fn an_interrupted_bake_leaves_nothing() {
    let dir = folder();
    let mut child = program(dir.path(), &["builtin:street", "-o", "new/far/a.cubist", "--frames", "2000"]).spawn().unwrap();
    // The folders are made after the handler is set.
    while !dir.path().join("new/far").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(names(dir.path()), ["a.obj"]);
}
