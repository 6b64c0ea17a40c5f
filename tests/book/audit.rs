//! What the audit's page names exists, and what it found false has not come back.

use std::collections::BTreeSet;
use std::path::Path;

use crate::page::Page;
use crate::repository;
use crate::support::repository_text;

/// Lower-case words of code with underscores: functions, and so tests.
fn is_function(name: &str) -> bool {
    name.contains('_') && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

/// All functions below a folder of Rust sources.
fn functions(folder: &Path, all: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).expect("a folder of the repository").flatten() {
        let path = entry.path();
        if path.is_dir() {
            functions(&path, all);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).expect("readable");
            let names = text.split("fn ").skip(1).filter_map(|rest| rest.split(['(', '<']).next());
            all.extend(names.filter(|name| is_function(name)).map(str::to_owned));
        }
    }
}

#[test]
fn every_test_that_the_audit_names_exists() {
    let mut known = BTreeSet::new();
    for folder in ["crates", "tests"] {
        functions(&repository(folder), &mut known);
    }
    let (mut count, mut faults) = (0, Vec::new());
    for (number, line) in &Page::read("docs/audit.md").text {
        // The last cell of a row with four.
        let cells: Vec<&str> = line.split('|').collect();
        let [.., tests, _] = cells.as_slice() else { continue };
        for name in tests.split('`').skip(1).step_by(2).filter(|name| is_function(name)) {
            count += 1;
            if !known.contains(name) {
                faults.push(format!("{number}: there is no `{name}`"));
            }
        }
    }
    println!("{count} tests are named");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(count > 30, "{count}");
}

/// What some page or help text said and was not so; in lower case.
const FALSE: [&str; 9] = [
    "supports the method",
    "number to believe",
    "all nodes lie elsewhere",
    "does no harm",
    "modelling error at the inner edges",
    "linear elements only",
    "ratios can be compared",
    "circuits.** currents are given",
    "saturated core is computed as if it were not",
];

/// What must be said where a reader meets it.
const SAID: [(&str, &str); 8] = [
    ("docs/results.md", "proves nothing"),
    ("docs/results.md", "up to 15 T"),
    ("docs/results.md", "the nearest found"),
    ("docs/gallery.md", "searched for row by row"),
    ("docs/README.md", "up to 15 T"),
    ("docs/README.md", "mpirun"),
    ("docs/verification.md", "secondary source"),
    ("docs/howto/gradient_certificate.md", "a hundredth of F"),
];

#[test]
fn claims_that_were_false_do_not_come_back() {
    let pages = Page::all().into_iter().filter(|page| page.path != "docs/audit.md");
    let texts = pages.map(|page| (repository_text(&page.path), page.path));
    for (text, path) in texts {
        let lower = text.to_lowercase();
        for phrase in FALSE {
            assert!(!lower.contains(phrase), "{path} says \"{phrase}\"");
        }
    }
    for (path, phrase) in SAID {
        assert!(repository_text(path).contains(phrase), "{path} no longer says \"{phrase}\"");
    }
}
