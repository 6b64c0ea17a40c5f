//! Measured devices of saturated steel: TEAM problems 13 (flux densities in thin plates) and 20 (force).

use fluxmorph::build::{Mode, set_up};
use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::linear::LinearSolverCache;
use fluxmorph_solver::{FieldModel, FieldSolution, Functional, RigidMotion};
use serde_json::Value;

use super::case::numbers;
use crate::references::reference;
use crate::support::config;

/// The field of a configuration.
struct Solved {
    model: FieldModel,
    mesh: Mesh,
    solution: FieldSolution,
}

fn solved(name: &str, overrides: &[&str]) -> Solved {
    let (config, source) = config(name, overrides);
    let setup = set_up(&config, &source, Mode::Analysis).unwrap_or_else(|e| panic!("{e}"));
    let (model, mesh) = (setup.problem.states()[0].clone(), setup.problem.original().clone());
    let steps = &mut |p: fluxmorph_solver::newton::NewtonProgress| {
        println!("  {name}, step {}: residual {:.1e}, length {}", p.steps, p.residual, p.damping);
    };
    let solution =
        model.solve_nonlinear(&mesh, (&LinearSolverCache::default(), None), steps).expect("it converges").0;
    Solved { model, mesh, solution }
}

/// Force [N] along z on the whole pole.
fn force(ampere_turns: &str) -> (f64, usize) {
    let coil = format!(
        "coils=[{{ name = \"coil\", shape = \"racetrack\", ampere_turns = {ampere_turns}, center = [0, 0, \"75 mm\"], \
         axis = \"z\", half_window = [\"19.5 mm\", \"19.5 mm\"], width = \"18 mm\", height = \"96.6 mm\", \
         inner_radius = \"5 mm\" }}]"
    );
    let Solved { model, mesh, solution } = solved("team20.toml", &[&coil]);
    let pole = mesh.topology().region("pole").expect("it is named");
    let motion = RigidMotion::Translation([0.0, 0.0, -1.0]);
    let force = Functional::force(&model, &mesh, "pole", &[pole], motion).expect("air around the pole");
    (4.0 * force.evaluate(&model, &mesh, &solution).expect("finite").value, solution.newton_steps())
}

#[test]
#[ignore = "four saturated fields of a benchmark, twenty seconds; the gallery has one of them"]
fn the_force_of_team_20_is_within_5_percent_of_the_measured_one() {
    let measured = &reference("team20.json")["measured"];
    for (current, expected) in numbers(&measured["NI_At"]).iter().zip(numbers(&measured["Fz_N"])) {
        let (found, steps) = force(&current.to_string());
        let error = found / expected - 1.0;
        println!("{current} A: {found:.2} N, measured {expected} N, {:+.1} %, {steps} steps", 100.0 * error);
        assert!(error.abs() < 0.05, "{current} A");
    }
}

/// Points of a section, and the direction in which its mean is measured.
fn section(position: &Value) -> (Vec<Point>, usize) {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let axis = |name: &str| AXES.iter().position(|axis| *axis == name).expect("an axis");
    let (across, at) = position["plane"].as_str().and_then(|plane| plane.split_once('=')).expect("a plane");
    let at: f64 = at.parse().expect("millimetres");
    let spread = |d: usize| -> Vec<f64> {
        if d == axis(across) {
            return vec![at];
        }
        let [from, to]: [f64; 2] = numbers(&position[AXES[d]]).try_into().expect("from and to");
        (0..8).map(|i| from + (to - from) * (f64::from(i) + 0.5) / 8.0).collect()
    };
    let [x, y, z] = [spread(0), spread(1), spread(2)];
    let points = x
        .iter()
        .flat_map(|&x| y.iter().map(move |&y| [x, y]))
        .flat_map(|[x, y]| z.iter().map(move |&z| [1e-3 * x, 1e-3 * y, 1e-3 * z]));
    let component = position["component"].as_str().and_then(|c| c.get(2..3)).expect("|Bx| or |Bz|");
    (points.collect(), axis(component))
}

#[test]
#[ignore = "a benchmark of some minutes"]
fn mean_flux_densities_of_team_13_are_within_7_percent_of_the_measured_ones() {
    let Solved { model, mesh, solution } = solved("team13.toml", &[]);
    let file = reference("team13.json");
    let mut worst = 0.0_f64;
    for position in file["positions_1000At"].as_array().expect("a list") {
        let (points, component) = section(position);
        // The field of the elements themselves, no fit: sections lie across corners of the steel.
        let fields = locate(&mesh, &points).into_iter().map(|found| {
            let (e, lambda) = found.expect("a point of the mesh");
            solution.at(&model, &mesh, e, &lambda).flux_density[component].re
        });
        let mean = fields.sum::<f64>().abs() / points.len() as f64;
        let error = mean / position["measured_T"].as_f64().expect("a number") - 1.0;
        println!("{}: {mean:.3} T, {:+.1} %", position["n"], 100.0 * error);
        worst = worst.max(error.abs());
    }
    assert!(worst < 0.07, "{worst}");
}
