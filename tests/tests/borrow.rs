//! What the player promises firmware: a bundle in flash is borrowed where it lies, never copied; a frame draws into any
//! embedded-graphics target, the same as row by row.

use cubist_baker::bake::Settings;
use cubist_core::{Bundle, ByteOrder, Frame, Player};
use cubist_tests::{play, scenes};
use embedded_graphics::image::{Image, ImageDrawableExt};
use embedded_graphics::pixelcolor::Rgb565;
use embedded_graphics::pixelcolor::raw::{RawU16, ToBytes};
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::Rectangle;
use std::sync::OnceLock;

const SIZE: [u32; 2] = [52, 39];
const FRAMES: u32 = 9;

fn bytes() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| scenes::bundle("street", SIZE, FRAMES, &Settings::default()).expect("a built-in scene bakes"))
}

/// Whether `part` lies within `whole`, as bytes in memory.
fn within(part: &[u8], whole: &[u8]) -> bool {
    let (part, whole) = (part.as_ptr_range(), whole.as_ptr_range());
    !part.is_empty() && part.start >= whole.start && part.end <= whole.end
}

#[test]
fn a_static_bundle_is_borrowed_where_it_lies() {
    let bundle: Bundle<'static> = Bundle::parse(bytes()).expect("the baker's bytes parse");
    let (atlas, path) = (*bundle.atlas(), *bundle.path());
    for part in [atlas.texels, atlas.palette, path.table, path.records] {
        assert!(within(part, bytes()));
    }
    assert!((0..bundle.key_count()).all(|key| within(bundle.record(key), bytes())));
    assert!(bundle.sections().all(|section| within(section.bytes, bytes())));
    // The view itself is small enough for a stack of a few KB.
    assert!(size_of::<Bundle<'_>>() <= 128 * size_of::<usize>(), "{} bytes", size_of::<Bundle<'_>>());
}

#[test]
fn views_outlive_the_bundle_they_came_from() {
    let texels: &'static [u8] = Bundle::parse(bytes()).expect("the baker's bytes parse").atlas().texels;
    assert!(within(texels, bytes()));
}

#[test]
fn a_player_lives_in_static_memory() {
    static BUNDLE: OnceLock<Bundle<'static>> = OnceLock::new();
    let bundle = BUNDLE.get_or_init(|| Bundle::parse(bytes()).expect("the baker's bytes parse"));
    let memory: &'static mut [u8] = vec![0; bundle.memory_needed()].leak();
    let mut player: Player<'static> = Player::new(bundle, memory).expect("the memory it asked for");
    player.seek(Frame(4));
    assert!(play::pixels(&mut player) == play::frames(bytes(), [4]).expect("it plays")[0]);
}

/// A display: colours row by row, larger than the frame.
struct Display {
    width: u32,
    pixels: Vec<Rgb565>,
}

impl Display {
    fn new(width: u32, height: u32) -> Self {
        Self { width, pixels: vec![Rgb565::MAGENTA; (width * height) as usize] }
    }

    fn at(&self, x: u32, y: u32) -> Rgb565 {
        self.pixels[(y * self.width + x) as usize]
    }
}

impl OriginDimensions for Display {
    fn size(&self) -> Size {
        Size::new(self.width, self.pixels.len() as u32 / self.width)
    }
}

impl DrawTarget for Display {
    type Color = Rgb565;
    type Error = std::convert::Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb565>>>(&mut self, pixels: I) -> Result<(), Self::Error> {
        let area = self.bounding_box();
        for Pixel(point, colour) in pixels.into_iter().filter(|pixel| area.contains(pixel.0)) {
            self.pixels[(point.y as u32 * self.width + point.x as u32) as usize] = colour;
        }
        Ok(())
    }
}

