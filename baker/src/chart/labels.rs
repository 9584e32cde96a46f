//! Labels for charts: one each while there are few, shared by charts that do not meet on the screen when there are many.
//! Charts come from the charting; labels go into the G-buffer.

use super::charting::Charting;
use crate::gbuffer::{BACKGROUND, Hits};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Pixels of a side of a block: charts within a block or its neighbours meet.
const BLOCK: usize = 16;
/// Charts that keep a label of their own when others have to share.
const ALONE: usize = 127;

/// Labels of charts.
pub struct Labels {
    /// Each chart's, from 1.
    pub of: Vec<u16>,
    /// How many there are.
    pub count: usize,
    /// Charts that are seen near another one of their label, for want of others.
    pub crowded: usize,
}

/// The labels of all charts. Up to `limit` charts have a label each; beyond that the charts seen most keep theirs and the rest share, as far as there are
/// enough never two that are seen within neighbouring blocks of 16 pixels in neighbouring blocks of 16 frames; else two of which little is seen.
pub fn assign(hits: &Hits, charting: &Charting, limit: usize) -> Labels {
    let count = charting.charts.len();
    if count <= limit {
        return Labels { of: (1..=count as u16).collect(), count, crowded: 0 };
    }
    let seen = |c: usize| charting.charts[c].hits;
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&c| (std::cmp::Reverse(seen(c)), c));
    let alone = ALONE.min(limit / 2);
    // The charts that share, by how much is seen of them.
    let sharing = &order[alone..];
    let mut place = vec![None; count];
    sharing.iter().enumerate().for_each(|(at, &c)| place[c] = Some(at as u32));
    let meets = Meetings::find(hits, charting, &place, sharing.len());
    let mut of: Vec<u16> = vec![0; count];
    order[..alone].iter().zip(1..).for_each(|(&c, label)| of[c] = label);
    let (mut most, mut crowded) = (alone, 0);
    // By label, what is seen of the charts that have it and meet the next one.
    let mut near = vec![0u64; limit - alone];
    for (at, &c) in sharing.iter().enumerate() {
        near.fill(0);
        for other in meets.of(at).take_while(|&other| other < at).map(|other| sharing[other]) {
            near[usize::from(of[other]) - alone - 1] += 1 + seen(other);
        }
        let (least, label) = near.iter().zip(alone..).map(|(&near, label)| (near, label + 1)).min().unwrap_or_default();
        of[c] = label as u16;
        (most, crowded) = (most.max(label), crowded + usize::from(least > 0));
    }
    Labels { of, count: most, crowded }
}

/// Which charts are seen near each other: a bit for each two.
struct Meetings {
    words: usize,
    bits: Vec<u64>,
}

impl Meetings {
    /// Those of `count` charts, which have such a `place` each.
    fn find(hits: &Hits, charting: &Charting, place: &[Option<u32>], count: usize) -> Self {
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
                    if let Some(place) = place[chart as usize] {
                        let (x, y) = (i % width, i % frame_size / width);
                        seen[y / BLOCK * across + x / BLOCK].insert(place);
                    }
                }
                seen
            })
            .collect();
        let words = count.div_ceil(64);
        let mut bits = vec![0u64; words * count];
        for (t, now) in blocks.iter().enumerate() {
            for (i, set) in now.iter().enumerate() {
                let (bx, by) = (i % across, i / across);
                let columns = bx.saturating_sub(1)..=(bx + 1).min(across - 1);
                let near = (by.saturating_sub(1)..=(by + 1).min(down - 1)).flat_map(|y| columns.clone().map(move |x| y * across + x));
                let near: BTreeSet<u32> =
                    near.flat_map(|j| blocks[t..(t + 2).min(blocks.len())].iter().flat_map(move |b| &b[j])).copied().collect();
                for &a in set {
                    for [a, b] in near.iter().filter(|&&b| b != a).flat_map(|&b| [[a, b], [b, a]]) {
                        bits[a as usize * words + b as usize / 64] |= 1 << (b % 64);
                    }
                }
            }
        }
        Self { words, bits }
    }

    /// The charts that a chart meets, in ascending order.
    fn of(&self, chart: usize) -> impl Iterator<Item = usize> {
        let words = &self.bits[chart * self.words..][..self.words];
        (0..self.words * 64).filter(|other| words[other / 64] >> (other % 64) & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{Density, Family, build};
    use crate::scene::builtin;
    use crate::trace::Tracer;

    #[test]
    fn charts_share_labels_and_meet_only_for_want_of_others() {
        let mut scene = builtin::build("street").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (96, 72, 17);
        let hits = Hits::cast(&scene, &Tracer::new(&scene), &|_, _| {});
        let density = Density { most: 1.0, detail: f64::INFINITY, texel: 1.0 };
        let charting = build(&scene, &hits, Family::Planes, &density, 512);
        let charts = charting.charts.len();
        assert!(charts > 20, "{charts} charts belong to the test");
        let crowded: Vec<usize> = [2, 8, charts - 1, charts]
            .into_iter()
            .map(|limit| {
                let Labels { of, count, crowded } = assign(&hits, &charting, limit);
                assert!(count <= limit && of.len() == charts && of.iter().all(|&label| (1..=count as u16).contains(&label)));
                // Those seen most have theirs alone.
                let mut order: Vec<usize> = (0..charts).collect();
                order.sort_by_key(|&c| (std::cmp::Reverse(charting.charts[c].hits), c));
                let alone = order[..ALONE.min(limit / 2)].iter().all(|&c| of.iter().filter(|&&label| label == of[c]).count() == 1);
                assert!(alone, "{limit}: {of:?}");
                crowded
            })
            .collect();
        assert!(crowded[0] > crowded[1] && crowded[1] > 0 && crowded[3] == 0, "{crowded:?}");
    }
}
