//! The last look at what an evaluation has computed, before an optimiser, a history or a file sees any of it.
//!
//! Linear solvers audit their residuals, and a mesh its volumes; a solution of them is finite. What is made of it may still
//! leave the range of numbers: the square of a large field, a weighted sum, the norm of a gradient. Each is refused here by
//! name, as [`Error::NotFinite`], so that no file holds a `NaN`, an infinity, or the `null` that JSON writes for them. One
//! pass over unknowns, nodes and variables; docs/robustness.md has what it costs and what a run does then.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::{FieldModel, FieldSolution, SolverError};

use crate::constraint::Constraint;
use crate::error::Error;
use crate::objective::Term;
use crate::output::{ProbeResult, RunResult};
use crate::problem::Analysis;

/// What to do about a field that is no number.
const FIELD: &str = "expected a finite number; check currents, material data and units";

/// What to do about an objective or constraint that is no number.
const SUM: &str = "expected a finite number; check weights, currents and units";

/// `the state at 60 Hz`, or another problem there.
pub(crate) fn problem_name(what: &str, model: &FieldModel) -> String {
    match model.setup().frequency {
        0.0 => format!("{what} of the static field"),
        frequency => format!("{what} at {frequency} Hz"),
    }
}

/// An error of a linear system with its name.
pub(crate) fn of_field(what: &str, model: &FieldModel) -> impl FnOnce(SolverError) -> Error + use<> {
    let problem = problem_name(what, model);
    move |cause| Error::Field { problem, cause: Box::new(cause) }
}

/// An error of a term on one state with its name.
pub(crate) fn of_term(
    owner: &str,
    term: &Term,
    model: &FieldModel,
) -> impl FnOnce(SolverError) -> Error + use<> {
    let region = term.label.region.as_ref().map_or(String::new(), |region| format!(" of region `{region}`"));
    let what = problem_name(&format!("the term `{}`{region} of {owner}", term.label.kind), model);
    move |cause| match cause {
        SolverError::NotFinite { value, .. } => Error::NotFinite { what, value, expected: SUM },
        other => other.into(),
    }
}

/// Potentials [T m] up to here have fields, losses and squares of both that are numbers, in elements of any size that a mesh
/// can have (1e-30 m) and for any material (1e60 S/m).
const SAFE_POTENTIAL: f64 = 1e60;

/// Flux density and loss of every element, and their squares, are numbers.
///
/// One pass over the unknowns; over the elements only where a potential is beyond [`SAFE_POTENTIAL`].
///
/// # Errors
/// [`Error::NotFinite`] names the first element's quantity, region and frequency.
pub(crate) fn state(model: &FieldModel, mesh: &Mesh, solution: &FieldSolution) -> Result<(), Error> {
    let is_safe = |v: &c64| v.re.abs() <= SAFE_POTENTIAL && v.im.abs() <= SAFE_POTENTIAL;
    if solution.values().iter().all(is_safe) {
        return Ok(());
    }
    let topology = mesh.topology();
    let refuse = |quantity: &str, e: usize, value: f64| {
        let region = &topology.region_names()[topology.region_of()[e].index()];
        let what = problem_name(&format!("{quantity} in element {e} of region `{region}`"), model);
        Err(Error::NotFinite { what, value, expected: FIELD })
    };
    let square = |v: &[c64; 3]| v.iter().map(|c| c.norm_sqr()).sum::<f64>();
    for (e, b) in solution.flux_densities(model, mesh).iter().enumerate() {
        if !square(b).is_finite() {
            return refuse("the squared flux density", e, square(b));
        }
    }
    // Without conductors both are zero throughout.
    if model.angular_frequency() == 0.0 || model.materials().iter().all(|m| m.conductivity == 0.0) {
        return Ok(());
    }
    for (e, loss) in solution.loss_densities(model, mesh).into_iter().enumerate() {
        if !loss.is_finite() {
            return refuse("the loss density", e, loss);
        }
    }
    Ok(())
}

