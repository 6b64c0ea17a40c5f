//! All ways to solve the linear systems give one field, one objective and one gradient; so do factors and solutions that
//! are kept from design to design.

use fluxmorph::build::{Mode, set_up};
use fluxmorph_optimizer::problem::{
    Analysis, Derivatives, NoProgress, Problem, SEARCH_ADJOINT_TOLERANCE, SolverCache,
};
use fluxmorph_solver::linear::{LinearSolverCache, Method};
use fluxmorph_solver::{FieldModel, LoadCase};

use crate::problems::variables;
use crate::support::{changed, config, norm, relative_difference, repository_text, setup, setup_of};

/// A meshed plate, coarse: skin layers, ψ, interfaces.
const MESHED: (&str, &[&str]) = (
    "shield.toml",
    &["mesh.shield.refinement=0.3", "mesh.shield.growth=2.5", "mesh.shield.skin=[4e-4,1.2e-3,2.5e-3,5e-3]"],
);

/// Deviation of objective and gradient that solutions to 1e-11 leave: the adjoint weighs a residual by far less than the
/// 1e3 in between.
const SAME: f64 = 1e-8;

fn problem((name, settings): (&str, &[&str]), more: &[&str]) -> Problem {
    let settings: Vec<&str> = settings.iter().chain(more).copied().collect();
    setup(name, &settings).problem
}

/// A design in the middle of nowhere, `step` times away from flat.
fn design(problem: &Problem, step: f64) -> Vec<f64> {
    (0..variables(problem)).map(|k| 1e-3 * step * (1.0 + (k as f64).sin())).collect()
}

fn evaluated(problem: &Problem, memory: &mut SolverCache, step: f64) -> Analysis {
    let p = design(problem, step);
    problem.evaluate(&p, Derivatives::First, memory, &mut NoProgress).unwrap_or_else(|e| panic!("{e}"))
}

/// Relative deviation of objective and gradient.
fn deviation(a: &Analysis, b: &Analysis) -> f64 {
    let objective = |a: &Analysis| a.objective.expect("an objective");
    let gradient = |a: &Analysis| a.gradient.clone().expect("asked for");
    let gradient = relative_difference(&gradient(a), &gradient(b));
    gradient.max((objective(a) / objective(b) - 1.0).abs())
}

fn every_method_agrees(case: (&str, &[&str]), more: &[&str], methods: &[Method]) {
    let of = |method: Method| {
        let setting = format!("analysis.linear_solver.method=\"{}\"", method.name());
        let settings: Vec<&str> = more.iter().copied().chain([setting.as_str()]).collect();
        let problem = problem(case, &settings);
        let analysis = evaluated(&problem, &mut SolverCache::default(), 1.0);
        assert!(analysis.worst_residual <= 1e-9, "{method:?}: {:e}", analysis.worst_residual);
        assert!(analysis.solver_events.is_empty(), "{method:?}: {:?}", analysis.solver_events);
        analysis
    };
    let direct = of(Method::Direct);
    for &method in methods {
        let deviation = deviation(&of(method), &direct);
        assert!(deviation < SAME, "{method:?} differs by {deviation:e}");
    }
}

const FACTORS: [Method; 4] =
    [Method::DirectSingle, Method::RealFactor, Method::RealFactorSingle, Method::Incomplete];

#[test]
fn every_method_gives_the_same_objective_and_gradient_with_eddy_currents() {
    every_method_agrees(MESHED, &[], &FACTORS);
}

#[test]
fn an_analysis_after_another_begins_with_the_method_that_worked() {
    let problem = setup("shield_two_frequencies.toml", &[]).problem;
    let mut analysis = evaluated(&problem, &mut SolverCache::default(), 1.0);
    // The first choice has worked: nothing to begin with.
    assert_eq!(problem.cache_after(&analysis).methods(), []);
    analysis.methods[1] = Some(Method::RealFactor);
    assert_eq!(problem.cache_after(&analysis).methods(), [None, Some(Method::RealFactor)]);
}

