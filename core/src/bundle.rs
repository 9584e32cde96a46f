//! A checked, borrowed view of a bundle's bytes. Everything is checked once, here; afterwards every
//! accessor is total.

use crate::BundleError;
use crate::atlas::Texture;
use crate::fixed::KEY_BITS;
use crate::format::{
    self, ATLAS, Atlas, Envelope, INFO, KEY_BYTES, KNOWN_FLAGS, KeyEntry, LABEL_BYTES, LABELS, LabelRecord, MAGIC, MASK, MASKED,
    MAX_SECTIONS, MAX_SHEETS, MOST_BLOCKS, MOST_FINER, PACKED, PATH, Path, SPACE_CUBIC, Section, TIME_CUBIC, TexelKind, VERSION,
};
use crate::grid::Grid;
use crate::mask::{Block, Mask, PLAIN, Shape, Tile};
use crate::plane::{CAMERA_BYTES, Camera, PLANE_BYTES};
use core::fmt;
use heapless::Vec;

/// A parsed bundle, borrowing everything from the bytes: about 400 bytes of a microcontroller's memory itself.
#[derive(Clone)]
pub struct Bundle<'a> {
    sections: Vec<Section<'a>, MAX_SECTIONS>,
    path: Path<'a>,
    atlas: Atlas<'a>,
    labels: &'a [[u8; LABEL_BYTES]],
    mask: Mask<'a>,
    keys: &'a [[u8; KEY_BYTES]],
    planes: &'a [[u8; PLANE_BYTES]],
    cameras: &'a [[u8; CAMERA_BYTES]],
}

/// The bytes of the first section of `tag`.
#[inline(never)]
fn find<'a>(sections: &[Section<'a>], tag: [u8; 4]) -> Result<&'a [u8], BundleError> {
    sections.iter().find(|section| section.tag == tag).map(|section| section.bytes).ok_or(BundleError::Section { tag })
}

impl<'a> Bundle<'a> {
    /// Checks `bytes`, all of which are a bundle, and borrows from them; time linear in their length, no memory.
    ///
    /// # Errors
    /// [`BundleError`] names what is wrong: not a bundle, damaged, of another version, with a field out of range, or followed by other bytes.
    #[inline]
    pub fn parse(bytes: &'a [u8]) -> Result<Self, BundleError> {
        Self::read::<false>(bytes)
    }

    /// Likewise of a bundle that `bytes` begin with, whatever follows: at an address of a flash only its size is known, not the bundle's.
    ///
    /// # Errors
    /// Those of [`Bundle::parse`] but the last.
    #[inline]
    pub fn parse_first(bytes: &'a [u8]) -> Result<Self, BundleError> {
        Self::read::<true>(bytes)
    }

