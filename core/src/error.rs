//! What can go wrong at the two doors: parsing a bundle, giving a player its memory.
//! Rendering has no errors: after `parse` every accessor is total.

use crate::format::TexelKind;
use core::fmt;

/// Why bytes are not a bundle that this player can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BundleError {
    /// The bytes do not start with the magic of a bundle.
    NotABundle,
    /// The envelope ends early or is not well-formed.
    Truncated {
        /// Bytes given.
        length: usize,
    },
    /// Bytes follow the end of the bundle: [`crate::Bundle::parse_first`] lets them.
    TrailingBytes {
        /// How many.
        count: usize,
    },
    /// A version of the format that this player does not know.
    Version {
        /// The version it knows.
        expected: u16,
        /// The version found.
        found: u16,
    },
    /// The checksum over the bundle does not match: it was damaged.
    Checksum {
        /// The CRC-32 stored in the bundle.
        expected: u32,
        /// The CRC-32 of its bytes.
        found: u32,
    },
    /// A required section that this player does not know.
    UnknownSection {
        /// Its tag.
        tag: [u8; 4],
    },
    /// A required section is not there, or not well-formed.
    Section {
        /// Its tag.
        tag: [u8; 4],
    },
    /// A field holds a value that no player could work with.
    Field {
        /// Section and name of the field.
        name: &'static str,
        /// The value found.
        found: u32,
    },
    /// A section's data has the wrong length.
    Length {
        /// Section and name of the data.
        name: &'static str,
        /// Bytes the header asks for.
        expected: usize,
        /// Bytes there are.
        found: usize,
    },
    /// An entry of the key table is out of order or points outside the key data.
    Key {
        /// The key's index.
        key: u32,
    },
}

impl fmt::Display for BundleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotABundle => f.write_str("not a Cubist bundle: the magic is missing"),
            Self::Truncated { length } => write!(f, "the bundle is cut short or damaged: its envelope does not fit into {length} bytes"),
            Self::TrailingBytes { count } => write!(f, "{count} bytes follow the end of the bundle"),
            Self::Version { expected, found } => write!(f, "format version {found}; this player knows version {expected}"),
            Self::Checksum { expected, found } => write!(f, "damaged: checksum {found:08x}, expected {expected:08x}"),
            Self::UnknownSection { tag } => write!(f, "the bundle requires section \"{}\", which this player does not know", Tag(tag)),
            Self::Section { tag } => write!(f, "section \"{}\" is missing or damaged", Tag(tag)),
            Self::Field { name, found } => write!(f, "{name}: {found} is out of range"),
            Self::Length { name, expected, found } => write!(f, "{name}: expected {expected} bytes, found {found}"),
            Self::Key { key } => write!(f, "key table: entry {key} is out of order or outside the key data"),
        }
    }
}

impl core::error::Error for BundleError {}

/// A section tag as text, unprintable bytes as dots.
struct Tag([u8; 4]);

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for byte in self.0 {
            fmt::Write::write_char(f, if byte.is_ascii_graphic() { char::from(byte) } else { '.' })?;
        }
        Ok(())
    }
}

/// Why there is no player of a bundle in the memory it was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MemoryError {
    /// Fewer bytes than [`crate::Player::memory_needed`] says.
    TooSmall {
        /// Bytes needed.
        needed: usize,
        /// Bytes given.
        given: usize,
    },
    /// The bundle's texels are of another kind than those that the player's type names ([`crate::Texels`]).
    Texels {
        /// What the bundle needs a player of.
        needed: TexelKind,
    },
}

impl fmt::Display for MemoryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooSmall { needed, given } => write!(f, "this bundle needs {needed} bytes of working memory, {given} were given"),
            Self::Texels { needed } => {
                let (texels, player) = match needed {
                    TexelKind::Indexed8 => ("8-bit indices", "Player<Indexed8>"),
                    TexelKind::Indexed4 => ("4-bit indices", "Player<Indexed4>"),
                    TexelKind::Direct565 => ("RGB565", "Player<Direct565>"),
                };
                write!(f, "this bundle's texels are {texels}, which a {player} or a Player<AnyTexels> plays, and this player does not")
            }
        }
    }
}

impl core::error::Error for MemoryError {}
