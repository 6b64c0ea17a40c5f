//! Configurations and quantities by chance: any text, sound configurations with changed lines and characters, numbers with
//! every unit; and what a configuration is resolved to, which must read back as the same configuration.
//!
//! Changes of values and keys, table by table, are in [`crate::agreement`].

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use cpu_time::ThreadTime;
use fluxmorph::config::{Config, Dimension, parse_quantity};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};

use crate::quantity::measure;
use crate::sound::assert_reads_back;
use crate::support::repository;

/// Longest computing time for a text of some kilobytes; the fuzz targets run with the same limit.
const HANG: Duration = Duration::from_secs(2);

/// Reads a text; what is accepted must read back from its resolved form as the same configuration.
fn read(text: &str) -> Option<Config> {
    let start = ThreadTime::now();
    let result = Config::from_str(text, "some.toml");
    let report = result.as_ref().err().map(ToString::to_string);
    assert!(start.elapsed() < HANG, "{:?}", start.elapsed());
    assert!(report.is_none_or(|report| report.contains("some.toml")));
    let (config, source) = result.ok()?;
    for missing in [config.optimisation(&source).err(), config.morphing(&source).err()] {
        assert!(missing.is_none_or(|error| !error.to_string().is_empty()));
    }
    assert_reads_back(&config);
    Some(config)
}

/// All files of a folder with an ending, in the order of their names.
pub(crate) fn files(folder: &str, ending: &str) -> Vec<PathBuf> {
    let folder = repository(folder);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.expect("readable").path());
    let mut paths: Vec<PathBuf> = paths.filter(|path| path.to_string_lossy().ends_with(ending)).collect();
    paths.sort();
    paths
}

/// The shipped configurations and the seeds of the fuzz target, which together write every key.
pub(crate) fn sound() -> Vec<PathBuf> {
    [files("configs", ".toml"), files("fuzz/seeds/config", ".toml")].concat()
}

fn sound_texts() -> Vec<String> {
    sound().iter().map(|path| fs::read_to_string(path).expect("readable")).collect()
}

#[test]
fn every_former_finding_is_answered_in_time() {
    let text = |path: PathBuf| String::from_utf8_lossy(&fs::read(path).expect("readable")).into_owned();
    for path in files("tests/config/regressions/config", "") {
        read(&text(path));
    }
    for path in files("tests/config/regressions/quantity", "") {
        measure(&text(path));
    }
}

#[test]
fn odd_and_unfinished_texts_are_answered() {
    let small = crate::support::repository_text("fuzz/seeds/config/small.toml");
    for end in (0..small.len()).step_by(3) {
        read(&small[..end]);
    }
    for odd in ["\u{feff}", "\u{e9} = 1", "x = '''\n", "\"\\u0000\" = 1", "title = \"\u{e9}\"\n\r"] {
        read(odd);
    }
}

/// A change of a text that keeps most of its lines.
#[derive(Clone, Debug)]
enum Change {
    /// Takes a line out.
    WithoutLine(Index),
    /// Puts a line at another place once more.
    LineAgain(Index, Index),
    /// Changes a number by a factor.
    Number(Index, f64),
    /// Puts characters in between.
    Characters(Index, String),
    /// Cuts the text off.
    Cut(Index),
}

fn change() -> impl Strategy<Value = Change> {
    prop_oneof![
        any::<Index>().prop_map(Change::WithoutLine),
        any::<(Index, Index)>().prop_map(|(from, to)| Change::LineAgain(from, to)),
        (any::<Index>(), 0.5..2.0).prop_map(|(at, factor)| Change::Number(at, factor)),
        (any::<Index>(), "\\PC{1,3}").prop_map(|(at, text)| Change::Characters(at, text)),
        any::<Index>().prop_map(Change::Cut),
    ]
}

