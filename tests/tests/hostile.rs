//! Hostile bundles: whatever the bytes, parsing refuses them or the player plays something: no panic, every pixel written, the
//! same pixels whatever the memory held. First layer: cuts, changed bytes, changed fields; what a fuzzer finds comes on top.

use cubist_baker::atlas::Storage;
use cubist_baker::bake::Settings;
use cubist_core::format::{
    ATLAS, Atlas, Envelope, FIXED, KNOWN_FLAGS, KeyEntry, LABEL_BYTES, LABELS, LabelRecord, Limits, MASKED, PATH, Path, STRIP, Section,
    TexelKind, VERSION,
};
use cubist_core::plane::{CAMERA_BYTES, Camera, PLANE_BYTES, Plane, Vector};
use cubist_core::{AnyTexels, Bundle, BundleError, Frame, Indexed8, MemoryError, Player, Texels};
use cubist_tests::random::{EDGES, Random};
use cubist_tests::scenes;
use cubist_tests::tamper::{self, seal};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::OnceLock;

/// A small bundle with several labels, a mask, torn cells and dependent keys.
fn sound() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let mut settings = Settings { cell: 8, key_interval: 2, ..Settings::default() };
        settings.atlas.max_side = 64;
        let bytes = scenes::bundle("street", [52, 39], 9, &settings).expect("a built-in scene bakes");
        let copy = bytes.clone();
        let bundle = Bundle::parse(&copy).expect("the baker's bytes parse");
        assert!(bundle.sections().any(|section| section.tag == *b"MASK"), "a mask belongs to the test");
        assert!(bundle.limits().cell_sheets > 2, "torn cells belong to the test");
        assert!(bundle.limits().fields == 2, "strips belong to the test");
        println!("{} bytes, {:?}, {} labels, {} keys", bytes.len(), bundle.limits(), bundle.label_count(), bundle.key_count());
        assert!(!bundle.planes().is_empty(), "planes belong to the test");
        assert!((0..bundle.key_count()).any(|key| !bundle.key(key).independent), "dependent keys belong to the test");
        bytes
    })
}

/// The same bundle with its source image packed.
fn packed() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let mut settings = Settings { cell: 8, key_interval: 2, ..Settings::default() };
        (settings.atlas.max_side, settings.atlas.storage) = (64, Storage::Packed);
        scenes::bundle("street", [52, 39], 9, &settings).expect("a built-in scene bakes")
    })
}

/// The source image of [`packed`].
fn packed_atlas() -> Atlas<'static> {
    *Bundle::parse(packed()).expect("sound").atlas()
}

/// The packed bundle with `atlas` in place of its own.
fn with_atlas(atlas: &Atlas<'_>) -> Vec<u8> {
    with_section(packed(), ATLAS, &postcard::to_stdvec(atlas).expect("an atlas serialises"))
}

/// Plays three frames if `bytes` parse, from memory filled with `fill`: at most 12 rows of each. `None`: refused. Up to `walk`
/// frames before each are passed through one by one.
fn play(bytes: &[u8], fill: u8, walk: u32) -> Option<Vec<u16>> {
    let bundle = Bundle::parse(bytes).ok()?;
    Some(match bundle.texel_kind() {
        TexelKind::Indexed8 => play_as::<Indexed8>(&bundle, fill, walk),
        _ => play_as::<AnyTexels>(&bundle, fill, walk),
    })
}

fn play_as<T: Texels>(bundle: &Bundle<'_>, fill: u8, walk: u32) -> Vec<u16> {
    let (width, height) = bundle.size();
    let mut memory = vec![fill; bundle.memory_needed()];
    let mut player = Player::<T>::with_texels(bundle, &mut memory).expect("the memory it asked for");
    let mut pixels = Vec::new();
    for frame in [0, bundle.frames() / 2, bundle.frames() - 1] {
        for frame in frame.saturating_sub(walk)..=frame {
            player.seek(Frame(frame));
            let most = u32::from(bundle.limits().seek_keys);
            assert!(player.work().keys <= most, "frame {frame}: more keys decoded than the bundle says");
        }
        for y in (0..height).step_by(height.div_ceil(12) as usize) {
            // Two fills: a pixel that is not written keeps both.
            let mut row = vec![0xdead; width as usize];
            player.row(y, &mut row);
            let mut again = vec![0xbeef; width as usize];
            player.row(y, &mut again);
            assert!(row == again, "frame {frame}, row {y}: a pixel is left out");
            pixels.extend(row);
        }
    }
    pixels
}

