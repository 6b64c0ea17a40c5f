//! How the stiffness of an element follows its size.
//!
//! In a stack of layers under one tension the strain of a layer is inverse to its stiffness. With one `E` all layers
//! stretch alike and a thin skin is lost; with `E ∝ 1/h`, `h` the layer's thickness, its change of thickness goes
//! with `h²`, and the thick layers take up the motion. Where layers cross, as under the free sides of a plate, one
//! modulus cannot serve both directions: the directional policy gives each principal direction of the element its own.
//!
//! Principal directions `n_i` and sizes `h_i` [m] are those of the covariance `C` of the four vertices, `h_i²` its
//! eigenvalues; `h = (h_1 h_2 h_3)^{1/3}` is the mean size, and `h̄` its geometric mean over the region. The weight of a
//! direction is `w_i = (h̄ / h)² (h̄ / h_i)^{1/2}`: the first factor is one on Young's modulus, the second a law with
//! directions, [`crate::elasticity`], with the tensor `T = Σ (h̄ / h_i)^{1/4} n_i n_iᵀ`.

use fluxmorph_geometry::eigen_decomposition;
use fluxmorph_geometry::fem::scalar::ordered_sum;
use fluxmorph_geometry::tet4::{self, FACES, Point, centroid, sub};
use fluxmorph_geometry::{ElementId, Mesh};

use crate::elasticity::{ISOTROPIC, Tensor};

/// Exponents of the directional weights: of the size along the direction, and of the element's mean size.
///
/// Found by measurement on the shield's skin layers (`tests/skin.rs`), which cross under the plate's sides, at `ν` of 0,
/// 0.2 and 0.3. With the first alone, one modulus per direction in the proportion of the sizes, the small cells where
/// layers cross are too soft as a whole, and the air beside the plate inverts at 0.99 to 1.06 of the motion to 30 mm
/// (exponent 1) or at 0.86 (exponent 2, ν = 0.3). These two keep clear of inversion at all three ratios (1.11 at the
/// least) and keep two layers.
const ALONG: f64 = 0.5;
const MEAN: f64 = 2.0;

/// How the stiffness of an element follows its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum StiffnessPolicy {
    /// `E` as given.
    Uniform,
    /// `E ∝ 1/h`, `h` the smallest altitude of the element (see [`smallest_altitude`] for why). The default: the most
    /// tolerant of Poisson's ratio.
    #[default]
    InverseSize,
    /// `E ∝ 1/V`. Protects layers that cross better than the size does, but wants `ν ≤ 0.2`: at 0.3 the sideways
    /// contraction of long thin cells inverts some of them.
    InverseVolume,
    /// Orthotropic: `E ∝ 1/h²`, `h` the mean size of the element, times `1/√h_i` along each of its principal directions.
    /// Keeps two layers of a skin also where layers cross, at any usual Poisson's ratio.
    Directional,
}

/// A policy on one mesh: what it needs to know of the whole region.
#[derive(Clone, Copy, Debug)]
pub struct Weighting {
    policy: StiffnessPolicy,
    /// The size [m] (or volume [m³]) whose weight is 1: the geometric mean over the region.
    reference: f64,
}

impl StiffnessPolicy {
    /// Every policy.
    pub const ALL: [Self; 4] = [Self::Uniform, Self::InverseSize, Self::InverseVolume, Self::Directional];

    /// Its name in messages and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::InverseSize => "inverse_size",
            Self::InverseVolume => "inverse_volume",
            Self::Directional => "directional",
        }
    }

    /// The policy on the elements of a region. The geometric mean of all weights is 1, so that `f / E` keeps its meaning
    /// from policy to policy.
    pub fn weighting(self, mesh: &Mesh, elements: &[ElementId]) -> Weighting {
        let mean_log = ordered_sum(elements.len(), |i| self.size(mesh.vertices(elements[i])).ln())
            / elements.len().max(1) as f64;
        Weighting { policy: self, reference: mean_log.exp() }
    }

    /// What the weight is inverse to; the geometric mean of the principal sizes for the directional policy.
    fn size(self, vertices: [Point; 4]) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::InverseSize => smallest_altitude(vertices),
            Self::InverseVolume => tet4::volume(vertices),
            // h³ = √det C = 3/8 V: affine in the volume, and 1 for the regular tetrahedron of volume 8/3 with C = 1.
            Self::Directional => (3.0 / 8.0 * tet4::volume(vertices)).cbrt(),
        }
    }
}

impl Weighting {
    /// Factor on Young's modulus of an element, and the tensor `T` of its law.
    pub fn of(&self, vertices: [Point; 4]) -> (f64, Tensor) {
        match self.policy {
            StiffnessPolicy::Directional => {
                let mean = StiffnessPolicy::Directional.size(vertices);
                ((self.reference / mean).powf(MEAN), self.directional(vertices))
            }
            policy => (self.reference / policy.size(vertices), ISOTROPIC),
        }
    }

    /// `T = Σ (h̄ / h_i)^{1/4} n_i n_iᵀ`: the square roots of the weights.
    fn directional(&self, vertices: [Point; 4]) -> Tensor {
        let mut tensor = [[0.0; 3]; 3];
        for (size, n) in principal_axes(vertices) {
            let weight = (self.reference / size).powf(0.5 * ALONG);
            for i in 0..3 {
                for j in 0..3 {
                    tensor[i][j] += weight * n[i] * n[j];
                }
            }
        }
        tensor
    }
}

