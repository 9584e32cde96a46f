//! Polygons as triangles: fans where they are convex, else what the library of ears makes of them. Corners come from the loaders of OBJ and PLY.

use glam::DVec3;

/// The triangles of a polygon of these corners, by their places; as the polygon goes around.
pub(super) fn triangles(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let fan = || (2..corners.len()).map(|last| [0, last - 1, last]).collect();
    let flat = flattened(corners);
    // What has no area looks the same however it is cut.
    let Some(flat) = flat.filter(|flat| !convex(flat)) else { return fan() };
    let mut cut: Vec<usize> = Vec::new();
    earcut::Earcut::new().earcut(flat.iter().copied(), &[], &mut cut);
    let area = |[a, b, c]: [usize; 3]| cross(flat[a], flat[b], flat[c]);
    let mut triangles = cut.as_chunks::<3>().0.to_vec();
    if triangles.iter().map(|&triangle| area(triangle)).sum::<f64>() < 0.0 {
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    // A polygon that crosses itself may have no ears.
    if triangles.is_empty() { fan() } else { triangles }
}

/// The corners in the polygon's plane, where they go around to the left; `None` where it has no area, or is no more than a triangle.
fn flattened(corners: &[DVec3]) -> Option<Vec<[f64; 2]>> {
    let &[first, _, _, _, ..] = corners else { return None };
    // Far from the origin digits would be lost.
    let corners: Vec<[f64; 3]> = corners.iter().map(|corner| (*corner - first).to_array()).collect();
    let mut flat = Vec::new();
    earcut::utils3d::project3d_to_2d(&corners, corners.len(), &mut flat).then_some(flat)
}

/// Twice the area of a triangle, negative where it goes around to the right.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether the triangles of the fan all go around as the whole does, but for what rounding makes of straight corners.
fn convex(flat: &[[f64; 2]]) -> bool {
    let areas: Vec<f64> = flat[1..].windows(2).map(|pair| cross(flat[0], pair[0], pair[1])).collect();
    let (all, most) = (areas.iter().sum::<f64>(), areas.iter().map(|area| area.abs()).sum::<f64>());
    areas.iter().all(|area| area * all >= 0.0 || area.abs() <= 1e-9 * most)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether (x, y) is in one of the triangles.
    fn inside(corners: &[DVec3], triangles: &[[usize; 3]], [x, y]: [f64; 2]) -> bool {
        triangles.iter().any(|triangle| {
            let [a, b, c] = triangle.map(|at| [corners[at].x, corners[at].y]);
            let sides = [cross(a, b, [x, y]), cross(b, c, [x, y]), cross(c, a, [x, y])];
            sides.iter().all(|side| *side >= 0.0)
        })
    }

    #[test]
    fn notches_stay_open_wherever_the_polygon_begins() {
        let mut corners =
            [[-0.45, -0.45], [0.45, -0.45], [0.45, -0.2], [-0.2, -0.2], [-0.2, 0.45], [-0.45, 0.45]].map(|[x, y]| DVec3::new(x, y, 1e4));
        for _ in 0..corners.len() {
            let cut = triangles(&corners);
            assert_eq!(cut.len(), 4);
            assert!([[-0.4, 0.4], [0.4, -0.4], [-0.3, -0.3]].iter().all(|&at| inside(&corners, &cut, at)), "{corners:?}");
            assert!([[0.1, 0.1], [0.4, 0.0], [0.0, 0.4]].iter().all(|&at| !inside(&corners, &cut, at)), "{corners:?}");
            corners.rotate_left(1);
        }
    }

    #[test]
    fn convex_polygons_are_fans_whichever_way_they_go() {
        let circle = |turn: f64| -> Vec<DVec3> {
            let corner = |at: i32| (f64::from(at) * turn, DVec3::new(3.0, 1.0, 2.0));
            (0..7).map(corner).map(|(a, centre)| centre + libm::cos(a) * DVec3::X + libm::sin(a) * DVec3::new(0.0, 0.6, 0.8)).collect()
        };
        for corners in [circle(0.8), circle(-0.8)] {
            assert_eq!(triangles(&corners), [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 6]]);
        }
        // A concave one that goes around to the right stays so.
        let dart = [[0.0, 0.0], [-1.0, 2.0], [0.0, 0.5], [1.0, 2.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let [first, ..] = triangles(&dart)[..] else { panic!("a dart has triangles") };
        assert!(cross([0.0, 0.0], [-1.0, 2.0], [0.0, 0.5]) < 0.0);
        let [a, b, c] = first.map(|at| [dart[at].x, dart[at].y]);
        assert!(cross(a, b, c) < 0.0);
    }

    #[test]
    fn what_has_no_area_or_crosses_itself_is_cut_all_the_same() {
        assert_eq!(triangles(&[DVec3::ZERO; 4]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(&[DVec3::ZERO, DVec3::X, DVec3::Y]), [[0, 1, 2]]);
        let bow = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 3.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        assert!(!triangles(&bow).is_empty());
    }
}
