//! What can be computed and can hardly be meant: `check` warns of it, and not of what is like it and sound.

use crate::case::{Case, groups, read};
use crate::support::folder::list;
use crate::support::program::{fluxmorph_in, folder};

groups! { "warned": coils, design, elements, faces, forces, materials }

/// Runs all cases of a group.
fn holds(group: &str) {
    let cases = read(&format!("warned/{group}"));
    let objections: Vec<String> = cases.iter().filter_map(objection).collect();
    println!("{group}: {} cases", cases.len());
    assert!(objections.is_empty(), "{}", objections.join("\n----\n"));
}

/// Which expectations of a case do not hold, and what is said in place of them.
fn objection(case: &Case) -> Option<String> {
    let home = folder();
    case.write(home.path());
    let overrides = case.arguments();
    let mut arguments = vec!["check", "device.toml", "--json"];
    arguments.extend(overrides.iter().map(String::as_str));
    let finished = fluxmorph_in(home.path(), &arguments);
    if finished.code != Some(0) {
        return Some(format!("{}: exit code {:?}\n{}", case.at, finished.code, finished.stderr));
    }
    let json = finished.json();
    let warnings: Vec<&str> =
        list(&json, "/warnings").iter().map(|warning| warning.as_str().expect("a text")).collect();
    let is_said = |part: &str| warnings.iter().any(|warning| warning.contains(part));
    let holds = |line: &&String| match (line.strip_prefix("warning: "), line.strip_prefix("no warning: ")) {
        (Some(part), _) => is_said(part),
        (_, Some(part)) => !is_said(part),
        _ => *line == "no warning" && warnings.is_empty(),
    };
    let mut broken: Vec<&str> =
        case.expected.iter().filter(|line| !holds(line)).map(String::as_str).collect();
    if case.expected.is_empty() {
        broken.push("something is expected");
    }
    if is_said("  ") {
        broken.push("no two blanks in a row");
    }
    let text = || format!("{}: expected\n{}\nand not\n{}", case.at, broken.join("\n"), warnings.join("\n"));
    (!broken.is_empty()).then(text)
}
