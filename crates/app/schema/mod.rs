//! The JSON schema of the configuration, for editors and other programs, and the page made from it.
//!
//! What a key is, its range and its words stand at the types of [`crate::config`]: this module turns them into one
//! document. Nothing here knows a key; `form` and `rules` are the vocabulary of the attributes there.

pub(crate) mod form;
mod overlay;
mod page;
mod prose;
mod quantities;
pub(crate) mod rules;
mod tidy;

use schemars::generate::SchemaSettings;
use schemars::transform::Transform;
use serde_json::{Map, Value};

pub use page::page;

use crate::config::Config;

/// Name of the document: it is part of the program, and fetched from nowhere.
const ID: &str = "urn:fluxmorph:configuration";

/// The schema, draft 2020-12.
pub fn document() -> Value {
    let mut schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<Config>();
    tidy::Tidy.transform(&mut schema);
    let mut document = schema.to_value();
    let Some(keywords) = document.as_object_mut() else { return document };
    keywords.insert("$id".into(), ID.into());
    keywords.insert("title".into(), "Configuration of Fluxmorph".into());
    let mut definitions = match keywords.shift_remove("$defs") {
        Some(Value::Object(definitions)) => definitions,
        _ => Map::new(),
    };
    let mut named = Vec::new();
    references(&Value::Object(definitions.clone()), &mut named);
    named.iter().for_each(|name| overlay::complete(&mut definitions, name));
    // Definitions of values are made in full, and those are kept that something refers to.
    definitions.extend(quantities::definitions());
    let mut named = Vec::new();
    references(&Value::Object(keywords.clone()), &mut named);
    let mut known = 0;
    while known < named.len() {
        if let Some(definition) = definitions.get(&named[known]).cloned() {
            let mut more = Vec::new();
            references(&definition, &mut more);
            more.retain(|name| !named.contains(name));
            named.extend(more);
        }
        known += 1;
    }
    definitions.retain(|name, _| named.contains(name));
    definitions.sort_keys();
    let mut ordered = Map::new();
    for keyword in ["$schema", "$id", "title"] {
        ordered.extend(keywords.shift_remove(keyword).map(|value| (keyword.to_owned(), value)));
    }
    ordered.extend(std::mem::take(keywords));
    ordered.insert("$defs".into(), definitions.into());
    ordered.into()
}

/// The schema as it is printed and shipped.
pub fn text() -> String {
    let mut text = serde_json::to_string_pretty(&document()).expect("a document of texts and numbers");
    text.push('\n');
    text
}

/// Names of all definitions that are referred to.
fn references(value: &Value, named: &mut Vec<String>) {
    match value {
        Value::Object(keywords) => {
            for (keyword, value) in keywords {
                match value.as_str().and_then(|name| name.strip_prefix("#/$defs/")) {
                    Some(name) if keyword == "$ref" => named.push(name.to_owned()),
                    _ => references(value, named),
                }
            }
        }
        Value::Array(items) => items.iter().for_each(|item| references(item, named)),
        _ => {}
    }
}
