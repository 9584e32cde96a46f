//! Folds: parts of a chart that would cover each other are taken out into charts of their own.
//! Measured charts come in; charts whose texels each show one depth go on to the packing.

use super::charting::{Charting, Projection};
use super::observe::Links;
use crate::gbuffer::{BACKGROUND, Hits};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::VecDeque;

/// The share of a face's texels that may lie over others before it has to go.
const TOLERATED: usize = 8;
/// Parts seen by a smaller share of all pixels stay where they are: 150 in 128 frames of 320x240.
const FEW: f64 = 150.0 / 9.8e6;
/// States of a face while its chart is examined.
const OUTSIDE: u8 = 0;
const WAITING: u8 = 1;
const QUEUED: u8 = 2;
const KEPT: u8 = 3;
const REJECTED: u8 = 4;
/// Texels a chart's side has at most while it is examined.
const FINEST: f64 = 1024.0;

/// What one face shows in one texel.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Touch {
    face: u32,
    texel: u32,
    /// Single-precision bits, turned so that they order like the depths.
    depth: u32,
}

fn ordered(depth: f32) -> u32 {
    let bits = depth.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | (1 << 31) }
}

fn depth(ordered: u32) -> f32 {
    f32::from_bits(if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered })
}

/// The grid a chart is examined on.
#[derive(Clone, Copy)]
struct Grid {
    lo: [f64; 2],
    density: f64,
    width: u32,
    height: u32,
    /// Depths are measured from here: they have to fit single precision.
    depth: f64,
}

/// Splits charts that fold over themselves; returns whether there were any.
pub(super) fn split(hits: &Hits, charting: &mut Charting, links: &Links) -> bool {
    let touches = touches(hits, charting);
    let mut first = vec![touches.len(); charting.faces.list.len() + 1];
    for (i, t) in touches.iter().enumerate().rev() {
        first[t.face as usize] = i;
    }
    for f in (0..charting.faces.list.len()).rev() {
        first[f] = first[f].min(first[f + 1]);
    }
    let mut found = false;
    let few = (FEW * hits.samples.len() as f64) as u64;
    let mut state = vec![OUTSIDE; charting.faces.list.len()];
    let mut work: VecDeque<(u32, Vec<u32>)> = (0u32..).zip(charting.members()).collect();
    while let Some((chart, faces)) = work.pop_front() {
        let rejected = examine(charting, links, &faces, chart, &mut state, |f| &touches[first[f as usize]..first[f as usize + 1]]);
        for part in rejected {
            // A few wrong pixels cost less than another chart.
            if charting.seen(&part) < few {
                continue;
            }
            found = true;
            let id = charting.take_out(chart, &part);
            work.push_back((id, part));
        }
    }
    found
}

fn grid(charting: &Charting, chart: usize) -> Grid {
    let c = &charting.charts[chart];
    let longest = (c.hi[0] - c.lo[0]).max(c.hi[1] - c.lo[1]).max(f64::MIN_POSITIVE);
    let density = c.density.min(FINEST / longest);
    let cells = |k: usize| ((c.hi[k] - c.lo[k]) * density).ceil().clamp(1.0, FINEST) as u32;
    Grid { lo: c.lo, density, width: cells(0), height: cells(1), depth: 0.0 }
}

fn grids(charting: &Charting) -> Vec<Grid> {
    let mut grids: Vec<Grid> = (0..charting.charts.len()).map(|c| grid(charting, c)).collect();
    let mut set = vec![false; grids.len()];
    for (corners, &c) in charting.corners.iter().zip(&charting.chart_of) {
        if !std::mem::replace(&mut set[c as usize], true) {
            grids[c as usize].depth = corners[0][2];
        }
    }
    grids
}

/// Every texel every face shows, in the order of the faces. Faces of flat charts are left out.
fn touches(hits: &Hits, charting: &Charting) -> Vec<Touch> {
    let grids = grids(charting);
    let flat: Vec<bool> = charting.deep().iter().zip(&grids).map(|(deep, g)| *deep < 2.0 / g.density).collect();
    let frame_size = ((hits.width * hits.height) as usize).max(1);
    let parts: Vec<Vec<Touch>> = hits
        .samples
        .par_chunks(frame_size * 4)
        .map(|samples| {
            let mut out = Vec::new();
            for s in samples.iter().filter(|s| s.surface != BACKGROUND) {
                let face = charting.faces.of[s.surface as usize];
                let chart = charting.chart_of[face as usize] as usize;
                if flat[chart] {
                    continue;
                }
                let g = &grids[chart];
                let [u, v, d] = charting.flat(face as usize, f64::from(s.b), f64::from(s.c));
                let x = (((u - g.lo[0]) * g.density).max(0.0) as u32).min(g.width - 1);
                let y = (((v - g.lo[1]) * g.density).max(0.0) as u32).min(g.height - 1);
                out.push(Touch { face, texel: y * g.width + x, depth: ordered((d - g.depth) as f32) });
            }
            out.sort_unstable();
            out.dedup_by_key(|t| (t.face, t.texel));
            out
        })
        .collect();
    let mut all = parts.concat();
    all.par_sort_unstable();
    all.dedup_by_key(|t| (t.face, t.texel));
    all
}

