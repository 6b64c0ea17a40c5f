//! Prisms with iron along a B–H curve: `H = (0, 0, T + c)` still holds, and `c` follows from a scalar equation.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, volume};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{BhCurve, FieldModel, Functional, RigidMotion};

use super::boxed::{Cells, boxed};
use super::discretisation::ALL;
use super::exact::Prism;
use super::problem::{Solved, set_up};
use super::source::Source;
use super::{cases, unstructured};

/// The steel of TEAM problem 20, of `tests/reference/team20_bh.csv`.
pub(super) fn steel() -> BhCurve {
    let rows = include_str!("../../reference/team20_bh.csv").lines().filter(|line| !line.starts_with('#'));
    let point = |line: &str| -> [f64; 2] {
        let numbers: Vec<f64> = line.split(',').map(|n| n.trim().parse().expect("a number")).collect();
        numbers.try_into().expect("H and B")
    };
    BhCurve::new(&rows.map(point).collect::<Vec<_>>()).expect("a sound table")
}

/// `B` [T] of a field strength [A/m], with its sign.
fn flux_density(curve: &BhCurve, h: f64) -> f64 {
    let (mut low, mut high) = (0.0, 10.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if curve.at(middle).field_strength < h.abs() { low = middle } else { high = middle }
    }
    high.copysign(h)
}

/// `c` [A/m] where the region `iron`, which `T` does not reach, follows the curve: `μ0 ∫(T + c) + A B(c) = 0`.
pub(super) fn constant(prism: &Prism, curve: &BhCurve) -> f64 {
    let iron = prism.parts.iter().find(|part| part.name == "iron").expect("it has iron");
    assert_eq!(prism.source.over(&iron.shape), 0.0, "no T in the iron");
    let [around, inside] = [prism.outline.area() - iron.shape.area(), iron.shape.area()];
    let source = prism.source.over(&prism.outline);
    let flux = |c: f64| VACUUM_PERMEABILITY * (source + c * around) + inside * flux_density(curve, c);
    let (mut low, mut high) = (-1e7, 0.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if flux(middle) < 0.0 { low = middle } else { high = middle }
    }
    high
}

/// The same with another current.
pub(super) fn driven(prism: Prism, ampere_turns: f64) -> Prism {
    Prism { source: Source { ampere_turns, ..prism.source }, ..prism }
}

/// Edge elements of both orders have these forces and torques on a part within 1 %, nodal ones of second order within 2 %; those of
/// first order are not at home beside iron and conductors.
fn assert_forces(
    prism: &Prism,
    part: &str,
    curve: Option<&BhCurve>,
    expected: impl IntoIterator<Item = (RigidMotion, f64)> + Clone,
) {
    let mesh = boxed(prism, Cells::COARSE);
    let at_home = ALL.into_iter().filter(|discretisation| discretisation.name != "nodal 1");
    for discretisation in at_home {
        let within = if discretisation.name == "nodal 2" { 0.02 } else { 0.01 };
        let (mesh, mut setup) = set_up(prism, &mesh, 1.0);
        let body = mesh.topology().region(part).expect("it is named");
        setup.bh = vec![None; body.index()];
        setup.bh.push(curve.cloned().map(Arc::new));
        let model = FieldModel::new(&mesh, discretisation.of(setup)).expect("a sound problem");
        let (solution, _) = model.solve(&mesh).expect("it converges");
        for (motion, exact) in expected.clone() {
            let force = Functional::force(&model, &mesh, part, &[body], motion).expect("a layer of air");
            let found = force.evaluate((&model, &mesh, &solution)).expect("finite").value;
            println!("{}: {found:e}, exact {exact:e}", discretisation.name);
            assert!((found / exact - 1.0).abs() < within, "{}: {found} against {exact}", discretisation.name);
        }
    }
}

/// A unit vector.
fn along(d: usize) -> Point {
    std::array::from_fn(|i| f64::from(u8::from(i == d)))
}

