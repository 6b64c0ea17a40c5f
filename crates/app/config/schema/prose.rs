//! Types, ranges and values of the schema in words, for the page.

use serde_json::{Map, Value};

use crate::config::value::definitions::DEFINITIONS;

/// Says what a schema is.
pub(super) struct Prose<'a> {
    /// All definitions.
    pub(super) definitions: &'a Map<String, Value>,
}

impl Prose<'_> {
    /// The type of a value.
    pub(super) fn kind(&self, schema: &Value) -> String {
        if let Some(alternatives) = schema["anyOf"].as_array() {
            let kinds: Vec<String> = alternatives.iter().map(|one| self.kind(one)).collect();
            return kinds.join(", or ");
        }
        if let Some(definition) = named(schema).and_then(|name| self.definitions.get(name)) {
            return match (definition["title"].as_str(), definition["oneOf"].as_array()) {
                (Some(title), _) => title.to_owned(),
                (None, Some(words)) => {
                    let words: Vec<String> = words
                        .iter()
                        .filter(|word| word.get("deprecated").is_none())
                        .filter_map(|word| Some(format!("`\"{}\"`", word["const"].as_str()?)))
                        .collect();
                    words.join(", ")
                }
                _ => self.kind(definition),
            };
        }
        if let Some(value) = schema.get("const") {
            return toml(value);
        }
        let types = schema["type"].as_str();
        match types {
            Some("array") => self.list(schema),
            Some("integer") => "whole number".to_owned(),
            Some("boolean") => "`true` or `false`".to_owned(),
            Some("string") => "text".to_owned(),
            Some("object") => {
                let keys = schema["properties"].as_object().into_iter().flatten();
                let keys: Vec<String> =
                    keys.map(|(key, value)| format!("{key} = {}", self.kind(value))).collect();
                format!("`{{ {} }}`", keys.join(", "))
            }
            Some(other) => other.to_owned(),
            None => "quantity or number".to_owned(),
        }
    }

    fn list(&self, schema: &Value) -> String {
        let items = &schema["items"];
        let is_point = items["type"] == "array" && items["maxItems"] == 3;
        let one = if is_point { "point".to_owned() } else { self.kind(items) };
        let several = if one.starts_with('`') { format!("of {one}") } else { plural(&one) };
        match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
            (Some(least), Some(most)) if least == most => format!("{least} {several}"),
            _ if several.starts_with("of ") => format!("list {several}"),
            _ => format!("list of {several}"),
        }
    }

    /// What a value must keep to beside its type.
    pub(super) fn range(&self, schema: &Value) -> String {
        let mut said = Vec::new();
        self.collect_ranges(schema, &mut said);
        said.dedup();
        said.join(", ")
    }

    fn collect_ranges(&self, schema: &Value, said: &mut Vec<String>) {
        if let Some(definition) = named(schema).and_then(|name| self.definitions.get(name))
            && definition.get("properties").is_none()
            && definition.get("anyOf").is_none()
        {
            self.collect_ranges(definition, said);
        }
        if let Some(alternatives) = schema["anyOf"].as_array() {
            alternatives.iter().for_each(|one| self.collect_ranges(one, said));
        }
        said.extend(interval(schema));
        if schema["items"].is_object() {
            self.collect_ranges(&schema["items"], said);
        }
        let is_list = schema["type"] == "array";
        if is_list && schema["minItems"] == 1 {
            said.push("at least one".to_owned());
        }
        if schema["uniqueItems"] == true {
            said.push("each once".to_owned());
        }
        if schema.get("not").is_some() {
            said.push("not 0".to_owned());
        }
        if schema.get("contains").is_some() {
            said.push("not all 0".to_owned());
        }
    }
}

/// The bounds of a number. The largest length there is, and the largest whole number, go without saying.
fn interval(schema: &Value) -> Option<String> {
    const GOES_WITHOUT_SAYING: f64 = 1e15;
    let is_length = schema["title"] == "length";
    let bound = |keyword: &str| {
        schema[keyword]
            .as_f64()
            .filter(|bound| bound.abs() < GOES_WITHOUT_SAYING && !(is_length && bound.abs() > 1.0))
    };
    let (least, above) = (bound("minimum"), bound("exclusiveMinimum"));
    let (most, below) = (bound("maximum"), bound("exclusiveMaximum"));
    let (least, above, most, below) = (least.map(shown), above.map(shown), most.map(shown), below.map(shown));
    match (least, above, most, below) {
        (Some(a), _, Some(b), _) => Some(format!("{a} to {b}")),
        (Some(a), _, None, Some(b)) => Some(format!("[{a}, {b})")),
        (None, Some(a), Some(b), _) => Some(format!("({a}, {b}]")),
        (None, Some(a), None, Some(b)) => Some(format!("({a}, {b})")),
        (Some(a), _, None, None) => Some(format!("≥ {a}")),
        (None, Some(a), None, None) => Some(format!("> {a}")),
        _ => None,
    }
}

/// A number with a true minus sign, and groups of three digits.
fn shown(value: f64) -> String {
    let digits = if value.abs() >= 1e7 || (value != 0.0 && value.abs() < 1e-3) {
        format!("{:e}", value.abs())
    } else {
        format!("{}", value.abs())
    };
    let grouped = match digits.parse::<u64>() {
        Ok(whole) if whole >= 10_000 => {
            let reversed: Vec<char> = digits.chars().rev().collect();
            let groups: Vec<String> = reversed.chunks(3).map(|group| group.iter().collect()).collect();
            groups.join("\u{a0}").chars().rev().collect()
        }
        _ => digits,
    };
    if value < 0.0 { format!("−{grouped}") } else { grouped }
}

fn plural(one: &str) -> String {
    match one.strip_suffix('y') {
        Some(stem) => format!("{stem}ies"),
        None if one.ends_with('s') => format!("lists of {one}"),
        None => format!("{one}s"),
    }
}

/// Name of the definition that a schema refers to.
pub(super) fn named(schema: &Value) -> Option<&str> {
    schema.get("$ref")?.as_str()?.strip_prefix(DEFINITIONS)
}

/// A value as it is written in the file.
pub(super) fn toml(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(toml).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// A text that fits into a cell of a table.
pub(super) fn cell(text: &str) -> String {
    text.replace('|', r"\|").replace("\n\n", " ").replace('\n', " ")
}
