//! Golden checksums: every built-in scene bakes to the bundle, and plays to the pixels, that `fixtures/golden` names.
//! The same files hold for debug and release builds and for any number of threads. One test a scene, so that they run side by side.
//! Bundles that are as they should be stay in `target/tmp/goldens`, for `player-mcu/identical` to play.

use cubist_baker::scene::builtin;
use cubist_tests::golden;
use serde_json::Value;
use std::fs;
use std::path::Path;

fn check(name: &str) {
    let file = golden::file(name);
    let text = fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}; make it with: {}", file.display(), golden::COMMAND));
    let expected: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let bundle = golden::bundle(name).expect("a built-in scene bakes");
    let found = golden::checksums(name, &bundle).expect("it plays");
    assert!(
        expected == found,
        "{name}: checksums differ from {}.\nexpected {expected:#}\nfound {found:#}\nIf the change is meant, make them anew with: {}",
        file.display(),
        golden::COMMAND
    );
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("goldens");
    fs::create_dir_all(&folder).and_then(|()| fs::write(folder.join(format!("{name}.cubist")), bundle)).expect("a place for bundles");
}

macro_rules! scenes {
    ($($test:ident: $name:literal,)*) => {
        $(#[test]
        fn $test() {
            check($name);
        })*

        #[test]
        fn every_scene_has_its_test() {
            assert_eq!([$($name),*], builtin::NAMES);
        }
    };
}

scenes! {
    cone_orbit: "cone-orbit",
    cone_translate: "cone-translate",
    street: "street",
    terrain: "terrain",
    arch: "arch",
    torus: "torus",
    columns: "columns",
    round_columns: "round-columns",
    pyramid: "pyramid",
    pivot: "pivot",
    wing: "wing",
    mirrors: "mirrors",
}

#[test]
fn the_checksum_is_the_usual_crc_32() {
    assert_eq!(cubist_core::checksum(b"123456789"), 0xcbf4_3926);
}
