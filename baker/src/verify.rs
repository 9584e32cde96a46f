//! Verification: the finished bytes, played by the real player, against exact ray casting and against the truth.
//! Bytes come from `encode`, exact positions from the G-buffer, the truth from [`Truth`]; figures go to the report.
//!
//! Frames are played and compared one at a time: memory does not grow with the path. Sums run in the order of frames,
//! so the figures do not depend on the number of threads.

use crate::atlas::{Atlas, Label, SourceImage};
use crate::gbuffer::{GBuffer, difference, size};
use crate::metrics::{self, Histogram};
use crate::truth::Truth;
use cubist_core::fixed::{PLAY_BITS, PlayUv};
use cubist_core::{AnyTexels, Bundle, Frame, Player, Probe};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;
use thiserror::Error;

/// Frames that one player plays in a row while others play the rest.
const RUN: u32 = 16;
/// Likewise of frames far apart: a player that is new to a path decodes all that leads to the frame, and unpacks a packed picture first.
const FAR_RUN: usize = 8;

/// Why a finished bundle cannot be verified: always the baker's fault.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum VerifyError {
    /// The player refuses the bytes.
    #[error("the finished bundle is refused by the player: {0}")]
    Refused(#[from] cubist_core::BundleError),
    /// The player refuses the memory it asked for.
    #[error("the finished bundle states less working memory than it needs: {0}")]
    Memory(#[from] cubist_core::MemoryError),
    /// The bundle shows something else than the scene asks for.
    #[error("the finished bundle shows {found:?} (width, height, frames), expected {expected:?}")]
    Shape {
        /// Width, height, frames of the G-buffer.
        expected: [u32; 3],
        /// Those of the bundle.
        found: [u32; 3],
    },
}

/// Distances between played and exact positions, texels, the larger of |du| and |dv|; over pixels of the right surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PathError {
    /// Half of the pixels are not farther off.
    pub p50: f64,
    /// 99 % of the pixels are not farther off.
    pub p99: f64,
    /// The worst pixel.
    pub max: f64,
}

/// Playback against exact ray casting of every pixel of every frame through the same source image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Mean of the frames' PSNR, dB, as [`metrics::mean_psnr`] has it.
    pub psnr_mean: f64,
    /// The worst frame's, dB.
    pub psnr_min: f64,
    /// The first frame of that PSNR.
    pub worst_frame: u32,
    /// Mean of the frames' SSIM.
    pub ssim_mean: f64,
    /// Mean of the frames' PSNR where both sides look the source image up bilinearly, dB: what the paths alone cost.
    pub psnr_bilinear: f64,
    /// Share of pixels that show another surface than the exact ray hits, %.
    pub wrong_surface_percent: f64,
    /// How far the played paths are off.
    pub path_error_texels: PathError,
}

/// The part of [`Quality`] that choices are told by, and that takes least time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Brief {
    /// Mean of the frames' PSNR, dB.
    pub psnr_mean: f64,
    /// That of the worst frame, dB.
    pub psnr_min: f64,
    /// Share of pixels that show another surface than the exact ray hits, %.
    pub wrong_surface_percent: f64,
    /// As many of those whose ray hits more than the backdrop, %: what people look at.
    pub wrong_seen_percent: f64,
    /// How far the played paths are off.
    pub path_error_texels: PathError,
}

/// Playback against the antialiased scene itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TruthQuality {
    /// Mean of the frames' PSNR, dB.
    pub psnr_mean: f64,
    /// The same where outlines are softened as they are drawn, dB.
    pub psnr_smooth: f64,
    /// That of frames whose texels are dithered, as `Player::dithered_row` draws them.
    pub psnr_dithered: f64,
    /// That of frames whose texels are bilinear, as `Player::bilinear_row` draws them.
    pub psnr_bilinear: f64,
    /// That of frames with both softened outlines and bilinear texels, as `Player::fine_row` draws them.
    pub psnr_fine: f64,
    /// Mean of the frames' SSIM.
    pub ssim_mean: f64,
    /// How many frames were compared, evenly spread over the path.
    pub truth_frames: u32,
}

