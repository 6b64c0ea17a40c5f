//! Checks that what an evaluation has computed is finite, before an optimiser, a history or a file sees any of it.
//!
//! Linear solvers audit their residuals, and a mesh its volumes; a solution of them is finite. What is computed from
//! it may still overflow: the square of a large field, a weighted sum, the norm of a gradient. Each is refused here by
//! name, as [`Error::NotFinite`], so that no file holds a `NaN`, an infinity, or the `null` that JSON writes for them. One
//! pass over unknowns, nodes and variables; docs/robustness.md has what it costs and what a run does then.

use fluxmorph_geometry::Readable;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::{FieldModel, FieldState, SolverError};

use crate::constraint::Constraint;
use crate::error::Error;
use crate::objective::Term;
use crate::problem::Analysis;

/// What to do about a field that is not finite.
const FIELD: &str = "expected a finite number; check currents, material data and units";

/// What to do about an objective or constraint that is not finite.
const SUM: &str = "expected a finite number; check weights, currents, frequencies, material data and units";

/// `the state at 60 Hz`, or another problem there.
pub(crate) fn problem_name(what: &str, model: &FieldModel) -> String {
    let problem = match model.setup().frequency {
        0.0 => format!("{what} of the static field"),
        frequency => format!("{what} at {} Hz", Readable(frequency)),
    };
    match &model.setup().load_case {
        Some(name) => format!("{problem} under the load `{name}`"),
        None => problem,
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

/// Potentials [T m] up to here have finite fields, losses and squares of both, in elements of any size that a mesh
/// can have (1e-30 m) and for any material (1e60 S/m).
const SAFE_POTENTIAL: f64 = 1e60;

/// Checks that flux density and loss of every element, and their squares, are finite.
///
/// One pass over the unknowns; over the elements only where a potential is beyond `SAFE_POTENTIAL`.
///
/// # Errors
/// [`Error::NotFinite`] names the first element's quantity, region and frequency.
pub fn state((model, mesh, solution): FieldState<'_>) -> Result<(), Error> {
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

/// Checks that values, gradients and their norms, and mesh quality of an evaluation are finite.
///
/// # Errors
/// [`Error::NotFinite`] names the first that is not.
pub fn analysis(analysis: &Analysis, constraints: &[Constraint]) -> Result<(), Error> {
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
    for force in &analysis.forces {
        if let Some((column, value)) = force.columns().find(|(_, value)| !value.is_finite()) {
            return Err(Error::NotFinite { what: format!("`{column}`"), value, expected: FIELD });
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

/// Checks that dF/dx is finite at every node.
///
/// # Errors
/// [`Error::NotFinite`] names the first node.
pub fn sensitivity(of: &str, nodal: &[Point]) -> Result<(), Error> {
    let Some(node) = nodal.iter().position(|g| g.iter().any(|g| !g.is_finite())) else { return Ok(()) };
    let value = nodal[node].into_iter().find(|g| !g.is_finite()).unwrap_or_default();
    Err(Error::NotFinite {
        what: format!("the derivative of {of} with respect to the position of node {node}"),
        value,
        expected: SUM,
    })
}

/// A gradient and its norm.
fn derivative(of: &str, gradient: &[f64]) -> Result<(), Error> {
    let refused = |what: String, value: f64| Err(Error::NotFinite { what, value, expected: SUM });
    if let Some((k, &value)) = gradient.iter().enumerate().find(|(_, g)| !g.is_finite()) {
        return refused(format!("the derivative of {of} with respect to design variable {k}"), value);
    }
    let square: f64 = gradient.iter().map(|g| g * g).sum();
    if square.is_finite() { Ok(()) } else { refused(format!("the squared gradient norm of {of}"), square) }
}
