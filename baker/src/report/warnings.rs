//! What the user should know of a bundle: what it does not show, and what to do about that. Figures come from the report's own origin.

use super::origin::Origin;
use crate::finer::{TORN, uneven};
use crate::verify::Quality;

/// Below this share of the resolution asked for, the source image is called too small.
const COARSE: f64 = 0.7;
/// From this share of pixels on, %, left-out surfaces are worth a warning.
const DROPPED_PERCENT: f64 = 0.01;
/// From as many of those that show the scene on, %, it can be seen that things are not whole.
const PARTS_PERCENT: f64 = 2.0;
/// Where a larger share of the pixels that show the scene is lost, %, smaller cells alone are no cure.
const LOST_PERCENT: f64 = 25.0;

/// What the scene's loader warned of, and the pipeline itself.
pub(super) fn of(origin: &Origin<'_>, quality: &Quality) -> Vec<String> {
    let own =
        [surfaces(origin, quality.wrong_surface_percent), source_image(origin), shared_labels(origin), crossed(origin), still(origin)]
            .into_iter()
            .flatten();
    let wrong = origin.flat.atlas.gbuffer.of_seen(quality.wrong_surface_percent);
    origin.scene.warnings.iter().cloned().chain(own).chain(missing(quality, wrong, closest(origin))).collect()
}

/// Surfaces that are not shown, because they are too small on the screen.
fn surfaces(origin: &Origin<'_>, wrong: f64) -> Option<String> {
    let Origin { flat, encoded, settings, .. } = origin;
    let (cell, interval) = (settings.cell, closest(origin));
    let dropped = 100.0 * encoded.dropped_pixels as f64 / flat.rays.max(1) as f64;
    // Of those that show more than the backdrop.
    let lost = flat.atlas.gbuffer.of_seen(dropped);
    if lost > LOST_PERCENT {
        return Some(format!(
            "{lost:.0} % of what the camera sees of the scene is not shown: its surfaces are too small on the screen for cells of {cell} x {cell} pixels; \
             bring the camera nearer, raise --size, or try --cell 4 --key-interval 1 --sheets all"
        ));
    }
    let cure = finer(cell, interval);
    let (or, cure) = match settings.error > 0.0 {
        true => (", or is not worth its bytes there", format!("--sheets all keeps more of them; {cure}")),
        false => ("", cure.to_owned()),
    };
    let parts = if lost >= PARTS_PERCENT { "things lose parts: " } else { "" };
    // What else is wrong is outlines that keys and cells do not follow.
    let all = if wrong > 1.5 * dropped { format!(" ({wrong:.2} % show a wrong surface in all)") } else { String::new() };
    (dropped > DROPPED_PERCENT).then(|| {
        format!(
            "{parts}{dropped:.2} % of the pixels show a neighbour because their own surface is left out{all}: a cell of {cell} x {cell} pixels x {interval} frames \
             leaves out what covers too little of it{or}; {cure}"
        )
    })
}

/// Frames between keys, on the mean where they stand closer than asked for: on short paths and quick turns.
fn closest(origin: &Origin<'_>) -> u32 {
    origin.settings.key_interval.min(origin.encoded.grid.spacing())
}

/// What keeps surfaces too small for cells of `cell` pixels and keys every `interval` frames.
fn finer(cell: u32, interval: u32) -> &'static str {
    match (cell, interval) {
        (5.., 2..) => "a shorter --key-interval or smaller cells (--cell) keep them",
        (5.., _) => "smaller cells (--cell) keep them",
        // There are no smaller cells than of 4 pixels.
        (_, 2..) => "a shorter --key-interval keeps them",
        _ => "a larger --size keeps them",
    }
}

/// A source image that is coarser than was asked for.
fn source_image(origin: &Origin<'_>) -> Option<String> {
    let (settings, scale) = (&origin.settings.atlas, origin.flat.atlas.figures.scale);
    let cure = match settings.max_side {
        side @ ..1024 => format!("raise --atlas above {side}"),
        _ => "shorten the path or lower --size".to_owned(),
    };
    (scale < COARSE).then(|| {
        format!(
            "the source image holds {:.0} % of the resolution asked for, {:.2} texels a pixel at the closest view; {cure}",
            100.0 * scale,
            scale * settings.density
        )
    })
}

/// Charts that have a label in common.
fn shared_labels(origin: &Origin<'_>) -> Option<String> {
    let figures = &origin.flat.atlas.figures;
    let but = match figures.crowded {
        0 => String::new(),
        crowded => format!(", but for {crowded} that little is seen of, for want of labels; lower --size or simplify the scene"),
    };
    (figures.charts + 1 > figures.labels).then(|| {
        format!(
            "{} charts share {} labels: charts that are never seen near each other have one in common{but}",
            figures.charts,
            figures.labels - 1
        )
    })
}

/// A path that goes through things.
fn crossed(origin: &Origin<'_>) -> Option<String> {
    let (first, rest) = origin.flat.crossed.split_first()?;
    let more = if rest.is_empty() { String::new() } else { format!(", and {} more times", rest.len()) };
    Some(format!(
        "the camera goes through a surface between frames {first} and {}{more}: what is behind it shows all at once; move the path around it",
        first + 1
    ))
}

/// A loop that goes nowhere.
fn still(origin: &Origin<'_>) -> Option<String> {
    let play = &origin.scene.playback;
    (play.looping && play.frames == 1).then(|| "a looping path of one frame shows a single picture".to_owned())
}

/// A frame in which whole things are missing. `wrong`: pixels of what is seen, percent.
fn missing(quality: &Quality, wrong: f64, interval: u32) -> Option<String> {
    let off = uneven(wrong, [quality.psnr_mean, quality.psnr_min])?;
    let cure = if interval > 1 { "--key-interval 1 keeps most of it" } else { "a slower path, or more --frames, keeps it" };
    let what = match wrong >= TORN {
        true => "what shows for a few frames only, as things that sweep past the camera do, is missing there",
        false => "what moves most from key to key is out of place there",
    };
    Some(format!("frame {} is {off:.1} dB worse than the mean: {what}; {cure}", quality.worst_frame))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_can_be_followed() {
        assert!(finer(8, 8).contains("--cell"));
        assert!(finer(4, 8).contains("--key-interval"));
        assert!(finer(4, 1).contains("--size"));
    }

    #[test]
    fn what_is_missing_in_a_frame_is_told() {
        let quality = |psnr_min| Quality { psnr_mean: 30.0, psnr_min, worst_frame: 7, ..Quality::default() };
        assert!(missing(&quality(25.0), 3.0, 8).unwrap().starts_with("frame 7 is 5.0 dB worse"));
        assert!(missing(&quality(25.0), 3.0, 1).unwrap().contains("--frames"));
        assert!(missing(&quality(25.0), 1.0, 8).is_none() && missing(&quality(27.0), 3.0, 8).is_none());
        assert!(missing(&quality(22.0), 0.1, 8).unwrap().contains("out of place"));
        assert!(missing(&Quality { psnr_mean: 44.0, ..quality(35.0) }, 3.0, 8).is_none(), "and good enough");
    }
}
