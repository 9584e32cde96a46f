//! Hostile bundles by design: a sound one taken apart, a few of its numbers changed to where things go wrong, put together and sealed again,
//! so that neither the checksum nor the envelope stops what lies deeper from being reached.
//! Edits come by lot from the tests, or from a fuzzer's bytes; bundles go through `survive`.

use crate::random::{EDGES, Random};
use crate::scenes;
use crate::tamper::seal;
use anyhow::Result;
use cubist_baker::atlas::Storage;
use cubist_baker::bake::Settings;
use cubist_core::format::{
    ATLAS, Atlas, Envelope, KEY_BYTES, KeyEntry, LABEL_BYTES, LABELS, LabelRecord, Limits, PATH, Path, Section, TexelKind,
};

/// One change. Places and choices may be any numbers: they are brought into range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edit {
    /// Flips bits of a byte of a section.
    Flip {
        /// The section.
        section: u8,
        /// Where.
        at: u32,
        /// Which bits.
        bits: u8,
    },
    /// Puts noise over some bytes of a section.
    Noise {
        /// The section.
        section: u8,
        /// Where it begins.
        at: u32,
        /// How long it is.
        length: u16,
        /// What it is.
        seed: u8,
    },
    /// Cuts a section short.
    Cut {
        /// The section.
        section: u8,
        /// The bytes left.
        length: u32,
    },
    /// Leaves a section out.
    Drop(u8),
    /// Has a section come first.
    First(u8),
    /// Changes a bound: which, and to what.
    Limit(u8, u16),
    /// Changes a number of the path's header: which, and to what.
    Header(u8, u16),
    /// Changes the number of frames.
    Frames(u32),
    /// Changes an entry of the key table.
    Key {
        /// Which.
        at: u8,
        /// What of it.
        what: u8,
        /// To what, beside what it was.
        by: i16,
    },
    /// Changes a number of a label's record: whose, which, and to what.
    Label(u8, u8, u16),
    /// Changes a number of the source image's header: which, and to what.
    Image(u8, u16),
    /// Changes a number of a plane (even) or a camera (odd): where, and to what.
    Vector(u16, i32),
    /// Replaces the key records by noise: how many bytes, and what.
    Records(u16, u8),
}

impl Edit {
    /// An edit by lot.
    pub fn by_lot(random: &mut Random) -> Self {
        let byte = |random: &mut Random| random.below(256) as u8;
        // Numbers at which something ends, and any.
        let number = |random: &mut Random| match random.below(4) {
            0 => random.below(12) as u16,
            1 => [0, 1, 0x7f, 0x80, 0xff, 0x100, 0x7fff, 0x8000, 0xffff, 1024, 4096][random.below(11)],
            2 => 1 << random.below(16),
            _ => random.below(1 << 16) as u16,
        };
        match random.below(20) {
            0 | 1 => Self::Flip { section: byte(random), at: random.below(1 << 20) as u32, bits: byte(random) },
            2 => {
                Self::Noise { section: byte(random), at: random.below(1 << 20) as u32, length: random.below(64) as u16, seed: byte(random) }
            }
            3 => Self::Cut { section: byte(random), length: random.below(1 << 14) as u32 },
            4 if random.below(8) == 0 => Self::Drop(byte(random)),
            4 => Self::First(byte(random)),
            5..=7 => Self::Limit(byte(random), number(random)),
            8 => {
                let (which, to) = (byte(random), number(random));
                // Large screens take long and show little more than small ones.
                Self::Header(which, if which % 9 < 2 && random.below(16) > 0 { to % 100 } else { to })
            }
            9 => {
                let bits = random.below(25);
                Self::Frames(random.below(1 << bits) as u32)
            }
            10 | 11 => Self::Key { at: byte(random), what: byte(random), by: random.below(9) as i16 - 4 },
            12..=14 => Self::Label(byte(random), byte(random), number(random)),
            15 => Self::Image(byte(random), number(random)),
            16 | 17 => Self::Vector(number(random), EDGES[random.below(EDGES.len())] >> random.below(2)),
            _ => Self::Records(random.below(500) as u16, byte(random)),
        }
    }
}

/// Bundles to change: as small as they can be with everything in them. One is raw with a palette, one packed with a palette, one packed with few colours
/// on a loop, one raw without a palette.
///
/// # Errors
/// A scene that does not bake.
pub fn seeds() -> Result<Vec<Vec<u8>>> {
    let kinds = [
        ("street", TexelKind::Indexed8, Storage::Raw),
        ("columns", TexelKind::Indexed4, Storage::Packed),
        ("mirrors", TexelKind::Indexed8, Storage::Packed),
        ("pyramid", TexelKind::Direct565, Storage::Raw),
    ];
    let seed = |(name, texels, storage)| {
        let mut settings = Settings { cell: 8, key_interval: 2, ..Settings::default() };
        (settings.atlas.max_side, settings.atlas.texels, settings.atlas.storage) = (64, texels, storage);
        let mut scene = scenes::reduced(name, [20, 12], 5)?;
        scene.playback.looping = name == "columns";
        Ok(scenes::bake(&scene, &settings)?.1.bundle)
    };
    kinds.into_iter().map(seed).collect()
}

