//! JSON as all files of a run have it.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Disk, OutputError};

/// Indented JSON with a line break at the end.
pub(crate) fn to_json(value: &impl Serialize) -> Vec<u8> {
    let mut bytes = serde_json::to_vec_pretty(value).expect("structs of numbers and text have a JSON form");
    bytes.push(b'\n');
    bytes
}

/// The content of a file of at most so many bytes.
///
/// # Errors
/// [`OutputError::Damaged`], or when the operating system refuses.
pub(crate) fn read_json<T: DeserializeOwned>(
    disk: &dyn Disk,
    path: &Path,
    largest: u64,
) -> Result<T, OutputError> {
    let bytes = disk.read(path, largest).map_err(OutputError::io("read", path))?;
    serde_json::from_slice(&bytes).map_err(OutputError::damaged(path))
}
