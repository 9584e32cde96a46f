//! A frame's rays in the source image: where its pixels fall, and the key-ray grid as the surfaces bend it.
//! The G-buffer comes from a finished job; pictures go to `diagnostics`, which writes them.

use super::{Picture, SIDE};
use cubist_baker::bake::Flat;
use cubist_baker::tears::{DOWN, RIGHT};
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, PremultipliedColorU8, Stroke, Transform};

/// The source image is shown at this share of its brightness, in 256ths: rays stand out.
const DIM: u16 = 120;
/// The colour of rays, and the share of it that is seen where they lie too close for dots of their own, in 256ths.
const DOT: [u8; 3] = [0, 208, 255];
const DOT_SHARE: u16 = 176;
/// The radius of a node's mark and the width of a line, pixels.
const NODE: f32 = 3.0;
const LINE: f32 = 1.6;

/// The source image, dimmed; a dot for each ray of `frame`, and the rays at the corners of cells of `cell` pixels as nodes, with a line between
/// neighbours that see the same surface all along.
pub fn draw(flat: &Flat, frame: u32, cell: u32) -> Picture {
    let (image, gbuffer) = (&flat.atlas.image, &flat.atlas.gbuffer);
    let (width, height, cell) = (gbuffer.width as usize, gbuffer.height as usize, cell.max(1) as usize);
    let first = frame as usize * width * height;
    let dimmed = |&texel: &u16| {
        let colour = image.palette.get(usize::from(texel)).copied().unwrap_or_default();
        colour.map(|v| (u16::from(v) * DIM / 256) as u8)
    };
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
    let (mut lines, mut nodes) = (PathBuilder::new(), PathBuilder::new());
    for y in (0..height).step_by(cell) {
        for x in (0..width).step_by(cell) {
            let pixel = first + y * width + x;
            let [u, v] = place(pixel);
            nodes.push_circle(u, v, NODE);
            for (bit, step, inside) in [(RIGHT, 1, x + cell < width), (DOWN, width, y + cell < height)] {
                let same = |i: usize| {
                    let at = pixel + i * step;
                    gbuffer.label[at] == gbuffer.label[at + step] && flat.tears[at] & bit == 0
                };
                if inside && (0..cell).all(same) {
                    let [s, t] = place(pixel + cell * step);
                    lines.move_to(u, v);
                    lines.line_to(s, t);
                }
            }
        }
    }
    over(&mut picture, |pixmap| {
        let mut paint = Paint { anti_alias: true, ..Paint::default() };
        paint.set_color(Color::from_rgba8(255, 214, 0, 255));
        if let Some(path) = lines.finish() {
            pixmap.stroke_path(&path, &paint, &Stroke { width: LINE, ..Stroke::default() }, Transform::identity(), None);
        }
        paint.set_color(Color::from_rgba8(255, 64, 32, 255));
        if let Some(path) = nodes.finish() {
            pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    });
    picture
}

/// Draws over a picture; one too large to draw on stays as it is.
fn over(picture: &mut Picture, draw: impl FnOnce(&mut Pixmap)) {
    let Some(mut pixmap) = Pixmap::new(SIDE, picture.height()) else { return };
    for (to, &[r, g, b]) in pixmap.pixels_mut().iter_mut().zip(&picture.pixels) {
        if let Some(opaque) = PremultipliedColorU8::from_rgba(r, g, b, 255) {
            *to = opaque;
        }
    }
    draw(&mut pixmap);
    for (to, from) in picture.pixels.iter_mut().zip(pixmap.pixels()) {
        *to = [from.red(), from.green(), from.blue()];
    }
}
