//! The tables of docs/torture.md.

use std::path::Path;

use super::{cases, shield};

const MARKS: [[&str; 2]; 2] = [
    ["<!-- torture:begin -->\n", "<!-- torture:end -->\n"],
    ["<!-- shield:begin -->\n", "<!-- shield:end -->\n"],
];

/// Measures everything and writes the tables between the marks of the page: `just torture-meshes`.
#[test]
#[ignore = "writes docs/torture.md: just torture-meshes"]
fn write_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/torture.md");
    let mut page = std::fs::read_to_string(&path).expect("the page is in the repository");
    for ([begin, end], table) in MARKS.into_iter().zip([cases::table(), shield::table()]) {
        let (head, rest) = page.split_once(begin).expect("the page has the first mark");
        let (_, tail) = rest.split_once(end).expect("the page has the second mark");
        page = format!("{head}{begin}{table}{end}{tail}");
    }
    std::fs::write(&path, page).expect("the page can be written");
}
