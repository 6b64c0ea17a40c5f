//! The rate at which the field energy of an element changes as its vertices move, and the derivatives of that rate: what a
//! force is made of.
//!
//! With the density `f(F)` of the point values `F` (of nodal elements `F_ij = ∂_i A_j`, of edge elements `B`), which follow a
//! displacement with the gradient `M_di = ∂_i u_d` by `δF = T(M) F` at fixed coefficients, a virtual velocity with the gradient
//! `L` changes the energy at the rate `s = V ⟨S:L⟩`, `S = f I + adj(f', F)`, where `adj(P, F):M = P·T(M)F`. As `L` itself
//! changes by `−L M`, a further displacement changes the rate by `V ⟨Q:M⟩`,
//!
//! `Q = (S:L) I + adj(∂_F (S:L), F) − Lᵀ S`.
//!
//! Coulomb, IEEE Trans. Magn. 19 (1983) 2514, has the rate.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};

use super::Complex3;
use super::density::ElementIntegral;
use super::lagrange::Lagrange;
use super::point::PointField;
use super::tabulated::Rule;
use super::volume::NodalField;

/// A rate and its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct VirtualWork<const N: usize> {
    /// `s`, with its derivatives.
    pub rate: ElementIntegral<N, 4>,
    /// By the velocities of the vertices, shape `(4, 3)`: the derivative of the energy by their positions.
    pub by_velocity: [Point; 4],
}

/// A tensor with the index `[d][i]`.
pub(super) type Tensor = [Point; 3];

/// `L_di = ∂_i v_d` of the velocities of the vertices.
pub(super) fn velocity_gradient(tet: &Tet4, velocities: &[Point; 4]) -> Tensor {
    tensor(|d, i| (0..4).map(|k| velocities[k][d] * tet.gradients[k][i]).sum())
}

/// The tensor with some entries.
#[inline]
pub(super) fn tensor(entry: impl Fn(usize, usize) -> f64) -> Tensor {
    std::array::from_fn(|d| std::array::from_fn(|i| entry(d, i)))
}

/// `S:L` and `Q` from `S`, `L` and `adj(∂_F (S:L), F)`.
pub(super) fn second(stress: &Tensor, velocity: &Tensor, adjoint: &Tensor) -> (f64, Tensor) {
    let rate = (0..3).flat_map(|d| (0..3).map(move |i| stress[d][i] * velocity[d][i])).sum();
    let turned = |d: usize, i: usize| (0..3).map(|e| velocity[e][d] * stress[e][i]).sum::<f64>();
    (rate, tensor(|d, i| if d == i { rate } else { 0.0 } + adjoint[d][i] - turned(d, i)))
}

/// `V S ∇λ_k` for the four vertices.
pub(super) fn at_vertices(tet: &Tet4, sum: &Tensor) -> [Point; 4] {
    tet.gradients.map(|g| std::array::from_fn(|d| tet.volume * (0..3).map(|i| sum[d][i] * g[i]).sum::<f64>()))
}

/// Adds a share of a tensor.
pub(super) fn add(sum: &mut Tensor, share: f64, term: &Tensor) {
    for d in 0..3 {
        for i in 0..3 {
            sum[d][i] += share * term[d][i];
        }
    }
}

/// `∂_i A_j`, or derivatives by it.
type Gradient = [Complex3; 3];

/// Half the derivative of `f = c (|curl A|² + p |div A|²)` by `∂_i A_j`.
fn half_derivative([factor, penalty]: [f64; 2], gradient: &Gradient) -> Gradient {
    let divergence = penalty * (gradient[0][0] + gradient[1][1] + gradient[2][2]);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let by = if i == j { divergence } else { gradient[i][j] - gradient[j][i] };
            factor * by.conj()
        })
    })
}

/// `adj(P, F)_di = −2 Re Σ_j P_ij ∂_d A_j`.
fn adjoint(by: &Gradient, gradient: &Gradient) -> Tensor {
    tensor(|d, i| -2.0 * (0..3).map(|j| (by[i][j] * gradient[d][j]).re).sum::<f64>())
}

