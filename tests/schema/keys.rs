//! The keys that the readers ask for are those of the schema, and the defaults are the same.

use std::collections::{BTreeMap, BTreeSet};

use fluxmorph_optimizer::config::{Config, ConfigError, resolved_toml};
use serde_json::Value;

use crate::places::{Step, all, schema_at, tables, value_at};
use crate::verdict::to_toml;
use crate::{bases, places};

/// A key that no table has, and that is near to none.
const UNKNOWN: &str = "zzzzzzzzzz";

/// The tables of a configuration with the names of their definitions; the root has none.
fn tables_of(document: &Value, table: &toml::Table) -> Vec<(places::Path, String)> {
    let mut root = toml::Value::Table(table.clone());
    let paths = std::iter::once(Vec::new()).chain(all(table));
    let is_table = |path: &places::Path, root: &mut toml::Value| value_at(root, path).is_table();
    let named = paths.filter(|path| is_table(path, &mut root)).filter_map(|path| {
        let (name, schema) = schema_at(document, &path)?;
        let name = name.unwrap_or_default().to_owned();
        (schema.get("properties").is_some() && !name.ends_with("Overlay")).then_some((path, name))
    });
    named.collect()
}

/// What a reader says it knows, from its answer to an unknown key.
fn known(table: &toml::Table, path: &[Step]) -> Vec<String> {
    let mut root = toml::Value::Table(table.clone());
    let Some(inner) = value_at(&mut root, path).as_table_mut() else { return Vec::new() };
    inner.insert(UNKNOWN.to_owned(), true.into());
    let text = toml::to_string(&root).expect("a table can be written");
    let Err(ConfigError::Invalid(report)) = Config::from_str(&text, "probe.toml") else {
        panic!("{path:?}: an unknown key was accepted")
    };
    let fault = report.diagnostics.iter().find(|fault| fault.message.contains(UNKNOWN));
    let known =
        fault.and_then(|fault| fault.expected.as_deref()).unwrap_or_else(|| panic!("{path:?}: {report}"));
    known.trim_start_matches("known: ").split(", ").map(str::to_owned).collect()
}

#[test]
fn the_readers_ask_for_the_keys_of_the_schema_and_no_others() {
    let document = fluxmorph_optimizer::schema::document();
    let mut asked: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (_, table) in bases::all() {
        for (path, name) in tables_of(&document, &table) {
            // A table without keys of its own, such as the random design, has no definition: its keys go under none.
            if name.is_empty() && !path.is_empty() {
                continue;
            }
            asked.entry(name).or_default().extend(known(&table, &path));
        }
    }
    let written: BTreeMap<String, BTreeSet<String>> =
        tables(&document).map(|(name, keys)| (name.to_owned(), keys.keys().cloned().collect())).collect();
    for name in asked.keys().chain(written.keys()) {
        assert_eq!(asked.get(name), written.get(name), "keys of the reader and of the schema in `{name}`");
    }
    let count: usize = written.values().map(BTreeSet::len).sum();
    println!("{count} keys in {} tables, the same in readers and schema", written.len());
    assert!(count > 200);
}

/// The configuration with a key of a table left out, or written.
fn with_key(table: &toml::Table, path: &[Step], key: &str, value: Option<toml::Value>) -> Option<String> {
    let mut root = toml::Value::Table(table.clone());
    let inner = value_at(&mut root, path).as_table_mut()?;
    match value {
        Some(value) => inner.insert(key.to_owned(), value),
        None => inner.remove(key),
    };
    let text = toml::to_string(&root).expect("a table can be written");
    Config::from_str(&text, "default.toml").ok().map(|(config, _)| resolved_toml(&config))
}

#[test]
fn a_key_with_its_default_is_a_key_left_out() {
    let document = fluxmorph_optimizer::schema::document();
    let (mut compared, mut all_keys) = (BTreeSet::new(), BTreeSet::new());
    for (name, keys) in tables(&document) {
        let with_default = keys.iter().filter(|(_, property)| property.get("default").is_some());
        all_keys.extend(with_default.map(|(key, _)| (name.to_owned(), key.clone())));
    }
    for (base, table) in bases::all() {
        // A case keeps its tables as they are written, defaults included.
        let in_a_case = |path: &places::Path| path.contains(&Step::Key("case".to_owned()));
        for (path, name) in tables_of(&document, &table).into_iter().filter(|(path, _)| !in_a_case(path)) {
            for (_, key) in all_keys.iter().filter(|(table, _)| *table == name) {
                let (_, schema) = schema_at(&document, &path).expect("a table of the schema");
                let Some(default) = schema["properties"][key].get("default") else { continue };
                let written = with_key(&table, &path, key, Some(to_toml(default)));
                let left_out = with_key(&table, &path, key, None);
                // Where either is refused, other keys of the table exclude it.
                if let (Some(written), Some(left_out)) = (written, left_out) {
                    assert_eq!(written, left_out, "{base}: default of `{key}` in `{name}`");
                    compared.insert((name.clone(), key.clone()));
                }
            }
        }
    }
    println!("{} defaults of the schema are those of the readers", compared.len());
    let missed: Vec<_> = all_keys.difference(&compared).collect();
    assert!(missed.is_empty(), "no configuration tests the default of {missed:?}");
}
