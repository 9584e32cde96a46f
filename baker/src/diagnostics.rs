//! Pictures that show what a bake did: the source image, its covered texels, exact frames next to played ones.
//! A finished job comes in; PNG files go out.

use anyhow::Result;
use cubist_baker::atlas::SourceImage;
use cubist_baker::files::write_png;
use cubist_baker::job::Baked;
use cubist_baker::truth::spread;
use cubist_baker::verify;
use std::path::Path;

/// Frames shown exact and played.
const FRAMES: u32 = 3;
/// How much stronger than it is a difference is shown.
const GAIN: u8 = 4;
/// The colour of the charts' borders.
const BORDER: [u8; 3] = [255, 0, 255];

/// Writes into `folder`: source-image.png, mask.png, and for three frames and the worst one frame-NNNN-exact.png, frame-NNNN-played.png and
/// frame-NNNN-compare.png (exact, played, their difference four times as strong).
pub fn write(folder: &Path, baked: &Baked) -> Result<()> {
    let image = &baked.flat.atlas.image;
    write_png(&folder.join("source-image.png"), image.width, &bordered(image))?;
    let mask: Vec<u8> = image.covered.iter().flat_map(|&covered| if covered { [255; 3] } else { [0; 3] }).collect();
    write_png(&folder.join("mask.png"), image.width, &mask)?;
    let gbuffer = &baked.flat.atlas.gbuffer;
    let mut result = Ok(());
    let mut frames = spread(gbuffer.frames, FRAMES);
    frames.push(baked.report.quality.worst_frame);
    frames.sort_unstable();
    frames.dedup();
    verify::play(&baked.bundle, &frames, |frame, played| {
        let name = |kind: &str| folder.join(format!("frame-{frame:04}-{kind}.png"));
        let write = || {
            let exact = verify::exact_frame(&baked.flat.atlas, frame);
            write_png(&name("exact"), gbuffer.width, &exact)?;
            write_png(&name("played"), gbuffer.width, played)?;
            let difference: Vec<u8> = exact.iter().zip(played).map(|(a, b)| a.abs_diff(*b).saturating_mul(GAIN)).collect();
            write_png(&name("compare"), gbuffer.width * 3, &side_by_side(gbuffer.width, [&exact, played, &difference]))
        };
        if result.is_ok() {
            result = write();
        }
    })?;
    result
}

/// The source image; texels without a surface at half brightness, the labels' rectangles and the charts' outlines drawn over it.
fn bordered(image: &SourceImage) -> Vec<u8> {
    let (width, height) = (image.width as usize, image.height as usize);
    let mut out: Vec<[u8; 3]> = image
        .texels
        .iter()
        .zip(&image.covered)
        .map(|(&texel, &covered)| {
            let colour = image.palette.get(usize::from(texel)).copied().unwrap_or_default();
            if covered { colour } else { colour.map(|v| v / 2) }
        })
        .collect();
    let covered = |x: usize, y: usize| x < width && y < height && image.covered[y * width + x];
    for y in 0..height {
        for x in 0..width {
            // A texel outside a chart with one inside beside it: the outline lies outside what is shown.
            let beside = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
            if !covered(x, y) && beside.iter().any(|&(x, y)| covered(x, y)) {
                out[y * width + x] = BORDER;
            }
        }
    }
    out.concat()
}

/// Three pictures of `width` pixels a row as one.
fn side_by_side(width: u32, pictures: [&[u8]; 3]) -> Vec<u8> {
    let row = (width as usize * 3).max(1);
    let rows = pictures[0].len() / row;
    (0..rows).flat_map(|y| pictures.iter().flat_map(move |picture| &picture[y * row..(y + 1) * row])).copied().collect()
}
