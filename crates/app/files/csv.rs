//! Texts in tables of comma-separated values, as RFC 4180 has them.

/// A text as a cell: quoted where it holds what separates cells.
pub(crate) fn csv_text(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::csv_text;

    #[test]
    fn a_text_is_quoted_only_where_it_would_be_more_than_one_cell() {
        assert_eq!(csv_text("nu = 0.1; E 5"), "nu = 0.1; E 5");
        assert_eq!(csv_text("soft, \"uniform\""), "\"soft, \"\"uniform\"\"\"");
        assert_eq!(csv_text("two\nlines"), "\"two\nlines\"");
    }
}
