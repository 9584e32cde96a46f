//! The bytes: the postcard values a bundle is made of, as the baker writes and `bundle` reads them.
//! FORMAT.md says the same to the byte.

use heapless::Vec;
use serde::{Deserialize, Serialize};

/// What a bundle starts with.
pub const MAGIC: [u8; 6] = *b"CUBIST";
/// The format's version.
pub const VERSION: u16 = 10;
/// The most sections a bundle can hold.
pub const MAX_SECTIONS: usize = 16;
/// The most sheets a cell can hold: the tests of all but the last fit into 16 bits.
pub const MAX_SHEETS: usize = 9;

/// Tag of the section that holds the camera path: screen, timeline, keys. A [`Path`].
pub const PATH: [u8; 4] = *b"PATH";
/// Tag of the section that holds the source image. An [`Atlas`].
pub const ATLAS: [u8; 4] = *b"ATLS";
/// Tag of the section that holds one [`LabelRecord`] a label.
pub const LABELS: [u8; 4] = *b"LABL";
/// Tag of the section that holds the tiles and blocks of a [`crate::mask::Mask`]. Present if a label is [`MASKED`] and the source image is raw.
pub const MASK: [u8; 4] = *b"MASK";
/// Tag of the optional section that holds a UTF-8 text about the scene, for people.
pub const INFO: [u8; 4] = *b"INFO";

/// The whole bundle; a CRC-32 (ISO-HDLC, little-endian) of all bytes before it follows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Envelope<'a> {
    /// [`MAGIC`].
    pub magic: [u8; 6],
    /// [`VERSION`].
    pub version: u16,
    /// The sections, in any order.
    #[serde(borrow)]
    pub sections: Vec<Section<'a>, MAX_SECTIONS>,
}

/// One section of a bundle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section<'a> {
    /// Four ASCII letters.
    pub tag: [u8; 4],
    /// A player that does not know a required section refuses the bundle.
    pub required: bool,
    /// The section's own value.
    pub bytes: &'a [u8],
}

/// [`Atlas::encoding`]: texels as they are read, and the mask in a section of its own. Both are borrowed where they lie.
pub const RAW: u8 = 0;
/// [`Atlas::encoding`], added to a [`TexelKind::encoding`]: mask and texels coded as [`crate::pack`] says, and unpacked into the caller's memory.
pub const PACKED: u8 = 1;

/// What a texel of the source image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TexelKind {
    /// A byte: an index of a palette of at most 256 colours.
    #[default]
    Indexed8,
    /// Half a byte, the first texel in the lower one: an index of a palette of at most 16 colours.
    Indexed4,
    /// Two bytes, little-endian: RGB565, no palette.
    Direct565,
}

impl TexelKind {
    /// The kind of an [`Atlas::encoding`]; `None` where this version knows none.
    #[must_use]
    pub const fn of(encoding: u8) -> Option<Self> {
        match encoding & !PACKED {
            0 => Some(Self::Indexed8),
            2 => Some(Self::Indexed4),
            4 => Some(Self::Direct565),
            _ => None,
        }
    }

    /// The [`Atlas::encoding`] of texels of this kind, [`RAW`].
    #[must_use]
    pub const fn encoding(self) -> u8 {
        match self {
            Self::Indexed8 => 0,
            Self::Indexed4 => 2,
            Self::Direct565 => 4,
        }
    }

    /// Bytes of `texels` texels, an even number.
    #[must_use]
    pub const fn bytes(self, texels: usize) -> usize {
        match self {
            Self::Indexed8 => texels,
            Self::Indexed4 => texels >> 1,
            Self::Direct565 => texels.saturating_mul(2),
        }
    }

    /// The most colours of a palette; 0: there is none.
    #[must_use]
    pub const fn colours(self) -> usize {
        match self {
            Self::Indexed8 => 256,
            Self::Indexed4 => 16,
            Self::Direct565 => 0,
        }
    }
}

/// The finest mask has 2^this bits a texel in each direction.
pub const MOST_FINER: u8 = 2;
/// The most blocks of a mask: numbers have 16 bits.
pub const MOST_BLOCKS: u32 = 1 << 16;

