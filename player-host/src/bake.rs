//! The one place where the player calls the baker.
//! A scene comes in from `input`; bundle bytes, rows for the table and warnings go back.

use anyhow::{Context, Result};
use cubist_baker::report;
use cubist_baker::scene::{self, Overrides};
use cubist_baker::{Options, TruthFrames, job};
use cubist_core::format::SPACE_CUBIC;
use std::path::Path;

/// The built-in scene that plays when nothing is given.
pub const DEMO: &str = "street";

/// What to bake.
#[derive(Clone, Copy, Debug)]
pub enum Scene<'a> {
    /// [`DEMO`].
    Demo,
    /// A built-in scene, by name.
    Builtin(&'a str),
    /// A scene file or a model.
    File(&'a Path),
}

/// What was baked.
pub struct Baked {
    /// The bundle.
    pub bytes: Vec<u8>,
    /// Rows of name and value for the table.
    pub rows: Vec<(String, String)>,
    /// What the user should know about the scene: each names it.
    pub warnings: Vec<String>,
}

/// Bakes `scene`; `progress` hears the stage by name and how much of it is done, 0 to 1.
pub fn bake(scene: Scene<'_>, progress: &(dyn Fn(&str, f32) + Sync)) -> Result<Baked> {
    progress("reading the scene", 0.0);
    let (scene, name, options) = match scene {
        Scene::Demo => (scene::load_builtin(DEMO, &Overrides::default())?, DEMO.to_owned(), settled()),
        Scene::Builtin(name) => (scene::load_builtin(name, &Overrides::default())?, name.to_owned(), Options::default()),
        Scene::File(path) => (scene::load(path, &Overrides::default())?, path.display().to_string(), Options::default()),
    };
    // Someone waits for the picture: the antialiased truth is for `cubist-bake --report`.
    let options = Options { truth: TruthFrames::None, ..options };
    let hear = |stage: &str, part: f64| progress(stage, part as f32);
    let (bytes, report) = job::bake_scene(&scene, &options, &hear).with_context(|| name.clone())?;
    let warnings = report.warnings.iter().map(|warning| format!("{name}: {warning}")).collect();
    Ok(Baked { bytes, rows: report::table(&report), warnings })
}

/// What the baker chooses for the demo by trials, said outright: the same bundle in a third of the time, for those who see the first one ever.
fn settled() -> Options {
    Options { cell: Some(8), key_interval: Some(4), space: Some(SPACE_CUBIC), all_sheets: true, ..Options::default() }
}
