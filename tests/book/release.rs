//! What goes into a release: how many packages, under which licences.

use std::collections::BTreeSet;
use std::process::Command;

use crate::support::repository_text;

/// Most packages of the release graph, this repository's own included.
const MOST_PACKAGES: usize = 150;

/// One word a package of `cargo tree`, each line once.
fn tree(format: &str) -> BTreeSet<String> {
    let arguments =
        ["tree", "--locked", "--offline", "-e", "normal,build", "--prefix", "none", "-p", "fluxmorph"];
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .args(["--format", format])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    // A package that stands in the tree twice has a mark the second time.
    text.lines()
        .map(|line| line.trim_end_matches(" (*)").to_owned())
        .filter(|line| !line.is_empty())
        .collect()
}

/// `name version` of a package without its path.
fn name_and_version(line: &str) -> String {
    line.split_whitespace().take(2).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_release_graph_stays_small() {
    let packages: BTreeSet<String> = tree("{p}").iter().map(|line| name_and_version(line)).collect();
    println!("{} packages", packages.len());
    assert!(packages.len() <= MOST_PACKAGES, "{} packages, at most {MOST_PACKAGES}", packages.len());
    assert!(
        packages.iter().any(|package| package.starts_with("nlopt ")),
        "the graph is not that of the program"
    );
}

/// Whether an SPDX expression without brackets can be met by the licences that deny.toml allows.
fn is_allowed(expression: &str, allowed: &[String]) -> bool {
    let plain = expression.replace(['(', ')'], "").replace(" / ", "/").replace('/', " OR ");
    plain
        .split(" AND ")
        .all(|part| part.split(" OR ").any(|licence| allowed.iter().any(|a| a == licence.trim())))
}

#[test]
fn every_licence_is_one_that_deny_toml_allows() {
    let deny: toml::Table = repository_text("deny.toml").parse().expect("deny.toml is TOML");
    let allowed: Vec<String> = deny["licenses"]["allow"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|licence| licence.as_str().expect("a text").to_owned())
        .collect();
    let lines = tree("{l}|{p}");
    let faults: Vec<&String> = lines
        .iter()
        .filter(|line| line.split_once('|').is_none_or(|(licence, _)| !is_allowed(licence, &allowed)))
        .collect();
    assert!(faults.is_empty(), "licences that deny.toml does not allow: {faults:#?}");
    for licence in &allowed {
        let used = lines.iter().any(|line| line.contains(licence.as_str()));
        assert!(used, "deny.toml allows {licence}, which no package has");
    }
}

#[test]
fn expressions_are_met_by_one_alternative_of_every_part() {
    let allowed = ["MIT".to_owned(), "Zlib".to_owned()];
    assert!(is_allowed("MIT OR GPL-3.0", &allowed));
    assert!(is_allowed("Apache-2.0/MIT", &allowed));
    assert!(!is_allowed("(MIT OR Apache-2.0) AND Unicode-3.0", &allowed));
    assert!(is_allowed("(MIT OR Apache-2.0) AND Zlib", &allowed));
}