/// Whether `bytes` parse; if so they play, the same from any memory, and whatever was shown before.
fn survives(bytes: &[u8]) -> bool {
    let pixels = play(bytes, 0, 0);
    assert!(pixels == play(bytes, 0xff, 8), "pixels depend on what the memory held, or on what was shown before");
    pixels.is_some()
}

/// `bytes` with `change` made to the envelope.
fn enveloped<'a>(bytes: &'a [u8], change: impl FnOnce(&mut Envelope<'a>)) -> Vec<u8> {
    tamper::enveloped(bytes, change).expect("a sound envelope")
}

/// `bytes` with the section `tag` replaced.
fn with_section<'a>(bytes: &'a [u8], tag: [u8; 4], section: &'a [u8]) -> Vec<u8> {
    tamper::with_section(bytes, tag, section).expect("the section is there")
}

fn section(tag: [u8; 4]) -> &'static [u8] {
    Bundle::parse(sound()).expect("sound").sections().find(|s| s.tag == tag).expect("the section is there").bytes
}

/// The sound bundle with `change` made to its camera path.
fn with_path<'a>(change: impl FnOnce(&mut Path<'a>)) -> Vec<u8> {
    let mut path: Path<'a> = postcard::from_bytes(section(PATH)).expect("a sound path");
    change(&mut path);
    with_section(sound(), PATH, &postcard::to_stdvec(&path).expect("a path serialises"))
}

fn with_limits(change: impl FnOnce(&mut Limits)) -> Vec<u8> {
    with_path(|path| change(&mut path.limits))
}

#[test]
fn the_sound_bundle_plays() {
    assert!(survives(sound()));
    assert_eq!(enveloped(sound(), |_| {}), sound(), "the bytes have one form only");
}

#[test]
fn every_cut_is_refused() {
    for length in 0..sound().len() {
        let mut cut = sound()[..length].to_vec();
        assert!(Bundle::parse(&cut).is_err(), "{length} bytes parse");
        seal(&mut cut);
        assert!(Bundle::parse(&cut).is_err(), "{length} bytes parse with a checksum of their own");
    }
}

#[test]
fn every_changed_byte_is_refused_by_the_checksum() {
    let mut bytes = sound().to_vec();
    for at in 0..bytes.len() {
        for flip in [0x01, 0x80, 0xff] {
            bytes[at] ^= flip;
            assert!(Bundle::parse(&bytes).is_err(), "byte {at} changed by {flip:#x}");
            bytes[at] ^= flip;
        }
    }
}

/// Changes one to eight bytes of `bytes` within `range`.
fn mutate(bytes: &mut [u8], range: std::ops::Range<usize>, random: &mut Random) {
    let values = [0, 1, 0x7f, 0x80, 0xff];
    for _ in 0..1 + random.below(8) * random.below(2) {
        let at = range.start + random.below(range.len());
        bytes[at] = match random.below(4) {
            0 => bytes[at] ^ 1 << random.below(8),
            1 => values[random.below(values.len())],
            2 => bytes[at].wrapping_add(if random.below(2) == 0 { 1 } else { 255 }),
            _ => random.below(256) as u8,
        };
    }
}

/// Where the section `tag` lies in the sound bundle.
fn range(tag: [u8; 4]) -> std::ops::Range<usize> {
    let start = section(tag).as_ptr().addr() - sound().as_ptr().addr();
    start..start + section(tag).len()
}

