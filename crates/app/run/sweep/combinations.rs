//! Every combination of the values of some keys, in an order and under names that last.

use std::collections::BTreeSet;

use super::names::directory_names;
use super::{Setting, SweepError};

/// Most combinations of a sweep: far more than anyone compares, and few enough for one folder.
pub const MOST_COMBINATIONS: usize = 10_000;

/// One value for every key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Combination {
    /// The name of its directory, unique in the sweep.
    pub name: String,
    /// Values of the swept keys, in the order of the settings.
    pub values: Vec<String>,
    /// The `--set` arguments of `run`, including those that all combinations share.
    pub overrides: Vec<String>,
}

/// The product of the settings; the first key changes slowest.
///
/// # Errors
/// [`SweepError::KeyTwice`], [`SweepError::Directories`], [`SweepError::TooMany`], and [`SweepError::Same`] where a value
/// stands twice.
pub fn combinations(settings: &[Setting]) -> Result<Vec<Combination>, SweepError> {
    let mut keys = BTreeSet::new();
    for Setting { key, values } in settings {
        if !keys.insert(key) {
            return Err(SweepError::KeyTwice { key: key.clone() });
        }
        if key == "output.directory" && values.len() > 1 {
            return Err(SweepError::Directories { values: values.len() });
        }
        let mut once = BTreeSet::new();
        if let Some(value) = values.iter().find(|value| !once.insert(*value)) {
            let twice = format!("{key}={value}");
            return Err(SweepError::Same { first: twice.clone(), second: twice });
        }
    }
    let count = settings.iter().map(|setting| setting.values.len()).fold(1, usize::saturating_mul);
    if count > MOST_COMBINATIONS {
        return Err(SweepError::TooMany { count });
    }
    let chosen: Vec<Vec<&str>> = (0..count).map(|index| values_of(settings, index)).collect();
    let names = directory_names(settings, &chosen);
    let combination = |(name, values): (String, Vec<&str>)| {
        let pairs = || settings.iter().zip(&values);
        let swept = pairs().filter(|(setting, _)| setting.is_swept());
        Combination {
            name,
            values: swept.map(|(_, value)| (*value).to_owned()).collect(),
            overrides: pairs().map(|(setting, value)| format!("{}={value}", setting.key)).collect(),
        }
    };
    Ok(names.into_iter().zip(chosen).map(combination).collect())
}

/// The values of the combination of a number, one for each setting.
fn values_of(settings: &[Setting], index: usize) -> Vec<&str> {
    let mut rest = index;
    let mut values: Vec<&str> = Vec::with_capacity(settings.len());
    for Setting { values: own, .. } in settings.iter().rev() {
        values.push(&own[rest % own.len()]);
        rest /= own.len();
    }
    values.reverse();
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(typed: &[&str]) -> Result<Vec<Combination>, SweepError> {
        let settings: Result<Vec<_>, _> = typed.iter().map(|typed| Setting::parse(typed)).collect();
        combinations(&settings?)
    }

    #[test]
    fn the_first_key_changes_slowest_and_a_single_value_is_in_all() {
        let all = of(&["a=1,2", "fixed=x", "b=3,4,5"]).expect("six");
        let names: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["a=1,b=3", "a=1,b=4", "a=1,b=5", "a=2,b=3", "a=2,b=4", "a=2,b=5"]);
        assert_eq!(all[4].values, ["2", "4"]);
        assert_eq!(all[4].overrides, ["a=2", "fixed=x", "b=4"]);
    }

    #[test]
    fn without_values_there_is_one_combination() {
        assert_eq!(of(&[]).expect("one").len(), 1);
        assert_eq!(of(&["a=1"]).expect("one")[0].overrides, ["a=1"]);
    }

    #[test]
    fn what_is_no_sweep_is_refused() {
        assert!(matches!(of(&["a=1,2", "a=3"]), Err(SweepError::KeyTwice { .. })));
        assert!(matches!(of(&["c[0].w=1,2", "c.0.w=3"]), Err(SweepError::KeyTwice { .. })));
        assert!(matches!(of(&["a=1,2,1"]), Err(SweepError::Same { .. })));
        assert!(matches!(of(&["output.directory=a,b"]), Err(SweepError::Directories { values: 2 })));
        let many = format!("={}", (0..101).map(|n| n.to_string()).collect::<Vec<_>>().join(","));
        let [a, b] = ["a", "b"].map(|key| format!("{key}{many}"));
        assert!(matches!(of(&[&a, &b]), Err(SweepError::TooMany { count: 10_201 })));
        // More than can be counted.
        let keys: Vec<String> = (0..64).map(|n| format!("k{n}=1,2")).collect();
        let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        assert!(matches!(of(&keys), Err(SweepError::TooMany { count: usize::MAX })));
    }
}
