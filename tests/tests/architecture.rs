//! The layout that ARCHITECTURE.md describes, held against the sources: who may name what, and how a file looks.
//! Every `.rs` file of the checkout comes in, and the manifests; out come the places that break a rule.

mod circles;
mod source;

use circles::circles;
use source::Source;
use std::collections::{BTreeMap, BTreeSet};

/// The core's modules from the bottom up: each may use those before it, none after it.
const ORDER: [&str; 38] = [
    "fixed", "bounds", "plane", "format", "error", "coder", "grid", "lists", "key", "predict", "field", "nodes", "record", "mask", "pack",
    "atlas", "form", "coverage", "bundle", "timeline", "row", "sheet", "patch", "window", "site", "span", "torn", "plan", "filter",
    "memory", "work", "draw", "playing", "colours", "texels", "player", "graphics", "lib",
];

/// Crates that only certain files (or folders, with a slash at the end) may name, so that they can be replaced there.
const ROOMS: [(&str, &[&str]); 5] = [
    ("obvhs", &["baker/src/trace.rs"]),
    ("gltf", &["baker/src/scene/gltf/"]),
    ("tiny_skia", &["player-host/src/canvas.rs"]),
    // Keys arrive as winit's: `keys` turns them into actions.
    ("winit", &["player-host/src/window.rs", "player-host/src/keys.rs"]),
    ("softbuffer", &["player-host/src/window.rs"]),
];

/// The packages, and which of ours each may depend on.
const PACKAGES: [(&str, &[&str]); 13] = [
    ("core", &[]),
    ("baker", &["cubist-core"]),
    ("player-host", &["cubist-core", "cubist-baker"]),
    ("player-mcu/proof", &["cubist-core"]),
    ("player-mcu/qemu", &["cubist-core"]),
    ("player-mcu/bench", &["cubist-core"]),
    ("player-mcu/pico", &["cubist-core"]),
    ("player-mcu/identity", &["cubist-core"]),
    ("player-mcu/identity/device", &["cubist-identity"]),
    ("player-mcu/identity/wasm", &["cubist-identity"]),
    ("player-mcu/identity/host", &["cubist-identity"]),
    ("player-mcu/peers", &["cubist-core"]),
    ("player-mcu/peers/host", &["cubist-core"]),
];

/// Where a device leaves no other way: the flash that the Pico's bundles lie in.
const UNSAFE: &str = "player-mcu/pico/src/slot.rs";

const LONGEST_FILE: usize = 600;

