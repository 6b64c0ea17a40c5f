//! Integrals of energy and loss over an edge tetrahedron, with their derivatives.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};

use super::super::Complex3;
use super::super::density::{ElementIntegral, OfFlux};
use super::super::tabulated::Rule;
use super::super::virtual_work::tensor;
use super::{Ascending, EdgeShape, FieldPoint, combine};

/// A density at a point: its value, its derivatives by `B` and by `A + ∇ψ` (halved, as in [`super::super::density`]), and
/// its Eshelby tensor.
struct Density {
    value: f64,
    by_curl: Complex3,
    by_potential: Complex3,
    tensor: [Point; 3],
}

impl<const N: usize, const M: usize> EdgeShape<N, M> {
    /// The integral of a density of `B`, by the rule that is exact for squares, whose points count alike.
    pub(crate) fn flux_integral(
        &self,
        cell: (&Tet4, &Ascending),
        coefficients: &[[c64; 4]],
        mut density: impl FnMut(Complex3) -> OfFlux,
    ) -> ElementIntegral<N, 4> {
        self.integrate(self.curl_rule(), cell, coefficients, |at| {
            let b = at.flux_density;
            let (value, by_curl) = density(b);
            // δB = (∇v) B − (div v) B.
            let along: f64 = (0..3).map(|d| (by_curl[d] * b[d]).re).sum();
            let tensor = tensor(|d, i| {
                let diagonal = if d == i { value - 2.0 * along } else { 0.0 };
                diagonal + 2.0 * (by_curl[d] * b[i]).re
            });
            Density { value, by_curl, by_potential: [c64::default(); 3], tensor }
        })
    }

    /// `f ∫|A + ∇ψ|² dV`.
    pub(crate) fn eddy_loss(
        &self,
        cell: (&Tet4, &Ascending),
        factor: f64,
        coefficients: &[[c64; 4]],
    ) -> ElementIntegral<N, 4> {
        self.integrate(self.value_rule(), cell, coefficients, |at| {
            let conjugate = at.electric_potential.map(|c| c.conj());
            let square: f64 = conjugate.iter().map(|c| c.norm_sqr()).sum();
            // δE = −(∇v)ᵀ E.
            let tensor = tensor(|d, i| {
                let diagonal = if d == i { square } else { 0.0 };
                factor * (diagonal - 2.0 * (at.electric_potential[d] * conjugate[i]).re)
            });
            let by_potential = conjugate.map(|c| factor * c);
            Density { value: factor * square, by_curl: [c64::default(); 3], by_potential, tensor }
        })
    }

    /// The mean of `|A + ∇ψ|²` [T² m²].
    pub(crate) fn mean_square(&self, tet: &Ascending, coefficients: &[[c64; 4]]) -> f64 {
        let square = |at: &FieldPoint| at.electric_potential.iter().map(|c| c.norm_sqr()).sum::<f64>();
        self.fields(self.value_rule(), tet, coefficients).map(|(share, at)| share * square(&at)).sum()
    }

    fn integrate(
        &self,
        rule: Rule,
        (plain, tet): (&Tet4, &Ascending),
        coefficients: &[[c64; 4]],
        mut density: impl FnMut(&FieldPoint) -> Density,
    ) -> ElementIntegral<N, 4> {
        let mut integral =
            ElementIntegral { value: 0.0, potentials: [[c64::default(); 4]; N], positions: [[0.0; 3]; 4] };
        let mut sum = [[0.0; 3]; 3];
        for at in &self.tables[rule as usize] {
            let of = density(&self.field(at, tet, coefficients));
            let weight = at.share * tet.volume;
            integral.value += weight * of.value;
            for (f, &(carrier, component)) in self.slots.iter().enumerate() {
                let value = combine(&at.along[f], &tet.gradients);
                let curl = combine(&at.curl[f], &tet.products);
                integral.potentials[carrier][component] += weight
                    * (0..3).map(|d| of.by_curl[d] * curl[d] + of.by_potential[d] * value[d]).sum::<c64>();
            }
            for d in 0..3 {
                for i in 0..3 {
                    sum[d][i] += at.share * of.tensor[d][i];
                }
            }
        }
        integral.positions = plain
            .gradients
            .map(|g| std::array::from_fn(|d| plain.volume * (0..3).map(|i| sum[d][i] * g[i]).sum::<f64>()));
        integral
    }
}
