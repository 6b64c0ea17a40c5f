//! Numbers, with and without unit.

use serde_json::{Map, json};

use super::definitions::{Definitions, Keywords, bounds, list_of};
use super::entry::Entry;
use super::kind::{Kind, Single, Value};
use super::limits::LONGEST_LENGTH;
use super::range::{Range, written};
use crate::config::text::dimension::Dimension;
use crate::config::text::quantity::parse_quantity;
use crate::config::text::tree::Content;

/// A number in a range, with a unit where it has a dimension.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Number {
    pub(in crate::config) dimension: Option<Dimension>,
    pub(in crate::config) range: Range,
}

impl Single for Number {}

impl Kind for Number {
    fn dimension(&self) -> Option<Dimension> {
        self.dimension
    }
}

impl Value<Number> for f64 {
    fn plural(kind: &Number) -> &'static str {
        match kind.dimension {
            None => "numbers",
            Some(Dimension::Length) => "lengths",
            Some(_) => "quantities",
        }
    }

    fn read(kind: &Number, entry: &Entry<'_>) -> Option<Self> {
        let path = &entry.path;
        let value = match (&entry.node.content, kind.dimension) {
            (Content::Integer(value), _) => *value as f64,
            (Content::Float(value), _) => *value,
            (Content::Text(text), Some(dimension)) => match parse_quantity(text, dimension) {
                Ok(value) => value,
                Err(error) => {
                    let expected = format!("expected {}", dimension.name());
                    entry.wrong(format!("`{path}`: {}", error.message), &expected, Some(error.help));
                    return None;
                }
            },
            (other, Some(dimension)) => {
                let (example, unit) = (dimension.example(), dimension.si_unit());
                let message = format!("`{path}` is {}, not {}", other.describe(), dimension.name());
                entry.wrong(message, &format!("a text like \"{example}\", or a number in {unit}"), None);
                return None;
            }
            (other, None) => {
                let message = format!("`{path}` is {}, not a number", other.describe());
                entry.wrong(message, "a number without quotes and unit", other.as_number());
                return None;
            }
        };
        if kind.dimension == Some(Dimension::Length) && value.is_finite() && value.abs() > LONGEST_LENGTH {
            let message = format!("`{path}` is {value:e} m, which is out of range");
            entry.wrong(message, &format!("at most {LONGEST_LENGTH} m"), None);
            return None;
        }
        in_range(entry, value, kind)
    }

    fn schema(kind: &Number, definitions: &mut Definitions) -> Keywords {
        match kind.dimension {
            Some(dimension) => definitions.quantity(dimension, kind.range),
            None => number(kind.range),
        }
    }
}

fn in_range(entry: &Entry<'_>, value: f64, kind: &Number) -> Option<f64> {
    if kind.range.contains(value) {
        return Some(value);
    }
    let unit = kind.dimension.map(Dimension::behind_value).unwrap_or_default();
    let shown = format!("{}{unit}", written(value));
    let message = if value.is_finite() {
        format!("`{}` is {shown}, which is out of range", entry.path)
    } else {
        format!("`{}` is {value}, not a finite number", entry.path)
    };
    entry.wrong(message, &format!("must be {}", kind.range.describe(unit.trim_start())), None);
    None
}

fn number(range: Range) -> Keywords {
    let mut keywords = Map::from_iter([("type".to_owned(), "number".into())]);
    keywords.extend(bounds(range));
    keywords
}

/// A whole number from `least` to `most`.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct Whole {
    pub(in crate::config) least: usize,
    pub(in crate::config) most: usize,
}

impl Single for Whole {}
impl Kind for Whole {}

impl Value<Whole> for usize {
    fn plural(_: &Whole) -> &'static str {
        "whole numbers"
    }

    fn read(&Whole { least, most }: &Whole, entry: &Entry<'_>) -> Option<Self> {
        let expected = format!("must be a whole number from {least} to {most}");
        match entry.node.content {
            Content::Integer(value) => match usize::try_from(value) {
                Ok(value) if (least..=most).contains(&value) => return Some(value),
                _ => entry.wrong(
                    format!("`{}` is {value}, which is out of range", entry.path),
                    &expected,
                    None,
                ),
            },
            Content::Float(value) if value.fract() == 0.0 => {
                let (why, help) = if (least as f64..=most as f64).contains(&value) {
                    ("written as a real number", Some(format!("write {}", value as usize)))
                } else {
                    ("which is out of range", None)
                };
                entry.wrong(format!("`{}` is {}, {why}", entry.path, written(value)), &expected, help);
            }
            ref other => {
                let message = format!("`{}` is {}, not a whole number", entry.path, other.describe());
                entry.wrong(message, &expected, other.as_number());
            }
        }
        None
    }

    fn schema(kind: &Whole, _: &mut Definitions) -> Keywords {
        let keywords =
            [("type", "integer".into()), ("minimum", kind.least.into()), ("maximum", kind.most.into())];
        keywords.map(|(keyword, value)| (keyword.to_owned(), value)).into_iter().collect()
    }
}

/// Three lengths, or one that holds along all three axes [m].
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct PerAxis(pub(in crate::config) Range);

impl Kind for PerAxis {}

impl PerAxis {
    fn length(&self) -> Number {
        Number { dimension: Some(Dimension::Length), range: self.0 }
    }
}

impl Value<PerAxis> for [f64; 3] {
    fn read(kind: &PerAxis, entry: &Entry<'_>) -> Option<Self> {
        match entry.node.content {
            Content::Array(_) => Self::read(&kind.length(), entry),
            _ => Some([f64::read(&kind.length(), entry)?; 3]),
        }
    }

    fn schema(kind: &PerAxis, definitions: &mut Definitions) -> Keywords {
        let one = f64::schema(&kind.length(), definitions);
        let mut three = list_of(one.clone());
        three.extend([("minItems".to_owned(), 3.into()), ("maxItems".to_owned(), 3.into())]);
        Map::from_iter([("anyOf".to_owned(), json!([one, three]))])
    }
}

/// A number in a range, or 0 for none.
#[derive(Debug, Clone, Copy)]
pub(in crate::config) struct ZeroOr(pub(in crate::config) Range);

impl Kind for ZeroOr {}

impl Value<ZeroOr> for f64 {
    fn read(kind: &ZeroOr, entry: &Entry<'_>) -> Option<Self> {
        let value = Self::read(&Number { dimension: None, range: Range::FINITE }, entry)?;
        if value == 0.0 || kind.0.contains(value) {
            return Some(value);
        }
        let expected = format!("0 for no check, or a number {}", kind.0.describe(""));
        entry.wrong(format!("`{}` is {}", entry.path, written(value)), &expected, None);
        None
    }

    fn schema(kind: &ZeroOr, _: &mut Definitions) -> Keywords {
        Map::from_iter([("anyOf".to_owned(), json!([{ "const": 0 }, number(kind.0)]))])
    }
}
