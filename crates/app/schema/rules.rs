//! What the keys of one table ask of each other: one of several, this with that, other keys for another kind.
//!
//! Every rule is an item of `allOf`, so that rules of a table and of a group of its keys add up.

use schemars::Schema;
use serde_json::{Map, Value, json};

/// Adds rules to the schema of a table.
pub(crate) struct Rules<'a>(&'a mut Map<String, Value>);

/// What a rule asks for where it applies.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Then<'a> {
    /// Keys that must be there.
    pub(crate) required: &'a [&'a str],
    /// Keys that must not.
    pub(crate) refused: &'a [&'a str],
}

impl Then<'_> {
    fn schema(self) -> Value {
        let refused: Map<String, Value> =
            self.refused.iter().map(|key| ((*key).into(), false.into())).collect();
        let mut schema = Map::new();
        if !self.required.is_empty() {
            schema.insert("required".into(), json!(self.required));
        }
        if !refused.is_empty() {
            schema.insert("properties".into(), refused.into());
        }
        schema.into()
    }
}

impl<'a> Rules<'a> {
    /// For this table.
    pub(crate) fn of(schema: &'a mut Schema) -> Self {
        Self(schema.ensure_object())
    }

    /// Any rule.
    pub(crate) fn add(self, rule: Value) -> Self {
        let rules = self.0.entry("allOf").or_insert_with(|| json!([]));
        if let Value::Array(rules) = rules {
            rules.push(rule);
        }
        self
    }

    /// One of the keys, and no more.
    pub(crate) fn exactly_one(self, keys: &[&str]) -> Self {
        self.add(json!({ "oneOf": present(keys) }))
    }

    /// Two keys that exclude each other.
    pub(crate) fn not_both(self, keys: [&str; 2]) -> Self {
        self.add(json!({ "not": { "required": keys } }))
    }

    /// With a key, others are needed.
    pub(crate) fn needs(self, key: &str, others: &[&str]) -> Self {
        self.add(json!({ "dependentRequired": { (key): others } }))
    }

    /// Where a key is written.
    pub(crate) fn with(self, key: &str, then: Then<'_>) -> Self {
        self.add(json!({ "if": { "required": [key] }, "then": then.schema() }))
    }

    /// Where a key is written with one of these words.
    pub(crate) fn when(self, key: &str, words: &[&str], then: Then<'_>) -> Self {
        self.add(json!({ "if": is(key, words), "then": then.schema() }))
    }

    /// Where a key is not written, or with none of these words.
    pub(crate) fn unless(self, key: &str, words: &[&str], then: Then<'_>) -> Self {
        self.add(json!({ "if": is(key, words), "else": then.schema() }))
    }
}

/// The condition that a key is written with one of these words.
pub(crate) fn is(key: &str, words: &[&str]) -> Value {
    json!({ "properties": { (key): { "enum": words } }, "required": [key] })
}

/// For each key, that it is written.
fn present(keys: &[&str]) -> Vec<Value> {
    keys.iter().map(|key| json!({ "required": [key] })).collect()
}
