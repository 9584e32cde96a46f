//! From a G-buffer to bytes to pixels: two sheets, one moving in front of the other.

use cubist_baker::atlas::{Label, Outline, SourceImage, Storage};
use cubist_baker::encode::{self, CodingSettings, Content, Exceeded, Header};
use cubist_baker::gbuffer::GBuffer;
use cubist_baker::order::Coverage;
use cubist_baker::sheets::{self, KeyGrid, Layers};
use cubist_baker::{fields, fit, order, settle};
use cubist_core::format::{SPACE_CUBIC, TIME_CUBIC, TIME_HOLD, TIME_LINEAR, TexelKind};
use cubist_core::{Bundle, Frame, Player};
use std::sync::Arc;

const SIZE: [u32; 2] = [100, 60];
const FRAMES: u32 = 33;

/// A wall (label 1) that pans behind a board (label 2) that crosses the screen.
fn gbuffer(looping: bool) -> (GBuffer, SourceImage) {
    let (width, height) = (256u32, 128u32);
    let labels = vec![
        Label { rect: [0, 0, 4, 4], masked: false, fixed: None },
        Label { rect: [8, 0, 150, 80], masked: false, fixed: None },
        Label { rect: [160, 4, 190, 44], masked: false, fixed: None },
    ];
    let texels = (0..width * height).map(|i| u16::from(((i % width) * 7 + (i / width) * 13) as u8)).collect();
    let palette = (0..=255u8).map(|i| [i & 0xf8, i & 0xfc, (i << 3) & 0xf8]).collect();
    let covered: Arc<[bool]> = vec![true; (width * height) as usize].into();
    let outline = Outline { finer: 0, bits: covered.clone() };
    let image = SourceImage { width, height, kind: TexelKind::Indexed8, texels, palette, covered, outline, labels };
    let mut gbuffer = GBuffer { width: SIZE[0], height: SIZE[1], frames: FRAMES, label: Vec::new(), uv: Default::default() };
    let mut places = Vec::new();
    for frame in 0..FRAMES {
        let s = frame as f32 / FRAMES as f32;
        let s = if looping { 0.5 - 0.5 * (s * std::f32::consts::TAU).cos() } else { s };
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let board = [x as f32 + 160.5 - 10.0 - 55.0 * s, y as f32 + 4.5 - 12.0];
                let on_board = (160.0..190.0).contains(&board[0]) && (4.0..44.0).contains(&board[1]);
                gbuffer.label.push(if on_board { 2 } else { 1 });
                places.push(if on_board { board } else { [x as f32 + 10.5 + 30.0 * s, y as f32 + 5.5] });
            }
        }
    }
    gbuffer.uv = places.into();
    (gbuffer, image)
}

fn bake(gbuffer: &GBuffer, image: &SourceImage, looping: bool, independent_every: usize, time: u8) -> Vec<u8> {
    bake_every(8, gbuffer, image, looping, independent_every, time)
}

/// Keys every `interval` frames.
fn bake_every(interval: u32, gbuffer: &GBuffer, image: &SourceImage, looping: bool, independent_every: usize, time: u8) -> Vec<u8> {
    let grid = KeyGrid::new(gbuffer, 3, interval, looping, [time, SPACE_CUBIC]);
    let mut sheets = sheets::find(gbuffer, &grid, 1);
    let layers = Layers::of(&grid, &sheets);
    let fit = fit::solve(gbuffer, &grid, &sheets, &layers, &vec![None; layers.label.len()]);
    let (field_price, coverage) = (4, Coverage::All);
    let evidence = order::Evidence { gbuffer, grid: &grid, image, layers: &layers, fit: &fit, field_price, coverage };
    let fields = settle::settle(&evidence, &mut sheets);
    let settings = CodingSettings { step_log2: 0, lambda: 0.0, independent_every };
    let content = Content { grid: &grid, image, sheets: &sheets, layers: &layers, fit: &fit, fields: &fields, planes: &[], cameras: &[] };
    encode::bundle(&content, settings, Header { storage: Storage::Raw, fps: 30, info: "two sheets" }).expect("it fits")
}

fn play(bytes: &[u8], frames: impl Iterator<Item = u32>) -> Vec<Vec<u16>> {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    let mut memory = vec![0; bundle.memory_needed()];
    let mut player = Player::new(&bundle, &mut memory).expect("the memory it asked for");
    frames
        .map(|frame| {
            player.seek(Frame(frame));
            let mut picture = vec![0; (SIZE[0] * SIZE[1]) as usize];
            for (y, row) in picture.chunks_mut(SIZE[0] as usize).enumerate() {
                player.row(y as u32, row);
            }
            picture
        })
        .collect()
}

