//! What the user gave, as a bundle: read from a file, or baked from a scene.
//! A path comes in from `cli`; checked bytes go to the commands.

use crate::bake::{Baked, DEMO, Scene, bake};
use crate::cli::Usage;
use crate::progress::progress;
use anyhow::{Context, Result, anyhow};
use cubist_baker::files::same;
use cubist_baker::scene::MODELS;
use cubist_baker::terminal::tell;
use cubist_core::Bundle;
use std::path::Path;

/// A bundle's bytes and where they come from.
pub struct Loaded {
    /// The file's name as given, or the built-in scene's.
    pub name: String,
    /// The bundle.
    pub bytes: Vec<u8>,
    /// What the baker reports, as rows for a table; empty for a bundle read from a file.
    pub rows: Vec<(String, String)>,
}

/// Reads a bundle, or bakes a scene (told by its ending, or built in: `builtin:NAME`), or bakes the demo when `path` is none.
pub fn load(path: Option<&Path>) -> Result<Loaded> {
    let Some(path) = path else {
        return baked(DEMO.to_owned(), Scene::Demo);
    };
    let name = path.display().to_string();
    if let Some(scene) = name.strip_prefix("builtin:") {
        return baked(name.clone(), Scene::Builtin(scene));
    }
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if ending.is_some_and(|e| e == "toml" || MODELS.contains(&e.as_str())) {
        return baked(name, Scene::File(path));
    }
    let bytes = cubist_baker::files::read(path)
        .map_err(|what| anyhow!("{name}: {what}; expected a bundle (made by `cubist-bake SCENE -o OUT.cubist`)"))?;
    Ok(Loaded { name, bytes, rows: Vec::new() })
}

/// Checks the bytes; the error names the file.
pub fn parse(loaded: &Loaded) -> Result<Bundle<'_>> {
    Bundle::parse(&loaded.bytes).map_err(|e| anyhow!("{}: {e}; bake it afresh with `cubist-bake SCENE -o OUT.cubist`", loaded.name))
}

/// Working memory for a bundle.
pub fn memory(bundle: &Bundle<'_>) -> Result<Vec<u8>> {
    let needed = bundle.memory_needed();
    let mut memory = Vec::new();
    memory.try_reserve_exact(needed).with_context(|| format!("the bundle asks for {needed} bytes of working memory"))?;
    memory.resize(needed, 0);
    Ok(memory)
}

/// Refuses, as wrong usage, that `option` writes `path` over the bundle that plays.
pub fn keep(bundle: &Path, option: &str, path: &Path) -> Result<()> {
    if same(bundle, path) {
        return Err(Usage(format!("{option} {}: that is the bundle, which would be replaced; name another file", path.display())).into());
    }
    Ok(())
}

fn baked(name: String, scene: Scene<'_>) -> Result<Loaded> {
    let bar = progress(1000, "bake");
    let result = bake(scene, &|stage, done| {
        bar.set_message(stage.to_owned());
        bar.set_position((done.clamp(0.0, 1.0) * 1000.0) as u64);
    });
    bar.finish_and_clear();
    let Baked { bytes, rows, warnings } = result?;
    for warning in warnings {
        tell(format_args!("warning: {warning}"));
    }
    Ok(Loaded { name, bytes, rows })
}
