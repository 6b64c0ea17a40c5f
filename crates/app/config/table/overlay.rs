//! Tables that are laid over complete ones, as those of `[[morph.case]]`: nothing is required, and no rule holds yet.

use serde_json::{Value, json};

use crate::config::value::definitions::{DEFINITIONS, Definitions, Keywords};

/// What the names of such definitions end with.
pub(in crate::config) const SUFFIX: &str = "Overlay";

/// A reference to the overlay of a table that is defined; it is made from that.
pub(in crate::config) fn reference(definitions: &mut Definitions, table: &str) -> Keywords {
    definitions.reference(&format!("{table}{SUFFIX}"), |definitions| overlay(definitions, table))
}

fn overlay(definitions: &mut Definitions, table: &str) -> Value {
    let mut properties = Keywords::new();
    let complete = definitions.get(table).and_then(|schema| schema["properties"].as_object()).cloned();
    for (key, mut property) in complete.into_iter().flatten() {
        if let Some(property) = property.as_object_mut() {
            property.shift_remove("default");
            if let Some(table) = table_of(property, definitions) {
                property.extend(reference(definitions, &table));
            } else if may_be_list(property) {
                allow_items(property);
            }
        }
        properties.insert(key, property);
    }
    json!({
        "description": "Keys that differ from those of the table outside of the cases.",
        "type": "object",
        "additionalProperties": false,
        "properties": properties,
    })
}

/// Name of the table that a property refers to.
fn table_of(property: &Keywords, definitions: &Definitions) -> Option<String> {
    let name = property.get("$ref")?.as_str()?.strip_prefix(DEFINITIONS)?;
    definitions.get(name)?.get("properties").map(|_| name.to_owned())
}

fn may_be_list(property: &Keywords) -> bool {
    let alternatives = property.get("anyOf").and_then(Value::as_array).into_iter().flatten();
    property.get("type").is_some_and(|kind| kind == "array")
        || alternatives.filter_map(Value::as_object).any(may_be_list)
}

/// A list may also be changed item by item: `sizes.0.size = "2 mm"`.
fn allow_items(property: &mut Keywords) {
    let description = property.shift_remove("description");
    let whole = std::mem::take(property);
    property.extend(description.map(|description| ("description".to_owned(), description)));
    let items = json!({
        "description": "Items by their number, counted from 0.",
        "type": "object",
        "propertyNames": { "pattern": r"^\+?[0-9]+$" },
    });
    property.insert("anyOf".into(), json!([whole, items]));
}
