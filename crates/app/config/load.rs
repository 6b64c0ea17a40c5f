//! Reads a configuration: a text with overrides laid over it, all tables, and the cases of a sweep.

use std::collections::HashSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use fluxmorph_geometry::io::read_at_most;

use super::error::{ConfigError, DiagnosticReport};
use super::schema::keys::known_keys;
use super::section::Section;
use super::table::Table;
use super::tables::Config;
use super::text::cases::{case_count, case_trees};
use super::text::diagnostic::{self, Diagnostic, Span};
use super::text::document::Document;
use super::text::source::SourceMap;
use super::text::tree;
use super::value::Context;

/// Largest configuration that is read [bytes]: a hundred times the longest sensible one.
const LARGEST_FILE: u64 = 1024 * 1024;

/// Most values that the cases of a motion may repeat: every case is the whole configuration again, with the places of its
/// values, and this many take a hundred megabytes.
const MOST_REPEATED: usize = 500_000;

/// Faults of a configuration from which on its cases are not read: each would find them again.
const MANY_FAULTS: usize = 100;

impl Config {
    /// Read a file, and lay overrides `key=value` over it.
    ///
    /// Paths in the file are relative to its folder, and absolute in the result.
    ///
    /// # Errors
    /// When the file cannot be read, or with all faults of its content at once.
    pub fn from_file(path: &Path, overrides: &[String]) -> Result<(Self, SourceMap), ConfigError> {
        let text = read_text(path)?;
        if overrides.iter().map(String::len).sum::<usize>() as u64 > LARGEST_FILE {
            return Err(ConfigError::TooManyOverrides { limit: LARGEST_FILE });
        }
        let absolute = std::path::absolute(path)
            .map_err(|source| ConfigError::Read { path: path.to_owned(), source })?;
        let directory = absolute.parent().map(Path::to_owned).unwrap_or_default();
        let stem = path.file_stem().map_or_else(|| "run".into(), |stem| stem.to_string_lossy());
        Self::again(path.display().to_string(), text, directory, &stem, overrides)
    }

    /// Read a text, such as that which a run has saved: `name` stands for the file in messages, paths are
    /// relative to `directory`, `stem` is the name of the file that it was read from, without extension.
    ///
    /// # Errors
    /// All faults of the text at once.
    pub fn again(
        name: String,
        text: String,
        directory: PathBuf,
        stem: &str,
        overrides: &[String],
    ) -> Result<(Self, SourceMap), ConfigError> {
        let mut documents = vec![Document::whole(name, text)];
        documents.extend(overrides.iter().map(|typed| Document::of_override(typed)));
        let bare = SourceMap::of_documents(documents, directory, stem);
        let root = parse_documents(&bare).map_err(|diagnostics| bare.error(diagnostics))?;
        let mut source = bare.of_tree(&root);
        let Reading { mut config, mut diagnostics, notices } = read_tree(&root, &source);
        source.notices = notices.into();
        let (count, values) = (case_count(&root), tree::value_count(&root));
        if count.saturating_mul(values) > MOST_REPEATED {
            let message = format!("{count} cases repeat a configuration of {values} values");
            let most = format!("at most {MOST_REPEATED} values in all cases together");
            diagnostics.push(source.diagnostic("morph.case", message).expected(most));
            diagnostic::sort(&mut diagnostics);
            return Err(source.error(diagnostics));
        }
        if diagnostics.len() > MANY_FAULTS {
            return Err(source.error(diagnostics));
        }
        source.cases = read_cases(root, &bare, config.as_mut(), &mut diagnostics).into();
        match config {
            Some(config) if diagnostics.is_empty() => Ok((config, source)),
            unfinished => {
                diagnostic::sort(&mut diagnostics);
                let unfinished = unfinished.map(Box::new);
                let report = DiagnosticReport { unfinished, ..DiagnosticReport::new(source, diagnostics) };
                Err(ConfigError::Invalid(Box::new(report)))
            }
        }
    }

    /// Read a text; `name` stands for the file in messages, and paths stay relative.
    ///
    /// # Errors
    /// All faults of the text at once.
    pub fn from_str(text: &str, name: &str) -> Result<(Self, SourceMap), ConfigError> {
        let stem = Path::new(name).file_stem().map_or_else(|| "run".into(), |stem| stem.to_string_lossy());
        Self::again(name.to_owned(), text.to_owned(), PathBuf::new(), &stem, &[])
    }
}

/// The configuration as TOML with every default written out, in SI; it reads back as the same [`Config`].
pub fn resolved_toml(config: &Config) -> String {
    toml::to_string(config).expect("every value of a configuration has a TOML form")
}

