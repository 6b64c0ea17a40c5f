//! Finds numbers in the bytes of a Gmsh file and puts others in their place, whatever the version and form.

use crate::msh_support::{Form, Version};

/// A file that is being damaged.
#[derive(Clone)]
pub(crate) struct Damaged {
    pub(crate) bytes: Vec<u8>,
    pub(crate) version: Version,
    pub(crate) form: Form,
}

/// A count that the head of a section gives.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Counted {
    /// All nodes, in `$Nodes`.
    Nodes,
    /// All elements, in `$Elements`.
    Elements,
    /// The names in `$PhysicalNames`, which are text in every form.
    Names,
}

impl Damaged {
    /// Behind the first place where some bytes stand.
    #[track_caller]
    pub(crate) fn behind(&self, mark: &str) -> usize {
        let mark = mark.as_bytes();
        let at = self.bytes.windows(mark.len()).position(|window| window == mark);
        at.unwrap_or_else(|| panic!("no {:?}", String::from_utf8_lossy(mark))) + mark.len()
    }

    /// Replaces the first place where a text stands.
    pub(crate) fn replace(&mut self, from: &str, to: &str) {
        let at = self.behind(from) - from.len();
        self.put(at, from.len(), to.as_bytes());
    }

    /// Replaces so many bytes from a place on.
    pub(crate) fn put(&mut self, at: usize, count: usize, bytes: &[u8]) {
        self.bytes.splice(at..at + count, bytes.iter().copied());
    }

    /// Adds bytes behind the end.
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    /// Behind the head of the format: version, type and size of data follow.
    pub(crate) fn format(&self) -> usize {
        self.behind("$MeshFormat\n")
    }

    /// Where the end of the elements is marked.
    pub(crate) fn last_mark(&self) -> usize {
        self.behind("$EndElements") - "$EndElements".len()
    }

    /// Cuts a section with its marks out; yields it.
    pub(crate) fn take(&mut self, name: &str) -> Vec<u8> {
        let head = format!("${name}\n");
        let start = self.behind(&head) - head.len();
        let end = self.behind(&format!("$End{name}\n"));
        self.bytes.drain(start..end).collect()
    }

    /// The end of the line that begins at a byte.
    fn line_end(&self, start: usize) -> usize {
        start + self.bytes[start..].iter().position(|&b| b == b'\n').expect("a line")
    }

    /// Puts a number in the place of the word of a line, by its number from 0.
    fn put_word(&mut self, line: usize, word: usize, value: &str) {
        let end = self.line_end(line);
        let text = String::from_utf8(self.bytes[line..end].to_vec()).expect("text");
        let mut words: Vec<&str> = text.split_whitespace().collect();
        words[word] = value;
        self.bytes.splice(line..end, words.join(" ").bytes());
    }

    fn put_bytes(&mut self, at: usize, little: &[u8]) {
        let mut bytes = little.to_vec();
        if self.form == Form::Big {
            bytes.reverse();
        }
        self.put(at, bytes.len(), &bytes);
    }

    /// Puts a number where a count stands.
    pub(crate) fn put_count(&mut self, counted: Counted, value: i64) {
        let section = match counted {
            Counted::Nodes => "$Nodes\n",
            Counted::Elements => "$Elements\n",
            Counted::Names => "$PhysicalNames\n",
        };
        let at = self.behind(section);
        match (counted, self.version, self.form) {
            (Counted::Names, ..) | (_, Version::V2, _) => self.put_word(at, 0, &value.to_string()),
            (_, Version::V4, Form::Ascii) => self.put_word(at, 1, &value.to_string()),
            (_, Version::V4, _) => self.put_bytes(at + 8, &value.to_le_bytes()),
        }
    }

    /// Puts a number where the first block of a section says how many it has; in version 2 only binary elements do.
    pub(crate) fn put_block_count(&mut self, counted: Counted, value: i64) {
        let at = self.behind(if matches!(counted, Counted::Nodes) { "$Nodes\n" } else { "$Elements\n" });
        match (self.version, self.form) {
            (Version::V2, Form::Ascii) => self.put_count(counted, value),
            (Version::V2, _) if matches!(counted, Counted::Nodes) => self.put_count(counted, value),
            (Version::V2, _) => {
                let block = self.line_end(at) + 1;
                self.put_bytes(block + 4, &(value as i32).to_le_bytes());
            }
            (Version::V4, Form::Ascii) => {
                let block = self.line_end(at) + 1;
                self.put_word(block, 3, &value.to_string());
            }
            (Version::V4, _) => self.put_bytes(at + 4 * 8 + 3 * 4, &value.to_le_bytes()),
        }
    }

    /// Puts another type in the place of that of the first elements.
    pub(crate) fn put_type(&mut self, code: i32) {
        let at = self.behind("$Elements\n");
        match (self.version, self.form) {
            (Version::V2, Form::Ascii) => {
                let element = self.line_end(at) + 1;
                self.put_word(element, 1, &code.to_string());
            }
            (Version::V2, _) => {
                let block = self.line_end(at) + 1;
                self.put_bytes(block, &code.to_le_bytes());
            }
            (Version::V4, Form::Ascii) => {
                let block = self.line_end(at) + 1;
                self.put_word(block, 2, &code.to_string());
            }
            (Version::V4, _) => self.put_bytes(at + 4 * 8 + 2 * 4, &code.to_le_bytes()),
        }
    }

    /// Puts a tag beyond 64 bits, or beyond 31 in a binary file of version 2, where the first node has its own.
    pub(crate) fn put_node_tag(&mut self, text: &str) {
        let at = self.behind("$Nodes\n");
        let first = self.line_end(at) + 1;
        match (self.version, self.form) {
            (Version::V2, Form::Ascii) => self.put_word(first, 0, text),
            (Version::V2, _) => self.put_bytes(first, &i32::MIN.to_le_bytes()),
            (Version::V4, Form::Ascii) => {
                let tag = self.line_end(first) + 1;
                self.put_word(tag, 0, text);
            }
            // Any 64 bits are a tag: then another is missing.
            (Version::V4, _) => self.put_bytes(at + 4 * 8 + 3 * 4 + 8, &u64::MAX.to_le_bytes()),
        }
    }
}
