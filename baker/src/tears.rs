//! Tears: where neighbouring pixels see the same chart, but not the same part of the surface: terrain behind a ridge,
//! the far side of a ring. Found by casting rays between the two; they go to `folds`.

use crate::gbuffer::{GBuffer, Hits, Lens, Sample};
use crate::scene::Scene;
use crate::trace::Tracer;
use glam::DVec3;
use rayon::prelude::*;

/// The pixel to the right sees a torn-off part.
pub const RIGHT: u8 = 1;
/// The pixel below does.
pub const DOWN: u8 = 2;
/// The same pixel in the next frame does.
pub const NEXT: u8 = 4;

/// Pixels this close in the source image are never looked at, texels: a fold of less is not seen.
const CLOSE: f32 = 2.0;
/// Rays cast between two pixels, at most: each halves where the tear can be.
const BISECTIONS: usize = 6;
/// A gap that six halvings leave this share of does not close.
const CLOSED: f64 = 0.2;
/// Two points whose gap leaves the plane of either face by less than this share are on one smooth surface.
const FLAT: f64 = 0.1;

/// One byte a pixel of the G-buffer: [`RIGHT`], [`DOWN`] and [`NEXT`].
#[must_use]
pub fn find(scene: &Scene, tracer: &Tracer<'_>, hits: &Hits, gbuffer: &GBuffer) -> Vec<u8> {
    let (width, height) = (gbuffer.width as usize, gbuffer.height as usize);
    let mut tears = vec![0u8; gbuffer.label.len()];
    tears.par_chunks_mut(width.max(1)).enumerate().for_each(|(line, out)| {
        let (frame, y) = (line / height, line % height);
        let lens = Lens::new(scene, frame as u32);
        let last = frame + 1 == gbuffer.frames as usize;
        for (x, bits) in out.iter_mut().enumerate() {
            let pixel = line * width + x;
            let pair = Pair { scene, tracer, hits, gbuffer, pixel };
            let at = [x as f64 + 0.5, y as f64 + 0.5];
            if x + 1 < width && pair.torn(pixel + 1, |t| Some((lens, [at[0] + t, at[1]]))) {
                *bits |= RIGHT;
            }
            if y + 1 < height && pair.torn(pixel + width, |t| Some((lens, [at[0], at[1] + t]))) {
                *bits |= DOWN;
            }
            if !last && pair.torn(pixel + width * height, |t| Some((Lens::at(scene, frame as f64 + t), at))) {
                *bits |= NEXT;
            }
        }
    });
    tears
}

/// A pixel and what it is seen with.
struct Pair<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer<'a>,
    hits: &'a Hits,
    gbuffer: &'a GBuffer,
    pixel: usize,
}

impl Pair<'_> {
    /// Whether the pixel and `other` see torn parts of one chart; `ray` gives the ray at 0..=1 between the two.
    fn torn(&self, other: usize, ray: impl Fn(f64) -> Option<(Lens, [f64; 2])>) -> bool {
        let label = self.gbuffer.label[self.pixel];
        if label == 0 || label != self.gbuffer.label[other] {
            return false;
        }
        let ([a, b], [c, d]) = (self.gbuffer.uv[self.pixel], self.gbuffer.uv[other]);
        if (a - c).abs().max((b - d).abs()) < CLOSE {
            return false;
        }
        let (from, to) = (self.point(self.hits.samples[self.pixel]), self.point(self.hits.samples[other]));
        let gap = (to.0 - from.0).length();
        let off = |normal: DVec3| (to.0 - from.0).dot(normal).abs();
        if off(from.1).max(off(to.1)) < FLAT * gap {
            return false;
        }
        let (mut ends, mut at) = ([from.0, to.0], [0.0, 1.0]);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (at[0] + at[1]);
            let Some((lens, [x, y])) = ray(middle) else { return false };
            let direction = lens.direction(x, y);
            // Something else in between: the two do not meet here.
            let Some(hit) = self.tracer.hit(lens.eye, direction) else { return true };
            let point = lens.eye + direction * hit.t;
            let half = usize::from((point - ends[0]).length() < (ends[1] - point).length());
            // The larger half is looked into further.
            (ends[1 - half], at[1 - half]) = (point, middle);
            if (ends[1] - ends[0]).length() < CLOSED * gap {
                return false;
            }
        }
        true
    }

    /// The point that a sample sees, and its face's unit normal.
    fn point(&self, sample: Sample) -> (DVec3, DVec3) {
        (sample.point(self.scene), sample.normal(self.scene))
    }
}
