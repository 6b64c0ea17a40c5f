//! The texts of a configuration and the place of every key in them.
//!
//! Some faults show only later: whether a region exists is known once the mesh is. [`SourceMap`] keeps the places,
//! so that such a fault points at its key like every other.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::diagnostic::{Diagnostic, Span, suggest};
use super::document::Document;
use super::message::shown;
use super::nearest::{MOST_COMPARED, offer};
use super::tree::{self, Table};
use super::written_paths::WrittenPaths;

/// Where a configuration came from. A clone shares the texts, and so does every case of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceMap {
    pub(in crate::config) documents: Arc<[Document]>,
    pub(in crate::config) spans: BTreeMap<String, Span>,
    /// The paths as they are written.
    pub(in crate::config) written: WrittenPaths,
    pub(in crate::config) directory: PathBuf,
    pub(in crate::config) stem: String,
    /// The same texts with the places of every case of `[[morph.case]]`.
    pub(in crate::config) cases: Arc<[SourceMap]>,
    /// What is read and should be written otherwise.
    pub(in crate::config) notices: Arc<[String]>,
}

impl SourceMap {
    /// The same texts with the places and paths of one reading of them.
    pub(in crate::config) fn of_tree(&self, tree: &Table) -> Self {
        Self { spans: tree::spans(tree), written: WrittenPaths::of(tree), ..self.clone() }
    }

    /// Texts without keys.
    pub(in crate::config) fn of_documents(documents: Vec<Document>, directory: PathBuf, stem: &str) -> Self {
        Self {
            documents: documents.into(),
            spans: BTreeMap::new(),
            written: WrittenPaths::default(),
            directory,
            stem: stem.to_owned(),
            cases: [].into(),
            notices: [].into(),
        }
    }

    /// The same with one more text, and the number of that.
    pub fn with_document(&self, document: Document) -> (Self, usize) {
        let documents: Arc<[Document]> = self.documents.iter().cloned().chain([document]).collect();
        let number = documents.len() - 1;
        (Self { documents, ..self.clone() }, number)
    }

    /// The file first, then the overrides in the order given.
    pub fn documents(&self) -> &[Document] {
        &self.documents
    }

    /// What is read and should be written otherwise: words of earlier versions.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The text of the file as given, without overrides.
    pub fn text(&self) -> &str {
        self.documents.first().map_or("", |document| &document.text)
    }

    /// The overrides of the command line, as TOML lines.
    pub fn overrides(&self) -> impl Iterator<Item = &str> {
        self.documents.iter().skip(1).map(|document| document.text.as_str())
    }

    /// The folder that paths in the configuration are relative to.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The same texts with the places of one case of `[[morph.case]]`: what the case does not say stands where it does
    /// without it.
    pub fn case(&self, index: usize) -> &SourceMap {
        self.cases.get(index).unwrap_or(self)
    }

    /// Where the value at a key path such as `design.surface` or `coils[0].center` stands.
    ///
    /// A key that was left to its default has no place: then that of the nearest table around it is taken.
    pub fn span(&self, path: &str) -> Span {
        let mut rest = path;
        while !rest.is_empty() {
            if let Some(span) = self.spans.get(rest) {
                return span.clone();
            }
            rest = rest.rfind(['.', '[']).map_or("", |end| &rest[..end]);
        }
        Span { document: 0, range: 0..0 }
    }

    /// Whether a key is written, in the file or in an override.
    pub fn is_written(&self, path: &str) -> bool {
        self.spans.contains_key(path)
    }

    /// A fault at a key path; add what was expected and what to do with the methods of [`Diagnostic`].
    pub fn diagnostic(&self, path: &str, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(path, self.span(path), message)
    }

    /// A fault about a name that is not among the known ones: suggests the nearest and lists them.
    pub fn unknown_name(&self, path: &str, what: &str, name: &str, known: &[&str]) -> Diagnostic {
        let diagnostic = self.diagnostic(path, format!("there is no {what} `{}`", shown(name)));
        suggest(diagnostic, name, known)
    }

    /// A fault about a file that does not exist: suggests the nearest of its folder.
    pub fn no_file(&self, path: &str, file: &Path) -> Diagnostic {
        let folder = file.parent().and_then(|folder| fs::read_dir(folder).ok());
        let names = folder.into_iter().flatten().flatten().map(|entry| entry.file_name());
        let mut names: Vec<String> =
            names.filter_map(|name| name.into_string().ok()).take(MOST_COMPARED).collect();
        names.sort();
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let help = offer(&name, names.iter().map(String::as_str));
        let fault = self.diagnostic(path, format!("there is no file `{}`", file.display()));
        Diagnostic { help, ..fault.expected("the path of a file, from the folder of the configuration") }
    }
}
