//! Kinds of texels against each other: the same picture as indices of eight bits, of four, and as colours plays the same pixels, however it is
//! stored; and what each kind costs and keeps.
//! Scenes come from `scenes`; bundles of 16 colours are retold in the other kinds byte by byte, here.

use cubist_baker::atlas::Storage;
use cubist_baker::bake::{Flat, Settings};
use cubist_baker::inspect::Inspection;
use cubist_baker::{Options, TruthFrames, bake_scene, encode};
use cubist_core::format::{ATLAS, Atlas, MASK, TexelKind};
use cubist_core::{AnyTexels, Bundle, ByteOrder, Direct565, Indexed4, Indexed8, MemoryError, Player, Spread8, Texels};
use cubist_tests::{play, scenes, tamper};

const SIZE: [u32; 2] = [104, 78];
const FRAMES: u32 = 12;
/// Scenes, and the largest side of their source image: pictures 256 and 512 wide, and one without runs.
const SCENES: [(&str, u32); 3] = [("street", 512), ("terrain", 256), ("cone-orbit", 128)];

/// A scene's bundles with texels of `kind`, raw and packed.
fn baked((name, max_side): (&str, u32), kind: TexelKind) -> (Flat, [Vec<u8>; 2]) {
    let scene = scenes::reduced(name, SIZE, FRAMES).expect("a built-in scene");
    let mut settings = Settings::default();
    (settings.atlas.max_side, settings.atlas.texels) = (max_side, kind);
    scenes::raw_and_packed(&scene, &settings).expect("it bakes")
}

/// `bytes` with `atlas` for its source image.
fn with_atlas(bytes: &[u8], atlas: &Atlas<'_>) -> Vec<u8> {
    tamper::with_section(bytes, ATLAS, &postcard::to_stdvec(atlas).expect("an image serialises")).expect("a sound bundle")
}

/// A raw bundle of 4-bit indices with its picture twice as wide, the right half black.
fn wider(four: &[u8]) -> Vec<u8> {
    let bundle = Bundle::parse(four).expect("the baker's bytes parse");
    let atlas = *bundle.atlas();
    let twice =
        |bytes: &[u8], row: usize| -> Vec<u8> { bytes.chunks(row).flat_map(|own| own.iter().copied().chain(vec![0; row])).collect() };
    let texels = twice(atlas.texels, 1 << atlas.width_log2 >> 1);
    let mask = bundle.sections().find(|section| section.tag == MASK).map(|section| {
        let (tiles, blocks) = section.bytes.split_at(2 * bundle.mask().shape.tiles());
        [&twice(tiles, 2 << atlas.width_log2 >> 3), blocks].concat()
    });
    let bytes = with_atlas(four, &Atlas { width_log2: atlas.width_log2 + 1, texels: &texels, ..atlas });
    mask.map_or(bytes.clone(), |mask| tamper::with_section(&bytes, MASK, &mask).expect("there is a mask"))
}

/// A raw bundle of 4-bit indices, retold in 8 bits and in colours.
fn retold(four: &[u8]) -> [Vec<u8>; 2] {
    let bundle = Bundle::parse(four).expect("the baker's bytes parse");
    let atlas = *bundle.atlas();
    let eight: Vec<u8> = atlas.texels.iter().flat_map(|both| [both % 16, both / 16]).collect();
    let direct: Vec<u8> =
        eight.iter().flat_map(|&index| atlas.palette.chunks(2).nth(usize::from(index)).expect("an entry")).copied().collect();
    [
        with_atlas(four, &Atlas { encoding: 0, texels: &eight, ..atlas }),
        with_atlas(four, &Atlas { encoding: 4, texels: &direct, palette: &[], ..atlas }),
    ]
}

/// Some frames as a player of `T` draws them, plain and antialiased, from memory filled with `fill`.
fn pixels<T: Texels>(bytes: &[u8], fill: u8, order: ByteOrder) -> Vec<u16> {
    play::every_way::<T>(bytes, &[0, 5, 6, 11, 2], fill, order).expect("sound, and the memory it asked for")
}

