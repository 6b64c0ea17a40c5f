//! Two materials with a plane interface: the coupling of the components on it is what converges here.
//!
//! With `s_x = sin πx`, `c_x = cos πx` and so on, take on each side of z = 1/2
//!
//! `A = (c_x s_y X(z), s_x c_y Y(z), s_x s_y Z(z))`,
//!
//! `X = α sin πz − (πγ + h μ) sin 2πz/(2π)`, `Y = β sin πz − (πγ + k μ) sin 2πz/(2π)`,
//! `Z = γ sin² πz − (π(α+β) + d μ) cos πz/π`, with the relative permeability `μ` of that side.
//!
//! On z = 1/2 all three components are the same from both sides and not zero; `ν(∂_z A_x − ∂_x A_z) = ν0 h c_x s_y`,
//! `ν(∂_z A_y − ∂_y A_z) = ν0 k s_x c_y` and `ν div A = ν0 d s_x s_y` are continuous while every derivative in them
//! jumps. So tangential H and normal B are continuous and the natural condition of the penalty holds. On the outer faces
//! `A_t = 0` and `div A = 0`. The lower side may conduct, with `ψ = q s_x s_y sin(πz/2)`.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{Boundary, FieldModelSetup, Material, Order};

use super::errors::{KnownField, ORDER_OF_A, QUADRATIC_ORDER_OF_A, Sample, assert_orders, setup};
use crate::meshes::{Distortion, unit_cube};

const PI: f64 = std::f64::consts::PI;

/// `α, β, γ` [T m] of the potential on the interface.
const ON_INTERFACE: [c64; 3] = [c64::new(1.0, 0.2), c64::new(-0.6, 0.7), c64::new(0.8, -0.3)];

/// `h, k, d` [T] of the derivatives that are continuous once multiplied by ν.
const ACROSS: [c64; 3] = [c64::new(0.3, -0.1), c64::new(0.2, 0.3), c64::new(-0.25, 0.1)];

/// `q` [T m²].
const Q: c64 = c64::new(0.3, 0.2);

/// Even numbers: a mesh line lies on the interface.
const CELLS: [usize; 3] = [10, 12, 16];

/// Those for quadratic elements.
const COARSE_CELLS: [usize; 3] = [6, 8, 12];

struct Layered {
    /// Of the lower side; the upper has 1.
    relative_permeability: f64,
    frequency: f64,
    penalty: f64,
    order: Order,
}

/// A function of z with its first two derivatives.
type Jet = [c64; 3];

impl Layered {
    fn materials(&self) -> Vec<Material> {
        // ωσμ0 = 5/m²: with μr = 4 a skin depth of a third of the cube.
        let conductivity =
            if self.frequency > 0.0 { 5.0 / (2.0 * PI * self.frequency * VACUUM_PERMEABILITY) } else { 0.0 };
        vec![Material { relative_permeability: self.relative_permeability, conductivity }, Material::AIR]
    }

    /// `X`, `Y`, `Z` with derivatives.
    fn jets(z: f64, mu: f64) -> [Jet; 3] {
        let [alpha, beta, gamma] = ON_INTERFACE;
        let (s, c) = (PI * z).sin_cos();
        let (s2, c2) = (2.0 * PI * z).sin_cos();
        let even = [s, PI * c, -PI * PI * s];
        let odd = [-s2 / (2.0 * PI), -c2, 2.0 * PI * s2];
        let even_z = [s * s, PI * s2, 2.0 * PI * PI * c2];
        let odd_z = [-c / PI, s, PI * c];
        let combine = |p: c64, f: [f64; 3], q: c64, g: [f64; 3]| std::array::from_fn(|i| p * f[i] + q * g[i]);
        [
            combine(alpha, even, PI * gamma + mu * ACROSS[0], odd),
            combine(beta, even, PI * gamma + mu * ACROSS[1], odd),
            combine(gamma, even_z, PI * (alpha + beta) + mu * ACROSS[2], odd_z),
        ]
    }
}

impl KnownField for Layered {
    fn name(&self) -> String {
        let Self { relative_permeability, frequency, penalty, .. } = self;
        format!("two materials 1:{relative_permeability}, {frequency} Hz, p = {penalty}")
    }

