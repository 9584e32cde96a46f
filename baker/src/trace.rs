//! Ray casting: the closest triangle along a ray, in double precision, without leaks between neighbours.
//! Triangles come from a [`Scene`]; hits go to the G-buffer. The only file that names obvhs.

use crate::scene::Scene;
use crate::shade::is_hole;
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// How far outside a triangle, in barycentric units, a ray still counts as inside it: neighbours overlap by this much.
const OVERLAP: f64 = 1e-9;
/// Distances that differ by less than this share are the same distance.
const SAME: f64 = 1e-12;

/// The closest surface point along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the origin in lengths of the ray's direction.
    pub t: f64,
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// Barycentric weights of the second and the third corner; each in 0..=1, their sum at most 1 up to rounding.
    pub bary: [f64; 2],
    /// Whether the ray meets the clockwise side.
    pub back: bool,
}

/// A triangle in the order of the hierarchy's leaves, relative to the scene's centre.
struct Leaf {
    corner: DVec3,
    edge: [DVec3; 2],
    triangle: u32,
    masked: bool,
    /// Rays pass through from behind.
    front: bool,
}

impl Leaf {
    /// Moeller-Trumbore; returns (t, b, c, whether the ray meets the back).
    #[inline(always)]
    fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64, f64, bool)> {
        let [e1, e2] = self.edge;
        let p = direction.cross(e2);
        let det = e1.dot(p);
        if det == 0.0 {
            return None;
        }
        let s = origin - self.corner;
        // Most candidates end here or below: no division until the triangle is all but hit.
        let (size, scaled_b) = (det.abs(), s.dot(p) * det.signum());
        if !(scaled_b >= -1e-4 * size && scaled_b <= 1.0001 * size) {
            return None;
        }
        let q = s.cross(e1);
        let scaled_c = direction.dot(q) * det.signum();
        if !(scaled_c >= -1e-4 * size && scaled_b + scaled_c <= 1.0002 * size) {
            return None;
        }
        let inverse = 1.0 / det;
        let (b, c) = (s.dot(p) * inverse, direction.dot(q) * inverse);
        let outside = -b.min(c).min(1.0 - b - c);
        if outside > OVERLAP {
            // The weights of far, small or grazing triangles are rounded by more than the overlap.
            let rounding = 1e-15 * s.length() * direction.length() * (e1.length() + e2.length()) * inverse.abs();
            if outside > 1e-4 || outside > rounding {
                return None;
            }
        }
        let t = e2.dot(q) * inverse;
        // Seen against the normal e1 x e2 the determinant is positive.
        (t > 0.0).then_some((t, b, c, det < 0.0))
    }
}

/// A scene made ready for ray casting.
pub struct Tracer<'a> {
    scene: &'a Scene,
    /// None: the scene has no triangles.
    hierarchy: Option<Arc<Hierarchy>>,
    /// Seconds that building it took: none where it is another tracer's.
    pub(crate) seconds: f64,
}

/// The triangles of a scene, and boxes around them.
struct Hierarchy {
    boxes: Bvh2,
    leaves: Vec<Leaf>,
    /// Single-precision boxes lose the least near the origin, so everything is moved there.
    centre: DVec3,
}

/// A box as obvhs wants it.
struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// The centre of the triangles and the reach of everything that happens: the farthest corner or eye from it.
fn extent(scene: &Scene) -> (DVec3, f64) {
    let (lo, hi) =
        scene.triangles.iter().flat_map(|t| t.position).fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let centre = (lo + hi) * 0.5;
    let eyes = (0..scene.playback.frames).map(|f| scene.camera.pose(scene.playback.parameter(f64::from(f))).eye.distance(centre));
    (centre, eyes.fold((hi - lo).length() * 0.5, f64::max))
}

/// Builds a hierarchy whatever the triangles are like. The wide hierarchy of obvhs has a fixed stack, which scenes of
/// very unequal triangles overflow; the binary one can be told how deep it is.
fn build<T: Boundable>(boxes: &[T]) -> Bvh2 {
    let p = BvhBuildParams::medium_build();
    let order = (0..boxes.len() as u32).collect();
    let distance: PlocSearchDistance = p.ploc_search_distance;
    let precision: SortPrecision = p.sort_precision;
    let mut hierarchy = PlocBuilder::with_capacity(boxes.len()).build(distance, boxes, order, precision, p.search_depth_threshold);
    ReinsertionOptimizer::default().run(&mut hierarchy, p.reinsertion_batch_ratio, None);
    collapse(&mut hierarchy, p.max_prims_per_leaf, p.collapse_traversal_cost);
    let again = p.reinsertion_batch_ratio * p.post_collapse_reinsertion_batch_ratio_multiplier;
    ReinsertionOptimizer::default().run(&mut hierarchy, again, None);
    let (mut deepest, mut stack) = (0, vec![(0, 1)]);
    while let Some((i, depth)) = stack.pop() {
        deepest = deepest.max(depth);
        if let Some(node) = hierarchy.nodes.get(i).filter(|n| !n.is_leaf()) {
            stack.extend([0, 1].map(|child| (node.first_index as usize + child, depth + 1)));
        }
    }
    hierarchy.max_depth = deepest + 1;
    hierarchy
}

