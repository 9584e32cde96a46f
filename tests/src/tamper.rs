//! Bundles changed from within: the envelope taken apart, altered, put together and sealed again. Bundles come from the tests, and go back
//! to them as ones that only their contents can give away.

use anyhow::{Context, Result};
use cubist_core::checksum;
use cubist_core::format::Envelope;

/// Puts the checksum at the end of `bytes` right.
pub fn seal(bytes: &mut [u8]) {
    if let Some(body) = bytes.len().checked_sub(4) {
        let sum = checksum(&bytes[..body]).to_le_bytes();
        bytes[body..].copy_from_slice(&sum);
    }
}

/// `bytes` with `change` made to the envelope.
///
/// # Errors
/// The bytes hold no envelope.
pub fn enveloped<'a>(bytes: &'a [u8], change: impl FnOnce(&mut Envelope<'a>)) -> Result<Vec<u8>> {
    let mut envelope: Envelope<'a> = postcard::take_from_bytes(bytes).context("read the envelope")?.0;
    change(&mut envelope);
    let mut bytes = postcard::to_stdvec(&envelope).context("write the envelope")?;
    bytes.extend([0; 4]);
    seal(&mut bytes);
    Ok(bytes)
}

/// `bytes` with the contents of the section `tag` replaced.
///
/// # Errors
/// The bytes hold no envelope, or it has no such section.
pub fn with_section<'a>(bytes: &'a [u8], tag: [u8; 4], section: &'a [u8]) -> Result<Vec<u8>> {
    let mut found = false;
    let changed = enveloped(bytes, |envelope| {
        for own in envelope.sections.iter_mut().filter(|own| own.tag == tag) {
            (own.bytes, found) = (section, true);
        }
    })?;
    anyhow::ensure!(found, "there is no section {}", tag.escape_ascii());
    Ok(changed)
}
