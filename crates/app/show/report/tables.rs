//! Tables of the page: evaluations, constraints, terms, losses, probes, skin depths.

use maud::{Markup, html};

use super::circuits::circuits;
use super::data::RunData;
use super::markup::{note, table};
use super::ticks::{decimals_of, given, number, trim_zeros};
use super::{harmonics, iron};
use crate::build::{Audited, Outline, PermeabilityOf, skin_warnings};
use crate::config::{Constraint, Limit, Objective, ObjectiveKind, RegionModel, Term};
use crate::files::{ConstraintResult, ProbeResult, RunResult, SAFETY, StateResult, TermResult};
use crate::show::Evaluation;
use crate::show::states::State;

/// Head of a column of error bars, in the unit of the column before.
pub(super) const ERROR_BAR: &str = "error bar (estimated)";

/// Rows of a table that is shown at once; a longer one is opened by the reader.
const SHOWN: usize = 12;

/// Points of probes that a table holds.
const MOST_POINTS: usize = 200;

/// Rows that a table holds; of the evaluations the first and the last half of so many.
pub(super) const MOST_ROWS: usize = 800;

/// A table under its title, nothing where it is empty; of a very long one the beginning.
pub(super) fn titled_table(title: &str, head: &[&str], rows: &[Vec<String>], most: usize) -> Markup {
    let shown = rows.len().min(most);
    html! {
        @if !rows.is_empty() {
            h3 { (title) }
            @if shown < rows.len() { (note(&format!("The first {shown} of {} rows; result.json has all.", rows.len()))) }
            (table(head, &rows[..shown], None))
        }
    }
}

/// What a column says of an evaluation.
type Cell<'a> = Box<dyn Fn(&Evaluation) -> String + 'a>;

/// The columns of the table of evaluations.
fn columns<'a>(rows: &'a [Evaluation], objective: &'a str) -> Vec<(&'a str, Cell<'a>)> {
    fn column<'a>(title: &'a str, cell: impl Fn(&Evaluation) -> String + 'a) -> (&'a str, Cell<'a>) {
        (title, Box::new(cell))
    }
    let thickness = |row: &Evaluation| {
        let [low, high] = [row.min_thickness_m?, row.max_thickness_m?].map(|t| 1e3 * t);
        let decimals = decimals_of(&[low, high], 2);
        Some(format!("{}–{}", trim_zeros(low, decimals), trim_zeros(high, decimals)))
    };
    let mut all = vec![
        column("evaluation", |row| row.evaluation.to_string()),
        column("iteration", |row| row.iteration.to_string()),
        (objective, Box::new(|row| number(row.objective, 6))),
        column("F / F₀", |row| number(row.ratio, 4)),
        column("‖dF/dp‖ [unit of F per m]", |row| number(row.gradient_norm, 3)),
        column("step [mm]", |row| number(1e3 * row.step_norm, 3)),
        column("worst quality", |row| number(row.worst_quality, 3)),
    ];
    if rows.iter().any(|row| row.min_thickness_m.is_some()) {
        all.push(column("thickness [mm]", move |row| thickness(row).unwrap_or_default()));
    }
    all.extend([
        column("inversion at", |row| {
            row.step_to_inversion.map_or("never".to_owned(), |step| format!("{} ×", number(step, 3)))
        }),
        column("solver iterations", |row| row.linear_iterations.to_string()),
        column("time [s]", |row| number(row.seconds, 3)),
    ]);
    for name in rows.iter().take(1).flat_map(|row| row.constraints.keys()) {
        let value = |row: &Evaluation| row.constraints.get(name).map(|v| number(*v, 3));
        all.push(column(name.strip_prefix("c_").unwrap_or(name), move |row| value(row).unwrap_or_default()));
    }
    all
}

