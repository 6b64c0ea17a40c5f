//! The end of a run, or of a single analysis, in a few lines.

use fluxmorph_optimizer::body::BodyForce;

use super::states::{State, peaks};
use super::styles::{Styles, styled};
use super::{Started, probes};
use crate::config::{Constraint, Limit, Objective, each_once};
use crate::files::{
    Accuracy, Amplitude, CoilResult, ConstraintResult, CrossCheck, ErrorBars, HarmonicResult, LEAST_LEFT_OUT,
    MultipoleResult, ObjectiveResult, RunResult, RunStatus, SAFETY, SaturatedRegion, StateErrors, Verdict,
    Verification, VerificationMesh, WHERE_LEFT_OUT,
};
use crate::printable::printable;

/// What the objective of a run is called, and its unit.
#[derive(Debug, Clone, Default)]
pub(super) struct Named {
    name: String,
    /// Behind a value, with a blank before it; empty where terms of several units are added.
    unit: String,
    /// Whether no field has a say in it: another mesh has an opinion of its constraints alone.
    is_of_shape: bool,
    /// What is limited.
    constraints: Vec<Constraint>,
}

impl Named {
    pub(super) fn of(started: &Started<'_>) -> Self {
        let objective = started.objective.map_or_else(Self::default, Self::objective);
        Self { constraints: started.constraints.to_vec(), ..objective }
    }

    fn objective(objective: &Objective) -> Self {
        let goal = objective.goal_word();
        let terms = objective.terms();
        let name = match terms {
            [term] => {
                let region = term.functional.region.as_deref().map(|region| format!(" in {region}"));
                let which = objective.worst().map(|worst| format!("{worst} ")).unwrap_or_default();
                let (weight, kind) = (term.weight_in_words(), term.functional.kind.name());
                format!("{goal} {which}{weight}{kind}{}", region.unwrap_or_default())
            }
            _ => format!("{goal} {} of {} terms", objective.worst().unwrap_or("a sum"), terms.len()),
        };
        let name = printable(&name).into_owned();
        Self {
            name,
            unit: objective.behind_value(),
            is_of_shape: !objective.is_of_field(),
            constraints: Vec::new(),
        }
    }

    fn limit_of(&self, constraint: &str) -> Option<&Limit> {
        self.constraints.iter().find(|own| own.is_called(constraint)).map(|own| &own.limit)
    }

    /// Whether the bound of a constraint is a share of the initial value.
    fn has_shared_bound(&self, constraint: &str) -> bool {
        self.limit_of(constraint).is_some_and(Limit::is_share_of_initial)
    }

    /// The unit of a constraint, behind a value.
    fn unit_of(&self, constraint: &str) -> String {
        self.limit_of(constraint).map_or_else(String::new, |limit| limit.dimension().behind_value())
    }
}

/// Terms of an expansion that are shown; all are in `result.json`.
const MOST_TERMS: usize = 6;

