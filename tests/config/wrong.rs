//! Every wrong input is refused by the real binary at the marked place, with the message that the table holds.

use std::collections::BTreeMap;
use std::fs;

use crate::case::{Case, Marked, groups, overwrite, read};
use crate::program::{check, limited};
use crate::support::program::folder;

groups! {
    "wrong": curves, design, elements, field, forces, keys, loads, looks, many, mesh, mesh_files, motion, names_and_paths,
    names_and_places, objective, optimizer, overrides, sizes, sources, syntax,
}

/// Bases that are sound as a text, and refused once their mesh is known: for faults that show before.
const TEXTS: [&str; 4] = ["bare.toml", "small.toml", "sound_v2.msh", "sound_v4.msh"];

#[test]
fn the_bases_are_sound() {
    let cases = GROUPS.iter().flat_map(|group| read(&format!("wrong/{group}")));
    let bases: BTreeMap<String, Case> = cases.map(|case| case.sound()).collect();
    assert!(TEXTS.iter().all(|name| bases.contains_key(*name)));
    for case in bases.iter().filter(|(name, _)| !TEXTS.contains(&name.as_str())).map(|(_, case)| case) {
        let home = folder();
        case.write(home.path());
        limited(home.path(), None, &["check", "device.toml"]).succeeds();
    }
}

/// Runs all cases of a group.
fn holds(group: &str) {
    let group = format!("wrong/{group}");
    let cases = read(&group);
    let mut objections = Vec::new();
    let said: Vec<Vec<String>> = cases.iter().map(|case| said(case, &mut objections)).collect();
    if std::env::var_os("SNAPSHOTS").is_some_and(|value| value == "overwrite") {
        overwrite(&group, &said);
    } else {
        let others = cases.iter().zip(&said).filter(|(case, said)| case.expected != **said);
        let other = |(case, said): (&Case, &Vec<String>)| {
            format!("{}: expected\n{}\nand not\n{}", case.at, case.expected.join("\n"), said.join("\n"))
        };
        objections.extend(others.map(other));
    }
    println!("{group}: {} cases", cases.len());
    assert!(objections.is_empty(), "{}", objections.join("\n----\n"));
}

/// What the program says of a case, in the form of the table.
fn said(case: &Case, objections: &mut Vec<String>) -> Vec<String> {
    let home = folder();
    let marked = case.write(home.path());
    let before = fs::read_dir(home.path()).expect("a folder").count();
    let overrides = case.arguments();
    let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
    let ended = match case.command.as_str() {
        "check" => check(home.path(), &overrides),
        other => limited(home.path(), None, &[&[other, "device.toml"], &overrides[..]].concat()),
    };
    let real = home.path().canonicalize().expect("it is there");
    let text = ended.stderr.replace(&format!("{}/", real.display()), "");
    let lines = without_frame(&text);
    let mut object = |what: String| objections.push(format!("{}: {what}\n{text}", case.at));
    if let Some(what) = ended.objection(3, &[]) {
        object(what);
    }
    if fs::read_dir(home.path()).expect("a folder").count() != before {
        object("something was written".to_owned());
    }
    if let Some(what) = marked.and_then(|marked| points_elsewhere(&text, &marked)) {
        object(what);
    }
    if let Some(what) = wrong_form(&text, &lines) {
        object(what.to_owned());
    }
    // How whole messages look is kept for a few.
    let whole = || text.lines().map(|line| format!("| {line}").trim_end().to_owned()).collect();
    if case.at.contains("looks") { whole() } else { lines }
}

/// What a message says, without the excerpt and its frame: the lines of the table.
fn without_frame(text: &str) -> Vec<String> {
    let (mut lines, mut source) = (Vec::new(), "");
    for line in text.lines() {
        let body = line.trim_start();
        if body.starts_with("error: ") || body.starts_with("= ") {
            lines.push(body.to_owned());
        } else if line.ends_with("not shown") {
            lines.push(format!("= {line}"));
        } else if let Some(marks) = body.strip_prefix('|') {
            lines.extend(label(marks.trim(), line, source));
        } else {
            source = line;
        }
    }
    lines
}

/// A line of marks, which stands below a line of the source.
fn label(marks: &str, line: &str, source: &str) -> Option<String> {
    let behind = |mark: char| marks.trim_start_matches(mark).trim_start();
    if marks.is_empty() || marks == "|" {
        None
    } else if marks.starts_with('^') {
        (!behind('^').is_empty()).then(|| format!("^ {}", behind('^')))
    } else if marks.starts_with('-') && !marks.contains('^') {
        let start = line.chars().position(|c| c == '-')?;
        let length = line.chars().skip(start).take_while(|c| *c == '-').count();
        let marked: String = source.chars().skip(start).take(length).collect();
        Some(format!("~ {marked}: {}", behind('-')))
    } else {
        // Two places of one line.
        Some(format!("| {}", marks.split_whitespace().collect::<Vec<_>>().join(" ")))
    }
}

/// What is wrong with the form of a refusal.
fn wrong_form(text: &str, lines: &[String]) -> Option<&'static str> {
    let errors: Vec<&str> = lines.iter().filter_map(|line| line.strip_prefix("error: ")).collect();
    let count = text.lines().last().and_then(|last| last.split(' ').next()).and_then(|n| n.parse().ok());
    let hidden = lines.last().is_some_and(|last| last.ends_with("not shown"));
    if count != Some(errors.len()) && !hidden {
        return Some("the number of faults is not that of the messages");
    }
    if errors.iter().any(|error| error.starts_with(char::is_uppercase) || error.ends_with('.')) {
        return Some("a message is lower case without a full stop");
    }
    // In a label, in advice, or behind a colon.
    let silent = |at: usize| {
        lines[at].starts_with("error: ")
            && !lines[at][7..].contains(": ")
            && lines.get(at + 1).is_none_or(|next| next.starts_with("error: "))
    };
    (0..lines.len()).any(silent).then_some("a message says what would be right")
}

/// Why the first excerpt of a message does not underline the marked place: file, line, column and characters.
fn points_elsewhere(text: &str, marked: &Marked) -> Option<String> {
    let lines: Vec<&str> = text.lines().collect();
    let place = lines.iter().find_map(|line| line.trim_start().strip_prefix("--> ")).unwrap_or("no place");
    let mut parts = place.rsplitn(3, ':');
    let mut number = || parts.next().and_then(|part| part.parse::<usize>().ok());
    let (column, line) = (number(), number());
    let is_there = parts.next() == Some(&marked.file) && line == Some(marked.line);
    if !is_there || (marked.column.is_some() && column != marked.column) {
        return Some(format!("expected {marked:?}, shown at {place}"));
    }
    let below = lines.iter().position(|line| line.contains('^')).unwrap_or(0);
    let is_source = |line: &&&str| line.trim_start().starts_with(|c: char| c.is_ascii_digit());
    let source = lines[..below].iter().rev().find(is_source).unwrap_or(&"");
    let carets: Vec<usize> =
        lines[below].chars().enumerate().filter(|(_, c)| *c == '^').map(|(at, _)| at).collect();
    let underlined: String = source.chars().skip(*carets.first().unwrap_or(&0)).take(carets.len()).collect();
    let right = if marked.text.is_empty() { carets.len() == 1 } else { underlined == marked.text };
    (!right).then(|| format!("expected {marked:?}, underlined `{underlined}`"))
}
