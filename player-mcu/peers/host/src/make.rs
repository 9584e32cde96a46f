//! What the peers play, made of the truth's frames and of a bundle, and what they must show, made by the same decoders. Files go to the firmware's
//! build, sums and PSNR to `figures`.

use crate::decode;
use crate::figures::{Expected, decibels};
use crate::raster::{self, Corner, Mesh, VERTICES};
use crate::screen::{HEIGHT, PIXELS, WIDTH, cut, nearest, psnr, sum};
use crate::warp::{self, Cells, NODE_ROWS, NODES};
use anyhow::{Context, Result, anyhow, ensure};
use cubist_core::{Bundle, Frame, Player};
use embedded_graphics_core::pixelcolor::{IntoStorage, Rgb565, Rgb888};
use image::codecs::gif::GifEncoder;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, RgbaImage};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Frames that the warp plays.
const WARP_FRAMES: usize = 16;

/// Makes everything into `folder`.
///
/// # Errors
/// Files that cannot be read or written, or are not what they should be.
pub fn all([truth, mesh, bundle]: [&Path; 3], frames: u32, folder: &Path) -> Result<()> {
    let rgb = fs::read(truth).with_context(|| truth.display().to_string())?;
    let truth: Vec<&[u8]> = rgb.chunks_exact(3 * PIXELS).collect();
    ensure!(!truth.is_empty(), "no frame of {WIDTH} x {HEIGHT} pixels in the truth");
    let bytes = fs::read(bundle).with_context(|| bundle.display().to_string())?;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let write = |name: &str, content: &[u8]| fs::write(folder.join(name), content).with_context(|| folder.join(name).display().to_string());
    let mut expected = BTreeMap::new();

    let raw: Vec<Vec<u16>> = truth.iter().map(|frame| frame.as_chunks().0.iter().map(|&rgb| nearest(rgb)).collect()).collect();
    write("frames.raw", &raw.iter().flatten().flat_map(|pixel| pixel.to_le_bytes()).collect::<Vec<u8>>())?;
    expected.insert("copy", Expected::of(&raw, &raw, &truth, 2 * PIXELS * raw.len(), "copied frames, RGB565"));

    let [played, cubist] = played(&bytes, frames, truth.len())?;
    write("clip.cubist", &bytes)?;
    let cubist = Expected::of(&played, &cubist, &truth, bytes.len(), "**Cubist**");
    let asked = cubist.psnr_db.context("a frame at least")?;
    expected.insert("cubist", cubist);

    let content = fs::read(mesh).with_context(|| mesh.display().to_string())?;
    write("scene.mesh", &content)?;
    let words: Vec<i32> = content.as_chunks().0.iter().map(|&word| i32::from_le_bytes(word)).collect();
    let scene = Mesh::new(&words).with_context(|| format!("{}: no triangles", mesh.display()))?;
    let drawn = rasterised(&scene);
    let compared: Vec<Vec<u16>> = drawn.iter().step_by(drawn.len().div_ceil(truth.len())).cloned().collect();
    ensure!(drawn.len() == frames as usize && compared.len() == truth.len(), "{} cameras for {frames} frames", drawn.len());
    let what = format!("a live rasteriser of {} triangles", scene.triangles.len());
    expected.insert("raster", Expected::of(&drawn, &compared, &truth, content.len(), &what));

    let (content, pictures) = warp();
    write("warp.raw", &content)?;
    let of_frame = content.len() - (1 << 16) - 512;
    let what = "a bare warp of 8-pixel cells, no scene";
    expected.insert("warp", Expected::of(&pictures, &[], &[], of_frame, what));

    let file = gif(&truth)?;
    write("clip.gif", &file)?;
    let decoded = decode::gif(&file)?;
    let shown =
        |how: fn([u8; 3]) -> u16| decoded.iter().map(|frame| frame.iter().map(|&rgb| how(rgb)).collect()).collect::<Vec<Vec<u16>>>();
    let pictures = shown(|[r, g, b]| Rgb565::from(Rgb888::new(r, g, b)).into_storage());
    expected.insert("gif_tiny", Expected::of(&pictures, &pictures, &truth, file.len(), "GIF by tinygif 0.0.4"));
    let pictures = shown(cut);
    expected.insert("gif_weezl", Expected::of(&pictures, &pictures, &truth, file.len(), "GIF by weezl 0.1"));

    let (quality, files) = jpeg(&truth, asked)?;
    write("clip.mjpeg", &files.iter().flat_map(|file| [&(file.len() as u32).to_le_bytes()[..], file].concat()).collect::<Vec<u8>>())?;
    let bytes = files.iter().map(Vec::len).sum();
    let [streams, pictures] = tjpgd(&files)?;
    let what = |by: &str| format!("JPEG 4:4:4, quality {quality}, by {by}");
    expected.insert("jpeg_tjpgd", Expected::of(&streams, &pictures, &truth, bytes, &what("tjpgdec-rs 0.4")));
    let pictures = files.iter().map(|file| decode::zune(file)).collect::<Result<Vec<_>>>()?;
    expected.insert("jpeg_zune", Expected::of(&pictures, &pictures, &truth, bytes, &what("zune-jpeg 0.5")));

    for (player, expected) in &expected {
        println!(
            "{player:<11} {:8.0} bytes a frame{}",
            expected.content_bytes as f64 / expected.sums.len() as f64,
            decibels(expected.psnr_db)
        );
    }
    write("expected.json", serde_json::to_string(&expected)?.as_bytes())
}

