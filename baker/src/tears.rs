//! Tears: where neighbouring pixels see the same chart, but not the same part of the surface: terrain behind a ridge,
//! the far side of a ring. Found by casting rays between the two; they go to `folds`.

use crate::cast::Cast;
use crate::gbuffer::{GBuffer, Lens, Sample, difference, size};
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
pub fn find(cast: &Cast<'_>, gbuffer: &GBuffer) -> Vec<u8> {
    let (width, height) = (gbuffer.width as usize, gbuffer.height as usize);
    // Rays halve what is left between two frames, so there are few moments.
    let moments = |frame: usize| (1..1 << BISECTIONS).map(move |part| frame as f64 + f64::from(part) / f64::from(1 << BISECTIONS));
    let between = |frame: usize| moments(frame).map(|moment| Lens::at(cast.scene, moment)).collect();
    let between: Vec<Vec<Lens>> = (0..gbuffer.frames as usize).into_par_iter().map(between).collect();
    let mut tears = vec![0u8; gbuffer.label.len()];
    tears.par_chunks_mut(width.max(1)).enumerate().for_each(|(line, out)| {
        let (frame, y) = (line / height, line % height);
        let lens = Lens::new(cast.scene, frame as u32);
        let last = frame + 1 == gbuffer.frames as usize;
        for (x, bits) in out.iter_mut().enumerate() {
            let pixel = line * width + x;
            let pair = Pair { cast, gbuffer, pixel };
            let at = [x as f64 + 0.5, y as f64 + 0.5];
            if x + 1 < width && pair.torn(RIGHT, pixel + 1, |t| (lens, [at[0] + t, at[1]])) {
                *bits |= RIGHT;
            }
            if y + 1 < height && pair.torn(DOWN, pixel + width, |t| (lens, [at[0], at[1] + t])) {
                *bits |= DOWN;
            }
            let moment = |t: f64| between[frame][(t * f64::from(1 << BISECTIONS)) as usize - 1];
            if !last && pair.torn(NEXT, pixel + width * height, |t| (moment(t), at)) {
                *bits |= NEXT;
            }
        }
    });
    tears
}

/// A pixel and what it is seen with.
struct Pair<'a> {
    cast: &'a Cast<'a>,
    gbuffer: &'a GBuffer,
    pixel: usize,
}

impl Pair<'_> {
    /// Whether the pixel and `other`, on this `side` of it, see torn parts of one chart; `ray` gives the ray at 0..=1 between the two.
    fn torn(&self, side: u8, other: usize, ray: impl Fn(f64) -> (Lens, [f64; 2])) -> bool {
        let label = self.gbuffer.label[self.pixel];
        if label == 0 || label != self.gbuffer.label[other] {
            return false;
        }
        if size(difference(self.gbuffer.uv[self.pixel], self.gbuffer.uv[other])) < CLOSE {
            return false;
        }
        self.cast.gaps.open(self.pixel, side, || self.open(other, ray))
    }

    /// Whether there is a gap between what the pixel sees and what `other` does.
    fn open(&self, other: usize, ray: impl Fn(f64) -> (Lens, [f64; 2])) -> bool {
        let samples = &self.cast.hits.samples;
        let (from, to) = (self.point(samples[self.pixel]), self.point(samples[other]));
        let gap = (to.0 - from.0).length();
        let off = |normal: DVec3| (to.0 - from.0).dot(normal).abs();
        if off(from.1).max(off(to.1)) < FLAT * gap {
            return false;
        }
        let (mut ends, mut at) = ([from.0, to.0], [0.0, 1.0]);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (at[0] + at[1]);
            let (lens, [x, y]) = ray(middle);
            let direction = lens.direction(x, y);
            // Something else in between: the two do not meet here.
            let Some(hit) = self.cast.tracer.hit(lens.eye, direction) else { return true };
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
        (sample.point(self.cast.scene), sample.normal(self.cast.scene))
    }
}
