//! `cubist-player measure`: what a bundle costs.
//! A bundle comes in and is played once from end to end; a table or one JSON document goes out.

use crate::input::{Loaded, print};
use crate::overlay::grouped;
use crate::picture::Picture;
use anyhow::Result;
use cubist_core::{Bundle, Player, Work};
use serde_json::{Value, json};
use std::time::Instant;

/// A counter of `Work` and its name in the JSON document.
type Counter = (&'static str, fn(&Work) -> u32);

const COUNTERS: [Counter; 5] = [
    ("keys", |w| w.keys),
    ("layers", |w| w.layers),
    ("smooth_pixels", |w| w.smooth_pixels),
    ("torn_pixels", |w| w.torn_pixels),
    ("coverage_tests", |w| w.coverage_tests),
];

/// Mean and largest of a counter over the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spread {
    mean: f64,
    max: u32,
}

/// Runs the command: a table, or with `as_json` one JSON document.
pub fn run(loaded: &Loaded, bundle: &Bundle<'_>, player: &mut Player<'_>, as_json: bool) -> Result<()> {
    let (width, height) = bundle.size();
    let mut picture = Picture::new(width, height);
    let start = Instant::now();
    let works: Vec<Work> = (0..bundle.frames()).map(|frame| picture.play(player, frame)).collect();
    let seconds = start.elapsed().as_secs_f64();
    let spreads = COUNTERS.map(|(name, count)| (name, spread(works.iter().map(count))));
    let speed = works.len() as f64 / seconds.max(1e-9);
    if as_json {
        let document = document(loaded, bundle, &spreads, seconds, speed);
        return print(&serde_json::to_string_pretty(&document)?);
    }
    let mut rows = facts(loaded, bundle);
    rows.push(("speed here".to_owned(), format!("{speed:.1} frames/s ({:.2} ms a frame)", 1000.0 * seconds / works.len().max(1) as f64)));
    for (name, spread) in spreads {
        rows.push((name.replace('_', " "), format!("mean {:.1}, max {}", spread.mean, grouped(spread.max.into()))));
    }
    print(&table(&rows))
}

/// What is known of a bundle before it plays, as rows of a table.
pub fn facts(loaded: &Loaded, bundle: &Bundle<'_>) -> Vec<(String, String)> {
    let (width, height) = bundle.size();
    let frames = bundle.frames();
    let end = if bundle.looping() { "looping" } else { "not looping" };
    let size = loaded.bytes.len() as u64;
    let row = |name: &str, value: String| (name.to_owned(), value);
    vec![
        row("bundle", loaded.name.clone()),
        row("pictures", format!("{frames} of {width} x {height}, {} frames/s, {end}", bundle.fps())),
        row("bundle size", format!("{} bytes", grouped(size))),
        row("per frame", format!("{:.1} bytes", size as f64 / f64::from(frames.max(1)))),
        row("working memory", format!("{} bytes + a row of {}", grouped(bundle.memory_needed() as u64), grouped(u64::from(width) * 2))),
    ]
}

/// Rows of name and value as text, the values in one column.
pub fn table(rows: &[(String, String)]) -> String {
    let widest = rows.iter().map(|r| r.0.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(name, value)| format!("{name:widest$}  {value}")).collect::<Vec<_>>().join("\n")
}

fn document(loaded: &Loaded, bundle: &Bundle<'_>, spreads: &[(&str, Spread)], seconds: f64, speed: f64) -> Value {
    let (width, height) = bundle.size();
    let work: serde_json::Map<String, Value> =
        spreads.iter().map(|(name, s)| ((*name).to_owned(), json!({ "mean": s.mean, "max": s.max }))).collect();
    json!({
        "bundle": loaded.name,
        "size": [width, height],
        "frames": bundle.frames(),
        "fps": bundle.fps(),
        "looping": bundle.looping(),
        "bytes": { "bundle": loaded.bytes.len(), "per_frame": loaded.bytes.len() as f64 / f64::from(bundle.frames().max(1)) },
        "memory": { "workspace": bundle.memory_needed(), "row": width * 2 },
        "host": { "seconds": seconds, "frames_per_second": speed },
        "work": work,
    })
}

fn spread(counts: impl Iterator<Item = u32>) -> Spread {
    let (mut sum, mut max, mut number) = (0u64, 0, 0u64);
    for count in counts {
        sum += u64::from(count);
        max = max.max(count);
        number += 1;
    }
    Spread { mean: sum as f64 / number.max(1) as f64, max }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_are_mean_and_maximum() {
        assert_eq!(spread([1, 2, 6].into_iter()), Spread { mean: 3.0, max: 6 });
        assert_eq!(spread([].into_iter()), Spread { mean: 0.0, max: 0 });
    }

    #[test]
    fn tables_align_their_values() {
        let rows = [("a".to_owned(), "1".to_owned()), ("long name".to_owned(), "2".to_owned())];
        assert_eq!(table(&rows), "a          1\nlong name  2");
    }
}
