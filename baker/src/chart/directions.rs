//! Directions: along which a chart may be projected so that its faces are seen straight on, and what each costs them.
//! Faces come from `observe`; `family` hands directions and costs on to `merge`.

use super::observe::Face;
use glam::DVec3;

/// Directions taken from the seen normals.
const MEANS: usize = 28;
/// Rounds in which they are improved.
const ROUNDS: usize = 8;
/// Directions closer than this, as a cosine, are one: 10 degrees.
const SAME: f64 = 0.985;
/// What a pixel costs whose face is shown an octave too coarse; the cost grows with the square of octaves.
pub(super) const OCTAVE: f64 = 0.004;
/// Octaves that a face loses for each octave that its projection is narrower: half of it in density, half of it in shape.
const LOSS: f64 = 0.75;
/// The least cosine at which a projection shows a face.
const GRAZING: f64 = 0.2;
/// What a pixel costs that is not shown.
pub(super) const HIDDEN: f64 = 0.05;

/// What a pixel costs whose face is projected at an angle of cosine `cosine`.
pub(super) fn cost(cosine: f64) -> f64 {
    if cosine < GRAZING {
        return HIDDEN + 2.0 * HIDDEN * (GRAZING - cosine);
    }
    let octaves = LOSS * libm::log2(1.0 / cosine);
    OCTAVE * octaves * octaves
}

/// The directions to choose from: 26 even ones, those among them replaced that the seen normals come close to.
pub(super) fn candidates(faces: &[Face]) -> Vec<DVec3> {
    let means = means(faces, |f| f.normal);
    let steps = || [-1.0, 0.0, 1.0].into_iter();
    let even = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z))));
    let mut out: Vec<DVec3> = even.filter_map(DVec3::try_normalize).filter(|d| means.iter().all(|m| m.dot(*d) < SAME)).collect();
    for mean in means {
        if out.iter().all(|d| d.dot(mean) < 0.9995) {
            out.push(mean);
        }
    }
    out
}

/// The unit vectors that stand for those of all faces: far from each other first, then moved to the middle of those nearest to them.
pub(super) fn means(faces: &[Face], of: impl Fn(&Face) -> DVec3) -> Vec<DVec3> {
    let weighted: Vec<(DVec3, f64)> = faces.iter().filter(|f| f.normal != DVec3::ZERO).map(|f| (of(f), f64::from(f.hits))).collect();
    let mut means: Vec<DVec3> = Vec::new();
    let mut near = vec![-2.0f64; weighted.len()];
    for _ in 0..MEANS {
        let need = |i: usize| weighted[i].1 * (1.0 - near[i]) * (1.0 - near[i]);
        let Some(most) = (0..weighted.len()).max_by(|&a, &b| need(a).total_cmp(&need(b)).then(b.cmp(&a))) else { break };
        if near[most] > 0.9999 {
            break;
        }
        let mean = weighted[most].0;
        means.push(mean);
        near.iter_mut().zip(&weighted).for_each(|(near, (n, _))| *near = near.max(n.dot(mean)));
    }
    for _ in 0..ROUNDS {
        let mut sums = vec![DVec3::ZERO; means.len()];
        for (normal, weight) in &weighted {
            let best = (0..means.len()).fold(0, |best, i| if means[i].dot(*normal) > means[best].dot(*normal) { i } else { best });
            sums[best] += *normal * *weight;
        }
        for (mean, sum) in means.iter_mut().zip(sums) {
            *mean = sum.try_normalize().unwrap_or(*mean);
        }
    }
    means
}
