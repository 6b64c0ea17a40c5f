//! The texts of a configuration and the place of every key in them.
//!
//! Some faults show only later: whether a region exists is known once the mesh is. [`SourceMap`] keeps the places,
//! so that such a fault points at its key like every other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::confinement::WrittenPaths;
use super::diagnostic::{Diagnostic, Span};
use super::tree::{self, Table};
use crate::config::tables::Config;
use crate::config::value::nearest;

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
}

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

    /// A fault at a key path; add what was expected and what to do with the methods of [`Diagnostic`].
    pub fn diagnostic(&self, path: &str, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(path, self.span(path), message)
    }

    /// A fault about a name that is not among the known ones: suggests the nearest and lists them.
    pub fn unknown_name(&self, path: &str, what: &str, name: &str, known: &[&str]) -> Diagnostic {
        let diagnostic = self.diagnostic(path, format!("there is no {what} `{}`", tree::shown(name)));
        suggest(diagnostic, name, known)
    }

    /// The error that reports these faults at their places.
    pub fn error(&self, diagnostics: Vec<Diagnostic>) -> ConfigError {
        ConfigError::Invalid(Box::new(DiagnosticReport::new(self.clone(), diagnostics)))
    }

    /// `Ok` without faults, else the error that reports them.
    ///
    /// # Errors
    /// When there is at least one fault.
    pub fn check(&self, diagnostics: Vec<Diagnostic>) -> Result<(), ConfigError> {
        if diagnostics.is_empty() { Ok(()) } else { Err(self.error(diagnostics)) }
    }
}

/// Most names that a fault lists: a mesh may have many, and a hostile one as many as it has bytes.
const MOST_NAMES: usize = 30;

/// The fault with the nearest known name as help and all known names as the expectation.
pub(in crate::config) fn suggest(diagnostic: Diagnostic, name: &str, known: &[&str]) -> Diagnostic {
    let help = nearest::offer(name, known.iter().copied());
    Diagnostic { help, ..diagnostic }.expected(listed(known))
}

/// The known names in one line.
pub(in crate::config) fn listed(known: &[&str]) -> String {
    match known {
        [] => "none is known here".to_owned(),
        _ if known.len() > MOST_NAMES => {
            format!("known: {} and {} more", known[..MOST_NAMES].join(", "), known.len() - MOST_NAMES)
        }
        _ => format!("known: {}", known.join(", ")),
    }
}

/// What kind of file is at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// A configuration.
    Configuration,
    /// A file with a design.
    Design,
}

impl Subject {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Configuration => "configuration",
            Self::Design => "design",
        }
    }
}

/// All faults of one configuration, or of another file, with the texts they stand in.
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnosticReport {
    /// The texts.
    pub source: SourceMap,
    /// The faults, in the order to be shown.
    pub diagnostics: Vec<Diagnostic>,
    /// What the first text is.
    pub of: Subject,
    /// What could be read all the same, with placeholders for the rest: good for further checks of names only.
    pub(crate) unfinished: Option<Box<Config>>,
}

impl DiagnosticReport {
    /// The faults of a configuration.
    pub fn new(source: SourceMap, diagnostics: Vec<Diagnostic>) -> Self {
        Self { source, diagnostics, of: Subject::Configuration, unfinished: None }
    }

    /// The fault of another file.
    pub fn of_file(of: Subject, document: Document, diagnostic: Diagnostic) -> Self {
        Self {
            of,
            ..Self::new(SourceMap::of_documents(vec![document], PathBuf::new(), ""), vec![diagnostic])
        }
    }
}

/// Why a configuration could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration `{path}`: {source}; give the path of a TOML file that exists")]
    Read {
        /// The path as given.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file is one of Gmsh's.
    #[error(
        "`{path}` is a .{extension} file of Gmsh, and not a configuration; give the TOML file that names the mesh as \
         mesh.file, `fluxmorph init --template gmsh` writes one"
    )]
    GmshFile {
        /// The path as given.
        path: PathBuf,
        /// Its extension.
        extension: String,
    },
    /// The file is too large to be a configuration.
    #[error(
        "the configuration `{path}` is larger than {limit} bytes; a mesh belongs into its own file, named by \
         mesh.file"
    )]
    TooLarge {
        /// The path as given.
        path: PathBuf,
        /// Largest size accepted [bytes].
        limit: u64,
    },
    /// The overrides are too long.
    #[error(
        "the overrides are longer than {limit} bytes in all; write them into a configuration of their own"
    )]
    TooManyOverrides {
        /// Largest size accepted [bytes].
        limit: u64,
    },
    /// The file is not UTF-8.
    #[error("the configuration `{path}` is not UTF-8 text at byte {offset}; save it as UTF-8")]
    NotText {
        /// The path as given.
        path: PathBuf,
        /// First byte that is not UTF-8.
        offset: usize,
    },
    /// The text is not a valid configuration.
    #[error("{0}")]
    Invalid(Box<DiagnosticReport>),
}