#[test]
fn changed_bytes_with_a_matching_checksum_never_panic() {
    let mut random = Random(1);
    let texels = range(ATLAS);
    let mut played = 0;
    for round in 0..4_000 {
        let mut bytes = sound().to_vec();
        let everywhere = 0..bytes.len() - 4;
        // Texels are the most bytes and the dullest: most changes go to headers, labels and keys.
        let range = match round % 8 {
            0 => everywhere,
            1 => texels.start..texels.start + 16,
            2 | 3 => range(LABELS),
            4 => range(PATH).start..range(PATH).start + 60,
            _ => range(PATH),
        };
        mutate(&mut bytes, range, &mut random);
        seal(&mut bytes);
        played += usize::from(survives(&bytes));
    }
    // If nearly all were refused, the test would say little about playing.
    assert!((800..3_800).contains(&played), "{played} of 4000 played");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn any_limits_and_sizes_play_or_are_refused(
        size in (0u16..80, 0u16..80),
        grid in (1u8..7, 0u8..4, 0u8..6),
        units in (0u8..3, 4u8..9),
        limits in (any::<[u16; 8]>(), 0u8..14, 0u8..4, 0u32..5),
        frames in (0u32..20, any::<bool>()),
    ) {
        survives(&with_path(|path| {
            let (values, cell_sheets, fields, shift) = limits;
            let [key_layers, row_layers, key_chains, row_chains, key_fields, list_bytes, row_sheets, seek_keys] = values.map(|x| x >> (3 * shift));
            (path.width, path.height) = size;
            (path.cell_log2, path.time, path.step_log2) = grid;
            (path.space, path.key_bits) = units;
            (path.frames, path.looping) = frames;
            path.limits = Limits {
                key_layers,
                row_layers,
                key_chains,
                row_chains,
                key_fields,
                list_bytes,
                row_sheets,
                cell_sheets,
                fields,
                seek_keys,
            };
        }));
    }

    #[test]
    fn any_key_records_play(records in prop::collection::vec(any::<u8>(), 0..600), looping: bool) {
        let third = records.len() as u32 / 3;
        let key = |frame, independent, end| KeyEntry { frame, independent, end }.to_bytes();
        let table = [key(0, true, third), key(3, false, 2 * third), key(8, true, records.len() as u32)].concat();
        let cameras = vec![0x35; 3 * CAMERA_BYTES];
        let bytes = with_path(|path| {
            (path.looping, path.frames) = (looping, if looping { 11 } else { 9 });
            (path.table, path.records) = (&table, &records);
            path.cameras = if path.planes.is_empty() { &[] } else { &cameras };
        });
        prop_assert!(survives(&bytes));
    }

    #[test]
    fn any_labels_play_or_are_refused(fields in prop::collection::vec(any::<[u8; LABEL_BYTES]>(), 1..9), tame: bool) {
        let labels: Vec<u8> = fields.iter().enumerate().flat_map(|(index, bytes)| {
            let mut label = LabelRecord::from_bytes(bytes);
            if tame {
                (label.left, label.top, label.right, label.bottom) = (label.left % 30, label.top % 30, 30 + label.right % 30, 30 + label.bottom % 30);
                label.flags &= if index > 0 { MASKED | STRIP } else if label.flags & FIXED == 0 { KNOWN_FLAGS } else { FIXED | STRIP };
            }
            label.to_bytes()
        }).collect();
        survives(&with_section(sound(), LABELS, &labels));
    }
}