/// The display after the frame was drawn at `place`, and the same frame row by row.
fn drawn(frame: u32, place: Point, area: Option<Rectangle>) -> (Display, Vec<u16>) {
    let mut display = Display::new(80, 60);
    let mut rows = Vec::new();
    play::visit(bytes(), [frame], |_, player| {
        rows = play::pixels(player);
        let mut row = [0u16; SIZE[0] as usize];
        let image = player.image(&mut row);
        match area {
            None => Image::new(&image, place).draw(&mut display),
            Some(area) => Image::new(&image.sub_image(&area), place).draw(&mut display),
        }
        .expect("drawing cannot fail");
    })
    .expect("the baker's bytes play");
    (display, rows)
}

fn colour(rows: &[u16], x: u32, y: u32) -> Rgb565 {
    Rgb565::from(RawU16::new(rows[(y * SIZE[0] + x) as usize]))
}

#[test]
fn a_frame_draws_as_an_image() {
    for frame in [0, 5, 8] {
        let (display, rows) = drawn(frame, Point::new(7, 11), None);
        for (y, x) in (0..60).flat_map(|y| (0..80).map(move |x| (y, x))) {
            let inside = (7..7 + SIZE[0]).contains(&x) && (11..11 + SIZE[1]).contains(&y);
            let expected = if inside { colour(&rows, x - 7, y - 11) } else { Rgb565::MAGENTA };
            assert_eq!(display.at(x, y), expected, "frame {frame}, ({x}, {y})");
        }
    }
}

#[test]
fn a_part_of_a_frame_draws_as_a_sub_image() {
    let area = Rectangle::new(Point::new(9, 13), Size::new(20, 17));
    let (display, rows) = drawn(3, Point::new(2, 1), Some(area));
    for (y, x) in (0..60).flat_map(|y| (0..80).map(move |x| (y, x))) {
        let inside = (2..22).contains(&x) && (1..18).contains(&y);
        let expected = if inside { colour(&rows, x - 2 + 9, y - 1 + 13) } else { Rgb565::MAGENTA };
        assert_eq!(display.at(x, y), expected, "({x}, {y})");
    }
}

#[test]
fn a_frame_past_the_displays_edge_is_cut_off() {
    let (display, rows) = drawn(2, Point::new(-5, 40), None);
    assert_eq!(display.at(0, 40), colour(&rows, 5, 0));
    assert_eq!(display.at(46, 59), colour(&rows, 51, 19));
    assert_eq!(display.at(47, 59), Rgb565::MAGENTA);
}

#[test]
fn a_short_row_buffer_draws_what_it_holds() {
    play::visit(bytes(), [0], |_, player| {
        let rows = play::pixels(player);
        let mut display = Display::new(80, 60);
        Image::new(&player.image(&mut [0; 30]), Point::zero()).draw(&mut display).expect("drawing cannot fail");
        assert_eq!(display.at(29, 38), colour(&rows, 29, 38));
        assert_eq!(display.at(30, 38), Rgb565::MAGENTA);
    })
    .expect("the baker's bytes play");
}

/// A way to draw a row that notes which rows were drawn how far.
fn noted(player: &mut Player<'_>, y: u32, out: &mut [u16]) {
    DRAWN.with_borrow_mut(|drawn| drawn.push((y, out.len())));
    player.fine_row(y, out);
}

thread_local! {
    static DRAWN: std::cell::RefCell<Vec<(u32, usize)>> = const { std::cell::RefCell::new(Vec::new()) };
}