/// The rows of the history.
pub(super) fn evaluations(data: &RunData) -> Markup {
    let rows = &data.history;
    let unit = data.config.objective.as_ref().and_then(Objective::si_unit);
    let objective = unit.map_or("F".to_owned(), |unit| format!("F [{unit}]"));
    let (titles, cells): (Vec<&str>, Vec<Cell<'_>>) = columns(rows, &objective).into_iter().unzip();
    let kept: Vec<&Evaluation> = if rows.len() > MOST_ROWS {
        rows[..MOST_ROWS / 2].iter().chain(&rows[rows.len() - MOST_ROWS / 2..]).collect()
    } else {
        rows.iter().collect()
    };
    let marked = kept.iter().position(|row| Some(row.evaluation) == data.best);
    let body: Vec<Vec<String>> =
        kept.iter().map(|row| cells.iter().map(|cell| cell(row)).collect()).collect();
    let left_out = rows.len() - kept.len();
    let table = table(&titles, &body, marked);
    html! {
        @if left_out > 0 {
            (note(&format!("{left_out} rows in the middle are left out here; history.csv has all.")))
        }
        @if body.len() <= SHOWN {
            (table)
        } @else {
            details { summary { "All " (rows.len()) " evaluations" } (table) }
        }
        (note(
            "The best design is marked. An iteration is an evaluation that improves on all before; “inversion at” is the \
             multiple of the straight motion from the undeformed mesh at which the first element would invert."
        ))
    }
}

/// The same state of the initial design; `None` for an analysis.
fn initial<'r>(state: &State<'_>, result: &'r RunResult) -> Option<&'r StateResult> {
    let is_same =
        |other: &&StateResult| other.frequency_hz == state.frequency && other.load.as_deref() == state.load;
    result.initial.iter().find(is_same)
}

/// A load, or a frequency.
pub(super) fn words_of(load: Option<&str>, frequency: f64) -> String {
    load.map_or_else(|| hertz(frequency), str::to_owned)
}

/// What stands behind the title of what is of one of several states: its load, else its frequency.
pub(super) fn behind_title(state: &State<'_>) -> String {
    match state.load {
        _ if !state.is_one_of_several => String::new(),
        Some(load) => format!(", under the load {load}"),
        None => format!(", at {}", hertz(state.frequency)),
    }
}

/// The same of what is of the first state.
pub(super) fn of_first_state(result: &RunResult) -> String {
    State::all(result).first().map(behind_title).unwrap_or_default()
}

/// What the column of a state is headed with.
fn head_of_state(result: &RunResult) -> &'static str {
    if result.loads.is_empty() { "frequency" } else { "load" }
}

/// What the result says beside the objective: constraints and terms of the objective, losses and probes.
pub(super) fn outcome(data: &RunData, result: &RunResult) -> Markup {
    let states = State::all(result);
    html! {
        (constraints(result, &data.config.constraints))
        @if let Some(objective) = &result.objective { (terms(&objective.terms, data.config.objective.as_ref())) }
        (circuits(result, &states))
        (harmonics::figures(&data.config, result))
        (losses(result, &states))
        @for state in &states { (iron::forces(state)) (iron::saturation(state)) }
        (probes(result, &states))
    }
}

fn constraints(result: &RunResult, constraints: &[Constraint]) -> Markup {
    let checked = result.objective.as_ref().and_then(|objective| objective.verification.as_ref());
    let checked: &[ConstraintResult] = checked.map_or(&[], |found| &found.constraints);
    let verdict = |c: &ConstraintResult| if c.satisfied { "satisfied" } else { "violated" };
    let row = |c: &ConstraintResult| {
        let limit = constraints.iter().find(|own| own.is_called(&c.name)).map(|own| &own.limit);
        let (unit, factor) = constraint_unit(limit);
        let on_other = checked.iter().find(|own| own.name == c.name);
        let shown = |v: f64| format!("{} {unit}", number(factor * v, 5));
        let is_shared = limit.is_some_and(Limit::is_share_of_initial);
        // Its own bound there is a share of another initial value.
        let of_bound = |own: &ConstraintResult| {
            if is_shared { format!(" of {}", shown(own.bound)) } else { String::new() }
        };
        let on_other = on_other.map(|own| format!("{}{}, {}", shown(own.value), of_bound(own), verdict(own)));
        let [value, bound] = [c.value, c.bound].map(shown);
        // The errors of a value and of a bound that is a share of the initial one cancel in part.
        let what = if is_shared { "difference " } else { "" };
        let bar = |error: f64| format!("{what}± {} {unit}", number(factor * SAFETY * error.abs(), 2));
        let bar = c.error_estimate.map(bar);
        let mut row = vec![c.name.clone(), value, bar.unwrap_or_default(), bound, verdict(c).to_owned()];
        if !checked.is_empty() {
            row.push(on_other.unwrap_or_default());
        }
        row
    };
    let rows: Vec<Vec<String>> = result.constraints.iter().map(row).collect();
    let head = ["constraint", "value", ERROR_BAR, "bound", "", "on the other mesh"];
    let columns = if checked.is_empty() { 5 } else { 6 };
    titled_table("Constraints at the best design", &head[..columns], &rows, MOST_ROWS)
}