/// The source image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Atlas<'a> {
    /// The width is 2^this texels, 4..=10.
    pub width_log2: u8,
    /// Rows, 1..=1024.
    pub height: u16,
    /// The [`TexelKind::encoding`], [`RAW`] or [`PACKED`].
    pub encoding: u8,
    /// The mask has 2^this bits a texel in each direction, 0..=[`MOST_FINER`]; of no meaning where no label is [`MASKED`].
    pub finer: u8,
    /// Different blocks of the mask, the two [`crate::mask::PLAIN`] ones included, 2..=[`MOST_BLOCKS`]; of no meaning where
    /// no label is [`MASKED`].
    pub blocks: u32,
    /// RGB565, little-endian, at most [`TexelKind::colours`] entries.
    pub palette: &'a [u8],
    /// Row by row, from the top; packed: the coded mask and texels.
    pub texels: &'a [u8],
}

/// [`LabelRecord::flags`]: the chart does not fill its rectangle; the mask says where it is.
pub const MASKED: u8 = 1;
/// [`LabelRecord::flags`]: the label is the backdrop, fixed to the screen: its positions are an affine function of that, and keys have none of them.
/// Only label 0 can be it.
pub const FIXED: u8 = 2;
/// [`LabelRecord::flags`]: the label's outline is told by two fields, distances from opposite sides, not by one.
pub const STRIP: u8 = 4;
/// All flags this version knows.
pub const KNOWN_FLAGS: u8 = MASKED | FIXED | STRIP;
/// Bytes of a label record.
pub const LABEL_BYTES: usize = 20;

/// One label: a chart's place in the source image, and what its surface asks for.
/// Stored as [`LABEL_BYTES`] little-endian bytes in the order of the fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct LabelRecord {
    /// Left edge of the rectangle, texels.
    pub left: u16,
    /// Top edge.
    pub top: u16,
    /// Right edge, exclusive.
    pub right: u16,
    /// Bottom edge, exclusive.
    pub bottom: u16,
    /// [`MASKED`], [`FIXED`], [`STRIP`].
    pub flags: u8,
    /// Room for a tint; 0: none.
    pub tint: [u8; 3],
    /// [`FIXED`] labels: u at the leftmost nodes, which stand at pixel centres, stored units.
    pub origin_u: u16,
    /// [`FIXED`] labels: v at the topmost nodes, stored units.
    pub origin_v: u16,
    /// [`FIXED`] labels: u a pixel to the right, 1/16384 texel.
    pub step_u: u16,
    /// [`FIXED`] labels: v a pixel down, 1/16384 texel.
    pub step_v: u16,
}

impl LabelRecord {
    /// The label is the backdrop.
    #[must_use]
    #[inline]
    pub const fn fixed(&self) -> bool {
        self.flags & FIXED != 0
    }

    /// The backdrop is one and the same position all over the screen.
    #[must_use]
    #[inline]
    pub const fn plain(&self) -> bool {
        self.fixed() && self.step_u == 0 && self.step_v == 0
    }

    /// The record's bytes.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; LABEL_BYTES] {
        let [a, b] = self.left.to_le_bytes();
        let [c, d] = self.top.to_le_bytes();
        let [e, f] = self.right.to_le_bytes();
        let [g, h] = self.bottom.to_le_bytes();
        let [r, s, t] = self.tint;
        let [i, j] = self.origin_u.to_le_bytes();
        let [k, l] = self.origin_v.to_le_bytes();
        let [m, n] = self.step_u.to_le_bytes();
        let [o, p] = self.step_v.to_le_bytes();
        [a, b, c, d, e, f, g, h, self.flags, r, s, t, i, j, k, l, m, n, o, p]
    }

    /// The record in `bytes`.
    #[must_use]
    pub const fn from_bytes(bytes: &[u8; LABEL_BYTES]) -> Self {
        let [a, b, c, d, e, f, g, h, flags, r, s, t, i, j, k, l, m, n, o, p] = *bytes;
        Self {
            left: u16::from_le_bytes([a, b]),
            top: u16::from_le_bytes([c, d]),
            right: u16::from_le_bytes([e, f]),
            bottom: u16::from_le_bytes([g, h]),
            flags,
            tint: [r, s, t],
            origin_u: u16::from_le_bytes([i, j]),
            origin_v: u16::from_le_bytes([k, l]),
            step_u: u16::from_le_bytes([m, n]),
            step_v: u16::from_le_bytes([o, p]),
        }
    }
}

/// How layers are interpolated between keys: [`Path::time`].
pub const TIME_HOLD: u8 = 0;
/// Straight lines between neighbouring keys.
pub const TIME_LINEAR: u8 = 1;
/// Catmull-Rom curves through four keys, a parabola through three at a layer's first and last.
pub const TIME_CUBIC: u8 = 2;

/// How layers are interpolated between nodes: [`Path::space`].
pub const SPACE_LINEAR: u8 = 0;
/// Positions bend between a cell's corners, by as much as the nodes around say; fields are bilinear.
pub const SPACE_CUBIC: u8 = 1;