/// The field presses on the free faces of a piece of iron in a corner, as everywhere along `B`: `½ μ0 H²`.
#[test]
fn the_force_on_saturated_iron_is_the_pressure_on_its_faces() {
    let curve = steel();
    let prism = driven(cases::iron_far(1e3), 4e6);
    let pressure = 0.5 * VACUUM_PERMEABILITY * constant(&prism, &curve).powi(2) * prism.height;
    // Faces at x = −0.8 over y from −1 to −0.4, and at y = −0.4 over x from −1 to −0.8.
    let about_z = pressure * (0.5 * (0.4_f64.powi(2) - 1.0) - 0.5 * (0.8_f64.powi(2) - 1.0));
    let expected = [
        (RigidMotion::Translation(along(0)), -0.6 * pressure),
        (RigidMotion::Translation(along(1)), -0.2 * pressure),
        (RigidMotion::Rotation { axis: along(2), about: [0.0; 3] }, about_z),
    ];
    assert_forces(&prism, "iron", Some(&curve), expected);
}

/// The mean of that over a period, `¼ μ0 |H|²`, is what presses on a conductor, whatever its skin depth.
#[test]
fn the_force_on_a_conductor_is_the_mean_pressure_on_its_faces() {
    for skin_depth in [0.1, 0.5] {
        let prism = cases::meshed_quarter(skin_depth);
        let pressure = 0.25 * VACUUM_PERMEABILITY * prism.constant().norm_sqr() * prism.height;
        // Faces of a metre at x = 0 and y = 0, the lower one at −1 ≤ y and the other at x ≤ 1.
        let expected = [
            (RigidMotion::Translation(along(0)), pressure),
            (RigidMotion::Translation(along(1)), -pressure),
            (RigidMotion::Rotation { axis: along(2), about: [0.2, 0.0, 0.0] }, 0.2 * pressure),
        ];
        assert_forces(&prism, "block", None, expected);
    }
}

#[test]
fn saturated_prisms_are_exact_on_edge_elements() {
    let curve = steel();
    let cut = unstructured::all()
        .into_iter()
        .filter(|(prism, _)| prism.parts.iter().any(|part| part.name == "iron") && prism.parts.len() == 1);
    let boxes = [cases::iron_corner(1e3), cases::iron_far(1e3)].map(|prism| {
        let mesh = boxed(&prism, Cells::COARSE);
        (prism, mesh)
    });
    let mut solved = 0;
    for (prism, mesh) in boxes.into_iter().chain(cut) {
        // The knee, saturation, and beyond the last point of the table.
        for ampere_turns in [1e6, 4e6, 4e7] {
            let prism = driven(prism.clone(), ampere_turns);
            let c = constant(&prism, &curve);
            let exact = flux_density(&curve, c);
            let mean = prism.source.over(&prism.observation) / prism.observation.area();
            for discretisation in ALL.into_iter().filter(|one| one.name.starts_with("edge")) {
                let (mesh, mut setup) = set_up(&prism, &mesh, 1.0);
                let regions = mesh.topology().region_names().to_vec();
                let law = |name: &String| (name == "iron").then(|| Arc::new(curve.clone()));
                setup.bh = regions.iter().map(law).collect();
                let model = FieldModel::new(&mesh, discretisation.of(setup)).expect("a sound problem");
                let (solution, _) = model.solve(&mesh).expect("it converges");
                let steps = solution.newton_steps();
                let mut sum = [0.0; 2];
                for &e in model.elements_with_a_law() {
                    let v = volume(mesh.vertices(e));
                    let b = solution.flux_density(&model, &mesh, e);
                    let off = [b[0], b[1], b[2] - exact].iter().map(|c: &c64| c.norm_sqr()).sum::<f64>();
                    sum = [sum[0] + v * off, sum[1] + v * exact * exact];
                }
                let of_iron = (sum[0] / sum[1]).sqrt();
                let solved_prism = Solved { model, mesh, solution, cpu_seconds: 0.0 };
                let observed =
                    (solved_prism.observed()[2].re / (VACUUM_PERMEABILITY * (mean + c)) - 1.0).abs();
                println!(
                    "{:<40} {:<8} {ampere_turns:.0e} A: {exact:.3} T, {:.3} % in the iron, {:.3} % far off, {steps} steps",
                    prism.name,
                    discretisation.name,
                    100.0 * of_iron,
                    100.0 * observed
                );
                assert!(of_iron.max(observed) < 0.005, "{} {}", prism.name, discretisation.name);
                solved += 1;
            }
        }
    }
    assert!(solved >= 12, "{solved}");
}
