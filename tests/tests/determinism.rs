//! Determinism: the same scene gives the same bytes whatever the number of threads, the same bundle the same pixels whatever was
//! shown before and whatever the working memory held. (Debug against release builds: the goldens, which hold for both.)

use cubist_baker::bake::Settings;
use cubist_core::{Bundle, ByteOrder, Frame, Player};
use cubist_tests::{play, scenes};
use rayon::ThreadPoolBuilder;

const FRAMES: u32 = 16;

fn bake(name: &str) -> Vec<u8> {
    scenes::bundle(name, [80, 60], FRAMES, &Settings { key_interval: 5, ..Settings::default() }).expect("a built-in scene bakes")
}

fn bake_on(threads: usize, name: &str) -> Vec<u8> {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of threads").install(|| bake(name))
}

#[test]
fn the_number_of_threads_does_not_change_the_bundle() {
    for name in ["street", "terrain", "round-columns"] {
        let one = bake_on(1, name);
        assert!(one == bake_on(2, name), "{name}: 2 threads");
        assert!(one == bake_on(7, name), "{name}: 7 threads");
    }
}

#[test]
fn frames_do_not_depend_on_what_was_shown_before() {
    for name in ["street", "mirrors"] {
        let bytes = bake(name);
        let straight = play::frames(&bytes, 0..FRAMES).expect("it plays");
        let orders: [Vec<u32>; 3] = [
            (0..FRAMES).rev().collect(),
            (0..4 * FRAMES).map(|i| i * i * 7 % FRAMES).collect(),
            (0..FRAMES).flat_map(|frame| [frame, frame, FRAMES - 1, 0]).collect(),
        ];
        for order in orders {
            let shown = play::frames(&bytes, order.iter().copied()).expect("it plays");
            for (picture, frame) in shown.iter().zip(order) {
                assert!(*picture == straight[frame as usize], "{name}: frame {frame}");
            }
        }
    }
}

#[test]
fn rows_do_not_depend_on_each_other() {
    let bytes = bake("columns");
    let straight = play::frames(&bytes, [10]).expect("it plays");
    play::visit(&bytes, [10], |_, player| {
        let (width, height) = player.bundle().size();
        let mut row = vec![0u16; width as usize];
        for y in (0..height).map(|i| i * 31 % height) {
            player.row(y, &mut row);
            assert!(row == straight[0][(y * width) as usize..][..width as usize], "row {y}");
        }
    })
    .expect("it plays");
}

#[test]
fn what_the_memory_held_does_not_matter() {
    let bytes = bake("arch");
    let bundle = Bundle::parse(&bytes).expect("the baker's bytes parse");
    let straight = play::frames(&bytes, [0, 11]).expect("it plays");
    // Every alignment, and more memory than needed.
    for (offset, fill) in [(0, 0xff), (1, 0xaa), (2, 0x55), (3, 0x01), (0, 0x80)] {
        let mut memory = vec![fill; bundle.memory_needed() + offset + 5];
        let mut player = Player::new(&bundle, &mut memory[offset..]).expect("the memory it asked for");
        for (frame, expected) in [0, 11].into_iter().zip(&straight) {
            player.seek(Frame(frame));
            assert!(play::pixels(&mut player) == *expected, "frame {frame}, offset {offset}, filled with {fill:#x}");
        }
    }
}

#[test]
fn byte_orders_differ_by_the_order_of_bytes_only() {
    let bytes = bake("torus");
    play::visit(&bytes, [7], |_, player| {
        let native = play::pixels(player);
        player.set_byte_order(ByteOrder::BigEndian);
        assert!(play::pixels(player).into_iter().map(u16::from_be).eq(native.iter().copied()));
        player.set_byte_order(ByteOrder::LittleEndian);
        assert!(play::pixels(player).into_iter().map(u16::from_le).eq(native.iter().copied()));
        player.set_byte_order(ByteOrder::Native);
        assert!(play::pixels(player) == native);
    })
    .expect("it plays");
}

#[test]
fn past_the_end_paths_hold_or_loop() {
    for looping in [false, true] {
        let mut scene = scenes::reduced("pyramid", [64, 48], 10).expect("there is such a scene");
        scene.playback.looping = looping;
        let bytes = scenes::bake(&scene, &Settings::default()).expect("it bakes").1.bundle;
        let last = u32::MAX;
        let shown = play::frames(&bytes, [9, 3, last % 10, 13, last]).expect("it plays");
        let [held, third, fifth, past, far] = shown.as_slice() else { panic!("five frames") };
        assert!(past == if looping { third } else { held });
        assert!(far == if looping { fifth } else { held });
    }
}
