//! Program and schema judge thousands of configurations, and agree.
//!
//! What the program accepts the schema accepts: without exception. What the program refuses the schema refuses, where the
//! fault lies in one value or in the keys of one table. A schema cannot compare values; those faults are listed here by
//! the words of their message, counted, and bounded in number.

use std::collections::{BTreeMap, BTreeSet};

use fastrand::Rng;
use fluxmorph::schema;

use crate::changes::{CHANGES, Change, changed};
use crate::places::{Step, all, schema_at, tables};
use crate::sound::value_at;
use crate::verdict::{bases, judge, validator};

/// Changed configurations.
const COUNT: usize = 6000;

/// Largest share of configurations that the schema accepts and the program refuses: half as much again as was measured, so
/// that a rule of the schema that stops working is seen.
const LARGEST_SHARE: f64 = 0.10;

/// Faults that no schema of single values can see: what they are about, and words of their messages.
const BEYOND_A_SCHEMA: [(&str, &[&str]); 9] = [
    (
        "a name that another table gives",
        &["there is no material", "there is no load", "which is not analysed"],
    ),
    (
        "a name twice in several tables",
        &[
            "two coils are named",
            "two loads are named",
            "two constraints are named",
            "two probes are named",
            "two forces are named",
            "two multipoles are named",
            "two surfaces are named",
            "two subregions are named",
            "two cases are named",
            "there are two symmetry planes",
        ],
    ),
    ("a name in two lists", &["stands in remesh.", "is flux-parallel and", "is flux-normal and"]),
    (
        "the order of values",
        &[
            "runs from",
            "goes from",
            "has no volume",
            "is turned over",
            "the bounds cross",
            "no value keeps both",
            "outside of the bounds",
            "the bounds leave out",
            "m at least and",
            "more than a half size",
            "which is no order of its terms",
        ],
    ),
    (
        "frequencies and what is analysed at them",
        &[
            "is a loss at 0 Hz",
            "is of losses at 0 Hz",
            "is of a coil at 0 Hz",
            "has an impedance surface",
            "is a permanent magnet, but",
            "has a B–H curve, but",
            "Hz twice",
        ],
    ),
    ("directions", &["has no part across the axis", "leaves the symmetry plane"]),
    ("an algorithm without constraints", &["cannot keep constraints", "has no bound on the terms"]),
    ("options of PETSc", &["`analysis.petsc.options`"]),
    ("what edge elements have not", &["for edge elements", "edge elements have"]),
];

/// Faults of the keys of a table, which the schema sees, but not where a case lays its table over another.
const OF_A_CASE: [&str; 7] = [
    "is a table, not a list",
    "is not the number of an item",
    "are both given",
    "has both `",
    "belongs to `mesh.file`",
    "has no use without generator",
    "divides the wall of a hollow sphere",
];

/// Words of faults in the size of a number.
const SIZES: [&str; 4] = ["which is out of range", "is too large for a number", "is 0 A", "is zero:"];

/// The kind of a fault that no schema can see.
fn beyond_a_schema(config: &toml::Table, path: &str, message: &str) -> Option<&'static str> {
    let holds = |words: &[&str]| words.iter().any(|word| message.contains(word));
    if let Some((kind, _)) = BEYOND_A_SCHEMA.iter().find(|(_, words)| holds(words)) {
        return Some(kind);
    }
    // A radius of zero is none, and the schema does not see it in a text.
    let radius = || written_at(config, "mesh.sphere.inner_radius");
    if message.contains("divides the wall") && radius().into_iter().any(toml::Value::is_str) {
        return Some("the size of a number in a text");
    }
    if let Some(cases) = cases_of(config)
        && (holds(&OF_A_CASE) || message.starts_with("missing key") || cases.iter().any(changes_items))
    {
        return Some("a table of a case laid over another");
    }
    written_at(config, path).into_iter().find_map(|value| form_of_a_number(value, message))
}

/// Whether a case changes lists item by item, `subregions.0.young = 5`: what is in an item the schema leaves open.
fn changes_items(value: &toml::Value) -> bool {
    match value {
        toml::Value::Table(table) => {
            table.iter().any(|(key, value)| key.parse::<usize>().is_ok() || changes_items(value))
        }
        toml::Value::Array(items) => items.iter().any(changes_items),
        _ => false,
    }
}

/// Faults of how a number is written: a pattern does not compute, and JSON has one kind of number and no dates.
fn form_of_a_number(value: &toml::Value, message: &str) -> Option<&'static str> {
    let is_text = |value: &toml::Value| value.is_str();
    match value {
        toml::Value::Datetime(_) => Some("a date where a text is asked for"),
        toml::Value::Float(number)
            if number.fract() == 0.0 && message.contains("written as a real number") =>
        {
            Some("a whole number written with a point")
        }
        toml::Value::Array(items) if message.contains("has no length") => {
            let tiny = |item: &toml::Value| item.as_float().is_some_and(|x| x != 0.0 && x.abs() < 1e-100);
            items.iter().any(tiny).then_some("a vector that is too short")
        }
        toml::Value::Array(items) if !items.iter().any(is_text) => None,
        toml::Value::String(_) | toml::Value::Array(_)
            if SIZES.iter().any(|words| message.contains(words)) =>
        {
            Some("the size of a number in a text")
        }
        _ => None,
    }
}