/// The share of pixels of all frames that are exactly what the G-buffer's texel gives.
fn agreement(gbuffer: &GBuffer, image: &SourceImage, frames: &[Vec<u16>]) -> f64 {
    let exact = gbuffer.uv.iter().map(|uv| {
        let texel = image.texels[uv[1] as usize * image.width as usize + uv[0] as usize];
        encode::rgb565(image.palette[usize::from(texel)])
    });
    let same = frames.iter().flatten().zip(exact).filter(|(a, b)| **a == *b).count();
    same as f64 / gbuffer.uv.len() as f64
}

#[test]
fn straight_motion_plays_back_nearly_exactly() {
    let (gbuffer, image) = gbuffer(false);
    let bytes = bake(&gbuffer, &image, false, 16, TIME_CUBIC);
    let share = agreement(&gbuffer, &image, &play(&bytes, 0..FRAMES));
    // What differs lies within 1/128 texel of a texel's edge, or of the board's.
    assert!(share > 0.97, "{share}");
}

#[test]
fn any_frame_is_the_same_whatever_was_shown_before() {
    for (looping, time) in [(false, TIME_LINEAR), (true, TIME_LINEAR), (false, TIME_CUBIC), (true, TIME_CUBIC)] {
        let (gbuffer, image) = gbuffer(looping);
        let bytes = bake(&gbuffer, &image, looping, 2, time);
        let straight = play(&bytes, 0..FRAMES);
        let order: Vec<u32> = (0..200).map(|i| i * 17 % FRAMES).collect();
        for (picture, &frame) in play(&bytes, order.iter().copied()).iter().zip(&order) {
            assert_eq!(picture, &straight[frame as usize], "frame {frame}, looping {looping}");
        }
    }
}

#[test]
fn loops_and_paths_of_few_keys_play_in_any_order() {
    // A loop has one to three keys, a path two to four.
    for (interval, looping) in [(12, false), (17, false), (40, false), (12, true), (17, true), (40, true)] {
        for time in [TIME_HOLD, TIME_LINEAR, TIME_CUBIC] {
            let (gbuffer, image) = gbuffer(looping);
            let bytes = bake_every(interval, &gbuffer, &image, looping, 2, time);
            let fresh: Vec<Vec<u16>> = (0..FRAMES).flat_map(|frame| play(&bytes, frame..frame + 1)).collect();
            let order: Vec<u32> = (0..FRAMES).chain((0..FRAMES).rev()).chain((0..66).map(|i| i * 14 % FRAMES)).collect();
            for (picture, &frame) in play(&bytes, order.iter().copied()).iter().zip(&order) {
                assert!(picture == &fresh[frame as usize], "frame {frame}, keys every {interval}, looping {looping}, time {time}");
            }
        }
    }
}

#[test]
fn the_number_of_independent_keys_does_not_change_the_picture() {
    let (gbuffer, image) = gbuffer(true);
    let one = bake(&gbuffer, &image, true, 100, TIME_CUBIC);
    let all = bake(&gbuffer, &image, true, 1, TIME_CUBIC);
    assert!(one.len() < all.len());
    assert!(play(&one, 0..FRAMES) == play(&all, 0..FRAMES));
}

#[test]
fn more_layers_than_a_key_can_have_are_an_error_with_a_cure() {
    // 257 x 257 nodes with a layer each.
    let pixels = 1024 * 1024;
    let gbuffer = GBuffer { width: 1024, height: 1024, frames: 1, label: vec![1; pixels], uv: vec![[0.5f32; 2]; pixels].into() };
    let (_, image) = self::gbuffer(false);
    let grid = KeyGrid::new(&gbuffer, 2, 1, false, [TIME_LINEAR, SPACE_CUBIC]);
    let sheets = sheets::find(&gbuffer, &grid, 1);
    let layers = Layers::of(&grid, &sheets);
    let count = layers.label.len();
    let fit = fit::Fit { uv: vec![[0.5; 2]; count], weight: vec![1.0; count] };
    let fields = fields::Fields { distance: vec![[0.0; 2]; count], thin: vec![fields::Thin::No; image.labels.len()] };
    let settings = CodingSettings { step_log2: 0, lambda: 0.0, independent_every: 1 };
    let content =
        Content { grid: &grid, image: &image, sheets: &sheets, layers: &layers, fit: &fit, fields: &fields, planes: &[], cameras: &[] };
    let error =
        encode::bundle(&content, settings, Header { storage: Storage::Raw, fps: 30, info: "" }).expect_err("more than 16 bits can say");
    assert!(matches!(error, Exceeded { what: "layers in a key", found: 66_049, most: 65_535, .. }), "{error:?}");
    assert!(error.to_string().contains("--cell"), "{error}");
}