#[test]
fn kinds_of_texels_play_the_same_pixels() {
    let mut widths = std::collections::BTreeSet::new();
    for scene in SCENES {
        let name = scene.0;
        let (_, [four, packed]) = baked(scene, TexelKind::Indexed4);
        same(name, &four);
        same(name, &wider(&four));
        let plain = |bytes: &[u8]| pixels::<Indexed4>(bytes, 0xa5, ByteOrder::BigEndian);
        assert!(plain(&packed) == plain(&four), "{name}: packed");
        let width = Bundle::parse(&four).expect("sound").atlas().width_log2;
        widths.extend([width, width + 1]);
    }
    assert!([7, 8, 9, 10].iter().all(|width| widths.contains(width)) && widths.len() > 3, "pictures 2^{widths:?} wide");
}

/// Compares all kinds of the raw bundle `four`.
fn same(name: &str, four: &[u8]) {
    let [eight, direct] = retold(four);
    let native = pixels::<Indexed8>(&eight, 0, ByteOrder::Native);
    assert!(native.iter().collect::<std::collections::BTreeSet<_>>().len() > 8, "{name}: colours belong to the test");
    for order in [ByteOrder::Native, ByteOrder::BigEndian, ByteOrder::LittleEndian] {
        let wanted: Vec<u16> = match order {
            ByteOrder::Native => native.clone(),
            ByteOrder::BigEndian => native.iter().map(|pixel| pixel.to_be()).collect(),
            ByteOrder::LittleEndian => native.iter().map(|pixel| pixel.to_le()).collect(),
        };
        assert!(pixels::<Indexed8>(&eight, 0, order) == wanted, "{name}, {order:?}");
        assert!(pixels::<Spread8>(&eight, 0x5a, order) == wanted, "{name}, {order:?}: 8 bits, the palette spread");
        assert!(pixels::<Indexed4>(four, 0, order) == wanted, "{name}, {order:?}: 4 bits");
        assert!(pixels::<Direct565>(&direct, 0, order) == wanted, "{name}, {order:?}: RGB565");
        for bytes in [&eight[..], four, &direct] {
            assert!(pixels::<AnyTexels>(bytes, 0x5a, order) == wanted, "{name}, {order:?}: any kind");
        }
    }
}

#[test]
fn packed_colours_play_the_pixels_of_raw_ones() {
    for scene in SCENES {
        let (_, [raw, packed]) = baked(scene, TexelKind::Direct565);
        assert!(pixels::<Direct565>(&raw, 0, ByteOrder::Native) == pixels::<Direct565>(&packed, 0xa5, ByteOrder::Native), "{}", scene.0);
        let [raw, packed] = [&raw, &packed].map(|bytes| Bundle::parse(bytes).expect("sound"));
        assert!(encode::unpacked(&raw) == encode::unpacked(&packed), "{}: other texels", scene.0);
    }
}

#[test]
fn texels_take_what_their_kind_says() {
    let kinds = [TexelKind::Indexed8, TexelKind::Indexed4, TexelKind::Direct565];
    let made = kinds.map(|kind| baked(SCENES[0], kind).1.map(|bytes| (bytes.len(), Inspection::of(&bytes).expect("sound"))));
    let [eight, four, direct] = &made;
    let mask = eight[0].1.section_bytes(*b"MASK");
    let texels = eight[0].1.image.raw_bytes - mask;
    for ([raw, packed], bytes, entries) in [(eight, texels, 256), (four, texels / 2, 16), (direct, texels * 2, 0)] {
        assert_eq!((raw.1.image.raw_bytes - mask, packed.1.image.raw_bytes - mask), (bytes, bytes));
        assert!(raw.1.image.colours <= entries && raw.1.unpacked_bytes() == 0 && packed.1.unpacked_bytes() == bytes + mask);
        // Unpacking itself needs no more than what playing has there later.
        assert_eq!(packed.1.workspace - raw.1.workspace, bytes + mask);
        assert!(packed.0 < raw.0 * 6 / 10, "{} of {}", packed.0, raw.0);
    }
    // The mask stays. Keys differ by a few bytes, since what shows wrong depends on the colours there are: pictures are compared, not bundles.
    assert_eq!(eight[0].1.image.stored_bytes - four[0].1.image.stored_bytes, texels / 2);
    assert!(four[1].1.image.stored_bytes * 2 < eight[1].1.image.stored_bytes);
    let (more, palettes) = (eight[0].1.workspace.abs_diff(four[0].1.workspace), 2 * (256 - 16));
    assert!(more.abs_diff(palettes) <= eight[0].1.workspace / 50, "{more} B, of which palettes {palettes}");
}

