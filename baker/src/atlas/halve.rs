//! Halving: a long or bent chart, beside which much of the source image stays empty, is cut in two where that saves more texels than its seam takes
//! keys. Charts come from the charting, layouts from `pack`; the charting goes back with the cuts in it.

use super::footprint::Footprints;
use super::mask::{Mask, Run};
use super::pack::Layout;
use super::place::Place;
use crate::chart::{self, Chart, Charting, Parts};
use crate::gbuffer::Hits;
use crate::scene::Scene;
use std::cmp::Reverse;

/// An image filled like this is left alone.
const FULL: f64 = 0.75;
/// Charts cut, at most.
const CUTS: usize = 8;
/// Charts tried for each cut: those whose rectangles are longest.
const TRIED: usize = 3;
/// Shorter ones are not cut, texels.
const SHORT: u32 = 24;
/// The part of a chart's length that each half keeps at least.
const LEAST: f64 = 0.25;
/// What keys are told to cost more, they have to save so many times: a seam costs quality and time, too.
const WORTH: f64 = 3.0;
/// Nothing is cut for less than this share of the image: every cut takes memory of the player, too.
const SOME: f64 = 0.1;

/// Cuts some of the charts in two while that pays in an image of raw texels that take `texel` bytes each; how many, and how `pack` lays all charts out then.
pub(super) fn halve(
    scene: &Scene,
    hits: &Hits,
    charting: &mut Charting,
    texel: f64,
    pack: impl Fn(&Charting) -> Option<Layout>,
) -> (usize, Option<Layout>) {
    let (mut packed, mut cuts) = (pack(charting), 0);
    // Where not all the density fits, room is short for another reason.
    while let Some(layout) = packed.as_ref().filter(|layout| layout.scale >= 1.0 && cuts < CUTS) {
        let whole = layout.worth();
        let sizes: Vec<[u32; 2]> = layout.places.iter().map(Place::size).collect();
        let masks = Footprints::new(scene, hits, charting).drawn(&sizes, layout.scale);
        let area: u32 = masks.iter().map(Mask::area).sum();
        if f64::from(area) >= FULL * f64::from(whole) {
            break;
        }
        let keys = chart::price(hits, charting);
        let mut best: Option<Cut> = None;
        for chart in longest(&masks) {
            let Some(line) = thinnest(&masks[chart], &charting.charts[chart]) else { continue };
            let Some(before) = charting.sever(hits, chart, line) else { continue };
            let told = chart::price(hits, charting);
            let layout = pack(charting).filter(|layout| layout.scale >= 1.0);
            let cut = charting.exchange(before);
            let Some(layout) = layout else { continue };
            let saved = whole.saturating_sub(layout.worth());
            let gain = texel * f64::from(saved) - WORTH * (told - keys);
            if f64::from(saved) > SOME * f64::from(whole) && gain > best.as_ref().map_or(0.0, |best| best.gain) {
                best = Some(Cut { gain, cut, layout });
            }
        }
        let Some(Cut { cut, layout, .. }) = best else { break };
        charting.exchange(cut);
        (packed, cuts) = (Some(layout), cuts + 1);
    }
    (cuts, packed)
}

/// A cut that pays.
struct Cut {
    /// Bytes that it saves, what keys take weighed.
    gain: f64,
    cut: Parts,
    layout: Layout,
}

/// The charts to try, those whose rectangles are longest first.
fn longest(masks: &[Mask]) -> impl Iterator<Item = usize> + use<> {
    let side = |chart: usize| masks[chart].width.max(masks[chart].height);
    let mut longest: Vec<usize> = (0..masks.len()).filter(|&chart| side(chart) >= SHORT).collect();
    longest.sort_by_key(|&chart| (Reverse(side(chart)), chart));
    longest.into_iter().take(TRIED)
}

/// Where a chart is thinnest across the longer side of its rectangle: the flattened coordinate along that, and what it is there.
fn thinnest(mask: &Mask, chart: &Chart) -> Option<(usize, f64)> {
    let axis = usize::from(mask.height > mask.width);
    let long = [mask.width, mask.height][axis] as usize;
    let mut across = vec![0u32; long];
    for Run { row, start, length } in mask.runs() {
        match axis {
            0 => across[start as usize..(start + length) as usize].iter_mut().for_each(|texels| *texels += 1),
            _ => across[row as usize] += length,
        }
    }
    let part = |share: f64| (share * long as f64) as usize;
    let at = (part(LEAST)..part(1.0 - LEAST)).min_by_key(|&at| (across[at], (2 * at).abs_diff(long)))?;
    Some((axis, chart.lo[axis] + (chart.hi[axis] - chart.lo[axis]) * (at as f64 + 0.5) / long as f64))
}
