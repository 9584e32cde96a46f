//! Halving: a long or bent chart, beside which much of the source image stays empty, is cut in two where that saves more texels than its seam takes
//! keys. Charts come from the charting, layouts from `pack`; the charting goes back with the cuts in it.

use super::footprint::Footprints;
use super::mask::{Mask, Run};
use super::pack::{self, Layout};
use crate::chart::{self, Chart, Charting};
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
/// A texel's bytes, its bit of the mask counted in.
const TEXEL: f64 = 1.125;
/// What keys are told to cost more, they have to save so many times: a seam costs quality and time, too.
const WORTH: f64 = 3.0;
/// Nothing is cut for less than this share of the image: every cut takes memory of the player, too.
const SOME: f64 = 0.1;

/// What became of the charts.
pub(super) struct Halved {
    /// How they are packed.
    pub layout: Layout,
    /// How many were cut.
    pub cuts: usize,
}

/// Packs the charts for an image of raw texels, and cuts some of them in two while that pays; `None` where they do not fit.
pub(super) fn halve(scene: &Scene, hits: &Hits, charting: &mut Charting, backdrop: [u32; 2], max_side: u32) -> Option<Halved> {
    let packed = |charting: &Charting| pack::pack(&Footprints::new(scene, hits, charting), backdrop, max_side);
    let mut halved = Halved { layout: packed(charting)?, cuts: 0 };
    let mut price = None;
    while halved.cuts < CUTS {
        let masks = Footprints::new(scene, hits, charting).drawn(&pack::sizes(charting, 1.0, max_side), 1.0);
        let (whole, area) = (texels(&halved.layout), masks.iter().map(Mask::area).sum::<u32>());
        // Where not all the density fits, room is short for another reason.
        if halved.layout.scale < 1.0 || f64::from(area) >= FULL * whole {
            break;
        }
        let before = *price.get_or_insert_with(|| chart::price(hits, charting));
        let side = |chart: usize| masks[chart].width.max(masks[chart].height);
        let mut longest: Vec<usize> = (0..masks.len()).filter(|&chart| side(chart) >= SHORT).collect();
        longest.sort_by_key(|&chart| (Reverse(side(chart)), chart));
        let mut best: Option<Cut> = None;
        for chart in longest.into_iter().take(TRIED) {
            let Some(line) = thinnest(&masks[chart], &charting.charts[chart]) else { continue };
            let Some(uncut) = charting.sever(hits, chart, line) else { continue };
            if let Some(layout) = packed(charting).filter(|layout| layout.scale >= 1.0) {
                let (keys, texels) = (chart::price(hits, charting), texels(&layout));
                let gain = TEXEL * (whole - texels) - WORTH * (keys - before);
                if texels < (1.0 - SOME) * whole && gain > best.as_ref().map_or(0.0, |best| best.gain) {
                    best = Some(Cut { gain, chart, line, keys, layout });
                }
            }
            charting.mend(uncut);
        }
        let Some(Cut { chart, line, keys, layout, .. }) = best else { break };
        charting.sever(hits, chart, line)?;
        price = Some(keys);
        halved = Halved { layout, cuts: halved.cuts + 1 };
    }
    Some(halved)
}

/// A cut that pays.
struct Cut {
    /// Bytes that it saves, what keys take weighed.
    gain: f64,
    chart: usize,
    /// See [`Charting::sever`].
    line: (usize, f64),
    /// What keys are told to take then, bytes.
    keys: f64,
    layout: Layout,
}

fn texels(layout: &Layout) -> f64 {
    f64::from(layout.width) * f64::from(layout.height)
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
