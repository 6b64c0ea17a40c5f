//! Links, anchors, and the table of contents.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use crate::page::Page;
use crate::repository;

/// Targets of the links of a line: `[text](target)`, images included; code spans hold none.
fn links(line: &str) -> Vec<String> {
    let text: String = line.split('`').step_by(2).collect::<Vec<_>>().join("`");
    let targets = text.split("](").skip(1);
    targets.filter_map(|rest| rest.split_once(')').map(|(target, _)| target.trim().to_owned())).collect()
}

/// The anchor that GitHub and mdBook make from a heading.
fn slug(heading: &str) -> String {
    let plain = heading.trim_start_matches('#').trim().replace(['`', '*'], "");
    let kept = plain.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.flat_map(char::to_lowercase).map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// All anchors of a page.
fn anchors(page: &Page) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    for (_, line) in &page.text {
        if line.starts_with('#') {
            let base = slug(line);
            let numbered = (1..).map(|n| format!("{base}-{n}"));
            let mut names = std::iter::once(base.clone()).chain(numbered);
            anchors.extend(names.find(|name| !anchors.contains(name)));
        }
        for part in line.split("<a id=\"").skip(1) {
            anchors.extend(part.split_once('"').map(|(id, _)| id.to_owned()));
        }
    }
    anchors
}

/// A path without `..`, relative to the repository; `None` when it leads out.
fn resolved(page: &str, target: &str) -> Option<String> {
    let mut path = PathBuf::from(page);
    path.pop();
    for component in Path::new(target).components() {
        match component {
            Component::ParentDir if !path.pop() => return None,
            Component::Normal(name) => path.push(name),
            _ => {}
        }
    }
    Some(path.to_string_lossy().into_owned())
}

fn fault(page: &Page, pages: &[Page], target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let path = if file.is_empty() { page.path.clone() } else { resolved(&page.path, file)? };
    if !repository(&path).exists() {
        return Some(format!("there is no {path}"));
    }
    let other = pages.iter().find(|other| other.path == path);
    match other {
        Some(other) if !anchor.is_empty() && !anchors(other).contains(anchor) => {
            Some(format!("{path} has no heading `#{anchor}`"))
        }
        _ => None,
    }
}

#[test]
fn every_link_leads_somewhere() {
    let pages = Page::all();
    let mut count = 0;
    let mut faults = Vec::new();
    for page in &pages {
        for (number, line) in &page.text {
            for target in links(line) {
                count += 1;
                let fault = fault(page, &pages, &target);
                faults.extend(fault.map(|fault| format!("{}:{number}: `{target}`: {fault}", page.path)));
            }
        }
    }
    println!("{count} links");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Files and folders of the repository that a line names in code: `crates/solver/src/audit.rs`.
fn named_paths(line: &str) -> Vec<&str> {
    const FOLDERS: [&str; 8] =
        ["crates/", "tests/", "docs/", "configs/", "tools/", "examples/", "benches/", "fuzz/"];
    let spans = line.split('`').skip(1).step_by(2);
    let is_path = |span: &&str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '.' | '_' | '-');
        let made =
            ["configs/runs", "docs/device/runs", "fuzz/corpus"].iter().any(|folder| span.starts_with(folder));
        FOLDERS.iter().any(|folder| span.starts_with(folder)) && span.chars().all(plain) && !made
    };
    spans.filter(is_path).collect()
}

#[test]
fn every_file_that_is_named_exists() {
    let mut count = 0;
    let mut faults = Vec::new();
    for page in Page::all() {
        for (number, line) in &page.text {
            for path in named_paths(line) {
                count += 1;
                if !repository(path).exists() {
                    faults.push(format!("{}:{number}: there is no `{path}`", page.path));
                }
            }
        }
    }
    println!("{count} names of files");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_page_stands_in_the_table_of_contents_once() {
    let summary = Page::read("docs/SUMMARY.md");
    let mut listed: Vec<String> = summary
        .text
        .iter()
        .flat_map(|(_, line)| links(line))
        .map(|target| resolved("docs/SUMMARY.md", &target).expect("a page of the book"))
        .collect();
    listed.sort();
    let pages = Page::all().into_iter().map(|page| page.path);
    let mut expected: Vec<String> =
        pages.filter(|path| path.starts_with("docs/") && path != "docs/SUMMARY.md").collect();
    expected.sort();
    assert_eq!(listed, expected);
}