    /// A bundle that `MORE` bytes may follow.
    // Not part of its callers: what it takes of the stack is free again before what it returns goes anywhere.
    #[inline(never)]
    fn read<const MORE: bool>(bytes: &'a [u8]) -> Result<Self, BundleError> {
        let (envelope, rest) = postcard::take_from_bytes::<Envelope<'a>>(bytes).map_err(|_| {
            if bytes.starts_with(&MAGIC) { BundleError::Truncated { length: bytes.len() } } else { BundleError::NotABundle }
        })?;
        if envelope.magic != MAGIC {
            return Err(BundleError::NotABundle);
        }
        if envelope.version != VERSION {
            return Err(BundleError::Version { expected: VERSION, found: envelope.version });
        }
        let (stored, trailing) = rest.split_first_chunk::<4>().ok_or(BundleError::Truncated { length: bytes.len() })?;
        if !MORE && !trailing.is_empty() {
            return Err(BundleError::TrailingBytes { count: trailing.len() });
        }
        let expected = u32::from_le_bytes(*stored);
        let found = checksum(bytes.get(..bytes.len().saturating_sub(rest.len())).unwrap_or(&[]));
        if expected != found {
            return Err(BundleError::Checksum { expected, found });
        }
        Self::from_sections(envelope.sections)
    }

    fn from_sections(sections: Vec<Section<'a>, MAX_SECTIONS>) -> Result<Self, BundleError> {
        const KNOWN: [[u8; 4]; 5] = [PATH, ATLAS, LABELS, MASK, INFO];
        for section in &sections {
            if section.required && !KNOWN.contains(&section.tag) {
                return Err(BundleError::UnknownSection { tag: section.tag });
            }
        }
        let find = |tag| find(&sections, tag);
        let path = whole::<Path<'a>>(find(PATH)?).ok_or(BundleError::Section { tag: PATH })?;
        let atlas = whole::<Atlas<'a>>(find(ATLAS)?).ok_or(BundleError::Section { tag: ATLAS })?;
        let (labels, rest) = find(LABELS)?.as_chunks::<LABEL_BYTES>();
        if !rest.is_empty() || labels.is_empty() || labels.len() > 256 {
            return Err(BundleError::Section { tag: LABELS });
        }
        check_atlas(&atlas)?;
        let mask = check_labels(labels, &atlas, find(MASK).unwrap_or(&[]))?;
        let keys = check_path(&path)?;
        let (planes, cameras) = check_planes(&path, keys.len())?;
        Ok(Self { sections, path, atlas, labels, mask, keys, planes, cameras })
    }

    /// Width and height of the screen, pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (u32::from(self.path.width), u32::from(self.path.height))
    }

    /// Number of frames, at least 1.
    #[must_use]
    pub fn frames(&self) -> u32 {
        self.path.frames
    }

    /// Frames per second that the bundle was baked for.
    #[must_use]
    pub fn fps(&self) -> u16 {
        self.path.fps
    }

    /// Whether frame 0 follows the last frame.
    #[must_use]
    pub fn looping(&self) -> bool {
        self.path.looping
    }

    /// The bounds on memory and work that the bundle states.
    #[must_use]
    pub fn limits(&self) -> format::Limits {
        self.path.limits
    }

    /// The sections as they stand in the bytes, unknown ones included.
    pub fn sections(&self) -> impl Iterator<Item = Section<'a>> + '_ {
        self.sections.iter().copied()
    }

    /// The camera path's header and coded keys.
    #[must_use]
    pub fn path(&self) -> &Path<'a> {
        &self.path
    }

    /// The source image as it is stored.
    #[must_use]
    pub fn atlas(&self) -> &Atlas<'a> {
        &self.atlas
    }

    /// Number of labels, 1..=256.
    #[must_use]
    pub fn label_count(&self) -> usize {
        self.labels.len()
    }

    /// The record of `label`; a label that is not there has an empty rectangle.
    #[must_use]
    pub fn label(&self, label: u8) -> LabelRecord {
        self.labels.get(usize::from(label)).map_or_else(LabelRecord::default, LabelRecord::from_bytes)
    }

    /// Number of keys, at least 1.
    #[must_use]
    pub fn key_count(&self) -> usize {
        self.keys.len()
    }

    /// Entry `key` of the key table; past the end, the last.
    #[must_use]
    pub fn key(&self, key: usize) -> KeyEntry {
        let entry = self.keys.get(key).or(self.keys.last());
        entry.map_or(KeyEntry { frame: 0, independent: true, end: 0 }, KeyEntry::from_bytes)
    }

    /// The coded record of `key`; empty past the end.
    #[must_use]
    pub fn record(&self, key: usize) -> &'a [u8] {
        let start = key.checked_sub(1).map_or(0, |before| self.key(before).end as usize);
        self.path.records.get(start..self.key(key).end as usize).unwrap_or(&[])
    }

    /// The planes that positions are told from.
    #[must_use]
    pub fn planes(&self) -> &'a [[u8; PLANE_BYTES]] {
        self.planes
    }

    /// From where `key` looks; from nowhere without planes.
    #[must_use]
    pub fn camera(&self, key: usize) -> Camera {
        self.cameras.get(key).map_or_else(Camera::default, Camera::from_bytes)
    }

    pub(crate) fn grid(&self) -> Grid {
        Grid::new(self.path.width, self.path.height, self.path.cell_log2)
    }

    /// What a texel of the source image is.
    #[must_use]
    pub fn texel_kind(&self) -> TexelKind {
        TexelKind::of(self.atlas.encoding).unwrap_or_default()
    }

    /// Texels of the source image.
    #[must_use]
    pub fn texel_count(&self) -> usize {
        usize::from(self.atlas.height) << self.atlas.width_log2
    }

    /// Whether there is a mask: a label asks for one.
    #[must_use]
    pub fn masked(&self) -> bool {
        self.labels.iter().any(|label| LabelRecord::from_bytes(label).flags & MASKED != 0)
    }

    /// The mask as far as it is borrowed: where the source image is packed, its size alone.
    #[must_use]
    pub fn mask(&self) -> Mask<'a> {
        self.mask
    }

    /// Tiles of the mask; 0: there is none.
    #[must_use]
    pub fn mask_tiles(&self) -> usize {
        if self.masked() { self.mask.shape.tiles() } else { 0 }
    }

    /// Different blocks of the mask; 0: there is none.
    #[must_use]
    pub fn mask_blocks(&self) -> usize {
        if self.masked() { self.atlas.blocks as usize } else { 0 }
    }

    /// The coded mask and texels of a bundle that holds them packed; `None`: they are raw.
    #[must_use]
    pub fn packed(&self) -> Option<&'a [u8]> {
        packs(&self.atlas).then_some(self.atlas.texels)
    }

    /// The source image as far as it is borrowed: where it is packed, its size alone.
    pub(crate) fn texture(&self) -> Texture<'a> {
        Texture {
            texels: if self.packed().is_some() { &[] } else { self.atlas.texels },
            mask: self.mask,
            width_log2: u32::from(self.atlas.width_log2),
            height: u32::from(self.atlas.height),
        }
    }
}

