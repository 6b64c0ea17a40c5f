//! Names of the run directories: readable, the same in every sweep over the same keys, safe on every file system.

use std::collections::BTreeMap;

use super::Setting;
use crate::files::blake3_hex;

/// Longest name [bytes]; the limit of file systems is 255, and some tools put something before or after.
const LONGEST: usize = 120;

/// Digits of the hash after a name that is shortened.
const DIGITS: usize = 8;

/// A name for each choice of one value for each setting: the swept keys with their values.
///
/// A name that leaves out characters of a value, is too long, or differs from another in capitals alone carries a hash of
/// the exact text.
pub(super) fn directory_names(settings: &[Setting], chosen: &[Vec<&str>]) -> Vec<String> {
    let is_sweep = settings.iter().any(Setting::is_swept);
    let named: Vec<Named> = chosen
        .iter()
        .map(|values| {
            let pairs = settings.iter().zip(values).filter(|(setting, _)| setting.is_swept() || !is_sweep);
            Named::of(pairs.map(|(setting, value)| (setting.key.as_str(), *value)))
        })
        .collect();
    let mut alike: BTreeMap<String, usize> = BTreeMap::new();
    for name in named.iter().filter(|name| name.is_exact) {
        *alike.entry(name.text.to_lowercase()).or_default() += 1;
    }
    let is_plain = |name: &Named| name.is_exact && alike[&name.text.to_lowercase()] == 1;
    named.iter().map(|name| if is_plain(name) { name.text.clone() } else { name.with_hash() }).collect()
}

struct Named {
    text: String,
    /// Whether no other combination can have this text.
    is_exact: bool,
    /// What the hash is of.
    exact: String,
}

impl Named {
    fn of<'a>(pairs: impl Iterator<Item = (&'a str, &'a str)>) -> Self {
        let mut named = Self { text: String::new(), is_exact: true, exact: String::new() };
        for (key, value) in pairs {
            if !named.text.is_empty() {
                named.text.push(',');
            }
            named.push(key);
            named.text.push('=');
            named.push(unquote(value));
            named.exact += &format!("{key}={value}\n");
        }
        if named.text.is_empty() {
            named.text.push_str("base");
        }
        // Windows drops a full stop at the end.
        named.is_exact &= named.text.len() <= LONGEST && !named.text.ends_with('.');
        named
    }

    /// Adds a text with what a name may hold.
    fn push(&mut self, text: &str) {
        let mut characters = text.chars().peekable();
        let mut before = None;
        self.is_exact &= !text.is_empty();
        while let Some(c) = characters.next() {
            match c {
                c if c.is_alphanumeric() || matches!(c, '.' | '_' | '-' | '+') => self.text.push(c),
                // Between a number and its unit a blank means nothing.
                ' ' if before.is_some_and(char::is_numeric)
                    && characters.peek().is_some_and(|c| c.is_alphabetic()) => {}
                '[' | ']' | '{' | '}' | '"' | '\'' => self.is_exact = false,
                _ => {
                    self.is_exact = false;
                    if !self.text.ends_with(['_', '=', ',']) {
                        self.text.push('_');
                    }
                }
            }
            before = Some(c);
        }
    }

    fn with_hash(&self) -> String {
        let room = LONGEST - DIGITS - 1;
        let end = (0..=room.min(self.text.len())).rev().find(|&end| self.text.is_char_boundary(end));
        let text = self.text[..end.unwrap_or(0)].trim_end_matches(['.', '_']);
        format!("{text}-{}", &blake3_hex(self.exact.as_bytes())[..DIGITS])
    }
}

/// A value without the quotes around it.
fn unquote(value: &str) -> &str {
    let inner = |quote| value.strip_prefix(quote)?.strip_suffix(quote);
    inner('"').or_else(|| inner('\'')).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(settings: &[(&str, &[&str])]) -> Vec<String> {
        let values = |own: &[&str]| own.iter().map(|v| (*v).to_owned()).collect();
        let settings: Vec<Setting> = settings
            .iter()
            .map(|(key, own)| Setting { key: (*key).to_owned(), values: values(own) })
            .collect();
        super::super::combinations(&settings).expect("a sweep").into_iter().map(|c| c.name).collect()
    }

    #[test]
    fn plain_values_are_read_from_the_name() {
        let all = names(&[
            ("design.upper", &["20 mm", "\"5 mm\"", "1e-3"]),
            ("optimizer.algorithm", &["mma", "ccsaq"]),
        ]);
        assert_eq!(all[0], "design.upper=20mm,optimizer.algorithm=mma");
        assert_eq!(all[3], "design.upper=5mm,optimizer.algorithm=ccsaq");
        assert_eq!(all[4], "design.upper=1e-3,optimizer.algorithm=mma");
        assert_eq!(names(&[("a", &["1"])]), ["a=1"]);
        assert_eq!(names(&[]), ["base"]);
    }

    #[test]
    fn a_name_that_does_not_tell_all_carries_a_hash() {
        let all = names(&[("design.grid", &["[7,13]", "[7, 13, 1]", "[71,3]", "../../x", "a b"])]);
        for (name, start) in all.iter().zip(["7_13-", "7_13_1-", "71_3-", ".._.._x-", "a_b-"]) {
            assert!(name.starts_with(&format!("design.grid={start}")), "{name}");
        }
        let long = "x".repeat(500);
        let all = names(&[("title", &[&long, &format!("{long}y"), "µ", "Ab", "aB"])]);
        assert!(all.iter().all(|name| name.len() <= LONGEST), "{all:?}");
        assert_eq!(all[2], "title=µ");
        let lower: std::collections::BTreeSet<_> = all.iter().map(|name| name.to_lowercase()).collect();
        assert_eq!(lower.len(), 5, "{all:?}");
    }

    #[test]
    fn further_values_change_no_name() {
        let few = names(&[("a", &["[1,2]", "x y"])]);
        let more = names(&[("a", &["[1, 2]", "[1,2]", "q", "x y", "x_y"])]);
        assert_eq!(few, [more[1].clone(), more[3].clone()]);
    }
}