#[test]
fn every_method_gives_the_same_objective_and_gradient_with_an_impedance_surface() {
    every_method_agrees(("shield_quick.toml", &[]), &[], &FACTORS);
}

#[test]
fn every_method_gives_the_same_objective_and_gradient_in_statics() {
    // Nodal elements are refused beside static iron of a higher permeability.
    let weak = "materials.steel.relative_permeability=10";
    every_method_agrees(MESHED, &["analysis.frequency=0", weak], &FACTORS);
}

#[test]
fn two_levels_give_the_same_objective_and_gradient_of_quadratic_elements() {
    every_method_agrees(("shield_quick.toml", &[]), &["analysis.order=2"], &[Method::TwoLevel]);
}

/// Gradients of a search against those by adjoint problems solved as the states are: the relative difference.
fn what_a_search_leaves(case: (&str, &[&str]), more: &[&str]) -> f64 {
    let problem = problem(case, more);
    let p = design(&problem, 1.0);
    let of = |derivatives: Derivatives| {
        let analysis = problem.evaluate(&p, derivatives, &mut SolverCache::default(), &mut NoProgress);
        analysis.unwrap_or_else(|e| panic!("{e}"))
    };
    let (search, exact) = (of(Derivatives::Search), of(Derivatives::First));
    assert_eq!(search.objective, exact.objective);
    assert!(search.linear_iterations < exact.linear_iterations);
    let gradient = |a: &Analysis| a.gradient.clone().expect("asked for");
    relative_difference(&gradient(&search), &gradient(&exact))
}

#[test]
fn a_search_takes_fewer_iterations_for_gradients_that_differ_by_its_tolerance() {
    let method = |method: Method| format!("analysis.linear_solver.method=\"{}\"", method.name());
    let [two, real, incomplete] =
        [Method::TwoLevel, Method::RealFactorSingle, Method::Incomplete].map(method);
    // Rows of ψ are small beside those of A, and the residual that ends an iteration is that of all rows together.
    let poor = ["materials.steel.conductivity=100", "materials.steel.relative_permeability=1"];
    for (case, more) in [
        (MESHED, &[&two[..]][..]),
        (MESHED, &[&real]),
        (MESHED, &[&incomplete, poor[0], poor[1]]),
        (("shield_quick.toml", &[]), &[&two, "analysis.order=2"]),
        (("shield_edge.toml", &["mesh.shield.refinement=0.3"]), &[&real, "analysis.order=1"]),
    ] {
        let difference = what_a_search_leaves(case, more);
        // Measured .3 to 2.7 of the tolerance.
        assert!(difference < 10.0 * SEARCH_ADJOINT_TOLERANCE, "{case:?} {more:?}: {difference:e}");
    }
}

/// Factors serve several designs.
const REUSED: &str = "analysis.linear_solver.reuse=while_it_pays";

#[test]
fn designs_that_share_factors_and_solutions_have_the_results_of_their_own() {
    let problem = problem(MESHED, &[REUSED]);
    let mut memory = SolverCache::default();
    let (mut kept, mut own) = (0, 0);
    for step in [0.0, 1.0, 3.0, 3.5, 3.6, 3.61] {
        let shared = evaluated(&problem, &mut memory, step);
        let cold = evaluated(&problem, &mut SolverCache::default(), step);
        let deviation = deviation(&shared, &cold);
        assert!(deviation < SAME, "after {step} mm: {deviation:e}");
        assert!(shared.worst_residual <= 1e-9);
        if shared.linear_iterations > cold.linear_iterations { kept += 1 } else { own += 1 }
    }
    // Both happen on the way, or the test says nothing.
    assert!(kept > 0 && own > 0, "{kept} kept, {own} of their own");
}

