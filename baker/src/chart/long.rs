//! Long: a chart that would have to be longer than a source image to be as fine as it is seen is cut in two across, and again: a wall along a street is near
//! the camera all the way, and as one chart it would be a smear.
//! Charts come measured; more of them go on to be measured again.

use super::charting::Charting;

/// Texels that a chart wants to be long, of those that it can be, from which on it is cut: what it then gains is worth a seam.
const LONG: f64 = 1.25;
/// Times that it is, at most.
pub(super) const CUTS: usize = 5;

/// Cuts charts, each in two at most; returns whether there were any to cut.
pub(super) fn split(charting: &mut Charting) -> bool {
    let before = charting.charts.len();
    for (chart, faces) in (0u32..).zip(charting.members()) {
        let of = &charting.charts[chart as usize];
        if of.wanted < LONG {
            continue;
        }
        let sides = [0, 1].map(|axis| of.hi[axis] - of.lo[axis]);
        let axis = usize::from(sides[1] > sides[0]);
        let middle = 0.5 * (of.lo[axis] + of.hi[axis]);
        if let Some(far) = charting.beyond(&faces, (axis, middle)) {
            charting.take_out(chart, &far);
        }
    }
    charting.charts.len() > before
}

#[cfg(test)]
mod tests {
    use super::super::{Density, Family, build};
    use super::*;
    use crate::camera::{Aim, Line};
    use crate::gbuffer::Hits;
    use crate::scene::{Background, Material, Playback, Scene, Triangle};
    use crate::trace::Tracer;
    use glam::{DVec3, Vec2, Vec3};
    use std::sync::Arc;

    /// A wall of 32 squares beside the way.
    fn wall() -> Scene {
        let at = |x: f64| DVec3::new(x, 0.0, 2.0);
        // Of a colour each, which blur would lose.
        let square = |x: f64| {
            let [a, b, c, d] = [[0.0, -0.5], [1.0, -0.5], [1.0, 0.5], [0.0, 0.5]].map(|[across, y]| DVec3::new(x + across, y, 0.0));
            [[a, b, c], [a, c, d]].map(|position| Triangle {
                position,
                normal: [Vec3::ZERO; 3],
                uv: [Vec2::ZERO; 3],
                colour: [Vec3::splat((x % 3.0) as f32 * 0.5); 3],
                material: 0,
                island: None,
            })
        };
        Scene {
            name: "wall".into(),
            triangles: (0..32).flat_map(|x| square(f64::from(x))).collect(),
            materials: vec![Material::default()],
            textures: [].into(),
            background: Background::Colour([32, 40, 48]),
            lights: Vec::new(),
            camera: Arc::new(Line { from: at(1.0), to: at(31.0), aim: Aim::Direction(DVec3::NEG_Z), up: DVec3::Y, fov: 45.0 }),
            playback: Playback { width: 48, height: 36, frames: 33, fps: 30, looping: false },
            warnings: Vec::new(),
        }
    }

    #[test]
    fn a_wall_along_the_way_is_as_fine_as_it_is_seen() {
        let scene = wall();
        let hits = Hits::cast(&scene, &Tracer::new(&scene), &|_, _| {});
        let density = Density { most: 1.0, detail: 1e6, texel: 1.0 };
        let charts = |max_side| build(&scene, &hits, Family::Planes, &density, max_side).charts;
        let (whole, parts) = (charts(1024), charts(256));
        assert_eq!(whole.len(), 1);
        assert!(parts.len() > 1, "{} texels a unit", parts[0].density);
        for part in &parts {
            assert!(part.wanted < LONG && part.density > 0.8 * whole[0].density, "{} {}", part.density, whole[0].density);
        }
    }
}
