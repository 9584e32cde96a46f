//! Inspection: what a bundle holds, byte by section.
//! Bytes come from a file or the encoder; figures go to `cubist-bake inspect` and to the report's byte counts, `text` puts them into words.

mod text;

use crate::encode::{Unpacked, unpacked};
use cubist_core::format::{
    ATLAS, FIXED, INFO, LABELS, Limits, MASK, MASKED, PATH, SPACE_LINEAR, STRIP, Section, TIME_HOLD, TIME_LINEAR, TexelKind, VERSION,
};
use cubist_core::mask::Tile;
use cubist_core::plane::Plane;
use cubist_core::{Bundle, BundleError};
use serde::Serialize;

/// A section as it stands in the bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SectionInfo {
    /// Four letters.
    pub tag: String,
    /// What it holds.
    pub holds: &'static str,
    /// A player that does not know it refuses the bundle.
    pub required: bool,
    /// Where its value starts, bytes from the bundle's start.
    pub offset: usize,
    /// Length of its value.
    pub bytes: usize,
}

/// A key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct KeyInfo {
    /// The frame it stands at.
    pub frame: u32,
    /// Decoding can start here.
    pub independent: bool,
    /// Bytes of its record.
    pub bytes: usize,
    /// From where it looks, in the bundle's own units; `None` without planes.
    pub eye: Option<[i32; 3]>,
}

impl KeyInfo {
    fn new(bundle: &Bundle<'_>, index: usize) -> Self {
        let (key, bytes) = (bundle.key(index), bundle.record(index).len());
        let eye = (!bundle.path().cameras.is_empty()).then(|| bundle.camera(index).eye);
        Self { frame: key.frame, independent: key.independent, bytes, eye }
    }
}

/// A plane that positions are told from, in the bundle's own units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PlaneInfo {
    /// The flat label.
    pub label: u8,
    /// The axes are 2^this times as long as a texel.
    pub shift: u8,
    /// The point of position (0, 0).
    pub origin: [i32; 3],
    /// A texel along u, times 2^shift.
    pub along_u: [i32; 3],
    /// A texel along v, times 2^shift.
    pub along_v: [i32; 3],
}

/// A label.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LabelInfo {
    /// Left, top, right, bottom, texels; right and bottom exclusive.
    pub rect: [u16; 4],
    /// Its chart does not fill its rectangle.
    pub masked: bool,
    /// Its outline is told by two distances, from opposite sides, not by one.
    pub strip: bool,
    /// An affine function of the screen position: the background.
    pub fixed: bool,
    /// Where the screen's top left pixel centre falls, texels; for fixed labels.
    pub origin: Option<[f64; 2]>,
    /// Texels a pixel; for fixed labels.
    pub step: Option<[f64; 2]>,
}

impl LabelInfo {
    fn new(bundle: &Bundle<'_>, label: u8) -> Self {
        let record = bundle.label(label);
        let fixed = record.flags & FIXED != 0;
        let scaled = |value: u16, bits: u32| f64::from(value) / f64::from(1u32 << bits);
        Self {
            rect: [record.left, record.top, record.right, record.bottom],
            masked: record.flags & MASKED != 0,
            strip: record.flags & STRIP != 0,
            fixed,
            origin: fixed.then(|| [record.origin_u, record.origin_v].map(|origin| scaled(origin, bundle.path().key_bits.into()))),
            step: fixed.then(|| [scaled(record.step_u, 14), scaled(record.step_v, 14)]),
        }
    }
}

/// The path's header.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PathInfo {
    /// Width and height of the screen, pixels.
    pub size: [u32; 2],
    /// Frames.
    pub frames: u32,
    /// Frames per second.
    pub fps: u16,
    /// Frame 0 follows the last frame.
    pub looping: bool,
    /// Side of a cell, pixels.
    pub cell: u32,
    /// Columns and rows of cells.
    pub cells: [u32; 2],
    /// How layers move between keys.
    pub time: &'static str,
    /// How layers bend between nodes.
    pub space: &'static str,
    /// Coordinates are coded in steps of one over this of a texel.
    pub steps_a_texel: u32,
    /// Bytes of the key table.
    pub table_bytes: usize,
    /// Bytes of the planes.
    pub plane_bytes: usize,
    /// Bytes of the keys' cameras.
    pub camera_bytes: usize,
    /// Bytes of the key records.
    pub record_bytes: usize,
}

