//! How the value of a key is written: attributes of fields turn the schema of a Rust type into that of the input.
//!
//! A field holds numbers in SI; the input may carry units. The functions here are named like the methods of the reader's
//! `Section` and take the same arguments, so that a field's attribute and the line that reads it can be compared.

use schemars::transform::Transform;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::{Map, Value, json};

use super::quantities;
use crate::config::range::Range;
use crate::config::section::LONGEST_LIST;
use crate::config::{Dimension, parse_quantity};

/// Replaces the innermost values of a field, through all lists, by a schema.
pub(crate) struct Leaf {
    schema: Value,
    dimension: Option<Dimension>,
}

/// A quantity: a text with a unit, or a bare number in SI.
pub(crate) fn quantity(dimension: Dimension, range: Range) -> Leaf {
    Leaf { schema: reference(&quantities::name(dimension, range)), dimension: Some(dimension) }
}

/// A length.
pub(crate) fn length(range: Range) -> Leaf {
    quantity(Dimension::Length, range)
}

/// A number without unit.
pub(crate) fn number(range: Range) -> Leaf {
    let mut schema = json!({ "type": "number" });
    object(&mut schema).extend(quantities::bounds(range));
    Leaf { schema, dimension: None }
}

/// A whole number from `least` to `most`.
pub(crate) fn integer(least: usize, most: usize) -> Leaf {
    Leaf { schema: json!({ "type": "integer", "minimum": least, "maximum": most }), dimension: None }
}

/// One name, or a list of different names that is not empty.
pub(crate) fn name_or_names(schema: &mut Schema) {
    replace(schema, reference(quantities::NAMES));
}

/// A list of different names.
pub(crate) fn names(schema: &mut Schema) {
    bound_list(schema.ensure_object());
    schema.insert("uniqueItems".into(), true.into());
}

/// What a name must be, for tables that the user names.
pub(crate) fn a_text() -> Value {
    reference(quantities::TEXT)
}

/// The default depends on other keys: the description says it.
pub(crate) fn no_default(schema: &mut Schema) {
    schema.ensure_object().shift_remove("default");
}

/// A list with at least one item.
pub(crate) fn not_empty(schema: &mut Schema) {
    schema.insert("minItems".into(), 1.into());
}

/// A list without an item twice.
pub(crate) fn each_once(schema: &mut Schema) {
    schema.insert("uniqueItems".into(), true.into());
}

/// Three lengths, or one that holds along all three axes.
pub(crate) fn length_per_axis(schema: &mut Schema) {
    let one = reference(&quantities::name(Dimension::Length, Range::POSITIVE));
    let three = json!({ "type": "array", "items": one, "minItems": 3, "maxItems": 3 });
    replace(schema, json!({ "anyOf": [one, three] }));
}

/// A number or quantity that is not zero.
pub(crate) fn not_zero(schema: &mut Schema) {
    schema.insert("not".into(), reference(quantities::ZERO));
}

/// A vector with a component that is not zero.
pub(crate) fn not_all_zero(schema: &mut Schema) {
    schema.insert("contains".into(), json!({ "not": reference(quantities::ZERO) }));
}

/// A quantity whose dimension a rule of its table says.
pub(crate) fn of_some_dimension(schema: &mut Schema) {
    replace(schema, json!({ "type": ["string", "number"] }));
}

/// A name that can stand in the header of a table: letters, digits, `_` and `-`.
pub(crate) fn column_name(schema: &mut Schema) {
    // Letters of other scripts are letters too; the pattern lets every character beyond ASCII pass but spaces.
    replace(schema, json!({ "type": "string", "pattern": "^(?:[A-Za-z0-9_-]|[^\\u0000-\\u007f\\s])+$" }));
}

/// A factor, or 0 for none.
pub(crate) fn zero_or(range: Range) -> impl Transform {
    move |schema: &mut Schema| {
        let mut number = json!({ "type": "number" });
        object(&mut number).extend(quantities::bounds(range));
        replace(schema, json!({ "anyOf": [{ "const": 0 }, number] }));
    }
}

/// A table of which every key may be left out: it is laid over one that is complete.
pub(crate) struct Overlay<T>(std::marker::PhantomData<T>);

impl<T: JsonSchema> JsonSchema for Overlay<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("{}{}", T::schema_name(), super::overlay::SUFFIX).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        // The definition is made from the complete one once all are there.
        generator.subschema_for::<T>();
        let mut schema = Schema::default();
        schema.insert("$ref".into(), format!("#/$defs/{}", Self::schema_name()).into());
        schema
    }
}

impl Transform for Leaf {
    fn transform(&mut self, schema: &mut Schema) {
        let keywords = schema.ensure_object();
        if let Some(dimension) = self.dimension {
            if let Some(default) = keywords.get_mut("default") {
                with_unit(default, dimension);
            }
            // The field is in SI; the input says its unit itself.
            if let Some(Value::String(description)) = keywords.get_mut("description") {
                *description = description.replace(&format!(" [{}]", dimension.si_unit()), "");
            }
        }
        enter(keywords, &self.schema);
    }
}

/// Puts a schema in place of the innermost values.
fn enter(keywords: &mut Map<String, Value>, leaf: &Value) {
    if let Some(Value::Object(items)) = keywords.get_mut("items") {
        enter(items, leaf);
        bound_list(keywords);
        return;
    }
    keywords.retain(|keyword, _| ["description", "default", "examples"].contains(&keyword.as_str()));
    if let Value::Object(leaf) = leaf {
        keywords.extend(leaf.clone());
    }
}

/// Limits the length of a list that has no other limit.
fn bound_list(keywords: &mut Map<String, Value>) {
    keywords.entry("maxItems").or_insert(LONGEST_LIST.into());
}

/// Replaces the whole schema, but for what is said of the key.
fn replace(schema: &mut Schema, by: Value) {
    let keywords = schema.ensure_object();
    keywords.shift_remove("items");
    enter(keywords, &by);
}

/// Lengths read better in millimetres: the text takes the place of the number where it has the same bits.
fn with_unit(value: &mut Value, dimension: Dimension) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(|item| with_unit(item, dimension)),
        Value::Number(number) if dimension == Dimension::Length => {
            let Some(metres) = number.as_f64().filter(|metres| *metres != 0.0) else { return };
            // Nine decimals of a millimetre: what a default is given with, without the last bits of the product.
            let text = format!("{} mm", (metres * 1e12).round() / 1e9);
            if parse_quantity(&text, dimension) == Ok(metres) {
                *value = text.into();
            }
        }
        _ => {}
    }
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{name}") })
}

fn object(value: &mut Value) -> &mut Map<String, Value> {
    value.as_object_mut().expect("it was made as an object")
}
