//! Text from files as it may reach a terminal: what would move its cursor, change its state, or hide or turn round other
//! letters is written out instead.

use std::borrow::Cow;

/// Whether a letter acts on a terminal or on the letters beside it instead of being seen: control characters (C0 but line
/// feed and tabulator, C1), marks of the writing direction, letters without width, other separators of lines.
pub(crate) fn is_hidden(letter: char) -> bool {
    match letter {
        '\n' | '\t' => false,
        '\u{ad}' | '\u{34f}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}' => true,
        '\u{180b}'..='\u{180f}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' => true,
        '\u{2060}'..='\u{206f}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}' | '\u{ffa0}' => true,
        '\u{fff9}'..='\u{fffb}' | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' => true,
        '\u{e0000}'..='\u{e0fff}' => true,
        other => other.is_control(),
    }
}

/// A text with what is hidden in it written out: `\u{9b}`.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |out, letter| out.extend(letter.escape_unicode()))
}

/// The same for a JSON document: in its strings, where alone such letters are, as JSON escapes them.
pub(crate) fn printable_json(text: &str) -> Cow<'_, str> {
    escaped(text, |out, letter| {
        let mut units = [0; 2];
        letter.encode_utf16(&mut units).iter().for_each(|unit| *out += &format!("\\u{unit:04x}"));
    })
}

/// The same with a visible letter of as many bytes in the place of each, so that every place in the text stays where it is.
/// C0 is left to whoever draws the excerpt.
pub(crate) fn masked(text: &str) -> Cow<'_, str> {
    let mask = |letter: char| match letter.len_utf8() {
        1 => letter,
        2 => '\u{bf}',
        3 => '\u{fffd}',
        _ => '\u{1f5d9}',
    };
    escaped(text, |out, letter| out.push(mask(letter)))
}

fn escaped(text: &str, mut escape: impl FnMut(&mut String, char)) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(2 * text.len());
    for letter in text.chars() {
        if is_hidden(letter) { escape(&mut out, letter) } else { out.push(letter) }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One of each kind: C0, delete, C1, direction, without width, separator, tag.
    const HOSTILE: &str = "a\u{1b}[2J\r\u{7f}\u{9b}31m\u{202e}\u{2066}\u{200b}\u{feff}\u{2028}\u{e0041}b";

    #[test]
    fn what_is_hidden_is_written_out_and_the_rest_stays() {
        assert!(matches!(printable("Eisen µ, 鉄, 10⁻⁷\n\tüber"), Cow::Borrowed(_)));
        let shown = printable(HOSTILE);
        assert!(!shown.contains(is_hidden), "{shown:?}");
        assert!(
            shown.starts_with("a\\u{1b}[2J\\u{d}\\u{7f}\\u{9b}31m\\u{202e}") && shown.ends_with('b'),
            "{shown}"
        );
    }

    #[test]
    fn json_stays_the_same_value() {
        let text = serde_json::to_string(HOSTILE).expect("a text");
        let shown = printable_json(&text);
        assert!(!shown.contains(is_hidden), "{shown:?}");
        assert_eq!(serde_json::from_str::<String>(&shown).expect("JSON"), HOSTILE);
    }

    #[test]
    fn a_mask_keeps_every_place() {
        let masked = masked(HOSTILE);
        assert_eq!(masked.len(), HOSTILE.len());
        assert_eq!(masked.find('b'), HOSTILE.find('b'));
        assert!(!masked.contains(|letter| is_hidden(letter) && !letter.is_ascii()), "{masked:?}");
    }
}
