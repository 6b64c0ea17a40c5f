//! What the program and the schema say of one configuration, and the sound configurations to begin with.

use fluxmorph::config::{Config, ConfigError};
use fluxmorph::schema;
use jsonschema::Validator;
use serde_json::Value;

use crate::chance::sound;
use crate::sound::assert_reads_back;

/// Both verdicts.
pub(crate) struct Verdict {
    /// Key path and message of the program's faults, none when it accepts.
    pub(crate) faults: Vec<(String, String)>,
    /// The first complaints of the schema, none when it accepts.
    pub(crate) complaints: Vec<String>,
}

/// All sound configurations, with their names.
pub(crate) fn bases() -> Vec<(String, toml::Table)> {
    let parsed = |path: std::path::PathBuf| {
        let name = path.file_name().expect("a file").to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).expect("readable");
        let table = text.parse().unwrap_or_else(|error| panic!("{name}: {error}"));
        (name, table)
    };
    sound().into_iter().map(parsed).collect()
}

/// The schema, ready to judge.
pub(crate) fn validator() -> Validator {
    jsonschema::draft202012::new(&schema::document()).expect("a valid schema")
}

/// Judges one configuration by both; what is accepted must read back from its resolved form.
pub(crate) fn judge(validator: &Validator, table: &toml::Table) -> Verdict {
    let text = toml::to_string(table).expect("a table can be written");
    let faults = match Config::from_str(&text, "changed.toml") {
        Ok((config, _)) => {
            assert_reads_back(&config);
            Vec::new()
        }
        Err(ConfigError::Invalid(report)) => {
            report.diagnostics.into_iter().map(|fault| (fault.path, fault.message)).collect()
        }
        Err(other) => panic!("{other}"),
    };
    let json = to_json(&toml::Value::Table(table.clone()));
    let complaints = validator
        .iter_errors(&json)
        .take(3)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    Verdict { faults, complaints }
}

/// The form in which editors hand a TOML file to a schema: a date is its text; what is no JSON number is null.
pub(crate) fn to_json(value: &toml::Value) -> Value {
    match value {
        toml::Value::String(text) => text.as_str().into(),
        toml::Value::Integer(value) => (*value).into(),
        toml::Value::Float(value) => (*value).into(),
        toml::Value::Boolean(value) => (*value).into(),
        toml::Value::Datetime(value) => value.to_string().into(),
        toml::Value::Array(items) => items.iter().map(to_json).collect(),
        toml::Value::Table(table) => {
            Value::Object(table.iter().map(|(key, value)| (key.clone(), to_json(value))).collect())
        }
    }
}

/// The TOML form of a value of the schema.
pub(crate) fn to_toml(value: &Value) -> toml::Value {
    match value {
        Value::String(text) => toml::Value::String(text.clone()),
        Value::Bool(value) => toml::Value::Boolean(*value),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => toml::Value::Integer(whole),
            None => toml::Value::Float(number.as_f64().expect("a number")),
        },
        Value::Array(items) => toml::Value::Array(items.iter().map(to_toml).collect()),
        Value::Object(keys) => {
            toml::Value::Table(keys.iter().map(|(key, value)| (key.clone(), to_toml(value))).collect())
        }
        Value::Null => panic!("TOML has no null"),
    }
}