/// Every frame of a bundle, and those of them that the truth has.
fn played(bytes: &[u8], frames: u32, truth: usize) -> Result<[Vec<Vec<u16>>; 2]> {
    let bundle = Bundle::parse(bytes).map_err(|error| anyhow!("{error}"))?;
    ensure!(
        bundle.size() == (WIDTH as u32, HEIGHT as u32) && bundle.frames() == frames,
        "a bundle of {frames} frames of {WIDTH} x {HEIGHT} is wanted"
    );
    let mut memory = vec![0; bundle.memory_needed()];
    let mut player = Player::new(&bundle, &mut memory).map_err(|error| anyhow!("{error}"))?;
    let mut played = Vec::new();
    for frame in 0..frames {
        let mut picture = vec![0; PIXELS];
        player.seek(Frame(frame));
        (0..).zip(picture.chunks_exact_mut(WIDTH)).for_each(|(y, row)| player.row(y, row));
        played.push(picture);
    }
    let every = (frames as usize).div_ceil(truth);
    let compared: Vec<Vec<u16>> = played.iter().step_by(every).cloned().collect();
    ensure!(compared.len() == truth, "{truth} frames of the truth are not every {every}th of {frames}");
    Ok([played, compared])
}

/// Every frame of a scene as the rasteriser draws it.
fn rasterised(scene: &Mesh<'_>) -> Vec<Vec<u16>> {
    let (mut seen, mut frame) = (Box::new([Corner::NEW; VERTICES]), Box::new(raster::Frame::NEW));
    let draw = |camera| {
        scene.draw(camera, &mut seen, &mut frame);
        frame.colour.as_flattened().to_vec()
    };
    scene.cameras.iter().map(draw).collect()
}