/// The unit that a constraint is shown in, and its number in one of SI.
fn constraint_unit(limit: Option<&Limit>) -> (&'static str, f64) {
    match limit {
        Some(Limit::Functional { functional, .. }) => match functional.kind {
            ObjectiveKind::Volume => ("cm³", 1e6),
            _ => (functional.dimension().shown_unit(), 1.0),
        },
        Some(Limit::Thickness { .. }) => ("mm", 1e3),
        None => ("in SI", 1.0),
    }
}

fn terms(terms: &[TermResult], objective: Option<&Objective>) -> Markup {
    let written = objective.map_or(&[][..], Objective::terms);
    let row = |(k, t): (usize, &TermResult)| {
        // A worst case has what is written once a load.
        let is_own = |own: &&Term| {
            let functional = &own.functional;
            let is_at = functional.frequency.is_none_or(|own| Some(own) == t.frequency)
                && (functional.load.is_none() || functional.load == t.load);
            let coils = functional.coils.as_deref().unwrap_or_default();
            let is_alike = functional.kind.name() == t.kind && own.weight == t.weight;
            is_alike && is_at && functional.region == t.region && coils == t.coils
        };
        let own = if written.len() == terms.len() { written.get(k) } else { written.iter().find(is_own) };
        let own = own.map(|term| &term.functional);
        vec![
            t.kind.replace('_', " "),
            match (&t.region, &t.coils[..]) {
                (Some(region), _) => region.clone(),
                (None, []) => "whole mesh".to_owned(),
                (None, coils) => coils.join(", "),
            },
            match (&t.load, t.frequency) {
                (Some(load), _) => load.clone(),
                (None, None) if own.is_some_and(|own| !own.kind.is_of_field()) => "–".to_owned(),
                (None, frequency) => frequency.map_or("all".to_owned(), hertz),
            },
            given(t.weight),
            number(t.value, 6) + &own.map_or(" in SI".to_owned(), |own| own.dimension().behind_value()),
            number(t.weight * t.value, 6),
        ]
    };
    let rows: Vec<Vec<String>> = terms.iter().enumerate().map(row).collect();
    let has_loads = terms.iter().any(|term| term.load.is_some());
    let state = if has_loads { "load" } else { "frequency" };
    let head = ["term", "region", state, "weight", "value", "weighted"];
    titled_table("Terms of the objective at the best design", &head, &rows, MOST_ROWS)
}

fn losses(result: &RunResult, states: &[State<'_>]) -> Markup {
    let row = |state: &State<'_>, (region, loss): (&String, &f64)| {
        let before = initial(state, result).and_then(|initial| initial.losses_w.get(region));
        let before = before.map_or(String::new(), |before| number(*before, 5));
        let error = state.errors.and_then(|errors| errors.losses_w.get(region));
        vec![region.clone(), words_of(state.load, state.frequency), before, number(*loss, 5), bar(error, 1.0)]
    };
    let rows: Vec<Vec<String>> =
        states.iter().flat_map(|state| state.losses.iter().map(|entry| row(state, entry))).collect();
    let head = ["region", head_of_state(result), "initial [W]", "loss [W]", ERROR_BAR];
    titled_table("Eddy-current losses of the part that is modelled", &head, &rows, MOST_ROWS)
}

