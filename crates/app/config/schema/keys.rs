//! Every key of every table, for advice on keys that are unknown where they stand.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use serde_json::Value;

use super::document::document;
use crate::config::table::overlay::SUFFIX;
use crate::config::value::KnownKeys;
use crate::config::value::definitions::DEFINITIONS;

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

#[cfg(test)]
mod tests {
    use super::known_keys;

    #[test]
    fn tables_are_found_by_key_path() {
        let keys = known_keys();
        let has = |path: &str, key: &str| {
            keys.table(path).is_some_and(|(_, keys)| keys.iter().any(|own| own == key))
        };
        assert!(has("coils[3]", "half_window"));
        assert!(has("materials.soft steel", "density"));
        assert!(has("morph.motion[0].rotation", "angle"));
        assert!(keys.table("nothing").is_none());
        assert_eq!(keys.table("coils").map(|(header, _)| header), Some("[[coils]]"));
    }

    #[test]
    fn the_tables_of_a_key_are_named_without_its_own() {
        let keys = known_keys();
        assert_eq!(keys.owners("frequency", "mesh")[0], "[analysis]");
        assert_eq!(keys.owners("algorithm", "design"), ["[optimizer]"]);
        assert_eq!(keys.owners("angle", "morph.motion[1].rotation"), [""; 0]);
        assert_eq!(keys.owners("nothing", ""), [""; 0]);
    }
}
