//! Values that a part of the schema allows, drawn at random.

use fastrand::Rng;
use serde_json::Value;

use crate::places::resolved;

/// Names that the configurations use, and others.
const NAMES: [&str; 6] = ["plate", "x_min", "observation", "steel", "a|b", "Größe 1"];

/// A value of a schema; rules between keys are not looked at.
pub(crate) fn sample(document: &Value, schema: &Value, random: &mut Rng) -> toml::Value {
    let (name, schema) = resolved(document, schema);
    if name == Some("Text") {
        return NAMES[random.usize(..NAMES.len())].into();
    }
    if let Some(value) = schema.get("const") {
        return crate::verdict::to_toml(value);
    }
    for keyword in ["oneOf", "anyOf"] {
        if let Some(alternatives) = schema.get(keyword).and_then(Value::as_array) {
            return sample(document, &alternatives[random.usize(..alternatives.len())], random);
        }
    }
    match &schema["type"] {
        Value::String(kind) => match kind.as_str() {
            "number" => number(schema, random).into(),
            "integer" => whole(schema, random).into(),
            "boolean" => random.bool().into(),
            "array" => list(document, schema, random),
            "object" => table(document, schema, random),
            _ => "some_name".into(),
        },
        // A quantity, or a bound of some dimension.
        _ => match (&schema["examples"][0], random.bool()) {
            (Value::String(example), true) => example.as_str().into(),
            _ => number(schema, random).into(),
        },
    }
}

fn table(document: &Value, schema: &Value, random: &mut Rng) -> toml::Value {
    let mut table = toml::Table::new();
    let Some(properties) = schema["properties"].as_object() else { return table.into() };
    for (key, property) in properties {
        let required = schema["required"].as_array().is_some_and(|keys| keys.iter().any(|one| one == key));
        if required || random.u8(..4) == 0 {
            table.insert(key.clone(), sample(document, property, random));
        }
    }
    table.into()
}

fn list(document: &Value, schema: &Value, random: &mut Rng) -> toml::Value {
    let least = schema["minItems"].as_u64().unwrap_or(0) as usize;
    let most = schema["maxItems"].as_u64().map_or(3, |most| most.min(3)) as usize;
    let count = random.usize(least..=most.max(least));
    let mut items: Vec<toml::Value> = Vec::new();
    // Where each may stand once, a few draws find others; a list that is too short for the words there are stays so.
    for _ in 0..10 * count {
        let item = sample(document, &schema["items"], random);
        if items.len() < count && !(schema["uniqueItems"] == true && items.contains(&item)) {
            items.push(item);
        }
    }
    items.into()
}

fn whole(schema: &Value, random: &mut Rng) -> i64 {
    let least = schema["minimum"].as_i64().unwrap_or(0);
    let most = schema["maximum"].as_i64().unwrap_or(least + 100);
    match random.u8(..4) {
        0 => least,
        1 => most,
        _ => random.i64(least..=most.min(least + 20)),
    }
}

fn number(schema: &Value, random: &mut Rng) -> f64 {
    let bound = |keyword: &str| schema[keyword].as_f64();
    let lower = bound("minimum").or(bound("exclusiveMinimum")).unwrap_or(-2.0).max(-2.0);
    let upper = bound("maximum").or(bound("exclusiveMaximum")).unwrap_or(3.0).min(3.0).max(lower);
    match (random.u8(..6), bound("minimum"), bound("maximum")) {
        (0, Some(least), _) => least,
        (1, _, Some(most)) => most,
        // Inside, and never at an end that may be left out.
        _ => lower + (upper - lower) * (0.05 + 0.9 * random.f64()),
    }
}
