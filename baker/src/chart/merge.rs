//! Merging: faces join where the seam that goes saves more than a common projection costs.
//! Faces and links come from `observe`, costs from `family`; clusters go to `absorb`, then to be measured.

use super::clusters::{Border, Clusters, Weights};
use super::family::Family;
use super::flat::Flat;
use super::observe::{Faces, Links};
use super::refine;
use super::view::View;
use crate::joins::root;
use crate::scene::Scene;
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// A cluster while it grows.
#[derive(Clone)]
struct Cluster {
    /// Pixels that see it.
    hits: f64,
    /// Its plane, while it is flat.
    flat: Option<Flat>,
    /// What each view costs.
    costs: Vec<f64>,
    /// Its neighbours.
    near: BTreeMap<u32, Border>,
}

impl Cluster {
    fn price(&self, bent: f64) -> f64 {
        self.costs.iter().copied().fold(f64::INFINITY, f64::min) + if self.flat.is_some() { 0.0 } else { bent * self.hits }
    }
}

/// A heap's entry: the bits of a positive gain, which order like it, then the pair.
type Entry = (u64, Reverse<u32>, Reverse<u32>);

/// What merging starts from.
pub(super) struct Merging<'a> {
    faces: &'a Faces,
    links: &'a Links,
    family: Family,
    views: Vec<View>,
    /// The group of each face.
    of: Vec<u32>,
    groups: Vec<Cluster>,
}

impl<'a> Merging<'a> {
    /// Groups of faces, and what each view costs them.
    pub fn new(scene: &Scene, faces: &'a Faces, links: &'a Links, family: Family) -> Self {
        let views = family.views(scene, &faces.list);
        let (of, count) = refine::group(faces, links);
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
        of.iter().enumerate().for_each(|(f, &g)| members[g as usize].push(f as u32));
        let costs = family.costs(&faces.list, &members, &views);
        let flat = |f: &u32| Flat::new(&faces.list[*f as usize]);
        let cluster = |(members, costs): (&Vec<u32>, Vec<f64>)| Cluster {
            hits: members.iter().map(|&f| f64::from(faces.list[f as usize].hits)).sum(),
            flat: members.iter().skip(1).fold(members.first().map(flat), |all, f| all?.with(&flat(f))),
            costs,
            near: BTreeMap::new(),
        };
        let mut groups: Vec<Cluster> = members.iter().zip(costs).map(cluster).collect();
        for (f, &g) in (0..).zip(&of) {
            for &(other, pairs) in links.of(f) {
                let h = of[other as usize];
                if h != g {
                    groups[g as usize].near.entry(h).or_default().add(Border::between(faces, f, other, pairs));
                }
            }
        }
        Self { faces, links, family, views, of, groups }
    }

    /// Merges the groups.
    pub fn merge(&self, weights: Weights) -> Clusters {
        let price = self.groups.iter().map(|c| c.price(weights.bent)).collect();
        let mut joining = Joining { weights, price, clusters: self.groups.clone() };
        let mut parent: Vec<u32> = (0..self.groups.len() as u32).collect();
        let mut heap: BinaryHeap<Entry> = BinaryHeap::new();
        for (a, group) in (0..).zip(&self.groups) {
            heap.extend(group.near.range(a + 1..).filter_map(|(&b, _)| joining.entry(a, b)));
        }
        while let Some((bits, Reverse(a), Reverse(b))) = heap.pop() {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            if a == b {
                continue;
            }
            // Either may have grown since: the pair then waits for its turn.
            if joining.gain(a, b) < f64::from_bits(bits) * 0.999 {
                heap.extend(joining.entry(a, b));
                continue;
            }
            let more = |c: u32| joining.clusters[c as usize].near.len();
            let (a, b) = if more(a) >= more(b) { (a, b) } else { (b, a) };
            parent[b as usize] = a;
            for c in joining.join(a, b) {
                heap.extend(joining.entry(a, c));
            }
        }
        let of: Vec<u32> = self.of.iter().map(|&g| root(&mut parent, g)).collect();
        let sides = joining.clusters.iter().map(|cluster| {
            let cheapest = |best: usize, d: usize| if cluster.costs[d] < cluster.costs[best] { d } else { best };
            // What has been joined to another has no costs left.
            let view = (0..cluster.costs.len()).reduce(cheapest).map_or(View::along(DVec3::Y), |d| self.views[d]);
            refine::Side { view, hits: cluster.hits, flat: cluster.flat }
        });
        refine::refine(self.faces, self.links, (self.family, weights), of, sides.collect())
    }
}

/// Clusters that are being joined.
struct Joining {
    weights: Weights,
    clusters: Vec<Cluster>,
    /// What each cluster costs.
    price: Vec<f64>,
}

impl Joining {
    /// What joining two neighbours saves.
    fn gain(&self, a: u32, b: u32) -> f64 {
        let (i, j) = (a as usize, b as usize);
        let (one, other) = (&self.clusters[i], &self.clusters[j]);
        let level = one.flat.zip(other.flat).is_some_and(|(x, y)| x.with(&y).is_some());
        let together = one.costs.iter().zip(&other.costs).map(|(x, y)| x + y).fold(f64::INFINITY, f64::min);
        let bend = if level { 0.0 } else { self.weights.bent * (one.hits + other.hits) };
        let seam = one.near.get(&b).map_or(0.0, |border| border.saved(one.hits.min(other.hits), self.weights.wide));
        seam - (together + bend - self.price[i] - self.price[j])
    }

    fn entry(&self, a: u32, b: u32) -> Option<Entry> {
        let gain = self.gain(a, b);
        (gain > 0.0).then(|| (gain.to_bits(), Reverse(a.min(b)), Reverse(a.max(b))))
    }

    /// Joins the second to the first; returns the neighbours it brings.
    fn join(&mut self, a: u32, b: u32) -> Vec<u32> {
        let (i, j) = (a as usize, b as usize);
        let taken = std::mem::take(&mut self.clusters[j].costs);
        let around = std::mem::take(&mut self.clusters[j].near);
        let (hits, flat) = (self.clusters[j].hits, self.clusters[j].flat);
        let one = &mut self.clusters[i];
        one.costs.iter_mut().zip(taken).for_each(|(x, y)| *x += y);
        one.hits += hits;
        one.flat = one.flat.zip(flat).and_then(|(x, y)| x.with(&y));
        one.near.remove(&b);
        self.price[i] = self.clusters[i].price(self.weights.bent);
        let mut brought = Vec::new();
        for (c, border) in around.into_iter().filter(|n| n.0 != a) {
            self.clusters[i].near.entry(c).or_default().add(border);
            let other = &mut self.clusters[c as usize].near;
            other.remove(&b);
            other.entry(a).or_default().add(border);
            brought.push(c);
        }
        brought
    }
}