/// A name and its text.
type Row = (&'static str, String);

/// The lines, without a blank one before them.
pub(super) fn lines(result: &RunResult, named: &Named, styles: &Styles) -> Vec<String> {
    let is_run = result.command != "solve";
    let mut rows = if is_run { run(result, named, styles) } else { analysis(result, named, styles) };
    rows.extend(result.constraints.iter().map(|constraint| constraint_row(constraint, named, styles)));
    let states: Vec<(String, State<'_>)> =
        State::all(result).into_iter().map(|state| (behind(&state), state)).collect();
    for (at, state) in &states {
        let loss = |(region, loss): (&String, &f64)| {
            let bar = bar(state.errors.and_then(|errors| errors.losses_w.get(region)), "W");
            ("loss", format!("{loss:.6e} W in {}{at}{bar}", printable(region)))
        };
        rows.extend(state.losses.iter().map(loss));
    }
    for (at, state) in &states {
        let vector = |[x, y, z]: [f64; 3]| format!("({x:.6e}, {y:.6e}, {z:.6e})");
        for BodyForce { name, force_n, torque_nm, .. } in state.forces {
            let on = format!("on {}{at}", printable(name));
            let error = state.errors.and_then(|errors| errors.forces.get(name));
            let bars = [bar(error.map(|own| &own.force_n), "N"), bar(error.map(|own| &own.torque_nm), "N m")];
            rows.push(("force", format!("{} N {on}{}", vector(*force_n), bars[0])));
            rows.push(("torque", format!("{} N m {on}{}", vector(*torque_nm), bars[1])));
        }
    }
    for (at, state) in &states {
        let Some(saturation) = state.saturation else { continue };
        rows.extend(saturation.regions.iter().map(|region| saturated(region, at)));
        rows.push(("Newton steps", format!("{}{at}", saturation.newton_steps)));
    }
    for (at, state) in &states {
        rows.extend(state.coils.iter().map(|coil| ("coil", coil_text(coil, state.errors) + at)));
    }
    for (at, state) in &states {
        let text = |set| expansion_text(set, state.errors) + at;
        rows.extend(state.multipoles.iter().map(|set| ("expansion", text(set))));
    }
    let shares = result.open.iter().flat_map(|open| &open.energy_share);
    for ((at, _), share) in states.iter().zip(shares) {
        rows.push(("energy in open space", format!("{:.2} %{at}", 100.0 * share)));
    }
    let (last, first) = (result.mesh.worst_quality_final, result.mesh.worst_quality_initial);
    if is_run {
        rows.push(("evaluations", format!("{} ({} iterations)", result.evaluations, result.iterations)));
        rows.push(("worst quality", format!("{}, was {}", quality(last), quality(first))));
    } else {
        rows.push(("worst quality", quality(last)));
    }
    let method = result
        .linear_solver
        .methods
        .first()
        .map_or(String::new(), |method| format!(", {}", printable(method)));
    rows.push(("worst residual", format!("{:.1e}{method}", result.linear_solver.worst_residual)));
    rows.push(("time", times(result)));
    rows.push(("peak memory", format!("{:.0} MiB", result.peak_memory_bytes as f64 / (1024.0 * 1024.0))));
    let mut lines: Vec<String> = rows.into_iter().map(|(name, text)| format!("{name:<22} {text}")).collect();
    for (at, state) in &states {
        let own = probes::lines(state.probes, state.errors, state.frequency);
        let title = (!at.is_empty() && !own.is_empty()).then(|| format!("{:<22}{at}", "probes"));
        lines.extend(title.into_iter().chain(own));
    }
    lines
}

/// The error bar of a value with an estimated error, behind it.
fn bar(error: Option<&f64>, unit: &str) -> String {
    error.map_or(String::new(), |error| format!(" ± {:.1e} {unit} (estimated)", SAFETY * error.abs()))
}

/// How far a region goes into its B–H curve.
fn saturated(region: &SaturatedRegion, at: &str) -> Row {
    let SaturatedRegion { region: name, highest_b_t: highest, table_ends_b_t: end, .. } = region;
    let end = match end {
        Some(end) if highest > end => format!(", beyond its curve, which ends at {end} T"),
        Some(end) => format!(", whose curve ends at {end} T"),
        None => String::new(),
    };
    let share = 100.0 * region.volume_share_beyond_knee;
    // Three decimals of a small value would be one digit, or none.
    let highest = if *highest < 0.01 { format!("{highest:.3e}") } else { format!("{highest:.3}") };
    let text = format!("{highest} T in {}{at}{end}; {share:.1} % is beyond the knee", printable(name));
    ("highest B", text)
}

/// How a run ended, and what it has gained.
fn run(result: &RunResult, named: &Named, styles: &Styles) -> Vec<Row> {
    let style = match result.status {
        RunStatus::Converged | RunStatus::Done => styles.good,
        RunStatus::Failed => styles.bad,
        _ => styles.warning,
    };
    let mut rows = vec![("ended", styled(style, result.stop_reason.describe()))];
    let Some(objective) = &result.objective else { return rows };
    if !named.name.is_empty() {
        rows.push(("objective", named.name.clone()));
    }
    let ObjectiveResult { initial, best, best_evaluation, ratio, .. } = objective;
    let unit = &named.unit;
    rows.push(("objective, initial", format!("{initial:.6e}{unit}")));
    rows.push(("objective, best", format!("{best:.6e}{unit} at evaluation {best_evaluation}")));
    rows.push(("F/F0", styled(styles.strong, &super::ratio(*ratio))));
    rows.extend(homogeneity(objective));
    rows.extend(objective.verification.as_ref().and_then(|found| verification(found, named, styles)));
    let Some(accuracy) = &result.accuracy else { return rows };
    rows.extend(accuracy.error_bars(*ratio).map(|bars| match bars {
        ErrorBars::Ratio(bar) => ("error bar of F/F0", format!("± {bar:.1e} (estimated)")),
        ErrorBars::Values([initial, best]) => {
            ("error bars", format!("± {initial:.1e}{unit} initial, ± {best:.1e}{unit} best (estimated)"))
        }
    }));
    if let Some(is_within) = accuracy.within_tolerance {
        let verdict = if is_within { "kept".to_owned() } else { styled(styles.bad, "NOT KEPT") };
        rows.push(("tolerance", format!("{verdict} after {} refinements of the mesh", accuracy.refinements)));
    }
    if let Some(CrossCheck { elements, order, ratio, by_estimate, .. }) = &accuracy.cross_check {
        let source = if *by_estimate { ", by the estimate" } else { "" };
        rows.push((
            "F/F0 by other elements",
            format!("{} ({elements}, order {order}{source})", super::ratio(*ratio)),
        ));
    }
    rows.extend(accuracy.verdict.map(|verdict| gain(verdict, (objective, accuracy), styles)));
    rows
}

/// What the mesh of a check has to say, of the field or of constraints.
fn verification(found: &Verification, named: &Named, styles: &Styles) -> Option<Row> {
    if named.is_of_shape && found.constraints.is_empty() {
        return None;
    }
    let [of_ratio, of_constraints] = match found.mesh {
        VerificationMesh::Fresh => ["F/F0 on a fresh mesh", "constraints, fresh mesh"],
        VerificationMesh::Cut => ["F/F0 on cut elements", "constraints, cut mesh"],
    };
    let constraints = constraints_text(found, styles);
    let (name, text) = match super::ratio(found.ratio) {
        _ if named.is_of_shape => (of_constraints, constraints),
        ratio if found.violated().next().is_some() => {
            (of_ratio, format!("{ratio}, constraints {constraints}"))
        }
        ratio => (of_ratio, ratio),
    };
    Some((name, format!("{text} ({} tetrahedra)", found.tets)))
}

/// Whether the gain is the shape's, and what is to be said of it.
fn gain(verdict: Verdict, (objective, accuracy): (&ObjectiveResult, &Accuracy), styles: &Styles) -> Row {
    let reservation = accuracy.reservation(objective);
    let style = match (verdict, reservation) {
        (Verdict::Confirmed, None) => styles.good,
        _ => styles.bad,
    };
    let opinions = [
        objective.verification.is_some(),
        accuracy.cross_check.as_ref().is_some_and(|check| !check.by_estimate),
        accuracy.error_estimate.is_some(),
    ];
    let alone = opinions.iter().filter(|is_there| **is_there).count() == 1;
    let remark = if alone { " (by one check alone)" } else { "" };
    let but = reservation.map_or(String::new(), |reservation| format!(", but {reservation}"));
    let text = format!("{}{but}", verdict.describe());
    ("gain", format!("{}{remark}", styled(style, &text)))
}

/// Whether the best shape keeps all constraints on the mesh of a check.
fn constraints_text(found: &Verification, styles: &Styles) -> String {
    let broken: Vec<&str> = found.violated().map(|constraint| constraint.name.as_str()).collect();
    if broken.is_empty() {
        return "kept".to_owned();
    }
    styled(styles.bad, &format!("VIOLATED: {}", printable(&broken.join(", "))))
}

/// The terms of an expansion, most of them relative to its main order.
fn expansion_text(set: &MultipoleResult, errors: Option<&StateErrors>) -> String {
    let errors = errors.and_then(|errors| errors.multipoles_t.get(&set.name));
    let term = |term: &HarmonicResult| {
        let value = match term.value_t {
            Amplitude::Static(value) => value,
            Amplitude::Phasor([re, im]) => re.hypot(im),
        };
        let units = term.units.map_or(String::new(), |units| format!(" ({units:.2} units)"));
        let bar = match errors.and_then(|errors| errors.get(&term.name)) {
            Some(error) => format!(" ± {:.1e}", SAFETY * error),
            None => String::new(),
        };
        format!("{} {value:.4e}{bar} T{units}", term.name)
    };
    let shown: Vec<String> = set.terms.iter().take(MOST_TERMS).map(term).collect();
    let more = if set.terms.len() > MOST_TERMS { ", and more in result.json" } else { "" };
    format!("{}: {}{more}", printable(&set.name), shown.join(", "))
}

/// What the terminals of a coil see.
fn coil_text(coil: &CoilResult, errors: Option<&StateErrors>) -> String {
    let text = |amplitude: Amplitude| match amplitude {
        Amplitude::Static(value) => format!("{value:.6e}"),
        Amplitude::Phasor([re, im]) => format!("({re:.6e} {im:+.6e}j)"),
    };
    format!(
        "{}: {} A{}, {} Wb{}, {}{}, {} V{}",
        printable(&coil.name),
        text(coil.current_a),
        bar(errors.and_then(|errors| errors.currents_a.get(&coil.name)), "A"),
        text(coil.flux_linkage_wb),
        bar(errors.and_then(|errors| errors.flux_linkages_wb.get(&coil.name)), "Wb"),
        coil.resistance_ohm
            .map_or_else(|| "no resistance at rest".to_owned(), |own| format!("{own:.6e} ohm")),
        bar(errors.and_then(|errors| errors.resistances_ohm.get(&coil.name)), "ohm"),
        text(coil.voltage_v),
        peaks(coil.voltage_v)
    )
}

/// How homogeneous the field is.
fn homogeneity(objective: &ObjectiveResult) -> Option<Row> {
    let figures = objective.homogeneity.as_ref()?;
    let before = figures.initial_rms_ppm.filter(|initial| *initial != figures.rms_ppm);
    let before = before.map(|initial| format!(" (was {initial:.4})")).unwrap_or_default();
    let state = figures.state.as_deref().map(|state| format!(", {}", printable(state)));
    let text = format!(
        "{:.4} ppm rms{before}, {:.4} ppm peak to peak, of a mean of {:.6e} T{}",
        figures.rms_ppm,
        figures.peak_to_peak_ppm,
        figures.mean_b_t,
        state.unwrap_or_default()
    );
    Some(("homogeneity", text))
}

/// Quality of an element; of a sliver its size.
fn quality(quality: f64) -> String {
    if quality < 1e-3 { format!("{quality:.1e}") } else { format!("{quality:.4}") }
}

/// The frequencies of an analysis, and what was measured.
fn analysis(result: &RunResult, named: &Named, styles: &Styles) -> Vec<Row> {
    let frequencies = each_once(result.frequencies_hz.iter().copied());
    let frequencies: Vec<String> = frequencies.iter().map(|f| format!("{f} Hz")).collect();
    let mut rows = vec![("analysed at", frequencies.join(", "))];
    if !result.loads.is_empty() {
        rows.push(("loads", printable(&result.loads.join(", ")).into_owned()));
    }
    if let Some(objective) = &result.objective {
        let value = styled(styles.strong, &format!("{:.6e}{}", objective.best, named.unit));
        // Of an analysis it is a measured quantity: there is no goal.
        let what = named.name.split_once(' ').map_or("", |(_, what)| what);
        rows.push(("value", format!("{value}  {what}").trim_end().to_owned()));
        rows.extend(homogeneity(objective));
        if let Some([error, _]) = result.accuracy.as_ref().and_then(|accuracy| accuracy.error_estimate) {
            rows.push(("estimated error", format!("{error:+.1e}{}", named.unit)));
        }
        let left_out = result.accuracy.as_ref().and_then(|accuracy| accuracy.excess);
        if let Some([more, _]) =
            left_out.filter(|[more, _]| more.abs() > LEAST_LEFT_OUT * objective.best.abs())
        {
            let what = format!("by impedance surfaces {WHERE_LEFT_OUT}; no error bar counts it");
            rows.push(("left out", format!("{more:+.1e}{} {what}", named.unit)));
        }
    }
    rows
}

fn constraint_row(constraint: &ConstraintResult, named: &Named, styles: &Styles) -> Row {
    let ConstraintResult { name, value, bound, satisfied, error_estimate } = constraint;
    let unit = named.unit_of(name);
    let bar = error_estimate.map(|error| format!(" ± {:.1e}{unit} (estimated)", SAFETY * error.abs()));
    // The errors of a value and of a bound that is a share of the initial one cancel in part.
    let [of_value, of_both] = match bar {
        None => [String::new(), String::new()],
        Some(bar) if named.has_shared_bound(name) => [String::new(), format!(", difference{bar}")],
        Some(bar) => [bar, String::new()],
    };
    let verdict = if *satisfied { "satisfied".to_owned() } else { styled(styles.bad, "VIOLATED") };
    (
        "constraint",
        format!(
            "{}: {value:.6e}{unit}{of_value}, bound {bound:.6e}{unit}{of_both}, {verdict}",
            printable(name)
        ),
    )
}

/// What tells a state from the others; nothing where there are none.
fn behind(state: &State<'_>) -> String {
    match state.load {
        _ if !state.is_one_of_several => String::new(),
        Some(load) => format!(" under {}", printable(load)),
        None => format!(" at {} Hz", state.frequency),
    }
}

/// The whole time, and the parts that took a tenth of it or more.
fn times(result: &RunResult) -> String {
    let of = |name: &str| result.timings_s.get(name).copied().unwrap_or_default();
    let total = of("total");
    let parts = [
        "setup",
        "remesh",
        "assembly",
        "factor",
        "state",
        "adjoint",
        "gradient",
        "refinement",
        "estimate",
        "verification",
    ];
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
        let named =
            Named { name: "minimise loss in plate".to_owned(), unit: " W".to_owned(), ..Named::default() };
        let text = lines(&crate::files::example_result(), &named, &Styles::default()).join("\n");
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
    fn a_gain_is_confirmed_with_what_speaks_against_it() {
        let mut result = crate::files::example_result();
        let violated = ConstraintResult { satisfied: false, ..result.constraints[0].clone() };
        let found = result.objective.as_mut().and_then(|own| own.verification.as_mut()).expect("a check");
        found.constraints = vec![violated];
        let of = |result: &RunResult| lines(result, &Named::default(), &Styles::default()).join("\n");
        let text = of(&result);
        for fragment in [
            "0.50000, constraints VIOLATED: volume_plate (147000 tetrahedra)",
            "confirmed: the gain is the shape's, but of a shape that violates constraints on the finer mesh",
        ] {
            assert!(text.contains(fragment), "{fragment}\n{text}");
        }
        result.accuracy.as_mut().expect("it is there").error_estimate_relative = Some(0.6);
        assert!(of(&result).contains("but smaller than its error bar"), "{}", of(&result));
        let accuracy = result.accuracy.as_mut().expect("it is there");
        (accuracy.error_estimate_relative, accuracy.error_estimate) = (None, Some([1.0, -0.25]));
        assert!(of(&result).contains("± 2.0e0 initial, ± 5.0e-1 best (estimated)"), "{}", of(&result));
    }

    #[test]
    fn an_analysis_does_not_read_like_an_optimisation() {
        let result = RunResult { command: "solve".to_owned(), ..crate::files::example_result() };
        let named =
            Named { name: "minimise loss in plate".to_owned(), unit: " W".to_owned(), ..Named::default() };
        let text = lines(&result, &named, &Styles::default()).join("\n");
        assert!(text.contains("value                  1.000000e0 W  loss in plate"), "{text}");
        for word in ["F/F0", "ended", "iterations", "minimise", "was "] {
            assert!(!text.contains(word), "{word}\n{text}");
        }
    }
}
