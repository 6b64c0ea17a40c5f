//! Values that many keys share, as definitions of the schema: quantities by dimension and range, texts and names.
//!
//! The units come from the table of the reader. A text is checked by a pattern, which knows the unit and the sign of its
//! number, and no more: a bound other than zero holds for bare numbers alone.

use serde_json::{Map, Value, json};

use crate::config::Dimension;
use crate::config::range::{End, Range};
use crate::config::section::{LONGEST_LENGTH, LONGEST_LIST};

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

/// A text that is not empty.
pub(super) const TEXT: &str = "Text";
/// One name, or a list of them.
pub(super) const NAMES: &str = "Names";

/// A number or quantity that is zero.
pub(super) const ZERO: &str = "Zero";

/// The three kinds of ranges that quantities have.
const RANGES: [(Range, &str); 3] =
    [(Range::FINITE, ""), (Range::POSITIVE, "Positive"), (Range::NOT_NEGATIVE, "NonNegative")];

/// Name of the definition of a quantity.
///
/// # Panics
/// For a range that no definition is made for: the schema is the same in every run, and a test makes it.
pub(super) fn name(dimension: Dimension, range: Range) -> String {
    let (_, prefix) =
        RANGES.iter().find(|(known, _)| *known == range).expect("quantities are of any sign, > 0 or >= 0");
    format!("{prefix}{dimension:?}")
}

/// Every definition that a `$ref` may name without being made from a type.
pub(super) fn definitions() -> Vec<(String, Value)> {
    let of = |dimension| RANGES.map(|(range, _)| (name(dimension, range), quantity(dimension, range)));
    let mut all = vec![(TEXT.to_owned(), text()), (NAMES.to_owned(), names()), (ZERO.to_owned(), zero())];
    all.extend(Dimension::ALL.into_iter().flat_map(of));
    all
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

fn names() -> Value {
    let one = json!({ "$ref": format!("#/$defs/{TEXT}") });
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

/// The keywords that keep a number within a range.
pub(super) fn bounds(range: Range) -> Map<String, Value> {
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
pub(super) fn plain(value: f64) -> Value {
    if value.fract() == 0.0 && value.abs() < 1e9 { json!(value as i64) } else { json!(value) }
}
