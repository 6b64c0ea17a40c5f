//! The energy of an element that moves in all directions: density, stress and tangent as pure functions of its deformation.
//!
//! With the deformation gradient `F = 1 + Σ_a u_a ⊗ ∇N_a`, constant on a linear tetrahedron, and `J = det F`, the density is
//!
//! `ψ(F) = ½ (|F|² − 3) − ln_δ J`,
//!
//! neo-Hookean with the barrier of [`crate::barrier`], finite for inverted elements too. It is least, and zero, at rotations; there
//! its tangent is linear elasticity with Poisson's ratio 0. Along one axis it is the energy of rails with `ε = 1`. The stress is
//! `P = F + b' cof F`, with `b(J) = −ln_δ J`. In the frame of the singular values, `F = U diag(σ) Vᵀ`, with `c_i = σ_j σ_k`,
//! the second derivative falls apart in closed form (Smith, de Goes and Kim, Analytic eigensystems for isotropic distortion
//! energies, ACM Trans. Graph. 38, 2019):
//!
//! * the stretches `dF_ii` have the matrix `A_ii = 1 + b'' c_i²`, `A_ij = b'' c_i c_j + b' σ_k`;
//! * the shears `dF_ij`, `dF_ji` of each pair, with the third `k`, have the matrix `[1, β; β, 1]`, `β = −b' σ_k`, with the
//!   eigenvalues `1 ± β`.
//!
//! Squeezed elements have negative ones: they would rather buckle. A direction of descent needs a matrix without them, and that
//! with their absolute values (Chen et al., Stabler neo-Hookean simulation: absolute eigenvalue filtering for projected Newton,
//! SIGGRAPH 2024) takes half of the steps of that with zeros (docs/torture.md).

use fluxmorph_geometry::eigen_decomposition;
use fluxmorph_geometry::fem::LocalMatrix;
use fluxmorph_geometry::tet4::{Point, cross, dot};

use crate::barrier::{Density, logarithm};
use crate::elasticity::Tensor;
use crate::singular_values::SingularValues;

/// `δ`: volume ratio below which the barrier is its Taylor polynomial. That of the least room, [`crate::LEAST_ROOM`]: any smaller
/// one takes more Newton steps where a motion starts with inverted elements (a cylinder shifted and turned: 12 at 0.03, 16 at
/// 0.01, 55 at 0.001) and changes nothing that is carried.
pub(crate) const KNEE: f64 = 0.03;

/// A deformation gradient with what its energy is made from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deformation {
    gradient: Tensor,
    cofactor: Tensor,
    /// `det F`.
    pub(crate) volume: f64,
    barrier: Density,
}

impl Deformation {
    pub(crate) fn new(gradient: Tensor) -> Self {
        let [x, y, z] = gradient;
        let cofactor = [cross(y, z), cross(z, x), cross(x, y)];
        let volume = dot(x, cofactor[0]);
        Self { gradient, cofactor, volume, barrier: logarithm(volume, KNEE) }
    }

    /// `ψ`.
    pub(crate) fn energy(&self) -> f64 {
        let square: f64 = self.gradient.iter().map(|row| dot(*row, *row)).sum();
        0.5 * (square - 3.0) + self.barrier.energy
    }

    /// `P = ∂ψ/∂F`.
    pub(crate) fn stress(&self) -> Tensor {
        let entry = |i: usize, j: usize| self.gradient[i][j] + self.barrier.slope * self.cofactor[i][j];
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }

    /// `cof F = ∂J/∂F`.
    pub(crate) fn cofactor(&self) -> &Tensor {
        &self.cofactor
    }

    /// `|dF F⁻¹|` of a change `dF`: how much it turns and deforms what is there, against volumes of `δ` at least.
    pub(crate) fn relative_change(&self, change: &Tensor) -> f64 {
        let entry = |k: usize| dot(change[k / 3], self.cofactor[k % 3]).powi(2);
        (0..9).map(entry).sum::<f64>().sqrt() / self.volume.abs().max(KNEE)
    }
}

/// Whether a tangent is the second derivative itself, or that with the absolute values of its eigenvalues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Curvature {
    Exact,
    Convex,
}

/// `w ∂²ψ/∂u_a ∂u_b` of the displacements of the four nodes, evaluated block by block.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tangent {
    /// `w [(∇N_a·∇N_b) 1 + b'' c_a ⊗ c_b + b' [F (∇N_a × ∇N_b)]_×]` with `c_a = cof F ∇N_a`.
    Exact {
        gradients: [Point; 4],
        /// `c_a`.
        cofactors: [Point; 4],
        deformation: Tensor,
        /// `w`, `w b'` and `w b''`.
        weights: [f64; 3],
    },
    /// By its eigenvalues, in the frame of the singular values.
    Convex {
        /// `u_k`, the columns of `U`.
        left: [Point; 3],
        /// `Vᵀ ∇N_a`.
        gradients: [Point; 4],
        /// `w |A|`.
        stretches: Tensor,
        /// Diagonal and off-diagonal entry of `w |[1, β; β, 1]|` for the pair without `k`.
        shears: [[f64; 2]; 3],
    },
}

