//! Goldens: checksums of every built-in scene's bundle and of some of its frames.
//! Scenes come from `scenes`; the checksums stand in `fixtures/golden`, one file a scene, written by the command `goldens`
//! and compared by the test of the same name.

use crate::{play, scenes};
use anyhow::Result;
use cubist_baker::bake::Settings;
use cubist_core::checksum;
use serde_json::{Map, Value, json};
use std::path::PathBuf;

/// The command that makes the files anew.
pub const COMMAND: &str = "cargo run --release -p cubist-tests --bin goldens";

/// The frames whose pixels are checked: both ends, keys, and moments between them.
pub const SHOWN: [u32; 8] = [0, 3, 8, 13, 16, 22, 27, 31];

/// The file of scene `name`.
#[must_use]
pub fn file(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", "fixtures", "golden", &format!("{name}.json")].iter().collect()
}

/// The bundle of scene `name` that its golden is about: baked at the reduced setting.
///
/// # Errors
/// Those of the baker.
pub fn bundle(name: &str) -> Result<Vec<u8>> {
    let mut settings = Settings::default();
    // Two of them have outlines finer than texels.
    settings.atlas.outline = match name {
        "round-columns" => Some(1),
        "mirrors" => Some(2),
        _ => None,
    };
    scenes::bundle(name, scenes::SIZE, scenes::FRAMES, &settings)
}

/// What the golden of scene `name` says where this is its bundle: its length, CRC-32 of all of it but its own checksum, CRC-32 of the pixels of
/// [`SHOWN`] (RGB565, little-endian, row by row).
///
/// # Errors
/// The bundle does not play.
pub fn checksums(name: &str, bytes: &[u8]) -> Result<Value> {
    let mut frames = Map::new();
    play::visit(bytes, SHOWN, |frame, player| {
        let pixels: Vec<u8> = play::pixels(player).into_iter().flat_map(u16::to_le_bytes).collect();
        frames.insert(format!("{frame:04}"), hex(&pixels));
    })?;
    let bundle = json!({ "bytes": bytes.len(), "crc32": hex(body(bytes)) });
    Ok(json!({ "scene": name, "size": scenes::SIZE, "frames": scenes::FRAMES, "bundle": bundle, "frame_crc32": frames }))
}

/// What tells one bundle from another: a CRC over bytes and the CRC of them is the same number whatever they are.
fn body(bundle: &[u8]) -> &[u8] {
    &bundle[..bundle.len().saturating_sub(4)]
}

fn hex(bytes: &[u8]) -> Value {
    Value::String(format!("{:08x}", checksum(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tamper::seal;

    #[test]
    fn sealed_bundles_are_told_apart() {
        let one = include_bytes!("../../fixtures/format/cone.cubist").to_vec();
        let mut other = one.clone();
        other[one.len() / 2] ^= 1;
        seal(&mut other);
        assert_eq!(hex(&one), hex(&other), "over its own checksum nothing shows");
        assert_ne!(hex(body(&one)), hex(body(&other)));
    }
}
