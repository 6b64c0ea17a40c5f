//! Reads numbers and lines from the bytes of a Gmsh file, ASCII or binary, and says where they stand.
//!
//! One set of methods reads both forms: a *record* is a line of an ASCII file and nothing of its own in a binary one.
//! ASCII records are kept to their lines although the format does not ask for it (all known writers do): a number too
//! few then shows on its own line, and not where the numbers run out.

use super::error::{Excerpt, MshError, MshFault, Place, Subject};

/// Bytes of a token that a message shows.
const SHOWN: usize = 40;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// As text.
    Ascii,
    /// Lowest byte first.
    LittleEndian,
    /// Highest byte first.
    BigEndian,
}

/// A place in the bytes of a file.
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    position: usize,
    encoding: Encoding,
    /// What is being read, for messages.
    pub(super) subject: Subject,
}

impl<'a> Cursor<'a> {
    /// At the start of a file that is taken for ASCII until its header says more.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, position: 0, encoding: Encoding::Ascii, subject: Subject::File }
    }

    pub(super) fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// From here on numbers of records are written like that.
    pub(super) fn set_encoding(&mut self, encoding: Encoding) {
        self.encoding = encoding;
    }

    pub(super) fn position(&self) -> usize {
        self.position
    }

    /// Bytes of the whole file.
    pub(super) fn length(&self) -> usize {
        self.bytes.len()
    }

    /// Bytes that remain.
    pub(super) fn remaining(&self) -> usize {
        self.bytes.len() - self.position
    }

    /// The place of a byte.
    pub(super) fn place(&self, position: usize) -> Place {
        match self.encoding {
            Encoding::Ascii => {
                let before = &self.bytes[..position.min(self.bytes.len())];
                Place::Line(1 + before.iter().filter(|&&b| b == b'\n').count())
            }
            _ => Place::Byte(position),
        }
    }

    /// A fault of the current subject at the current position.
    pub(super) fn fault(&self, fault: MshFault) -> MshError {
        self.fault_at(self.position, self.subject.clone(), fault)
    }

    /// A fault of a subject at a position.
    pub(super) fn fault_at(&self, position: usize, subject: Subject, fault: MshFault) -> MshError {
        let place = self.place(position);
        let excerpt = match place {
            Place::Line(_) => Some(Box::new(Excerpt::of(self.bytes, position))),
            Place::Byte(_) => None,
        };
        MshError { place, subject, fault, excerpt }
    }

    /// The position of the next number: in an ASCII file of the next word on this line, or of the line's end.
    pub(super) fn next_word(&self) -> usize {
        if self.encoding == Encoding::Ascii { self.next_word_of_text() } else { self.position }
    }

    /// The position of the next word on this line, of the line's end where there is none.
    pub(super) fn next_word_of_text(&self) -> usize {
        let blanks = self.bytes[self.position..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
        self.position + blanks
    }

    fn truncated(&self, expected: &'static str) -> MshError {
        self.fault_at(self.bytes.len(), self.subject.clone(), MshFault::Truncated { expected })
    }

    /// What stands at the position instead of what is expected.
    pub(super) fn unexpected(&self, expected: &'static str) -> MshError {
        let rest = &self.bytes[self.position..];
        if rest.is_empty() {
            return self.truncated(expected);
        }
        let found = match rest.iter().position(u8::is_ascii_whitespace) {
            Some(0) if rest[0] == b'\r' && rest.get(1) != Some(&b'\n') => {
                "a carriage return without a line feed, which ends no line".to_owned()
            }
            Some(0) => "the end of the line".to_owned(),
            end => shown(&rest[..end.unwrap_or(rest.len())]),
        };
        self.fault(MshFault::Unexpected { expected, found })
    }

    /// Refuses a count of things of at least `least` bytes each that the rest of the file cannot hold.
    pub(super) fn check_count(
        &self,
        position: usize,
        claimed: u64,
        least: usize,
        what: &'static str,
    ) -> Result<usize, MshError> {
        let bytes = self.remaining();
        let most = bytes / least;
        match usize::try_from(claimed) {
            Ok(count) if count <= most => Ok(count),
            _ => {
                let fault = MshFault::TooMany { what, claimed, bytes, most: most as u64 };
                Err(self.fault_at(position, self.subject.clone(), fault))
            }
        }
    }

    /// Starts a record and yields its position.
    pub(super) fn begin_record(&mut self) -> usize {
        if self.encoding == Encoding::Ascii {
            self.skip_blank();
        }
        self.position
    }

    /// Ends a record: nothing more may stand on its line.
    pub(super) fn end_record(&mut self) -> Result<(), MshError> {
        if self.encoding == Encoding::Ascii { self.end_line() } else { Ok(()) }
    }

    /// Leaves the rest of an ASCII record unread.
    pub(super) fn skip_line(&mut self) {
        let rest = &self.bytes[self.position..];
        self.position += rest.iter().position(|&b| b == b'\n').map_or(rest.len(), |end| end + 1);
    }

    /// Leaves bytes of a binary file unread.
    pub(super) fn skip_bytes(&mut self, count: usize, expected: &'static str) -> Result<(), MshError> {
        if count > self.remaining() {
            return Err(self.truncated(expected));
        }
        self.position += count;
        Ok(())
    }

    /// Skips blanks, tabs and line ends.
    pub(super) fn skip_blank(&mut self) {
        while self.bytes.get(self.position).is_some_and(u8::is_ascii_whitespace) {
            self.position += 1;
        }
    }

    fn skip_spaces(&mut self) {
        while matches!(self.bytes.get(self.position), Some(b' ' | b'\t')) {
            self.position += 1;
        }
    }

    /// The end of a line of text, in ASCII and binary files alike; the end of the file is one too.
    pub(super) fn end_line(&mut self) -> Result<(), MshError> {
        self.skip_spaces();
        match &self.bytes[self.position..] {
            [] => Ok(()),
            [b'\n', ..] => {
                self.position += 1;
                Ok(())
            }
            [b'\r', b'\n', ..] => {
                self.position += 2;
                Ok(())
            }
            _ => Err(self.unexpected("the end of the line")),
        }
    }

    /// The rest of the line without its end.
    pub(super) fn line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.position..];
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.position += (end + 1).min(rest.len());
        rest[..end].strip_suffix(b"\r").unwrap_or(&rest[..end])
    }

    /// A word on this line.
    pub(super) fn word(&mut self, expected: &'static str) -> Result<&'a [u8], MshError> {
        self.skip_spaces();
        let rest = &self.bytes[self.position..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if end == 0 {
            return Err(self.unexpected(expected));
        }
        self.position += end;
        Ok(&rest[..end])
    }

    /// Goes behind the next line that is exactly `mark`; the search reads every byte once.
    pub(super) fn skip_behind(&mut self, mark: &[u8]) -> bool {
        let mut from = self.position;
        while let Some(found) = find(&self.bytes[from..], mark) {
            let (start, end) = (from + found, from + found + mark.len());
            let own_line = start == 0 || self.bytes[start - 1] == b'\n';
            if own_line && self.bytes.get(end).is_none_or(u8::is_ascii_whitespace) {
                self.position = end;
                return true;
            }
            from = start + 1;
        }
        false
    }

    /// A whole number from 0, as text.
    pub(super) fn text_size(&mut self, expected: &'static str) -> Result<u64, MshError> {
        self.skip_spaces();
        let start = self.position;
        let mut value: u64 = 0;
        while let Some(digit) =
            self.bytes.get(self.position).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10)
        {
            match value.checked_mul(10).and_then(|v| v.checked_add(u64::from(digit))) {
                Some(next) => value = next,
                None => {
                    self.position = start;
                    return Err(self.unexpected(expected));
                }
            }
            self.position += 1;
        }
        let ended = self.bytes.get(self.position).is_none_or(u8::is_ascii_whitespace);
        if self.position == start || !ended {
            self.position = start;
            return Err(self.unexpected(expected));
        }
        Ok(value)
    }

    /// A whole number of 32 bits, as text.
    pub(super) fn text_int(&mut self, expected: &'static str) -> Result<i32, MshError> {
        self.skip_spaces();
        let start = self.position;
        let negative = self.bytes.get(start) == Some(&b'-');
        self.position += usize::from(negative);
        let size = if self.bytes.get(self.position).is_some_and(u8::is_ascii_digit) {
            self.text_size(expected).ok()
        } else {
            None
        };
        let value = size.and_then(|size| i64::try_from(size).ok()).map(|v| if negative { -v } else { v });
        value.and_then(|v| i32::try_from(v).ok()).ok_or_else(|| {
            self.position = start;
            self.unexpected(expected)
        })
    }

    fn text_real(&mut self, expected: &'static str) -> Result<f64, MshError> {
        self.skip_spaces();
        let start = self.position;
        let word = self.word(expected)?;
        std::str::from_utf8(word).ok().and_then(|text| text.parse().ok()).ok_or_else(|| {
            self.position = start;
            self.unexpected(expected)
        })
    }

    fn take<const N: usize>(&mut self, expected: &'static str) -> Result<[u8; N], MshError> {
        let Some(&bytes) = self.bytes[self.position..].first_chunk::<N>() else {
            return Err(self.truncated(expected));
        };
        self.position += N;
        Ok(bytes)
    }

    /// A whole number of 32 bits.
    #[inline]
    pub(super) fn int(&mut self, expected: &'static str) -> Result<i32, MshError> {
        match self.encoding {
            Encoding::Ascii => self.text_int(expected),
            Encoding::LittleEndian => self.take(expected).map(i32::from_le_bytes),
            Encoding::BigEndian => self.take(expected).map(i32::from_be_bytes),
        }
    }

    /// A whole number from 0, of 64 bits in a binary file.
    #[inline]
    pub(super) fn size(&mut self, expected: &'static str) -> Result<u64, MshError> {
        match self.encoding {
            Encoding::Ascii => self.text_size(expected),
            Encoding::LittleEndian => self.take(expected).map(u64::from_le_bytes),
            Encoding::BigEndian => self.take(expected).map(u64::from_be_bytes),
        }
    }

    /// A tag of version 2: a whole number from 0, of 32 bits in a binary file.
    #[inline]
    pub(super) fn tag(&mut self, expected: &'static str) -> Result<u64, MshError> {
        if self.encoding == Encoding::Ascii {
            return self.text_size(expected);
        }
        let start = self.position;
        let value = self.int(expected)?;
        u64::try_from(value).map_err(|_| {
            let fault = MshFault::Unexpected { expected, found: value.to_string() };
            self.fault_at(start, self.subject.clone(), fault)
        })
    }

    /// A number.
    #[inline]
    pub(super) fn real(&mut self, expected: &'static str) -> Result<f64, MshError> {
        match self.encoding {
            Encoding::Ascii => self.text_real(expected),
            Encoding::LittleEndian => self.take(expected).map(f64::from_le_bytes),
            Encoding::BigEndian => self.take(expected).map(f64::from_be_bytes),
        }
    }
}