/// What playing costs, per frame where not said otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// Keys decoded.
    pub keys_mean: f64,
    /// Layers interpolated in time.
    pub layers_mean: f64,
    /// Layers in the worst frame.
    pub layers_worst: u32,
    /// Pixels in smooth cells.
    pub smooth_pixels_mean: f64,
    /// Pixels in torn cells.
    pub torn_pixels_mean: f64,
    /// Share of pixels in torn cells, %.
    pub torn_percent: f64,
    /// Coverage tests.
    pub coverage_tests_mean: f64,
    /// Coverage tests in the worst frame.
    pub coverage_tests_worst: u32,
    /// Frames per second on this machine, one thread, all frames in order.
    pub host_frames_per_second: f64,
}

/// A player's pixel as R, G, B: leading bits repeated.
#[must_use]
pub fn rgb(pixel: u16) -> [u8; 3] {
    let (r, g, b) = (pixel >> 11, pixel >> 5 & 63, pixel & 31);
    [r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2].map(|v| v as u8)
}

/// One of the player's ways to draw a row.
type Row<'a> = fn(&mut Player<'a, AnyTexels>, u32, &mut [u16]);

/// Renders frames of a bundle into memory of its own.
pub struct Screen<'p, 'a> {
    player: &'p mut Player<'a, AnyTexels>,
    row: Vec<u16>,
    height: u32,
}

impl<'p, 'a> Screen<'p, 'a> {
    /// A screen for what `player` plays.
    pub fn new(player: &'p mut Player<'a, AnyTexels>) -> Self {
        let (width, height) = player.bundle().size();
        Self { player, row: vec![0; width as usize], height }
    }

    /// Plays frame `frame` into `out`: R, G, B, row by row.
    pub fn play(&mut self, frame: u32, out: &mut Vec<u8>) {
        self.player.seek(Frame(frame));
        self.draw(out, Player::row);
    }

    /// The current frame into `out` as `row` draws it: R, G, B, row by row.
    fn draw(&mut self, out: &mut Vec<u8>, row: Row<'a>) {
        out.clear();
        for y in 0..self.height {
            row(self.player, y, &mut self.row);
            out.extend(self.row.iter().flat_map(|&pixel| rgb(pixel)));
        }
    }

    /// Where the pixels of row `y` of the current frame come from.
    fn probe(&mut self, y: u32, out: &mut [Probe]) {
        self.player.probe_row(y, out);
    }

    /// For every label of the bundle the label of `image` with the same chart: folded surfaces have several (see [`crate::folds`]).
    fn charts(&self, image: &SourceImage) -> Vec<u8> {
        let bundle = self.player.bundle();
        let chart = |label: usize| {
            let own = bundle.label(label as u8);
            let same = |l: &Label| l.rect == [own.left, own.top, own.right, own.bottom];
            if label < image.labels.len() { label } else { image.labels.iter().position(same).unwrap_or(0) }
        };
        (0..bundle.label_count()).map(|label| chart(label) as u8).collect()
    }
}

/// Runs `then` with a player of `bundle` in memory of its own.
fn with_screen<R>(bundle: &Bundle<'_>, then: impl FnOnce(Screen<'_, '_>) -> R) -> Result<R, VerifyError> {
    let mut memory = vec![0; bundle.memory_needed()];
    let mut player = Player::<AnyTexels>::with_texels(bundle, &mut memory)?;
    Ok(then(Screen::new(&mut player)))
}

