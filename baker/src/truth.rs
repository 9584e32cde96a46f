//! The truth: the scene itself, ray traced with 16 samples a pixel, without any source image in between.
//! Rays come from the camera path, colours from [`Shader`]; pictures go to `verify`.

use crate::gbuffer::Lens;
use crate::scene::Scene;
use crate::shade::Shader;
use crate::trace::{Hit, PACKET, Tracer};
use glam::Vec3;
use rayon::prelude::*;

/// Samples along each side of a pixel: as many in all as are cast together.
const SIDE: usize = PACKET.isqrt();
const _: () = assert!(SIDE * SIDE == PACKET);

/// A scene ready to be rendered.
pub struct Truth<'a> {
    scene: &'a Scene,
    tracer: Tracer<'a>,
    shader: Shader<'a>,
}

impl<'a> Truth<'a> {
    /// Builds the ray hierarchy and the texture pyramids.
    #[must_use]
    pub fn new(scene: &'a Scene) -> Self {
        Self::by(Tracer::new(scene))
    }

    /// Likewise, by the tracer of a scene.
    #[must_use]
    pub fn by(tracer: Tracer<'a>) -> Self {
        let scene = tracer.scene();
        Self { scene, tracer, shader: Shader::new(scene) }
    }

    /// Renders frame `frame`: R, G, B, row by row; the same bytes on any number of threads.
    #[must_use]
    pub fn frame(&self, frame: u32) -> Vec<u8> {
        let (width, height) = (self.scene.playback.width as usize, self.scene.playback.height as usize);
        let lens = Lens::new(self.scene, frame);
        let mut picture = vec![0u8; width * height * 3];
        picture.par_chunks_mut((width * 3).max(1)).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                let offset = |i: usize| (i as f64 + 0.5) / SIDE as f64;
                let places: [[f64; 2]; PACKET] = std::array::from_fn(|at| [x as f64 + offset(at % SIDE), y as f64 + offset(at / SIDE)]);
                let hits = self.tracer.hits(lens.eye, &places.map(|[x, y]| lens.direction(x, y)));
                let sum = hits.into_iter().zip(places).map(|(hit, place)| self.colour(hit, place)).sum::<Vec3>();
                // Colours are at most 255 a component: the mean fits a byte.
                *pixel = (sum / PACKET as f32).to_array().map(|v| (v + 0.5) as u8);
            }
        });
        picture
    }

    /// At most `most` frames, evenly spread over the path: which, and as [`Truth::frame`] has it.
    pub(crate) fn frames(&self, most: u32) -> Vec<(u32, Vec<u8>)> {
        spread(self.scene.playback.frames, most).into_iter().map(|frame| (frame, self.frame(frame))).collect()
    }

    fn colour(&self, hit: Option<Hit>, [x, y]: [f64; 2]) -> Vec3 {
        match hit {
            // The side matters to lit materials only, and the shader asks for it there only.
            Some(hit) => self.shader.shade(hit.triangle * 2 + u32::from(hit.back), hit.bary, 0.0),
            None => self.shader.background(x, y),
        }
    }
}

/// At most `most` frames of `frames`, evenly spread from the first to the last.
#[must_use]
pub fn spread(frames: u32, most: u32) -> Vec<u32> {
    let count = frames.min(most);
    let place = |i: u32| u64::from(i) * u64::from(frames.saturating_sub(1)) / u64::from(count.saturating_sub(1).max(1));
    (0..count).map(|i| place(i) as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn frames_are_spread_from_end_to_end() {
        assert_eq!(spread(128, 4), [0, 42, 84, 127]);
        assert_eq!(spread(3, 16), [0, 1, 2]);
        assert_eq!(spread(1, 16), [0]);
        assert_eq!(spread(10, 1), [0]);
        assert!(spread(10, 0).is_empty());
    }

    #[test]
    fn a_flat_background_is_itself_and_outlines_are_softened() {
        let mut scene = builtin::build("pyramid").unwrap();
        (scene.playback.width, scene.playback.height) = (32, 24);
        scene.background = crate::scene::Background::Colour([10, 200, 30]);
        // One white triangle in front of the eye: its right edge runs down the middle of a column of pixels.
        let lens = Lens::new(&scene, 0);
        let corner = |x: f64, y: f64| lens.eye + lens.direction(x, y) * 2.0;
        scene.triangles.truncate(1);
        scene.triangles[0].position = [corner(20.5, -300.0), corner(20.5, 300.0), corner(-500.0, 12.0)];
        scene.materials = vec![crate::scene::Material { unlit: true, ..Default::default() }];
        (scene.triangles[0].material, scene.triangles[0].colour) = (0, [Vec3::ONE; 3]);
        let picture = Truth::new(&scene).frame(0);
        assert_eq!(picture.len(), 32 * 24 * 3);
        for row in picture.as_chunks::<3>().0.chunks(32) {
            assert_eq!((row[19], row[21]), ([255; 3], [10, 200, 30]));
            // Half of 16 samples see the triangle, half the background.
            assert_eq!(row[20], [133, 228, 143]);
        }
    }
}
