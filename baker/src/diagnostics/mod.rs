//! Pictures that show what a bake did: the source image, what of it is covered, seen and how finely; frames exact, played, and as rays in it.
//! A finished job comes in; PNG files go out.

mod maps;
mod picture;
mod rays;
mod texels;

use anyhow::{Context, Result};
use cubist_baker::atlas::SourceImage;
use cubist_baker::files::write_png;
use cubist_baker::job::Baked;
use cubist_baker::scene::Scene;
use cubist_baker::truth::{Truth, spread};
use cubist_baker::verify;
use std::path::Path;

/// What is shown of a frame: what the names of its pictures end in.
const KINDS: [&str; 5] = ["exact", "played", "compare", "rays", "scene"];
/// Frames shown exact and played.
const FRAMES: u32 = 3;
/// How much stronger than it is a difference is shown.
const GAIN: u8 = 4;
/// The colour of the charts' borders.
const BORDER: [u8; 3] = [255, 0, 255];
/// Writes into `folder`: source-image.png, mask.png, never-seen.png and density.png; for three frames and the worst one frame-NNNN-exact.png,
/// frame-NNNN-played.png, frame-NNNN-compare.png (exact, played, their difference four times as strong), frame-NNNN-rays.png and frame-NNNN-scene.png: the
/// antialiased `scene`, which knows nothing of the source image's colours. Pictures of other frames, which an earlier bake left there, are removed.
pub fn write(folder: &Path, scene: &Scene, baked: &Baked) -> Result<()> {
    let (flat, report) = (&baked.flat, &baked.report);
    let image = &flat.atlas.image;
    write_png(&folder.join("source-image.png"), image.width, &bordered(image))?;
    let mask: Vec<u8> = image.covered.iter().flat_map(|&covered| if covered { [255; 3] } else { [0; 3] }).collect();
    write_png(&folder.join("mask.png"), image.width, &mask)?;
    let seen = texels::seen(flat);
    maps::never_seen(image, &texels::never_seen(flat, &seen)).write(&folder.join("never-seen.png"))?;
    let asked = report.source_image.density * report.source_image.scale;
    maps::density(image, &seen, asked).write(&folder.join("density.png"))?;
    let gbuffer = &flat.atlas.gbuffer;
    let truth = Truth::new(scene);
    let mut result = Ok(());
    let mut frames = spread(gbuffer.frames, FRAMES);
    frames.push(report.quality.worst_frame);
    frames.sort_unstable();
    frames.dedup();
    verify::play(&baked.bundle, &frames, |frame, played| {
        let [exact_name, played_name, compare_name, rays_name, scene_name] = KINDS.map(|kind| folder.join(name(frame, kind)));
        let write = || {
            let exact = verify::exact_frame(&flat.atlas, frame);
            write_png(&exact_name, gbuffer.width, &exact)?;
            write_png(&played_name, gbuffer.width, played)?;
            let difference: Vec<u8> = exact.iter().zip(played).map(|(a, b)| a.abs_diff(*b).saturating_mul(GAIN)).collect();
            write_png(&compare_name, gbuffer.width * 3, &side_by_side(gbuffer.width, [&exact, played, &difference]))?;
            write_png(&scene_name, gbuffer.width, &truth.frame(frame))?;
            rays::draw(flat, frame, report.grid.cell).write(&rays_name)
        };
        if result.is_ok() {
            result = write();
        }
    })?;
    result.and_then(|()| remove_others(folder, &frames))
}

/// What the picture of that `kind` of a frame is called.
fn name(frame: u32, kind: &str) -> String {
    format!("frame-{frame:04}-{kind}.png")
}

/// The frame whose picture has this name.
fn frame_of(file: &str) -> Option<u32> {
    let (frame, _) = file.strip_prefix("frame-")?.split_once('-')?;
    let frame = frame.parse().ok()?;
    // Numbers are written in other ways, too, but not by us.
    KINDS.iter().any(|kind| name(frame, kind) == file).then_some(frame)
}

/// Removes the pictures of other frames than `frames` from `folder`.
fn remove_others(folder: &Path, frames: &[u32]) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("{}: the folder cannot be read", folder.display()))?.flatten() {
        let other = entry.file_name().to_str().and_then(frame_of).is_some_and(|frame| !frames.contains(&frame));
        if other && entry.file_type().is_ok_and(|kind| kind.is_file()) {
            let path = entry.path();
            std::fs::remove_file(&path).with_context(|| format!("{}: the picture of an earlier bake cannot be removed", path.display()))?;
        }
    }
    Ok(())
}

