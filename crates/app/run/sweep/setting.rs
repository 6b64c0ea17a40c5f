//! One `--set key=v1,v2`: a key of the configuration and its values.

use serde::{Deserialize, Serialize};

use super::SweepError;

/// A key of the configuration and the values that it takes, as they were typed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// The key path, with `coils.0.width` for `coils[0].width`.
    pub key: String,
    /// The values: at least one, each TOML or a plain text.
    pub values: Vec<String>,
}

impl Setting {
    /// Takes `key=v1,v2` apart. A comma in quotes, brackets or braces belongs to its value.
    ///
    /// # Errors
    /// [`SweepError::EmptyValue`] where nothing stands between two commas.
    pub fn parse(typed: &str) -> Result<Self, SweepError> {
        let (key, text) = typed.split_once('=').unwrap_or((typed, ""));
        let key = key.trim().replace('[', ".").replace(']', "");
        let values: Vec<String> = split(text).into_iter().map(|value| value.trim().to_owned()).collect();
        match values.iter().position(String::is_empty) {
            // A single empty value is an empty text, as for `run`.
            Some(gap) if values.len() > 1 => Err(SweepError::EmptyValue { key, number: gap + 1 }),
            _ => Ok(Self { key, values }),
        }
    }

    /// Whether it takes several values; one alone is the same for all combinations.
    pub fn is_swept(&self) -> bool {
        self.values.len() > 1
    }
}

/// The parts of a text between the commas that separate values.
fn split(text: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let (mut start, mut depth) = (0, 0_usize);
    let (mut quote, mut is_escaped) = (None, false);
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(_), _) if is_escaped => is_escaped = false,
            (Some('"'), '\\') => is_escaped = true,
            (Some(open), _) => quote = quote.filter(|_| c != open),
            // An apostrophe within a word is none that TOML knows.
            (None, '"' | '\'') if depth > 0 || text[start..at].trim().is_empty() => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            (None, _) => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comma_separates_outside_of_quotes_brackets_and_braces_only() {
        let cases: [(&str, &str, &[&str]); 9] = [
            ("a.b=1", "a.b", &["1"]),
            (" a = 1 , 2,3 ", "a", &["1", "2", "3"]),
            ("design.grid=[7,13],[3,5]", "design.grid", &["[7,13]", "[3,5]"]),
            ("coils[0].width=30 mm,20 mm", "coils.0.width", &["30 mm", "20 mm"]),
            ("title=\"a,b\",'c,d'", "title", &["\"a,b\"", "'c,d'"]),
            (r#"title="a\",b",c"#, "title", &[r#""a\",b""#, "c"]),
            (
                "design.initial={ random = 1, a = [2, 3] },0",
                "design.initial",
                &["{ random = 1, a = [2, 3] }", "0"],
            ),
            ("title=it's,that's", "title", &["it's", "that's"]),
            ("title=a=b,c", "title", &["a=b", "c"]),
        ];
        for (typed, key, values) in cases {
            let setting = Setting::parse(typed).expect(typed);
            assert_eq!(
                (setting.key.as_str(), setting.values.iter().map(String::as_str).collect()),
                (key, values.to_vec())
            );
        }
    }

    #[test]
    fn a_gap_is_refused_and_a_single_empty_value_is_not() {
        for typed in ["a=1,,2", "a=,1", "a=1,"] {
            assert!(matches!(Setting::parse(typed), Err(SweepError::EmptyValue { .. })), "{typed}");
        }
        assert_eq!(Setting::parse("title=").expect("an empty text").values, [""]);
    }
}
