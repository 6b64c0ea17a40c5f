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
    let mut cache = LinearSolverCache::default();
    let solution = match model.is_linear() {
        true => model.solve(&mesh).expect("it converges").0,
        false => model.solve_nonlinear(&mesh, (&mut cache, None), steps).expect("it converges").0,
    };
    Solved { model, mesh, solution }
}

impl Solved {
    /// Mean component [T] of B over some points [m]: that of the elements themselves, no fit, as sections lie across corners of the
    /// steel.
    fn mean(&self, points: &[Point], component: usize) -> f64 {
        let fields = locate(&self.mesh, points).into_iter().map(|found| {
            let (e, lambda) = found.expect("a point of the mesh");
            self.solution.at(&self.model, &self.mesh, e, &lambda).flux_density[component].re
        });
        fields.sum::<f64>() / points.len() as f64
    }
}

/// The field of TEAM problem 20 at so many ampere-turns, and the force [N] along z on the whole pole.
fn pole(ampere_turns: &str) -> (Solved, f64) {
    let coil = format!(
        "coils=[{{ name = \"coil\", shape = \"racetrack\", ampere_turns = {ampere_turns}, center = [0, 0, \"75 mm\"], \
         axis = \"z\", half_window = [\"19.5 mm\", \"19.5 mm\"], width = \"18 mm\", height = \"96.6 mm\", \
         inner_radius = \"5 mm\" }}]"
    );
    let solved = solved("team20.toml", &[&coil]);
    let pole = solved.mesh.topology().region("pole").expect("it is named");
    let motion = RigidMotion::Translation([0.0, 0.0, -1.0]);
    let force = Functional::force(&solved.model, &solved.mesh, "pole", &[pole], motion);
    let force = force.expect("air around the pole").evaluate((&solved.model, &solved.mesh, &solved.solution));
    let force = 4.0 * force.expect("finite").value;
    (solved, force)
}

/// Points [m] in a rectangle across z, from two corners [mm].
fn across(z: f64, x: [f64; 2], y: [f64; 2]) -> Vec<Point> {
    let along = |[from, to]: [f64; 2], i: i32| 1e-3 * (from + (to - from) * (f64::from(i) + 0.5) / 20.0);
    (0..400).map(|k| [along(x, k / 20), along(y, k % 20), 1e-3 * z]).collect()
}

#[test]
#[ignore = "four saturated fields of a benchmark, twenty seconds; the gallery has one of them"]
fn the_force_of_team_20_is_within_5_percent_of_the_measured_one() {
    // In the gap under the middle of the pole, and the means of the pole and of a leg of the yoke halfway up. The one in the gap is
    // measured 11 % above what the forces say at 1000 A, and that under the corner lies within a cell of it: both are printed.
    let places = [
        ("Bz_P1_T", vec![[0.0, 0.0, 0.02575]], 1),
        ("Bz_P2_T", vec![[0.0125, 0.005, 0.02575]], 4),
        ("meanBz_pole_alpha_beta_T", across(75.0, [0.0, 12.5], [0.0, 5.0]), 0),
        ("meanBz_yoke_gamma_delta_T", across(75.0, [38.5, 63.5], [0.0, 12.5]), 0),
    ];
    let measured = &reference("team20.json")["measured"];
    for (k, current) in numbers(&measured["NI_At"]).iter().enumerate() {
        let (solved, found) = pole(&current.to_string());
        let (expected, steps) = (numbers(&measured["Fz_N"])[k], solved.solution.newton_steps());
        let error = found / expected - 1.0;
        println!("{current} A: {found:.2} N, measured {expected} N, {:+.1} %, {steps} steps", 100.0 * error);
        assert!(error.abs() < 0.05, "{current} A");
        // One more than steps that are solved exactly take (docs/verification.md).
        assert!(steps <= 9, "{current} A: {steps} steps from zero");
        for (name, points, first) in &places {
            let (found, expected) = (solved.mean(points, 2).abs(), numbers(&measured[name])[k]);
            let error = found / expected - 1.0;
            println!("  {name}: {found:.3} T, measured {expected} T, {:+.1} %", 100.0 * error);
            assert!(k < *first || error.abs() < 0.05, "{current} A, {name}");
        }
    }
}

/// Points of a section, and the direction in which its mean is measured.
///
/// 50 to each side of 50 mm, so that none lies across the edge of what is opposite, at y = ±25 mm: the field at the end of a channel
/// is strong before the plate and weak beside it.
fn section(position: &Value) -> (Vec<Point>, usize) {
    const AXES: [&str; 3] = ["x", "y", "z"];
    const ACROSS: u32 = 50;
    let axis = |name: &str| AXES.iter().position(|axis| *axis == name).expect("an axis");
    let (across, at) = position["plane"].as_str().and_then(|plane| plane.split_once('=')).expect("a plane");
    let at: f64 = at.parse().expect("millimetres");
    let spread = |d: usize| -> Vec<f64> {
        if d == axis(across) {
            return vec![at];
        }
        let [from, to]: [f64; 2] = numbers(&position[AXES[d]]).try_into().expect("from and to");
        (0..ACROSS).map(|i| from + (to - from) * (f64::from(i) + 0.5) / f64::from(ACROSS)).collect()
    };
    let [x, y, z] = [spread(0), spread(1), spread(2)];
    let points = x
        .iter()
        .flat_map(|&x| y.iter().map(move |&y| [x, y]))
        .flat_map(|[x, y]| z.iter().map(move |&z| [1e-3 * x, 1e-3 * y, 1e-3 * z]));
    let component = position["component"].as_str().and_then(|c| c.get(2..3)).expect("|Bx| or |Bz|");
    (points.collect(), axis(component))
}

/// Deviations of the 25 means of TEAM problem 13 from the measured ones.
fn deviations(overrides: &[&str]) -> Vec<f64> {
    let solved = solved("team13.toml", overrides);
    let steps = solved.solution.newton_steps();
    println!("{overrides:?}: {} tetrahedra, {steps} steps", solved.mesh.topology().tets().len());
    let file = reference("team13.json");
    let deviation = |position: &Value| {
        let (points, component) = section(position);
        let mean = solved.mean(&points, component).abs();
        let error = mean / position["measured_T"].as_f64().expect("a number") - 1.0;
        println!("{}: {mean:.3} T, {:+.1} %", position["n"], 100.0 * error);
        error
    };
    file["positions_1000At"].as_array().expect("a list").iter().map(deviation).collect()
}

#[test]
#[ignore = "a benchmark of some minutes"]
fn mean_flux_densities_of_team_13_are_within_7_percent_of_the_measured_ones() {
    let worst = deviations(&[]).iter().map(|error| error.abs()).fold(0.0, f64::max);
    assert!(worst < 0.07, "{worst}");
}

/// `check` warns of them: steel in a circuit with narrow gaps.
#[test]
#[ignore = "a benchmark of some minutes"]
fn nodal_elements_lose_two_fifths_of_the_flux_of_team_13() {
    let errors = deviations(&["analysis.elements=\"nodal\""]);
    assert!(errors.iter().all(|error| (-0.55..-0.35).contains(error)), "{errors:?}");
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
