//! JSON as all files of a run have it.

use serde::Serialize;

/// Indented JSON with a line break at the end.
pub(crate) fn to_json(value: &impl Serialize) -> Vec<u8> {
    let mut bytes = serde_json::to_vec_pretty(value).expect("structs of numbers and text have a JSON form");
    bytes.push(b'\n');
    bytes
}
