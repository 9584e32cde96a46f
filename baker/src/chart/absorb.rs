//! Absorption: small clusters join a neighbour whose plane still shows them.
//! Clusters come from `merge`; fewer of them go on to be measured.

use super::clusters::Clusters;
use super::observe::{Faces, Links, NONE};
use crate::joins::root;
use std::collections::BTreeMap;

/// A cluster seen by fewer pixels than this in 9.8 million (128 frames of 320x240) joins another.
const SMALL: f64 = 600.0 / 9.8e6;
/// The least cosine between such a cluster's faces and the plane it joins.
const GRAZING: f64 = 0.2;
/// The share of a cluster's hits that has to fit the plane it joins.
const FITTING: f64 = 0.9;

/// Joins clusters, smallest first, and renumbers what is left; `samples` is the number of pixels of all frames.
pub(crate) fn absorb(faces: &Faces, links: &Links, clusters: &mut Clusters, samples: usize) {
    let count = clusters.views.len();
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
    let mut hits = vec![0u64; count];
    for (f, &c) in clusters.of.iter().enumerate() {
        members[c as usize].push(f as u32);
        hits[c as usize] += u64::from(faces.list[f].hits);
    }
    let mut parent: Vec<u32> = (0..count as u32).collect();
    let limit = (SMALL * samples as f64).max(8.0) as u64;
    let mut order: Vec<u32> = (0..count as u32).filter(|&c| hits[c as usize] < limit).collect();
    order.sort_by_key(|&c| (hits[c as usize], c));
    for c in order {
        if hits[c as usize] >= limit {
            continue;
        }
        let mut around: BTreeMap<u32, u64> = BTreeMap::new();
        for &f in &members[c as usize] {
            for &(g, weight) in links.of(f) {
                let other = root(&mut parent, clusters.of[g as usize]);
                if other != c {
                    *around.entry(other).or_default() += u64::from(weight);
                }
            }
        }
        let fitting = |plane: u32| {
            let view = clusters.views[plane as usize];
            let fits = |f: &&u32| view.cosine(&faces.list[**f as usize]).is_some_and(|c| c > GRAZING);
            let fit: u64 = members[c as usize].iter().filter(fits).map(|&f| u64::from(faces.list[f as usize].hits)).sum();
            fit as f64 >= FITTING * hits[c as usize] as f64
        };
        // Into the neighbour with the longest seam.
        let mut candidates: Vec<(u64, u32)> = around.into_iter().map(|(c, w)| (w, c)).collect();
        candidates.sort_by_key(|&(w, c)| (std::cmp::Reverse(w), c));
        let target = candidates.into_iter().map(|(_, c)| c).find(|&t| hits[t as usize] >= hits[c as usize] && fitting(t));
        if let Some(t) = target {
            parent[c as usize] = t;
            hits[t as usize] += hits[c as usize];
            let moved = std::mem::take(&mut members[c as usize]);
            members[t as usize].extend(moved);
        }
    }
    let mut number = vec![NONE; count];
    let mut views = Vec::new();
    for of in &mut clusters.of {
        let r = root(&mut parent, *of) as usize;
        if number[r] == NONE {
            number[r] = views.len() as u32;
            views.push(clusters.views[r]);
        }
        *of = number[r];
    }
    clusters.views = views;
}