/// What `of` finds for each of `items`, frames of `bundle` with whatever belongs to them, ascending: in runs of [`FAR_RUN`], with a player each.
fn in_runs<T: Sync, R: Send>(
    bundle: &Bundle<'_>,
    items: &[T],
    of: impl Fn(&mut Screen<'_, '_>, &T) -> R + Sync,
) -> Result<Vec<R>, VerifyError> {
    let run = |items: &[T]| with_screen(bundle, |mut screen| items.iter().map(|item| of(&mut screen, item)).collect::<Vec<R>>());
    Ok(items.par_chunks(FAR_RUN).map(run).collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

/// Plays the frames `frames` of a finished bundle; `show` gets each one's number and its R, G, B bytes, row by row.
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub fn play(bytes: &[u8], frames: &[u32], mut show: impl FnMut(u32, &[u8])) -> Result<(), VerifyError> {
    let bundle = Bundle::parse(bytes)?;
    with_screen(&bundle, |mut screen| {
        let mut picture = Vec::new();
        for &frame in frames {
            screen.play(frame, &mut picture);
            show(frame, &picture);
        }
    })
}

/// Where the pixels of the frames `frames` of a finished bundle come from; `show` gets each one's number and positions, texels, row by row.
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub(crate) fn probe(bytes: &[u8], frames: &[u32], mut show: impl FnMut(u32, &[[f32; 2]])) -> Result<(), VerifyError> {
    let bundle = Bundle::parse(bytes)?;
    with_screen(&bundle, |mut screen| {
        let mut probes = vec![Probe::default(); screen.row.len()];
        let mut positions = Vec::new();
        for &frame in frames {
            screen.player.seek(Frame(frame));
            positions.clear();
            for y in 0..screen.height {
                screen.probe(y, &mut probes);
                positions.extend(probes.iter().map(|probe| texels(probe.at)));
            }
            show(frame, &positions);
        }
    })
}

/// Frame `frame` as exact rays see it through the source image, nearest texel: R, G, B, row by row.
#[must_use]
pub fn exact_frame(atlas: &Atlas, frame: u32) -> Vec<u8> {
    looked_up(&atlas.image, &atlas.gbuffer, frame)
}

fn looked_up(image: &SourceImage, gbuffer: &GBuffer, frame: u32) -> Vec<u8> {
    gbuffer.uv[pixels_of(gbuffer, frame)].iter().flat_map(|&uv| image.colour_at(uv)).collect()
}

fn pixels_of(gbuffer: &GBuffer, frame: u32) -> std::ops::Range<usize> {
    let size = gbuffer.width as usize * gbuffer.height as usize;
    frame as usize * size..(frame as usize + 1) * size
}

/// The bilinear colour at `uv`, 0..=255 a component, from texels of the rectangle of `label` alone.
#[inline]
fn bilinear(image: &SourceImage, label: usize, [u, v]: [f32; 2]) -> [f32; 3] {
    let Some(rect) = image.labels.get(label).map(|l| l.rect) else { return [0.0; 3] };
    let clamp = |i: i32, axis: usize| i.clamp(i32::from(rect[axis]), i32::from(rect[axis + 2].max(rect[axis] + 1)) - 1) as usize;
    let (x, y) = (u - 0.5, v - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (left, right) = (clamp(x0 as i32, 0), clamp(x0 as i32 + 1, 0));
    let (top, bottom) = (clamp(y0 as i32, 1) * image.width as usize, clamp(y0 as i32 + 1, 1) * image.width as usize);
    let at = |index: usize| image.colour(image.texels.get(index).copied().unwrap_or(0));
    let [a, b, c, d] = [top + left, top + right, bottom + left, bottom + right].map(at);
    std::array::from_fn(|k| {
        let mix = |a: u8, b: u8| f32::from(a) + (f32::from(b) - f32::from(a)) * fx;
        let (top, bottom) = (mix(a[k], b[k]), mix(c[k], d[k]));
        top + (bottom - top) * fy
    })
}

fn texels(at: PlayUv) -> [f32; 2] {
    [at.u, at.v].map(|x| x as f32 / (1u32 << PLAY_BITS) as f32)
}

/// What one run of frames adds up to; the lists have an entry a frame, or none where they are not asked for.
#[derive(Default)]
struct Sums {
    psnr: Vec<f64>,
    bilinear: Vec<f64>,
    ssim: Vec<f64>,
    wrong: u64,
    path: Histogram,
}

/// Compares every pixel of every frame of a finished bundle with exact ray casting through the same source image.
/// `progress` hears (frames done, frames in all).
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes or they are of another size.
pub fn against_exact(bytes: &[u8], atlas: &Atlas, progress: &(dyn Fn(u32, u32) + Sync)) -> Result<Quality, VerifyError> {
    compare(bytes, (&atlas.image, &atlas.gbuffer), true, progress)
}

/// The part of it that choices are told by; `image` may have other colours than the one that the G-buffer came with.
///
/// # Errors
/// The same.
pub(crate) fn briefly(bytes: &[u8], image: &SourceImage, gbuffer: &GBuffer) -> Result<Brief, VerifyError> {
    let Quality { psnr_mean, psnr_min, wrong_surface_percent, path_error_texels, .. } =
        compare(bytes, (image, gbuffer), false, &|_, _| {})?;
    let wrong_seen_percent = gbuffer.of_seen(wrong_surface_percent);
    Ok(Brief { psnr_mean, psnr_min, wrong_surface_percent, wrong_seen_percent, path_error_texels })
}

/// The figures of both; SSIM and bilinear lookup are left out unless `all` are asked for.
fn compare(
    bytes: &[u8],
    (image, gbuffer): (&SourceImage, &GBuffer),
    all: bool,
    progress: &(dyn Fn(u32, u32) + Sync),
) -> Result<Quality, VerifyError> {
    let bundle = Bundle::parse(bytes)?;
    let (width, height) = bundle.size();
    let (expected, found) = ([gbuffer.width, gbuffer.height, gbuffer.frames], [width, height, bundle.frames()]);
    if expected != found {
        return Err(VerifyError::Shape { expected, found });
    }
    let done = AtomicU32::new(0);
    let runs: Vec<Sums> = (0..gbuffer.frames.div_ceil(RUN))
        .into_par_iter()
        .map(|run| {
            with_screen(&bundle, |mut screen| {
                let mut sums = Sums::default();
                let mut played = Vec::new();
                for frame in run * RUN..((run + 1) * RUN).min(gbuffer.frames) {
                    screen.play(frame, &mut played);
                    sums.add(&mut screen, &played, (image, gbuffer), frame, all);
                    progress(done.fetch_add(1, Ordering::Relaxed) + 1, gbuffer.frames);
                }
                sums
            })
        })
        .collect::<Result<_, _>>()?;
    let mut path = Histogram::default();
    runs.iter().for_each(|run| path.merge(&run.path));
    let listed = |list: fn(&Sums) -> &Vec<f64>| runs.iter().flat_map(list).copied();
    let (worst_frame, psnr_min) = (0..).zip(listed(|run| &run.psnr)).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, metrics::PERFECT));
    let wrong: u64 = runs.iter().map(|run| run.wrong).sum();
    Ok(Quality {
        psnr_mean: metrics::mean_psnr(listed(|run| &run.psnr)),
        psnr_min,
        worst_frame,
        ssim_mean: listed(|run| &run.ssim).sum::<f64>() / f64::from(gbuffer.frames.max(1)),
        psnr_bilinear: metrics::mean_psnr(listed(|run| &run.bilinear)),
        wrong_surface_percent: 100.0 * wrong as f64 / gbuffer.label.len().max(1) as f64,
        path_error_texels: PathError { p50: path.percentile(0.5), p99: path.percentile(0.99), max: path.max() },
    })
}

impl Sums {
    /// Adds the current frame of `screen`, whose pixels are `played`.
    fn add(&mut self, screen: &mut Screen<'_, '_>, played: &[u8], (image, gbuffer): (&SourceImage, &GBuffer), frame: u32, all: bool) {
        let (width, pixels) = (gbuffer.width as usize, pixels_of(gbuffer, frame));
        let exact = looked_up(image, gbuffer, frame);
        self.psnr.push(metrics::psnr(metrics::mean_squared_error(played, &exact)));
        if all {
            self.ssim.push(metrics::ssim(played, &exact, width));
        }
        let mut probes = vec![Probe::default(); width];
        let charts = screen.charts(image);
        let mut squares = 0f64;
        let rows = gbuffer.label[pixels.clone()].chunks(width).zip(gbuffer.uv[pixels].chunks(width));
        for (y, (labels, uvs)) in (0..).zip(rows) {
            screen.probe(y, &mut probes);
            for probe in &mut probes {
                probe.label = charts[usize::from(probe.label)];
            }
            let mut row = 0f32;
            for ((&label, &exact), probe) in labels.iter().zip(uvs).zip(&probes) {
                let at = texels(probe.at);
                if label == u16::from(probe.label) {
                    self.path.add(size(difference(exact, at)));
                } else {
                    self.wrong += 1;
                }
                if !all {
                    continue;
                }
                let (a, b) = (bilinear(image, usize::from(probe.label), at), bilinear(image, usize::from(label), exact));
                row += a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
            }
            squares += f64::from(row);
        }
        if all {
            self.bilinear.push(metrics::psnr(squares / (played.len().max(1) as f64)));
        }
    }
}

/// Compares the frames `frames` of a finished bundle with the scene itself; those that are `rendered` already, which frame and R, G, B, row by row, are
/// not again. `progress` hears (frames done, frames in all).
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub fn against_truth(
    bytes: &[u8],
    truth: &Truth<'_>,
    frames: &[u32],
    rendered: &[(u32, Vec<u8>)],
    progress: &(dyn Fn(u32, u32) + Sync),
) -> Result<TruthQuality, VerifyError> {
    let bundle = Bundle::parse(bytes)?;
    let width = bundle.size().0 as usize;
    let done = AtomicU32::new(0);
    // PSNR as frames are, PSNR as others draw them, and SSIM.
    let compared = |screen: &mut Screen<'_, '_>, frame: u32| -> (f64, [f64; 4], f64) {
        let known = rendered.iter().find(|&&(at, _)| at == frame);
        let exact = known.map_or_else(|| Cow::from(truth.frame(frame)), |(_, picture)| Cow::from(picture));
        let mut played = Vec::new();
        let psnr = |played: &[u8]| metrics::psnr(metrics::mean_squared_error(played, &exact));
        screen.play(frame, &mut played);
        let (plain, ssim) = (psnr(&played), metrics::ssim(&played, &exact, width));
        let ways: [Row<'_>; 4] = [Player::smooth_row, Player::dithered_row, Player::bilinear_row, Player::fine_row];
        let others = ways.map(|row| {
            screen.draw(&mut played, row);
            psnr(&played)
        });
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, frames.len() as u32);
        (plain, others, ssim)
    };
    let all = in_runs(&bundle, frames, |screen, &frame| compared(screen, frame))?;
    let psnr_mean = metrics::mean_psnr(all.iter().map(|&(plain, ..)| plain));
    let [psnr_smooth, psnr_dithered, psnr_bilinear, psnr_fine] =
        [0, 1, 2, 3].map(|way| metrics::mean_psnr(all.iter().map(|(_, ways, _)| ways[way])));
    let ssim_mean = all.iter().map(|&(.., ssim)| ssim).sum::<f64>() / all.len().max(1) as f64;
    Ok(TruthQuality { psnr_mean, psnr_smooth, psnr_dithered, psnr_bilinear, psnr_fine, ssim_mean, truth_frames: frames.len() as u32 })
}

/// The mean PSNR, dB, of a finished bundle's frames against these `pictures` of the scene: which frame, and R, G, B, row by row.
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub(crate) fn against_pictures(bytes: &[u8], pictures: &[(u32, Vec<u8>)]) -> Result<f64, VerifyError> {
    let bundle = Bundle::parse(bytes)?;
    let all = in_runs(&bundle, pictures, |screen, (frame, exact)| {
        let mut played = Vec::new();
        screen.play(*frame, &mut played);
        metrics::psnr(metrics::mean_squared_error(&played, exact))
    })?;
    Ok(metrics::mean_psnr(all))
}

/// Bytes of working memory that a player of a bundle asks for.
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub fn memory(bytes: &[u8]) -> Result<usize, VerifyError> {
    Ok(Bundle::parse(bytes)?.memory_needed())
}

/// Plays all frames in order on one thread and counts the work.
///
/// # Errors
/// [`VerifyError`] where the player refuses the bytes.
pub fn work(bytes: &[u8]) -> Result<Work, VerifyError> {
    let bundle = Bundle::parse(bytes)?;
    let ((width, height), frames) = (bundle.size(), bundle.frames());
    let mut memory = vec![0; bundle.memory_needed()];
    let mut player = Player::<AnyTexels>::with_texels(&bundle, &mut memory)?;
    // A new player holds the first keys already: starting from the end, frame 0 is charged for them like any other.
    player.seek(Frame(frames - 1));
    let mut row = vec![0u16; width as usize];
    let mut sums = [0u64; 5];
    let mut work = Work::default();
    let start = Instant::now();
    for frame in 0..frames {
        player.seek(Frame(frame));
        for y in 0..height {
            player.row(y, &mut row);
        }
        let now = player.work();
        for (sum, count) in sums.iter_mut().zip([now.keys, now.layers, now.smooth_pixels, now.torn_pixels, now.coverage_tests]) {
            *sum += u64::from(count);
        }
        work.layers_worst = work.layers_worst.max(now.layers);
        work.coverage_tests_worst = work.coverage_tests_worst.max(now.coverage_tests);
    }
    work.host_frames_per_second = f64::from(frames) / start.elapsed().as_secs_f64().max(1e-9);
    let [keys, layers, smooth, torn, tests] = sums.map(|sum| sum as f64 / f64::from(frames));
    (work.keys_mean, work.layers_mean, work.smooth_pixels_mean) = (keys, layers, smooth);
    (work.torn_pixels_mean, work.coverage_tests_mean) = (torn, tests);
    work.torn_percent = 100.0 * torn / (smooth + torn).max(1.0);
    Ok(work)
}
