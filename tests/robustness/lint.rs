//! The lint that keeps sums in order is there, and nothing turns it off.

use crate::support::{repository, repository_text};

/// What combines numbers in an order that depends on the threads.
const FORBIDDEN: [&str; 8] =
    ["sum", "product", "reduce", "reduce_with", "try_reduce", "fold", "fold_with", "min_by"];

fn table(path: &str) -> toml::Table {
    repository_text(path).parse().unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn reductions_without_an_order_are_forbidden() {
    let clippy = table("clippy.toml");
    let forbidden = clippy["disallowed-methods"].as_array().expect("a list");
    let paths: Vec<&str> = forbidden.iter().filter_map(|entry| entry["path"].as_str()).collect();
    for name in FORBIDDEN {
        let path = format!("rayon::iter::ParallelIterator::{name}");
        assert!(paths.contains(&path.as_str()), "clippy.toml does not forbid {path}");
    }
    let workspace = table("Cargo.toml");
    assert_eq!(workspace["workspace"]["lints"]["clippy"]["all"]["level"].as_str(), Some("warn"));
    assert!(workspace["workspace"]["lints"]["clippy"].get("disallowed_methods").is_none());
    let ci = repository_text(".ci/run");
    assert!(ci.contains("cargo clippy") && ci.contains("-D warnings"));
    for name in ["geometry", "solver", "remesh", "optimizer"] {
        let lints = &table(&format!("crates/{name}/Cargo.toml"))["lints"];
        let own = lints.get("clippy");
        assert!(own.is_some() || lints.get("workspace").is_some(), "{name} has no lints");
        assert!(own.is_none_or(|own| own["all"]["level"].as_str() == Some("warn")), "{name}");
        assert!(own.is_none_or(|own| own.get("disallowed_methods").is_none()), "{name}");
    }
}

/// An expectation is itself a warning once nothing forbids what it expects: clippy fails without the list of clippy.toml.
#[test]
fn what_is_excepted_says_why_and_notices_when_the_lint_is_gone() {
    let mut folders = vec![repository("crates")];
    let mut exceptions = 0;
    while let Some(folder) = folders.pop() {
        for entry in
            std::fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry").path())
        {
            if entry.is_dir() {
                folders.push(entry);
            } else if entry.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&entry).expect("text");
                // What stands before the name of the lint, back to the attribute that it is in.
                for (at, _) in text.match_indices("clippy::disallowed_methods") {
                    let attribute = text[..at].rfind("#[").map_or("", |start| &text[start..at]);
                    let rest = text[at..].split(']').next().unwrap_or_default();
                    assert!(attribute.starts_with("#[expect("), "{}: {attribute}", entry.display());
                    assert!(rest.contains("reason = \""), "{}: {rest}", entry.display());
                    exceptions += 1;
                }
            }
        }
    }
    assert!(exceptions > 0, "without an exception nothing would notice");
}
