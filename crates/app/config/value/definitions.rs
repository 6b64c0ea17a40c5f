//! Values that many keys share, as definitions of the schema: quantities by dimension and range, texts and names.
//!
//! The units come from the table of the reader. A text is checked by a pattern, which knows the unit and the sign of its
//! number, and no more: a bound other than zero holds for bare numbers alone.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::limits::{LONGEST_LENGTH, LONGEST_LIST};
use super::range::{End, Range};
use crate::config::text::dimension::Dimension;

/// Keywords of a JSON schema.
pub(in crate::config) type Keywords = Map<String, Value>;

/// Where definitions are.
pub(in crate::config) const DEFINITIONS: &str = "#/$defs/";

/// The power of ten of a number.
const EXPONENT: &str = "(?:[eE][+-]?[0-9]+)?";
/// The digits of any number.
const DIGITS: &str = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)";
/// The digits of a number that is not zero.
const DIGITS_NOT_ZERO: &str = r"(?:[0-9]*[1-9][0-9]*\.?[0-9]*|[0-9]*\.[0-9]*[1-9][0-9]*)";
/// The digits of zero.
const DIGITS_OF_ZERO: &str = r"(?:0+\.?0*|\.0+)";

/// Characters that no text may hold.
const CONTROL: &str = r"\u0000-\u001f\u007f-\u009f";
/// White space beside control characters.
const SPACE: &str = r"\u0020\u00a0\u1680\u2000-\u200a\u2028\u2029\u202f\u205f\u3000";

/// The three kinds of ranges that quantities have.
const RANGES: [(Range, &str); 3] =
    [(Range::FINITE, ""), (Range::POSITIVE, "Positive"), (Range::NOT_NEGATIVE, "NonNegative")];

/// The definitions that something refers to, by name.
#[derive(Debug, Default)]
pub(in crate::config) struct Definitions(BTreeMap<String, Value>);

impl Definitions {
    /// A reference to a definition, which is made where it is new.
    pub(in crate::config) fn reference(
        &mut self,
        name: &str,
        make: impl FnOnce(&mut Self) -> Value,
    ) -> Keywords {
        if !self.0.contains_key(name) {
            // It may refer to itself.
            self.0.insert(name.to_owned(), Value::Null);
            let definition = make(self);
            self.0.insert(name.to_owned(), definition);
        }
        Map::from_iter([("$ref".to_owned(), format!("{DEFINITIONS}{name}").into())])
    }

    /// A definition that is there.
    pub(in crate::config) fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// A quantity.
    ///
    /// # Panics
    /// For a range that quantities do not have: the schema is the same in every run, and a test makes it.
    pub(in crate::config) fn quantity(&mut self, dimension: Dimension, range: Range) -> Keywords {
        let (_, prefix) = RANGES
            .iter()
            .find(|(known, _)| *known == range)
            .expect("quantities are of any sign, > 0 or >= 0");
        self.reference(&format!("{prefix}{dimension:?}"), |_| quantity(dimension, range))
    }

    /// A text that is not empty.
    pub(in crate::config) fn text(&mut self) -> Keywords {
        self.reference("Text", |_| text())
    }

    /// One name, or a list of them.
    pub(in crate::config) fn names(&mut self) -> Keywords {
        self.reference("Names", |definitions| names(&definitions.text().into()))
    }

    /// A number or quantity that is zero.
    pub(in crate::config) fn zero(&mut self) -> Keywords {
        self.reference("Zero", |_| zero())
    }

    /// All of them, sorted by name.
    pub(in crate::config) fn into_value(self) -> Value {
        self.0.into_iter().collect::<Map<String, Value>>().into()
    }
}

fn text() -> Value {
    json!({
        "title": "text",
        "type": "string",
        "pattern": format!("^[^{CONTROL}]*[^{CONTROL}{SPACE}][^{CONTROL}]*$"),
    })
}

