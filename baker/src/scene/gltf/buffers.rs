//! The bytes a glTF file names: its binary chunk, data URIs, files beside it; never the network.
//! The document comes from `document`; bytes go to `accessor` and to the textures.

use crate::files::{read as read_file, rooted};
use ::gltf::json::Root;
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
        let data = percent_decode(data);
        return if base64 { decode_base64(&data).map(Location::Data) } else { Ok(Location::Data(data.into_owned())) };
    }
    if let Some((scheme, _)) =
        uri.split_once(':').filter(|(s, _)| s.len() > 1 && s.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b)))
    {
        return Err(format!(
            "URI \"{uri}\": {scheme}: is never fetched; expected a path beside the file: download it and use a relative path"
        ));
    }
    let decoded = percent_decode(uri);
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

fn percent_decode(text: &str) -> Cow<'_, [u8]> {
    let bytes = text.as_bytes();
    if !bytes.contains(&b'%') {
        return Cow::Borrowed(bytes);
    }
    let digit = |i: usize| bytes.get(i).and_then(|b| char::from(*b).to_digit(16));
    let (mut out, mut i) = (Vec::with_capacity(bytes.len()), 0);
    while let Some(&b) = bytes.get(i) {
        match (b, digit(i + 1), digit(i + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((high * 16 + low) as u8);
                i += 3;
            }
            _ => {
                out.push(b);
                i += 1;
            }
        }
    }
    Cow::Owned(out)
}

fn decode_base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let body = match text {
        [body @ .., b'=', b'='] | [body @ .., b'='] => body,
        body => body,
    };
    let mut out = Vec::with_capacity(body.len() / 4 * 3 + 2);
    let (mut bits, mut count) = (0u32, 0);
    for (i, &c) in body.iter().enumerate() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'\r' | b'\n' | b' ' => continue,
            _ => return Err(format!("data URI: character {i} is not base64: the data are damaged")),
        };
        bits = (bits << 6 | u32::from(value)) & 0x00ff_ffff;
        count += 6;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
        }
    }
    if count == 6 {
        return Err("data URI: the base64 text is cut short: fetch or export it again".to_owned());
    }
    Ok(out)
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
        assert_eq!(percent_decode("a%20b%C3%A9%").as_ref(), "a bé%".as_bytes());
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
