//! A smooth field in one material on the unit cube.
//!
//! With `Φ = Π_d sin πx_d` (flux-parallel faces) or `Φ = Π_d cos πx_d` (flux-normal ones) take `A_i = k_i ∂_iΦ/π` and
//! `ψ = q (Φ − Φ(0))`. Then `div A = −π Σk Φ`, `−ΔA = 3π² A`, and all conditions hold: on flux-parallel faces
//! `A_t = 0`, `ψ = 0` and `div A = 0`; on flux-normal ones `A_n = 0`, `n × curl A = 0` and `∂ψ/∂n = 0`.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::element::Complex3;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{Boundary, ElementFamily, FieldModelSetup, Material, Order};

use super::errors::{
    ANY_ORDER_OF_A, KnownField, ORDER_OF_A, QUADRATIC_ORDER_OF_A, Sample, Turned, assert_orders, errors_on,
    setup,
};
use crate::meshes::{Distortion, unit_cube};

const PI: f64 = std::f64::consts::PI;

/// `k_i` [T m²]: different, so that curl and divergence are there.
const K: [c64; 3] = [c64::new(1.0, 0.3), c64::new(-0.4, 0.8), c64::new(0.6, -0.5)];

/// `q` [T m²].
const Q: c64 = c64::new(0.2, -0.4);

const CELLS: [usize; 3] = [8, 10, 14];

/// Those for quadratic elements.
const COARSE_CELLS: [usize; 3] = [6, 8, 10];

struct Smooth {
    faces: Boundary,
    frequency: f64,
    /// Zero for edge elements, which have none.
    penalty: f64,
    order: Order,
}

impl Smooth {
    /// `ωσμ = 10/m²` at 50 Hz: a skin depth of 0.45 m.
    fn material(&self) -> Material {
        let conductivity =
            if self.frequency > 0.0 { 10.0 / (2.0 * PI * self.frequency * VACUUM_PERMEABILITY) } else { 0.0 };
        Material { relative_permeability: 1.0, conductivity }
    }
}

impl KnownField for Smooth {
    fn name(&self) -> String {
        let Self { faces, frequency, penalty, .. } = self;
        format!("smooth, {faces:?}, {frequency} Hz, p = {penalty}")
    }

    fn at(&self, x: Point, _: Point) -> Sample {
        let (value, slope): ([f64; 3], [f64; 3]) = match self.faces {
            Boundary::FluxParallel => (x.map(|t| (PI * t).sin()), x.map(|t| PI * (PI * t).cos())),
            _ => (x.map(|t| (PI * t).cos()), x.map(|t| -PI * (PI * t).sin())),
        };
        let gradient: Point =
            std::array::from_fn(|i| (0..3).map(|d| if d == i { slope[d] } else { value[d] }).product());
        let vector_potential: Complex3 = std::array::from_fn(|i| K[i] * (gradient[i] / PI));
        let scalar_gradient: Complex3 = gradient.map(|g| Q * g);
        // (curl A)_i = (k_k − k_j) ∂_j∂_kΦ/π for i, j, k in cyclic order.
        let flux_density = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            (K[k] - K[j]) * (value[i] * slope[j] * slope[k] / PI)
        });
        // curl curl A − p grad div A = −ΔA + (1 − p) grad div A.
        let material = self.material();
        let eddy = c64::new(0.0, 2.0 * PI * self.frequency * material.conductivity);
        let sum: c64 = K.iter().sum();
        let source = std::array::from_fn(|i| {
            let magnetic =
                3.0 * PI * PI * vector_potential[i] - (1.0 - self.penalty) * PI * sum * gradient[i];
            material.reluctivity() * magnetic + eddy * (vector_potential[i] + scalar_gradient[i])
        });
        Sample { vector_potential, scalar_gradient, flux_density, source }
    }

    fn mesh(&self, n: usize) -> Mesh {
        unit_cube(n, &["all"], |_| 0)
    }

    fn setup(&self) -> FieldModelSetup {
        let (family, penalty) = match self.penalty {
            0.0 => (ElementFamily::Edge, 1.0),
            penalty => (ElementFamily::Nodal, penalty),
        };
        let setup = setup(self.frequency, penalty, vec![self.material()], self.faces);
        FieldModelSetup { family, order: self.order, ..setup }
    }
}