impl Change {
    fn apply(&self, text: String) -> String {
        let mut lines: Vec<&str> = text.lines().collect();
        if lines.is_empty() {
            return text;
        }
        let boundary = |at: usize| (0..=at).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
        let cut = |at: &Index| text.split_at(boundary(at.index(text.len() + 1)));
        match self {
            Self::WithoutLine(at) => drop(lines.remove(at.index(lines.len()))),
            Self::LineAgain(from, to) => lines.insert(to.index(lines.len()), lines[from.index(lines.len())]),
            Self::Number(at, factor) => return scaled(&text, *at, *factor),
            Self::Characters(at, characters) => return [cut(at).0, characters, cut(at).1].concat(),
            Self::Cut(at) => return cut(at).0.to_owned(),
        }
        lines.join("\n")
    }
}

/// The text with one of its numbers multiplied; whole numbers stay whole.
fn scaled(text: &str, at: Index, factor: f64) -> String {
    let is_digit = |&(_, c): &(usize, char)| c.is_ascii_digit();
    let Some((start, _)) = text.char_indices().filter(is_digit).nth(at.index(text.len().max(1)) / 8) else {
        return text.to_owned();
    };
    let length = text[start..].bytes().take_while(|b| b.is_ascii_digit() || *b == b'.').count();
    let number = &text[start..start + length];
    let new = match number.parse::<f64>() {
        Ok(value) if number.contains('.') => format!("{:?}", value * factor),
        Ok(value) => format!("{}", (value * factor).round()),
        Err(_) => number.to_owned(),
    };
    format!("{}{new}{}", &text[..start], &text[start + length..])
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,200}") {
        read(&text);
    }

    #[test]
    fn any_text_like_a_configuration_is_read_or_refused(
        lines in vec("(\\[{1,2}[a-z.]{1,12}\\]{1,2}|[a-z_.]{1,16} = [-+0-9a-z\"'\\[\\]{}., ]{0,24})", 0..20),
    ) {
        read(&lines.join("\n"));
    }

    #[test]
    fn a_changed_configuration_is_read_back_the_same_or_refused(
        text in select(sound_texts()),
        changes in vec(change(), 1..5),
    ) {
        read(&changes.iter().fold(text, |text, change| change.apply(text)));
    }
}

/// Every dimension with every unit that its messages name.
fn units() -> Vec<(Dimension, String)> {
    let of = |dimension: Dimension| {
        let units = dimension.accepted_units();
        units.split(", ").map(|unit| (dimension, unit.to_owned())).collect::<Vec<_>>()
    };
    Dimension::ALL.into_iter().flat_map(of).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn any_text_is_a_quantity_or_refused(text in "\\PC{0,30}") {
        measure(&text);
    }

    #[test]
    fn any_number_with_any_unit_is_a_quantity_or_refused(
        number in "[-+]?[0-9]{0,20}[.]?[0-9]{0,20}([eE][-+]?[0-9]{0,6})?",
        space in "[ \t\u{a0}]{0,2}",
        unit in select(units()),
    ) {
        measure(&format!("{number}{space}{}", unit.1));
    }

    #[test]
    fn a_number_with_a_unit_is_the_same_in_si_and_back(number in -1e9_f64..1e9, unit in select(units())) {
        let (dimension, unit) = unit;
        let one = parse_quantity(&format!("1 {unit}"), dimension).expect("a unit of its dimension");
        prop_assert!(one > 0.0 && one.is_finite());
        let value = parse_quantity(&format!("{number} {unit}"), dimension).expect("a number and a unit");
        // One rounding in the unit, one in the product, one in the quotient: half a unit in the last place each.
        prop_assert!((value / one - number).abs() <= 2.0 * f64::EPSILON * number.abs(), "{value} {one}");
        let again = parse_quantity(&format!("{value:e} {}", dimension.si_unit()), dimension);
        prop_assert_eq!(again, Ok(value));
    }

    #[test]
    fn a_quantity_of_another_dimension_is_refused(number in -1e9_f64..1e9, unit in select(units())) {
        for dimension in Dimension::ALL.into_iter().filter(|dimension| *dimension != unit.0) {
            let quantity = parse_quantity(&format!("{number} {}", unit.1), dimension);
            prop_assert!(quantity.is_err());
        }
    }
}