/// How many keys before an interval's first and after its first one are needed to play it.
#[must_use]
pub const fn reach(time: u8) -> (usize, usize) {
    if time == TIME_CUBIC { (1, 2) } else { (0, 1) }
}

/// One camera path: the screen, the grid, the timeline and the coded keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Path<'a> {
    /// Screen width, pixels, 1..=4096.
    pub width: u16,
    /// Screen height, pixels, 1..=4096.
    pub height: u16,
    /// Frames, at least 1.
    pub frames: u32,
    /// Frames per second.
    pub fps: u16,
    /// Frame 0 follows the last frame.
    pub looping: bool,
    /// A cell is 2^this pixels wide and high, 2..=5.
    pub cell_log2: u8,
    /// [`TIME_HOLD`], [`TIME_LINEAR`] or [`TIME_CUBIC`].
    pub time: u8,
    /// [`SPACE_LINEAR`] or [`SPACE_CUBIC`].
    pub space: u8,
    /// Fraction bits of coordinates, one of [`crate::fixed::KEY_BITS`].
    pub key_bits: u8,
    /// Coordinates are coded in steps of 2^this of their units, 0..=4.
    pub step_log2: u8,
    /// The bounds that memory and work follow from.
    pub limits: Limits,
    /// One [`KEY_BYTES`]-byte entry a key.
    pub table: &'a [u8],
    /// [`crate::plane::PLANE_BYTES`] a flat label that positions are told from, labels ascending.
    pub planes: &'a [u8],
    /// [`crate::plane::CAMERA_BYTES`] a key, where there are planes.
    pub cameras: &'a [u8],
    /// The key records, one after the other.
    pub records: &'a [u8],
}

impl Path<'_> {
    /// Bytes of all that is stored for keys: their records and table, and the planes and cameras that positions are told from.
    #[must_use]
    pub const fn key_bytes(&self) -> usize {
        let told = self.planes.len().saturating_add(self.cameras.len());
        self.records.len().saturating_add(self.table.len()).saturating_add(told)
    }
}

/// Upper bounds, stated by the baker. The player's memory and work follow from them: what a bundle holds beyond them is not
/// played. [`Limits::seek_keys`] is checked against the key table when the bundle is parsed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Limits {
    /// Layers in a key, all nodes together, those of the backdrop left out.
    pub key_layers: u16,
    /// Layers in a row of nodes of a key.
    pub row_layers: u16,
    /// Chains in a key, each of layers of one label at neighbouring nodes of a row.
    pub key_chains: u16,
    /// Chains in a row of nodes.
    pub row_chains: u16,
    /// Layers of a key in chains that some cell tests.
    pub key_fields: u16,
    /// Bytes of a key interval's sheet lists, as [`crate::lists::row_bytes`] counts them.
    pub list_bytes: u16,
    /// Sheets in a row of cells.
    pub row_sheets: u16,
    /// Sheets in a cell.
    pub cell_sheets: u8,
    /// Fields that a layer carries: 0 where no cell tests any, 2 where a tested label is a [`STRIP`].
    pub fields: u8,
    /// Keys decoded by one seek: from an independent key up to the last one that the frame needs. The player keeps to it with what it
    /// decodes ahead counted in.
    pub seek_keys: u16,
}

/// Bytes of a key table entry.
pub const KEY_BYTES: usize = 8;

/// An entry of the key table: four bytes of frame number with the highest bit set on a key that needs no
/// earlier one, four bytes of where its record ends in [`Path::records`]; both little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyEntry {
    /// The frame the key stands at.
    pub frame: u32,
    /// Decoding can start here.
    pub independent: bool,
    /// Where the record ends.
    pub end: u32,
}

impl KeyEntry {
    const INDEPENDENT: u32 = 1 << 31;

    /// The entry's bytes.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; KEY_BYTES] {
        let word = if self.independent { self.frame | Self::INDEPENDENT } else { self.frame };
        let [a, b, c, d] = word.to_le_bytes();
        let [e, f, g, h] = self.end.to_le_bytes();
        [a, b, c, d, e, f, g, h]
    }

    /// The entry in `bytes`.
    #[must_use]
    pub const fn from_bytes(bytes: &[u8; KEY_BYTES]) -> Self {
        let [a, b, c, d, e, f, g, h] = *bytes;
        let word = u32::from_le_bytes([a, b, c, d]);
        Self { frame: word & !Self::INDEPENDENT, independent: word & Self::INDEPENDENT != 0, end: u32::from_le_bytes([e, f, g, h]) }
    }
}
