//! The test card's scene: a picture drawn here, shown behind the one triangle that a scene must have, the head of the arrow. The baker makes a bundle
//! of it that the Pico's firmware has built in; `run` holds the two that are committed against it.
//!
//! From the top: an arrow to the corner that is TOP LEFT; bars of white, yellow, cyan, green, magenta, red, blue and black, each with the
//! letter it is called by; greys from black to white; and a patch that is green where bytes arrive in order and red where they are swapped. A line
//! of one pixel runs along the display's edges.

use crate::font;
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::Path;

type Colour = [u8; 3];
const WHITE: Colour = [255, 255, 255];
const BLACK: Colour = [0, 0, 0];
const GROUND: Colour = [24, 28, 41];
/// RGB565 0x07e0; with its bytes swapped 0xe007, a red.
const PATCH: Colour = [0, 255, 0];

/// The bars and the letters on them.
const BARS: [(Colour, char); 8] = [
    (WHITE, 'W'),
    ([255, 255, 0], 'Y'),
    ([0, 255, 255], 'C'),
    ([0, 255, 0], 'G'),
    ([255, 0, 255], 'M'),
    ([255, 0, 0], 'R'),
    ([0, 0, 255], 'B'),
    (BLACK, 'K'),
];

const SCENE: &str = "# The Pico's test card; `cubist-mcu card` writes it.
[scene]
model = \"arrow.obj\"
background = \"card.png\"

[camera]
fov = 45.0
line = { from = [0, 0, 0], to = [0, 0, -0.001], look = [0, 0, -1] }

[playback]
size = [WIDTH, HEIGHT]
frames = 1
fps = 30
looping = false
";
/// Half the height of what the camera sees a unit away: the tangent of half of `fov`.
const HALF: f64 = std::f64::consts::SQRT_2 - 1.0;

struct Picture {
    width: usize,
    pixels: Vec<Colour>,
}

impl Picture {
    fn new(width: usize, height: usize, colour: Colour) -> Self {
        Self { width, pixels: vec![colour; width * height] }
    }

    fn fill(&mut self, [left, top, width, height]: [usize; 4], colour: Colour) {
        for row in self.pixels.chunks_exact_mut(self.width).skip(top).take(height) {
            row.iter_mut().skip(left).take(width).for_each(|pixel| *pixel = colour);
        }
    }

    /// `text` from (left, top), dots of `dot` pixels; its width comes back.
    fn write(&mut self, text: &str, [left, top]: [usize; 2], dot: usize, colour: Colour) -> usize {
        let step = (font::SIZE.0 + 1) * dot;
        for (place, letter) in text.chars().enumerate() {
            for (y, bits) in font::letter(letter).into_iter().enumerate() {
                for x in (0..font::SIZE.0).filter(|x| bits >> (font::SIZE.0 - 1 - x) & 1 == 1) {
                    self.fill([left + place * step + x * dot, top + y * dot, dot, dot], colour);
                }
            }
        }
        text.chars().count() * step
    }
}

/// The arrow's head, as a model in front of a camera at the origin: the corner at (8, 8), with sides of 20 pixels.
fn arrow(width: u32, height: u32) -> String {
    let mut model = String::from("mtllib arrow.mtl\nusemtl white\n");
    for (x, y) in [(8, 8), (8, 28), (28, 8)] {
        let place = |pixel: u32, side: u32| (2.0 * f64::from(pixel) - f64::from(side)) / f64::from(height) * HALF;
        model += &format!("v {:.6} {:.6} -1\n", place(x, width), -place(y, height));
    }
    model + "f 1 2 3\n"
}

fn draw(width: usize, height: usize) -> Picture {
    let mut card = Picture::new(width, height, WHITE);
    card.fill([1, 1, width - 2, height - 2], GROUND);
    // The arrow's shaft; its head is the model.
    for along in 8..40 {
        card.fill([along, along, 7, 7], WHITE);
    }
    card.write("TOP LEFT", [58, 16], 3, WHITE);

    let (bars, top, deep) = (width - 16, 58, height * 5 / 16);
    for (index, &(colour, name)) in BARS.iter().enumerate() {
        let (left, right) = (8 + bars * index / BARS.len(), 8 + bars * (index + 1) / BARS.len());
        card.fill([left, top, right - left, deep], colour);
        // Bright bars have dark letters.
        let bright = colour.iter().map(|&part| u32::from(part)).sum::<u32>() > 255 || colour == PATCH;
        card.write(&name.to_string(), [left + (right - left) / 2 - 7, top + deep - 28], 3, if bright { BLACK } else { WHITE });
    }

    let top = top + deep + 8;
    for grey in 0..16 {
        let (left, right) = (8 + bars * grey / 16, 8 + bars * (grey + 1) / 16);
        card.fill([left, top, right - left, 20], [(grey * 17) as u8; 3]);
    }

    let top = top + 28;
    let (side, room) = (height - 8 - top, width - 16);
    card.fill([8, top, side, side], PATCH);
    let left = 8 + side + 10;
    card.fill([left - 5, top, room - side - 5, side], BLACK);
    let spaced = side / 3;
    for (line, text) in ["GREEN IS OK", "RED IS SWAPPED", "BYTES"].into_iter().enumerate() {
        card.write(text, [left, top + spaced * line + (spaced.saturating_sub(14)) / 2], if width < 300 && line < 2 { 1 } else { 2 }, WHITE);
    }
    card
}

/// Writes the scene for a display of `size`, `WIDTHxHEIGHT`, into the folder `out`.
///
/// # Errors
/// A size that is none or too small for the card, a folder that cannot be written.
pub fn write(size: &str, out: &Path) -> Result<()> {
    let parsed = size.split_once('x').and_then(|(width, height)| Some((width.parse::<u32>().ok()?, height.parse::<u32>().ok()?)));
    let (width, height) = parsed.with_context(|| format!("{size}: expected WIDTHxHEIGHT"))?;
    ensure!((240..=1024).contains(&width) && (240..=1024).contains(&height), "{size}: the card takes 240 to 1024 pixels a side");
    let card = draw(width as usize, height as usize);
    fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let file = fs::File::create(out.join("card.png")).with_context(|| out.join("card.png").display().to_string())?;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(card.pixels.as_flattened())?;
    fs::write(out.join("arrow.obj"), arrow(width, height))?;
    fs::write(out.join("arrow.mtl"), "newmtl white\nKd 1 1 1\n")?;
    let scene = SCENE.replace("WIDTH", &width.to_string()).replace("HEIGHT", &height.to_string());
    fs::write(out.join("card.toml"), scene).with_context(|| out.display().to_string())
}
