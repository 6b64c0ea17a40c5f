//! One table in the schema: its keys, which of them are required, and its rules.

use serde_json::{Value as Json, json};

use super::field::{Also, Field};
use super::rules::Rules;
use crate::config::text::dimension::Dimension;
use crate::config::text::quantity::parse_quantity;
use crate::config::value::definitions::{Definitions, Keywords, described, plain};
use crate::config::value::{Kind, Value};

/// A table being described.
#[derive(Debug, Default)]
pub(in crate::config) struct Description {
    properties: Keywords,
    required: Vec<String>,
    rules: Vec<Json>,
}

impl Description {
    /// Adds a key.
    pub(in crate::config) fn key<T: Value<K>, K: Kind>(
        &mut self,
        kind: &K,
        field: Field<'_>,
        default: Option<Json>,
        definitions: &mut Definitions,
    ) {
        let property = property::<T, K>(kind, field, default, definitions);
        self.properties.insert(field.key.to_owned(), property.into());
    }

    /// A key that must be there.
    pub(in crate::config) fn require(&mut self, key: &str) {
        self.required.push(key.to_owned());
    }

    /// Adds what keys ask of each other.
    pub(in crate::config) fn add_rules(&mut self, rules: fn(Rules) -> Rules, definitions: &mut Definitions) {
        let (rules, changed) = rules(Rules::new(std::mem::take(definitions))).into_parts();
        self.rules.extend(rules);
        *definitions = changed;
    }

    /// The schema of the table.
    pub(in crate::config) fn into_schema(self, about: &[&str]) -> Keywords {
        let mut schema = Keywords::new();
        if !about.is_empty() {
            schema.insert("description".into(), described(about).into());
        }
        schema.insert("type".into(), "object".into());
        if !self.required.is_empty() {
            schema.insert("required".into(), self.required.into());
        }
        schema.insert("additionalProperties".into(), false.into());
        schema.insert("properties".into(), self.properties.into());
        if !self.rules.is_empty() {
            schema.insert("allOf".into(), self.rules.into());
        }
        schema
    }
}

/// The schema of a key, or of one form of its value.
pub(in crate::config) fn property<T: Value<K>, K: Kind>(
    kind: &K,
    field: Field<'_>,
    default: Option<Json>,
    definitions: &mut Definitions,
) -> Keywords {
    let mut meaning = described(field.meaning);
    if let Some(dimension) = kind.dimension() {
        // The field is in SI; the input says its unit itself.
        meaning = meaning.replace(&format!(" [{}]", dimension.si_unit()), "");
    }
    let mut property = Keywords::new();
    property.insert("description".into(), meaning.into());
    // The keys of a table have defaults of their own.
    if let Some(default) = default.filter(|default| !default.is_object()) {
        property.insert("default".into(), shown(default, kind.dimension()));
    }
    property.extend(T::schema(kind, definitions));
    for also in field.also {
        let (keyword, value) = match also {
            Also::each_once => ("uniqueItems", true.into()),
            Also::not_zero => ("not", definitions.zero().into()),
            Also::not_all_zero => ("contains", json!({ "not": definitions.zero() })),
        };
        property.insert(keyword.into(), value);
    }
    property
}

/// A default as it is best read: whole numbers without a point, and lengths in millimetres where that has the same bits.
fn shown(value: Json, dimension: Option<Dimension>) -> Json {
    let number = match value {
        Json::Array(items) => return items.into_iter().map(|item| shown(item, dimension)).collect(),
        Json::Number(number) if number.is_f64() => number.as_f64().unwrap_or_default(),
        other => return other,
    };
    if dimension == Some(Dimension::Length) && number != 0.0 {
        // Nine decimals of a millimetre: what a default is given with, without the last bits of the product.
        let text = format!("{} mm", (number * 1e12).round() / 1e9);
        if parse_quantity(&text, Dimension::Length) == Ok(number) {
            return text.into();
        }
    }
    plain(number)
}