/// Bundles whose planes and cameras hold `vectors`, one after the other.
fn with_vectors(vectors: &mut dyn FnMut() -> Vector, shifts: &mut dyn FnMut() -> u8) -> Vec<u8> {
    let (labels, keys) = Bundle::parse(sound()).map(|bundle| (bundle.label_count(), bundle.key_count())).expect("sound");
    let plane = |label: usize| {
        let [origin, along_u, along_v] = [vectors(), vectors(), vectors()];
        Plane { label: label as u8, shift: shifts(), origin, along_u, along_v }.to_bytes()
    };
    let planes = (1..labels).map(plane).collect::<Vec<_>>().concat();
    let camera = |_| {
        let [eye, first, column, row] = [vectors(), vectors(), vectors(), vectors()];
        Camera { eye, first, column, row }.to_bytes()
    };
    let cameras = (0..keys).map(camera).collect::<Vec<_>>().concat();
    with_path(|path| (path.planes, path.cameras) = (&planes, &cameras))
}

#[test]
fn planes_and_cameras_of_any_numbers_play() {
    for x in EDGES {
        assert!(survives(&with_vectors(&mut || [x; 3], &mut || 0)), "{x} everywhere");
    }
    let (mut random, mut shift) = (Random(7), Random(8));
    for round in 0..400 {
        // Edges alone; small numbers, whose planes are seen; anything.
        let mut number = || match round % 3 {
            0 => EDGES[random.below(EDGES.len())],
            1 => random.below(2001) as i32 - 1000,
            _ => random.below(1 << 32) as u32 as i32 >> random.below(28),
        };
        let bytes = with_vectors(&mut || [number(), number(), number()], &mut || shift.below(256) as u8 >> shift.below(8));
        assert!(survives(&bytes), "round {round}");
    }
}

#[test]
fn planes_out_of_order_and_cameras_too_few_are_refused() {
    let bundle = Bundle::parse(sound()).expect("sound");
    let (planes, keys) = (bundle.planes(), bundle.key_count());
    let refusal = |planes: &[u8], cameras: &[u8]| {
        let bytes = with_path(|path| (path.planes, path.cameras) = (planes, cameras));
        Bundle::parse(&bytes).err()
    };
    let cameras = vec![0x11; keys * CAMERA_BYTES];
    let all = planes.as_flattened();
    assert_eq!(refusal(all, &cameras), None);
    assert_eq!(refusal(&[], &[]), None, "planes are optional");
    assert!(planes.len() > 1, "more than one plane belongs to the test");
    let reversed: Vec<u8> = planes.iter().rev().flatten().copied().collect();
    let twice = [&planes[0][..], all].concat();
    for (wrong, count) in [(&reversed, planes.len()), (&twice, planes.len() + 1)] {
        assert_eq!(refusal(wrong, &cameras), Some(BundleError::Field { name: "PATH planes", found: count as u32 }));
    }
    for cut in [1, PLANE_BYTES - 1] {
        let found = all.len() - cut;
        let whole = (planes.len() - 1) * PLANE_BYTES;
        assert_eq!(refusal(&all[..found], &cameras), Some(BundleError::Length { name: "PATH planes", expected: whole, found }));
    }
    let length = |expected: usize, found: usize| Some(BundleError::Length { name: "PATH cameras", expected, found });
    for found in [0, 1, cameras.len() - CAMERA_BYTES, cameras.len() - 1] {
        assert_eq!(refusal(all, &cameras[..found]), length(cameras.len(), found));
    }
    assert_eq!(refusal(all, &[&cameras[..], &[0]].concat()), length(cameras.len(), cameras.len() + 1));
    assert_eq!(refusal(&[], &cameras), length(0, cameras.len()), "cameras without planes");
}

#[test]
fn limits_that_are_too_low_leave_pixels_out_but_play() {
    let halve = |x: &mut u16| *x /= 2;
    let changes: [fn(&mut Limits); 11] = [
        |limits| limits.key_layers /= 2,
        |limits| limits.row_layers /= 2,
        |limits| limits.key_chains /= 2,
        |limits| limits.row_chains /= 2,
        |limits| limits.key_fields /= 2,
        |limits| limits.list_bytes /= 2,
        |limits| limits.row_sheets /= 2,
        |limits| limits.cell_sheets = 1,
        |limits| limits.fields = 1,
        |limits| limits.fields = 0,
        |limits| *limits = Limits { seek_keys: limits.seek_keys, cell_sheets: 1, ..Limits::default() },
    ];
    for change in changes {
        assert!(survives(&with_limits(change)));
    }
    assert!(survives(&with_limits(|limits| [&mut limits.key_layers, &mut limits.row_layers].into_iter().for_each(halve))));
    let refused = with_limits(|limits| limits.seek_keys = 1);
    assert!(matches!(Bundle::parse(&refused), Err(BundleError::Field { name: "PATH seek_keys", found: 1 })));
}

