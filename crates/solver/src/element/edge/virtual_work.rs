//! The rate at which the field energy of an edge tetrahedron changes as its vertices move: see [`super::super::virtual_work`].

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};

use super::super::Complex3;
use super::super::density::squared_deviation;
use super::super::virtual_work::{Tensor, VirtualWork, second, tensor, velocity_gradient};
use super::integral::Density;
use super::{Ascending, EdgeShape};

/// `adj(P, B)_di = 2 Re (P_d B_i) − δ_di 2 Re (P·B)`, from `δB = (M − tr M) B`.
fn adjoint(by: &Complex3, b: &Complex3) -> Tensor {
    let along: f64 = (0..3).map(|d| (by[d] * b[d]).re).sum();
    tensor(|d, i| 2.0 * (by[d] * b[i]).re - if d == i { 2.0 * along } else { 0.0 })
}

impl<const N: usize, const M: usize> EdgeShape<N, M> {
    /// The rate of `∫c |B|²` for some velocities of the vertices.
    pub(crate) fn virtual_work(
        &self,
        cell: (&Tet4, &Ascending),
        factor: f64,
        velocities: &[Point; 4],
        coefficients: &[[c64; 4]],
    ) -> VirtualWork<N> {
        let velocity = velocity_gradient(cell.0, velocities);
        let trace = velocity[0][0] + velocity[1][1] + velocity[2][2];
        let rate = self.integrate(self.curl_rule(), cell, coefficients, |at| {
            let b = at.flux_density;
            let half = b.map(|c| factor * c.conj());
            let density: f64 = (0..3).map(|d| (half[d] * b[d]).re).sum();
            let of_stress = adjoint(&half, &b);
            let stress = tensor(|d, i| if d == i { density } else { 0.0 } + of_stress[d][i]);
            let by_curl: Complex3 = std::array::from_fn(|d| {
                let both: c64 = (0..3).map(|i| (velocity[d][i] + velocity[i][d]) * half[i]).sum();
                both - trace * half[d]
            });
            let (value, tensor) = second(&stress, &velocity, &adjoint(&by_curl, &b));
            Density { value, by_curl, by_potential: [c64::default(); 3], tensor }
        });
        let energy = self.flux_integral(cell, coefficients, squared_deviation(factor, [0.0; 3]));
        VirtualWork { rate, by_velocity: energy.positions }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::differences::{SKEW, central_difference, derivatives_hold, values};
    use super::super::super::virtual_work::tests::{VELOCITIES, after};
    use super::*;

    fn check<const N: usize, const M: usize>(shape: &'static EdgeShape<N, M>) {
        let cell = |vertices: [Point; 4]| {
            let tet = Tet4::new(vertices);
            (tet, Ascending::new(&tet, [1, 3, 0, 2]))
        };
        derivatives_hold::<N, 4>(SKEW, |x, u| {
            let (plain, tet) = cell(x);
            shape.virtual_work((&plain, &tet), 0.7, &VELOCITIES, &u).rate
        });
        let field: [[c64; 4]; N] = values(5);
        let energy = |t: f64| {
            let (plain, tet) = cell(after(t));
            shape.flux_integral((&plain, &tet), &field, squared_deviation(0.7, [0.0; 3])).value.into()
        };
        let (plain, tet) = cell(SKEW);
        let rate = shape.virtual_work((&plain, &tet), 0.7, &VELOCITIES, &field).rate.value;
        let difference = central_difference(1e-5, energy).re;
        assert!((difference - rate).abs() < 1e-8 * (1.0 + rate.abs()), "{difference} {rate}");
    }

    #[test]
    fn the_rate_is_the_derivative_of_the_energy_and_has_the_derivatives_of_differences() {
        check(EdgeShape::<6, 12>::tet());
        check(EdgeShape::<10, 30>::tet());
    }
}
