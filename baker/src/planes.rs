//! Planes: labels whose chart is an affine picture of a flat surface. Playback tells their layers' positions from where a key looks, to within
//! what the fit moves them (see `cubist_core::plane`).
//! Points come from the hits, positions from the G-buffer; records go to `encode`.

use crate::gbuffer::{GBuffer, Hits, Lens};
use crate::scene::Scene;
use crate::sheets::{KeyGrid, Layers};
use cubist_core::plane::{Camera, Plane, Vector};
use glam::DVec3;

/// A plane whose picture is off a straight line by this much from node to node, texels, counts half.
const BEND: f64 = 1.0;
/// Every this many pixels one is looked at.
const SPARSE: usize = 7;
/// A point farther than this from where its position says, texels, shows that a label is not flat.
const FLAT: f64 = 0.25;
/// A plane has to serve this many layers to be worth its bytes, and those of all planes together this many a key to be worth the cameras'.
const LAYERS: usize = 64;
/// Points are stored below 2^26 units from the middle of all, axes below 2^24, directions below 2^27.
const POINT: f64 = (1u32 << 26) as f64;
const AXIS: f64 = (1u32 << 24) as f64;
const DIRECTION: f64 = (1u32 << 27) as f64;

/// Where a flat label lies in space: the point of position (u, v) is `origin` + u `along_u` + v `along_v`, in the scene's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatChart {
    /// The point of position (0, 0).
    pub origin: DVec3,
    /// A texel along u.
    pub along_u: DVec3,
    /// A texel along v.
    pub along_v: DVec3,
}

impl FlatChart {
    /// The position, texels, that a ray sees; `None` where the plane is behind its eye.
    #[must_use]
    pub fn seen(&self, eye: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let (c, normal) = (eye - self.origin, self.along_u.cross(self.along_v));
        let divisor = direction.dot(normal);
        let ahead = -c.dot(normal) * divisor > 0.0;
        ahead.then(|| [direction.dot(c.cross(self.along_v)) / divisor, direction.dot(self.along_u.cross(c)) / divisor])
    }

    fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        self.origin + self.along_u * u + self.along_v * v
    }
}

/// The flat ones among `labels` labels.
#[must_use]
pub fn find(scene: &Scene, hits: &Hits, gbuffer: &GBuffer, labels: usize) -> Vec<Option<FlatChart>> {
    let mut seen: Vec<Vec<([f64; 2], DVec3)>> = vec![Vec::new(); labels];
    for pixel in (0..gbuffer.label.len()).step_by(SPARSE) {
        let label = usize::from(gbuffer.label[pixel]);
        if label > 0 && label < labels {
            seen[label].push((gbuffer.uv[pixel].map(f64::from), hits.samples[pixel].point(scene)));
        }
    }
    seen.iter().map(|seen| flat_chart(seen)).collect()
}

/// The plane through three samples that lie far apart, if all others lie in it where they should.
fn flat_chart(seen: &[([f64; 2], DVec3)]) -> Option<FlatChart> {
    let &(first, start) = seen.first()?;
    let apart = |[a, b]: [f64; 2]| libm::hypot(a - first[0], b - first[1]);
    let &(second, next) = seen.iter().max_by(|a, b| apart(a.0).total_cmp(&apart(b.0)))?;
    let area = |[a, b]: [f64; 2]| (second[0] - first[0]) * (b - first[1]) - (second[1] - first[1]) * (a - first[0]);
    let &(third, last) = seen.iter().max_by(|a, b| area(a.0).abs().total_cmp(&area(b.0).abs()))?;
    let determinant = area(third);
    if determinant.abs() < 1.0 {
        return None;
    }
    let ([u1, v1], [u2, v2]) = ([second[0] - first[0], second[1] - first[1]], [third[0] - first[0], third[1] - first[1]]);
    let (x1, x2) = (next - start, last - start);
    let (along_u, along_v) = ((x1 * v2 - x2 * v1) / determinant, (x2 * u1 - x1 * u2) / determinant);
    let chart = FlatChart { origin: start - along_u * first[0] - along_v * first[1], along_u, along_v };
    let texel = along_u.length().min(along_v.length());
    let flat = texel > 0.0 && seen.iter().all(|&(at, point)| (chart.point(at) - point).length() <= FLAT * texel);
    flat.then_some(chart)
}

/// Where every layer's ray meets its label's plane, texels, and how sure it is that the layer belongs there, 0..=1; `None` where there is no
/// such plane, or no such point.
///
/// Towards its horizon a plane's picture bends more and more from node to node. What is interpolated between nodes cannot follow it
/// there, and the best layers are elsewhere.
#[must_use]
pub fn positions(charts: &[Option<FlatChart>], layers: &Layers, lenses: &[Lens], grid: &KeyGrid) -> Vec<Option<([f32; 2], f32)>> {
    let (nodes, width, size) = (grid.grid.nodes(), grid.grid.node_columns(), f64::from(1u32 << grid.grid.log2));
    let mut positions = vec![None; layers.label.len()];
    for (key, lens) in lenses.iter().enumerate() {
        for node in 0..nodes {
            let [x, y] = [node % width, node / width].map(|at| at as f64 * size + 0.5);
            let directions = [[0.0, 0.0], [-size, 0.0], [size, 0.0], [0.0, -size], [0.0, size]].map(|[dx, dy]| lens.ray(x + dx, y + dy));
            let place = |chart: FlatChart| {
                let [at, left, right, up, down] = directions.map(|direction| chart.seen(lens.eye, direction));
                let at = at?;
                let bend = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] + b[0] - 2.0 * at[0], a[1] + b[1] - 2.0 * at[1]) / BEND;
                let (across, along) = (bend(left?, right?), bend(up?, down?));
                Some((at.map(|x| x as f32), (1.0 / (1.0 + across * across + along * along)) as f32))
            };
            let at = layers.start[key * nodes + node] as usize..layers.start[key * nodes + node + 1] as usize;
            for (position, &label) in positions[at.clone()].iter_mut().zip(&layers.label[at]) {
                *position = charts[usize::from(label)].and_then(place);
            }
        }
    }
    positions
}

