//! Integrals of real densities over one element, with their derivatives: field energy, eddy-current loss.
//!
//! For an integral of a density `j` of `∂_i A_j`, `A` and `∂_i ψ` on a straight-sided tetrahedron and at fixed nodal
//! values, moving vertex `k` gives `V ⟨S⟩ ∇λ_k` with the tensor `S_di = j δ_di − (terms of dj with ∂_i replaced by
//! ∂_d)`, as in [`super::point`]. The quadrature is exact for each order. Derivatives by the complex nodal values are
//! halved, so that `d(∫j) = 2 Re Σ derivative · d(value)`.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};

use super::lagrange::Lagrange;
use super::point::PointField;
use super::tabulated::Rule;
use super::volume::NodalField;
use super::{Complex3, cross3, dot3};

/// A real integral over an element of `N` nodes with `M` vertices, and its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct ElementIntegral<const N: usize, const M: usize> {
    /// The integral.
    pub value: f64,
    /// By the nodal `A_x, A_y, A_z, ψ`, shape `(N, 4)`: `d value = 2 Re Σ potentials · d(potential)`.
    pub potentials: [[c64; 4]; N],
    /// By the positions of the vertices at fixed potentials, shape `(M, 3)`.
    pub positions: [Point; M],
}

/// A density of `B`, and its derivatives by the components of `B`, halved.
pub type OfFlux = (f64, Complex3);

/// `f |B − B_r|²`; `remanence` is `B_r` [T], zero outside magnets.
pub fn squared_deviation(factor: f64, remanence: Point) -> impl Fn(Complex3) -> OfFlux {
    move |b| {
        let conjugate: Complex3 = std::array::from_fn(|d| (b[d] - remanence[d]).conj());
        let square: f64 = conjugate.iter().map(|c| c.norm_sqr()).sum();
        (factor * square, conjugate.map(|c| factor * c))
    }
}

/// The integral of a density of `B = curl A` over a tetrahedron, by the rule that is exact for squares, whose points count alike.
pub fn flux_integral<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    field: &NodalField<N>,
    mut density: impl FnMut(Complex3) -> OfFlux,
) -> ElementIntegral<N, 4> {
    let rule = if N == 4 { Rule::Centroid } else { Rule::Degree2 };
    integrate(shape, tet, rule, field, |at| {
        let (value, by_curl) = density(at.flux_density());
        // δ(∂_i A_j) = −∂_i λ_k ∂_d A_j, hence by_curl·δb = −∇λ_k · (∂_d A × by_curl).
        let turned: [Complex3; 3] = at.gradient.map(|row| cross3(row, by_curl));
        let replaced = turned.map(|row| row.map(|c| -2.0 * c.re));
        Density { value, by_curl, by_drive: [c64::default(); 3], replaced }
    })
}

/// `f ∫|A + ∇ψ|² dV` over a tetrahedron.
pub fn eddy_loss<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    factor: f64,
    field: &NodalField<N>,
) -> ElementIntegral<N, 4> {
    let rule = if N == 4 { Rule::Degree2 } else { Rule::Degree5 };
    integrate(shape, tet, rule, field, |at| {
        let conjugate = at.electric_potential().map(|c| c.conj());
        let square: f64 = conjugate.iter().map(|c| c.norm_sqr()).sum();
        Density {
            value: factor * square,
            by_curl: [c64::default(); 3],
            by_drive: conjugate.map(|c| factor * c),
            replaced: at.scalar_gradient.map(|slope| conjugate.map(|c| -2.0 * factor * (c * slope).re)),
        }
    })
}

/// A density at a point and its derivatives, halved as in the module's documentation.
struct Density {
    value: f64,
    /// By `curl A`.
    by_curl: Complex3,
    /// By `A + ∇ψ`.
    by_drive: Complex3,
    /// The terms of `S_di` with `∂_i` replaced by `∂_d`, index `[d][i]`.
    replaced: [Point; 3],
}

/// The integral of a density by a quadrature rule.
fn integrate<const N: usize>(
    shape: &Lagrange<N, 4>,
    tet: &Tet4,
    rule: Rule,
    field: &NodalField<N>,
    mut density: impl FnMut(&PointField) -> Density,
) -> ElementIntegral<N, 4> {
    let mut integral =
        ElementIntegral { value: 0.0, potentials: [[c64::default(); 4]; N], positions: [[0.0; 3]; 4] };
    let mut tensor = [[0.0; 3]; 3];
    for point in shape.at(rule) {
        let (share, at) = (point.share, density(&PointField::tabulated(point, tet, field)));
        let weight = share * tet.volume;
        integral.value += weight * at.value;
        // by_curl·(∇N × A) = (by_curl × ∇N)·A, and ∇N is a sum of ∇λ: the products with these are the same for all N.
        let along = tet.gradients.map(|g| {
            let turned = cross3(at.by_curl, g.map(c64::from));
            [turned[0], turned[1], turned[2], dot3(at.by_drive, g.map(c64::from))].map(|c| weight * c)
        });
        for (a, derivative) in integral.potentials.iter_mut().enumerate() {
            for k in 0..if a < 4 { 1 } else { 2 } {
                let (m, slope) = (point.along[a][k], point.slopes[a][k]);
                for (sum, term) in derivative.iter_mut().zip(&along[m]) {
                    *sum += slope * term;
                }
            }
            for d in 0..3 {
                derivative[d] += weight * point.values[a] * at.by_drive[d];
            }
        }
        for d in 0..3 {
            tensor[d][d] += share * at.value;
            for i in 0..3 {
                tensor[d][i] += share * at.replaced[d][i];
            }
        }
    }
    integral.positions = tet
        .gradients
        .map(|g| std::array::from_fn(|d| tet.volume * (0..3).map(|i| tensor[d][i] * g[i]).sum::<f64>()));
    integral
}

#[cfg(test)]
mod tests {
    use super::super::differences::SKEW;
    use super::*;

    #[test]
    fn a_uniform_field_has_the_energy_of_its_volume() {
        // A = ½ b × x has the curl b.
        let (tet, b) = (Tet4::new(SKEW), [0.3, -0.4, 1.2]);
        let field = NodalField::new(SKEW.map(|x| {
            let a = fluxmorph_geometry::tet4::cross(b, x).map(|c| c64::new(0.5 * c, 0.0));
            [a[0], a[1], a[2], c64::default()]
        }));
        let shape = Lagrange::<4, 4>::tet();
        let energy = |remanence| flux_integral(shape, &tet, &field, squared_deviation(2.0, remanence)).value;
        assert!((energy([0.0; 3]) - 2.0 * 1.69 * tet.volume).abs() < 1e-14, "|b|² = 1.69");
        assert!(energy(b) < 1e-28, "a magnet at its remanence");
    }

    #[test]
    fn a_constant_potential_has_the_loss_of_its_volume() {
        let tet = Tet4::new(SKEW);
        let constant = [c64::new(0.0, 2.0), c64::default(), c64::default(), c64::default()];
        let loss = eddy_loss(Lagrange::<4, 4>::tet(), &tet, 0.5, &NodalField::new([constant; 4])).value;
        assert!((loss - 2.0 * tet.volume).abs() < 1e-14, "½ |2j|² V");
    }
}