impl<'a> Tracer<'a> {
    /// Builds the hierarchy; a scene without triangles is fine.
    pub fn new(scene: &'a Scene) -> Self {
        let start = Instant::now();
        if scene.triangles.is_empty() {
            return Self { scene, hierarchy: None, seconds: 0.0 };
        }
        let (centre, reach) = extent(scene);
        let boxes: Vec<Padded> = scene
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.position.map(|p| p - centre);
                let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
                // The box test rounds to single precision: about 3e-7 of the distance between ray and box.
                let pad = 1e-4 * (hi - lo).max_element() + 2e-6 * reach;
                Padded(Aabb::new((lo - pad).as_vec3a(), (hi + pad).as_vec3a()))
            })
            .collect();
        let boxes = build(&boxes);
        let leaves = boxes
            .primitive_indices
            .iter()
            .map(|&triangle| {
                let t = &scene.triangles[triangle as usize];
                let [a, b, c] = t.position.map(|p| p - centre);
                let material = scene.materials.get(t.material as usize);
                let (masked, front) = (material.is_some_and(|m| m.alpha_cutoff.is_some()), material.is_some_and(|m| m.front));
                Leaf { corner: a, edge: [b - a, c - a], triangle, masked, front }
            })
            .collect();
        Self { scene, hierarchy: Some(Arc::new(Hierarchy { boxes, leaves, centre })), seconds: start.elapsed().as_secs_f64() }
    }

    /// The same for `scene`, which differs in what its screen and its frames are alone: a hierarchy takes a while to build.
    pub fn of<'b>(&self, scene: &'b Scene) -> Tracer<'b> {
        Tracer { scene, hierarchy: self.hierarchy.clone(), seconds: 0.0 }
    }

    /// The scene.
    pub const fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The box around all triangles, world space: smallest and largest corner. Without triangles it is inside out.
    pub fn bounds(&self) -> [DVec3; 2] {
        let corners = |l: &Leaf| [l.corner, l.corner + l.edge[0], l.corner + l.edge[1]];
        let (leaves, centre) = self.hierarchy.as_ref().map_or((&[][..], DVec3::ZERO), |all| (&all.leaves, all.centre));
        let (lo, hi) = leaves.iter().flat_map(corners).fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
        [lo + centre, hi + centre]
    }

    /// The closest hit in front of `origin`; of several at the same distance the one of the lowest triangle.
    /// Texels that a material's alpha cuts out are passed through, and backs of what has a front alone.
    #[inline]
    pub fn hit(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let Hierarchy { boxes, leaves, centre } = self.hierarchy.as_deref()?;
        let origin = origin - centre;
        let ray = Ray::new(origin.as_vec3a(), direction.as_vec3a(), 0.0, f32::INFINITY);
        let mut best: Option<Hit> = None;
        // A RayHit carries its bound along: a fresh one for each ray.
        boxes.ray_traverse(ray, &mut RayHit::none(), |_, i| self.closer(&leaves[i], origin, direction, &mut best).unwrap_or(f32::INFINITY));
        best
    }

    /// The same of rays from one `origin` whose `directions` differ little: a box is fetched once for all of them, and tested side by side.
    pub fn hits(&self, origin: DVec3, directions: &[DVec3; PACKET]) -> [Option<Hit>; PACKET] {
        let mut best = [None; PACKET];
        let Some(Hierarchy { boxes, leaves, centre }) = self.hierarchy.as_deref() else { return best };
        let origin = origin - centre;
        let mut packet = Packet::new(origin.as_vec3a(), directions);
        let (mut stack, mut next) = (Vec::with_capacity(boxes.max_depth), boxes.nodes.first());
        while let Some(node) = next {
            let first = node.first_index as usize;
            next = None;
            if node.is_leaf() {
                // Some may have hit something since.
                let (rays, _) = packet.meets(node.aabb());
                for leaf in &leaves[first..][..node.prim_count as usize] {
                    for ray in (0..PACKET).filter(|ray| rays & 1 << ray != 0) {
                        if let Some(farthest) = self.closer(leaf, origin, directions[ray], &mut best[ray]) {
                            packet.farthest[ray] = farthest;
                        }
                    }
                }
            } else {
                let children = [&boxes.nodes[first], &boxes.nodes[first + 1]];
                let [(left, near), (right, far)] = children.map(|child| packet.meets(child.aabb()));
                let [closer, other] = if near <= far { children } else { [children[1], children[0]] };
                if left != 0 && right != 0 {
                    stack.push((other, near.max(far)));
                }
                next = Some(closer).filter(|_| left != 0 || right != 0);
            }
            while next.is_none()
                && let Some((node, near)) = stack.pop()
            {
                next = Some(node).filter(|_| packet.farthest.iter().any(|&farthest| near <= farthest));
            }
        }
        best
    }

    /// Makes the hit of a ray with `leaf`, if any, the `best` one where it is closer: then the distance up to which boxes matter.
    #[inline(always)]
    fn closer(&self, leaf: &Leaf, origin: DVec3, direction: DVec3, best: &mut Option<Hit>) -> Option<f32> {
        let (t, b, c, back) = leaf.intersect(origin, direction)?;
        if back && leaf.front {
            return None;
        }
        if let Some(best) = best {
            let same = (t - best.t).abs() <= SAME * best.t;
            if if same { leaf.triangle >= best.triangle } else { t > best.t } {
                return None;
            }
        }
        let bary = [b.clamp(0.0, 1.0), c.clamp(0.0, 1.0)];
        if leaf.masked && is_hole(self.scene, leaf.triangle, bary) {
            return None;
        }
        *best = Some(Hit { t, triangle: leaf.triangle, bary, back });
        // Rounded up, so that boxes at the same distance are still visited.
        Some((t * 1.00001) as f32)
    }
}

