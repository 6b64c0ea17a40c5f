//! What two runs must have in common: every file, but for times, memory and the manifest.

use std::collections::BTreeMap;
use std::path::PathBuf;

use fluxmorph::run::journal;
use fluxmorph_optimizer::driver::Record;
use fluxmorph_optimizer::problem::Timings;
use serde_json::Value;

/// The files of a run by their paths, without what depends on the clock.
pub(crate) type Essence = BTreeMap<PathBuf, Vec<u8>>;

/// The files of a run without what depends on the clock.
pub(crate) fn essence(files: &BTreeMap<PathBuf, Vec<u8>>) -> Essence {
    let stripped = |(path, bytes): (&PathBuf, &Vec<u8>)| {
        let name = path.file_name()?.to_str()?;
        let bytes = match name {
            // The report shows times, memory, the manifest and the directory; tests/report compares it.
            "manifest.json" | "journal.damaged.jsonl" | "report.html" => return None,
            "result.json" => result(bytes),
            "history.csv" => table(bytes),
            "journal.jsonl" => format!("{:?}", records(bytes)).into_bytes(),
            "resolved.toml" => without_own_keys(bytes),
            _ => bytes.clone(),
        };
        Some((path.clone(), bytes))
    };
    files.iter().filter_map(stripped).collect()
}

/// Says which file differs, not only that one does.
pub(crate) fn assert_same(own: &Essence, expected: &Essence, context: &str) {
    let names = |essence: &Essence| essence.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(own), names(expected), "{context}");
    for (path, bytes) in own {
        let text = |bytes: &[u8]| String::from_utf8_lossy(&bytes[..bytes.len().min(2000)]).into_owned();
        assert!(
            *bytes == expected[path],
            "{context}: {} differs\n{}\n---\n{}",
            path.display(),
            text(bytes),
            text(&expected[path])
        );
    }
}

/// Without limits, which a resumed run may have others of, and without the directory.
fn without_own_keys(bytes: &[u8]) -> Vec<u8> {
    let mut table: toml::Table = std::str::from_utf8(bytes).expect("text").parse().expect("TOML");
    for (name, keys) in
        [("optimizer", ["max_evaluations", "max_time"].as_slice()), ("output", &["directory"])]
    {
        let own = table.get_mut(name).and_then(toml::Value::as_table_mut).expect("every run has it");
        keys.iter().for_each(|key| drop(own.remove(*key)));
    }
    table.to_string().into_bytes()
}

fn result(bytes: &[u8]) -> Vec<u8> {
    let mut value: Value = serde_json::from_slice(bytes).expect("a result");
    let object = value.as_object_mut().expect("an object");
    object.remove("timings_s");
    object.remove("peak_memory_bytes");
    value.to_string().into_bytes()
}

fn table(bytes: &[u8]) -> Vec<u8> {
    let text = std::str::from_utf8(bytes).expect("text");
    let header: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
    let seconds = header.iter().position(|&name| name == "seconds").expect("a column");
    let line = |line: &str| {
        // No cell before that column holds a comma.
        let mut cells: Vec<&str> = line.split(',').collect();
        cells.remove(seconds);
        cells.join(",") + "\n"
    };
    text.lines().map(line).collect::<String>().into_bytes()
}

fn records(bytes: &[u8]) -> Vec<Record> {
    let contents = journal::parse(bytes).expect("a journal");
    assert_eq!(contents.rest.bytes(), 0);
    let strip = |mut record: Record| {
        record.row.seconds = 0.0;
        record.timings = Timings::default();
        record
    };
    contents.records.into_iter().map(strip).collect()
}
