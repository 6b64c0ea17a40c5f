//! Every key of every table, for advice on keys that are unknown where they stand.

use std::collections::BTreeSet;
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
        collect("", &document, &document, &mut keys, &mut BTreeSet::new());
        keys
    });
    &KEYS
}

/// Enters the tables inside a table, each definition where it comes first.
fn collect<'d>(
    path: &str,
    table: &'d Value,
    document: &'d Value,
    known: &mut KnownKeys,
    entered: &mut BTreeSet<&'d str>,
) {
    for (key, property) in table["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let forms = [
            (property, format!("[{path}]")),
            (&property["items"], format!("[[{path}]]")),
            (&property["additionalProperties"], format!("[{path}.NAME]")),
        ];
        for (schema, header) in forms {
            let name = schema["$ref"].as_str().and_then(|name| name.strip_prefix(DEFINITIONS));
            let Some(name) = name.filter(|name| !name.ends_with(SUFFIX)) else { continue };
            let inner = &document["$defs"][name];
            let Some(keys) = inner["properties"].as_object().filter(|_| entered.insert(name)) else {
                continue;
            };
            known.enter(&header, keys.keys());
            collect(&path, inner, document, known, entered);
        }
    }
}