#[test]
fn cells_show_no_more_sheets_than_the_bundle_says() {
    let most = Bundle::parse(sound()).expect("sound").limits().cell_sheets;
    for cell_sheets in 1..=most {
        let bytes = with_limits(|limits| limits.cell_sheets = cell_sheets);
        let (mut tests, mut torn) = (0, 0);
        cubist_tests::play::visit(&bytes, 0..9, |frame, player| {
            let _ = cubist_tests::play::pixels(player);
            let work = player.work();
            assert!(work.coverage_tests <= u32::from(cell_sheets - 1) * work.torn_pixels, "frame {frame}, {cell_sheets} sheets: {work:?}");
            (tests, torn) = (tests + work.coverage_tests, torn + work.torn_pixels);
        })
        .expect("it plays");
        assert_eq!(torn > 0, cell_sheets > 1, "{cell_sheets} sheets");
        // Most of a torn cell is told from its corners; where outlines run there is something to test.
        assert!(cell_sheets < 2 || tests > 0, "{cell_sheets} sheets: {tests} tests of {torn} pixels");
    }
}

#[test]
fn label_flags_play_in_every_combination_or_are_refused() {
    for flags in 0..=255u8 {
        let changed = |labels_changed: usize| {
            let mut labels = section(LABELS).to_vec();
            for record in labels.chunks_mut(LABEL_BYTES).take(labels_changed) {
                let label = LabelRecord { flags, ..LabelRecord::from_bytes((&*record).try_into().expect("a whole record")) };
                record.copy_from_slice(&label.to_bytes());
            }
            with_section(sound(), LABELS, &labels)
        };
        let known = flags & !KNOWN_FLAGS == 0 && flags & (MASKED | FIXED) != MASKED | FIXED;
        for count in [1, 2, usize::MAX] {
            let bytes = changed(count);
            // There is one backdrop.
            let good = known && (flags & FIXED == 0 || count == 1);
            assert_eq!(survives(&bytes), good, "flags {flags}");
            let refused = Some(BundleError::Field { name: "LABL flags", found: u32::from(flags) });
            assert!(good || Bundle::parse(&bytes).err() == refused, "flags {flags}");
        }
    }
}

#[test]
fn more_fields_than_there_are_is_refused() {
    let refused = with_limits(|limits| limits.fields = 3);
    assert_eq!(Bundle::parse(&refused).err(), Some(BundleError::Field { name: "PATH fields", found: 3 }));
}

#[test]
fn the_palette_may_be_shorter_than_the_texels_ask_for() {
    let mut atlas: Atlas<'_> = postcard::from_bytes(section(ATLAS)).expect("a sound image");
    atlas.palette = &atlas.palette[..4];
    assert!(survives(&with_section(sound(), ATLAS, &postcard::to_stdvec(&atlas).expect("it serialises"))));
}

#[test]
fn a_byte_too_few_is_a_memory_error() {
    let bundle = Bundle::parse(sound()).expect("sound");
    let needed = bundle.memory_needed();
    for given in [0, 1, needed / 2, needed - 1] {
        let mut memory = vec![0; given];
        let error = Player::new(&bundle, &mut memory).err();
        assert_eq!(error, Some(MemoryError::TooSmall { needed, given }));
    }
    assert!(Player::new(&bundle, &mut vec![0; needed]).is_ok());
}