fn zero() -> Value {
    // No unit begins with a digit, a sign, a point or the letter e.
    let pattern = format!(r"^\s*[+-]?{DIGITS_OF_ZERO}{EXPONENT}\s*[^0-9.eE+\-\s]");
    json!({ "title": "zero", "anyOf": [{ "const": 0 }, { "type": "string", "pattern": pattern }] })
}

fn names(one: &Value) -> Value {
    json!({
        "title": "name or names",
        "anyOf": [one, {
            "type": "array",
            "items": one,
            "minItems": 1,
            "maxItems": LONGEST_LIST,
            "uniqueItems": true,
        }],
    })
}

fn quantity(dimension: Dimension, range: Range) -> Value {
    let number = match range.lower() {
        End::Open(_) => format!(r"\+?{DIGITS_NOT_ZERO}"),
        End::Closed(_) => format!(r"(?:\+?{DIGITS}|-{DIGITS_OF_ZERO})"),
        End::None => format!("[+-]?{DIGITS}"),
    };
    let units = dimension.units().collect::<Vec<_>>().join("|");
    let described = match range {
        Range::FINITE => String::new(),
        _ => format!(" It must be {}.", range.describe(dimension.si_unit())),
    };
    let name = dimension.name();
    let (first, rest) = name.split_at(1);
    let mut schema = json!({
        "title": dimension.noun(),
        "description": format!(
            "{}{rest}: a text with one of the units {}, such as \"{}\", or a number in {}.{described}",
            first.to_uppercase(),
            dimension.accepted_units(),
            dimension.example(),
            dimension.si_unit(),
        ),
        "type": ["string", "number"],
        "pattern": format!(r"^\s*{number}{EXPONENT}\s*(?:{units})\s*$"),
        "examples": [dimension.example()],
    });
    let keywords = schema.as_object_mut().expect("an object was just made");
    keywords.extend(bounds(range));
    if dimension == Dimension::Length {
        keywords.insert("maximum".into(), plain(LONGEST_LENGTH));
        if range == Range::FINITE {
            keywords.insert("minimum".into(), plain(-LONGEST_LENGTH));
        }
    }
    schema
}

/// The schema of a list.
pub(in crate::config) fn list_of(items: Keywords) -> Keywords {
    Map::from_iter([("type".to_owned(), "array".into()), ("items".to_owned(), items.into())])
}

/// The schema of a value of several forms.
pub(in crate::config) fn any_of<T: Into<Value>>(forms: Vec<T>) -> Keywords {
    Map::from_iter([("anyOf".to_owned(), forms.into_iter().map(Into::into).collect())])
}

/// The keywords that keep a number within a range.
pub(in crate::config) fn bounds(range: Range) -> Keywords {
    let lower = match range.lower() {
        End::Open(bound) => Some(("exclusiveMinimum", bound)),
        End::Closed(bound) => Some(("minimum", bound)),
        End::None => None,
    };
    let upper = match range.upper() {
        End::Open(bound) => Some(("exclusiveMaximum", bound)),
        End::Closed(bound) => Some(("maximum", bound)),
        End::None => None,
    };
    lower.into_iter().chain(upper).map(|(keyword, bound)| (keyword.to_owned(), plain(bound))).collect()
}

/// A number as it is best read: without a point where it is a small whole number.
pub(in crate::config) fn plain(value: f64) -> Value {
    if value.fract() == 0.0 && value.abs() < 1e9 { json!(value as i64) } else { json!(value) }
}

/// Lines of documentation as one text: those of a paragraph are joined, blocks of code keep theirs.
pub(in crate::config) fn described(lines: &[&str]) -> String {
    let mut joined = String::new();
    let mut in_code = false;
    for line in lines.iter().map(|line| line.strip_prefix(' ').unwrap_or(line).trim_end()) {
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

#[cfg(test)]
mod tests {
    use super::described;

    #[test]
    fn lines_of_a_paragraph_are_joined_and_those_of_code_are_not() {
        let lines = [" One", " line.", "", " Two.", "", " ```toml", " [a]", "", " b = 1", " ```"];
        assert_eq!(described(&lines), "One line.\n\nTwo.\n\n```toml\n[a]\n\nb = 1\n```");
    }
}
