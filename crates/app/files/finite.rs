//! Checks that every number of a result is finite before it is published.

use fluxmorph_optimizer::Error;

use super::result::RunResult;
use super::state_result::ProbeResult;

/// What to do about a number that is not finite.
const SUM: &str = "expected a finite number; check weights, currents and units";

/// Checks every number of a result that is to be published.
///
/// # Errors
/// [`Error::NotFinite`] names the first that is not finite.
pub(crate) fn check_finite(result: &RunResult) -> Result<(), Error> {
    let RunResult { objective, constraints, design, mesh, probes, losses_w, states, initial, .. } = result;
    let states = || states.iter().chain(initial);
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
    let probes = probes.iter().chain(states().flat_map(|state| &state.probes));
    numbers.extend(probes.flat_map(at_probe));
    let losses = losses_w.iter().chain(states().flat_map(|state| &state.losses_w));
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
    use crate::files::example_result as example;

    fn named(error: Result<(), Error>) -> String {
        let error = error.expect_err("it is no number");
        assert!(error.is_numerical());
        error.to_string()
    }

    #[test]
    fn a_result_with_a_number_that_is_none_is_not_published() {
        assert!(check_finite(&example()).is_ok());
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
            let message = named(check_finite(&damaged));
            assert!(message.contains(name), "{name}: {message}");
        }
    }
}
