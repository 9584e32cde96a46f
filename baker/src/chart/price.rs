//! Prices: what the charts of a scene are likely to cost, told without coding them.
//! Charts come measured; the price decides between candidates.

use super::charting::{Charting, FLAT};
use super::observe::NONE;
use crate::gbuffer::{BACKGROUND, Hits};
use rayon::prelude::*;

/// Pixels of a side of a block, and frames.
const BLOCK: usize = 8;
/// A chart seen in fewer pixels of a block does not count.
const LEAST: u32 = 8;

/// Bytes that a chart takes in a block of its own and in a torn one: flat, then not flat. Fitted to bundles; positions on flat charts are
/// all but told by the camera.
const BYTES: [f64; 4] = [0.1, 2.0, 0.7, 5.0];

/// Bytes of keys that the charts are likely to take: those of blocks of 8 x 8 pixels and 8 frames, more where they are not flat and where they share the block.
pub(crate) fn price(hits: &Hits, charting: &Charting) -> f64 {
    let bent = bent(charting);
    let (width, height) = (hits.width as usize, hits.height as usize);
    let (across, frame_size) = (width.div_ceil(BLOCK), (width * height).max(1));
    // Charts in whole and in torn blocks, flat and not.
    let parts: Vec<[u64; 4]> = hits
        .samples
        .par_chunks(frame_size * BLOCK)
        .map(|samples| {
            let mut blocks: Vec<Vec<(u32, u32)>> = vec![Vec::new(); across * height.div_ceil(BLOCK)];
            for (i, s) in samples.iter().enumerate() {
                let seen = s.surface != BACKGROUND;
                let chart = if seen { charting.chart_of[charting.faces.of[s.surface as usize] as usize] } else { NONE };
                let (x, y) = (i % width, i % frame_size / width);
                let block = &mut blocks[y / BLOCK * across + x / BLOCK];
                match block.iter_mut().find(|c| c.0 == chart) {
                    Some(c) => c.1 += 1,
                    None => block.push((chart, 1)),
                }
            }
            let mut counts = [0; 4];
            for block in &mut blocks {
                block.retain(|c| c.1 >= LEAST);
                let torn = 2 * usize::from(block.len() > 1);
                block.iter().for_each(|c| counts[torn + usize::from(c.0 != NONE && bent[c.0 as usize])] += 1);
            }
            counts
        })
        .collect();
    let sum = parts.iter().fold([0; 4], |sum, part| [0, 1, 2, 3].map(|k| sum[k] + part[k]));
    sum.iter().zip(BYTES).map(|(&n, w)| n as f64 * w).sum()
}

/// Which charts are not flat.
fn bent(charting: &Charting) -> Vec<bool> {
    charting.deep().iter().zip(&charting.charts).map(|(deep, chart)| deep * chart.density > FLAT).collect()
}