/// Values, gradients and their norms, and mesh quality of an evaluation are numbers.
///
/// # Errors
/// [`Error::NotFinite`] names the first that is none.
pub(crate) fn analysis(analysis: &Analysis, constraints: &[Constraint]) -> Result<(), Error> {
    if let Some(value) = analysis.objective.filter(|value| !value.is_finite()) {
        return Err(Error::NotFinite { what: "the objective".to_owned(), value, expected: SUM });
    }
    if let Some(gradient) = &analysis.gradient {
        derivative("the objective", gradient)?;
    }
    for (constraint, measured) in constraints.iter().zip(&analysis.constraints) {
        let name = format!("the constraint `{}`", constraint.name);
        if let Some(gradient) = &measured.gradient {
            derivative(&name, gradient)?;
        }
        if !measured.value.is_finite() {
            return Err(Error::NotFinite { what: name, value: measured.value, expected: SUM });
        }
    }
    let value = analysis.quality.worst;
    if !value.is_finite() {
        let what = format!("the quality of element {}", analysis.quality.worst_element);
        let expected = "expected a finite number; check the unit of the mesh and the bounds of the design";
        return Err(Error::NotFinite { what, value, expected });
    }
    Ok(())
}

/// dF/dx at every node is a number.
///
/// # Errors
/// [`Error::NotFinite`] names the first node.
pub(crate) fn sensitivity(of: &str, nodal: &[Point]) -> Result<(), Error> {
    let Some(node) = nodal.iter().position(|g| g.iter().any(|g| !g.is_finite())) else { return Ok(()) };
    let value = nodal[node].into_iter().find(|g| !g.is_finite()).unwrap_or_default();
    Err(Error::NotFinite {
        what: format!("the derivative of {of} by the place of node {node}"),
        value,
        expected: SUM,
    })
}

/// A gradient and its norm.
fn derivative(of: &str, gradient: &[f64]) -> Result<(), Error> {
    let refused = |what: String, value: f64| Err(Error::NotFinite { what, value, expected: SUM });
    if let Some((k, &value)) = gradient.iter().enumerate().find(|(_, g)| !g.is_finite()) {
        return refused(format!("the derivative of {of} by design variable {k}"), value);
    }
    let square: f64 = gradient.iter().map(|g| g * g).sum();
    if square.is_finite() { Ok(()) } else { refused(format!("the squared gradient norm of {of}"), square) }
}

/// Every number of a result that is to be published.
///
/// # Errors
/// [`Error::NotFinite`] names the first that is none.
pub(crate) fn result(result: &RunResult) -> Result<(), Error> {
    let RunResult { objective, constraints, design, mesh, probes, losses_w, states, .. } = result;
    let mut numbers: Vec<(String, f64)> = vec![
        ("worst_quality_initial".to_owned(), mesh.worst_quality_initial),
        ("worst_quality_final".to_owned(), mesh.worst_quality_final),
        ("worst_residual".to_owned(), result.linear_solver.worst_residual),
    ];
    if let Some(objective) = objective {
        numbers.push(("the initial objective".to_owned(), objective.initial));
        numbers.push(("the best objective".to_owned(), objective.best));
        numbers.push(("the ratio of the objectives".to_owned(), objective.ratio));
        let terms = objective.terms.iter();
        numbers.extend(terms.map(|term| (format!("the term `{}` of the objective", term.kind), term.value)));
    }
    for constraint in constraints {
        let name = || format!("the constraint `{}`", constraint.name);
        numbers.extend([(name(), constraint.value), (name(), constraint.bound)]);
    }
    let values = design.iter().flat_map(|design| design.values_m.iter().enumerate());
    numbers.extend(values.map(|(k, &value)| (format!("design variable {k}"), value)));
    let probes = probes.iter().chain(states.iter().flat_map(|state| &state.probes));
    numbers.extend(probes.flat_map(at_probe));
    let losses = losses_w.iter().chain(states.iter().flat_map(|state| &state.losses_w));
    numbers.extend(losses.map(|(region, &loss)| (format!("the loss of `{region}`"), loss)));
    match numbers.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((what, value)) => Err(Error::NotFinite { what, value, expected: SUM }),
        None => Ok(()),
    }
}

