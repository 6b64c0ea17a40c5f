//! One random change to a configuration, by kind.

use fastrand::Rng;
use serde_json::Value;

use crate::places::{Path, all, schema_at, value_at};
use crate::samples::sample;

/// What is done to a configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Change {
    /// Nothing.
    None,
    /// A key is taken away.
    Removed,
    /// A letter of a key is changed.
    Misspelt,
    /// A key is added that no table has.
    Unknown,
    /// A key of the table is added, or replaced, with a value that the schema allows there.
    Sampled,
    /// A value has another type.
    OtherType,
    /// A quantity has a unit of another dimension, none, or one that does not exist.
    OtherUnit,
    /// A number is far away, negative, zero or none; a text with a unit likewise.
    OutOfRange,
    /// A text is another word, empty, or holds a control character.
    OtherText,
    /// A list has an item more or less, or one twice.
    OtherLength,
    /// A whole table is replaced by one that the schema allows there.
    SampledTable,
}

/// All kinds.
pub(crate) const CHANGES: [Change; 11] = [
    Change::None,
    Change::Removed,
    Change::Misspelt,
    Change::Unknown,
    Change::Sampled,
    Change::OtherType,
    Change::OtherUnit,
    Change::OutOfRange,
    Change::OtherText,
    Change::OtherLength,
    Change::SampledTable,
];

/// The configuration with one change; `None` where there is nothing to change in this way.
pub(crate) fn changed(
    document: &Value,
    table: &toml::Table,
    change: Change,
    random: &mut Rng,
) -> Option<toml::Table> {
    let mut root = toml::Value::Table(table.clone());
    match change {
        Change::None => {}
        Change::Removed => {
            let path =
                pick(&mut root, random, |value| value.as_table().is_some_and(|table| !table.is_empty()))?;
            let table = value_at(&mut root, &path).as_table_mut()?;
            let key = a_key(table, random);
            table.remove(&key);
        }
        Change::Misspelt => {
            let path =
                pick(&mut root, random, |value| value.as_table().is_some_and(|table| !table.is_empty()))?;
            let table = value_at(&mut root, &path).as_table_mut()?;
            let key = a_key(table, random);
            let value = table.remove(&key)?;
            table.insert(misspelt(&key, random), value);
        }
        Change::Unknown => {
            let path = pick(&mut root, random, toml::Value::is_table)?;
            let key = ["colour", "sub.table", "unit", "name", "kind", "box"][random.usize(..6)];
            let values: [toml::Value; 3] = [1.into(), "text".into(), toml::Table::new().into()];
            let value = values[random.usize(..3)].clone();
            value_at(&mut root, &path).as_table_mut()?.insert(key.to_owned(), value);
        }
        Change::Sampled => {
            let path = pick(&mut root, random, toml::Value::is_table)?;
            let (_, schema) = schema_at(document, &path)?;
            let properties = schema.get("properties")?.as_object()?;
            let (key, property) = properties.iter().nth(random.usize(..properties.len()))?;
            let value = sample(document, property, random);
            value_at(&mut root, &path).as_table_mut()?.insert(key.clone(), value);
        }
        Change::SampledTable => {
            let path = pick(&mut root, random, toml::Value::is_table)?;
            let (_, schema) = schema_at(document, &path).filter(|_| !path.is_empty())?;
            *value_at(&mut root, &path) = sample(document, schema, random);
        }
        Change::OtherType => {
            let path = pick(&mut root, random, |_| true).filter(|path| !path.is_empty())?;
            *value_at(&mut root, &path) = other_type(random);
        }
        Change::OtherUnit => {
            let path = pick(&mut root, random, is_quantity)?;
            let units = ["kg", "S/m", "m", "Hz", "", "parsec", "mm2", "deg", "T", "Ohm m", "M", "mM"];
            let unit = units[random.usize(..units.len())];
            *value_at(&mut root, &path) = format!("2.5 {unit}").trim().into();
        }
        Change::OutOfRange => {
            let path = pick(&mut root, random, |value| is_number(value) || is_quantity(value))?;
            let value = value_at(&mut root, &path);
            *value = out_of_range(value, random);
        }
        Change::OtherText => {
            let path = pick(&mut root, random, toml::Value::is_str)?;
            let texts = ["nonsense", "", "  ", "a\nb", "a\u{7}", "Mma", " z ", "\u{a0}", "µ", "../x"];
            *value_at(&mut root, &path) = texts[random.usize(..texts.len())].into();
        }
        Change::OtherLength => {
            let path =
                pick(&mut root, random, |value| value.as_array().is_some_and(|items| !items.is_empty()))?;
            let items = value_at(&mut root, &path).as_array_mut()?;
            match random.u8(..3) {
                0 => items.push(items[0].clone()),
                1 => items.truncate(items.len() - 1),
                _ => items.clear(),
            }
        }
    }
    root.as_table().cloned()
}

fn pick(root: &mut toml::Value, random: &mut Rng, wanted: impl Fn(&toml::Value) -> bool) -> Option<Path> {
    let table = root.as_table()?.clone();
    let mut paths: Vec<Path> = std::iter::once(Path::new()).chain(all(&table)).collect();
    paths.retain(|path| wanted(value_at(root, path)));
    (!paths.is_empty()).then(|| paths.swap_remove(random.usize(..paths.len())))
}

fn a_key(table: &toml::Table, random: &mut Rng) -> String {
    table.keys().nth(random.usize(..table.len())).cloned().unwrap_or_default()
}

fn misspelt(key: &str, random: &mut Rng) -> String {
    let mut letters: Vec<char> = key.chars().collect();
    let place = random.usize(..letters.len());
    match random.u8(..3) {
        0 => {
            letters.remove(place);
        }
        1 => letters.insert(place, 'q'),
        _ => letters[place] = 'Q',
    }
    letters.into_iter().collect()
}

fn is_number(value: &toml::Value) -> bool {
    value.is_integer() || value.is_float()
}

fn is_quantity(value: &toml::Value) -> bool {
    value.as_str().is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
}

fn other_type(random: &mut Rng) -> toml::Value {
    let date: toml::value::Datetime = "2024-05-17".parse().expect("a date");
    match random.u8(..8) {
        0 => true.into(),
        1 => 7.into(),
        2 => 0.5.into(),
        3 => "text".into(),
        4 => toml::Value::Array(Vec::new()),
        5 => toml::Value::Array(vec![1.into(), "x".into()]),
        6 => toml::Table::new().into(),
        _ => date.into(),
    }
}

fn out_of_range(value: &toml::Value, random: &mut Rng) -> toml::Value {
    if let toml::Value::String(text) = value {
        let unit = text.trim_start_matches(|c: char| c.is_ascii_digit() || "+-.eE".contains(c)).to_owned();
        let number =
            ["-5", "0", "-0", "0.0", "1e9", "-1e-3", "+3", "1e999", "1e-999", "٣"][random.usize(..10)];
        return format!("{number} {}", unit.trim()).into();
    }
    let floats = [f64::NAN, f64::INFINITY, -1.0, 1e300, -1e300, 1e7, 0.0, -0.0, 2.0, 0.5, 1e-300];
    let wholes = [-1, 0, 1, 2, 1_000_001, i64::MAX, i64::MIN];
    match random.bool() {
        true => floats[random.usize(..floats.len())].into(),
        false => wholes[random.usize(..wholes.len())].into(),
    }
}