fn none(found: Vec<String>) {
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn the_sources_are_found() {
    let sources = source::all();
    for path in
        ["core/src/lib.rs", "baker/src/trace.rs", "player-host/src/main.rs", "tests/tests/architecture.rs", "player-mcu/proof/src/main.rs"]
    {
        assert!(sources.iter().any(|s| s.path == path), "{path} is not among the {} sources", sources.len());
    }
}

#[test]
fn no_file_of_tests_is_left_out() {
    let mut found = Vec::new();
    for folder in ["tests/tests/", "baker/tests/"] {
        let program = source::file(&format!("{folder}all.rs"));
        for source in source::below(folder) {
            let name = source.path[folder.len()..].trim_end_matches(".rs");
            if name != "all" && !name.contains('/') && !program.contains(&format!("\nmod {name};")) {
                found.push(format!("{}: is not run; {folder}all.rs lacks `mod {name};`", source.path));
            }
        }
    }
    none(found);
}

#[test]
fn every_file_says_what_it_is() {
    let silent = |s: &&Source| !s.text.starts_with("//! ");
    none(source::all().iter().filter(silent).map(|s| format!("{}: begins without a `//!` that says what it is", s.path)).collect());
}

#[test]
fn no_file_is_too_long() {
    let sources = source::all();
    let lines = |s: &Source| s.text.lines().count();
    let long = sources.iter().filter(|s| lines(s) > LONGEST_FILE);
    none(long.map(|s| format!("{}: {} lines, at most {LONGEST_FILE}: it is two rooms", s.path, lines(s))).collect());
}

#[test]
fn nothing_is_unsafe_and_no_lint_is_silenced_without_a_reason() {
    let mut found = Vec::new();
    for source in source::all() {
        let code = source.code();
        let blocks = source::words(&code).filter(|(_, word)| *word == "unsafe").count();
        if blocks > usize::from(source.path == UNSAFE) {
            found.push(format!("{}: unsafe", source.path));
        }
        if code.contains("#[allow(") || code.contains("#![allow(") {
            found.push(format!("{}: an allow attribute; write #[expect(lint, reason = \"...\")]", source.path));
        }
    }
    none(found);
}

#[test]
fn crates_keep_to_their_rooms() {
    let mut found = Vec::new();
    for source in source::all() {
        let code = source.code();
        for (name, rooms) in ROOMS {
            let at_home = rooms.iter().any(|room| if room.ends_with('/') { source.path.starts_with(room) } else { source.path == *room });
            let named = source::words(&code).any(|(at, word)| word == name && names_the_crate(&code, at, name));
            if named && !at_home {
                found.push(format!("{}: names {name}, which only {} may", source.path, rooms.join(" and ")));
            }
        }
    }
    none(found);
}

/// Whether the word `name` at `at` is the crate: a path starts with it. The loader of glTF is a module called `gltf`, so
/// there only `::gltf` and `use gltf` are the crate.
fn names_the_crate(code: &str, at: usize, name: &str) -> bool {
    let before = code[..at].trim_end();
    if let Some(path) = before.strip_suffix("::") {
        return !path.ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '>');
    }
    let path = code[at + name.len()..].starts_with("::");
    let used = before.ends_with("use") || before.ends_with("extern crate");
    used || (path && name != "gltf")
}

#[test]
fn packages_depend_on_ours_only_downwards() {
    let mut found = Vec::new();
    for (package, allowed) in PACKAGES {
        for name in source::own_dependencies(package) {
            if !allowed.contains(&name.as_str()) {
                found.push(format!("{package}/Cargo.toml: depends on {name}; it may on {allowed:?}"));
            }
        }
    }
    none(found);
    assert_eq!(source::own_dependencies("player-host"), ["cubist-core", "cubist-baker"], "the manifests are read as they should be");
}

#[test]
fn the_core_has_no_floats() {
    let mut found = Vec::new();
    for source in source::below("core/src/") {
        let code = source.code_without_tests();
        let floats = source::words(&code).filter(|(_, word)| matches!(*word, "f16" | "f32" | "f64" | "f128"));
        found.extend(floats.map(|(at, word)| format!("{}:{}: {word}", source.path, source::line(&code, at))));
    }
    none(found);
}

/// What the system's library, the compiler or the processor may round otherwise elsewhere.
const ROUNDED: [&str; 18] = [
    ".hypot(",
    ".powi(",
    ".powf(",
    ".sin()",
    ".cos()",
    ".sin_cos()",
    ".tan()",
    ".asin()",
    ".acos()",
    ".atan()",
    ".atan2(",
    ".exp()",
    ".exp2()",
    ".ln()",
    ".log2()",
    ".log10()",
    ".cbrt()",
    ".mul_add(",
];

#[test]
fn the_baker_computes_the_same_everywhere() {
    let mut found = Vec::new();
    for source in source::below("baker/src/") {
        let code = source.code_without_tests();
        for call in ROUNDED {
            found.extend(code.match_indices(call).map(|(at, _)| format!("{}:{}: {call}", source.path, source::line(&code, at))));
        }
    }
    none(found);
}

