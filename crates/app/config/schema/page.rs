//! The page of all tables and keys, as Markdown, made from the schema.
//!
//! A table of the configuration is a heading, its description, a row for every key, the meaning of words, and its example.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::document::document;
use super::prose::{self, Prose};
use crate::config::table::overlay;
use crate::config::text::dimension::Dimension;

/// All units, tables and keys.
pub fn page() -> String {
    let document = document();
    let no_definitions = Map::new();
    let definitions = document["$defs"].as_object().unwrap_or(&no_definitions);
    let mut page = Page { definitions, headings: BTreeMap::new(), words: Vec::new(), text: units() };
    page.root(&document);
    page.text
}

/// The units of every dimension.
fn units() -> String {
    let mut text =
        "## Units\n\n| quantity | units | a bare number is in | example |\n|---|---|---|---|\n".to_owned();
    for dimension in Dimension::ALL {
        let units: Vec<String> = dimension.units().map(|unit| format!("`{unit}`")).collect();
        text += &format!(
            "| {} | {} | {} | `\"{}\"` |\n",
            dimension.noun(),
            units.join(", "),
            dimension.si_unit(),
            dimension.example()
        );
    }
    text
}

/// A page being written.
struct Page<'a> {
    definitions: &'a Map<String, Value>,
    /// Headings of the tables so far, by definition.
    headings: BTreeMap<String, String>,
    /// Definitions of words that are explained.
    words: Vec<String>,
    text: String,
}

/// How a table is written in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// `[table]`.
    One,
    /// `[[table]]`.
    Several,
    /// `[table.NAME]`.
    Named,
}

impl<'a> Page<'a> {
    fn root(&mut self, document: &'a Value) {
        let Some(properties) = document["properties"].as_object() else { return };
        for (key, property) in properties {
            match self.table_of(property) {
                Some((form, name)) => self.table(2, key, form, name),
                None => {
                    self.text += &format!("\n## `{key}`\n\n");
                    self.rows(&[(key.as_str(), property)], document);
                }
            }
        }
    }

    /// One table of the configuration, and those inside it.
    fn table(&mut self, level: usize, path: &str, form: Form, name: &str) {
        let Some(schema) = self.definitions.get(name) else { return };
        let heading = match form {
            Form::One => format!("[{path}]"),
            Form::Several => format!("[[{path}]]"),
            Form::Named => format!("[{path}.NAME]"),
        };
        self.headings.insert(name.to_owned(), heading.clone());
        let described = schema["description"].as_str().unwrap_or_default();
        let (prose, example) = described
            .split_once("```")
            .map_or((described, None), |(prose, code)| (prose.trim_end(), Some(format!("```{code}"))));
        self.text += &format!("\n{} `{heading}`\n\n{prose}\n\n", "#".repeat(level));
        let Some(properties) = schema["properties"].as_object() else { return };
        // Tables inside come after this one; their headings are needed in its rows.
        let mut inner = Vec::new();
        for (key, property) in properties {
            if let Some((form, name)) = self.table_of(property)
                && !self.headings.contains_key(name)
            {
                let path = format!("{path}.{key}");
                let heading = if form == Form::Several { format!("[[{path}]]") } else { format!("[{path}]") };
                self.headings.insert(name.to_owned(), heading);
                inner.push((path, form, name));
            }
        }
        let rows: Vec<(&str, &Value)> =
            properties.iter().map(|(key, property)| (key.as_str(), property)).collect();
        self.rows(&rows, schema);
        for (_, property) in &rows {
            self.explain_words(property, &rows);
        }
        if let Some(example) = example {
            self.text += &format!("\nExample:\n\n{example}\n");
        }
        for (path, form, name) in inner {
            self.table(3, &path, form, name);
        }
    }

    /// A row for every key.
    fn rows(&mut self, rows: &[(&str, &Value)], table: &Value) {
        let prose = Prose { definitions: self.definitions };
        let ranges: Vec<String> = rows.iter().map(|(_, property)| prose.range(property)).collect();
        let with_range = ranges.iter().any(|range| !range.is_empty());
        self.text += if with_range {
            "| key | type | range | default | meaning |\n|---|---|---|---|---|\n"
        } else {
            "| key | type | default | meaning |\n|---|---|---|---|\n"
        };
        for ((key, property), range) in rows.iter().zip(ranges) {
            let kind = self.linked(property).unwrap_or_else(|| prose.kind(property));
            let required = table["required"].as_array().is_some_and(|keys| keys.iter().any(|one| one == key));
            let default = match property.get("default") {
                _ if required => "*required*".to_owned(),
                Some(value) => format!("`{}`", prose::toml(value)),
                None => "—".to_owned(),
            };
            let meaning = property["description"].as_str().unwrap_or_default();
            let mut cells = vec![format!("`{key}`"), kind];
            cells.extend(with_range.then_some(range));
            cells.extend([default, meaning.to_owned()]);
            let cells: Vec<String> = cells.iter().map(|cell| prose::cell(cell)).collect();
            self.text += &format!("| {} |\n", cells.join(" | "));
        }
    }

    /// The words of a key and their meaning, where they have not been explained and do not explain themselves.
    fn explain_words(&mut self, property: &Value, rows: &[(&str, &Value)]) {
        let Some(name) = prose::named(property).filter(|name| !self.words.iter().any(|word| word == name))
        else {
            return;
        };
        let Some(words) = self.definitions.get(name).and_then(|choice| choice["oneOf"].as_array()) else {
            return;
        };
        let told = |word: &Value| {
            let meaning = word["description"].as_str().unwrap_or_default();
            (word["const"].as_str().unwrap_or_default().to_owned(), meaning.to_owned())
        };
        let words: Vec<(String, String)> = words.iter().map(told).collect();
        if words.len() < 2 || words.iter().all(|(word, meaning)| meaning.trim_end_matches('.') == word) {
            return;
        }
        let of = |property: &Value| prose::named(property) == Some(name);
        let keys: Vec<String> =
            rows.iter().filter(|(_, property)| of(property)).map(|(key, _)| format!("`{key}`")).collect();
        self.text += &format!("\nWords of {}:\n\n", keys.join(" and "));
        for (word, meaning) in words {
            self.text += &format!("- `\"{word}\"`: {meaning}\n");
        }
        self.words.push(name.to_owned());
    }

    /// The type of a key that holds a table, with a link to its heading.
    fn linked(&self, property: &Value) -> Option<String> {
        let overlaid = prose::named(property).and_then(|name| name.strip_suffix(overlay::SUFFIX));
        let (form, name) = self.table_of(property).or(overlaid.map(|name| (Form::One, name)))?;
        let heading = self.headings.get(name)?;
        let anchor: String = heading.chars().filter(|c| c.is_alphanumeric() || *c == '_').collect();
        let what = match (form, overlaid) {
            (_, Some(_)) => "keys of ",
            (Form::One, _) => "table ",
            _ => "tables ",
        };
        Some(format!("{what}[`{heading}`](#{})", anchor.to_lowercase()))
    }

    /// The table that a property is, and how it is written.
    fn table_of<'b>(&self, property: &'b Value) -> Option<(Form, &'b str)> {
        let candidates = [
            (Form::One, property),
            (Form::Several, &property["items"]),
            (Form::Named, &property["additionalProperties"]),
        ];
        candidates.into_iter().find_map(|(form, schema)| {
            let name = prose::named(schema)?;
            let is_table = self.definitions.get(name)?.get("properties").is_some();
            (is_table && !name.ends_with(overlay::SUFFIX)).then_some((form, name))
        })
    }
}