#[test]
fn unknown_sections_are_skipped_unless_required() {
    let add = |required| {
        enveloped(sound(), |envelope| {
            envelope.sections.insert(0, Section { tag: *b"NEWS", required, bytes: b"later versions" }).expect("room for a section");
        })
    };
    let optional = add(false);
    let (with, without) = (Bundle::parse(&optional).expect("skipped"), Bundle::parse(sound()).expect("sound"));
    assert_eq!(with.sections().count(), without.sections().count() + 1);
    assert!(play(&optional, 0, 0) == play(sound(), 0, 0));
    let error = Bundle::parse(&add(true)).err();
    assert_eq!(error, Some(BundleError::UnknownSection { tag: *b"NEWS" }));
    assert!(error.expect("an error").to_string().contains("\"NEWS\""), "it is refused by name");
}

#[test]
fn packed_pictures_play_whatever_their_bytes() {
    assert!(play(packed(), 0, 0) == play(sound(), 0, 0));
    let (mut random, atlas) = (Random(7), packed_atlas());
    for round in 0..400 {
        let mut texels = atlas.texels.to_vec();
        match round % 4 {
            // Cut short: the rest is zeros.
            0 => texels.truncate(random.below(texels.len() + 1)),
            1 => texels.fill([0, 0xff, 0x80, 0x55][random.below(4)]),
            _ => {
                let whole = 0..texels.len();
                mutate(&mut texels, whole, &mut random);
            }
        }
        assert!(survives(&with_atlas(&Atlas { texels: &texels, ..atlas })), "any packed picture is a picture");
    }
}

#[test]
fn packed_pictures_of_any_size_ask_for_what_they_take() {
    let atlas = packed_atlas();
    for (width_log2, height) in [(4, 1), (4, 1024), (6, 63), (10, 1), (10, 1024), (7, 64)] {
        for flags in [0, MASKED, FIXED] {
            let label = LabelRecord { right: 9, bottom: 1, flags, ..LabelRecord::default() }.to_bytes();
            let bytes = with_atlas(&Atlas { width_log2, height, ..atlas });
            let bytes = with_section(&bytes, LABELS, &label);
            assert!(survives(&bytes), "{width_log2} {height} {flags}");
            let needed = Bundle::parse(&bytes).expect("it played").memory_needed();
            let count = usize::from(height) << width_log2;
            // Two bytes for every tile of 8 by 8 bits.
            assert!(needed >= count + if flags == MASKED { count / 32 + 16 } else { 0 });
        }
    }
    // Where playback needs next to nothing, unpacking still has its room.
    let path: Path<'_> = postcard::from_bytes(section(PATH)).expect("a sound path");
    let limits = Limits { cell_sheets: 1, seek_keys: path.limits.seek_keys, ..Limits::default() };
    let path = Path { width: 1, height: 1, limits, ..path };
    let bytes = with_section(packed(), PATH, &postcard::to_stdvec(&path).expect("a path serialises"));
    assert!(survives(&bytes));
    for encoding in [6, 7, 8, 0xff] {
        let error = Bundle::parse(&with_atlas(&Atlas { encoding, ..atlas })).err();
        assert_eq!(error, Some(BundleError::Field { name: "ATLS encoding", found: encoding.into() }));
    }
}

