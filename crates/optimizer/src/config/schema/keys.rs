//! Every key of every table, for advice on keys that are unknown where they stand.

use std::sync::LazyLock;

use serde_json::Value;

use super::definitions::DEFINITIONS;
use super::document;
use super::overlay::SUFFIX;
use crate::config::section::KnownKeys;

/// The keys of the configuration.
pub(in crate::config) fn known_keys() -> &'static KnownKeys {
    static KEYS: LazyLock<KnownKeys> = LazyLock::new(|| {
        let document = document();
        let mut keys = KnownKeys::default();
        collect("", &document, &document, &mut keys);
        keys
    });
    &KEYS
}

/// Enters the tables inside a table.
fn collect(path: &str, table: &Value, document: &Value, known: &mut KnownKeys) {
    for (key, property) in table["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let forms = [
            (property, format!("[{path}]")),
            (&property["items"], format!("[[{path}]]")),
            (&property["additionalProperties"], format!("[{path}.NAME]")),
        ];
        for (schema, header) in forms {
            let name = schema["$ref"].as_str().and_then(|name| name.strip_prefix(DEFINITIONS));
            let Some(inner) = name.filter(|name| !name.ends_with(SUFFIX)).map(|name| &document["$defs"][name]) else {
                continue;
            };
            let Some(keys) = inner["properties"].as_object() else { continue };
            if known.enter(&header, keys.keys()) {
                collect(&path, inner, document, known);
            }
        }
    }
}