/// A section in memory of its own.
type Own = ([u8; 4], bool, Vec<u8>);

/// `bytes` with `edits`, sealed; `None` where they hold no envelope.
#[must_use]
pub fn mutated(bytes: &[u8], edits: &[Edit]) -> Option<Vec<u8>> {
    let envelope: Envelope<'_> = postcard::take_from_bytes(bytes).ok()?.0;
    let mut sections: Vec<Own> = envelope.sections.iter().map(|own| (own.tag, own.required, own.bytes.to_vec())).collect();
    for edit in edits {
        apply(&mut sections, *edit);
    }
    let mut envelope = Envelope { magic: envelope.magic, version: envelope.version, sections: Default::default() };
    for (tag, required, bytes) in &sections {
        envelope.sections.push(Section { tag: *tag, required: *required, bytes }).ok()?;
    }
    let mut bytes = postcard::to_stdvec(&envelope).ok()?;
    bytes.extend([0; 4]);
    seal(&mut bytes);
    Some(bytes)
}

/// `at` brought into `0..length`, 0 where that is empty.
fn within(at: u32, length: usize) -> usize {
    at as usize % length.max(1)
}

fn apply(sections: &mut Vec<Own>, edit: Edit) {
    let count = sections.len();
    let choose = |section: u8| within(u32::from(section), count);
    match edit {
        Edit::Flip { section, at, bits } => {
            if let Some((.., own)) = sections.get_mut(choose(section)) {
                let at = within(at, own.len());
                own.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= bits);
            }
        }
        Edit::Noise { section, at, length, seed } => {
            if let Some((.., own)) = sections.get_mut(choose(section)) {
                let (at, mut random) = (within(at, own.len()), Random(seed.into()));
                own.iter_mut().skip(at).take(length.into()).for_each(|byte| *byte = random.below(256) as u8);
            }
        }
        Edit::Cut { section, length } => {
            if let Some((.., own)) = sections.get_mut(choose(section)) {
                own.truncate(within(length, own.len() + 1));
            }
        }
        Edit::Drop(section) if count > 0 => {
            sections.remove(choose(section));
        }
        Edit::First(section) if count > 0 => sections.swap(0, choose(section)),
        Edit::Drop(_) | Edit::First(_) => {}
        Edit::Limit(which, to) => path(sections, |path, _| limit(&mut path.limits, which, to)),
        Edit::Header(which, to) => path(sections, |path, _| header(path, which, to)),
        Edit::Frames(frames) => path(sections, |path, _| path.frames = frames),
        Edit::Key { at, what, by } => path(sections, |path, room| key(path, room, [at, what], by)),
        Edit::Label(at, which, to) => section(sections, LABELS, |own| label(own, [at, which], to)),
        Edit::Image(which, to) => section(sections, ATLAS, |own| image(own, which, to)),
        Edit::Vector(at, to) => path(sections, |path, room| vector(path, room, at, to)),
        Edit::Records(length, seed) => path(sections, |path, room| records(path, room, length, seed)),
    }
}

/// Changes the section of that `tag`, if there is one.
fn section(sections: &mut [Own], tag: [u8; 4], change: impl FnOnce(&mut Vec<u8>)) {
    if let Some((.., own)) = sections.iter_mut().find(|own| own.0 == tag) {
        change(own);
    }
}

/// Changes a number of an entry of the key table.
fn key<'a>(path: &mut Path<'a>, room: &'a mut Vec<u8>, [at, what]: [u8; 2], by: i16) {
    *room = path.table.to_vec();
    let entries = room.len() / KEY_BYTES;
    let start = within(at.into(), entries) * KEY_BYTES;
    if let Some(bytes) = room.get_mut(start..start + KEY_BYTES) {
        let mut entry = KeyEntry::from_bytes((&*bytes).try_into().unwrap_or(&[0; KEY_BYTES]));
        match what % 3 {
            0 => entry.frame = entry.frame.wrapping_add_signed(by.into()) & (u32::MAX >> 1),
            1 => entry.independent = !entry.independent,
            _ => entry.end = entry.end.wrapping_add_signed(by.into()),
        }
        bytes.copy_from_slice(&entry.to_bytes());
    }
    path.table = room;
}