/// What it is, without its bytes.
impl fmt::Debug for Bundle<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut told = f.debug_struct("Bundle");
        told.field("size", &self.size()).field("frames", &self.frames()).field("fps", &self.fps()).field("looping", &self.looping());
        told.field("keys", &self.key_count())
            .field("labels", &self.label_count())
            .field("texels", &self.texel_kind())
            .finish_non_exhaustive()
    }
}

/// The CRC-32 (ISO-HDLC) of `bytes`, as it stands at a bundle's end.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    CRC.checksum(bytes)
}

/// The postcard value that fills all of `bytes`.
fn whole<'a, T: serde::Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    postcard::take_from_bytes(bytes).ok().filter(|(_, rest)| rest.is_empty()).map(|(value, _)| value)
}

fn field(good: bool, name: &'static str, found: u32) -> Result<(), BundleError> {
    if good { Ok(()) } else { Err(BundleError::Field { name, found }) }
}

fn length(expected: usize, found: usize, name: &'static str) -> Result<(), BundleError> {
    if expected == found { Ok(()) } else { Err(BundleError::Length { name, expected, found }) }
}

fn packs(atlas: &Atlas<'_>) -> bool {
    atlas.encoding & PACKED != 0
}

fn check_atlas(atlas: &Atlas<'_>) -> Result<(), BundleError> {
    field((4..=10).contains(&atlas.width_log2), "ATLS width_log2", u32::from(atlas.width_log2))?;
    field((1..=1024).contains(&atlas.height), "ATLS height", u32::from(atlas.height))?;
    let Some(kind) = TexelKind::of(atlas.encoding) else { return field(false, "ATLS encoding", u32::from(atlas.encoding)) };
    if !packs(atlas) {
        length(kind.bytes(usize::from(atlas.height) << atlas.width_log2), atlas.texels.len(), "ATLS texels")?;
    }
    let (entries, most) = (atlas.palette.len() / 2, kind.colours());
    let some = (most.min(1)..=most).contains(&entries);
    field(some && atlas.palette.len().is_multiple_of(2), "ATLS palette bytes", atlas.palette.len() as u32)
}

fn check_labels<'a>(labels: &[[u8; LABEL_BYTES]], atlas: &Atlas<'_>, mask: &'a [u8]) -> Result<Mask<'a>, BundleError> {
    let mut masked = false;
    for (index, bytes) in labels.iter().enumerate() {
        let label = LabelRecord::from_bytes(bytes);
        field(label.flags & !KNOWN_FLAGS == 0, "LABL flags", u32::from(label.flags))?;
        field(label.left <= label.right && u32::from(label.right) <= 1 << atlas.width_log2, "LABL right", u32::from(label.right))?;
        field(label.top <= label.bottom && label.bottom <= atlas.height, "LABL bottom", u32::from(label.bottom))?;
        masked |= label.flags & MASKED != 0;
        // The backdrop is all of its rectangle, and there is one.
        field(!label.fixed() || index == 0 && label.flags & MASKED == 0, "LABL flags", u32::from(label.flags))?;
    }
    let shape = Shape { width_log2: atlas.width_log2.into(), height: atlas.height.into(), finer: 0 };
    if !masked {
        return Ok(Mask { shape, ..Mask::default() });
    }
    field(atlas.finer <= MOST_FINER, "ATLS finer", u32::from(atlas.finer))?;
    field((PLAIN.len() as u32..=MOST_BLOCKS).contains(&atlas.blocks), "ATLS blocks", atlas.blocks)?;
    let shape = Shape { finer: atlas.finer.into(), ..shape };
    // A packed picture brings its mask along.
    if packs(atlas) {
        return Ok(Mask { shape, ..Mask::default() });
    }
    let tiles = shape.tiles().saturating_mul(size_of::<Tile>());
    length(tiles.saturating_add((atlas.blocks as usize).saturating_mul(size_of::<Block>())), mask.len(), "MASK")?;
    let (tiles, blocks) = mask.split_at_checked(tiles).unwrap_or_default();
    Ok(Mask { tiles: tiles.as_chunks().0, blocks: blocks.as_chunks().0, shape })
}