#[test]
fn the_core_imports_downwards() {
    let sources = source::below("core/src/");
    let module = |source: &Source| source.path["core/src/".len()..].trim_end_matches(".rs").split('/').next().unwrap_or("").to_owned();
    let place = |name: &str| ORDER.iter().position(|&m| m == name);
    let library = sources.iter().find(|s| s.path == "core/src/lib.rs").expect("the core has a lib.rs");
    let reexports: BTreeMap<String, String> = source::reexports(&library.code()).into_iter().collect();
    let mut found = Vec::new();
    for source in sources.iter().filter(|s| s.path != library.path) {
        let name = module(source);
        let Some(own) = place(&name) else {
            found.push(format!("{}: has no place in ORDER of tests/tests/architecture.rs", source.path));
            continue;
        };
        for import in source::imports(&source.code_without_tests(), "crate::") {
            let target = reexports.get(&import).unwrap_or(&import);
            match place(target) {
                None => found.push(format!("{}: crate::{import} is no module of ORDER", source.path)),
                Some(at) if at > own => found.push(format!("{}: imports {target}, which stands above it", source.path)),
                Some(_) => {}
            }
        }
    }
    none(found);
    assert_eq!(reexports.get("Bundle").map(String::as_str), Some("bundle"), "the re-exports are read as they should be");
}

/// Modules are files beside `lib.rs`, and folders.
#[test]
fn the_baker_imports_in_no_circle() {
    let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for source in source::below("baker/src/") {
        let name = source.path["baker/src/".len()..].trim_end_matches(".rs").split('/').next().unwrap_or("").to_owned();
        if !matches!(name.as_str(), "lib" | "main") {
            let named = imports.entry(name.clone()).or_default();
            named.extend(source::imports(&source.code_without_tests(), "crate::").into_iter().filter(|other| *other != name));
        }
    }
    assert!(imports["job"].contains("bake") && imports["bake"].contains("gbuffer"), "the imports are read as they should be");
    none(circles(imports));
}

#[test]
fn the_files_of_the_bakers_folders_import_in_no_circle() {
    let sources = source::below("baker/src/");
    let folders: Vec<&str> = sources.iter().filter_map(|source| source.path.strip_suffix("mod.rs")).collect();
    for folder in ["baker/src/chart/", "baker/src/scene/", "baker/src/scene/gltf/"] {
        assert!(folders.contains(&folder), "{folder} is not among {folders:?}");
    }
    let mut found = Vec::new();
    for folder in folders {
        let imports = circles::inside(folder, &sources);
        found.extend(circles::circles(imports).into_iter().map(|circle| format!("{folder}{circle}")));
    }
    none(found);
    let charts = circles::inside("baker/src/chart/", &sources);
    assert!(charts["merge"].contains("clusters") && charts["clusters"].contains("view") && charts["mod"].contains("merge"), "{charts:?}");
    let scenes = circles::inside("baker/src/scene/", &sources);
    assert!(scenes["gltf"].contains("error") && scenes["gltf"].contains("model") && scenes["turned"].contains("mod"), "{scenes:?}");
}

#[test]
fn the_document_lists_the_cores_modules_in_their_order() {
    let document = source::file("ARCHITECTURE.md");
    let listed = document.split("| module | |").nth(1).and_then(|table| table.split("\n\n").next()).unwrap_or("");
    let modules: Vec<&str> = listed.split("\n| `").skip(1).filter_map(|row| row.split('`').next()).collect();
    assert_eq!(modules, ORDER[..ORDER.len() - 1], "ARCHITECTURE.md lists other modules than ORDER, or in another order");
}

#[test]
fn the_document_names_every_file_of_the_baker_and_the_desktop_player() {
    let document = source::file("ARCHITECTURE.md");
    let mut found = Vec::new();
    for (folder, end) in [("baker/src/", ".rs`"), ("player-host/src/", "`")] {
        for source in source::below(folder) {
            let file = source.path[folder.len()..].trim_end_matches(".rs");
            let (name, own) = (file.split('/').next().unwrap_or(file), !file.contains('/'));
            let known = document.contains(&format!("`{name}{}", if own { end } else { "/" }));
            if !known && !matches!(name, "lib" | "trace_tests") {
                found.push(format!("{}: ARCHITECTURE.md does not name it", source.path));
            }
        }
    }
    none(found);
}

#[test]
fn ci_runs_what_the_readme_promises() {
    let (readme, ci) = (source::file("README.md"), source::file(".ci/run"));
    assert!(readme.contains("\ncargo test --workspace\n"), "the README's test command has changed");
    assert!(ci.contains("cargo test --workspace\n"), ".ci/run does not run the README's test command");
    assert!(readme.contains("\ncargo run --release\n"), "the README's demo command has changed");
}
