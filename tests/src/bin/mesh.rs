//! `mesh SCENE WxH FRAMES FILE`: writes a built-in scene as `player-mcu/peers/src/raster.rs` draws it: triangles, a texture, and every frame's camera,
//! in numbers of 32 bits, little-endian. `player-mcu/peers/run` links it into the live rasteriser that stands beside Cubist.

use anyhow::{Context, Result, bail, ensure};
use cubist_baker::atlas::widened;
use cubist_baker::camera::Pose;
use cubist_baker::encode::rgb565;
use cubist_baker::scene::Scene;
use cubist_tests::scenes;
use glam::DVec3;
use std::collections::HashMap;

/// Units of a position in one of the scene's: 2^this.
const POSITION_BITS: i32 = 12;
/// Units of a texture coordinate in a texel: 2^this.
const TEXEL_BITS: i32 = 8;
/// Units of a camera's directions in one of the scene's: 2^this.
const DIRECTION_BITS: i32 = 16;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, size, frames, file] = arguments.as_slice() else {
        bail!("usage: mesh SCENE WxH FRAMES FILE");
    };
    let words = words(&scenes::asked(name, size, frames)?)?;
    std::fs::write(file, words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>()).with_context(|| file.clone())
}

/// What is written of `scene`: how many frames, vertices and triangles there are, then cameras, vertices, triangles and texels.
fn words(scene: &Scene) -> Result<Vec<i32>> {
    let [texture] = &*scene.textures else { bail!("{}: one texture is wanted", scene.name) };
    ensure!([texture.width, texture.height] == [512, 512], "{}: a texture of 512 x 512 texels is wanted", scene.name);
    let poses: Vec<Pose> = (0..scene.playback.frames).map(|frame| scene.camera.pose(scene.playback.parameter(frame.into()))).collect();
    let (mut vertices, mut triangles, mut known) = (Vec::new(), Vec::new(), HashMap::new());
    for triangle in &scene.triangles {
        let corners = [0, 1, 2].map(|corner| {
            let position = triangle.position[corner].to_array().map(|x| fixed(x, POSITION_BITS));
            let texel = triangle.uv[corner].to_array().map(|x| fixed(f64::from(x) * 512.0, TEXEL_BITS));
            let vertex = [position[0], position[1], position[2], texel[0], texel[1]];
            *known.entry(vertex).or_insert_with(|| {
                vertices.push(vertex);
                vertices.len() as i32 - 1
            })
        });
        let middle = (triangle.position[0] + triangle.position[1] + triangle.position[2]) / 3.0;
        let away = poses.iter().map(|pose| pose.eye.distance(middle)).sum::<f64>();
        triangles.push((away, corners));
    }
    // The nearest first: what they hide costs no more than a look at its depth.
    triangles.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut words = vec![poses.len() as i32, vertices.len() as i32, triangles.len() as i32];
    words.extend(poses.iter().flat_map(|pose| camera(pose, [scene.playback.width, scene.playback.height])));
    words.extend(vertices.iter().flatten());
    words.extend(triangles.iter().flat_map(|(_, corners)| corners));
    let texels: Vec<u16> = texture.texels.iter().map(|&[r, g, b, _]| rgb565(widened([r, g, b]))).collect();
    words.extend(texels.as_chunks().0.iter().map(|&[even, odd]| (u32::from(odd) << 16 | u32::from(even)) as i32));
    Ok(words)
}

/// The focal point; where right, down and forward are, the first two so long that what is seen is as far to the side as ahead at most.
fn camera(pose: &Pose, size: [u32; 2]) -> [i32; 12] {
    let [wide, high] = size.map(f64::from);
    let tangent = libm::tan(0.5 * pose.fov.to_radians());
    let direction = |axis: DVec3| axis.to_array().map(|x| fixed(x, DIRECTION_BITS));
    let ([a, b, c], [d, e, f]) = (direction(pose.right / (tangent * wide / high)), direction(-pose.up / tangent));
    let ([g, h, i], [x, y, z]) = (direction(pose.forward), pose.eye.to_array().map(|x| fixed(x, POSITION_BITS)));
    [x, y, z, a, b, c, d, e, f, g, h, i]
}

fn fixed(x: f64, bits: i32) -> i32 {
    libm::round(libm::scalbn(x, bits)) as i32
}