#[test]
fn texels_of_other_kinds_play_whatever_their_bytes() {
    let mut random = Random(11);
    for (texels, storage) in [TexelKind::Indexed4, TexelKind::Direct565].into_iter().flat_map(|t| [(t, Storage::Raw), (t, Storage::Packed)])
    {
        let mut settings = Settings { cell: 8, key_interval: 2, ..Settings::default() };
        (settings.atlas.max_side, settings.atlas.storage, settings.atlas.texels) = (64, storage, texels);
        let bytes = scenes::bundle("street", [52, 39], 9, &settings).expect("a built-in scene bakes");
        assert!(survives(&bytes), "{texels:?}, {storage:?}");
        let section = Bundle::parse(&bytes).expect("sound").sections().find(|s| s.tag == ATLAS).expect("it is there").bytes;
        let atlas: Atlas<'_> = postcard::from_bytes(section).expect("a sound image");
        let with = |atlas: &Atlas<'_>| with_section(&bytes, ATLAS, &postcard::to_stdvec(atlas).expect("it serialises"));
        for round in 0..200 {
            let mut changed = section.to_vec();
            let whole = 0..if round % 2 == 0 { 12 } else { section.len() };
            mutate(&mut changed, whole, &mut random);
            survives(&with_section(&bytes, ATLAS, &changed));
            let cut = &atlas.texels[..random.below(atlas.texels.len())];
            let played = survives(&with(&Atlas { texels: cut, ..atlas }));
            assert_eq!(played, storage == Storage::Packed, "a raw picture is whole, a packed one any bytes");
        }
        for noise in [0, 0x0f, 0xf0, 0xff] {
            assert!(survives(&with(&Atlas { texels: &vec![noise; atlas.texels.len()], ..atlas })));
        }
        let field = |palette: &[u8]| Bundle::parse(&with(&Atlas { palette, ..atlas })).err();
        let refused = |bytes: usize| Some(BundleError::Field { name: "ATLS palette bytes", found: bytes as u32 });
        let most = 2 * texels.colours();
        assert_eq!(field(&vec![7; most + 2]), refused(most + 2));
        assert_eq!(field(&[7]), refused(1));
        assert_eq!(field(&[]), if most == 0 { None } else { refused(0) });
        // Fewer colours than texels name: the others are black.
        assert!(most == 0 || survives(&with(&Atlas { palette: &atlas.palette[..2], ..atlas })));
    }
}

#[test]
fn missing_sections_are_named() {
    for tag in [PATH, ATLAS, LABELS] {
        let bytes = enveloped(sound(), |envelope| envelope.sections.retain(|section| section.tag != tag));
        assert_eq!(Bundle::parse(&bytes).err(), Some(BundleError::Section { tag }));
    }
    let bytes = enveloped(sound(), |envelope| envelope.sections.retain(|section| section.tag != *b"MASK"));
    assert!(matches!(Bundle::parse(&bytes), Err(BundleError::Length { name: "MASK", found: 0, .. })));
}

#[test]
fn sections_may_come_in_any_order() {
    let bytes = enveloped(sound(), |envelope| envelope.sections.reverse());
    assert!(bytes != sound() && play(&bytes, 0, 0) == play(sound(), 0, 0));
}

#[test]
fn other_files_and_versions_are_told_apart() {
    let version = enveloped(sound(), |envelope| envelope.version = 300);
    assert_eq!(Bundle::parse(&version).err(), Some(BundleError::Version { expected: VERSION, found: 300 }));
    let magic = enveloped(sound(), |envelope| envelope.magic = *b"CUBISM");
    assert_eq!(Bundle::parse(&magic).err(), Some(BundleError::NotABundle));
    assert_eq!(Bundle::parse(b"").err(), Some(BundleError::NotABundle));
    assert_eq!(Bundle::parse(b"GIF89a..............................").err(), Some(BundleError::NotABundle));
    let trailing = [sound(), &[0; 3]].concat();
    assert_eq!(Bundle::parse(&trailing).err(), Some(BundleError::TrailingBytes { count: 3 }));
    // As it lies in flash, with whatever was there before behind it.
    let flash = [sound(), &[0xff; 4096]].concat();
    assert_eq!(Bundle::parse_first(&flash).map(|bundle| bundle.frames()), Bundle::parse(sound()).map(|bundle| bundle.frames()));
    assert_eq!(Bundle::parse_first(&sound()[..sound().len() - 1]).err(), Some(BundleError::Truncated { length: sound().len() - 1 }));
    let mut damaged = flash;
    damaged[sound().len() / 2] ^= 1;
    assert!(matches!(Bundle::parse_first(&damaged).err(), Some(BundleError::Checksum { .. })));
    assert_eq!(Bundle::parse_first(&[0xff; 64]).err(), Some(BundleError::NotABundle));
}
