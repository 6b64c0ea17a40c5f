//! The end of a run, or of a single analysis, in a few lines.

use super::{Colour, Paint, Started, probes};
use crate::config::{Goal, Objective};
use crate::output::{ConstraintResult, RunResult, RunStatus};

/// What the objective of a run is called, and its unit.
#[derive(Debug, Clone, Default)]
pub(super) struct Named {
    name: String,
    /// Behind a value, with a blank before it; empty where terms of several units are added.
    unit: String,
}

impl Named {
    pub(super) fn of(started: &Started<'_>) -> Self {
        started.objective.map_or_else(Self::default, Self::objective)
    }

    fn objective(objective: &Objective) -> Self {
        let goal = match objective.goal {
            Goal::Minimise => "minimise",
            Goal::Maximise => "maximise",
        };
        let terms = objective.terms();
        let unit = terms[0].functional.dimension().si_unit();
        let is_one_unit = terms.iter().all(|term| term.functional.dimension().si_unit() == unit);
        let name = match terms {
            [term] => {
                let region = term.functional.region.as_deref().map(|region| format!(" in {region}"));
                format!("{goal} {}{}", term.functional.kind.name(), region.unwrap_or_default())
            }
            _ => format!("{goal} a sum of {} terms", terms.len()),
        };
        Self { name, unit: if is_one_unit { format!(" {unit}") } else { String::new() } }
    }
}

/// The lines, without a blank one before them.
pub(super) fn lines(result: &RunResult, named: &Named, paint: Paint) -> Vec<String> {
    let mut lines = Vec::new();
    let mut row = |name: &str, text: String| lines.push(format!("{name:<22} {text}"));
    let is_run = result.command != "solve";
    if is_run {
        let colour = match result.status {
            RunStatus::Converged | RunStatus::Done => Colour::Good,
            RunStatus::Failed => Colour::Bad,
            _ => Colour::Warning,
        };
        row("ended", paint.paint(colour, result.stop_reason.describe()));
    } else {
        let frequencies: Vec<String> = result.frequencies_hz.iter().map(|f| format!("{f} Hz")).collect();
        row("analysed at", frequencies.join(", "));
    }
    match &result.objective {
        Some(objective) if is_run => {
            let unit = &named.unit;
            if !named.name.is_empty() {
                row("objective", named.name.clone());
            }
            row("objective, initial", format!("{:.6e}{unit}", objective.initial));
            let evaluation = objective.best_evaluation;
            row("objective, best", format!("{:.6e}{unit} at evaluation {evaluation}", objective.best));
            row("F/F0", paint.paint(Colour::Strong, &format!("{:.5}", objective.ratio)));
            if let Some(fresh) = &objective.verification {
                row("F/F0 on a fresh mesh", format!("{:.5} ({} tetrahedra)", fresh.ratio, fresh.tets));
            }
        }
        Some(objective) => {
            let value = paint.paint(Colour::Strong, &format!("{:.6e}{}", objective.best, named.unit));
            // Of an analysis it is a measured quantity.
            let what = named.name.split_once(' ').map_or("", |(_, what)| what);
            row("value", format!("{value}  {what}").trim_end().to_owned());
        }
        None => {}
    }
    for constraint in &result.constraints {
        let ConstraintResult { name, value, bound, satisfied } = constraint;
        let verdict = if *satisfied { "kept".to_owned() } else { paint.paint(Colour::Bad, "NOT KEPT") };
        row("constraint", format!("{name}: {value:.6e}, bound {bound:.6e}, {verdict}"));
    }
    for state in states(result) {
        let at = if result.states.len() > 1 { format!(" at {} Hz", state.0) } else { String::new() };
        for (region, loss) in state.1 {
            row("loss", format!("{loss:.6e} W in {region}{at}"));
        }
    }
    let mesh = &result.mesh;
    if is_run {
        row("evaluations", format!("{} ({} iterations)", result.evaluations, result.iterations));
        let (last, first) = (mesh.worst_quality_final, mesh.worst_quality_initial);
        row("worst quality", format!("{last:.4}, was {first:.4}"));
    } else {
        row("worst quality", format!("{:.4}", mesh.worst_quality_final));
    }
    let methods = result.linear_solver.methods.first().map(|method| format!(", {method}"));
    let residual = result.linear_solver.worst_residual;
    row("worst residual", format!("{residual:.1e}{}", methods.unwrap_or_default()));
    row("time", times(result));
    row("peak memory", format!("{:.0} MiB", result.peak_memory_bytes as f64 / (1024.0 * 1024.0)));
    let frequency = result.frequencies_hz.first().copied().unwrap_or_default();
    lines.extend(probes::lines(&result.probes, frequency));
    lines
}

/// Losses by frequency [Hz].
fn states(result: &RunResult) -> Vec<(f64, &std::collections::BTreeMap<String, f64>)> {
    if result.states.is_empty() {
        let frequency = result.frequencies_hz.first().copied().unwrap_or_default();
        return vec![(frequency, &result.losses_w)];
    }
    result.states.iter().map(|state| (state.frequency_hz, &state.losses_w)).collect()
}

/// The whole time, and the parts that took a tenth of it or more.
fn times(result: &RunResult) -> String {
    let of = |name: &str| result.timings_s.get(name).copied().unwrap_or_default();
    let total = of("total");
    let parts = ["setup", "remesh", "assembly", "factor", "state", "adjoint", "gradient", "verification"];
    let shown: Vec<String> = parts
        .into_iter()
        .filter(|part| of(part) >= 0.1 * total && of(part) > 0.0)
        .map(|part| format!("{part} {:.1}", of(part)))
        .collect();
    let shown = if shown.is_empty() { String::new() } else { format!(" ({})", shown.join(", ")) };
    format!("{total:.1} s{shown}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_names_the_outcome() {
        let named = Named { name: "minimise loss in plate".to_owned(), unit: " W".to_owned() };
        let text = lines(&crate::output::example_result(), &named, Paint::PLAIN).join("\n");
        for fragment in [
            "the objective has converged",
            "minimise loss in plate",
            "1.000000e0 W at evaluation 7",
            "F/F0                   0.50000",
            "8 (7 iterations)",
            "in plate",
            "0.50000 (147000 tetrahedra)",
        ] {
            assert!(text.contains(fragment), "{fragment}\n{text}");
        }
    }

    #[test]
    fn an_analysis_does_not_read_like_an_optimisation() {
        let result = RunResult { command: "solve".to_owned(), ..crate::output::example_result() };
        let named = Named { name: "minimise loss in plate".to_owned(), unit: " W".to_owned() };
        let text = lines(&result, &named, Paint::PLAIN).join("\n");
        assert!(text.contains("value                  1.000000e0 W  loss in plate"), "{text}");
        for word in ["F/F0", "ended", "iterations", "minimise", "was "] {
            assert!(!text.contains(word), "{word}\n{text}");
        }
    }
}