/// The records of the planes that are worth it, labels ascending, and of every key's camera. `charts` are by label, `layers` counts each label's
/// layers in all keys.
#[must_use]
pub fn records(charts: &[Option<FlatChart>], layers: &[usize], lenses: &[Lens], grid: &KeyGrid) -> (Vec<Plane>, Vec<Camera>) {
    let wanted: Vec<(u8, FlatChart)> = (0..=u8::MAX)
        .zip(charts)
        .filter_map(|(label, chart)| Some((label, (*chart)?)).filter(|_| layers[usize::from(label)] >= LAYERS))
        .collect();
    let served: usize = wanted.iter().map(|&(label, _)| layers[usize::from(label)]).sum();
    if served < LAYERS * lenses.len() {
        return (Vec::new(), Vec::new());
    }
    let points = || lenses.iter().map(|lens| lens.eye).chain(wanted.iter().map(|(_, chart)| chart.origin));
    let low = points().fold(DVec3::INFINITY, DVec3::min);
    let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
    let middle = 0.5 * (low + high);
    let texels = wanted.iter().map(|(_, chart)| chart.along_u.abs().max_element().max(chart.along_v.abs().max_element()));
    // A texel as large as the scene leaves nothing to tell.
    let extent = texels.fold((high - middle).max_element(), f64::max);
    let unit = POINT / extent;
    let rounded = |vector: DVec3| -> Vector { vector.to_array().map(|x| libm::round(x) as i32) };
    let plane = |&(label, chart): &(u8, FlatChart)| {
        let axes = [chart.along_u, chart.along_v].map(|axis| axis * unit);
        let largest = axes[0].abs().max_element().max(axes[1].abs().max_element());
        let shift = libm::floor(libm::log2(AXIS / largest)).clamp(-2.0, 31.0);
        let [along_u, along_v] = axes.map(|axis| rounded(axis * libm::exp2(shift)));
        // Only a plane whose texels are as large as all of the scene is left out.
        (shift >= 0.0).then(|| Plane { label, shift: shift as u8, origin: rounded((chart.origin - middle) * unit), along_u, along_v })
    };
    let camera = |lens: &Lens| {
        let size = f64::from(1u32 << grid.grid.log2);
        let (first, right, down) = (lens.ray(0.5, 0.5), lens.ray(0.5 + size, 0.5), lens.ray(0.5, 0.5 + size));
        let (column, row) = (right - first, down - first);
        let end = |steps: [usize; 2]| first + column * steps[0] as f64 + row * steps[1] as f64;
        let corners = [[0, 0], [grid.grid.columns, 0], [0, grid.grid.rows], [grid.grid.columns, grid.grid.rows]].map(end);
        let longest = corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
        let scaled = |vector: DVec3| rounded(vector * (DIRECTION / longest));
        Camera { eye: rounded((lens.eye - middle) * unit), first: scaled(first), column: scaled(column), row: scaled(row) }
    };
    (wanted.iter().filter_map(plane).collect(), lenses.iter().map(camera).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::{self, Atlas};
    use crate::scene::builtin;
    use crate::trace::Tracer;
    use cubist_core::format::{SPACE_LINEAR, TIME_LINEAR};
    use cubist_core::plane::View;

    #[test]
    fn the_players_integers_tell_what_rays_see() {
        let mut scene = builtin::build("street").unwrap();
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (160, 120, 9);
        let hits = Hits::cast(&scene, &Tracer::new(&scene), &|_, _| {});
        let Atlas { image, gbuffer, .. } = atlas::build(&scene, &hits, &atlas::Settings::default(), &|_, _| {}).unwrap();
        let charts = find(&scene, &hits, &gbuffer, image.labels.len());
        let grid = KeyGrid::new(&gbuffer, 3, 4, false, [TIME_LINEAR, SPACE_LINEAR]);
        let lenses: Vec<Lens> = grid.keys.iter().map(|&key| Lens::new(&scene, key)).collect();
        let (planes, cameras) = records(&charts, &vec![1000; charts.len()], &lenses, &grid);
        assert!(planes.len() > 10, "{}", planes.len());
        let mut told = 0;
        for (key, (&frame, camera)) in grid.keys.iter().zip(&cameras).enumerate() {
            for plane in &planes {
                let chart = charts[usize::from(plane.label)].unwrap();
                let view = View::new(plane, camera, 6);
                for node in 0..grid.grid.nodes() {
                    let (column, row) = (node % grid.grid.node_columns(), node / grid.grid.node_columns());
                    let (x, y) = ((8 * column).min(159), (8 * row).min(119));
                    let label = gbuffer.label[(frame as usize * 120 + y) * 160 + x];
                    if usize::from(label) != usize::from(plane.label) {
                        continue;
                    }
                    let direction = lenses[key].ray((8 * column) as f64 + 0.5, (8 * row) as f64 + 0.5);
                    let Some(exact) = chart.seen(lenses[key].eye, direction) else { continue };
                    let at = view.at(column, row).expect("what is seen lies ahead");
                    for axis in 0..2 {
                        assert!((f64::from(at[axis]) / 64.0 - exact[axis]).abs() < 1.0 / 64.0, "{at:?} {exact:?}");
                    }
                    told += 1;
                }
            }
        }
        assert!(told > 300, "{told}");
    }
}
