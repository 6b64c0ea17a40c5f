//! The schema as one document, from the declarations of the tables.

use serde_json::{Map, Value};

use crate::config::table::{Table, describe};
use crate::config::tables::Config;
use crate::config::value::definitions::Definitions;

/// Name of the document: it is part of the program, and fetched from nowhere.
const ID: &str = "urn:fluxmorph:configuration";

/// The schema, draft 2020-12.
pub fn document() -> Value {
    let mut definitions = Definitions::default();
    let root = describe::<Config>(&mut definitions).into_schema(Config::ABOUT);
    let head = [
        ("$schema", "https://json-schema.org/draft/2020-12/schema"),
        ("$id", ID),
        ("title", "Configuration of Fluxmorph"),
    ];
    let mut document: Map<String, Value> =
        head.into_iter().map(|(keyword, value)| (keyword.to_owned(), value.into())).collect();
    document.extend(root);
    document.insert("$defs".into(), definitions.into_value());
    document.into()
}

/// The schema as it is printed and shipped.
pub fn text() -> String {
    let mut text = serde_json::to_string_pretty(&document()).expect("a document of texts and numbers");
    text.push('\n');
    text
}
