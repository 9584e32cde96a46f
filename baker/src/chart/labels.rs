//! Labels for charts: one each while there are few, shared by charts that never meet on the screen when there are many.
//! Charts come from the charting; labels go into the G-buffer.

use super::Charting;
use crate::gbuffer::{BACKGROUND, Hits};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Pixels of a side of a block: charts within a block or its neighbours meet.
const BLOCK: usize = 16;
/// Charts that keep a label of their own when others have to share.
const ALONE: usize = 127;

/// The label of each chart, from 1, and the number of labels. Up to `limit` charts have a label each; beyond that the
/// charts seen most keep theirs and the rest share, never two that are seen within neighbouring blocks of 16 pixels
/// in neighbouring blocks of 16 frames. Where more than `limit` would be needed, the number may be too small, but not as small as `limit`.
pub fn assign(hits: &Hits, charting: &Charting, limit: usize) -> (Vec<u16>, usize) {
    let count = charting.charts.len();
    if count <= limit {
        return ((1..=count as u16).collect(), count);
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&c| (std::cmp::Reverse(charting.charts[c].hits), c));
    let alone = ALONE.min(limit / 2);
    let mut labels = vec![0u16; count];
    for (i, &c) in order.iter().take(alone).enumerate() {
        labels[c] = i as u16 + 1;
    }
    let meets = match meetings(hits, charting, &labels, limit.saturating_sub(alone) + 1) {
        Ok(meets) => meets,
        Err(crowd) => return (labels, alone + crowd),
    };
    let mut most = alone;
    for &c in order.iter().skip(alone) {
        let taken: BTreeSet<u16> = meets[c].iter().map(|&o| labels[o as usize]).collect();
        let free = (alone as u16 + 1..).find(|l| !taken.contains(l)).unwrap_or(u16::MAX);
        labels[c] = free;
        most = most.max(usize::from(free));
    }
    (labels, most)
}

/// The charts without a label that each of them meets. Fails with how many of them are in one block, if those alone are more than `most`: pairs of
/// all that meet would then fill any memory.
fn meetings(hits: &Hits, charting: &Charting, labels: &[u16], most: usize) -> Result<Vec<Vec<u32>>, usize> {
    let (width, height) = (hits.width as usize, hits.height as usize);
    let (across, down) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let frame_size = (width * height).max(1);
    let blocks: Vec<Vec<BTreeSet<u32>>> = hits
        .samples
        .par_chunks(frame_size * BLOCK)
        .map(|samples| {
            let mut seen = vec![BTreeSet::new(); across * down];
            for (i, s) in samples.iter().enumerate().filter(|(_, s)| s.surface != BACKGROUND) {
                let chart = charting.chart_of[charting.faces.of[s.surface as usize] as usize];
                if labels[chart as usize] == 0 {
                    let (x, y) = (i % width, i % frame_size / width);
                    seen[y / BLOCK * across + x / BLOCK].insert(chart);
                }
            }
            seen
        })
        .collect();
    let crowd = blocks.iter().flatten().map(BTreeSet::len).max().unwrap_or(0);
    if crowd > most {
        return Err(crowd);
    }
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for (t, now) in blocks.iter().enumerate() {
        for (i, set) in now.iter().enumerate() {
            let (bx, by) = (i % across, i / across);
            let columns = bx.saturating_sub(1)..=(bx + 1).min(across - 1);
            let near = (by.saturating_sub(1)..=(by + 1).min(down - 1)).flat_map(|y| columns.clone().map(move |x| y * across + x));
            let near: BTreeSet<u32> =
                near.flat_map(|j| blocks[t..(t + 2).min(blocks.len())].iter().flat_map(move |b| &b[j])).copied().collect();
            for &a in set {
                pairs.extend(near.iter().filter(|&&b| b != a).flat_map(|&b| [(a, b), (b, a)]));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
    }
    let mut meets = vec![Vec::new(); labels.len()];
    for (a, b) in pairs {
        meets[a as usize].push(b);
    }
    Ok(meets)
}