/// The rate of `∫c (|curl A|² + p |div A|²)`, the energy with its penalty, for some velocities of the vertices.
pub fn virtual_work<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    law: [f64; 2],
    velocities: &[Point; 4],
    field: &NodalField<N>,
) -> VirtualWork<N> {
    let velocity = velocity_gradient(tet, velocities);
    let trace = velocity[0][0] + velocity[1][1] + velocity[2][2];
    let mut rate =
        ElementIntegral { value: 0.0, potentials: [[c64::default(); 4]; N], positions: [[0.0; 3]; 4] };
    let (mut stresses, mut sum) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
    for at in shape.at(if N == 4 { Rule::Centroid } else { Rule::Degree2 }) {
        let gradient = PointField::tabulated(at, tet, field).gradient;
        let half = half_derivative(law, &gradient);
        let density: f64 =
            (0..3).map(|i| (0..3).map(|j| (half[i][j] * gradient[i][j]).re).sum::<f64>()).sum();
        let of_stress = adjoint(&half, &gradient);
        let stress = tensor(|d, i| if d == i { density } else { 0.0 } + of_stress[d][i]);
        let carried: Gradient = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|d| velocity[d][i] * gradient[d][j]).sum())
        });
        let of_carried = half_derivative(law, &carried);
        let by: Gradient = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let turned: c64 = (0..3).map(|e| velocity[i][e] * half[e][j]).sum();
                trace * half[i][j] - turned - of_carried[i][j]
            })
        });
        let (value, tensor) = second(&stress, &velocity, &adjoint(&by, &gradient));
        let weight = at.share * tet.volume;
        rate.value += weight * value;
        for (a, potentials) in rate.potentials.iter_mut().enumerate() {
            let slope = at.gradient(&tet.gradients, a);
            for j in 0..3 {
                potentials[j] += (0..3).map(|i| weight * slope[i] * by[i][j]).sum::<c64>();
            }
        }
        add(&mut stresses, at.share, &stress);
        add(&mut sum, at.share, &tensor);
    }
    rate.positions = at_vertices(tet, &sum);
    VirtualWork { rate, by_velocity: at_vertices(tet, &stresses) }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::density::{flux_integral, squared_deviation};
    use super::super::differences::{SKEW, central_difference, derivatives_hold, values};
    use super::*;

    pub(in super::super) const VELOCITIES: [Point; 4] =
        [[0.4, -0.2, 0.7], [0.1, 0.9, -0.5], [-0.3, 0.2, 0.6], [0.8, -0.7, 0.1]];

    /// The vertices after some time.
    pub(in super::super) fn after(time: f64) -> [Point; 4] {
        std::array::from_fn(|k| std::array::from_fn(|d| SKEW[k][d] + time * VELOCITIES[k][d]))
    }

    fn check<const N: usize>(shape: &'static Lagrange<N, 4>) {
        derivatives_hold::<N, 4>(SKEW, |x, u| {
            virtual_work(shape, &Tet4::new(x), [0.7, 0.6], &VELOCITIES, &NodalField::new(u)).rate
        });
        let field = NodalField::new(values(5));
        let work = virtual_work(shape, &Tet4::new(SKEW), [0.7, 0.0], &VELOCITIES, &field);
        let energy = |t: f64| {
            flux_integral(shape, &Tet4::new(after(t)), &field, squared_deviation(0.7, [0.0; 3])).value.into()
        };
        let difference = central_difference(1e-5, energy).re;
        assert!((difference - work.rate.value).abs() < 1e-8, "{difference} {}", work.rate.value);
        let along: f64 =
            (0..4).map(|k| fluxmorph_geometry::tet4::dot(work.by_velocity[k], VELOCITIES[k])).sum();
        assert!((along - work.rate.value).abs() < 1e-13, "the rate is linear in the velocities");
    }

    #[test]
    fn the_rate_is_the_derivative_of_the_energy_and_has_the_derivatives_of_differences() {
        check(Lagrange::<4, 4>::tet());
        check(Lagrange::<10, 4>::tet());
    }
}
