//! The backdrop: where it is of one colour it is filled in, and that shows what drawing it would.
//! Scenes come from `scenes`.

use cubist_baker::atlas::{self, Storage};
use cubist_baker::bake::Settings;
use cubist_core::format::{LABEL_BYTES, LABELS, LabelRecord, SPACE_CUBIC, SPACE_LINEAR};
use cubist_core::{AnyTexels, Bundle, ByteOrder};
use cubist_tests::{play, scenes, tamper};

/// `bytes` with a backdrop that is said to change, by less than a stored unit all over the screen.
fn drawn(bytes: &[u8]) -> Vec<u8> {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    let mut labels = bundle.sections().find(|section| section.tag == LABELS).expect("there are labels").bytes.to_vec();
    let (record, _) = labels.split_first_chunk_mut::<LABEL_BYTES>().expect("a record");
    let label = LabelRecord::from_bytes(record);
    assert!(label.plain());
    *record = LabelRecord { step_u: 1, step_v: 1, ..label }.to_bytes();
    tamper::with_section(bytes, LABELS, &labels).expect("a sound bundle")
}

#[test]
fn a_backdrop_of_one_colour_is_filled_in_as_it_would_be_drawn() {
    // Cells that the screen's edge cuts, and blocks of two, four and eight pixels, and of more than a tile.
    for (name, cell, space) in [
        ("torus", 8, SPACE_CUBIC),
        ("torus", 8, SPACE_LINEAR),
        ("wing", 4, SPACE_CUBIC),
        ("pyramid", 32, SPACE_CUBIC),
        ("arch", 16, SPACE_LINEAR),
    ] {
        let scene = scenes::without_sky(name, [102, 78], 9).expect("a built-in scene");
        let settings = Settings { cell, space, ..Settings::default() };
        let [raw, _] = scenes::raw_and_packed(&scene, &settings).expect("it bakes").1;
        let mut shown = 0;
        play::visit(&raw, [0, 5], |_, player| shown += play::probes(player).iter().filter(|probe| probe.label == 0).count())
            .expect("sound");
        assert!(shown > 400, "{name}: {shown} pixels of backdrop");
        let ways = |bytes: &[u8]| play::every_way::<AnyTexels>(bytes, &[0, 5, 6, 2], 0xa5, ByteOrder::BigEndian).expect("sound");
        assert!(ways(&raw) == ways(&drawn(&raw)), "{name}, cells of {cell}");
    }
}

#[test]
fn keys_have_no_positions_of_a_backdrop() {
    let scene = scenes::without_sky("wing", [104, 80], 9).expect("a built-in scene");
    // A raw picture's charts may be cut, and there are layers on both sides of a cut.
    let atlas = atlas::Settings { storage: Storage::Packed, ..Default::default() };
    let bytes = scenes::bake(&scene, &Settings { atlas, ..Settings::default() }).expect("it bakes").1.bundle;
    let bundle = Bundle::parse(&bytes).expect("the baker's bytes parse");
    // Every node carries a layer at least, but most carry that of the backdrop alone.
    let nodes = (104 / 8 + 1) * (80 / 8 + 1);
    let layers = usize::from(bundle.limits().key_layers);
    assert!(2 * layers < nodes, "{layers} positions at {nodes} nodes");
}
