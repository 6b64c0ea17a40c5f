//! The position of a value in a JSON text, for messages; the JSON reader does not give it.

use std::ops::Range;

/// The bytes around a line and column, both from 1, as a parser gives them: to the end of the word there.
pub(super) fn at_line(text: &str, line: usize, column: usize) -> Range<usize> {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let in_line = text[start..].lines().next().unwrap_or_default();
    let mut at = column.saturating_sub(1).min(in_line.len());
    while !in_line.is_char_boundary(at) {
        at -= 1;
    }
    let word = in_line[at..].find([',', ']', '}', ' ']).unwrap_or(in_line.len() - at);
    let least = in_line[at..].chars().next().map_or(0, char::len_utf8);
    start + at..start + at + word.max(least)
}

/// The bytes of the item with a number of the first list after a byte.
pub(super) fn item(text: &str, from: usize, number: usize) -> Option<Range<usize>> {
    let open = from + text[from..].find('[')?;
    let (mut depth, mut count, mut quoted, mut escaped) = (0_usize, 0, false, false);
    let mut start = open + 1;
    for (offset, c) in text[open..].char_indices() {
        let at = open + offset;
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            _ if quoted => {}
            '[' | '{' => depth += 1,
            ',' | ']' | '}' if depth == 1 => {
                if count == number {
                    let item = &text[start..at];
                    let lead = item.len() - item.trim_start().len();
                    return Some(start + lead..start + lead + item.trim().len());
                }
                count += 1;
                start = at + 1;
                if c != ',' {
                    return None;
                }
            }
            ']' | '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_found_past_lists_and_quotes() {
        let text = "{\"a\": \"[\", \"values_m\": [1, [2, 3], \"x,]\" ,\n null]}";
        let from = text.find("values_m").expect("it is there");
        let found = |number| item(text, from, number).map(|range| &text[range]);
        assert_eq!(found(0), Some("1"));
        assert_eq!(found(1), Some("[2, 3]"));
        assert_eq!(found(2), Some("\"x,]\""));
        assert_eq!(found(3), Some("null"));
        assert_eq!(found(4), None);
        assert_eq!(&text[at_line(text, 2, 2)], "null");
    }
}