/// The field at the points of a probe that the mesh holds.
fn at_probe(probe: &ProbeResult) -> impl Iterator<Item = (String, f64)> + '_ {
    let values = probe.b_re_t.iter().chain(&probe.b_im_t).flatten().flatten();
    values.map(|&value| (format!("the flux density of the probe `{}`", probe.name), value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::ExitCode;
    use crate::output::example_result as example;
    use crate::setup::{Purpose, set_up};

    fn named(error: Result<(), Error>) -> String {
        let error = error.expect_err("it is no number");
        assert_eq!(error.exit_code(), ExitCode::Numerical);
        error.to_string()
    }

    #[test]
    fn a_result_with_a_number_that_is_none_is_not_published() {
        assert!(result(&example()).is_ok());
        type Damage = fn(&mut RunResult);
        let damages: [(&str, Damage); 8] = [
            ("ratio", |r| r.objective.as_mut().expect("it has one").ratio = f64::INFINITY),
            ("best objective", |r| r.objective.as_mut().expect("it has one").best = f64::NAN),
            ("term `loss`", |r| r.objective.as_mut().expect("it has one").terms[0].value = f64::NAN),
            ("constraint `volume_plate`", |r| r.constraints[0].value = f64::NEG_INFINITY),
            ("design variable 0", |r| r.design.as_mut().expect("it has one").values_m[0] = f64::NAN),
            ("worst_quality_final", |r| r.mesh.worst_quality_final = f64::NAN),
            ("loss of `plate`", |r| *r.losses_w.entry("plate".to_owned()).or_default() = f64::INFINITY),
            ("probe `behind`", |r| {
                r.probes.push(ProbeResult {
                    name: "behind".to_owned(),
                    points_m: vec![[0.0; 3]],
                    b_re_t: vec![None, Some([0.0, f64::NAN, 0.0])],
                    b_im_t: vec![None, Some([0.0; 3])],
                });
            }),
        ];
        for (name, damage) in damages {
            let mut damaged = example();
            damage(&mut damaged);
            let message = named(result(&damaged));
            assert!(message.contains(name), "{name}: {message}");
        }
    }

    fn quick() -> (crate::problem::Problem, Analysis) {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/shield_quick.toml");
        let (config, source) =
            crate::config::Config::from_file(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        let problem = set_up(&config, &source, Purpose::Optimisation).expect("a sound case").problem;
        let p = problem.shape.as_ref().expect("a shape").initial.clone();
        let analysis = problem.evaluate(&p, crate::problem::Want::Gradient).expect("a sound case");
        (problem, analysis)
    }

    #[test]
    fn an_evaluation_with_a_number_that_is_none_is_refused_by_name() {
        let (_, sound) = quick();
        assert!(analysis(&sound, &[]).is_ok());
        let mut damaged = sound;
        damaged.objective = Some(f64::INFINITY);
        assert!(named(analysis(&damaged, &[])).starts_with("the objective is inf"));
        damaged.objective = Some(1.0);
        let gradient = damaged.gradient.as_mut().expect("it was asked for");
        gradient[5] = f64::NAN;
        assert!(named(analysis(&damaged, &[])).contains("objective by design variable 5 is NaN"));
        // Finite, but not its square: the norm in the history would be infinite.
        damaged.gradient.as_mut().expect("it was asked for")[5] = 1e200;
        assert!(named(analysis(&damaged, &[])).contains("squared gradient norm of the objective is inf"));
        damaged.gradient = None;
        damaged.quality.worst = f64::NAN;
        assert!(named(analysis(&damaged, &[])).contains("quality of element"));
        let mut nodal = vec![[0.0; 3]; 9];
        nodal[7][2] = f64::NEG_INFINITY;
        assert!(named(sensitivity("the objective", &nodal)).contains("by the place of node 7 is -inf"));
    }

    /// The share of an evaluation that the checks take; docs/robustness.md has the number.
    #[test]
    #[ignore = "a measurement: the clock is the process', and other tests run in it"]
    fn the_checks_take_less_than_a_hundredth_of_an_evaluation() {
        let (problem, analysed) = quick();
        let p = &problem.shape.as_ref().expect("a shape").initial;
        let cpu = || cpu_time::ProcessTime::now();
        let start = cpu();
        problem.evaluate(p, crate::problem::Want::Gradient).expect("a sound case");
        let evaluation = start.elapsed().as_secs_f64();
        let start = cpu();
        const REPEATS: u32 = 20;
        for _ in 0..REPEATS {
            state(&problem.states[0], &analysed.mesh, &analysed.solutions[0]).expect("sound");
            analysis(&analysed, &problem.constraints).expect("sound");
        }
        let checks = start.elapsed().as_secs_f64() / f64::from(REPEATS);
        println!(
            "checks {:.2} ms of {:.1} ms: {:.2} %",
            1e3 * checks,
            1e3 * evaluation,
            100.0 * checks / evaluation
        );
        assert!(checks < 0.01 * evaluation, "{checks} s of {evaluation} s");
    }
}