/// The cases as they are written.
fn cases_of(config: &toml::Table) -> Option<&[toml::Value]> {
    Some(config.get("morph")?.get("case")?.as_array()?)
}

/// The values that a fault at a key path such as `coils[0].center[1]` may be about: that of the configuration, and those of the
/// cases, since a fault of a case has the path that its value has once it is laid over the configuration.
fn written_at<'a>(config: &'a toml::Table, path: &str) -> Vec<&'a toml::Value> {
    let path = path.replace('[', ".").replace(']', "");
    let of_a_case = path.strip_prefix("morph.").unwrap_or(&path);
    let cases = cases_of(config).into_iter().flatten().filter_map(toml::Value::as_table);
    value_at(config, &path).into_iter().chain(cases.filter_map(|case| value_at(case, of_a_case))).collect()
}

/// Changes are made where a base has something to change.
#[test]
fn the_bases_write_every_key() {
    let document = schema::document();
    let name_of = |path: &[Step]| Some(schema_at(&document, path)?.0.unwrap_or_default().to_owned());
    let mut written = BTreeSet::new();
    for (_, table) in bases() {
        for path in all(&table) {
            if let (Some(Step::Key(key)), Some(name)) = (path.last(), name_of(&path[..path.len() - 1])) {
                written.insert((name, key.clone()));
            }
        }
    }
    let missing: Vec<_> = tables(&document)
        .flat_map(|(name, keys)| keys.keys().map(move |key| (name.to_owned(), key.clone())))
        .filter(|key| !written.contains(key))
        .collect();
    assert!(missing.is_empty(), "no shipped configuration and no seed writes {missing:?}");
}

#[test]
fn program_and_schema_agree() {
    let document = schema::document();
    let validator = validator();
    let bases = bases();
    let mut random = Rng::with_seed(7);
    let mut table: BTreeMap<Change, [usize; 4]> = BTreeMap::new();
    let mut beyond: BTreeMap<&str, usize> = BTreeMap::new();
    let mut unknown = Vec::new();
    let mut wrong = Vec::new();
    let mut count = 0;
    while count < COUNT {
        let (name, base) = &bases[random.usize(..bases.len())];
        let change = CHANGES[count % CHANGES.len()];
        let Some(mut config) = changed(&document, base, change, &mut random) else { continue };
        // Now and then a second change: faults that hide each other.
        if change != Change::None && random.u8(..8) == 0 {
            let second = CHANGES[random.usize(..CHANGES.len())];
            config = changed(&document, &config, second, &mut random).unwrap_or(config);
        }
        count += 1;
        let verdict = judge(&validator, &config);
        let row = table.entry(change).or_default();
        match (verdict.faults.is_empty(), verdict.complaints.is_empty()) {
            (true, true) => row[0] += 1,
            (false, false) => row[1] += 1,
            (true, false) => {
                row[2] += 1;
                let complaints = verdict.complaints;
                wrong.push(format!("{name}, {change:?}: only the schema refuses: {complaints:?}\n{config}"));
            }
            (false, true) => {
                row[3] += 1;
                // One fault of a single value would have to be seen, whatever else is wrong.
                for (path, message) in &verdict.faults {
                    match beyond_a_schema(&config, path, message) {
                        Some(kind) => *beyond.entry(kind).or_default() += 1,
                        None => unknown.push(format!("{name}, {change:?}: {message}")),
                    }
                }
            }
        }
    }

    println!("change          both accept  both refuse  schema only refuses  program only refuses");
    for (change, [accept, refuse, schema, program]) in &table {
        println!("{:<15} {accept:>11} {refuse:>12} {schema:>20} {program:>21}", format!("{change:?}"));
    }
    let sum = |column: usize| table.values().map(|row| row[column]).sum::<usize>();
    let totals = [sum(0), sum(1), sum(2), sum(3)];
    println!("{COUNT} configurations: {totals:?}; faults that no schema can see, by kind:");
    for (kind, count) in &beyond {
        println!("{count:>6}  {kind}");
    }
    assert!(wrong.is_empty(), "{} of {COUNT}:\n{}", wrong.len(), wrong[..wrong.len().min(12)].join("\n"));
    unknown.sort();
    unknown.dedup();
    assert!(
        unknown.is_empty(),
        "{} of {COUNT}:\n{}",
        unknown.len(),
        unknown[..unknown.len().min(40)].join("\n")
    );
    assert!(totals[0] > COUNT / 10 && totals[1] > COUNT / 4, "the changes are lopsided: {totals:?}");
    assert!((totals[3] as f64) < LARGEST_SHARE * COUNT as f64, "{totals:?}");
}