impl PathInfo {
    fn new(bundle: &Bundle<'_>) -> Self {
        let (path, (width, height)) = (bundle.path(), bundle.size());
        let cell = 1u32 << path.cell_log2;
        Self {
            size: [width, height],
            frames: bundle.frames(),
            fps: bundle.fps(),
            looping: bundle.looping(),
            cell,
            cells: [width.div_ceil(cell), height.div_ceil(cell)],
            time: time_name(path.time),
            space: space_name(path.space),
            steps_a_texel: (1 << path.key_bits) >> path.step_log2,
            table_bytes: path.table.len(),
            plane_bytes: path.planes.len(),
            camera_bytes: path.cameras.len(),
            record_bytes: path.records.len(),
        }
    }
}

/// The source image's header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ImageInfo {
    /// Texels a row and rows.
    pub size: [u32; 2],
    /// What a texel is.
    pub texels: TexelKind,
    /// How texels are stored, as the bundle numbers it: raw 0, 2, 4; packed 1, 3, 5.
    pub encoding: u8,
    /// Texels and mask are coded, and unpacked into working memory.
    pub packed: bool,
    /// Bytes of texels and mask, as they are stored.
    pub stored_bytes: usize,
    /// Bytes of texels and mask, raw.
    pub raw_bytes: usize,
    /// Palette entries; 0 where texels are colours themselves.
    pub colours: usize,
    /// What of it belongs to a chart; `None`: no label is masked.
    pub mask: Option<MaskInfo>,
}

impl ImageInfo {
    /// That of `bundle`, whose texels and mask are `image`.
    fn new(bundle: &Bundle<'_>, image: &Unpacked) -> Self {
        let (atlas, raw_bytes) = (bundle.atlas(), image.bytes());
        Self {
            size: [1 << atlas.width_log2, u32::from(atlas.height)],
            texels: bundle.texel_kind(),
            encoding: atlas.encoding,
            packed: bundle.packed().is_some(),
            stored_bytes: bundle.packed().map_or(raw_bytes, <[u8]>::len),
            raw_bytes,
            colours: atlas.palette.len() / 2,
            mask: bundle.masked().then(|| MaskInfo::new(image)),
        }
    }
}

/// A mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MaskInfo {
    /// Bits a texel in each direction.
    pub bits_a_texel: u32,
    /// Tiles of 8 x 8 bits.
    pub tiles: usize,
    /// Different ones.
    pub blocks: usize,
    /// What belongs to a chart, texels.
    pub covered_texels: u64,
}

impl MaskInfo {
    fn new(image: &Unpacked) -> Self {
        let bits = |tile: &Tile| {
            image.blocks.get(usize::from(u16::from_le_bytes(*tile))).map_or(0, |&block| u64::from_le_bytes(block).count_ones())
        };
        let covered: u64 = image.tiles.iter().map(|tile| u64::from(bits(tile))).sum();
        let bits_a_texel = 1u32 << image.shape.finer;
        let covered_texels = covered / u64::from(bits_a_texel * bits_a_texel);
        Self { bits_a_texel, tiles: image.tiles.len(), blocks: image.blocks.len(), covered_texels }
    }
}

/// Everything there is to say about a bundle without playing it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspection {
    /// Version of the format.
    pub version: u16,
    /// Bytes of the whole bundle.
    pub bytes: usize,
    /// Bytes of magic, version, section headers and checksum.
    pub envelope_bytes: usize,
    /// The CRC-32 at the end.
    pub checksum: String,
    /// The sections, in the order of the bytes.
    pub sections: Vec<SectionInfo>,
    /// The path's header.
    pub path: PathInfo,
    /// The keys.
    pub keys: Vec<KeyInfo>,
    /// The planes.
    pub planes: Vec<PlaneInfo>,
    /// The source image's header.
    pub image: ImageInfo,
    /// The palette, "#rrggbb".
    pub palette: Vec<String>,
    /// The labels; label 0 is the background.
    pub labels: Vec<LabelInfo>,
    /// Working memory that a player asks for, bytes.
    pub workspace: usize,
    /// The stated bounds.
    pub limits: Limits,
    /// The text for people, if there is one.
    pub info: Option<String>,
}