impl Tangent {
    pub(crate) fn new(
        deformation: &Deformation,
        gradients: &[Point; 4],
        weight: f64,
        curvature: Curvature,
    ) -> Self {
        let Density { slope, curvature: bend, .. } = deformation.barrier;
        if curvature == Curvature::Exact {
            return Self::Exact {
                gradients: *gradients,
                cofactors: gradients.map(|g| deformation.cofactor.map(|row| dot(row, g))),
                deformation: deformation.gradient,
                weights: [weight, weight * slope, weight * bend],
            };
        }
        let SingularValues { left, values: s, right } = SingularValues::of(&deformation.gradient);
        let c = [s[1] * s[2], s[2] * s[0], s[0] * s[1]];
        let entry = |i: usize, j: usize| bend * c[i] * c[j] + if i == j { 1.0 } else { slope * s[3 - i - j] };
        let stretches = absolute(std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))));
        let shears = s.map(|s| {
            let [even, odd] = [1.0 - slope * s, 1.0 + slope * s].map(f64::abs);
            [0.5 * (even + odd), 0.5 * (even - odd)]
        });
        Self::Convex {
            left,
            gradients: gradients.map(|g| right.map(|v| dot(v, g))),
            stretches: stretches.map(|row| row.map(|x| weight * x)),
            shears: shears.map(|pair| pair.map(|x| weight * x)),
        }
    }
}

/// A symmetric matrix with the absolute values of its eigenvalues.
fn absolute(matrix: Tensor) -> Tensor {
    let (values, axes) = eigen_decomposition(matrix);
    let entry = |i: usize, j: usize| (0..3).map(|k| values[k].abs() * axes[k][i] * axes[k][j]).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

impl LocalMatrix<f64, 4, 3> for Tangent {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[f64; 3]; 3] {
        match self {
            Self::Exact { gradients, cofactors, deformation, weights: [one, slope, bend] } => {
                let [x, y, z] = {
                    let normal = cross(gradients[a], gradients[b]);
                    deformation.map(|row| slope * dot(row, normal))
                };
                let turn = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
                let own = one * dot(gradients[a], gradients[b]);
                let (ca, cb) = (cofactors[a], cofactors[b]);
                std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        bend * ca[i] * cb[j] + turn[i][j] + if i == j { own } else { 0.0 }
                    })
                })
            }
            Self::Convex { left, gradients, stretches, shears } => {
                convex_block((gradients[a], gradients[b]), stretches, shears, left)
            }
        }
    }
}

