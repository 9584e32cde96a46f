//! `cubist-player`: a bundle in; a window, pictures or figures out.
//! The command line comes from `cli`; bytes from `input`; the exit code is 0, 1 (the input is at fault), 2 (usage)
//! or 130 (interrupted).

mod bake;
mod canvas;
mod cli;
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
mod files;
mod headless;
mod input;
mod keys;
mod measure;
mod overlay;
mod picture;
mod progress;
mod render;
mod stage;
mod text;
mod transport;
mod window;

use anyhow::Result;
use cli::{Cli, Command, Show, Usage};
use cubist_baker::files::clean_up_when_interrupted;
use cubist_baker::terminal::{aligned, arguments, print, tell};
use cubist_core::Bundle;
use input::Loaded;
use picture::Player;
use stage::Stage;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

fn main() -> ExitCode {
    let cli: Cli = arguments();
    let result = clean_up_when_interrupted().and_then(|()| match &cli.command {
        Some(Command::Render(args)) => {
            args.check()?;
            with_player(Some(&args.bundle), |_, _, mut player| render::run(&mut player, args))
        }
        Some(Command::Measure(args)) => {
            with_player(Some(&args.bundle), |loaded, bundle, mut player| measure::run(loaded, bundle, &mut player, args.json))
        }
        None => show(&cli.show),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tell(format_args!("error: {error:#}"));
            ExitCode::from(if error.is::<Usage>() { 2 } else { 1 })
        }
    }
}

/// The window, or files where there is no display.
fn show(args: &Show) -> Result<()> {
    if let (Some(shot), Some(bundle)) = (&args.shot, &args.input) {
        input::keep(bundle, "--shot", shot)?;
    }
    let events = if args.headless { None } else { Some(window::connect()) };
    with_player(args.input.as_deref(), |loaded, bundle, mut player| {
        let events = events.and_then(|events| {
            let told = events.inspect_err(|reason| {
                let instead = args.shot.as_deref().unwrap_or(&args.out).display();
                tell(format_args!("No display ({reason}): writing files instead of opening a window: {instead}"));
            });
            told.ok()
        });
        let mut rows = measure::facts(loaded, bundle);
        rows.extend(loaded.rows.iter().cloned());
        print(&aligned(&rows))?;
        if events.is_none() && args.shot.is_none() {
            return headless::pictures(&mut player, &args.out, args.frames, args.scale.unwrap_or(1));
        }
        let stage = Stage::new(player, loaded.bytes.len(), bundle.memory_needed(), args.scale, Duration::ZERO);
        // A shot without a number is of the first picture.
        let limit = args.frames.or(args.shot.as_ref().map(|_| 1));
        match (events, &args.shot) {
            (Some(events), shot) => window::run(events, stage, &format!("Cubist: {}", loaded.name), limit, shot.as_deref()),
            (None, Some(shot)) => headless::shot(stage, shot, limit.unwrap_or(1)),
            (None, None) => Ok(()),
        }
    })
}

/// Loads what `path` names and hands a player of it to `then`.
fn with_player(path: Option<&Path>, then: impl FnOnce(&Loaded, &Bundle<'_>, Player<'_>) -> Result<()>) -> Result<()> {
    let loaded = input::load(path)?;
    let bundle = input::parse(&loaded)?;
    let mut memory = input::memory(&bundle)?;
    let player = Player::with_texels(&bundle, &mut memory)?;
    then(&loaded, &bundle, player)
}
