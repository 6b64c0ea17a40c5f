//! What the keys of one table ask of each other: one of several, this with that, other keys for another kind.
//!
//! Every rule is an item of `allOf`, so that rules of a table and of a group of its keys add up.

use serde_json::{Map, Value, json};

use crate::config::value::definitions::Definitions;

/// The rules of a table.
#[derive(Debug, Default)]
pub(in crate::config) struct Rules {
    rules: Vec<Value>,
    /// What rules refer to.
    pub(in crate::config) definitions: Definitions,
}

/// What a rule asks for where it applies.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::config) struct Then<'a> {
    /// Keys that must be there.
    pub(in crate::config) required: &'a [&'a str],
    /// Keys that must not.
    pub(in crate::config) refused: &'a [&'a str],
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

impl Rules {
    /// With definitions that are there already.
    pub(super) fn new(definitions: Definitions) -> Self {
        Self { rules: Vec::new(), definitions }
    }

    /// The rules, and the definitions with those that were added.
    pub(super) fn into_parts(self) -> (Vec<Value>, Definitions) {
        (self.rules, self.definitions)
    }

    /// Any rule.
    pub(in crate::config) fn add(mut self, rule: Value) -> Self {
        self.rules.push(rule);
        self
    }

    /// All rules of others, in a branch (`then` or `else`) of a condition.
    pub(in crate::config) fn branch(
        mut self,
        condition: Value,
        branch: &str,
        others: fn(Self) -> Self,
    ) -> Self {
        let inner = others(Self::new(std::mem::take(&mut self.definitions)));
        self.definitions = inner.definitions;
        self.add(json!({ "if": condition, (branch): { "allOf": inner.rules } }))
    }

    /// One of the keys, and no more.
    pub(in crate::config) fn exactly_one(self, keys: &[&str]) -> Self {
        self.add(json!({ "oneOf": present(keys) }))
    }

    /// Two keys that exclude each other.
    pub(in crate::config) fn not_both(self, keys: [&str; 2]) -> Self {
        self.add(json!({ "not": { "required": keys } }))
    }

    /// With a key, others are needed.
    pub(in crate::config) fn needs(self, key: &str, others: &[&str]) -> Self {
        self.add(json!({ "dependentRequired": { (key): others } }))
    }

    /// Where a key is written.
    pub(in crate::config) fn with(self, key: &str, then: Then<'_>) -> Self {
        self.add(json!({ "if": { "required": [key] }, "then": then.schema() }))
    }

    /// Where a key is written with one of these words.
    pub(in crate::config) fn when(self, key: &str, words: &[&str], then: Then<'_>) -> Self {
        self.add(json!({ "if": is(key, words), "then": then.schema() }))
    }

    /// Where a key is written with none of these words.
    pub(in crate::config) fn when_none_of(self, key: &str, words: &[&str], then: Then<'_>) -> Self {
        self.add(json!({ "if": { "required": [key], "not": is(key, words) }, "then": then.schema() }))
    }

    /// Where a key is not written, or with none of these words.
    pub(in crate::config) fn unless(self, key: &str, words: &[&str], then: Then<'_>) -> Self {
        self.add(json!({ "if": is(key, words), "else": then.schema() }))
    }
}

/// The condition that a key is written with one of these words.
pub(in crate::config) fn is(key: &str, words: &[&str]) -> Value {
    json!({ "required": [key], "properties": { (key): { "enum": words } } })
}

/// For each key, that it is written.
pub(in crate::config) fn present(keys: &[&str]) -> Vec<Value> {
    keys.iter().map(|key| json!({ "required": [key] })).collect()
}
