//! The work of Maxwell's stress along a virtual motion of the vertices of an element, and its derivatives: what a force is made of.
//!
//! With the energy density `c |B|²` the stress is `S = 2c Re(B̄ Bᵀ) − c |B|² I`. It is also the rate at which the energy changes as
//! the vertices move and carry the flux with them, `δB = (L − tr L) B` for a velocity `v` with the gradient `L_di = ∂_i v_d`; edge
//! elements do so at fixed coefficients (Coulomb, IEEE Trans. Magn. 19 (1983) 2514). Nodal elements at fixed potentials do not: their
//! energy changes by a tensor that is off by one without divergence, `ε_ijk H_k ∂_j A_d`, so that forces are right, but not torques,
//! for the potentials within a body that turns would have to turn with it, nor what acts on part of a surface. So `B` is carried in
//! both families.
//!
//! As the vertices move by a displacement with the gradient `M`, `L` itself changes by `−L M`, and the work `s = V ⟨S:L⟩` by that of a
//! density of `B`, less `V ⟨Lᵀ S⟩:M`.

use fluxmorph_geometry::tet4::{Point, Tet4};

use super::Complex3;
use super::density::OfFlux;

/// A tensor with the index `[d][i]`.
type Tensor = [Point; 3];

/// The tensor with some entries.
#[inline]
pub(super) fn tensor(entry: impl Fn(usize, usize) -> f64) -> Tensor {
    std::array::from_fn(|d| std::array::from_fn(|i| entry(d, i)))
}

/// The work in one element, by the points at which `B` is integrated.
#[derive(Debug)]
pub(crate) struct VirtualWork {
    /// `c` [m/H].
    factor: f64,
    /// `L` [1/m per unit of the motion].
    velocity: Tensor,
    /// The stresses [N/m²] of all points so far.
    sum: Tensor,
    points: usize,
}

impl VirtualWork {
    /// Of velocities of the vertices.
    pub(crate) fn new(tet: &Tet4, factor: f64, velocities: &[Point; 4]) -> Self {
        let velocity = tensor(|d, i| (0..4).map(|k| velocities[k][d] * tet.gradients[k][i]).sum());
        Self { factor, velocity, sum: [[0.0; 3]; 3], points: 0 }
    }

    /// The density `S:L`, and its derivative by `B`, halved as in [`super::density`], at the next point. All points count alike.
    pub(crate) fn density(&mut self, b: Complex3) -> OfFlux {
        let half = b.map(|c| self.factor * c.conj());
        let density: f64 = (0..3).map(|d| (half[d] * b[d]).re).sum();
        let stress = tensor(|d, i| 2.0 * (half[d] * b[i]).re - if d == i { density } else { 0.0 });
        let (velocity, mut work) = (&self.velocity, 0.0);
        for d in 0..3 {
            for i in 0..3 {
                self.sum[d][i] += stress[d][i];
                work += stress[d][i] * velocity[d][i];
            }
        }
        self.points += 1;
        let trace = velocity[0][0] + velocity[1][1] + velocity[2][2];
        let by_b = |d: usize| {
            let both = |i: usize| half[i] * (velocity[d][i] + velocity[i][d]);
            both(0) + both(1) + both(2) - half[d] * trace
        };
        (work, std::array::from_fn(by_b))
    }

    /// After all points: what the derivatives by the positions of the vertices have beside those of the density, and the derivatives by
    /// their velocities [N].
    pub(crate) fn at_vertices(&self, tet: &Tet4) -> [[Point; 4]; 2] {
        let share = tet.volume / self.points as f64;
        let along = |tensor: &Tensor, g: Point| -> Point {
            std::array::from_fn(|d| share * (0..3).map(|i| tensor[d][i] * g[i]).sum::<f64>())
        };
        let turned = tensor(|d, i| -(0..3).map(|e| self.velocity[e][d] * self.sum[e][i]).sum::<f64>());
        [&turned, &self.sum].map(|tensor| tet.gradients.map(|g| along(tensor, g)))
    }
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::fem::c64;

    use super::super::density::squared_deviation;
    use super::super::differences::{SKEW, central_difference, derivatives_hold, values};
    use super::*;
    use crate::family::{Cell, EDGE_1, EDGE_2, LocalIntegral, Matrices, NODAL_1, NODAL_2};

    const VELOCITIES: [Point; 4] = [[0.4, -0.2, 0.7], [0.1, 0.9, -0.5], [-0.3, 0.2, 0.6], [0.8, -0.7, 0.1]];

    fn cell(vertices: [Point; 4]) -> Cell {
        Cell { tet: Tet4::new(vertices), order: [1, 3, 0, 2] }
    }

    /// The work on a field, and its derivatives by the velocities.
    fn work<const N: usize, const F: usize>(
        family: &impl Matrices<N, F>,
        vertices: [Point; 4],
        field: &[[c64; 4]; N],
    ) -> (LocalIntegral<4>, [Point; 4]) {
        let cell = cell(vertices);
        let mut work = VirtualWork::new(&cell.tet, 0.7, &VELOCITIES);
        let mut rate = family.flux_integral(&cell, field, &mut |b| work.density(b));
        let [by_positions, by_velocities] = work.at_vertices(&cell.tet);
        for (position, more) in rate.positions.iter_mut().zip(by_positions) {
            (0..3).for_each(|d| position[d] += more[d]);
        }
        (rate, by_velocities)
    }

    fn check_derivatives<const N: usize, const F: usize>(family: &impl Matrices<N, F>) {
        derivatives_hold::<N, 4>(SKEW, |x, u| work(family, x, &u).0);
        let (rate, by_velocities) = work(family, SKEW, &values(5));
        let along: f64 = (0..4).map(|k| fluxmorph_geometry::tet4::dot(by_velocities[k], VELOCITIES[k])).sum();
        assert!((along - rate.value).abs() < 1e-12 * rate.value.abs(), "it is linear in the velocities");
    }

    fn check_rate<const N: usize, const F: usize>(family: &impl Matrices<N, F>) {
        let field: [[c64; 4]; N] = values(5);
        let energy = |t: f64| {
            let moved = |k: usize| std::array::from_fn(|d| SKEW[k][d] + t * VELOCITIES[k][d]);
            let cell = cell(std::array::from_fn(moved));
            family.flux_integral(&cell, &field, &mut squared_deviation(0.7, [0.0; 3])).value.into()
        };
        let (rate, difference) = (work(family, SKEW, &field).0.value, central_difference(1e-5, energy).re);
        assert!((difference - rate).abs() < 1e-8 * (1.0 + rate.abs()), "{difference} {rate}");
    }

    #[test]
    fn the_work_has_the_derivatives_of_differences_and_is_the_rate_of_the_energy_on_edge_elements() {
        check_derivatives(&*NODAL_1);
        check_derivatives(&*NODAL_2);
        check_derivatives(&*EDGE_1);
        check_derivatives(&*EDGE_2);
        check_rate(&*EDGE_1);
        check_rate(&*EDGE_2);
    }
}
