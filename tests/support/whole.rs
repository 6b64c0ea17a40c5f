//! Whether the files of a run are whole under their final names.

use std::collections::BTreeMap;
use std::path::PathBuf;

use fluxmorph::run::journal::{self, Rest};
use fluxmorph_geometry::io::read_vtu;

/// What the ends of logs may look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Logs {
    /// The process saw the failure itself.
    AreWhole,
    /// It was ended in the middle of a record.
    MayBeCut,
}

/// The files of a run directory that are not whole, and those that nobody expects.
pub(crate) fn torn(files: &BTreeMap<PathBuf, Vec<u8>>, logs: Logs) -> Vec<String> {
    let own = |(path, _): &(&PathBuf, &Vec<u8>)| !path.to_string_lossy().contains(".fluxmorph-");
    let own: BTreeMap<&PathBuf, &Vec<u8>> = files.iter().filter(own).collect();
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let is_whole = |path: &PathBuf, bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes);
        match path.extension().and_then(|e| e.to_str()).unwrap_or_default() {
            "json" => serde_json::from_slice::<serde_json::Value>(bytes).is_ok(),
            "toml" => !text.is_empty() && text.parse::<toml::Table>().is_ok(),
            "vtu" => {
                let file = scratch.path().join("field.vtu");
                std::fs::write(&file, bytes).expect("written");
                read_vtu(&file).is_ok_and(|contents| !contents.points.is_empty())
            }
            "pvd" => {
                let mut named = text.split("file=\"").skip(1).filter_map(|rest| rest.split('"').next());
                text.ends_with("</VTKFile>\n") && named.all(|file| own.contains_key(&PathBuf::from(file)))
            }
            "msh" => text.ends_with("$EndElements\n"),
            "stl" => bytes.len() > 84,
            "html" => text.ends_with("</html>\n"),
            "csv" => logs == Logs::MayBeCut || text.is_empty() || text.ends_with('\n'),
            "jsonl" => journal::parse(bytes).is_ok_and(|contents| match contents.rest {
                Rest::Nothing => true,
                Rest::Torn(_) => logs == Logs::MayBeCut,
                _ => false,
            }),
            _ => false,
        }
    };
    let torn = own.iter().filter(|(path, bytes)| !is_whole(path, bytes));
    torn.map(|(path, _)| path.display().to_string()).collect()
}
