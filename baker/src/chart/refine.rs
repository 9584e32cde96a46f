//! Refinement: the groups that merging starts from, and the faces that change sides after it.
//! Faces and links come from `observe`; `merge` calls both.

use super::clusters::{Border, Clusters, Weights};
use super::family::Family;
use super::flat::Flat;
use super::observe::{Faces, Links, NONE};
use super::view::View;
use glam::DVec3;
use std::cmp::Reverse;

/// Faces beyond this many are grouped before they are merged.
const MANY: usize = 10_000;
/// How far, as a cosine, normals of a group may stray from its first: 8, 12, 18 and 25 degrees.
const GROUPS: [f64; 4] = [0.990, 0.978, 0.951, 0.906];
/// Where faces are many, rounds end when fewer than one in so many changes sides.
const SETTLED: usize = 200;
/// Rounds in which faces may change sides.
const ROUNDS: usize = 6;

/// Groups of connected faces with much the same normal, from the face seen most: (the group of each face, the number of groups).
pub(super) fn group(faces: &Faces, links: &Links) -> (Vec<u32>, usize) {
    let count = faces.list.len();
    let mut found = ((0..count as u32).collect(), count);
    let mut order: Vec<u32> = (0..count as u32).collect();
    order.sort_by_key(|&f| (Reverse(faces.list[f as usize].hits), f));
    for cosine in GROUPS {
        if found.1 <= MANY {
            break;
        }
        let mut of = vec![NONE; count];
        let (mut groups, mut stack) = (0, Vec::new());
        for &seed in &order {
            if of[seed as usize] != NONE {
                continue;
            }
            let normal = faces.list[seed as usize].normal;
            of[seed as usize] = groups;
            stack.push(seed);
            while let Some(f) = stack.pop() {
                for &(g, _) in links.of(f) {
                    if of[g as usize] == NONE && faces.list[g as usize].normal.dot(normal) > cosine {
                        of[g as usize] = groups;
                        stack.push(g);
                    }
                }
            }
            groups += 1;
        }
        found = (of, groups as usize);
    }
    found
}

/// A cluster whose faces may change sides.
pub(super) struct Side {
    /// How it is projected.
    pub view: View,
    /// Pixels that see it.
    pub hits: f64,
    /// Its plane, if it is flat.
    pub flat: Option<Flat>,
}

/// Turns every cluster's view to its faces, then lets faces change sides, until neither helps.
pub(super) fn refine(
    faces: &Faces,
    links: &Links,
    (family, weights): (Family, Weights),
    mut of: Vec<u32>,
    mut sides: Vec<Side>,
) -> Clusters {
    for _ in 0..ROUNDS {
        turn(faces, family, &of, &mut sides);
        let moved = exchange(faces, links, (family, weights), &mut of, &sides);
        if moved <= if of.len() > MANY { of.len() / SETTLED } else { 0 } {
            break;
        }
    }
    turn(faces, family, &of, &mut sides);
    components(links, &of, &sides)
}

/// Moves each face to the neighbouring cluster where it costs least; returns how many moved.
fn exchange(faces: &Faces, links: &Links, (family, weights): (Family, Weights), of: &mut [u32], sides: &[Side]) -> usize {
    let mut moved = 0;
    let mut around: Vec<(u32, Border)> = Vec::new();
    for f in 0..of.len() {
        around.clear();
        around.push((of[f], Border::default()));
        for &(g, pairs) in links.of(f as u32) {
            let (other, border) = (of[g as usize], Border::between(faces, f as u32, g, pairs));
            match around.iter_mut().find(|a| a.0 == other) {
                Some(a) => a.1.add(border),
                None => around.push((other, border)),
            }
        }
        if around.len() < 2 {
            continue;
        }
        let face = &faces.list[f];
        let (hits, flat) = (f64::from(face.hits), Flat::new(face));
        let price = |(c, border): &(u32, Border)| {
            let side = &sides[*c as usize];
            let bend = match &side.flat {
                Some(plane) if plane.with(&flat).is_some() => 0.0,
                // One face would bend all of it.
                Some(_) => weights.bent * side.hits,
                None => weights.bent * hits,
            };
            hits * family.cost(face, &side.view) + bend - border.saved(hits, weights.wide)
        };
        let stay = (of[f], price(&around[0]));
        let (to, _) = around.iter().map(|a| (a.0, price(a))).fold(stay, |least, a| if a.1 < least.1 - 1e-9 { a } else { least });
        moved += usize::from(to != of[f]);
        of[f] = to;
    }
    moved
}

/// Projects a cluster along its mean normal where that costs less.
fn turn(faces: &Faces, family: Family, of: &[u32], sides: &mut [Side]) {
    let mut sums = vec![DVec3::ZERO; sides.len()];
    for (face, &c) in faces.list.iter().zip(of) {
        sums[c as usize] += face.normal * f64::from(face.hits);
    }
    let mean: Vec<Option<DVec3>> = sums.into_iter().map(DVec3::try_normalize).collect();
    let mut gains = vec![0.0f64; sides.len()];
    for (face, &c) in faces.list.iter().zip(of) {
        if let Some(mean) = mean[c as usize] {
            let [old, new] = [sides[c as usize].view, View::along(mean)].map(|v| family.cost(face, &v));
            gains[c as usize] += f64::from(face.hits) * (old - new);
        }
    }
    for ((side, mean), gain) in sides.iter_mut().zip(mean).zip(gains) {
        side.view = mean.filter(|_| gain > 0.0 && side.view.eye.is_none()).map_or(side.view, View::along);
    }
}

/// The connected parts of the clusters, in the order of their first faces.
fn components(links: &Links, of: &[u32], sides: &[Side]) -> Clusters {
    let mut out = Clusters { of: vec![NONE; of.len()], views: Vec::new() };
    let mut stack = Vec::new();
    for seed in 0..of.len() as u32 {
        if out.of[seed as usize] != NONE {
            continue;
        }
        let id = out.views.len() as u32;
        out.views.push(sides[of[seed as usize] as usize].view);
        out.of[seed as usize] = id;
        stack.push(seed);
        while let Some(f) = stack.pop() {
            for &(g, _) in links.of(f) {
                if out.of[g as usize] == NONE && of[g as usize] == of[seed as usize] {
                    out.of[g as usize] = id;
                    stack.push(g);
                }
            }
        }
    }
    out
}
