//! Residuals that are nothing but the rounding of `K x`.
//!
//! Iron that closes on itself around a winding carries thousands of times the flux that the current has in air. The unknowns of the
//! air beside it are as large, their products with the stiffness of air cancel to the load, and what rounding leaves of them may be
//! more of the load than is asked of a residual, while the field is exact to ten digits.

use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::fem::{CsrMatrix, c64, norm};

/// Of the required residual, what a solution that ends at rounding may be wrong by, in the norm of the energy.
const UNSEEN: f64 = 100.0;

/// What is left of a system `K x = b`.
pub(crate) struct Left<'a> {
    pub(crate) matrix: &'a CsrMatrix<c64>,
    pub(crate) load: &'a [c64],
    pub(crate) solution: &'a [c64],
    /// `r = b − K x`, or its negative.
    pub(crate) residual: &'a [c64],
    /// `K⁻¹ r`, about.
    pub(crate) step: &'a [c64],
}

impl Left<'_> {
    /// Whether the residual is below what a double holds of the products, `ε |(|b| + |K| |x|)|` (a sixth of it is usual), and a step
    /// has no share of the energy, `|rᴴ K⁻¹ r| ≤ (UNSEEN · required)² |bᴴ x|`: neither vanishes but with the field, where real and
    /// imaginary part of `K` are semidefinite.
    pub(crate) fn is_rounding(&self, required: f64) -> bool {
        let product = |a: &[c64], b: &[c64]| ordered_sum(a.len(), |i| a[i].conj() * b[i]).norm();
        let (left, all) = (product(self.residual, self.step), product(self.load, self.solution));
        left <= (UNSEEN * required).powi(2) * all && norm(self.residual) <= f64::EPSILON * self.products()
    }

    /// `|(|b| + |K| |x|)|`.
    fn products(&self) -> f64 {
        let CsrMatrix { structure, values } = self.matrix;
        let of_row = |i: usize| {
            let row = structure.row(i);
            let entries = values[row.clone()].iter().zip(&structure.columns[row]);
            let product =
                |(entry, &column): (&c64, &u32)| entry.norm() * self.solution[column as usize].norm();
            self.load[i].norm() + entries.map(product).sum::<f64>()
        };
        ordered_sum(self.load.len(), |i| of_row(i).powi(2)).sqrt()
    }
}
