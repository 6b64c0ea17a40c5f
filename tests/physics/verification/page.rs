//! The table of docs/verification.md.

use crate::case::MeshSize;
use crate::rows::{assert_rows, table};
use crate::support::repository;
use crate::{plate, shield, sphere, team7, team21a};

const BEGIN: &str = "<!-- verify:begin -->\n";
const END: &str = "<!-- verify:end -->\n";

/// Computes every row and writes the table between the marks of the page: `just verify`.
#[test]
#[ignore = "writes docs/verification.md: just verify"]
fn write_the_table() {
    let mut rows = sphere::rows();
    rows.extend(plate::rows());
    rows.extend(shield::rows());
    for frequency in [50, 200] {
        rows.extend(team7::rows(frequency, MeshSize::Shipped, 0.05));
    }
    for model in ["0", "2"] {
        rows.extend(team21a::rows(model, MeshSize::Shipped, 0.06));
    }
    let path = repository("docs/verification.md");
    let page = std::fs::read_to_string(&path).expect("the page is in the repository");
    let (head, rest) = page.split_once(BEGIN).expect("the page has the first mark");
    let (_, tail) = rest.split_once(END).expect("the page has the second mark");
    std::fs::write(&path, format!("{head}{BEGIN}{}{END}{tail}", table(&rows)))
        .expect("the page can be written");
    assert_rows(&rows);
}
