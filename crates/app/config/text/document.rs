//! One text that keys are read from.

use toml::de::DeTable;

/// A text that keys were read from: the file, or one override of the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Document {
    /// What to call it in messages: the path as typed, or `--set`.
    pub name: String,
    /// The whole text, or the part of it that is shown.
    pub text: String,
    /// The number of its first line, from 1.
    pub first_line: usize,
}

impl Document {
    /// All of a text.
    pub fn whole(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into(), first_line: 1 }
    }

    /// The TOML line for an override `key=value` as typed: `coils[0].width=30 mm` becomes
    /// `coils.0.width = "30 mm"`.
    ///
    /// A value that is not TOML by itself is taken as text, so that a shell needs no second quotes.
    pub(in crate::config) fn of_override(typed: &str) -> Self {
        let (key, value) = typed.split_once('=').unwrap_or((typed, ""));
        let key = key.trim().replace('[', ".").replace(']', "");
        let value = value.trim();
        let plain = format!("{key} = {value}");
        let is_one_line = !typed.contains(['\n', '\r']);
        let text = if is_one_line && DeTable::parse(&plain).is_ok() {
            plain
        } else {
            format!("{key} = {}", toml::Value::String(value.to_owned()))
        };
        // Long enough for any key and value in use.
        const LONGEST: usize = 200;
        let cut = typed.chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c });
        let dots = if typed.chars().nth(LONGEST).is_some() { "…" } else { "" };
        Self::whole(format!("--set '{}{dots}'", cut.collect::<String>()), text)
    }
}
