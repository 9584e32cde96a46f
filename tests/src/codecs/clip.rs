//! Clips: all frames of a scene as raw pictures, and how like each other two of them are.
//! Frames come from exact rays, from the truth, from the player and from codecs; scores go to the codec table.

use crate::play;
use anyhow::Result;
use cubist_baker::atlas::Atlas;
use cubist_baker::metrics::{mean_squared_error, psnr, ssim};
use cubist_baker::scene::Scene;
use cubist_baker::truth::Truth;
use cubist_baker::verify::{exact_frame, rgb};
use cubist_core::{AnyTexels, Player};

/// Width and height, pixels, and frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Pixels a row.
    pub width: u32,
    /// Rows a frame.
    pub height: u32,
    /// Frames.
    pub frames: u32,
}

impl Shape {
    /// That of a scene's playback.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        Self { width: scene.playback.width, height: scene.playback.height, frames: scene.playback.frames }
    }

    /// Bytes of a frame: R, G, B, row by row.
    #[must_use]
    pub fn frame_bytes(&self) -> usize {
        self.width as usize * self.height as usize * 3
    }
}

/// How like two clips are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Likeness {
    /// Mean of the frames' PSNR, dB; a frame without error counts as 99.
    pub psnr: f64,
    /// Mean of the frames' SSIM.
    pub ssim: f64,
}

/// Compares two clips frame by frame; both hold R, G, B, row by row and frame by frame.
#[must_use]
pub fn compare(shape: Shape, a: &[u8], b: &[u8]) -> Likeness {
    let frames = || a.chunks(shape.frame_bytes().max(1)).zip(b.chunks(shape.frame_bytes().max(1)));
    let count = f64::from(shape.frames.max(1));
    Likeness {
        psnr: frames().map(|(a, b)| psnr(mean_squared_error(a, b))).sum::<f64>() / count,
        ssim: frames().map(|(a, b)| ssim(a, b, shape.width as usize)).sum::<f64>() / count,
    }
}

/// What exact rays see through the source image.
#[must_use]
pub fn exact(atlas: &Atlas) -> Vec<u8> {
    (0..atlas.gbuffer.frames).flat_map(|frame| exact_frame(atlas, frame)).collect()
}

/// The scene itself, antialiased.
#[must_use]
pub fn truth(scene: &Scene) -> Vec<u8> {
    let truth = Truth::new(scene);
    (0..scene.playback.frames).flat_map(|frame| truth.frame(frame)).collect()
}

/// What the player shows of a bundle of `frames` frames whose rows `draw` draws.
///
/// # Errors
/// The player refuses the bytes.
pub fn played(bytes: &[u8], frames: u32, draw: fn(&mut Player<'_, AnyTexels>, u32, &mut [u16])) -> Result<Vec<u8>> {
    let mut clip = Vec::new();
    play::visit_as::<AnyTexels>(bytes, 0..frames, |_, player| clip.extend(play::whole(player, draw).into_iter().flat_map(rgb)))?;
    Ok(clip)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn likeness_is_the_mean_over_frames() {
        let shape = Shape { width: 8, height: 8, frames: 2 };
        let a = vec![100; 2 * shape.frame_bytes()];
        let mut b = a.clone();
        assert_eq!(compare(shape, &a, &b), Likeness { psnr: 99.0, ssim: 1.0 });
        // One frame ten off: 28.13 dB, and the other perfect.
        b[..shape.frame_bytes()].fill(110);
        let found = compare(shape, &a, &b);
        assert!((found.psnr - (99.0 + 28.1308) / 2.0).abs() < 1e-3 && found.ssim < 1.0, "{found:?}");
    }
}
