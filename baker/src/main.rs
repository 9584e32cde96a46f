//! `cubist-bake`: scene in, bundle out.
//! The command line comes from `cli`, files are written by `files`; the exit code is 0, 1 (the input is at fault), 2 (usage)
//! or 130 (interrupted).

mod choices;
mod cli;
mod diagnostics;

use anyhow::{Context, Result, anyhow};
use clap::CommandFactory;
use clap::error::ErrorKind;
use cli::{Bake, Cli, Command, Inspect, Playback, Throughput};
use cubist_baker::inspect::Inspection;
use cubist_baker::scene::Scene;
use cubist_baker::terminal::{self, aligned, grouped, print, tell};
use cubist_baker::{files, job, report, scene, throughput};
use indicatif::ProgressBar;
use serde_json::json;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let cli: Cli = terminal::arguments();
    let result = match (&cli.command, &cli.bake.scene, &cli.bake.output) {
        (Some(Command::Inspect(args)), ..) => inspect(args),
        (Some(Command::Throughput(args)), ..) => throughput(args),
        (None, Some(scene), Some(output)) => bake(scene, output, &cli.bake),
        _ => Cli::command().error(ErrorKind::MissingRequiredArgument, "expected a SCENE and -o OUT.cubist").exit(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            files::remove_empty_folders();
            tell(format_args!("error: {error:#}"));
            ExitCode::from(1)
        }
    }
}

fn bake(name: &str, output: &Path, args: &Bake) -> Result<()> {
    files::clean_up_when_interrupted()?;
    threads(args.threads)?;
    distinct(name, output, args.report.as_deref());
    if let Some(clash) = args.clash() {
        Cli::command().error(ErrorKind::ArgumentConflict, clash).exit();
    }
    let start = Instant::now();
    let scene = load(name, &args.playback)?;
    let options = args.options(start.elapsed().as_secs_f64());
    // What cannot be written is told before minutes of work.
    files::check(output)?;
    if let Some(path) = &args.report {
        files::check(path)?;
    }
    if let Some(folder) = &args.diagnostics {
        files::check_folder(folder)?;
    }
    let bar = bar(args.quiet);
    let baked = job::run(&scene, &options, &|stage, part| {
        bar.set_message(stage.to_owned());
        bar.set_position((part * 1000.0) as u64);
    });
    bar.finish_and_clear();
    let baked = baked.with_context(|| name.to_owned())?;
    files::write(output, &baked.bundle)?;
    if let Some(path) = &args.report {
        files::write(path, (baked.report.json() + "\n").as_bytes())?;
    }
    if let Some(folder) = &args.diagnostics {
        diagnostics::write(folder, &scene, &baked)?;
    }
    if args.quiet {
        return Ok(());
    }
    for warning in &baked.report.warnings {
        tell(format_args!("warning: {name}: {warning}"));
    }
    let mut rows = report::table(&baked.report);
    // A search for a goal chooses more than options can say.
    if options.goal.is_none()
        && let Some(found) = report::sooner(&baked.report)
    {
        rows.push(("sooner".to_owned(), format!("much the same without trials, as far as not given yet: {found}")));
    }
    print(&aligned(&rows))
}

/// What scenes are read from beside models, by the ends of their files' names.
const INPUTS: [&str; 13] = ["toml", "bin", "mtl", "png", "jpg", "jpeg", "gif", "tif", "tiff", "bmp", "tga", "webp", "dds"];

/// Refuses, as wrong usage, to write over the scene, or the report over the bundle; or to a name that only files of scenes have.
fn distinct(scene: &str, output: &Path, report: Option<&Path>) {
    let others = [("scene", Path::new(scene)), ("bundle", output)];
    let clash = clash("-o", output, &others[..1]).or_else(|| clash("--report", report?, &others));
    if let Some(clash) = clash {
        Cli::command().error(ErrorKind::ArgumentConflict, clash).exit();
    }
}

/// Why `option` may not write `path`, if so.
fn clash(option: &str, path: &Path, others: &[(&str, &Path)]) -> Option<String> {
    let shown = path.display();
    if let Some((what, _)) = others.iter().find(|(_, other)| files::same(path, other)) {
        return Some(format!("{option} {shown}: that is the {what}, which would be replaced; name another file"));
    }
    let end = path.extension()?.to_str()?.to_ascii_lowercase();
    let inputs = scene::MODELS.contains(&end.as_str()) || INPUTS.contains(&end.as_str());
    inputs.then(|| format!("{option} {shown}: so a scene's own files are called; expected OUT.cubist, or OUT.json for a report"))
}

fn inspect(args: &Inspect) -> Result<()> {
    let name = args.bundle.display();
    let bytes = files::read(&args.bundle).map_err(|what| anyhow!("{name}: {what}"))?;
    let inspection = Inspection::of(&bytes).map_err(|e| anyhow!("{name}: {e}; bake it afresh with `cubist-bake SCENE -o OUT.cubist`"))?;
    print(&if args.json { serde_json::to_string_pretty(&inspection)? + "\n" } else { inspection.text() })
}

fn throughput(args: &Throughput) -> Result<()> {
    threads(args.threads)?;
    let scene = load(&args.scene, &args.playback)?;
    let figures = throughput::measured(&scene);
    let ratio = if figures.obvhs_alone > 0.0 { figures.ours / figures.obvhs_alone } else { 0.0 };
    if args.json {
        let document = json!({
            "scene": scene.name,
            "triangles": scene.triangles.len(),
            "rays": figures.rays,
            "threads": rayon::current_num_threads(),
            "g_buffer_mrays_per_second": figures.ours,
            "obvhs_alone_mrays_per_second": figures.obvhs_alone,
            "ratio": ratio,
        });
        return print(&(serde_json::to_string_pretty(&document)? + "\n"));
    }
    let row = |name: &str, value: String| (name.to_owned(), value);
    print(&aligned(&[
        row("scene", format!("{}: {} triangles", scene.name, grouped(scene.triangles.len()))),
        row("rays", format!("{} on {} threads", grouped(figures.rays as usize), rayon::current_num_threads())),
        row("G-buffer", format!("{:.2} million rays/s", figures.ours)),
        row("obvhs alone", format!("{:.2} million rays/s", figures.obvhs_alone)),
        row("ratio", format!("{:.1} %", 100.0 * ratio)),
    ]))
}

/// Loads what SCENE names.
fn load(name: &str, playback: &Playback) -> Result<Scene> {
    let Playback { size, frames, fps, looping, up, turn } = *playback;
    let overrides = scene::Overrides { size, frames, fps, looping: looping.then_some(true), up };
    let scene = match name.strip_prefix("builtin:") {
        Some(builtin) => scene::load_builtin(builtin, &overrides)?,
        None => scene::load(Path::new(name), &overrides)?,
    };
    Ok(scene::turned(scene, turn.unwrap_or(0)))
}

fn threads(count: Option<u16>) -> Result<()> {
    match count {
        Some(count) => rayon::ThreadPoolBuilder::new().num_threads(count.into()).build_global().context("--threads: no threads to be had"),
        None => Ok(()),
    }
}

/// A progress bar of a thousand steps a stage; hidden where nobody watches.
fn bar(quiet: bool) -> ProgressBar {
    if quiet { ProgressBar::hidden() } else { terminal::bar(1000, "{msg:26} [{wide_bar}] {elapsed}") }
}
