//! The JSON schema of the configuration, for editors and other programs, and the page made from it.
//!
//! What a key is, its range and its words stand in the declarations of the tables: this module turns them into one
//! document. Nothing here knows a key.

pub(super) mod definitions;
pub(super) mod description;
pub(super) mod keys;
pub(super) mod overlay;
mod page;
mod prose;
pub(super) mod rules;

use serde_json::{Map, Value};

pub use page::page;

use super::table::Table;
use super::tables::Config;
use definitions::Definitions;
use description::Description;

/// Name of the document: it is part of the program, and fetched from nowhere.
const ID: &str = "urn:fluxmorph:configuration";

/// The schema, draft 2020-12.
pub fn document() -> Value {
    let mut definitions = Definitions::default();
    let root = Description::of::<Config>(&mut definitions).into_schema(Config::ABOUT);
    let head = [
        ("$schema", "https://json-schema.org/draft/2020-12/schema"),
        ("$id", ID),
        ("title", "Configuration of Fluxmorph"),
    ];
    let mut document: Map<String, Value> =
        head.into_iter().map(|(keyword, value)| (keyword.to_owned(), value.into())).collect();
    if let Value::Object(root) = root {
        document.extend(root);
    }
    document.insert("$defs".into(), definitions.into_value());
    document.into()
}

/// The schema as it is printed and shipped.
pub fn text() -> String {
    let mut text = serde_json::to_string_pretty(&document()).expect("a document of texts and numbers");
    text.push('\n');
    text
}