/// Changes a number of a label's record.
fn label(own: &mut [u8], [at, which]: [u8; 2], to: u16) {
    let start = within(at.into(), own.len() / LABEL_BYTES) * LABEL_BYTES;
    let Some(bytes) = own.get_mut(start..start + LABEL_BYTES) else { return };
    let mut label = LabelRecord::from_bytes((&*bytes).try_into().unwrap_or(&[0; LABEL_BYTES]));
    let numbers = [&mut label.left, &mut label.top, &mut label.right, &mut label.bottom, &mut label.origin_u, &mut label.origin_v];
    match which % 9 {
        6 => label.step_u = to,
        7 => label.step_v = to,
        8 => label.flags = to as u8,
        which => numbers.into_iter().skip(which.into()).take(1).for_each(|number| *number = to),
    }
    bytes.copy_from_slice(&label.to_bytes());
}

/// Changes a number of the source image's header.
fn image(own: &mut Vec<u8>, which: u8, to: u16) {
    let Ok(mut image) = postcard::from_bytes::<Atlas<'_>>(own) else { return };
    match which % 5 {
        0 => image.width_log2 = to as u8,
        1 => image.height = to,
        2 => image.encoding = to as u8,
        3 => image.palette = image.palette.get(..usize::from(to) & !1).unwrap_or(image.palette),
        _ => image.texels = image.texels.get(..usize::from(to)).unwrap_or(image.texels),
    }
    if let Ok(bytes) = postcard::to_stdvec(&image) {
        *own = bytes;
    }
}

/// Changes a number of a plane or a camera.
fn vector<'a>(path: &mut Path<'a>, room: &'a mut Vec<u8>, at: u16, to: i32) {
    let planes = at.is_multiple_of(2);
    *room = if planes { path.planes.to_vec() } else { path.cameras.to_vec() };
    let start = within(u32::from(at / 2), room.len());
    // Wherever that is: across two numbers too.
    room.iter_mut().skip(start).zip(to.to_le_bytes()).for_each(|(byte, new)| *byte = new);
    *if planes { &mut path.planes } else { &mut path.cameras } = room;
}

/// Replaces the beginning of the key records by noise.
fn records<'a>(path: &mut Path<'a>, room: &'a mut Vec<u8>, length: u16, seed: u8) {
    // As long as they were in all, so that the table still holds: noise from the start on.
    let (mut random, length) = (Random(seed.into()), usize::from(length));
    *room = path.records.to_vec();
    room.iter_mut().take(length).for_each(|byte| *byte = random.below(256) as u8);
    path.records = room;
}

/// Changes the camera path; `change` gets room for bytes that the path borrows.
fn path(sections: &mut [Own], change: impl for<'a> FnOnce(&mut Path<'a>, &'a mut Vec<u8>)) {
    let Some((.., own)) = sections.iter_mut().find(|own| own.0 == PATH) else { return };
    let bytes = own.clone();
    let mut room = Vec::new();
    let Ok(mut path) = postcard::from_bytes::<Path<'_>>(&bytes) else { return };
    change(&mut path, &mut room);
    if let Ok(bytes) = postcard::to_stdvec(&path) {
        *own = bytes;
    }
}

fn limit(limits: &mut Limits, which: u8, to: u16) {
    match which % 10 {
        0 => limits.key_layers = to,
        1 => limits.row_layers = to,
        7 => limits.key_chains = to,
        8 => limits.row_chains = to,
        9 => limits.key_fields = to,
        2 => limits.list_bytes = to,
        3 => limits.row_sheets = to,
        4 => limits.cell_sheets = (to % 12) as u8,
        5 => limits.fields = (to % 4) as u8,
        _ => limits.seek_keys = to,
    }
}

fn header(path: &mut Path<'_>, which: u8, to: u16) {
    match which % 9 {
        0 => path.width = to,
        1 => path.height = to,
        2 => path.fps = to,
        3 => path.looping = !path.looping,
        4 => path.cell_log2 = (to % 8) as u8,
        5 => path.time = (to % 4) as u8,
        6 => path.space = (to % 3) as u8,
        7 => path.key_bits = (to % 10) as u8,
        _ => path.step_log2 = (to % 6) as u8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_edit_is_no_change_and_no_edit_fails() {
        let sound = include_bytes!("../../fixtures/format/cone.cubist");
        assert_eq!(mutated(sound, &[]).as_deref(), Some(&sound[..]));
        assert_eq!(mutated(b"GIF89a", &[]), None);
        let mut random = Random(3);
        for _ in 0..2_000 {
            let edits: Vec<Edit> = (0..30).map(|_| Edit::by_lot(&mut random)).collect();
            assert!(mutated(sound, &edits).is_some(), "{edits:?}");
        }
    }
}
