//! Journals whose checksums are right: no mutation would ever find one by itself.

/// Bytes of the mark and of the version of the form, before the header's length.
const HEAD: usize = 12;

/// Bytes of a checksum: the first of BLAKE3 over the checksum before it and what lies between.
const CHECKSUM: usize = 16;

/// The end of the part that starts at `start`, whose length stands behind `before` bytes, without its checksum; `None`
/// where the bytes end earlier.
fn end(bytes: &[u8], start: usize, before: usize) -> Option<usize> {
    let at = start.checked_add(before)?;
    let length = u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?) as usize;
    let end = at.checked_add(4)?.checked_add(length)?;
    (end.checked_add(CHECKSUM)? <= bytes.len()).then_some(end)
}

/// Replaces the checksums of header and records, as far as their lengths fit into the bytes.
pub fn sign(bytes: &mut [u8]) {
    let mut chain = [0; CHECKSUM];
    let (mut start, mut before) = (0, HEAD);
    while let Some(end) = end(bytes, start, before) {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&chain).update(&bytes[start..end]);
        chain.copy_from_slice(&hasher.finalize().as_bytes()[..CHECKSUM]);
        bytes[end..end + CHECKSUM].copy_from_slice(&chain);
        (start, before) = (end + CHECKSUM, 0);
    }
}
