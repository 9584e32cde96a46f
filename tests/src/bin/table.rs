//! Prints the project's tables, as Markdown or as one JSON document, or puts them into a document.
//! Tables come from `cubist_tests::tables`; they go to stdout or the file, progress to stderr.

use anyhow::{Result, ensure};
use clap::{Parser, Subcommand};
use cubist_baker::bake::Settings;
use cubist_baker::scene::{Overrides, builtin, load, load_builtin};
use cubist_tests::codecs::ffmpeg::Ffmpeg;
use cubist_tests::hard::baseline;
use cubist_tests::tables::document::Document;
use cubist_tests::tables::{self, Table, atlas, codecs, coverage, edges, hard};
use std::path::PathBuf;

/// Prints the tables of the README and the docs.
#[derive(Parser)]
#[command(name = "table")]
struct Arguments {
    #[command(subcommand)]
    table: Name,
    /// One JSON document instead of Markdown.
    #[arg(long, global = true, conflicts_with = "write")]
    json: bool,
    /// Replaces the table in this document, between `<!-- table: NAME -->` and `<!-- /table -->`, instead of printing it.
    #[arg(long, global = true, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Frames of every scene.
    #[arg(long, global = true)]
    frames: Option<u32>,
    /// Screen of every scene, WIDTHxHEIGHT.
    #[arg(long, global = true, value_parser = size)]
    size: Option<(u32, u32)>,
}

#[derive(Subcommand)]
enum Name {
    /// Every built-in scene at its own playback, as cubist-bake bakes it without options.
    Builtin,
    /// Every scene file (.toml) of a folder.
    Scenes {
        /// The folder.
        folder: PathBuf,
    },
    /// What telling surfaces apart is worth: from the way of 1998 to a perfect one.
    Coverage {
        /// Built-in scenes or scene files; left out: eight built-in ones.
        scenes: Vec<String>,
        /// Sides of a cell, pixels, a row of the table for each.
        #[arg(long, value_name = "PX", value_delimiter = ',')]
        cell: Vec<u32>,
    },
    /// Bytes beside those of other codecs at equal PSNR and SSIM (needs ffmpeg).
    Codecs {
        /// Built-in scenes or scene files; left out: four built-in ones.
        scenes: Vec<String>,
    },
    /// What scenes are cut into, how tightly that is packed, why cells are torn, and MJPEG and GIF beside it (needs ffmpeg for MJPEG).
    Atlas {
        /// Built-in scenes or scene files; left out: five built-in ones.
        scenes: Vec<String>,
    },
    /// Numerically hard scenes, each small, at a size of their own.
    Hard {
        /// Fails where a figure is worse than in fixtures/hard.json by more than 0.1 dB.
        #[arg(long)]
        check: bool,
        /// Writes fixtures/hard.json anew.
        #[arg(long, conflicts_with = "check")]
        update: bool,
    },
    /// What antialiased outlines are worth against the antialiased scene, and what they cost.
    Edges {
        /// Built-in scenes or scene files; left out: five built-in ones.
        scenes: Vec<String>,
    },
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let number = |side: &str| side.parse().map_err(|_| format!("expected WIDTHxHEIGHT such as 320x240, found {text}"));
    let (width, height) = text.split_once('x').unwrap_or((text, ""));
    Ok((number(width)?, number(height)?))
}

/// The scenes named, or these.
fn or_default(named: &[String], default: &[&str]) -> Vec<String> {
    if named.is_empty() { default.iter().map(|&name| name.to_owned()).collect() } else { named.to_vec() }
}

fn table(name: &Name, overrides: &Overrides) -> Result<Table> {
    let mut rows = Vec::new();
    Ok(match name {
        Name::Builtin => {
            for name in builtin::NAMES {
                rows.push(tables::builtin::measure(&load_builtin(name, overrides)?)?);
            }
            tables::builtin::table(rows)
        }
        Name::Scenes { folder } => {
            for file in tables::builtin::scene_files(folder)? {
                rows.push(tables::builtin::measure(&load(&file, overrides)?)?);
            }
            tables::builtin::table(rows)
        }
        Name::Coverage { scenes, cell } => {
            let cells = if cell.is_empty() { vec![Settings::default().cell] } else { cell.clone() };
            let (size, frames) = (overrides.size.or(Some(coverage::SIZE)), overrides.frames.or(Some(coverage::FRAMES)));
            let overrides = Overrides { size, frames, ..*overrides };
            for name in or_default(scenes, &coverage::SCENES) {
                rows.extend(coverage::measure(&tables::scene(&name, &overrides)?, &cells)?);
            }
            coverage::table(rows)
        }
        Name::Codecs { scenes } => {
            let ffmpeg = Ffmpeg::find();
            if ffmpeg.is_none() {
                eprintln!("there is no ffmpeg, hence only a GIF to compare with; for all codecs install it: apt-get install ffmpeg");
            }
            for name in or_default(scenes, &codecs::SCENES) {
                rows.extend(codecs::measure(&tables::scene(&name, overrides)?, ffmpeg.as_ref())?);
            }
            codecs::table(rows, ffmpeg.as_ref())
        }
        Name::Atlas { scenes } => {
            let ffmpeg = Ffmpeg::find();
            for name in or_default(scenes, &atlas::SCENES) {
                rows.push(atlas::measure(&tables::scene(&name, overrides)?, ffmpeg.as_ref())?);
            }
            atlas::table(rows)
        }
        Name::Hard { check, update } => {
            let figures = hard::measure_all()?;
            if *update {
                baseline::write(&figures)?;
            }
            if *check {
                let worse = hard::regressions(&figures, &baseline::read()?);
                ensure!(worse.is_empty(), "{}", worse.join("\n"));
            }
            hard::table(&figures)?
        }
        Name::Edges { scenes } => {
            for name in or_default(scenes, &edges::SCENES) {
                rows.push(edges::measure(&tables::scene(&name, overrides)?)?);
            }
            edges::table(rows)
        }
    })
}

impl Name {
    /// What stands in the table's marker.
    fn marker(&self) -> &'static str {
        match self {
            Self::Builtin => "builtin",
            Self::Scenes { .. } => "scenes",
            Self::Coverage { .. } => "coverage",
            Self::Codecs { .. } => "codecs",
            Self::Atlas { .. } => "atlas",
            Self::Edges { .. } => "edges",
            Self::Hard { .. } => "hard",
        }
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let document = arguments.write.as_deref().map(|file| Document::open(file, arguments.table.marker())).transpose()?;
    let overrides = Overrides { size: arguments.size, frames: arguments.frames, ..Overrides::default() };
    let table = table(&arguments.table, &overrides)?;
    if let Some(document) = document {
        document.write(&table.markdown)?;
    } else if arguments.json {
        println!("{}", serde_json::to_string_pretty(&table.json)?);
    } else {
        print!("{}", table.markdown);
    }
    Ok(())
}