    fn at(&self, x: Point, inside: Point) -> Sample {
        let material = self.materials()[usize::from(inside[2] > 0.5)];
        let [big_x, big_y, big_z] = Self::jets(x[2], material.relative_permeability);
        let ((sx, cx), (sy, cy)) = ((PI * x[0]).sin_cos(), (PI * x[1]).sin_cos());
        let shape = [cx * sy, sx * cy, sx * sy];
        let vector_potential = [shape[0] * big_x[0], shape[1] * big_y[0], shape[2] * big_z[0]];
        let flux_density = [
            sx * cy * (PI * big_z[0] - big_y[1]),
            cx * sy * (big_x[1] - PI * big_z[0]),
            cx * cy * PI * (big_y[0] - big_x[0]),
        ];
        let (s_half, c_half) = (0.5 * PI * x[2]).sin_cos();
        let scalar_gradient =
            [PI * shape[0] * s_half, PI * shape[1] * s_half, 0.5 * PI * shape[2] * c_half].map(|g| Q * g);
        // div A = s_x s_y W.
        let w = -PI * (big_x[0] + big_y[0]) + big_z[1];
        let w_slope = -PI * (big_x[1] + big_y[1]) + big_z[2];
        let minus_laplacian = [big_x, big_y, big_z].map(|jet| 2.0 * PI * PI * jet[0] - jet[2]);
        let grad_div = [PI * w, PI * w, w_slope];
        let eddy = c64::new(0.0, 2.0 * PI * self.frequency * material.conductivity);
        let source = std::array::from_fn(|i| {
            let magnetic = shape[i] * (minus_laplacian[i] + (1.0 - self.penalty) * grad_div[i]);
            material.reluctivity() * magnetic + eddy * (vector_potential[i] + scalar_gradient[i])
        });
        Sample { vector_potential, scalar_gradient, flux_density, source }
    }

    fn mesh(&self, n: usize) -> Mesh {
        unit_cube(n, &["lower", "upper"], |centre| u32::from(centre[2] > 0.5))
    }

    fn setup(&self) -> FieldModelSetup {
        let setup = setup(self.frequency, self.penalty, self.materials(), Boundary::FluxParallel);
        FieldModelSetup { order: self.order, ..setup }
    }
}

#[test]
fn fields_converge_across_a_jump_of_the_reluctivity_and_the_face_of_a_conductor() {
    // With the coupling penalty statics has the errors of B of 50 Hz within a per cent.
    for (relative_permeability, frequency, penalty) in [(4.0, 0.0, 1.0), (4.0, 50.0, 1.0), (2.5, 50.0, 0.5)] {
        let field = Layered { relative_permeability, frequency, penalty, order: Order::Linear };
        // A penalty that couples the components reaches the orders later.
        let cells = if penalty == 1.0 { CELLS } else { [12, 16, 22] };
        assert_orders(&field, Distortion::Random, &cells, ORDER_OF_A);
    }
}

#[test]
fn a_large_jump_of_the_reluctivity_delays_the_order_of_the_potential_but_not_of_the_flux_density() {
    // The constant of A's second-order estimate grows with the ratio of the reluctivities: on these meshes the order is
    // still on its way from 1 to 2. That of B, asserted with it, is not touched.
    let field = Layered { relative_permeability: 100.0, frequency: 0.0, penalty: 1.0, order: Order::Linear };
    assert_orders(&field, Distortion::Random, &CELLS, 1.25);
}

#[test]
fn quadratic_elements_gain_an_order_across_a_jump() {
    // In statics the errors of B are the same within a thousandth.
    for penalty in [1.0, 0.5] {
        let order = Order::Quadratic;
        let field = Layered { relative_permeability: 4.0, frequency: 50.0, penalty, order };
        // A penalty that couples the components reaches the order of B later.
        let cells = if penalty == 1.0 { COARSE_CELLS } else { [8, 10, 12] };
        assert_orders(&field, Distortion::Random, &cells, QUADRATIC_ORDER_OF_A);
    }
}
