//! A frame's rays in the source image: where its pixels fall, and the key-ray grid as the surfaces bend it.
//! The G-buffer comes from a finished job; pictures go to `diagnostics`, which writes them.

use super::picture::{Picture, SIDE};
use cubist_baker::bake::Flat;
use cubist_baker::tears::{DOWN, RIGHT};

/// The source image is shown at this share of its brightness, in 256ths: rays stand out.
const DIM: u16 = 120;
/// The colour of rays, and the share of it that is seen where they lie too close for dots of their own, in 256ths.
const DOT: [u8; 3] = [0, 208, 255];
const DOT_SHARE: u16 = 176;
/// The radius of a node's mark and half the width of a line, pixels.
const NODE: f32 = 3.0;
const LINE: f32 = 0.8;
/// The colours of both.
const NODES: [u8; 3] = [255, 64, 32];
const LINES: [u8; 3] = [255, 214, 0];

/// The source image, dimmed; a dot for each ray of `frame`, and the rays at the corners of cells of `cell` pixels as nodes, with a line between
/// neighbours that see the same surface all along.
pub fn draw(flat: &Flat, frame: u32, cell: u32) -> Picture {
    let (image, gbuffer) = (&flat.atlas.image, &flat.atlas.gbuffer);
    let (width, height, cell) = (gbuffer.width as usize, gbuffer.height as usize, cell.max(1) as usize);
    let first = frame as usize * width * height;
    let dimmed = |&texel: &u16| image.colour(texel).map(|v| (u16::from(v) * DIM / 256) as u8);
    let mut picture = Picture::enlarged(&image.texels.iter().map(dimmed).collect::<Vec<_>>(), image.width);
    let scale = SIDE / image.width;
    let place = |pixel: usize| gbuffer.uv[pixel].map(|v| v * scale as f32);
    let dot = (scale / 2).max(1) as usize;
    for pixel in first..first + width * height {
        let [x, y] = place(pixel).map(|v| v as usize);
        for row in picture.pixels.chunks_mut(SIDE as usize).skip(y).take(dot) {
            for under in row.iter_mut().skip(x).take(dot) {
                *under = std::array::from_fn(|k| ((u16::from(under[k]) * (256 - DOT_SHARE) + u16::from(DOT[k]) * DOT_SHARE) / 256) as u8);
            }
        }
    }
    let (mut lines, mut nodes) = (Vec::new(), Vec::new());
    for y in (0..height).step_by(cell) {
        for x in (0..width).step_by(cell) {
            let pixel = first + y * width + x;
            nodes.push(place(pixel));
            for (bit, step, inside) in [(RIGHT, 1, x + cell < width), (DOWN, width, y + cell < height)] {
                let same = |i: usize| {
                    let at = pixel + i * step;
                    gbuffer.label[at] == gbuffer.label[at + step] && flat.tears[at] & bit == 0
                };
                if inside && (0..cell).all(same) {
                    lines.push([place(pixel), place(pixel + cell * step)]);
                }
            }
        }
    }
    for [from, to] in lines {
        stroke(&mut picture, from, to, LINE, LINES);
    }
    for node in nodes {
        stroke(&mut picture, node, node, NODE, NODES);
    }
    picture
}

/// Colours what lies within `radius` of the line between two points, with a soft edge a pixel wide.
fn stroke(picture: &mut Picture, from: [f32; 2], to: [f32; 2], radius: f32, colour: [u8; 3]) {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    let reach = |axis: usize, size: u32| {
        let (low, high) = (from[axis].min(to[axis]) - radius - 1.0, from[axis].max(to[axis]) + radius + 1.0);
        (low.max(0.0) as usize)..(high.max(0.0) as usize + 1).min(size as usize)
    };
    for y in reach(1, picture.height()) {
        for x in reach(0, SIDE) {
            let point = [x as f32 + 0.5 - from[0], y as f32 + 0.5 - from[1]];
            let share = if length > 0.0 { ((point[0] * along[0] + point[1] * along[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
            let off = [point[0] - share * along[0], point[1] - share * along[1]];
            let opacity = (radius + 0.5 - (off[0] * off[0] + off[1] * off[1]).sqrt()).clamp(0.0, 1.0);
            let under = &mut picture.pixels[y * SIDE as usize + x];
            *under = std::array::from_fn(|k| (f32::from(under[k]) * (1.0 - opacity) + f32::from(colour[k]) * opacity).round() as u8);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_as_wide_as_asked_and_stays_within_the_picture() {
        let mut picture = Picture { pixels: vec![[0; 3]; SIDE as usize * 8] };
        stroke(&mut picture, [-5.0, 4.0], [20.0, 4.0], 2.0, [200; 3]);
        stroke(&mut picture, [SIDE as f32 + 3.0, 90.0], [SIDE as f32 + 9.0, 95.0], 3.0, [200; 3]);
        let column: Vec<u8> = picture.pixels.chunks(SIDE as usize).map(|row| row[10][0]).collect();
        assert_eq!(column, [0, 0, 200, 200, 200, 200, 0, 0]);
        assert!(picture.pixels.chunks(SIDE as usize).all(|row| row[30..].iter().all(|&p| p == [0; 3])));
    }
}
