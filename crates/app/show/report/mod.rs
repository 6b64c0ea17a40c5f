//! `report.html`: one page about a run, made from its directory alone, that can be sent and read anywhere.
//!
//! `data` reads the directory (fields by `field_file`), `page` puts the sections in their order, and the others show one
//! thing each: `head`, `map`, `field`, `iron`, `error_map`, `convergence`, `histogram`, `surface`, `tables`, `facts`, `files`. Underneath are
//! `plot` (axes), `bars`, `frame` and `picture` (to scale), `ticks` (numbers), `colour`, `raster` and `png` (images), `window`,
//! `field_cut`, `cut`, `coils`, `moment` and `plane` (geometry), `observed` (what the objective is taken over), `words` (the
//! configuration in plain words), `markup` (what the pages of this program share). The page holds its style and its script
//! (`style.css`, `view.js`), asks no network, and says nothing of the moment at which it is made: equal directories make
//! equal pages.
//!
//! Does not live here: anything that solves a field or moves a mesh. What is shown was computed by the run.

mod bars;
mod circuits;
mod coils;
mod colour;
mod convergence;
mod cut;
mod data;
mod deviation;
mod error_map;
mod facts;
mod field;
mod field_cut;
mod field_file;
mod files;
mod frame;
mod harmonics;
mod head;
mod histogram;
mod iron;
mod map;
pub(crate) mod markup;
mod moment;
mod observed;
mod page;
mod picture;
mod plane;
pub(crate) mod plot;
mod png;
mod raster;
mod surface;
mod tables;
pub(crate) mod ticks;
mod window;
mod words;

use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use data::RunData;

use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::files::{Disk, Manifest, OutputError, RunDirectory};
use crate::run;
use crate::run::journal;

/// Bytes of a file that tell whether it is a page.
const HEAD: u64 = 1024;

/// A run directory that a page can be made of.
#[derive(Debug)]
pub struct ReportedRun {
    directory: RunDirectory,
    manifest: Manifest,
    config: Config,
    source: SourceMap,
}

impl ReportedRun {
    /// Reads manifest and configuration of the directory of a `run` or a `solve`.
    ///
    /// # Errors
    /// [`Error::NoReport`] for what another command has written and for a configuration that has become another, faults of the
    /// configuration, files that are damaged or cannot be read.
    pub fn open(disk: &Arc<dyn Disk>, path: &Path) -> Result<Self, Error> {
        Self::of(RunDirectory::open(disk, path)?)
    }

    /// The same of a directory that is open.
    pub(crate) fn of(directory: RunDirectory) -> Result<Self, Error> {
        let manifest = Manifest::read(&directory)?;
        let refused = |cause: String| Error::NoReport { path: directory.path().to_owned(), cause };
        if !matches!(manifest.command.as_str(), "run" | "solve") {
            let command = &manifest.command;
            return Err(refused(format!(
                "it holds a `{command}`; a report needs a directory that `fluxmorph run` or `fluxmorph solve` has written"
            )));
        }
        if !directory.holds_configuration() {
            return Err(refused(
                "config.toml is gone, or the run was cut before it was saved: restore it, or start the run again".into(),
            ));
        }
        let (config, source) = run::configuration(&directory, &manifest)?;
        if !journal::is_of_run(&directory, &manifest, (&config, &source))? {
            return Err(refused(
                "its config.toml is another than that of the run (manifest.json has its hash): restore it"
                    .into(),
            ));
        }
        Ok(Self { directory, manifest, config, source })
    }

    /// The configuration of the run, which names the mesh that is made or read again.
    pub fn config(&self) -> (&Config, &SourceMap) {
        (&self.config, &self.source)
    }

    /// Writes the page into the directory, unless another process works in it, or to `out`, where there is nothing yet or a page;
    /// where it is written.
    ///
    /// # Errors
    /// [`OutputError::NoPage`], damaged files, a directory in use or changed meanwhile, or when the operating system refuses.
    pub fn write(self, out: Option<&Path>) -> Result<PathBuf, Error> {
        let (mut directory, manifest) = (self.directory.clone(), self.manifest.clone());
        let path = out.map_or_else(|| Ok(directory.report()), place_of_page)?;
        let data = RunData::read(self)?;
        if out.is_none() {
            directory = directory.locked()?;
        }
        manifest.check_current(&directory)?;
        let page = page::page(&data, &link_prefix(&path, directory.path()));
        directory.write(&path, page.as_bytes())?;
        Ok(path)
    }
}

/// Where a path leads that a page may be written to: to nothing yet, an empty file or a page of this program, of which the head is read.
fn place_of_page(path: &Path) -> Result<PathBuf, OutputError> {
    let is_link = std::fs::symlink_metadata(path).is_ok_and(|entry| entry.is_symlink());
    let entry = match std::fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound && is_link => {
            return Err(OutputError::DeadLink { path: path.to_owned() });
        }
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(path.to_owned()),
        entry => entry.map_err(OutputError::io("look at", path))?,
    };
    // A pipe has no head until somebody writes into it.
    let is_page = entry.is_file() && (entry.len() == 0 || head(path)?.contains(markup::GENERATOR));
    match is_page {
        true if is_link => path.canonicalize().map_err(OutputError::io("look at", path)),
        true => Ok(path.to_owned()),
        false => Err(OutputError::NoPage { path: path.to_owned() }),
    }
}

/// The first letters of a file.
fn head(path: &Path) -> Result<String, OutputError> {
    let mut head = Vec::new();
    let file = std::fs::File::open(path).map_err(OutputError::io("read", path))?;
    file.take(HEAD).read_to_end(&mut head).map_err(OutputError::io("read", path))?;
    Ok(String::from_utf8_lossy(&head).into_owned())
}

/// The relative path from the folder of a file to a directory, with a slash at its end; nothing where they are the same.
fn link_prefix(file: &Path, directory: &Path) -> String {
    // Links and `..` are followed where there is something; what is not there yet is taken as written.
    let whole = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned())
    };
    let (from, to) = (file.parent().map(whole).unwrap_or_default(), whole(directory));
    let from: Vec<_> = from.components().collect();
    let to: Vec<_> = to.components().collect();
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let down = to[same..].iter().map(|part| markup::address(&part.as_os_str().to_string_lossy()) + "/");
    "../".repeat(from.len() - same) + &down.collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::link_prefix;
    use std::path::Path;

    #[test]
    fn links_lead_from_the_page_to_the_run() {
        for (file, directory, expected) in [
            ("runs/a/report.html", "runs/a", ""),
            ("b.html", "runs/a b", "runs/a%20b/"),
            ("out/b.html", "runs/a", "../runs/a/"),
        ] {
            assert_eq!(link_prefix(Path::new(file), Path::new(directory)), expected);
        }
    }
}