fn read_text(path: &Path) -> Result<String, ConfigError> {
    if let Some(extension) = path.extension().filter(|e| *e == "geo" || *e == "msh") {
        let extension = extension.to_string_lossy().into_owned();
        return Err(ConfigError::GmshFile { path: path.to_owned(), extension });
    }
    let bytes = read_at_most(path, LARGEST_FILE).map_err(|source| match source.kind() {
        ErrorKind::FileTooLarge => ConfigError::TooLarge { path: path.to_owned(), limit: LARGEST_FILE },
        _ => ConfigError::Read { path: path.to_owned(), source },
    })?;
    String::from_utf8(bytes).map_err(|error| ConfigError::NotText {
        path: path.to_owned(),
        offset: error.utf8_error().valid_up_to(),
    })
}

/// Reads the cases of a sweep, and enters them; the places of each.
fn read_cases(
    root: tree::Table,
    bare: &SourceMap,
    mut config: Option<&mut Config>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<SourceMap> {
    let mut known: HashSet<Diagnostic> = diagnostics.iter().cloned().collect();
    let mut sources = Vec::new();
    for (index, tree) in case_trees(root).enumerate() {
        let (tree, overlay) = match tree {
            Ok(tree) => tree,
            Err(diagnostic) => {
                diagnostics.push(*diagnostic);
                continue;
            }
        };
        let Reading { config: case, diagnostics: own, .. } = read_tree(&tree, bare);
        // What is wrong without the case has been said.
        diagnostics.extend(own.into_iter().filter(|diagnostic| known.insert(diagnostic.clone())));
        sources.push(bare.of_tree(&tree));
        let Some((config, mut case)) = config.as_mut().zip(case) else { continue };
        // What goes out is the whole motion's, and not what follows from the design of one case.
        if !overlay.contains_key("output") {
            case.output = config.output.clone();
        }
        if let Some(slot) = config.morph.as_mut().and_then(|morph| morph.cases.get_mut(index)) {
            slot.complete(overlay, case);
        }
    }
    sources
}

/// What was read from one tree.
struct Reading {
    /// None where a table is missing that all others rest on.
    config: Option<Config>,
    /// Faults in the order of the text.
    diagnostics: Vec<Diagnostic>,
    /// What should be written otherwise.
    notices: Vec<String>,
}

fn read_tree(tree: &tree::Table, source: &SourceMap) -> Reading {
    let context = Context::new(known_keys);
    let root = Section::new(String::new(), tree, Span { document: 0, range: 0..0 }, &context);
    let mut config = Config::read_keys(&root);
    config.complete(&root, source);
    root.finish();
    let (diagnostics, notices) = (context.sink.into_sorted(), context.notices.into_inner());
    let rests = |diagnostic: &Diagnostic| ["mesh", "analysis"].contains(&diagnostic.path.as_str());
    Reading { config: (!diagnostics.iter().any(rests)).then_some(config), diagnostics, notices }
}

/// An override by an empty table, which would leave all keys of the table as they are and looks as if it removed them.
fn without_effect(root: &tree::Table, over: &tree::Table, path: &str) -> Option<Diagnostic> {
    over.iter().find_map(|(key, node)| {
        let path = tree::join(path, key);
        let (known, own) = (root.get(key)?.content.table()?, node.content.table()?);
        if !own.is_empty() || known.is_empty() {
            return without_effect(known, own, &path);
        }
        let message =
            format!("`{path}` = {{}} changes nothing: an override keeps the keys that it does not name");
        let first = known.keys().next().map_or_else(String::new, |key| format!(", such as {path}.{key}=…"));
        let fault = Diagnostic::new(path, node.key_span.clone(), message);
        Some(fault.expected(format!("every key by itself{first}")))
    })
}

/// Parse the file and lay the overrides over it.
fn parse_documents(source: &SourceMap) -> Result<tree::Table, Vec<Diagnostic>> {
    let mut root = tree::Table::new();
    let mut diagnostics = Vec::new();
    for (index, document) in source.documents.iter().enumerate() {
        match tree::parse(index, &document.text) {
            Ok(table) if index == 0 => root = table,
            Ok(table) => {
                diagnostics.extend(without_effect(&root, &table, ""));
                diagnostics.extend(tree::overlay(&mut root, table, "").err().map(|one| *one));
            }
            Err(errors) => diagnostics.extend(errors),
        }
    }
    if diagnostics.is_empty() { Ok(root) } else { Err(diagnostics) }
}