/// The sections of `bundle`, which was parsed from `bytes`.
fn sections(bundle: &Bundle<'_>, bytes: &[u8]) -> Vec<SectionInfo> {
    let section = |s: Section<'_>| SectionInfo {
        tag: String::from_utf8_lossy(&s.tag).into_owned(),
        holds: holds(s.tag),
        required: s.required,
        // A section borrows from the bytes: its place in memory says its place in them.
        offset: (s.bytes.as_ptr() as usize).saturating_sub(bytes.as_ptr() as usize),
        bytes: s.bytes.len(),
    };
    bundle.sections().map(section).collect()
}

fn holds(tag: [u8; 4]) -> &'static str {
    match tag {
        PATH => "camera path: header, key table, key records",
        ATLAS => "source image: palette, texels",
        LABELS => "labels: a rectangle of the source image each",
        MASK => "mask: what is part of its chart",
        INFO => "a text for people",
        _ => "unknown to this version",
    }
}

impl Inspection {
    /// Takes a bundle apart.
    ///
    /// # Errors
    /// [`BundleError`] where `bytes` are no bundle.
    pub fn of(bytes: &[u8]) -> Result<Self, BundleError> {
        let bundle = Bundle::parse(bytes)?;
        let sections = sections(&bundle, bytes);
        let image = unpacked(&bundle);
        let info = bundle.sections().find(|section| section.tag == INFO);
        Ok(Self {
            version: VERSION,
            bytes: bytes.len(),
            envelope_bytes: bytes.len() - sections.iter().map(|s| s.bytes).sum::<usize>(),
            checksum: format!("{:08x}", bytes.last_chunk::<4>().map_or(0, |crc| u32::from_le_bytes(*crc))),
            sections,
            path: PathInfo::new(&bundle),
            keys: (0..bundle.key_count()).map(|index| KeyInfo::new(&bundle, index)).collect(),
            planes: bundle
                .planes()
                .iter()
                .map(Plane::from_bytes)
                .map(|Plane { label, shift, origin, along_u, along_v }| PlaneInfo { label, shift, origin, along_u, along_v })
                .collect(),
            image: ImageInfo::new(&bundle, &image),
            palette: bundle.atlas().palette.as_chunks::<2>().0.iter().map(|&colour| hex(u16::from_le_bytes(colour))).collect(),
            labels: (0..bundle.label_count()).map(|label| LabelInfo::new(&bundle, label as u8)).collect(),
            workspace: bundle.memory_needed(),
            limits: bundle.limits(),
            info: info.map(|section| String::from_utf8_lossy(section.bytes).into_owned()),
        })
    }

    /// Bytes of the section `tag`; 0 where there is none.
    #[must_use]
    pub fn section_bytes(&self, tag: [u8; 4]) -> usize {
        let tag = String::from_utf8_lossy(&tag);
        self.sections.iter().filter(|s| s.tag == tag).map(|s| s.bytes).sum()
    }

    /// Bytes of the keys: their table, their records, and the planes and cameras that these are told from.
    #[must_use]
    pub fn key_bytes(&self) -> usize {
        self.path.table_bytes + self.path.plane_bytes + self.path.camera_bytes + self.path.record_bytes
    }

    /// Bytes of working memory that the unpacked source image takes; 0 where it is raw.
    #[must_use]
    pub fn unpacked_bytes(&self) -> usize {
        if self.image.packed { self.image.raw_bytes } else { 0 }
    }
}

fn hex(colour: u16) -> String {
    let [r, g, b] = crate::verify::rgb(colour);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// What `--time` calls one of the format's `TIME_` numbers.
pub(crate) const fn time_name(time: u8) -> &'static str {
    match time {
        TIME_HOLD => "hold",
        TIME_LINEAR => "linear",
        _ => "cubic",
    }
}

/// What `--space` calls one of the format's `SPACE_` numbers.
pub(crate) const fn space_name(space: u8) -> &'static str {
    if space == SPACE_LINEAR { "linear" } else { "cubic" }
}
