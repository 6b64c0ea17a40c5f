//! What all tables of one reading share.

use std::cell::RefCell;

use super::known_keys::KnownKeys;
use crate::config::text::diagnostic::DiagnosticSink;

/// What all tables of one reading share.
pub(in crate::config) struct Context {
    /// What is wrong.
    pub(in crate::config) sink: DiagnosticSink,
    /// What is read and should be written otherwise.
    pub(in crate::config) notices: RefCell<Vec<String>>,
    /// The keys of all tables, for advice.
    pub(in crate::config) keys: fn() -> &'static KnownKeys,
}

impl Context {
    /// For a reading with advice from these keys.
    pub(in crate::config) fn new(keys: fn() -> &'static KnownKeys) -> Self {
        Self { sink: DiagnosticSink::default(), notices: RefCell::default(), keys }
    }
}

impl Default for Context {
    fn default() -> Self {
        static NONE: KnownKeys = KnownKeys::NONE;
        Self::new(|| &NONE)
    }
}