/// The source image; texels without a surface at half brightness, the labels' rectangles and the charts' outlines drawn over it.
fn bordered(image: &SourceImage) -> Vec<u8> {
    let (width, height) = (image.width as usize, image.height as usize);
    let mut out: Vec<[u8; 3]> = image
        .texels
        .iter()
        .zip(image.covered.iter())
        .map(|(&texel, &covered)| {
            let colour = image.colour(texel);
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

#[cfg(test)]
mod tests {
    use super::picture::SIDE;
    use super::*;
    use cubist_baker::metrics;
    use cubist_baker::scene::builtin;
    use cubist_baker::{Options, TruthFrames, job};

    #[test]
    fn pictures_have_their_sizes_and_show_what_was_never_seen() {
        let mut scene = builtin::build("columns").expect("a built-in scene");
        (scene.playback.width, scene.playback.height, scene.playback.frames) = (64, 48, 5);
        let baked = job::run(&scene, &Options { truth: TruthFrames::None, ..Options::default() }, &|_, _| {}).expect("a bundle");
        let folder = tempfile::tempdir().expect("a folder");
        let earlier = folder.path().join(name(5, "exact"));
        std::fs::write(&earlier, "earlier").expect("a file");
        write(folder.path(), &scene, &baked).expect("pictures");
        assert!(!earlier.exists(), "there are five frames");
        let image = &baked.flat.atlas.image;
        let tall = image.height * SIDE / image.width;
        let mut sizes = vec![
            ("source-image".to_owned(), [image.width, image.height]),
            ("mask".to_owned(), [image.width, image.height]),
            ("never-seen".to_owned(), [SIDE, tall]),
            ("density".to_owned(), [SIDE, tall + maps::LEGEND]),
        ];
        for frame in [0, 2, 4] {
            let kinds = [("exact", [64, 48]), ("played", [64, 48]), ("compare", [192, 48]), ("rays", [SIDE, tall]), ("scene", [64, 48])];
            sizes.extend(kinds.map(|(kind, size)| (format!("frame-{frame:04}-{kind}"), size)));
        }
        let open = |name: &str| image::open(folder.path().join(format!("{name}.png"))).expect(name).into_rgb8();
        for (name, size) in sizes {
            let picture = open(&name);
            assert_eq!([picture.width(), picture.height()], size, "{name}");
        }
        // Of one scene, but not of the same colours.
        let [exact, truth] = ["exact", "scene"].map(|kind| open(&format!("frame-0002-{kind}")));
        let off = metrics::psnr(metrics::mean_squared_error(&exact, &truth));
        assert!((20.0..50.0).contains(&off), "{off} dB");
        // Counted from the G-buffer alone.
        let mut hidden = image.covered.to_vec();
        for uv in baked.flat.atlas.gbuffer.uv.iter() {
            hidden[uv[1] as usize * image.width as usize + uv[0] as usize] = false;
        }
        let never = hidden.iter().filter(|&&hidden| hidden).count();
        let shown = open("never-seen").pixels().filter(|pixel| pixel.0 == maps::NEVER).count();
        let square = (SIDE / image.width).pow(2) as usize;
        assert!(never > 0 && shown == never * square, "{never} texels are never seen, {shown} pixels of {square} a texel say so");
    }

    #[test]
    fn pictures_of_other_frames_are_removed_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let files = [
            ("frame-0001-exact.png", false),
            ("frame-0002-compare.png", true),
            ("frame-12345-rays.png", false),
            ("frame-7-exact.png", true),
            ("frame-+007-exact.png", true),
            ("frame-00007-exact.png", true),
            ("frame-0007-mine.png", true),
            ("frame-0007.png", true),
            ("frame-0007-exact.png.bak", true),
            ("frame-99999999999-exact.png", true),
        ];
        for (name, _) in files {
            std::fs::write(folder.path().join(name), "earlier").expect(name);
        }
        std::fs::create_dir(folder.path().join("frame-0008-exact.png")).expect("a folder");
        remove_others(folder.path(), &[0, 2, 4]).expect("removed");
        for (name, kept) in files.into_iter().chain([("frame-0008-exact.png", true)]) {
            assert_eq!(folder.path().join(name).exists(), kept, "{name}");
        }
    }
}