fn probes(result: &RunResult, states: &[State<'_>]) -> Markup {
    let of = |state: &State<'_>| {
        let initial = initial(state, result);
        let before = |probe: &ProbeResult| initial?.probes.iter().find(|initial| initial.name == probe.name);
        state.probes.iter().flat_map(|probe| rows_of(state, probe, before(probe))).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = states.iter().flat_map(of).collect();
    let head = [
        "probe",
        "x, y, z [mm]",
        head_of_state(result),
        "initial |B| [mT]",
        "|B| [mT]",
        ERROR_BAR,
        "Bx [mT]",
        "By [mT]",
        "Bz [mT]",
    ];
    titled_table("Flux density at the probes, best design", &head, &rows, MOST_POINTS)
}

/// The error bar of a value with an estimated error, in a unit of which so many are one of SI; empty where none is known.
pub(super) fn bar(error: Option<&f64>, factor: f64) -> String {
    error.map_or(String::new(), |error| format!("± {}", number(factor * SAFETY * error.abs(), 2)))
}

fn hertz(frequency: f64) -> String {
    format!("{} Hz", trim_zeros(frequency, 6))
}

/// Magnitude of B at a point of a probe [T]; `None` outside the mesh, and where a file was cut short.
fn magnitude(probe: &ProbeResult, k: usize) -> Option<f64> {
    let (re, im) = (probe.b_re_t.get(k)?.as_ref()?, probe.b_im_t.get(k)?.as_ref()?);
    Some(re.iter().chain(im).map(|c| c * c).sum::<f64>().sqrt())
}

/// The rows of one probe, with its field at the initial design.
fn rows_of(state: &State<'_>, probe: &ProbeResult, initial: Option<&ProbeResult>) -> Vec<Vec<String>> {
    // A file may be cut short.
    let count = probe.points_m.len().min(probe.b_re_t.len()).min(probe.b_im_t.len());
    let component = |re: f64, im: f64| {
        let real = number(1e3 * re, 3);
        let sign = if im < 0.0 { "−" } else { "+" };
        if state.frequency == 0.0 { real } else { format!("{real} {sign} {} j", number(1e3 * im.abs(), 3)) }
    };
    let places: Vec<_> = probe.points_m.iter().map(|point| point.map(|c| 1e3 * c)).collect();
    let decimals = decimals_of(places.as_flattened(), 2);
    let row = |k: usize| {
        let place = places[k].map(|c| trim_zeros(c, decimals)).join(", ");
        let mut cells = vec![probe.name.clone(), place, words_of(state.load, state.frequency)];
        let millitesla = |size: Option<f64>| size.map_or(String::new(), |size| number(1e3 * size, 4));
        cells.push(millitesla(initial.and_then(|initial| magnitude(initial, k))));
        if let (Some(re), Some(im)) = (probe.b_re_t[k], probe.b_im_t[k]) {
            let error = state.errors.and_then(|errors| errors.probes_t.get(&probe.name)?.get(k)?.as_ref());
            cells.push(millitesla(magnitude(probe, k)));
            cells.push(bar(error, 1e3));
            cells.extend((0..3).map(|d| component(re[d], im[d])));
        } else {
            cells.extend(["outside the moved mesh", "", "", "", ""].map(str::to_owned));
        }
        cells
    };
    (0..count).map(row).collect()
}

/// The skin-depth audit.
pub(super) fn skin(outline: &Outline, result: Option<&RunResult>) -> Markup {
    if outline.audits.is_empty() {
        return html! { p { "No region conducts at a frequency above zero: there are no skin depths to resolve." } };
    }
    let has_several = outline.audits.iter().any(|own| own.frequency != outline.audits[0].frequency);
    let row = |audited: &Audited| {
        let a = &audited.audit;
        let at = if has_several { format!(" at {}", hertz(audited.frequency)) } else { String::new() };
        let model = match audited.model {
            RegionModel::Volume => "meshed",
            RegionModel::Impedance => "surface impedance",
            RegionModel::Perfect => "perfect conductor",
        };
        let is_supposed = audited.permeability_of == PermeabilityOf::LargestOfCurve;
        let unsaturated = if is_supposed { " (unsaturated)" } else { "" };
        let [median, least] =
            [a.median_elements_per_skin_depth, a.least_elements_per_skin_depth].map(|n| number(n, 3));
        vec![
            format!("{}{at}", a.region),
            model.to_owned(),
            format!("{}{unsaturated}", number(1e3 * a.skin_depth, 3)),
            if audited.model == RegionModel::Volume {
                format!("{median} (least {least})")
            } else {
                "none inside".to_owned()
            },
            number(a.thickness_in_skin_depths, 3),
        ]
    };
    let rows: Vec<Vec<String>> = outline.audits.iter().map(row).collect();
    let head =
        ["conductor", "model", "skin depth [mm]", "elements per skin depth", "thickness 2V/S [skin depths]"];
    // What is supposed of iron with a B–H curve a result knows.
    let is_said = |own: &&Audited| result.is_none() || own.permeability_of == PermeabilityOf::Material;
    let finds_nothing = skin_warnings(outline.audits.iter()).is_empty();
    let warnings = skin_warnings(outline.audits.iter().filter(is_said));
    // What a result warns of stands above.
    let said = |warning: &String| result.is_some_and(|result| result.warnings.contains(warning));
    html! {
        (table(&head, &rows, None))
        @if finds_nothing { (note("The skin-depth audit of the undeformed mesh found nothing to warn about.")) }
        @for warning in warnings.iter().filter(|warning| !said(warning)) { p class="warning" { (warning) } }
    }
}
