//! A saturating spheroid in a uniform field: its inner field is uniform whatever the law, and follows from a scalar equation.
//!
//! With the demagnetising factor `N` along the field `B_0`, and the dipole mirrored on the outer sphere of radius `R` where `A`
//! is prescribed (as of the linear spheres): `N B + (1 − N) μ0 h(B) + κ (B − μ0 h(B)) = B_0`, `κ = (2/3) a² c/R³`. With the
//! aspect ratio `c/a = 1 + ε` at constant volume `N = 1/3 − (4/15) ε` (Osborn, Phys. Rev. 67 (1945) 351, has `N` of any aspect),
//! which gives the exact derivative of the inner field, and of the energy `V w(B)`, by `ε`.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::generate::sphere;
use fluxmorph_geometry::tet4::{Point, norm, volume};
use fluxmorph_solver::linear::PreparedSystem;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{
    BhCurve, Boundary, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Functional, Order,
    UniformField, adjoint,
};

use super::sphere::{BOX, coarse, setup};
use crate::orders::Study;

/// Radius of the sphere [m].
const RADIUS: f64 = 0.05;

/// A law of points that saturates at 2 T, with an initial permeability of 1600.
fn law() -> BhCurve {
    let point = |i: i32| {
        let h = 30.0 * (1.25_f64.powi(i) - 1.0);
        [h, VACUUM_PERMEABILITY * h + 2.0 * (1.0 - (-h / 1000.0).exp())]
    };
    BhCurve::new(&(0..45).map(point).collect::<Vec<_>>()).expect("a sound table")
}

/// The spheroid of an aspect ratio `c/a` and the sphere's volume in an applied field [T].
struct Exact {
    flux_density: f64,
    /// By `ε` at `c/a = 1` [T].
    by_aspect: f64,
}

impl Exact {
    fn new(curve: &BhCurve, aspect: f64, applied: f64) -> Self {
        let factor = demagnetising_factor(aspect);
        let kappa = 2.0 / 3.0 / BOX.powi(3);
        let mu = VACUUM_PERMEABILITY;
        let excess = |b: f64| {
            let h = curve.at(b).field_strength;
            factor * b + (1.0 - factor) * mu * h + kappa * (b - mu * h) - applied
        };
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
        let at = curve.at(high);
        let tangent = factor + (1.0 - factor) * mu * at.slope + kappa * (1.0 - mu * at.slope);
        let by_aspect = 4.0 / 15.0 * (high - mu * at.field_strength) / tangent;
        Self { flux_density: high, by_aspect }
    }
}

/// Along the axis of a spheroid with the aspect ratio `m = c/a ≥ 1` (Osborn 1945).
fn demagnetising_factor(m: f64) -> f64 {
    if m == 1.0 {
        return 1.0 / 3.0;
    }
    let root = (m * m - 1.0).sqrt();
    ((m / root) * (m + root).ln() - 1.0) / (m * m - 1.0)
}

/// How far a stretch of the inside reaches: the whole of it, falling to none at the outer sphere.
fn share(x: Point) -> f64 {
    let r = norm(x);
    if r <= RADIUS { 1.0 } else { (BOX * RADIUS / r - 1.0) / (BOX - 1.0) }
}

/// The sphere stretched along z to an aspect ratio at constant volume.
fn stretched(mesh: &Mesh, aspect: f64) -> Mesh {
    let [across, along] = [aspect.powf(-1.0 / 3.0), aspect.powf(2.0 / 3.0)];
    let to = |x: &Point| -> Point {
        std::array::from_fn(|d| x[d] * (1.0 + share(*x) * (if d == 2 { along } else { across } - 1.0)))
    };
    Mesh::new(Arc::clone(mesh.topology()), mesh.points().iter().map(to).collect()).expect("a mesh")
}

fn model(mesh: &Mesh, (family, order): (ElementFamily, Order), curve: &BhCurve, applied: f64) -> FieldModel {
    let linear = fluxmorph_solver::Material { relative_permeability: 1600.0, conductivity: 0.0 };
    let mut setup = FieldModelSetup { family, ..setup(mesh, 0.0, linear, order) };
    let has_law = |name: &String| (name == "sphere").then(|| Arc::new(curve.clone()));
    setup.bh = mesh.topology().region_names().iter().map(has_law).collect();
    setup.boundaries.retain(|(name, _)| name != "outer");
    let applied = UniformField { flux_density: [0.0, 0.0, applied], centre: None };
    setup.boundaries.push(("outer".to_owned(), Boundary::UniformField(applied)));
    FieldModel::new(mesh, setup).expect("a sound problem")
}

/// Mean and root mean square deviation of `B` in the iron from the exact field, relative to it.
fn errors(model: &FieldModel, mesh: &Mesh, solution: &FieldSolution, exact: f64) -> [f64; 2] {
    let mut sums = [0.0; 3];
    for &e in model.elements_with_a_law() {
        let (v, b) = (volume(mesh.vertices(e)), solution.flux_density(model, mesh, e));
        let off = b[0].norm_sqr() + b[1].norm_sqr() + (b[2] - exact).norm_sqr();
        sums = [sums[0] + v, sums[1] + v * b[2].re, sums[2] + v * off];
    }
    [(sums[1] / sums[0] / exact - 1.0).abs(), (sums[2] / sums[0]).sqrt() / exact]
}