/// Bytes for a message: as text, without control characters, and not too many.
pub(super) fn shown(bytes: &[u8]) -> String {
    let cut = &bytes[..bytes.len().min(SHOWN)];
    let text = String::from_utf8_lossy(cut).escape_debug().to_string();
    if cut.len() < bytes.len() { format!("{text}…") } else { text }
}

/// The first place of a needle, which starts with a dollar.
fn find(bytes: &[u8], needle: &[u8]) -> Option<usize> {
    let mut from = 0;
    while let Some(found) = bytes[from..].iter().position(|b| Some(b) == needle.first()) {
        let start = from + found;
        if bytes[start..].starts_with(needle) {
            return Some(start);
        }
        from = start + 1;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_to_their_limits_and_not_beyond() {
        let text = b"18446744073709551615 -2147483648 2147483647 -0 1.5e-3";
        let mut cursor = Cursor::new(text);
        assert_eq!(cursor.size("a size").ok(), Some(u64::MAX));
        assert_eq!(cursor.int("an int").ok(), Some(i32::MIN));
        assert_eq!(cursor.int("an int").ok(), Some(i32::MAX));
        assert_eq!(cursor.int("an int").ok(), Some(0));
        assert_eq!(cursor.real("a number").ok(), Some(1.5e-3));
        for text in ["18446744073709551616", "-1", "1x", "x", "", "+", "1.0"] {
            assert!(Cursor::new(text.as_bytes()).size("a size").is_err(), "{text}");
        }
        for text in ["2147483648", "-2147483649", "--1", "- 1", "-", "1-"] {
            assert!(Cursor::new(text.as_bytes()).int("an int").is_err(), "{text}");
        }
    }

    #[test]
    fn a_number_that_is_missing_is_named_on_its_line() {
        let mut cursor = Cursor::new(b"1 2\n3\n");
        assert!(cursor.size("a tag").is_ok() && cursor.size("a tag").is_ok());
        let error = cursor.size("a third tag").expect_err("the line ends");
        assert_eq!(error.to_string(), "line 1, file: expected a third tag, found `the end of the line`");
        let error = Cursor::new(b"1 2").end_record().expect_err("more on the line");
        assert!(matches!(error.fault, MshFault::Unexpected { .. }));
    }

    #[test]
    fn a_mark_is_found_only_as_a_line_of_its_own() {
        let mut cursor = Cursor::new(b"a $EndX\n$EndXY\n$$EndX\n$EndX\nrest");
        assert!(cursor.skip_behind(b"$EndX"));
        assert_eq!(cursor.remaining(), "\nrest".len());
        assert!(!cursor.skip_behind(b"$EndX"));
    }
}
