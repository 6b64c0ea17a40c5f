//! Measured devices of saturated steel: TEAM problems 13 (flux densities in thin plates) and 20 (force).

use fluxmorph::build::{Mode, set_up};
use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::problem::{Derivatives, Progress, SolverCache, Stage};
use fluxmorph_solver::linear::LinearSolverCache;
use fluxmorph_solver::newton::NewtonProgress;
use fluxmorph_solver::{FieldModel, FieldSolution, Functional, RigidMotion};
use serde_json::Value;

use super::case::numbers;
use crate::references::reference;
use crate::support::config;

/// The field of a configuration.
pub(super) struct Solved {
    pub(super) model: FieldModel,
    pub(super) mesh: Mesh,
    pub(super) solution: FieldSolution,
}

pub(super) fn solved(name: &str, overrides: &[&str]) -> Solved {
    let (config, source) = config(name, overrides);
    let setup = set_up(&config, &source, Mode::Analysis).unwrap_or_else(|e| panic!("{e}"));
    let (model, mesh) = (setup.problem.states()[0].clone(), setup.problem.original().clone());
    let steps = &mut |p: NewtonProgress| {
        println!("  {name}, step {}: residual {:.1e}, length {}", p.steps, p.residual, p.damping);
    };
    let cache = LinearSolverCache::default();
    let solution = match model.is_linear() {
        true => model.solve(&mesh).expect("it converges").0,
        false => model.solve_nonlinear(&mesh, (&cache, None), steps).expect("it converges").0,
    };
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
        assert!(steps <= 8, "{current} A: {steps} steps from zero");
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

/// Prints the steps.
struct Printed;

impl Progress for Printed {
    fn stage(&mut self, _: Stage) {}

    fn newton(&mut self, progress: NewtonProgress) {
        println!(
            "  step {}: residual {:.1e}, length {:.2}",
            progress.steps, progress.residual, progress.damping
        );
    }
}

/// Steps from the field on the reference mesh, as every evaluation of a run after the first takes them.
#[test]
#[ignore = "a dozen saturated fields of the actuator, half a minute"]
fn designs_of_an_actuator_take_few_steps_from_the_reference() {
    let (config, source) = config("actuator.toml", &[]);
    let setup = set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|e| panic!("{e}"));
    let problem = &setup.problem;
    let shape = problem.shape().expect("a shape");
    let bounds = config.design.as_ref().map(|design| [design.lower, design.upper]).expect("a design");
    let mut cache = SolverCache::default();
    let mut steps = |share: f64, seed: u64| {
        let mut random = seed;
        let mut next = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let p: Vec<f64> =
            shape.initial().iter().map(|p| p + 2.0 * share * next() * (bounds[1] - bounds[0])).collect();
        let p: Vec<f64> = p.into_iter().map(|p| p.clamp(bounds[0], bounds[1])).collect();
        let analysis = problem.evaluate(&p, Derivatives::First, &mut cache, &mut Printed);
        analysis.unwrap_or_else(|e| panic!("{e}")).solutions[0].newton_steps()
    };
    println!("the initial design: {} steps from zero", steps(0.0, 1));
    // A first step goes a tenth of the range.
    for (share, most) in [(0.01, 4), (0.05, 4), (0.1, 4), (0.2, 5)] {
        let found: Vec<usize> = (1..=3).map(|seed| steps(share, seed)).collect();
        println!("variables moved by up to {share} of their range: {found:?} steps from the reference");
        assert!(found.iter().all(|&steps| steps <= most), "{share}: {found:?}");
    }
}
