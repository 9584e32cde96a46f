//! What the frames see of each texel: whether at all, and how finely.
//! The G-buffer comes from a finished job; `maps` draws the figures.

use cubist_baker::bake::Flat;
use cubist_baker::tears::{DOWN, RIGHT};

/// What is known of a texel that some pixel falls on: the fewest texels a pixel covers there, as the side of a square; infinite where no pixel
/// has neighbours on the same surface.
pub type Seen = Option<f64>;

/// One entry a texel of the source image; `None` where no pixel of any frame falls on it.
pub fn seen(flat: &Flat) -> Vec<Seen> {
    let (image, gbuffer) = (&flat.atlas.image, &flat.atlas.gbuffer);
    let (width, height) = (gbuffer.width as usize, gbuffer.height as usize);
    let mut seen: Vec<Seen> = vec![None; image.texels.len()];
    for (pixel, &[u, v]) in gbuffer.uv.iter().enumerate() {
        let (x, y) = (pixel % width, pixel / width % height);
        let label = gbuffer.label[pixel];
        let whole = x + 1 < width && y + 1 < height && flat.tears[pixel] & (RIGHT | DOWN) == 0;
        let whole = whole && gbuffer.label[pixel + 1] == label && gbuffer.label[pixel + width] == label;
        let size = if whole {
            let step = |other: usize| [0, 1].map(|k| f64::from(gbuffer.uv[other][k] - [u, v][k]));
            let ([a, b], [c, d]) = (step(pixel + 1), step(pixel + width));
            (a * d - b * c).abs().sqrt()
        } else {
            f64::INFINITY
        };
        let texel = &mut seen[v as usize * image.width as usize + u as usize];
        *texel = Some(texel.map_or(size, |least| least.min(size)));
    }
    seen
}

/// Texels that belong to a surface, but that no pixel of any frame falls on.
pub fn never_seen(flat: &Flat, seen: &[Seen]) -> Vec<bool> {
    flat.atlas.image.covered.iter().zip(seen).map(|(&covered, seen)| covered && seen.is_none()).collect()
}
