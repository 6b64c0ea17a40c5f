//! What the top-level tests share. `program`: the binary as a process; `device`: small devices and their runs; `folder`: a
//! run directory read back; `essence` and `whole`: what of it must be the same, and whether it is whole; `shield`: the
//! shipped shield and its reference; `markup`: a strict reader of pages.

#![allow(dead_code, reason = "every test binary uses its part")]

pub(crate) mod device;
pub(crate) mod essence;
pub(crate) mod folder;
pub(crate) mod markup;
pub(crate) mod program;
pub(crate) mod shield;
pub(crate) mod whole;

use std::path::PathBuf;
use std::sync::Arc;

use fluxmorph::build::{Mode, Setup, set_up};
use fluxmorph::config::{Config, SourceMap};
use fluxmorph::files::{Disk, OverwritePolicy};
use fluxmorph::run::Options;

/// A file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The text of a file of the repository.
#[track_caller]
pub(crate) fn repository_text(path: &str) -> String {
    std::fs::read_to_string(repository(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// A text with changes `(from, to)`, each at the first place where `from` stands; it must stand somewhere.
#[track_caller]
pub(crate) fn changed(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "no `{from}` in:\n{text}");
        text.replacen(from, to, 1)
    })
}

/// The text of a configuration with its mesh from `file` in millimetres, in place of the table `[mesh]`.
#[track_caller]
pub(crate) fn with_mesh_file(text: &str, file: &str) -> String {
    let (before, rest) = text.split_once("[mesh]").expect("a mesh");
    let (_, behind) = rest.split_once("[analysis]").expect("an analysis");
    format!("{before}[mesh]\nfile = \"{file}\"\nunit = \"mm\"\n\n[analysis]{behind}")
}

/// Replaces what stands in a page of docs/ between the marks of a `name` by a table that was computed.
pub(crate) fn write_into_page(page: &str, name: &str, table: &str) {
    let [begin, end] = ["begin", "end"].map(|mark| format!("<!-- {name}:{mark} -->\n"));
    let text = repository_text(page);
    let (head, rest) = text.split_once(&begin).expect("the page has the first mark");
    let (_, tail) = rest.split_once(&end).expect("the page has the second mark");
    std::fs::write(repository(page), format!("{head}{begin}{table}{end}{tail}"))
        .expect("the page can be written");
}

/// A shipped configuration with overrides `key=value`.
pub(crate) fn config(name: &str, overrides: &[&str]) -> (Config, SourceMap) {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    Config::from_file(&repository("configs").join(name), &overrides).unwrap_or_else(|e| panic!("{e}"))
}

/// The problem of a shipped configuration with overrides.
pub(crate) fn setup(name: &str, overrides: &[&str]) -> Setup {
    let (config, source) = config(name, overrides);
    set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|e| panic!("{e}"))
}

/// A configuration of this text.
pub(crate) fn parsed(text: &str) -> (Config, SourceMap) {
    Config::from_str(text, "test.toml").unwrap_or_else(|e| panic!("{e}"))
}

/// The problem of a configuration of this text.
pub(crate) fn setup_of(text: &str) -> Setup {
    let (config, source) = parsed(text);
    set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|e| panic!("{e}"))
}

/// A run of the library: on one thread, into a folder without an earlier run, never interrupted.
pub(crate) fn options(disk: &Arc<dyn Disk>) -> Options<'_> {
    Options {
        disk,
        overwrite_policy: OverwritePolicy::Keep,
        threads: 1,
        ranks: None,
        interrupted: &|| false,
        searched: &|_| None,
    }
}

/// Euclidean norm.
pub(crate) fn norm(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// `|a − b| / |b|`.
#[track_caller]
pub(crate) fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    norm(a.iter().zip(b).map(|(a, b)| a - b)) / norm(b.iter().copied())
}
