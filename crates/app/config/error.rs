//! Why a configuration could not be read: all its faults at once, at their places.

use std::path::PathBuf;

use super::tables::Config;
use super::text::diagnostic::Diagnostic;
use super::text::document::Document;
use super::text::source::SourceMap;

impl SourceMap {
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
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration `{path}`: {source}; give the path of a TOML file that exists")]
    Read { path: PathBuf, source: std::io::Error },
    /// The file is one of Gmsh's.
    #[error(
        "`{path}` is a .{extension} file of Gmsh, and not a configuration; give the TOML file that names the mesh as \
         mesh.file, `fluxmorph init --template gmsh` writes one"
    )]
    GmshFile { path: PathBuf, extension: String },
    /// The file is too large to be a configuration.
    #[error(
        "the configuration `{path}` is larger than {limit} bytes; a mesh belongs into its own file, named by \
         mesh.file"
    )]
    TooLarge {
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
    NotText { path: PathBuf, offset: usize },
    /// The text is not a valid configuration.
    #[error("{0}")]
    Invalid(Box<DiagnosticReport>),
}
