//! Heightfields: a grid of heights, thinned to what the screen can show, as a triangle mesh with smooth normals.
//! Grids come from `read`, colours from a picture; models go to `file`.

mod geotiff;
mod grid;
mod read;

use super::error::SceneError;
use super::model::Model;
use super::{Material, Playback, Triangle, Wrap, picture};
use glam::{DVec3, Vec2, Vec3};
use grid::Grid;
use std::path::Path;

/// The longest side of a colour picture, texels; larger ones are reduced.
const MAX_COLOUR: u32 = 2048;
/// What an untextured, lit heightfield looks like.
const GREY: Vec3 = Vec3::splat(0.8);

/// What a scene file says about a heightfield.
pub(crate) struct Field<'a> {
    /// The picture of heights.
    pub heights: &'a Path,
    /// The picture of colours.
    pub colour: Option<&'a Path>,
    /// Extent along x and z, world units.
    pub size: [f64; 2],
    /// What the smallest and the largest stored value stand for; without it stored values are heights.
    pub range: Option<[f64; 2]>,
}

/// Loads a heightfield for a screen; `unlit`: no light will show its shape.
pub(crate) fn load(field: &Field<'_>, screen: &Playback, unlit: bool) -> Result<Model, SceneError> {
    let error = |file: &Path| {
        let file = file.to_owned();
        move |what| SceneError::Model { file, what }
    };
    let mut model = Model::default();
    let mut grid = read::load(field.heights, &mut model.warnings).map_err(error(field.heights))?;
    let (low, high) = grid.extremes().ok_or_else(|| error(field.heights)("every post is nodata: nothing to show".to_owned()))?;
    // 1.6 posts a pixel of the longer side: more would be thinner than a pixel wherever the whole field is in view.
    let most = (screen.width.max(screen.height) * 8 / 5).clamp(256, 1024);
    if let Some(thin) = grid.thinned(most) {
        model.warnings.add(format!(
            "{}: {} x {} posts averaged down to {} x {}, as much as a {} x {} screen can show",
            field.heights.display(),
            grid.width,
            grid.height,
            thin.width,
            thin.height,
            screen.width,
            screen.height
        ));
        grid = thin;
    }
    let mut material = Material::default();
    let tint = match field.colour {
        Some(path) => {
            let mut texture = crate::files::read(path).and_then(|b| picture::texture(&b, [Wrap::Clamp; 2], &[])).map_err(error(path))?;
            if let Some(small) = picture::reduce(&texture, MAX_COLOUR) {
                let (w, h) = (small.width, small.height);
                model.warnings.add(format!("{}: {} x {} texels averaged down to {w} x {h}", path.display(), texture.width, texture.height));
                texture = small;
            }
            model.textures.push(texture);
            material.texture = Some(0);
            false
        }
        None if unlit => {
            model.warnings.add("a heightfield without colour and without light: tinted by height so that its shape shows");
            true
        }
        None => {
            material.colour = GREY;
            model.warnings.add("a heightfield without colour: plain light grey");
            false
        }
    };
    model.materials.push(material);
    model.coloured = tint;
    let scale = match field.range {
        Some([from, to]) if high > low => ((to - from) / (high - low), from - low * (to - from) / (high - low)),
        Some([from, _]) => (0.0, from),
        None => (1.0, 0.0),
    };
    mesh(&grid, field.size, scale, tint.then_some([low, high]), &mut model);
    Ok(model)
}

/// A valley-to-summit colour for 0..=1: green, ochre, grey, white.
fn hypsometric(t: f64) -> Vec3 {
    const STOPS: [[f32; 3]; 5] = [[0.20, 0.42, 0.25], [0.50, 0.60, 0.32], [0.72, 0.62, 0.42], [0.55, 0.48, 0.44], [0.96, 0.96, 0.97]];
    let x = t.clamp(0.0, 1.0) * 4.0;
    let i = (x as usize).min(3);
    Vec3::from(STOPS[i]).lerp(Vec3::from(STOPS[i + 1]), (x - i as f64) as f32)
}

/// Two triangles a quad of posts; those with a hole for a corner are left out.
fn mesh(grid: &Grid, size: [f64; 2], (factor, offset): (f64, f64), tint: Option<[f64; 2]>, model: &mut Model) {
    let (w, h) = (grid.width, grid.height);
    let step = [size[0] / f64::from(w - 1), size[1] / f64::from(h - 1)];
    let height = |x: u32, y: u32| grid.at(x, y).map(|v| v * factor + offset);
    let position = |x: u32, y: u32| {
        height(x, y).map(|v| DVec3::new(f64::from(x) * step[0] - size[0] / 2.0, v, f64::from(y) * step[1] - size[1] / 2.0))
    };
    // The slope between the nearest posts on either side that are there.
    let slope = |before: Option<f64>, here: f64, after: Option<f64>, step: f64| match (before, after) {
        (Some(b), Some(a)) => (a - b) / (2.0 * step),
        (Some(b), None) => (here - b) / step,
        (None, Some(a)) => (a - here) / step,
        (None, None) => 0.0,
    };
    let normal = |x: u32, y: u32| {
        let here = height(x, y).unwrap_or(0.0);
        let left = x.checked_sub(1).and_then(|x| height(x, y));
        let up = y.checked_sub(1).and_then(|y| height(x, y));
        let dx = slope(left, here, if x + 1 < w { height(x + 1, y) } else { None }, step[0]);
        let dz = slope(up, here, if y + 1 < h { height(x, y + 1) } else { None }, step[1]);
        DVec3::new(-dx, 1.0, -dz).normalize().as_vec3()
    };
    let colour = |x: u32, y: u32| match (tint, grid.at(x, y)) {
        (Some([low, high]), Some(v)) => hypsometric(if high > low { (v - low) / (high - low) } else { 0.0 }),
        _ => Vec3::ONE,
    };
    // Posts are where their texels have their centres.
    let uv = |x: u32, y: u32| Vec2::new(grid.across(x) as f32, grid.down(y) as f32);
    for y in 0..h - 1 {
        for x in 0..w - 1 {
            let (a, b, c, d) = ((x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1));
            // The shorter diagonal in height: ridges and valleys along it stay whole.
            let rise = |p: (u32, u32), q: (u32, u32)| height(p.0, p.1).zip(height(q.0, q.1)).map_or(f64::INFINITY, |(p, q)| (p - q).abs());
            let halves = if rise(a, d) <= rise(b, c) { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] };
            for corners in halves {
                let [Some(p), Some(q), Some(r)] = corners.map(|(x, y)| position(x, y)) else { continue };
                model.triangles.push(Triangle {
                    position: [p, q, r],
                    normal: corners.map(|(x, y)| normal(x, y)),
                    uv: corners.map(|(x, y)| uv(x, y)),
                    colour: corners.map(|(x, y)| colour(x, y)),
                    material: 0,
                    island: None,
                });
            }
        }
    }
}
