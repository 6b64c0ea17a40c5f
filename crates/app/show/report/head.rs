//! The head of the page: how the run ended, and its key figures.

use maud::Markup;

use super::data::{RunData, Snapshot};
use super::iron;
use super::markup::{Card, header};
use super::observed;
use super::plane::bounds;
use super::tables::of_first_state;
use super::ticks::{self, decimals_of, duration, group_digits, number, threads, trim_zeros};
use super::window::inside;
use super::words;
use crate::build::Outline;
use crate::config::Objective;
use crate::files::{
    Accuracy, CrossCheck, ErrorBars, ObjectiveResult, RunStatus, StopReason, Verdict, VerificationMesh,
};

/// Title, status, what was done in a sentence, and key figures.
pub(super) fn head(data: &RunData) -> Markup {
    let kind = if data.is_run() { "Shape optimisation" } else { "Field analysis" };
    let (class, status) = status(data);
    let variables = data.designs[1].as_ref().or(data.designs[0].as_ref()).map(Vec::len);
    let lead = words::summary(&data.config, variables, data.is_run());
    let objective = data.result.as_ref().and_then(|result| result.objective.as_ref());
    let mut cards = if data.is_run() {
        run_cards(data, objective)
    } else {
        objective.map(|o| ("objective F", number(o.best, 5), unit(data).to_owned())).into_iter().collect()
    };
    if let Some(seconds) = data.manifest.seconds {
        cards.push(("time", duration(seconds), format!("on {}", threads(data.manifest.threads))));
    }
    if let Some(result) = &data.result {
        let unknowns = format!("{} unknowns", group_digits(result.mesh.unknowns));
        cards.push(("tetrahedra", group_digits(result.mesh.tets), unknowns));
    } else if let Some(mesh) = &data.manifest.mesh {
        cards.push(("tetrahedra", group_digits(mesh.tets), format!("{} nodes", group_digits(mesh.nodes))));
    }
    cards.extend(iron::cards(data));
    if let Ok(outline) = &data.outline {
        cards.extend(mean_card(data, outline));
        cards.push(size_card(data, outline));
    }
    header(kind, &data.config.title, (class, &status), &lead, &cards)
}

/// A class, and how far the run is in words.
fn status(data: &RunData) -> (&'static str, String) {
    let Some(result) = &data.result else {
        let (class, text) = match data.manifest.status {
            RunStatus::Running => ("fair", "Still running or interrupted: there is no result yet"),
            RunStatus::Interrupted => ("fair", "Interrupted before there was a result"),
            RunStatus::Failed => ("bad", "Failed before there was a result"),
            _ => ("bad", "There is no result.json, though the run has ended"),
        };
        return (class, text.to_owned());
    };
    let reason = result.stop_reason.describe();
    if data.manifest.status == RunStatus::Running {
        return ("fair", format!("The search has ended: {reason}; what it found is still to be checked"));
    }
    match result.status {
        RunStatus::Converged => ("good", format!("Converged: {reason}")),
        RunStatus::Done => ("good", "Done".to_owned()),
        RunStatus::Stopped if result.stop_reason == StopReason::Infeasible => {
            ("bad", format!("Stopped: {reason}"))
        }
        RunStatus::Stopped => ("fair", format!("Stopped at a limit: {reason}; the results are valid")),
        RunStatus::Interrupted => ("fair", "Interrupted: the best design so far is shown".to_owned()),
        RunStatus::Failed => ("bad", format!("Failed: {reason}; the best design before is shown")),
        RunStatus::Running => ("fair", "Not ended".to_owned()),
    }
}

/// The unit of the objective, where all its terms have the same.
fn unit(data: &RunData) -> &'static str {
    data.config.objective.as_ref().map(Objective::shown_unit).unwrap_or_default()
}

/// What an optimisation has gained, and at which cost.
fn run_cards(data: &RunData, objective: Option<&ObjectiveResult>) -> Vec<Card> {
    let mut cards = Vec::new();
    if let Some(ratio) = data.ratio() {
        let remark = objective.map_or("so far".to_owned(), |o| {
            format!("{} → {} {}", number(o.initial, 4), number(o.best, 4), unit(data))
        });
        cards.push(("objective F / F₀", ticks::ratio(ratio), remark));
    }
    cards.extend(objective.map(|objective| finer_mesh_card(data, objective)));
    cards.extend(
        objective.zip(data.accuracy()).and_then(|(objective, accuracy)| gain_card(data, objective, accuracy)),
    );
    let (evaluations, iterations) = match (&data.result, data.history.last()) {
        (Some(result), _) => (result.evaluations, result.iterations),
        (None, Some(row)) => (row.evaluation.saturating_add(1), row.iteration),
        (None, None) => (0, 0),
    };
    let best = data.best.map_or(String::new(), |best| format!("; best: {best}"));
    cards.push(("evaluations", evaluations.to_string(), format!("{iterations} iterations improved{best}")));
    cards
}

