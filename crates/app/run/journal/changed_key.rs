//! Which key of a configuration is another than when a run began, for the message that refuses to resume it.

use toml::{Table, Value};

use crate::config::{Config, resolved_toml};
use crate::files::RunDirectory;

/// Largest file that is compared [bytes].
const LARGEST: u64 = 1 << 24;

/// What [`configuration_hash`](super::configuration_hash) leaves out, beside the paths of B–H tables.
const OF_NO_ACCOUNT: [&str; 6] =
    ["title", "probes", "output", "optimizer.max_evaluations", "optimizer.max_time", "mesh.file"];

/// The first key that differs from `resolved.toml` of the run, which it has from its beginning; `None` where there is none, or no such
/// file to read.
pub(in crate::run) fn changed_key(directory: &RunDirectory, config: &Config) -> Option<String> {
    let bytes = directory.disk().read(&directory.resolved(), LARGEST).ok()?;
    let was: Table = std::str::from_utf8(&bytes).ok()?.parse().ok()?;
    let is: Table = resolved_toml(config).parse().ok()?;
    difference("", &Value::Table(was), &Value::Table(is))
}

/// The first place below `path` at which two values differ.
fn difference(path: &str, was: &Value, is: &Value) -> Option<String> {
    match (was, is) {
        (Value::Table(was), Value::Table(is)) => was.keys().chain(is.keys()).find_map(|key| {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            match (was.get(key), is.get(key)) {
                _ if OF_NO_ACCOUNT.contains(&path.as_str()) || key == "bh_file" => None,
                (Some(was), Some(is)) => difference(&path, was, is),
                _ => Some(path),
            }
        }),
        (Value::Array(was), Value::Array(is)) if was.len() == is.len() => {
            let mut pairs = was.iter().zip(is).enumerate();
            pairs.find_map(|(k, (was, is))| difference(&format!("{path}[{k}]"), was, is))
        }
        _ => (was != is).then(|| path.to_owned()),
    }
}
