//! A small bundle for tests that asks nothing of the baker: well-formed to the last check, its key data drawn by lot.
//! Nothing comes in; bytes that `Bundle::parse` takes go to the tests. Playback is total, so any key data plays:
//! the pictures mean nothing, but they are many-coloured, differ from frame to frame, and are always the same.

use cubist_core::checksum;
use cubist_core::format::{
    ATLAS, Atlas, Envelope, KeyEntry, LABELS, LabelRecord, Limits, MAGIC, PATH, Path, SPACE_CUBIC, Section, TIME_LINEAR, TexelKind, VERSION,
};

/// Width, height, frames and frames per second of [`bundle`].
pub const SIZE: (u32, u32, u32, u32) = (96, 64, 12, 30);

/// The bundle's bytes.
pub fn bundle() -> Vec<u8> {
    bundle_of(TexelKind::Indexed8)
}

/// The bytes of a bundle with texels of `kind`.
pub fn bundle_of(kind: TexelKind) -> Vec<u8> {
    let mut lot = Lot(1);
    let palette: Vec<u8> = (0..2 * kind.colours()).map(|_| lot.byte()).collect();
    let texels: Vec<u8> = (0..kind.bytes(64 * 64)).map(|_| lot.byte()).collect();
    let records: Vec<u8> = (0..3 * 400).map(|_| lot.byte()).collect();
    let keys = [0, 5, 11].map(|frame| KeyEntry { frame, independent: frame == 0, end: 400 * frame.div_ceil(5).min(2) + 400 });
    let table: Vec<u8> = keys.iter().flat_map(|k| k.to_bytes()).collect();
    let labels: Vec<u8> = [(0, 0), (32, 0), (0, 32), (32, 32)]
        .map(|(left, top)| LabelRecord { left, top, right: left + 32, bottom: top + 32, ..LabelRecord::default() }.to_bytes())
        .concat();
    let path = Path {
        width: SIZE.0 as u16,
        height: SIZE.1 as u16,
        frames: SIZE.2,
        fps: SIZE.3 as u16,
        looping: false,
        cell_log2: 3,
        time: TIME_LINEAR,
        space: SPACE_CUBIC,
        key_bits: 6,
        step_log2: 0,
        limits: Limits {
            key_layers: 2000,
            row_layers: 400,
            key_chains: 400,
            row_chains: 80,
            list_bytes: 2000,
            row_sheets: 80,
            cell_sheets: 4,
            seek_keys: 4,
            ..Limits::default()
        },
        table: &table,
        planes: &[],
        cameras: &[],
        records: &records,
    };
    let path = postcard::to_stdvec(&path).expect("a path is plain data");
    let atlas = postcard::to_stdvec(&Atlas {
        width_log2: 6,
        height: 64,
        encoding: kind.encoding(),
        finer: 0,
        blocks: 0,
        palette: &palette,
        texels: &texels,
    })
    .expect("an image is plain data");
    let sections = [(PATH, &path), (ATLAS, &atlas), (LABELS, &labels)].map(|(tag, bytes)| Section { tag, required: true, bytes });
    let envelope = Envelope { magic: MAGIC, version: VERSION, sections: sections.into_iter().collect() };
    let mut bytes = postcard::to_stdvec(&envelope).expect("an envelope is plain data");
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}

/// Numbers by lot, the same on every machine.
struct Lot(u64);

impl Lot {
    fn byte(&mut self) -> u8 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 56) as u8
    }
}
