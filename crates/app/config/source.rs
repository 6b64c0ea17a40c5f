//! The texts of a configuration and the place of every key in them.
//!
//! Some faults show only later: whether a region exists is known once the mesh is. [`Source`] keeps the places,
//! so that such a fault points at its key like every other.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Config;
use super::confinement::WrittenPaths;
use super::fault::{Fault, Place};
use super::tree::{self, Table};

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
pub struct Source {
    pub(super) documents: Arc<[Document]>,
    pub(super) places: BTreeMap<String, Place>,
    /// The paths as they are written.
    pub(super) written: WrittenPaths,
    pub(super) directory: PathBuf,
    pub(super) stem: String,
    /// The same texts with the places of every case of `[[morph.case]]`.
    pub(super) cases: Arc<[Source]>,
}

impl Source {
    /// The same texts with the places and paths of one reading of them.
    pub(super) fn of_tree(&self, tree: &Table) -> Self {
        Self { places: tree::places(tree), written: WrittenPaths::of(tree), ..self.clone() }
    }

    /// A text without keys.
    fn of_document(document: Document) -> Self {
        Self {
            documents: [document].into(),
            places: BTreeMap::new(),
            written: WrittenPaths::default(),
            directory: PathBuf::new(),
            stem: String::new(),
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
    pub fn case(&self, index: usize) -> &Source {
        self.cases.get(index).unwrap_or(self)
    }

    /// Where the value at a key path such as `design.surface` or `coils[0].center` stands.
    ///
    /// A key that was left to its default has no place: then that of the nearest table around it is taken.
    pub fn place(&self, path: &str) -> Place {
        let mut rest = path;
        while !rest.is_empty() {
            if let Some(place) = self.places.get(rest) {
                return place.clone();
            }
            rest = rest.rfind(['.', '[']).map_or("", |end| &rest[..end]);
        }
        Place { document: 0, span: 0..0 }
    }

    /// A fault at a key path; add what was expected and what to do with the methods of [`Fault`].
    pub fn fault(&self, path: &str, message: impl Into<String>) -> Fault {
        Fault::new(path, self.place(path), message)
    }

    /// A fault about a name that is not among the known ones: suggests the nearest and lists them.
    pub fn unknown_name(&self, path: &str, what: &str, name: &str, known: &[&str]) -> Fault {
        let fault = self.fault(path, format!("there is no {what} `{}`", tree::shown(name)));
        suggest(fault, name, known)
    }

    /// The error that reports these faults at their places.
    pub fn error(&self, faults: Vec<Fault>) -> ConfigError {
        ConfigError::Faults(Box::new(FaultReport::new(self.clone(), faults)))
    }

    /// `Ok` without faults, else the error that reports them.
    ///
    /// # Errors
    /// When there is at least one fault.
    pub fn check(&self, faults: Vec<Fault>) -> Result<(), ConfigError> {
        if faults.is_empty() { Ok(()) } else { Err(self.error(faults)) }
    }
}

/// Most names that a fault lists: a mesh may have many, and a hostile one as many as it has bytes.
const MOST_NAMES: usize = 30;

/// The fault with the nearest known name as help and all known names as the expectation.
pub(super) fn suggest(fault: Fault, name: &str, known: &[&str]) -> Fault {
    let offer = super::nearest::offer(name, known.iter().copied());
    let fault = match offer {
        Some(offer) => fault.help(offer),
        None => fault,
    };
    fault.expected(listed(known))
}

/// The known names in one line.
pub(super) fn listed(known: &[&str]) -> String {
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
pub enum Faulty {
    /// A configuration.
    Configuration,
    /// A file with a design.
    Design,
}

impl Faulty {
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
pub struct FaultReport {
    /// The texts.
    pub source: Source,
    /// The faults, in the order to be shown.
    pub faults: Vec<Fault>,
    /// What the first text is.
    pub of: Faulty,
    /// What could be read all the same, with placeholders for the rest: good for further checks of names only.
    pub(crate) unfinished: Option<Box<Config>>,
}

impl FaultReport {
    /// The faults of a configuration.
    pub fn new(source: Source, faults: Vec<Fault>) -> Self {
        Self { source, faults, of: Faulty::Configuration, unfinished: None }
    }

    /// The fault of another file.
    pub fn of_file(of: Faulty, document: Document, fault: Fault) -> Self {
        Self { of, ..Self::new(Source::of_document(document), vec![fault]) }
    }
}

impl fmt::Display for FaultReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&crate::diagnostics::render(self, crate::diagnostics::Style::Plain))
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
    Faults(Box<FaultReport>),
}