#[test]
fn an_image_draws_as_it_is_told_and_no_row_that_nobody_sees() {
    play::visit(bytes(), [6], |_, player| {
        let mut row = [0; SIZE[0] as usize];
        let fine: Vec<Vec<u16>> = (0..SIZE[1])
            .map(|y| {
                player.fine_row(y, &mut row);
                row.to_vec()
            })
            .collect();
        // Half of it off the display's left upper corner, and a clip of 10 x 8 pixels in what is left.
        let (place, clip) = (Point::new(-20, -9), Rectangle::new(Point::new(4, 3), Size::new(10, 8)));
        let mut display = Display::new(80, 60);
        let image = player.image_by(&mut row, noted);
        Image::new(&image, place).draw(&mut display.clipped(&clip)).expect("drawing cannot fail");
        let colour = |x: i32, y: i32| Rgb565::from(RawU16::new(fine[(y - place.y) as usize][(x - place.x) as usize]));
        for (x, y) in (0..60).flat_map(|y| (0..80).map(move |x| (x, y))) {
            let wanted = if clip.contains(Point::new(x, y)) { colour(x, y) } else { Rgb565::MAGENTA };
            assert_eq!(display.at(x as u32, y as u32), wanted, "{x} {y}");
        }
        assert_eq!(DRAWN.take(), (12..20).map(|y| (y, 34)).collect::<Vec<_>>());
        Image::new(&image, Point::new(80, 0)).draw(&mut display).expect("drawing cannot fail");
        assert_eq!(DRAWN.take(), []);
    })
    .expect("the baker's bytes play");
}

#[test]
fn a_clock_tells_the_frame() {
    let bundle = Bundle::parse(bytes()).expect("the baker's bytes parse");
    assert_eq!((bundle.fps(), bundle.looping()), (30, false));
    assert_eq!([0, 33_333, 33_334, 266_667, u64::MAX].map(|micros| bundle.frame_at(micros).0), [0, 0, 1, 8, 8]);
    let mut scene = scenes::reduced("cone-orbit", SIZE, FRAMES).expect("it is built in");
    scene.playback.looping = true;
    let looping = scenes::bake(&scene, &Settings::default()).expect("it bakes").1.bundle;
    let bundle = Bundle::parse(&looping).expect("the baker's bytes parse");
    assert_eq!((bundle.fps(), bundle.looping()), (30, true));
    assert_eq!([266_667, 300_000, 3_600_000_000].map(|micros| bundle.frame_at(micros).0), [8, 0, 0]);
}

#[test]
fn a_bundle_and_its_player_are_told_in_a_line() {
    play::visit(bytes(), [6], |_, player| {
        let told = format!("{player:?}");
        assert!(told.contains("Frame(6)") && told.contains("(52, 39)") && told.len() < 300, "{told}");
    })
    .expect("the baker's bytes play");
}

#[test]
fn an_image_has_its_colours_in_any_byte_order() {
    play::visit(bytes(), [6], |_, player| {
        let rows = play::pixels(player);
        for order in [ByteOrder::BigEndian, ByteOrder::LittleEndian, ByteOrder::Native] {
            player.set_byte_order(order);
            let mut display = Display::new(80, 60);
            Image::new(&player.image(&mut [0; SIZE[0] as usize]), Point::zero()).draw(&mut display).expect("drawing cannot fail");
            assert!((0..SIZE[1]).all(|y| (0..SIZE[0]).all(|x| display.at(x, y) == colour(&rows, x, y))), "{order:?}");
        }
    })
    .expect("the baker's bytes play");
}

#[test]
fn byte_orders_are_what_embedded_graphics_calls_them() {
    play::visit(bytes(), [6], |_, player| {
        let native: Vec<Rgb565> = play::pixels(player).into_iter().map(|raw| Rgb565::from(RawU16::new(raw))).collect();
        let memory = |pixels: Vec<u16>| -> Vec<u8> { pixels.into_iter().flat_map(u16::to_ne_bytes).collect() };
        player.set_byte_order(ByteOrder::BigEndian);
        assert!(memory(play::pixels(player)) == native.iter().flat_map(|c| c.to_be_bytes()).collect::<Vec<u8>>());
        player.set_byte_order(ByteOrder::LittleEndian);
        assert!(memory(play::pixels(player)) == native.iter().flat_map(|c| c.to_le_bytes()).collect::<Vec<u8>>());
    })
    .expect("the baker's bytes play");
}
