//! Packed source images: what a bundle that holds one plays, and what memory it takes, against the same scene's with a raw one.
//! Scenes come from `scenes`, baked both ways; real pictures go through the packer and back.

use cubist_baker::atlas::Storage;
use cubist_baker::bake::{self, Flat, Settings};
use cubist_baker::encode;
use cubist_baker::inspect::Inspection;
use cubist_core::format::{ATLAS, MASK};
use cubist_core::{Bundle, Frame, MemoryError, Player};
use cubist_tests::scenes;

const SIZE: [u32; 2] = [104, 78];
const FRAMES: u32 = 12;
/// One with masks, one with charts of every size.
const SCENES: [&str; 2] = ["street", "terrain"];

/// A scene baked raw and packed.
fn both(name: &str) -> (Flat, [Vec<u8>; 2]) {
    let scene = scenes::reduced(name, SIZE, FRAMES).expect("a built-in scene");
    let raw = Settings::default();
    let flat = bake::flatten(&scene, &raw.atlas, &|_, _| {}).expect("it flattens");
    let bundles = [Storage::Raw, Storage::Packed].map(|storage| {
        let mut settings = raw;
        settings.atlas.storage = storage;
        bake::encode(&scene, &flat, &settings, &|_, _| {}).expect("it encodes").bundle
    });
    (flat, bundles)
}

/// All frames, plain and antialiased, from memory filled with `fill`.
fn pixels(bytes: &[u8], fill: u8) -> Vec<u16> {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    let mut memory = vec![fill; bundle.memory_needed()];
    let mut player = Player::new(&bundle, &mut memory).expect("the memory it asked for");
    let mut out = Vec::new();
    for frame in [0, 5, 6, 11, 2] {
        player.seek(Frame(frame));
        for y in 0..SIZE[1] {
            let mut row = vec![0; SIZE[0] as usize];
            player.row(y, &mut row);
            out.extend(&row);
            player.smooth_row(y, &mut row);
            out.extend(&row);
        }
    }
    out
}

#[test]
fn packed_plays_the_pixels_of_raw() {
    for name in SCENES {
        let (flat, [raw, packed]) = both(name);
        assert!(pixels(&raw, 0) == pixels(&packed, 0xa5), "{name}: other pixels");
        let (raw_bundle, packed_bundle) = (Bundle::parse(&raw).expect("raw"), Bundle::parse(&packed).expect("packed"));
        assert!(encode::unpacked(&raw_bundle) == encode::unpacked(&packed_bundle), "{name}: other texels or another mask");
        assert!(encode::unpacked(&packed_bundle).0 == flat.atlas.image.texels, "{name}: other texels");
        let (before, after) = (Inspection::of(&raw).expect("raw"), Inspection::of(&packed).expect("packed"));
        let [was, is] = [&before, &after].map(|i| i.section_bytes(ATLAS) + i.section_bytes(MASK));
        println!("{name}: {} -> {} bytes, image and mask {was} -> {is}", raw.len(), packed.len());
        assert!(is * 2 < was, "{name}: {was} bytes became {is}");
        assert!(before.section_bytes(MASK) > 0 && after.section_bytes(MASK) == 0, "{name}: the mask is in the picture");
        assert_eq!(before.image.covered_texels, after.image.covered_texels);
        // Unpacking itself needs no more than what playing has there later.
        assert_eq!(after.workspace - before.workspace, after.unpacked_bytes(), "{name}");
        assert_eq!(before.unpacked_bytes(), 0);
        assert!(after.text().contains("packed") && before.text().contains("raw"));
    }
}

#[test]
fn a_byte_less_than_it_takes_is_refused() {
    let (_, bundles) = both("terrain");
    for bytes in &bundles {
        let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
        let needed = bundle.memory_needed();
        let mut memory = vec![0; needed - 1];
        assert_eq!(Player::new(&bundle, &mut memory).err(), Some(MemoryError::TooSmall { needed, given: needed - 1 }));
        // What is asked for is enough wherever it starts.
        let mut memory = vec![0u8; needed + 8];
        for start in 0..8 {
            assert!(Player::new(&bundle, &mut memory[start..start + needed]).is_ok());
        }
    }
}