/// Rays that are cast together.
pub const PACKET: usize = 16;
/// A direction's component counts as no smaller: a ray in a box's face has to stay in it.
const LEVEL: f32 = 1e-20;

/// Rays from one origin against boxes, a component after the other.
struct Packet {
    origin: [f32; 3],
    inverse: [[f32; PACKET]; 3],
    farthest: [f32; PACKET],
}

impl Packet {
    fn new(origin: Vec3A, directions: &[DVec3; PACKET]) -> Self {
        let inverse = |v: f64| 1.0 / (v.abs() as f32).max(LEVEL).copysign(v as f32);
        let inverse = [0, 1, 2].map(|axis| directions.map(|direction| inverse(direction[axis])));
        Self { origin: origin.to_array(), inverse, farthest: [f32::INFINITY; PACKET] }
    }

    /// Which of the rays come through the box before they have hit something, and how far the first of them goes to it.
    #[inline(always)]
    fn meets(&self, around: &Aabb) -> (u32, f32) {
        let [lo, hi] = [around.min, around.max].map(|corner| corner.to_array());
        // No `min` of two numbers: that asks about what is none, and is slower.
        let (less, more) = (|a: f32, b: f32| if a < b { a } else { b }, |a: f32, b: f32| if a > b { a } else { b });
        let (mut enter, mut leave) = ([0.0; PACKET], self.farthest);
        for axis in 0..3 {
            let [lo, hi] = [lo[axis] - self.origin[axis], hi[axis] - self.origin[axis]];
            for ((&inverse, enter), leave) in self.inverse[axis].iter().zip(&mut enter).zip(&mut leave) {
                let (a, b) = (lo * inverse, hi * inverse);
                (*enter, *leave) = (more(*enter, less(a, b)), less(*leave, more(a, b)));
            }
        }
        let mut rays = 0;
        let mut first = f32::INFINITY;
        for (ray, (&enter, &leave)) in enter.iter().zip(&leave).enumerate() {
            let meets = enter <= leave;
            rays |= u32::from(meets) << ray;
            first = less(first, if meets { enter } else { f32::INFINITY });
        }
        (rays, first)
    }
}

/// obvhs alone, with its own single-precision triangle test, and rays made beforehand: what ray casting is measured against.
pub(crate) struct Bare {
    boxes: Bvh2,
    triangles: Vec<obvhs::triangle::Triangle>,
    rays: Vec<Ray>,
    found: Vec<RayHit>,
}

impl Bare {
    /// The triangles of `scene`, and `rays` by their origins and directions; `None` where there are none of either.
    pub fn new(scene: &Scene, rays: impl Iterator<Item = (DVec3, DVec3)>) -> Option<Self> {
        if scene.triangles.is_empty() {
            return None;
        }
        let (centre, _) = extent(scene);
        let corners = scene.triangles.iter().map(|t| t.position.map(|p| (p - centre).as_vec3a()));
        let triangles: Vec<obvhs::triangle::Triangle> = corners.map(|[v0, v1, v2]| obvhs::triangle::Triangle { v0, v1, v2 }).collect();
        let rays: Vec<Ray> = rays.map(|(origin, direction)| Ray::new_inf((origin - centre).as_vec3a(), direction.as_vec3a())).collect();
        if rays.is_empty() {
            return None;
        }
        let boxes = build(&triangles);
        let triangles = boxes.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        let found = vec![RayHit::none(); rays.len()];
        Some(Self { boxes, triangles, rays, found })
    }

    /// Casts them all, so many side by side on one thread.
    pub fn cast(&mut self, run: usize) {
        let Self { boxes, triangles, rays, found } = self;
        found.par_chunks_mut(run).zip(rays.par_chunks(run)).for_each(|(found, rays)| {
            for (found, ray) in found.iter_mut().zip(rays) {
                *found = RayHit::none();
                boxes.ray_traverse(*ray, found, |ray, i| triangles[i].intersect(ray));
            }
        });
    }
}

#[cfg(test)]
#[path = "trace_tests.rs"]
mod tests;