/// Below the knee, beyond it, and deep in saturation [T].
const APPLIED: [f64; 3] = [0.3, 0.6, 0.8];

const LINEAR: (ElementFamily, Order) = (ElementFamily::Edge, Order::Linear);
const QUADRATIC: (ElementFamily, Order) = (ElementFamily::Edge, Order::Quadratic);
const NODAL: (ElementFamily, Order) = (ElementFamily::Nodal, Order::Quadratic);

/// Aspect ratio and applied field [T].
type Case = (f64, f64);

/// Elements, the refinement of the mesh that they are solved on, and cases: first order takes smaller cells, and one field tells
/// what second order does.
type Cases<'a> = [((ElementFamily, Order), f64, &'a [Case]); 3];

/// Both aspect ratios on linear elements, beyond the knee, and the derivative on all elements.
const SOME: Cases<'_> = [
    (LINEAR, 2.0, &[(1.0, APPLIED[2]), (1.5, APPLIED[1])]),
    (QUADRATIC, 1.0, &[(1.0, APPLIED[1])]),
    (NODAL, 1.0, &[(1.0, APPLIED[1])]),
];

const OTHERS: Cases<'_> = [
    (LINEAR, 2.0, &[(1.0, APPLIED[0]), (1.0, APPLIED[1]), (1.5, APPLIED[0]), (1.5, APPLIED[2])]),
    (QUADRATIC, 4.0 / 3.0, &[(1.5, APPLIED[1])]),
    (NODAL, 4.0 / 3.0, &[(1.5, APPLIED[1])]),
];

/// The derivative [J] of the energy in the iron by `ε` on a mesh of the sphere.
fn energy_by_aspect(
    mesh: &Mesh,
    model: &FieldModel,
    solution: &FieldSolution,
    system: &mut PreparedSystem,
) -> f64 {
    let region = mesh.topology().region("sphere").expect("the generator makes it");
    let energy = Functional::energy(model, Some(region)).expect("it has elements");
    let value = energy.evaluate((model, mesh, solution)).expect("finite");
    let lambda = adjoint::solve(system, &value.derivative).expect("it converges");
    let moving: Vec<_> = mesh.topology().elements().collect();
    let implicit = adjoint::node_gradient((model, mesh, solution), &lambda, &moving).expect("one process");
    let explicit = value.explicit.expect("an energy of a region that moves");
    let along = |(x, (i, f)): (&Point, (&Point, &Point))| -> f64 {
        let rate = |d: usize| share(*x) * x[d] * if d == 2 { 2.0 / 3.0 } else { -1.0 / 3.0 };
        (0..3).map(|d| rate(d) * (i[d] + f[d])).sum()
    };
    8.0 * mesh.points().iter().zip(implicit.iter().zip(&explicit)).map(along).sum::<f64>()
}

/// And the energy of the sphere changes with its aspect ratio as the same equation says.
#[test]
fn the_inner_field_of_a_saturated_spheroid_solves_a_scalar_equation() {
    inner_field_solves_the_equation(SOME);
}

#[test]
#[ignore = "six more saturated fields, half a minute"]
fn so_it_does_in_every_field_at_every_aspect_ratio() {
    inner_field_solves_the_equation(OTHERS);
}

fn inner_field_solves_the_equation(study: Cases<'_>) {
    let curve = law();
    let volume = 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    for (elements, refinement, cases) in study {
        let ball = sphere(&coarse(RADIUS, refinement)).expect("a sound sphere");
        for &(aspect, applied) in cases {
            let mesh = stretched(&ball, aspect);
            let exact = Exact::new(&curve, aspect, applied);
            let model = model(&mesh, elements, &curve, applied);
            let (solution, mut system) = model.solve(&mesh).expect("it converges");
            let [mean, rms] = errors(&model, &mesh, &solution, exact.flux_density);
            println!(
                "{elements:?}, c/a = {aspect}, {applied} T: {:.4} T inside, mean off by {:.3} %, rms {:.2} %, {} steps",
                exact.flux_density,
                100.0 * mean,
                100.0 * rms,
                solution.newton_steps()
            );
            assert!(mean < 0.01, "{elements:?}, {aspect}, {applied} T: {mean}");
            if aspect == 1.0 {
                let by_aspect = volume * curve.at(exact.flux_density).field_strength * exact.by_aspect;
                let found = energy_by_aspect(&mesh, &model, &solution, &mut system);
                let error = found / by_aspect - 1.0;
                println!("  {found:.5e} J, exact {by_aspect:.5e} J, {:+.2} %", 100.0 * error);
                assert!(error.abs() < 0.03, "{elements:?}, {applied} T: {found} against {by_aspect}");
            }
        }
    }
}

/// Facets leave out a volume of second order, and linear elements have a field of first order between them.
#[test]
fn the_mean_inner_field_converges_with_second_order() {
    let curve = law();
    let exact = Exact::new(&curve, 1.0, APPLIED[1]).flux_density;
    let mut study = Study::new("saturated sphere, linear edge elements: mean B");
    for refinement in [0.5, 1.0, 2.0] {
        let mesh = sphere(&coarse(RADIUS, refinement)).expect("a sound sphere");
        let model = model(&mesh, LINEAR, &curve, APPLIED[1]);
        let (solution, _) = model.solve(&mesh).expect("it converges");
        study.add(1.0 / refinement, errors(&model, &mesh, &solution, exact)[0]);
    }
    study.assert_order(1.6);
}
