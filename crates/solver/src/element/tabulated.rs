//! Shape functions tabulated at the points of the quadrature rules, for the loops over elements.
//!
//! Gradients of `N_a` need its derivatives `∂N_a/∂λ_m` only up to what is common to all `m`, since `Σ_m ∇λ_m = 0`. With
//! that freedom a function of a vertex has one derivative that is not zero, and one of an edge two: `∇N_a = Σ_k s_k
//! ∇λ_{m_k}` has two terms at most. So a field's gradient is found from its sums `Σ_a s_k A_a` by vertex first, and
//! meets the geometry of the element once.

use fluxmorph_geometry::tet4::Point;

use super::quadrature::{self, Node};

/// A quadrature rule on the tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The centroid: exact for linear polynomials.
    Centroid,
    /// The vertices, in their order: exact for linear polynomials.
    Vertices,
    /// Exact for polynomials of degree 2.
    Degree2,
    /// Exact for polynomials of degree 5.
    Degree5,
}

impl Rule {
    /// All rules, in the order of their tables.
    pub const ALL: [Self; 4] = [Self::Centroid, Self::Vertices, Self::Degree2, Self::Degree5];

    /// Points and weights.
    pub fn nodes(self) -> &'static [Node] {
        match self {
            Self::Centroid => &[([0.25; 4], 1.0)],
            Self::Vertices => quadrature::vertices(),
            Self::Degree2 => quadrature::degree_2(),
            Self::Degree5 => quadrature::degree_5(),
        }
    }
}

/// The `N` shape functions of a tetrahedron at one point of a rule.
#[derive(Clone, Copy, Debug)]
pub struct Tabulated<const N: usize> {
    /// Weight of the point: its share of the volume.
    pub share: f64,
    /// `N_a`.
    pub values: [f64; N],
    /// The vertices `m_k` along whose `λ` a function changes; of a function of a vertex, twice that vertex.
    pub along: [[usize; 2]; N],
    /// `s_k`; of a function of a vertex, the second is zero.
    pub slopes: [[f64; 2]; N],
}

impl<const N: usize> Tabulated<N> {
    /// `∇N_a` [1/m] from the gradients `∇λ_m` [1/m].
    #[inline]
    pub fn gradient(&self, gradients: &[Point; 4], a: usize) -> Point {
        let ([m, n], [s, t]) = (self.along[a], self.slopes[a]);
        std::array::from_fn(|d| s * gradients[m][d] + t * gradients[n][d])
    }
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::tet4::Tet4;

    use super::super::differences::SKEW;
    use super::super::lagrange::Lagrange;
    use super::super::point;
    use super::*;

    fn check<const N: usize>(shape: &'static Lagrange<N, 4>) {
        let tet = Tet4::new(SKEW);
        for rule in Rule::ALL {
            let table = shape.at(rule);
            assert_eq!(table.len(), rule.nodes().len());
            for (at, (lambda, share)) in table.iter().zip(rule.nodes()) {
                assert_eq!(at.share, *share);
                for a in 0..N {
                    assert!((at.values[a] - shape.value(a, lambda)).abs() < 1e-15);
                    let (short, long) =
                        (at.gradient(&tet.gradients, a), point::gradient(shape, &tet, lambda, a));
                    assert!((0..3).all(|d| (short[d] - long[d]).abs() < 1e-14), "function {a}");
                }
            }
        }
    }

    #[test]
    fn tables_hold_the_values_and_gradients_of_the_functions() {
        check(Lagrange::<4, 4>::tet());
        check(Lagrange::<10, 4>::tet());
    }
}