/// Lays the faces of a chart down one after another, neighbours first; returns those that would cover others, as
/// connected parts.
fn examine<'t>(
    charting: &Charting,
    links: &Links,
    faces: &[u32],
    chart: u32,
    state: &mut [u8],
    touched: impl Fn(u32) -> &'t [Touch],
) -> Vec<Vec<u32>> {
    let normal = match charting.charts[chart as usize].projection {
        Projection::Plane([_, _, normal]) | Projection::Point(_, [_, _, normal], _) => Some(normal),
        Projection::Unwrapped(_) => None,
        Projection::Texture => return Vec::new(),
    };
    if faces.iter().all(|&f| touched(f).is_empty()) {
        return Vec::new();
    }
    let mut order = faces.to_vec();
    order.sort_by_key(|&f| (std::cmp::Reverse(charting.faces.list[f as usize].hits), f));
    faces.iter().for_each(|&f| state[f as usize] = WAITING);
    lay_down(charting, links, &order, (&grid(charting, chart as usize), normal), state, touched);
    let parts = rejected(links, &order, state);
    faces.iter().for_each(|&f| state[f as usize] = OUTSIDE);
    parts
}

/// Lays faces down in `order`, and after each its neighbours, on a grid of texels; `normal`: that of their plane. What would cover others is rejected.
fn lay_down<'t>(
    charting: &Charting,
    links: &Links,
    order: &[u32],
    (g, normal): (&Grid, Option<DVec3>),
    state: &mut [u8],
    touched: impl Fn(u32) -> &'t [Touch],
) {
    let mut depths = vec![f32::NAN; (g.width * g.height) as usize];
    let mut queue = VecDeque::new();
    let mut kept = 0;
    for &seed in order {
        if state[seed as usize] != WAITING {
            continue;
        }
        queue.push_back(seed);
        state[seed as usize] = QUEUED;
        while let Some(f) = queue.pop_front() {
            let touches = touched(f);
            let step = ((2.0 + 2.0 * slope(charting, f as usize, normal)) / g.density) as f32;
            let over = |t: &&Touch| (depth(t.depth) - depths[t.texel as usize]).abs() > step;
            let bad = touches.iter().filter(over).count();
            if bad > 0 && bad * TOLERATED >= touches.len() && kept > 0 {
                state[f as usize] = REJECTED;
                continue;
            }
            kept += 1;
            state[f as usize] = KEPT;
            for t in touches {
                let here = &mut depths[t.texel as usize];
                if here.is_nan() {
                    *here = depth(t.depth);
                }
            }
            for &(n, _) in links.of(f) {
                if state[n as usize] == WAITING {
                    state[n as usize] = QUEUED;
                    queue.push_back(n);
                }
            }
        }
    }
}

/// How much deeper a face gets along its chart, at most, over as much of it.
fn slope(charting: &Charting, face: usize, normal: Option<DVec3>) -> f64 {
    match normal {
        Some(normal) => {
            let cosine = charting.faces.list[face].normal.dot(normal).abs().max(0.2);
            (1.0 / (cosine * cosine) - 1.0).sqrt()
        }
        // No step along the surface is more than what the face is stretched by, unless it is stretched much more one way.
        None => 2.0 * charting.stretch(face),
    }
}

/// The connected parts of what was rejected, in `order`; nothing is any more.
fn rejected(links: &Links, order: &[u32], state: &mut [u8]) -> Vec<Vec<u32>> {
    let mut parts = Vec::new();
    for &seed in order {
        if state[seed as usize] != REJECTED {
            continue;
        }
        let mut part = vec![seed];
        state[seed as usize] = OUTSIDE;
        let mut head = 0;
        while let Some(&f) = part.get(head) {
            head += 1;
            for &(n, _) in links.of(f) {
                if state[n as usize] == REJECTED {
                    state[n as usize] = OUTSIDE;
                    part.push(n);
                }
            }
        }
        parts.push(part);
    }
    parts
}
