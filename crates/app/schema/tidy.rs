//! From the schema of Rust types to that of a TOML file: no null, closed tables, plain descriptions.

use schemars::Schema;
use schemars::transform::{Transform, transform_subschemas};
use serde_json::{Map, Value};

use super::quantities;

/// Goes through all subschemas.
pub(super) struct Tidy;

impl Transform for Tidy {
    fn transform(&mut self, schema: &mut Schema) {
        if let Some(keywords) = schema.as_object_mut() {
            drop_null(keywords);
            drop_format(keywords);
            plain_default(keywords);
            join_lines(keywords);
            refer_to_text(keywords);
            close_table(keywords);
            let taken = std::mem::take(keywords);
            *keywords = in_order(taken);
        }
        transform_subschemas(self, schema);
    }
}

/// TOML has no null: a key without value is left out.
fn drop_null(keywords: &mut Map<String, Value>) {
    if keywords.get("default").is_some_and(Value::is_null) {
        keywords.shift_remove("default");
    }
    if let Some(Value::Array(types)) = keywords.get_mut("type") {
        types.retain(|kind| kind != "null");
        if let [one] = types.as_slice() {
            let one = one.clone();
            keywords.insert("type".into(), one);
        }
    }
    let Some(Value::Array(alternatives)) = keywords.get_mut("anyOf") else { return };
    alternatives.retain(|one| one.get("type").is_none_or(|kind| kind != "null"));
    if let [Value::Object(one)] = alternatives.as_slice() {
        let one = one.clone();
        keywords.shift_remove("anyOf");
        // What is said of the key goes before what is said of its type.
        for (keyword, value) in one {
            keywords.entry(keyword).or_insert(value);
        }
    }
}

/// Formats such as `double` say how Rust holds a number.
fn drop_format(keywords: &mut Map<String, Value>) {
    keywords.shift_remove("format");
}

/// Whole numbers without a point; none for a table, whose keys have their own.
fn plain_default(keywords: &mut Map<String, Value>) {
    fn plain(value: &mut Value) {
        match value {
            Value::Array(items) => items.iter_mut().for_each(plain),
            Value::Number(number) if number.is_f64() => {
                *value = quantities::plain(number.as_f64().unwrap_or_default());
            }
            _ => {}
        }
    }
    if keywords.get("default").is_some_and(Value::is_object) {
        keywords.shift_remove("default");
    }
    if let Some(default) = keywords.get_mut("default") {
        plain(default);
    }
}

/// Lines of a comment in the code end where the page is full; those of a paragraph belong together.
fn join_lines(keywords: &mut Map<String, Value>) {
    if let Some(Value::String(description)) = keywords.get_mut("description") {
        *description = paragraphs(description);
    }
}

/// A text with one line a paragraph; blocks of code keep their lines.
fn paragraphs(text: &str) -> String {
    let mut joined = String::new();
    let mut in_code = false;
    for line in text.lines().map(str::trim_end) {
        let fence = line.starts_with("```");
        let same_paragraph = !in_code && !fence && !line.is_empty() && !joined.ends_with('\n');
        let after_blank = !in_code && joined.ends_with("\n\n");
        if !joined.is_empty() && !after_blank {
            joined.push_str(if same_paragraph { " " } else { "\n" });
        }
        if line.is_empty() && !in_code {
            joined.push('\n');
        }
        joined.push_str(line);
        in_code ^= fence;
    }
    joined
}

/// Every text is one that the reader takes: not empty, without control characters.
fn refer_to_text(keywords: &mut Map<String, Value>) {
    let plain = keywords.get("type").is_some_and(|kind| kind == "string")
        && ["pattern", "enum", "const"].iter().all(|keyword| !keywords.contains_key(*keyword));
    if plain {
        keywords.shift_remove("type");
        keywords.insert("$ref".into(), format!("#/$defs/{}", quantities::TEXT).into());
    }
}

/// Unknown keys are faults, and a key with a default is not required.
fn close_table(keywords: &mut Map<String, Value>) {
    if keywords.get("type").is_none_or(|kind| kind != "object") || !keywords.contains_key("properties") {
        return;
    }
    let with_default: Vec<String> = match keywords.get("properties") {
        Some(Value::Object(properties)) => properties
            .iter()
            .filter(|(_, property)| property.get("default").is_some())
            .map(|(key, _)| key.clone())
            .collect(),
        _ => Vec::new(),
    };
    if let Some(Value::Array(required)) = keywords.get_mut("required") {
        required.retain(|key| key.as_str().is_none_or(|key| with_default.iter().all(|other| other != key)));
        if required.is_empty() {
            keywords.shift_remove("required");
        }
    }
    keywords.insert("additionalProperties".into(), false.into());
}

/// What a reader looks for first stands first.
fn in_order(mut keywords: Map<String, Value>) -> Map<String, Value> {
    const FIRST: [&str; 8] =
        ["$schema", "$id", "title", "description", "default", "type", "required", "additionalProperties"];
    let mut ordered = Map::new();
    for keyword in FIRST {
        ordered.extend(keywords.shift_remove(keyword).map(|value| (keyword.to_owned(), value)));
    }
    ordered.extend(keywords);
    ordered
}

#[cfg(test)]
mod tests {
    use super::paragraphs;

    #[test]
    fn lines_of_a_paragraph_are_joined_and_those_of_code_are_not() {
        let text = "One\nline.\n\nTwo.\n\n```toml\n[a]\n\nb = 1\n```";
        assert_eq!(paragraphs(text), "One line.\n\nTwo.\n\n```toml\n[a]\n\nb = 1\n```");
    }
}
