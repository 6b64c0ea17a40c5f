//! How far a tetrahedron is from its ideal shape, with the derivative by one vertex.
//!
//! With the deformation gradient `F = Σ_k x_k ⊗ ∇N_k` of the affine map from the ideal tetrahedron (shape functions
//! `N_k`) to the present one (vertices `x_k`), the measure is `m = c det F (‖F‖² / 3)^(−3/2)`, `‖·‖` the Frobenius norm.
//! By the inequality of the means `m ≤ c`, with equality for a similarity only; its sign is that of the volume.
//!
//! * The ideal is a **regular tetrahedron**: `‖F‖² / 3 = Σ L² / 6` and `det F = 6√2 V` at edge 1, so that `m` is the
//!   quality of Eq. 4 when `c` carries the printed constant.
//! * The ideal is the element of a **reference mesh**, `c = 1`: a thin element that is meant to be thin has `m = 1`.
//!
//! In one vertex `det F` is affine and `‖F‖³` convex, so that every set `m ≥ const > 0` is convex, and a strict local
//! maximum of the least `m` around a node is the global one: a quasiconvex programme, as in Amenta, Bern and Eppstein,
//! J. Algorithms 30, 1999.

use fluxmorph_geometry::quality::NORMALISATION;
use fluxmorph_geometry::tet4::{Point, Tet4, cross, dot, sub};

/// A regular tetrahedron of positive volume; the measure does not depend on its size.
const REGULAR: [Point; 4] = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];

/// The shape an element should have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ideal {
    /// `∇N_k` of the ideal tetrahedron.
    gradients: [Point; 4],
    /// Measure of the ideal shape itself.
    best: f64,
}

impl Ideal {
    /// The regular tetrahedron, with the measure of Eq. 4.
    pub(super) fn regular() -> Self {
        Self { gradients: Tet4::new(REGULAR).gradients, best: NORMALISATION / (6.0 * 2f64.sqrt()) }
    }

    /// The shape of an element of positive volume, with the measure 1.
    pub(super) fn shape_of(vertices: [Point; 4]) -> Self {
        Self { gradients: Tet4::new(vertices).gradients, best: 1.0 }
    }

    /// The measure of a tetrahedron; 0 if its vertices coincide.
    pub(super) fn measure(&self, vertices: [Point; 4]) -> f64 {
        let columns = self.deformation(vertices);
        let mean = mean_square(columns);
        if mean == 0.0 { 0.0 } else { self.best * determinant(columns) / (mean * mean.sqrt()) }
    }

    /// The measure and its derivative by the vertex `k`.
    ///
    /// `∂m/∂x_k = c n^(−3/2) (cof F − det F / n · F) ∇N_k` with `n = ‖F‖² / 3`.
    pub(super) fn measure_and_gradient(&self, vertices: [Point; 4], k: usize) -> (f64, Point) {
        let columns = self.deformation(vertices);
        let mean = mean_square(columns);
        if mean == 0.0 {
            return (0.0, [0.0; 3]);
        }
        let scale = self.best / (mean * mean.sqrt());
        let (det, cofactor) = (determinant(columns), cofactor(columns));
        let gradient = std::array::from_fn(|i| {
            let along = |j: usize| (cofactor[j][i] - det / mean * columns[j][i]) * self.gradients[k][j];
            scale * (along(0) + along(1) + along(2))
        });
        (scale * det, gradient)
    }

    /// `det F`, the volume in units of the ideal one, and its derivative `cof F ∇N_k` by the vertex `k`.
    pub(super) fn volume_and_gradient(&self, vertices: [Point; 4], k: usize) -> (f64, Point) {
        let columns = self.deformation(vertices);
        let cofactor = cofactor(columns);
        let gradient = std::array::from_fn(|i| (0..3).map(|j| cofactor[j][i] * self.gradients[k][j]).sum());
        (determinant(columns), gradient)
    }

    /// The columns of `F`, from differences of vertices: the gradients sum to zero.
    fn deformation(&self, vertices: [Point; 4]) -> [Point; 3] {
        let edges = [1, 2, 3].map(|k| sub(vertices[k], vertices[0]));
        let entry = |i: usize, j: usize| {
            edges[0][i] * self.gradients[1][j]
                + edges[1][i] * self.gradients[2][j]
                + edges[2][i] * self.gradients[3][j]
        };
        std::array::from_fn(|j| std::array::from_fn(|i| entry(i, j)))
    }
}

fn determinant([a, b, c]: [Point; 3]) -> f64 {
    dot(a, cross(b, c))
}

fn cofactor([a, b, c]: [Point; 3]) -> [Point; 3] {
    [cross(b, c), cross(c, a), cross(a, b)]
}

fn mean_square(columns: [Point; 3]) -> f64 {
    (dot(columns[0], columns[0]) + dot(columns[1], columns[1]) + dot(columns[2], columns[2])) / 3.0
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::quality::quality;

    use super::*;

    const SKEW: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];
    const FLAT: [Point; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 1e-3]];

    fn inverted([a, b, c, d]: [Point; 4]) -> [Point; 4] {
        [a, c, b, d]
    }

    #[test]
    fn against_the_regular_tetrahedron_the_measure_is_the_quality() {
        for vertices in [SKEW, inverted(SKEW), FLAT, REGULAR] {
            // Rounding of some dozen operations.
            assert!((Ideal::regular().measure(vertices) - quality(vertices)).abs() < 1e-14);
        }
        assert_eq!(Ideal::regular().measure([[0.5; 3]; 4]), 0.0);
    }

    #[test]
    fn similar_shapes_have_the_measure_one_and_stretched_ones_the_closed_form() {
        let ideal = Ideal::shape_of(FLAT);
        let turned = FLAT.map(|[x, y, z]| [3.0 * z + 7.0, 3.0 * x, 3.0 * y]);
        assert!((ideal.measure(turned) - 1.0).abs() < 1e-10, "the flat shape magnifies rounding by its 1000");
        for s in [0.25, 1.0, 4.0, -1.0] {
            // F = diag(1, 1, s): det = s, ‖F‖² = 2 + s².
            let stretched = FLAT.map(|[x, y, z]| [x, y, s * z]);
            let expected = s / ((2.0 + s * s) / 3.0f64).powf(1.5);
            assert!((ideal.measure(stretched) - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn derivatives_by_a_vertex_match_central_differences() {
        let h = 1e-5;
        for ideal in [Ideal::regular(), Ideal::shape_of(REGULAR.map(|[x, y, z]| [x, y + 0.3 * x, 0.2 * z]))] {
            for vertices in [SKEW, inverted(SKEW)] {
                for k in 0..4 {
                    let (m, by_vertex) = ideal.measure_and_gradient(vertices, k);
                    let (v, volume_by_vertex) = ideal.volume_and_gradient(vertices, k);
                    assert_eq!(m, ideal.measure(vertices));
                    for d in 0..3 {
                        let moved = |s: f64| {
                            let mut moved = vertices;
                            moved[k][d] += s;
                            moved
                        };
                        // Truncation h² times third derivatives of order 10, rounding 1e-16 / h.
                        let difference = (ideal.measure(moved(h)) - ideal.measure(moved(-h))) / (2.0 * h);
                        assert!(
                            (difference - by_vertex[d]).abs() < 1e-8,
                            "{difference} against {by_vertex:?}"
                        );
                        // The volume is affine in a vertex: one difference is exact.
                        let difference = ideal.volume_and_gradient(moved(1.0), k).0 - v;
                        assert!((difference - volume_by_vertex[d]).abs() < 1e-12);
                    }
                }
            }
        }
    }
}