/// Principal sizes [m] and unit directions of an element: the square roots of the eigenvalues of its
/// vertices' covariance `¼ Σ (x_a − x̄)(x_a − x̄)ᵀ`, and the eigenvectors.
pub fn principal_axes(vertices: [Point; 4]) -> [(f64, Point); 3] {
    let centre = centroid(vertices);
    let arms = vertices.map(|x| sub(x, centre));
    // Scaled to order one, so that no element is too small for the decomposition.
    let scale = arms.iter().flatten().fold(0.0f64, |m, c| m.max(c.abs()));
    let product = |i: usize, j: usize| arms.iter().map(|r| r[i] / scale * (r[j] / scale)).sum::<f64>() / 4.0;
    let covariance = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)));
    let (squares, axes) = eigen_decomposition(covariance);
    // Of an element as flat as numbers can tell, the least eigenvalue is rounding and may be negative.
    let size = |k: usize| scale * squares[k].max(f64::EPSILON).sqrt();
    std::array::from_fn(|k| (size(k), axes[k]))
}

/// Smallest altitude [m] of a tetrahedron: `3 V` over the area of its largest face.
///
/// The size of an element for [`StiffnessPolicy::InverseSize`]: in a thin layer it is the layer's thickness, whatever
/// its width, so that the strain of a stack is shared out as the module doc says. `V^(1/3)` sees a 0.4 mm layer of
/// 20 mm cells as 3 mm thick and lets it stretch accordingly. Where layers cross, as under the free sides of a plate, the
/// altitude cannot tell the two directions apart; the volume can, since it is their product (`tests/skin.rs` holds
/// the policies against each other).
pub fn smallest_altitude(vertices: [Point; 4]) -> f64 {
    let largest =
        FACES.iter().map(|face| tet4::norm(tet4::area_vector(face.map(|v| vertices[v])))).fold(0.0, f64::max);
    3.0 * tet4::volume(vertices) / largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::generate::{BlockParameters, block};

    /// The regular tetrahedron in the corners of a cube, stretched along three oblique axes.
    #[test]
    fn principal_axes_are_those_of_a_stretched_regular_tetrahedron() {
        let axes = [[2.0, 3.0, 6.0], [3.0, -6.0, 2.0], [6.0, 2.0, -3.0]].map(|n: Point| n.map(|c| c / 7.0));
        let sizes = [1e-4, 3e-3, 2e-2];
        let corners = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let vertices = corners.map(|c: Point| {
            std::array::from_fn(|d| 0.3 + (0..3).map(|k| sizes[k] * c[k] * axes[k][d]).sum::<f64>())
        });
        let mut found = principal_axes(vertices);
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (k, (size, direction)) in found.into_iter().enumerate() {
            // The least eigenvalue is (1/200)² of the largest and carries the rounding of the vertices' places.
            assert!((size / sizes[k] - 1.0).abs() < 1e-9, "{size}");
            assert!((tet4::dot(direction, axes[k]).abs() - 1.0).abs() < 1e-12);
        }
        let mean = sizes.iter().product::<f64>().cbrt();
        assert!((StiffnessPolicy::Directional.size(vertices) / mean - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_geometric_mean_of_all_weights_is_one() {
        let size = [1.0, 2.0, 0.1];
        let mesh = block(&BlockParameters { size, cells: [3, 4, 2] }).expect("a block");
        let elements: Vec<ElementId> = mesh.topology().elements().collect();
        for policy in StiffnessPolicy::ALL {
            let weighting = policy.weighting(&mesh, &elements);
            let log = |&e: &ElementId| {
                let (factor, t) = weighting.of(mesh.vertices(e));
                // det T is the product of the square roots of the three weights.
                factor.ln() + 2.0 / 3.0 * tet4::dot(t[0], tet4::cross(t[1], t[2])).ln()
            };
            let mean = elements.iter().map(log).sum::<f64>() / elements.len() as f64;
            assert!(mean.abs() < 1e-12, "{policy:?}: {mean:e}");
        }
    }

    #[test]
    fn the_directional_law_is_stiffest_across_a_thin_layer() {
        let size = [0.02, 0.02, 4e-4];
        let mesh = block(&BlockParameters { size, cells: [1, 1, 1] }).expect("a block");
        let elements: Vec<ElementId> = mesh.topology().elements().collect();
        let weighting = StiffnessPolicy::Directional.weighting(&mesh, &elements);
        for &e in &elements {
            let (_, t) = weighting.of(mesh.vertices(e));
            // A fiftieth of the size is 50^(1/4) = 2.7 times the tensor; the axes of a corner cell are turned a little.
            assert!(t[2][2] > 2.0 * t[0][0] && t[2][2] > 2.0 * t[1][1], "{t:?}");
            assert!((0..3).all(|i| (0..3).all(|j| (t[i][j] - t[j][i]).abs() < 1e-15)));
        }
    }

    #[test]
    fn a_flat_element_has_finite_sizes() {
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert!(principal_axes(flat).iter().all(|(size, n)| *size > 0.0 && n.iter().all(|c| c.is_finite())));
    }

    #[test]
    fn the_smallest_altitude_of_a_flat_layer_is_its_thickness() {
        let layer = |t: f64| [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, t]];
        assert!((smallest_altitude(layer(1e-3)) / 1e-3 - 1.0).abs() < 1e-5);
        assert!((smallest_altitude(layer(1.0)) - 1.0 / 3f64.sqrt()).abs() < 1e-15);
    }
}