#[test]
fn a_spread_palette_takes_a_kilobyte_that_has_to_be_there() {
    let (_, [raw, packed]) = baked(SCENES[2], TexelKind::Indexed8);
    for bytes in [raw, packed] {
        let bundle = Bundle::parse(&bytes).expect("sound");
        let needed = bundle.memory_needed() + 1024;
        assert_eq!([Player::<Spread8>::memory_needed(&bundle), Player::<Indexed8>::memory_needed(&bundle)], [needed, needed - 1024]);
        let refused = Player::<Spread8>::with_texels(&bundle, &mut vec![0; needed - 1]).err();
        assert_eq!(refused, Some(MemoryError::TooSmall { needed, given: needed - 1 }));
        assert!(pixels::<Spread8>(&bytes, 0xa5, ByteOrder::Native) == pixels::<Indexed8>(&bytes, 0, ByteOrder::Native));
    }
}

#[test]
fn a_player_of_other_texels_says_what_the_bundle_needs() {
    fn refusal<T: Texels>(bytes: &[u8]) -> Option<MemoryError> {
        let bundle = Bundle::parse(bytes).expect("sound");
        Player::<T>::with_texels(&bundle, &mut vec![0; Player::<T>::memory_needed(&bundle)]).err()
    }
    let (_, [four, packed]) = baked(SCENES[2], TexelKind::Indexed4);
    let [eight, direct] = retold(&four);
    for (bytes, needed) in
        [(&eight, TexelKind::Indexed8), (&four, TexelKind::Indexed4), (&packed, TexelKind::Indexed4), (&direct, TexelKind::Direct565)]
    {
        let error = |plays: TexelKind| (plays != needed).then_some(MemoryError::Texels { needed });
        assert_eq!(refusal::<Indexed8>(bytes), error(TexelKind::Indexed8));
        assert_eq!(refusal::<Spread8>(bytes), error(TexelKind::Indexed8));
        assert_eq!(refusal::<Indexed4>(bytes), error(TexelKind::Indexed4));
        assert_eq!(refusal::<Direct565>(bytes), error(TexelKind::Direct565));
        assert_eq!(refusal::<AnyTexels>(bytes), None);
        let text = MemoryError::Texels { needed }.to_string();
        assert!(text.contains(&format!("Player<{needed:?}>")), "{text}");
    }
    // What is wrong with the kind comes first: no memory would be enough.
    let bundle = Bundle::parse(&four).expect("sound");
    assert_eq!(Player::new(&bundle, &mut []).err(), Some(MemoryError::Texels { needed: TexelKind::Indexed4 }));
}

#[test]
fn more_colours_are_no_worse() {
    for name in ["terrain", "mirrors", "torus"] {
        let scene = scenes::reduced(name, [96, 72], 3).expect("a built-in scene");
        let psnr = [TexelKind::Indexed4, TexelKind::Indexed8, TexelKind::Direct565].map(|texels| {
            // Of the same charts: a raw picture's are cut by what its texels take.
            let source = cubist_baker::atlas::Settings { texels, storage: Storage::Packed, ..Settings::default().atlas };
            // What a bit is worth is said: the baker would tell it from the pictures, and so from their colours.
            let lambda = Some(0.01);
            let options = Options { source, cell: Some(8), key_interval: Some(1), lambda, truth: TruthFrames::All, ..Options::default() };
            let (_, report) = bake_scene(&scene, &options, &|_, _| {}).expect("it bakes");
            assert_eq!(report.source_image.texels, texels);
            report.quality_vs_truth.expect("it was asked for").psnr_mean
        });
        println!("{name}: {psnr:.3?} dB with 16 colours, 256, all");
        // Texels looked up nearest are farther from their mean than an antialiased picture is, and so are their exact colours: of 256 colours those
        // that few pixels see are nearer to it by a hair.
        assert!(psnr[1] > psnr[0] && psnr[2] >= psnr[1] - 0.05, "{name}: {psnr:?}");
    }
}
