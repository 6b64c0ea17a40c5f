//! Tables that are laid over complete ones, as those of `[[morph.case]]`: nothing is required, and no rule holds yet.

use serde_json::{Map, Value, json};

/// What the names of such definitions end with.
pub(super) const SUFFIX: &str = "Overlay";

/// Where definitions are.
const DEFINITIONS: &str = "#/$defs/";

/// Makes every definition of an overlay that is referred to, from the complete table of the same name.
pub(super) fn complete(definitions: &mut Map<String, Value>, named: &str) {
    if definitions.contains_key(named) {
        return;
    }
    let Some(mut schema) = named.strip_suffix(SUFFIX).and_then(|table| definitions.get(table)).cloned()
    else {
        return;
    };
    let Some(keywords) = schema.as_object_mut() else { return };
    keywords.retain(|keyword, _| {
        ["description", "type", "properties", "additionalProperties"].contains(&keyword.as_str())
    });
    keywords.insert(
        "description".into(),
        "Keys that differ from those of the table outside of the cases.".into(),
    );
    let mut inner = Vec::new();
    if let Some(Value::Object(properties)) = keywords.get_mut("properties") {
        for property in properties.values_mut().filter_map(Value::as_object_mut) {
            property.shift_remove("default");
            if let Some(table) = table_of(property, definitions) {
                let overlay = format!("{table}{SUFFIX}");
                property.insert("$ref".into(), format!("{DEFINITIONS}{overlay}").into());
                inner.push(overlay);
            } else if may_be_list(property, definitions) {
                allow_items(property);
            }
        }
    }
    definitions.insert(named.to_owned(), schema);
    inner.iter().for_each(|name| complete(definitions, name));
}

/// Name of the table that a property refers to.
fn table_of<'a>(property: &'a Map<String, Value>, definitions: &Map<String, Value>) -> Option<&'a str> {
    let name = property.get("$ref")?.as_str()?.strip_prefix(DEFINITIONS)?;
    definitions.get(name)?.get("properties").map(|_| name)
}

fn may_be_list(schema: &Map<String, Value>, definitions: &Map<String, Value>) -> bool {
    let named = schema.get("$ref").and_then(Value::as_str).and_then(|name| name.strip_prefix(DEFINITIONS));
    let referred = named.and_then(|name| definitions.get(name)).and_then(Value::as_object);
    let alternatives = schema.get("anyOf").and_then(Value::as_array).into_iter().flatten();
    schema.get("type").is_some_and(|kind| kind == "array")
        || referred.is_some_and(|schema| may_be_list(schema, definitions))
        || alternatives.filter_map(Value::as_object).any(|schema| may_be_list(schema, definitions))
}

/// A list may also be changed item by item: `sizes.0.size = "2 mm"`.
fn allow_items(property: &mut Map<String, Value>) {
    let description = property.shift_remove("description");
    let whole = std::mem::take(property);
    if let Some(description) = description {
        property.insert("description".into(), description);
    }
    let items = json!({
        "description": "Items by their number, counted from 0.",
        "type": "object",
        "propertyNames": { "pattern": r"^\+?[0-9]+$" },
    });
    property.insert("anyOf".into(), json!([whole, items]));
}