fn convex_block(
    (ga, gb): (Point, Point),
    stretches: &Tensor,
    shears: &[[f64; 2]; 3],
    left: &[Point; 3],
) -> [[f64; 3]; 3] {
    let along = |i: usize| {
        let [j, k] = [(i + 1) % 3, (i + 2) % 3];
        stretches[i][i] * ga[i] * gb[i] + shears[k][0] * ga[j] * gb[j] + shears[j][0] * ga[k] * gb[k]
    };
    let across = |i: usize, j: usize| stretches[i][j] * ga[i] * gb[j] + shears[3 - i - j][1] * ga[j] * gb[i];
    let own: Tensor =
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { along(i) } else { across(i, j) }));
    // U own Uᵀ.
    let half: Tensor = own.map(|row| std::array::from_fn(|d| (0..3).map(|j| row[j] * left[j][d]).sum()));
    std::array::from_fn(|c| std::array::from_fn(|d| (0..3).map(|i| left[i][c] * half[i][d]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::{ISOTROPIC, Isotropic, stiffness};
    use fluxmorph_geometry::tet4::Tet4;

    const SKEW: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];

    /// Stretched, squeezed, below the knee, inverted, turned by half a turn and squeezed.
    const DEFORMED: [Tensor; 5] = [
        [[1.4, 0.3, -0.2], [0.1, 1.2, 0.4], [-0.3, 0.2, 1.1]],
        [[0.4, 0.3, -0.2], [0.1, 0.5, 0.2], [-0.3, 0.2, 0.6]],
        [[0.2, 0.1, 0.0], [0.0, 0.3, 0.1], [0.1, 0.0, 0.2]],
        [[0.7, 0.3, -0.2], [0.1, 0.8, 0.2], [-0.3, 0.2, -0.4]],
        [[-0.8, 0.1, 0.0], [0.0, -0.5, 0.1], [0.2, 0.0, 0.9]],
    ];

    fn full(tangent: &impl LocalMatrix<f64, 4, 3>) -> [[f64; 12]; 12] {
        std::array::from_fn(|r| std::array::from_fn(|c| tangent.block(r / 3, c / 3)[r % 3][c % 3]))
    }

    /// `F` after a displacement of one node along one direction.
    fn shifted(f: &Tensor, tet: &Tet4, unknown: usize, h: f64) -> Deformation {
        let mut f = *f;
        for (entry, gradient) in f[unknown % 3].iter_mut().zip(tet.gradients[unknown / 3]) {
            *entry += h * gradient;
        }
        Deformation::new(f)
    }

    #[test]
    fn stress_and_tangent_are_derivatives_of_the_energy() {
        let tet = Tet4::new(SKEW);
        let force = |d: &Deformation| -> [f64; 12] {
            let stress = d.stress();
            std::array::from_fn(|r| dot(stress[r % 3], tet.gradients[r / 3]))
        };
        for f in DEFORMED {
            let at = Deformation::new(f);
            let tangent = full(&Tangent::new(&at, &tet.gradients, 1.0, Curvature::Exact));
            let size = tangent.iter().flatten().fold(1.0, |m: f64, x| m.max(x.abs()));
            let h = 1e-6;
            for r in 0..12 {
                let [low, high] = [-h, h].map(|h| shifted(&f, &tet, r, h));
                // Truncation of h² and rounding over h, both in the size of the second derivatives.
                let slope = (high.energy() - low.energy()) / (2.0 * h);
                assert!((slope - force(&at)[r]).abs() < 1e-7 * size, "{f:?}");
                for (c, (high, low)) in force(&high).iter().zip(force(&low)).enumerate() {
                    let difference = (high - low) / (2.0 * h);
                    assert!((difference - tangent[r][c]).abs() < 1e-6 * size, "{f:?}: ({r}, {c})");
                }
            }
        }
    }

    #[test]
    fn at_rest_there_is_no_stress_and_the_tangent_is_linear_elasticity() {
        let (tet, rest) = (Tet4::new(SKEW), Deformation::new(ISOTROPIC));
        assert_eq!((rest.energy(), rest.stress()), (0.0, [[0.0; 3]; 3]));
        let tangent = full(&Tangent::new(&rest, &tet.gradients, tet.volume, Curvature::Exact));
        let linear = full(&stiffness(&tet, &Isotropic { young: 2.0, poisson: 0.0 }, &ISOTROPIC));
        for (r, c) in (0..144).map(|k| (k / 12, k % 12)) {
            assert!((tangent[r][c] - linear[r][c]).abs() < 1e-14);
        }
    }

    /// The square of `|H|` is that of `H`, and no form of it is negative.
    #[test]
    fn the_convex_tangent_is_the_absolute_value_of_the_exact_one() {
        // One tetrahedron with orthonormal gradients of three nodes: the matrix of `dF` itself.
        let gradients = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        for f in DEFORMED {
            let of = |curvature| full(&Tangent::new(&Deformation::new(f), &gradients, 1.0, curvature));
            let (exact, convex) = (of(Curvature::Exact), of(Curvature::Convex));
            let size = convex.iter().flatten().fold(1.0, |m: f64, x| m.max(x.abs()));
            let square =
                |m: &[[f64; 12]; 12], r: usize, c: usize| (0..12).map(|k| m[r][k] * m[k][c]).sum::<f64>();
            for (r, c) in (0..144).map(|k| (k / 12, k % 12)) {
                assert!((square(&exact, r, c) - square(&convex, r, c)).abs() < 1e-12 * size * size, "{f:?}");
            }
            for k in 0..50 {
                let x: [f64; 12] = std::array::from_fn(|i| ((13 * i + 7 * k) as f64).sin());
                let form: f64 = (0..144).map(|k| x[k / 12] * convex[k / 12][k % 12] * x[k % 12]).sum();
                assert!(form > -1e-12 * size, "{f:?}");
            }
        }
    }

    #[test]
    fn a_rotation_costs_nothing_and_is_no_relative_change_of_its_own() {
        let turned = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let at = Deformation::new(turned);
        assert_eq!((at.energy(), at.volume), (0.0, 1.0));
        // A spin by one per cent, whatever the place it starts from.
        let spin = [[-0.01, 0.0, 0.0], [0.0, -0.01, 0.0], [0.0, 0.0, 0.0]];
        assert!((at.relative_change(&spin) - 0.01 * 2f64.sqrt()).abs() < 1e-15);
    }
}
