//! Errors over mesh sizes, and the order fitted to them.

use fluxmorph_optimizer::verify::fitted_slope;

/// A quantity's relative error on every mesh of a sequence.
pub(crate) struct Study {
    what: String,
    points: Vec<(f64, f64)>,
}

impl Study {
    /// An empty study of a quantity.
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), points: Vec::new() }
    }

    /// Adds the error on a mesh with cells of relative size `size`.
    pub(crate) fn add(&mut self, size: f64, error: f64) {
        self.points.push((size, error));
    }

    /// The slope of the least-squares line through `(ln size, ln error)`.
    pub(crate) fn order(&self) -> f64 {
        let (sizes, errors): (Vec<f64>, Vec<f64>) = self.points.iter().copied().unzip();
        fitted_slope(&sizes, &errors)
    }

    /// The error on the last mesh.
    pub(crate) fn last(&self) -> f64 {
        self.points.last().expect("a study has meshes").1
    }

    /// Prints errors and fitted order, and asserts the order on at least three meshes.
    pub(crate) fn assert_order(&self, least: f64) {
        let errors: Vec<String> = self.points.iter().map(|(_, e)| format!("{e:.3e}")).collect();
        println!("{:<60} order {:.3}   errors {}", self.what, self.order(), errors.join("  "));
        assert!(self.points.len() >= 3, "{}: an order needs three meshes", self.what);
        assert!(self.order() >= least, "{}: order {:.3}, expected at least {least}", self.what, self.order());
    }
}

#[test]
fn the_fitted_order_of_a_power_is_its_exponent() {
    let mut study = Study::new("a power");
    for n in [6.0, 9.0, 13.0, 18.0] {
        study.add(1.0 / n, 3.0 / f64::powf(n, 1.7));
    }
    // Rounding of four logarithms.
    assert!((study.order() - 1.7).abs() < 1e-12);
}