#[test]
fn the_part_of_a_factor_that_is_kept_changes_no_bit_of_a_result() {
    let pole = repository_text("configs/pole.toml");
    // Of the tip alone: around all of the iron the rim would be too large.
    let own = "[regions.tip]\nmaterial = \"soft\"\n\n[materials.soft]\nbh = \"team20_steel\"";
    let along_a_curve = changed(&pole, &[("[regions.tip]\nmaterial = \"iron\"", own)]);
    let coils = repository_text("configs/coupled_coils.toml");
    let two = [("frequency = \"85 kHz\"", "frequencies = [\"85 kHz\", \"40 kHz\"]")];
    let problems = [
        ("two frequencies", setup_of(&changed(&coils, &two)).problem),
        ("statics", setup_of(&pole).problem),
        ("Newton's method", setup_of(&along_a_curve).problem),
    ];
    for (name, problem) in problems {
        let solver = problem.states()[0].linear_solver().expect("one process");
        assert!(solver.keeps_a_part(), "{name}");
        let mut memory = SolverCache::default();
        for step in [0.0, 1.0] {
            let shared = evaluated(&problem, &mut memory, step);
            let own = evaluated(&problem, &mut SolverCache::default(), step);
            assert_eq!(shared.objective, own.objective, "{name}, {step} mm");
            assert_eq!(shared.gradient, own.gradient, "{name}, {step} mm");
        }
    }
}

#[test]
fn a_factor_serves_a_frequency_close_by() {
    let problem = problem(MESHED, &[REUSED]);
    let (mesh, at_60) = (problem.original(), &problem.states()[0]);
    let at_61 = at_60
        .at_load_case(mesh, &LoadCase { frequency: 61.0, ..at_60.load_case() })
        .expect("a frequency above zero");
    let solved = |model: &FieldModel, memory: &mut LinearSolverCache| {
        let mut system = model.prepare_with(model.assemble(mesh), memory).expect("a regular system");
        let field = model.solve_prepared(&mut system, &model.load(mesh)).expect("it converges");
        (field, system.into_cache())
    };
    let (_, memory) = solved(at_60, &mut LinearSolverCache::default());
    let (shared, _) = solved(&at_61, &mut memory.without_initial_guess());
    let (own, _) = solved(&at_61, &mut LinearSolverCache::default());
    let (shared_count, own_count) = (shared.report().iterations, own.report().iterations);
    assert!(shared_count > own_count, "{shared_count} iterations, {own_count} with an own factor");
    let difference = norm(shared.values().iter().zip(own.values()).map(|(a, b)| (a - b).norm()));
    assert!(difference < SAME * norm(own.values().iter().map(|v| v.norm())));
}

#[test]
fn what_is_shared_between_frequencies_changes_no_result() {
    const TWO: (&str, &[&str]) = ("shield_two_frequencies.toml", &[]);
    let of = |reuse: &str| {
        let setting = format!("analysis.linear_solver.reuse=\"{reuse}\"");
        evaluated(&problem(TWO, &[&setting]), &mut SolverCache::default(), 1.0)
    };
    let deviation = deviation(&of("while_it_pays"), &of("never"));
    assert!(deviation < SAME, "{deviation:e}");
}

#[test]
fn a_poor_conductor_has_the_same_loss_by_an_incomplete_and_a_complete_factor() {
    // Rows of ψ are some 1e-6 of those of A here, and the residual that ends an iteration is that of all rows together.
    const POOR: (&str, &[&str]) = (
        "sphere.toml",
        &[
            "materials.metal.conductivity=1",
            "materials.metal.relative_permeability=1",
            "analysis.elements=\"nodal\"",
            "analysis.order=1",
            "mesh.sphere.divisions=4",
        ],
    );
    let loss = |method: &str| {
        let (config, source) = config(POOR.0, &[POOR.1, &[method]].concat());
        let setup = set_up(&config, &source, Mode::Analysis).unwrap_or_else(|error| panic!("{error}"));
        let (model, mesh) = (&setup.problem.states()[0], setup.problem.original());
        let (solution, _) = model.solve(mesh).expect("it converges");
        solution.losses(model, mesh).iter().map(|(_, loss)| loss).sum::<f64>()
    };
    let [direct, incomplete] =
        ["direct", "incomplete"].map(|name| loss(&format!("analysis.linear_solver.method=\"{name}\"")));
    // Measured 3.5e-10.
    assert!((incomplete / direct - 1.0).abs() < SAME, "{direct:e} {incomplete:e}");
}
