//! Lines of sight: views like those of the camera, so that what playback interpolates in the source image goes much as it goes on the screen.
//! Faces come from `observe`; `family` hands views and costs on to `merge`.

use super::directions::{self, HIDDEN, OCTAVE};
use super::observe::Face;
use super::view::View;
use crate::gbuffer::Lens;
use crate::scene::Scene;
use crate::truth::spread;
use glam::{DMat3, DVec3};

/// Frames whose cameras are views.
const ANCHORS: u32 = 13;
/// How much farther back than where the lines of sight meet views from a point stand, in parts of that distance: a bird's eye.
const RETREATS: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 4.0];
/// The least cosine at which a view shows a face: the camera may see it no better.
const EDGE: f64 = 0.03;
/// What a pixel costs whose face is out of view: more than any seam saves.
const ABSENT: f64 = 10.0;

/// The views to choose from: along the seen normals and the lines of sight, from cameras of the path, from where the lines of sight meet.
pub(super) fn views(scene: &Scene, faces: &[Face]) -> Vec<View> {
    let along = directions::candidates(faces).into_iter().chain(directions::means(faces, |f| f.view)).map(View::along);
    let anchors = spread(scene.playback.frames, ANCHORS).into_iter().map(|f| Lens::new(scene, f));
    along.chain(anchors.map(|lens| View { back: -lens.forward, eye: Some(lens.eye) })).chain(meetings(faces)).collect()
}

/// Views from the point that the lines of sight pass closest by, and from farther back.
fn meetings(faces: &[Face]) -> Vec<View> {
    let (mut lines, mut sum, mut mean, mut middle, mut hits) = (DMat3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
    for face in faces {
        let (weight, sight, point) = (f64::from(face.hits), face.view, face.middle());
        let across = (DMat3::IDENTITY - DMat3::from_cols(sight * sight.x, sight * sight.y, sight * sight.z)) * weight;
        lines += across;
        sum += across * point;
        (mean, middle, hits) = (mean + sight * weight, middle + point * weight, hits + weight);
    }
    let middle = middle / f64::max(hits, 1.0);
    // Parallel lines meet nowhere.
    if lines.determinant().abs() < 1e-9 * hits * hits * hits {
        return Vec::new();
    }
    let eye = lines.inverse() * sum;
    let (Some(mean), Some(back)) = (mean.try_normalize(), (eye - middle).try_normalize()) else { return Vec::new() };
    // Around an object the lines meet inside it.
    if back.dot(mean) < 0.5 {
        return Vec::new();
    }
    RETREATS.map(|t| View { back, eye: Some(eye + (eye - middle) * t) }).to_vec()
}

/// What a pixel of `face` costs in `view`: how much the picture is stretched or squeezed on its way from the screen to the chart, octaves
/// squared. A step on the screen is a step on the face, which is a step in the chart; from the mean of where the face is seen from.
pub(super) fn cost(face: &Face, view: &View) -> f64 {
    let Some(cosine) = view.cosine(face) else { return ABSENT };
    if cosine < EDGE {
        return HIDDEN + 2.0 * HIDDEN * (EDGE - cosine);
    }
    let (towards, slant) = (view.towards(face.middle()), face.normal.dot(face.view).max(0.05));
    let (across, down) = face.view.any_orthonormal_pair();
    let step = |screen: DVec3| {
        let on_face = screen - face.view * (screen.dot(face.normal) / slant);
        on_face - towards * on_face.dot(towards)
    };
    let (p, q) = (step(across), step(down));
    // Squared singular values of the map from the screen to the chart.
    let (half, area) = (0.5 * (p.dot(p) + q.dot(q)), p.cross(q).length_squared());
    let root = (half * half - area).max(0.0).sqrt();
    let octaves = [half + root, half - root].map(|squared| 0.5 * libm::log2(squared.max(1e-4)));
    OCTAVE * (octaves[0] * octaves[0] + octaves[1] * octaves[1])
}
