//! One line of a text and its parts.

use std::ops::Range;

/// A line and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Line<'t> {
    /// Without its end.
    pub(super) text: &'t str,
    /// Bytes of the whole text.
    pub(super) range: Range<usize>,
}

impl<'t> Line<'t> {
    /// The line that holds a byte; a byte behind the end of a line belongs to it.
    pub(super) fn at(text: &'t str, byte: usize) -> Self {
        let mut byte = byte.min(text.len());
        while !text.is_char_boundary(byte) {
            byte -= 1;
        }
        let start = text[..byte].rfind('\n').map_or(0, |end| end + 1);
        let end = text[start..].find('\n').map_or(text.len(), |length| start + length);
        let line = &text[start..end];
        let line = line.strip_suffix('\r').unwrap_or(line);
        Self { text: line, range: start..start + line.len() }
    }

    /// The lines of a text, first to last.
    pub(super) fn all(text: &'t str) -> impl Iterator<Item = Self> {
        let mut start = 0;
        text.split_inclusive('\n').map(move |line| {
            let whole = line.trim_end_matches(['\n', '\r']);
            let range = start..start + whole.len();
            start += line.len();
            Self { text: whole, range }
        })
    }

    /// Bytes of the whole text for bytes of the line.
    pub(super) fn span(&self, part: Range<usize>) -> Range<usize> {
        self.range.start + part.start..self.range.start + part.end
    }

    /// The line without blanks around it and without a comment.
    pub(super) fn content(&self) -> Range<usize> {
        let end = self.outside_quotes().find(|(_, c)| *c == '#').map_or(self.text.len(), |(at, _)| at);
        let trimmed = self.text[..end].trim_end();
        let start = trimmed.len() - trimmed.trim_start().len();
        start..trimmed.len().max(start)
    }

    /// Whether it starts with a bracket.
    pub(super) fn is_header(&self) -> bool {
        self.text.trim_start().starts_with('[')
    }

    /// The key: what stands before the first `=`, or all of the line.
    pub(super) fn key(&self) -> Range<usize> {
        let content = self.content();
        let end = self.equals().unwrap_or(content.end).max(content.start);
        content.start..content.start + self.text[content.start..end].trim_end().len()
    }

    /// The value: what stands behind the first `=`.
    pub(super) fn value(&self) -> Option<Range<usize>> {
        let (start, content) = (self.equals()? + 1, self.content());
        let rest = &self.text[start..content.end.max(start)];
        let lead = rest.len() - rest.trim_start().len();
        Some(start + lead..start + lead + rest.trim().len())
    }

    /// The first `=` that is in no quotes and no comment.
    pub(super) fn equals(&self) -> Option<usize> {
        self.outside_quotes().take_while(|(_, c)| *c != '#').find(|(_, c)| *c == '=').map(|(at, _)| at)
    }

    /// The quote that is not closed on the line; three quotes in a row open a text of several lines.
    pub(super) fn open_quote(&self) -> Option<usize> {
        if self.text.contains("\"\"\"") || self.text.contains("'''") {
            return None;
        }
        Scan::of(self.text).last().and_then(|step| step.opened)
    }

    /// Characters outside of quotes, with their bytes.
    pub(super) fn outside_quotes(&self) -> impl Iterator<Item = (usize, char)> {
        Scan::of(self.text).filter(|step| !step.quoted).map(|step| (step.at, step.letter))
    }
}

/// One character, and whether it is quoted.
struct Step {
    at: usize,
    letter: char,
    quoted: bool,
    /// The quote that is open behind it.
    opened: Option<usize>,
}

/// Walks through a line and keeps account of quotes, up to a comment.
struct Scan<'t> {
    rest: std::str::CharIndices<'t>,
    open: Option<(usize, char)>,
    commented: bool,
}

impl<'t> Scan<'t> {
    fn of(text: &'t str) -> Self {
        Self { rest: text.char_indices(), open: None, commented: false }
    }
}

impl Iterator for Scan<'_> {
    type Item = Step;

    fn next(&mut self) -> Option<Step> {
        let (at, letter) = self.rest.next()?;
        let quoted = self.open.is_some() || matches!(letter, '"' | '\'') && !self.commented;
        match (self.open, letter) {
            _ if self.commented => {}
            (None, '#') => self.commented = true,
            (None, '"' | '\'') => self.open = Some((at, letter)),
            (Some((_, '"')), '\\') => {
                self.rest.next();
            }
            (Some((_, quote)), _) if quote == letter => self.open = None,
            _ => {}
        }
        Some(Step { at, letter, quoted, opened: self.open.map(|(start, _)| start) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_a_line_are_found() {
        let text = "a = 1\n  key = \"x # = y\" # it's a comment\n";
        let line = Line::at(text, 10);
        assert_eq!(&line.text[line.key()], "key");
        assert_eq!(&line.text[line.value().expect("it has one")], "\"x # = y\"");
        assert_eq!(&text[line.span(line.content())], "key = \"x # = y\"");
        assert_eq!(line.open_quote(), None);
        assert_eq!(Line::at("a = \"b\\\" c", 0).open_quote(), Some(4));
        assert_eq!(Line::at("a = 'b\\'", 0).open_quote(), None);
        assert_eq!(Line::all(text).count(), 2);
    }
}
