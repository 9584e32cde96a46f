//! `cubist-player measure`: what a bundle costs.
//! A bundle comes in and is played once from end to end; a table or one JSON document goes out.

use crate::input::Loaded;
use crate::picture::{Picture, Player};
use crate::progress::progress;
use anyhow::Result;
use cubist_baker::terminal::{aligned, grouped, print};
use cubist_core::format::{ATLAS, Section};
use cubist_core::{Bundle, Frame, Work};
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

/// Sum and largest of a counter over the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Spread {
    sum: u64,
    max: u32,
}

impl Spread {
    fn add(&mut self, count: u32) {
        self.sum += u64::from(count);
        self.max = self.max.max(count);
    }

    fn mean(self, frames: u32) -> f64 {
        self.sum as f64 / f64::from(frames.max(1))
    }
}

/// Runs the command: a table, or with `as_json` one JSON document.
pub fn run(loaded: &Loaded, bundle: &Bundle<'_>, player: &mut Player<'_>, as_json: bool) -> Result<()> {
    let (width, height) = bundle.size();
    let frames = bundle.frames();
    let mut picture = Picture::new(width, height);
    // As in playback that goes on: in a loop frame 0 finds there what the last one has left; elsewhere it decodes from the first key on, as in a new player.
    player.seek(Frame(frames - 1));
    let mut spreads = [Spread::default(); COUNTERS.len()];
    let bar = progress(frames.into(), "frames");
    let start = Instant::now();
    for frame in 0..frames {
        let work = picture.play(player, frame);
        for (spread, (_, count)) in spreads.iter_mut().zip(COUNTERS) {
            spread.add(count(&work));
        }
        bar.inc(1);
    }
    let seconds = start.elapsed().as_secs_f64();
    bar.finish_and_clear();
    // Backwards every step past a key decodes anew.
    let mut backwards = Spread::default();
    for frame in (0..frames).rev() {
        player.seek(Frame(frame));
        backwards.add(player.work().keys);
    }
    if as_json {
        return print(&(serde_json::to_string_pretty(&document(loaded, bundle, &spreads, backwards, seconds))? + "\n"));
    }
    let mut rows = facts(loaded, bundle);
    rows.extend(bundle.sections().map(|s| (format!("section {}", tag(&s)), format!("{} bytes", grouped(s.bytes.len())))));
    rows.push((
        "keys".to_owned(),
        format!(
            "{} bytes in {} keys, {:.1} a frame",
            grouped(key_bytes(bundle)),
            bundle.key_count(),
            key_bytes(bundle) as f64 / f64::from(frames)
        ),
    ));
    rows.push((
        "speed here".to_owned(),
        format!("{:.1} frames/s, {:.2} ms a frame", f64::from(frames) / seconds.max(1e-9), 1000.0 * seconds / f64::from(frames)),
    ));
    for ((name, _), spread) in COUNTERS.iter().zip(spreads) {
        rows.push((
            format!("{} a frame", name.replace('_', " ")),
            format!("mean {:.1}, max {}", spread.mean(frames), grouped(spread.max as usize)),
        ));
    }
    rows.push(("keys a frame backwards".to_owned(), format!("mean {:.1}, max {}", backwards.mean(frames), backwards.max)));
    rows.push(("keys a seek".to_owned(), format!("at most {}", bundle.limits().seek_keys)));
    print(&aligned(&rows))
}

/// What is known of a bundle before it plays, as rows of a table.
pub fn facts(loaded: &Loaded, bundle: &Bundle<'_>) -> Vec<(String, String)> {
    let (width, height) = bundle.size();
    let frames = bundle.frames();
    let end = if bundle.looping() { "looping" } else { "not looping" };
    let size = loaded.bytes.len();
    let row = |name: &str, value: String| (name.to_owned(), value);
    vec![
        row("bundle", loaded.name.clone()),
        row("pictures", format!("{frames} of {width} x {height}, {} frames/s, {end}", bundle.fps())),
        row("bundle size", format!("{} bytes", grouped(size))),
        row("per frame", format!("{:.1} bytes", size as f64 / f64::from(frames.max(1)))),
        row("working memory", format!("{} bytes + a row of {}", grouped(bundle.memory_needed()), grouped(width as usize * 2))),
    ]
}

fn document(loaded: &Loaded, bundle: &Bundle<'_>, spreads: &[Spread], backwards: Spread, seconds: f64) -> Value {
    let (width, height) = bundle.size();
    let frames = bundle.frames();
    let per_frame = |bytes: usize| bytes as f64 / f64::from(frames);
    let size = loaded.bytes.len();
    let work = COUNTERS.iter().zip(spreads).map(|((name, _), s)| ((*name).to_owned(), json!({ "mean": s.mean(frames), "max": s.max })));
    let sections: Vec<Value> =
        bundle.sections().map(|s| json!({ "tag": tag(&s), "required": s.required, "bytes": s.bytes.len() })).collect();
    let atlas: usize = bundle.sections().filter(|s| s.tag == ATLAS).map(|s| s.bytes.len()).sum();
    json!({
        "bundle": loaded.name,
        "size": [width, height],
        "frames": frames,
        "fps": bundle.fps(),
        "looping": bundle.looping(),
        "keys": bundle.key_count(),
        "bytes": {
            "bundle": size,
            "per_frame": per_frame(size),
            "atlas": atlas,
            "keys": key_bytes(bundle),
            "keys_per_frame": per_frame(key_bytes(bundle)),
        },
        "sections": sections,
        "memory": { "workspace": bundle.memory_needed(), "row": width * 2 },
        "host": { "seconds": seconds, "frames_per_second": f64::from(frames) / seconds.max(1e-9) },
        "work": work.collect::<serde_json::Map<String, Value>>(),
        "keys_backwards": { "mean": backwards.mean(frames), "max": backwards.max },
        "seek_keys_max": bundle.limits().seek_keys,
    })
}

/// Bytes of the key records and their table.
fn key_bytes(bundle: &Bundle<'_>) -> usize {
    bundle.path().key_bytes()
}

fn tag(section: &Section<'_>) -> String {
    String::from_utf8_lossy(&section.tag).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_are_mean_and_maximum() {
        let mut spread = Spread::default();
        [1, 2, 6].into_iter().for_each(|count| spread.add(count));
        assert_eq!((spread.mean(3), spread.max), (3.0, 6));
    }
}
