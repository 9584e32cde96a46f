//! The bytes a glTF file names: its binary chunk, data URIs, files beside it; never the network.
//! The document comes from `document`; bytes go to `accessor` and to the textures.

use crate::files::{read as read_file, rooted};
use ::gltf::json::Root;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use base64::{DecodeError, Engine, alphabet};
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// All buffers of a document.
pub(crate) struct Buffers(Vec<Vec<u8>>);

impl Buffers {
    /// Loads every buffer; errors name the buffer, and the file it should come from.
    pub fn load(root: &Root, mut blob: Option<Vec<u8>>, folder: &Path) -> Result<Self, String> {
        let mut all = Vec::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                Some(uri) => fetch(uri, folder).map_err(|e| format!("buffer {i}: {e}"))?,
                None if i == 0 => blob
                    .take()
                    .ok_or_else(|| format!("buffer {i}: no uri, and the file has no binary chunk: data are missing: export it again"))?,
                None => return Err(format!("buffer {i}: no uri: data are missing: export the file again")),
            };
            let expected = buffer.byte_length.0;
            if (bytes.len() as u64) < expected {
                return Err(format!(
                    "buffer {i}: {} bytes; byteLength promises {expected}: the data are cut short: fetch or export them again",
                    bytes.len()
                ));
            }
            all.push(bytes);
        }
        Ok(Self(all))
    }

    /// The bytes of buffer view `index`, and its stride if it has one.
    pub fn view(&self, root: &Root, index: usize) -> Result<(&[u8], Option<usize>), String> {
        let view = root.buffer_views.get(index).ok_or_else(|| format!("bufferView {index} of {}", root.buffer_views.len()))?;
        let buffer = view.buffer.value();
        let bytes = self.0.get(buffer).ok_or_else(|| format!("bufferView {index}: buffer {buffer} of {}", self.0.len()))?;
        let (start, length) = (view.byte_offset.map_or(0, |o| o.0), view.byte_length.0);
        let end = start.checked_add(length).filter(|end| *end <= bytes.len() as u64).ok_or_else(|| {
            format!("bufferView {index}: bytes {start} to {} of buffer {buffer}, which has {}", start.saturating_add(length), bytes.len())
        })?;
        Ok((&bytes[start as usize..end as usize], view.byte_stride.map(|s| s.0)))
    }
}

/// The bytes of a URI: data, or a file relative to `folder`.
pub(crate) fn fetch(uri: &str, folder: &Path) -> Result<Vec<u8>, String> {
    match locate(uri, folder)? {
        Location::Data(bytes) => Ok(bytes),
        Location::File(path) => read_file(&path).map_err(|e| format!("{}: {e}", path.display())),
    }
}

/// Where a URI leads.
pub(crate) enum Location {
    Data(Vec<u8>),
    File(PathBuf),
}

/// Resolves a URI; only data URIs and relative paths are taken. Those may lead up and down again, as in `../textures/wall.png`: models in
/// folders of their own beside their textures are usual. A path from the root is right on one machine only, and on another leads to what is
/// none of the model's.
pub(crate) fn locate(uri: &str, folder: &Path) -> Result<Location, String> {
    if let Some(rest) = uri.strip_prefix("data:") {
        let (kind, data) = rest.split_once(',').ok_or("data URI: no comma before the data")?;
        let mut parameters = kind.split(';').skip(1).peekable();
        let mut base64 = false;
        while let Some(p) = parameters.next() {
            match p {
                "base64" if parameters.peek().is_none() => base64 = true,
                p if p.contains('=') => {}
                p => return Err(format!("data URI: parameter \"{p}\"; expected name=value or base64")),
            }
        }
        let data: Cow<'_, [u8]> = percent_decode_str(data).into();
        return if base64 { decode_base64(&data) } else { Ok(data.into_owned()) }.map(Location::Data);
    }
    if let Some((scheme, _)) =
        uri.split_once(':').filter(|(s, _)| s.len() > 1 && s.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b)))
    {
        return Err(format!(
            "URI \"{uri}\": {scheme}: is never fetched; expected a path beside the file: download it and use a relative path"
        ));
    }
    let decoded: Cow<'_, [u8]> = percent_decode_str(uri).into();
    if rooted(uri.as_bytes()) || rooted(&decoded) {
        return Err(format!("URI \"{uri}\": an absolute path is not read; expected one relative to the file: put what it names beside it"));
    }
    let path = folder.join(String::from_utf8_lossy(&decoded).as_ref());
    // Some exporters do not encode: a file really called "a%20b.bin" is taken as well.
    let plain = folder.join(uri);
    let path = if !path.exists() && plain.exists() { plain } else { path };
    let slashed = folder.join(uri.replace('\\', "/"));
    Ok(Location::File(if !path.exists() && slashed.exists() { slashed } else { path }))
}

/// Base64 without padding, whatever the bits are that the last character has too many.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::RequireNone).with_decode_allow_trailing_bits(true),
);

/// Decodes base64 as exporters write it: in lines or not, padded or not, of the alphabet for URLs or the usual one.
fn decode_base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let shown = text.iter().filter(|c| !matches!(c, b'\r' | b'\n' | b' '));
    let usual = |c: &u8| match c {
        b'-' => b'+',
        b'_' => b'/',
        other => *other,
    };
    let mut plain: Vec<u8> = shown.map(usual).collect();
    let padding = plain.iter().rev().take(2).take_while(|c| **c == b'=').count();
    plain.truncate(plain.len() - padding);
    BASE64.decode(&plain).map_err(|e| match e {
        DecodeError::InvalidLength(_) => "data URI: the base64 text is cut short: fetch or export it again".to_owned(),
        other => format!("data URI: no base64 ({other}): the data are damaged: fetch or export the file again"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_and_percent_decoding() {
        assert_eq!(decode_base64(b"Zm9vYmE=").unwrap(), b"fooba");
        assert_eq!(decode_base64(b"Zm9vYg==").unwrap(), b"foob");
        assert_eq!(decode_base64(b"Zm9vYmFy").unwrap(), b"foobar");
        assert!(decode_base64(b"Zm9v!").is_err());
        assert!(decode_base64(b"Zm9vY").is_err());
        assert_eq!(decode_base64(b"Zm9v\r\nYg").unwrap(), b"foob");
        assert_eq!(decode_base64(b"-_-_").unwrap(), [0xfb, 0xff, 0xbf]);
        assert_eq!(fetch("data:,a%20b%C3%A9%", Path::new("")).unwrap(), "a bé%".as_bytes());
    }

    #[test]
    fn the_network_is_never_asked() {
        for uri in ["http://example.com/a.bin", "https://x/y", "file:///etc/passwd", "ftp://x"] {
            assert!(fetch(uri, Path::new("/nowhere")).unwrap_err().contains("never fetched"), "{uri}");
        }
        for uri in ["/etc/passwd", "%2Fetc/passwd", "//server/a.bin", "\\\\server\\a.bin", "C:\\a.bin", "c%3A/a.bin"] {
            assert!(fetch(uri, Path::new("/nowhere")).unwrap_err().contains("an absolute path is not read"), "{uri}");
        }
        assert!(fetch("data:application/octet-stream;;base64,AA==", Path::new("")).unwrap_err().contains("parameter"));
        assert_eq!(fetch("data:;base64,AAE=", Path::new("")).unwrap(), [0, 1]);
    }
}
