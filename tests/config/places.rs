//! Where one is in a configuration, and what the schema says there.

use serde_json::{Map, Value};

/// One step into a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Step {
    /// Into a table.
    Key(String),
    /// Into a list.
    Item(usize),
}

/// A way into a configuration.
pub(crate) type Path = Vec<Step>;

/// All ways to values, tables and lists included; the root is left out.
pub(crate) fn all(table: &toml::Table) -> Vec<Path> {
    fn walk(value: &toml::Value, path: &Path, found: &mut Vec<Path>) {
        let mut enter = |step: Step, value: &toml::Value| {
            let mut path = path.clone();
            path.push(step);
            found.push(path.clone());
            walk(value, &path, found);
        };
        match value {
            toml::Value::Table(table) => {
                table.iter().for_each(|(key, value)| enter(Step::Key(key.clone()), value));
            }
            toml::Value::Array(items) => {
                items.iter().enumerate().for_each(|(index, item)| enter(Step::Item(index), item));
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    walk(&toml::Value::Table(table.clone()), &Vec::new(), &mut found);
    found
}

/// The value at the end of a way.
pub(crate) fn value_at<'a>(root: &'a mut toml::Value, path: &[Step]) -> &'a mut toml::Value {
    path.iter().fold(root, |value, step| match (step, value) {
        (Step::Key(key), toml::Value::Table(table)) => table.get_mut(key).expect("a key that is there"),
        (Step::Item(index), toml::Value::Array(items)) => &mut items[*index],
        _ => panic!("no such step"),
    })
}

/// What a reference leads to, through any number of them, with the name of the last.
pub(crate) fn resolved<'a>(document: &'a Value, mut schema: &'a Value) -> (Option<&'a str>, &'a Value) {
    let mut name = None;
    while let Some(next) = schema.get("$ref").and_then(Value::as_str) {
        name = next.strip_prefix("#/$defs/");
        schema = &document["$defs"][name.expect("references lead to definitions")];
    }
    (name, schema)
}

/// The schema at the end of a way, with the name of its definition; `None` where it says nothing of its own.
pub(crate) fn schema_at<'a>(document: &'a Value, path: &[Step]) -> Option<(Option<&'a str>, &'a Value)> {
    let mut here = (None, document);
    for step in path {
        let alternatives: Vec<&Value> = match here.1.get("anyOf").and_then(Value::as_array) {
            Some(several) => several.iter().map(|one| resolved(document, one).1).collect(),
            None => vec![here.1],
        };
        let next = alternatives.into_iter().find_map(|schema| match step {
            Step::Key(key) => schema
                .get("properties")
                .and_then(|properties| properties.get(key))
                .or_else(|| schema.get("additionalProperties").filter(|other| other.is_object())),
            Step::Item(_) => schema.get("items"),
        })?;
        here = resolved(document, next);
    }
    Some(here)
}

/// Every table definition with its keys, but for those laid over others.
pub(crate) fn tables(document: &Value) -> impl Iterator<Item = (&str, &Map<String, Value>)> {
    let definitions = document["$defs"].as_object().expect("definitions");
    let named = definitions
        .iter()
        .filter(|(name, _)| !name.ends_with("Overlay"))
        .filter_map(|(name, schema)| Some((name.as_str(), schema.get("properties")?.as_object()?)));
    std::iter::once(("", document["properties"].as_object().expect("tables"))).chain(named)
}