fn check_path<'a>(path: &Path<'a>) -> Result<&'a [[u8; KEY_BYTES]], BundleError> {
    field((1..=4096).contains(&path.width), "PATH width", u32::from(path.width))?;
    field((1..=4096).contains(&path.height), "PATH height", u32::from(path.height))?;
    field((1..1 << 24).contains(&path.frames), "PATH frames", path.frames)?;
    field(path.fps > 0, "PATH fps", u32::from(path.fps))?;
    field((2..=5).contains(&path.cell_log2), "PATH cell_log2", u32::from(path.cell_log2))?;
    field(path.time <= TIME_CUBIC, "PATH time", u32::from(path.time))?;
    field(path.space <= SPACE_CUBIC, "PATH space", u32::from(path.space))?;
    field(KEY_BITS.contains(&path.key_bits), "PATH key_bits", u32::from(path.key_bits))?;
    field(path.step_log2 <= 4, "PATH step_log2", u32::from(path.step_log2))?;
    field((1..=MAX_SHEETS as u8).contains(&path.limits.cell_sheets), "PATH cell_sheets", u32::from(path.limits.cell_sheets))?;
    field(path.limits.fields <= 2, "PATH fields", u32::from(path.limits.fields))?;
    let (keys, rest) = path.table.as_chunks::<KEY_BYTES>();
    if !rest.is_empty() || keys.is_empty() {
        return Err(BundleError::Section { tag: PATH });
    }
    let (mut frame, mut end, mut run) = (0, 0, 0u32);
    for (index, bytes) in (0u32..).zip(keys) {
        let key = KeyEntry::from_bytes(bytes);
        let ordered = if index == 0 { key.frame == 0 && key.independent } else { key.frame > frame };
        if !ordered || key.frame >= path.frames || key.end < end || key.end as usize > path.records.len() {
            return Err(BundleError::Key { key: index });
        }
        (frame, end) = (key.frame, key.end);
        run = if key.independent { 1 } else { run.saturating_add(1) };
        // A seek decodes from an independent key up to the last one that the frame needs.
        let (back, ahead) = format::reach(path.time);
        let most = run.saturating_add(back.saturating_add(ahead) as u32);
        field(most <= u32::from(path.limits.seek_keys), "PATH seek_keys", u32::from(path.limits.seek_keys))?;
    }
    if !path.looping && frame != path.frames.saturating_sub(1) {
        return Err(BundleError::Key { key: keys.len().saturating_sub(1) as u32 });
    }
    length(end as usize, path.records.len(), "PATH records")?;
    Ok(keys)
}

/// Records of planes and of cameras.
type Records<'a> = (&'a [[u8; PLANE_BYTES]], &'a [[u8; CAMERA_BYTES]]);

/// The planes and the cameras of `keys` keys.
fn check_planes<'a>(path: &Path<'a>, keys: usize) -> Result<Records<'a>, BundleError> {
    let (planes, rest) = path.planes.as_chunks::<PLANE_BYTES>();
    let found = path.planes.len();
    length(found.saturating_sub(rest.len()), found, "PATH planes")?;
    let (cameras, _) = path.cameras.as_chunks::<CAMERA_BYTES>();
    let wanted = if planes.is_empty() { 0 } else { keys };
    length(wanted.saturating_mul(CAMERA_BYTES), path.cameras.len(), "PATH cameras")?;
    let labels = planes.iter().map(|[label, ..]| *label);
    let ascending = labels.clone().zip(labels.skip(1)).all(|(label, next)| label < next);
    field(ascending, "PATH planes", planes.len() as u32)?;
    Ok((planes, cameras))
}