/// Texture, palette and nodes of a picture that turns and swells, and its frames.
fn warp() -> (Vec<u8>, Vec<Vec<u16>>) {
    let mut texels = [0; 1 << 16];
    // Whatever is not flat: what a texel is makes no difference to what it costs.
    texels.iter_mut().enumerate().for_each(|(i, texel)| *texel = (((i >> 8) * (i & 255)) >> 6) as u8);
    let palette: [u16; 256] = std::array::from_fn(|i| cut([i as u8, 255 - i as u8, (i * 7) as u8]));
    let mut content = texels.to_vec();
    content.extend(palette.iter().flat_map(|colour| colour.to_le_bytes()));
    let mut pictures = Vec::new();
    for frame in 0..WARP_FRAMES {
        let turn = frame as f64 * 0.1;
        let node = |x: f64, y: f64| {
            let (x, y) = ((x - 20.0) * (1.0 + 0.01 * y), y - 15.0);
            // Positions stay inside of the texture; 8.8 each.
            let [u, v] = [x * turn.cos() - y * turn.sin(), x * turn.sin() + y * turn.cos()].map(|at| ((128.0 + 3.0 * at) * 256.0) as u32);
            u << 16 | v
        };
        let rows: Vec<[u32; NODES]> = (0..NODE_ROWS).map(|y| std::array::from_fn(|x| node(x as f64, y as f64))).collect();
        content.extend(rows.iter().flatten().flat_map(|node| node.to_le_bytes()));
        let mut picture = Vec::with_capacity(PIXELS);
        for pair in rows.windows(2) {
            let (mut cells, mut out) = (Cells::NEW, [0; 160]);
            warp::set_up(&pair[0], &pair[1], &mut cells);
            for _ in 0..8 {
                warp::row(&mut cells, &texels, &palette, &mut out);
                picture.extend(out.iter().flat_map(|&two| [two as u16, (two >> 16) as u16]));
            }
        }
        pictures.push(picture);
    }
    (content, pictures)
}

/// A GIF of whole frames, each with its own 256 colours.
fn gif(truth: &[&[u8]]) -> Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut encoder = GifEncoder::new_with_speed(&mut file, 10);
    for frame in truth {
        let rgba: Vec<u8> = frame.as_chunks::<3>().0.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        let picture = RgbaImage::from_raw(WIDTH as u32, HEIGHT as u32, rgba).context("a frame of another size")?;
        encoder.encode_frame(image::Frame::new(picture)).context("encode a GIF")?;
    }
    drop(encoder);
    Ok(file)
}

/// The JPEG pictures whose mean PSNR is nearest to `asked`, and their quality.
fn jpeg(truth: &[&[u8]], asked: f64) -> Result<(u8, Vec<Vec<u8>>)> {
    let mut best: Option<(f64, u8, Vec<Vec<u8>>)> = None;
    let (mut low, mut high) = (1, 100);
    // PSNR goes up with quality, so that halving finds both neighbours of what is asked for.
    while low <= high {
        let quality = low + (high - low) / 2;
        let encode = |frame: &&[u8]| -> Result<Vec<u8>> {
            let mut file = Vec::new();
            JpegEncoder::new_with_quality(&mut file, quality).encode(frame, WIDTH as u32, HEIGHT as u32, ExtendedColorType::Rgb8)?;
            Ok(file)
        };
        let files = truth.iter().map(encode).collect::<Result<Vec<_>>>()?;
        let [_, pictures] = tjpgd(&files)?;
        let reached = mean(pictures.iter().zip(truth).map(|(picture, truth)| psnr(picture, truth)));
        if reached < asked {
            low = quality + 1;
        } else {
            high = quality - 1;
        }
        if best.as_ref().is_none_or(|(off, ..)| (reached - asked).abs() < *off) {
            best = Some(((reached - asked).abs(), quality, files));
        }
    }
    best.map(|(_, quality, files)| (quality, files)).context("no quality")
}

fn tjpgd(files: &[Vec<u8>]) -> Result<[Vec<Vec<u16>>; 2]> {
    let mut all = [Vec::new(), Vec::new()];
    for file in files {
        let [stream, picture] = decode::tjpgd(file)?;
        all[0].push(stream);
        all[1].push(picture);
    }
    Ok(all)
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

impl Expected {
    /// Of what comes out of a player pixel by pixel, and of what then stands on the screen in the frames that the truth has.
    fn of(streams: &[Vec<u16>], pictures: &[Vec<u16>], truth: &[&[u8]], content_bytes: usize, what: &str) -> Self {
        let psnr_db = (!truth.is_empty()).then(|| mean(pictures.iter().zip(truth).map(|(picture, truth)| psnr(picture, truth))));
        let sums = streams.iter().map(|pixels| sum(pixels.iter().copied())).collect();
        Self { what: what.to_owned(), sums, psnr_db, content_bytes: content_bytes as u64 }
    }
}