#[test]
fn smooth_fields_converge_between_faces_of_either_kind_whatever_the_penalty() {
    use Boundary::{FluxNormal, FluxParallel};
    for (faces, frequency, penalty) in [
        (FluxParallel, 0.0, 1.0),
        (FluxParallel, 50.0, 1.0),
        // All components are coupled.
        (FluxParallel, 0.0, 0.5),
        (FluxParallel, 50.0, 0.5),
        (FluxNormal, 0.0, 1.0),
        // The scalar potential is grounded in one node.
        (FluxNormal, 50.0, 1.0),
    ] {
        let field = Smooth { faces, frequency, penalty, order: Order::Linear };
        assert_orders(&field, Distortion::Random, &CELLS, ORDER_OF_A);
    }
}

#[test]
fn recovered_flux_density_converges_faster_than_its_elements_on_a_smooth_mesh() {
    let field = Smooth { faces: Boundary::FluxParallel, frequency: 50.0, penalty: 1.0, order: Order::Linear };
    // Second order, with a margin for fits that reach over two or three of a dozen cells.
    let order = assert_orders(&field, Distortion::Smooth, &CELLS, ORDER_OF_A);
    assert!(order >= 1.7, "{order}");
}

#[test]
fn quadratic_elements_gain_an_order() {
    for (faces, frequency, penalty) in [
        (Boundary::FluxParallel, 0.0, 1.0),
        (Boundary::FluxParallel, 50.0, 1.0),
        (Boundary::FluxNormal, 50.0, 1.0),
        (Boundary::FluxParallel, 50.0, 0.5),
    ] {
        let field = Smooth { faces, frequency, penalty, order: Order::Quadratic };
        // Grounded in one node, the scalar potential reaches its order later.
        let cells = if faces == Boundary::FluxNormal { [6, 8, 12] } else { COARSE_CELLS };
        assert_orders(&field, Distortion::Random, &cells, QUADRATIC_ORDER_OF_A);
    }
}

/// `A` is one field of many in statics, so that only `B` and `A + ∇ψ` have orders.
#[test]
fn edge_elements_converge_between_faces_of_either_kind() {
    use Boundary::{FluxNormal, FluxParallel};
    for (order, faces, frequency, cells) in [
        // Errors of B do not feel the frequency here: each once.
        (Order::Linear, FluxParallel, 0.0, CELLS),
        (Order::Linear, FluxNormal, 50.0, CELLS),
        // Between flux-parallel faces the order is there at once.
        (Order::Quadratic, FluxParallel, 0.0, [4, 6, 8]),
        (Order::Quadratic, FluxNormal, 50.0, COARSE_CELLS),
    ] {
        let field = Smooth { faces, frequency, penalty: 0.0, order };
        assert_orders(&field, Distortion::Random, &cells, ANY_ORDER_OF_A);
    }
}

/// Conditions on oblique planes use directions of their own at every node; the discrete problem is the same one turned
/// in space, so the errors agree up to the solver's residual.
#[test]
fn conditions_on_oblique_planes_are_those_of_the_axes_turned() {
    fn compare(field: impl KnownField, turned: impl KnownField) {
        let straight = errors_on(&field, &Distortion::Random.apply(&field.mesh(6), 6));
        let oblique = errors_on(&turned, &turned.mesh(6));
        println!("{}: {straight:?} {oblique:?}", turned.name());
        for (a, b) in straight.iter().zip(oblique) {
            // Static problems have no A + grad psi.
            assert!((a - b).abs() <= 1e-9 * a || a.is_nan(), "{a} {b}");
        }
    }
    for faces in [Boundary::FluxParallel, Boundary::FluxNormal] {
        for (frequency, penalty) in [(0.0, 1.0), (50.0, 1.0), (50.0, 0.5)] {
            for order in [Order::Linear, Order::Quadratic] {
                let field = || Smooth { faces, frequency, penalty, order };
                compare(field(), Turned(field()));
            }
        }
    }
}
