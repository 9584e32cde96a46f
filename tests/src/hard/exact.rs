//! What a ray hits, told by trying every triangle: the reference that the baker's rays are held against.
//! Rays are those of a scene's camera; what disagrees goes to the tests as words.
//!
//! Another way than the tracer's, in double precision: on which sides of a triangle's edges a ray passes, by the volumes that it spans with
//! each, and where it meets the triangle's plane. Where a volume is less than `NEAR` of all three, or the ray runs along the plane, either
//! answer is right; everywhere else the distance has to agree to `APART` of itself over the sine of the angle between ray and plane.

use cubist_baker::gbuffer::Lens;
use cubist_baker::scene::Scene;
use cubist_baker::trace::Tracer;
use glam::DVec3;

/// Nearer to an edge than this share of the triangle, a ray may pass on either side.
const NEAR: f64 = 1e-7;
/// A sine of the angle between ray and plane below which the ray runs along the plane.
const ALONG: f64 = 1e-9;
/// How far distances may be apart, as a share of the distance, straight on.
const APART: f64 = 1e-9;

/// How a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meeting {
    /// Not at all.
    Not,
    /// At this distance, in lengths of the ray's direction, within this much.
    At(f64, f64),
    /// So near its edge, or so much along it, that either answer is right.
    Unsure,
}

/// How the ray from `eye` along `direction` meets the triangle `corners`.
#[must_use]
pub fn meet(corners: [DVec3; 3], eye: DVec3, direction: DVec3) -> Meeting {
    let [a, b, c] = corners.map(|corner| corner - eye);
    let normal = (b - a).cross(c - a);
    let reach = a.length().max(b.length()).max(c.length());
    // What rounding makes of the corners' distances from the eye, as an area beside the triangle's own.
    let rounding = 1e-15 * corners.iter().fold(eye.length(), |most, corner| most.max(corner.length()));
    if normal.length() <= 8.0 * rounding * (b - a).length().max((c - a).length()).max((c - b).length()) {
        return Meeting::Unsure;
    }
    let sine = normal.dot(direction) / (normal.length() * direction.length());
    let volumes = [direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b))];
    let size = volumes.iter().map(|volume| volume.abs()).sum::<f64>();
    let slack = NEAR * size + 1e-14 * direction.length() * reach * reach;
    if volumes.iter().any(|volume| *volume > slack) && volumes.iter().any(|volume| *volume < -slack) {
        return Meeting::Not;
    }
    if sine.abs() < ALONG || volumes.iter().any(|volume| volume.abs() <= slack) {
        return Meeting::Unsure;
    }
    let distance = normal.dot(a) / normal.dot(direction);
    let within = (APART * distance.abs() + 16.0 * rounding) / sine.abs();
    if distance.abs() <= within {
        Meeting::Unsure
    } else if distance < 0.0 {
        Meeting::Not
    } else {
        Meeting::At(distance, within)
    }
}

/// Says what is wrong with the tracer's answer for the ray through the middle of the pixel (`x`, `y`) of a frame; `None`: nothing.
#[must_use]
pub fn disagreement(scene: &Scene, tracer: &Tracer<'_>, lens: &Lens, [x, y]: [u32; 2]) -> Option<String> {
    let (eye, direction) = (lens.eye, lens.direction(f64::from(x) + 0.5, f64::from(y) + 0.5));
    let meetings = || scene.triangles.iter().map(|triangle| meet(triangle.position, eye, direction));
    let nearest =
        meetings().filter_map(|meeting| if let Meeting::At(distance, within) = meeting { Some((distance, within)) } else { None });
    let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0));
    let wrong = |what: String| Some(format!("pixel ({x}, {y}): {what}; every triangle tried: {nearest:?}"));
    match (tracer.hit(eye, direction), nearest) {
        (None, None) => None,
        (None, Some(_)) => wrong("nothing is hit".into()),
        (Some(hit), nearest) => {
            let own = meet(scene.triangles[hit.triangle as usize].position, eye, direction);
            let good = match (own, nearest) {
                (Meeting::Not, _) => false,
                // A triangle that may be hit must not be seen through what is surely nearer.
                (Meeting::Unsure, nearest) => nearest.is_none_or(|(distance, within)| hit.t <= distance + within),
                (Meeting::At(own, near), nearest) => {
                    let first = nearest.is_none_or(|(distance, within)| own <= distance + within + near);
                    first && (hit.t - own).abs() <= near
                }
            };
            if good { None } else { wrong(format!("{hit:?} is {own:?}")) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_met_missed_or_grazed() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let down = |x: f64, y: f64| meet(triangle, DVec3::new(x, y, 2.0), DVec3::NEG_Z);
        assert!(matches!(down(0.3, 0.3), Meeting::At(at, within) if (at - 2.0).abs() < within && within < 1e-8));
        assert_eq!([down(-0.1, 0.3), down(0.6, 0.6)], [Meeting::Not; 2]);
        assert_eq!([down(0.5, 0.5), down(0.0, 0.3)], [Meeting::Unsure; 2]);
        assert_eq!(meet(triangle, DVec3::new(0.3, 0.3, -1.0), DVec3::NEG_Z), Meeting::Not, "behind");
        assert_eq!(meet(triangle, DVec3::new(0.3, 0.3, 0.0), DVec3::NEG_Z), Meeting::Unsure, "on it");
        assert_eq!(meet(triangle, DVec3::new(-1.0, 0.3, 0.0), DVec3::X), Meeting::Unsure, "along it");
        assert_eq!(meet([DVec3::ZERO, DVec3::X, DVec3::X * 0.5], DVec3::Z, DVec3::NEG_Z), Meeting::Unsure, "no area");
    }
}
