//! Growing of charts: connected faces that face about the same way.
//! Faces and links come from `observe`; clusters go to `absorb`.

use super::NONE;
use super::observe::{Faces, Links};
use glam::DVec3;

/// How far, as a cosine, normals may stray from the seed's while its surroundings are explored: 35 degrees.
const EXPLORE: f64 = 0.819;
/// How far, as a cosine, normals may stray from the plane of their cluster: 45 degrees.
const STRAY: f64 = 0.707;

/// A partition of the seen faces.
pub(crate) struct Clusters {
    /// The cluster of each face.
    pub of: Vec<u32>,
    /// The unit normal of each cluster's plane, towards the viewer.
    pub normals: Vec<DVec3>,
}

/// Grows clusters, from the face seen most.
pub(crate) fn grow(faces: &Faces, links: &Links) -> Clusters {
    let mut order: Vec<u32> = (0..faces.list.len() as u32).collect();
    order.sort_by_key(|&f| (std::cmp::Reverse(faces.list[f as usize].hits), f));
    let mut out = Clusters { of: vec![NONE; faces.list.len()], normals: Vec::new() };
    // The seed whose exploration last visited a face.
    let mut visited = vec![NONE; faces.list.len()];
    let mut queue: Vec<u32> = Vec::new();
    for &seed in &order {
        if out.of[seed as usize] != NONE {
            continue;
        }
        let normal = faces.list[seed as usize].normal;
        let (mut sum, mut head) = (DVec3::ZERO, 0);
        queue.clear();
        queue.push(seed);
        visited[seed as usize] = seed;
        while let Some(&f) = queue.get(head) {
            head += 1;
            let face = &faces.list[f as usize];
            sum += face.normal * f64::from(face.hits);
            for &(g, _) in links.of(f) {
                let free = out.of[g as usize] == NONE && visited[g as usize] != seed;
                if free && faces.list[g as usize].normal.dot(normal) > EXPLORE {
                    visited[g as usize] = seed;
                    queue.push(g);
                }
            }
        }
        // A degenerate seed has no normal: any plane will do.
        let plane = sum.try_normalize().filter(|m| m.dot(normal) > STRAY).unwrap_or(normal);
        let plane = if plane == DVec3::ZERO { DVec3::Y } else { plane };
        let id = out.normals.len() as u32;
        out.normals.push(plane);
        queue.clear();
        queue.push(seed);
        out.of[seed as usize] = id;
        while let Some(f) = queue.pop() {
            for &(g, _) in links.of(f) {
                if out.of[g as usize] == NONE && faces.list[g as usize].normal.dot(plane) > STRAY {
                    out.of[g as usize] = id;
                    queue.push(g);
                }
            }
        }
    }
    out
}
