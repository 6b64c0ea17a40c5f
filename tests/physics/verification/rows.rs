//! One compared number, and the table of all.

use std::fmt::Write;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::FieldModel;

/// A computed quantity beside its reference.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    case: String,
    quantity: String,
    tets: usize,
    unknowns: usize,
    computed: String,
    reference: String,
    error: f64,
    bar: f64,
}

/// The mesh and model that rows belong to.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) tets: usize,
    pub(crate) unknowns: usize,
}

impl Case {
    pub(crate) fn new(name: impl Into<String>, mesh: &Mesh, model: &FieldModel) -> Self {
        Self { name: name.into(), tets: mesh.topology().tets().len(), unknowns: model.unknown_count() }
    }

    /// A number; its error is `|computed − reference| / |reference|`, at most `bar`.
    pub(crate) fn row(&self, quantity: &str, computed: c64, reference: c64, bar: f64) -> Row {
        let error = (computed - reference).norm() / reference.norm();
        self.graded(quantity, number(computed), number(reference), error, bar)
    }

    /// A comparison with an error of its own kind.
    pub(crate) fn graded(
        &self,
        quantity: &str,
        computed: String,
        reference: String,
        error: f64,
        bar: f64,
    ) -> Row {
        let Self { name: case, tets, unknowns } = self.clone();
        Row { case, quantity: quantity.to_owned(), tets, unknowns, computed, reference, error, bar }
    }
}

impl Row {
    /// The relative error.
    pub(crate) fn error(&self) -> f64 {
        self.error
    }
}

/// Prints rows and asserts that each meets its bar.
pub(crate) fn assert_rows(rows: &[Row]) {
    println!("{}", table(rows));
    let missed: Vec<&Row> = rows.iter().filter(|row| row.error.is_nan() || row.error > row.bar).collect();
    assert!(missed.is_empty(), "{missed:#?}");
}

/// The rows as Markdown.
pub(crate) fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| case | quantity | tetrahedra | unknowns | computed | reference | error | bar |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let Row { case, quantity, tets, unknowns, computed, reference, error, bar } = row;
        writeln!(
            text,
            "| {case} | {quantity} | {tets} | {unknowns} | {computed} | {reference} | {:.2} % | {:.0} % |",
            100.0 * error,
            100.0 * bar
        )
        .expect("a string takes text");
    }
    text
}

fn number(value: c64) -> String {
    if value.im == 0.0 {
        format!("{:.5e}", value.re)
    } else {
        format!("{:.4e} {:+.4e} j", value.re, value.im)
    }
}