/// Whether the gain is the shape's, with the error bar; `None` where nothing says so.
fn gain_card(data: &RunData, objective: &ObjectiveResult, accuracy: &Accuracy) -> Option<Card> {
    let verdict = match (accuracy.verdict?, accuracy.reservation(objective)) {
        (Verdict::NotConfirmed, _) => "NOT CONFIRMED",
        (Verdict::Confirmed, None) => "confirmed",
        (Verdict::Confirmed, Some(reservation)) => reservation,
    };
    let bar = accuracy.error_bars(objective.ratio).map(|bars| match bars {
        ErrorBars::Ratio(bar) => {
            format!("F / F₀ = {} ± {}", ticks::ratio(objective.ratio), number(bar, 2))
        }
        ErrorBars::Values([of_initial, of_best]) => {
            let [initial, best] = [objective.initial, objective.best].map(|value| number(value, 4));
            let [of_initial, of_best] = [of_initial, of_best].map(|bar| number(bar, 2));
            format!("F₀ = {initial} ± {of_initial}, F = {best} ± {of_best} {}", unit(data))
        }
    });
    let other = accuracy.cross_check.as_ref().map(|check| {
        let CrossCheck { elements, order, ratio, by_estimate, .. } = check;
        let source = if *by_estimate { ", by the estimate" } else { "" };
        format!("{} by {elements} elements of order {order}{source}", ticks::ratio(*ratio))
    });
    let refined = match (accuracy.refinements, accuracy.within_tolerance) {
        (_, None) => None,
        (count, Some(true)) => Some(format!("within the tolerance after {count} refinements")),
        (count, Some(false)) => Some(format!("beyond the tolerance after {count} refinements")),
    };
    let facets = accuracy
        .facets
        .as_ref()
        .map(|facets| format!("facets up to {} mm off {}", number(1e3 * facets.off_m, 2), facets.surface));
    let excess = accuracy.excess.map(|[initial, best]| {
        let with_all = (objective.best + best) / (objective.initial + initial);
        format!("{} with what impedance surfaces leave out of losses", ticks::ratio(with_all))
    });
    let remark: Vec<String> = [bar, other, refined, facets, excess].into_iter().flatten().collect();
    Some(("gain", verdict.to_owned(), remark.join("; ")))
}

/// The gain on a mesh that was not optimised on.
fn finer_mesh_card(data: &RunData, objective: &ObjectiveResult) -> Card {
    let (value, remark) = match (objective.verified_ratio, &objective.verification) {
        (Some(ratio), Some(v)) => {
            let (parts, tets) = (trim_zeros(v.refinement, 3), group_digits(v.tets));
            let violated = v.violated().count();
            let violated = match violated {
                0 => String::new(),
                1 => ", a constraint violated".to_owned(),
                count => format!(", {count} constraints violated"),
            };
            let remark = match v.mesh {
                VerificationMesh::Fresh => {
                    format!("cells over the device in {parts} parts each way, {tets} tetrahedra{violated}")
                }
                VerificationMesh::Cut => {
                    format!("both shapes on the elements of the run, cut into {tets} tetrahedra{violated}")
                }
            };
            (ticks::ratio(ratio), remark)
        }
        (Some(ratio), None) => (ticks::ratio(ratio), "the initial shape is the best".to_owned()),
        (None, ..) if !data.config.output.is_verified_on_finer_cells() => {
            let parts = data.config.output.verify_refinement;
            ("not checked".to_owned(), format!("output.verify_refinement is {parts}"))
        }
        _ => ("not checked".to_owned(), "see the messages at the end of the run".to_owned()),
    };
    (
        if objective.is_verified_on_cut_elements() { "on cut elements" } else { "on a fresh mesh" },
        value,
        remark,
    )
}

/// Mean |B| over what is observed, before and after, where the fields are there.
fn mean_card(data: &RunData, outline: &Outline) -> Option<Card> {
    let mean = |field: &Result<Snapshot, String>| {
        let mean = observed::mean_flux_density(data, outline, field.as_ref().ok()?)?;
        Some(format!("{} mT", number(1e3 * mean, 4)))
    };
    let [before, after] = data.fields.each_ref().map(mean);
    let state = data.result.as_ref().map(of_first_state).unwrap_or_default();
    let regions = observed::region_names(data).join(", ") + &state;
    let remark = before.map_or(regions.clone(), |before| format!("{before} before, in {regions}"));
    Some(("mean |B|", after?, remark))
}

/// Extents of the design surface and of the mesh, without the shell of open space.
fn size_card(data: &RunData, outline: &Outline) -> Card {
    let extents = |[low, high]: [[f64; 3]; 2]| [0, 1, 2].map(|d| high[d] - low[d]);
    let shown = |extents: &[f64]| {
        let extents: Vec<f64> = extents.iter().map(|e| 1e3 * e).collect();
        let decimals = decimals_of(&extents, 1);
        extents.iter().map(|e| trim_zeros(*e, decimals)).collect::<Vec<_>>().join(" × ")
    };
    let mesh = shown(&extents(inside(&data.config, &outline.full_mesh)));
    let Some(design) = &outline.design else {
        let of_what =
            if data.config.open.is_some() { "of the mesh inside of open space" } else { "of the whole mesh" };
        return ("size", format!("{mesh} mm"), of_what.to_owned());
    };
    let nodes = design.surface.nodes().iter().map(|&n| outline.full_mesh.point(n));
    let surface: Vec<f64> = extents(bounds(nodes)).into_iter().filter(|e| *e > 1e-9).collect();
    ("design surface", format!("{} mm", shown(&surface)), format!("in a mesh of {mesh} mm"))
}
