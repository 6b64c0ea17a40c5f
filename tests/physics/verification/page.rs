//! The table of docs/verification.md.

use super::case::MeshSize;
use super::rows::{assert_rows, table};
use super::{plate, shield, sphere, team7, team21a};
use crate::support::write_into_page;

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
    write_into_page("docs/verification.md", "verify", &table(&rows));
    assert_rows(&rows);
}
