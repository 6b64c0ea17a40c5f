//! What the result of a run and that of a single analysis have in common: the best design, its mesh, losses and probes.

use std::collections::BTreeMap;
use std::time::Instant;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::locate::{Located, locate};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::body::Body;
use fluxmorph_optimizer::constraint::{Bound, Constraint, Quantity};
use fluxmorph_optimizer::driver::Best;
use fluxmorph_optimizer::objective::{Combination, Term};
use fluxmorph_optimizer::problem::{Analysis, ErrorEstimate, Measured, Problem, Shape, Timings};
use fluxmorph_remesh::Moved;
use fluxmorph_solver::circuit::{self, CoilTerminals, Terminals};
use fluxmorph_solver::functional::rounding_of_main;
use fluxmorph_solver::linear::Method;
use fluxmorph_solver::multipole::Harmonic;
use fluxmorph_solver::{FieldModel, FieldSolution, Functional, PointsOf, SolverError, saturation};

use super::Session;
use super::confirmation::InitialField;
use super::reported::{self, AtPoints, Terms};
use super::reservations::reservations;
use crate::build::multipole;
use crate::config;
use crate::error::Error;
use crate::files::{
    Amplitude, CoilResult, ConstraintResult, DesignResult, HarmonicResult, HomogeneityResult,
    LinearSolverResult, MeshResult, MultipoleResult, OpenResult, ProbeResult, RunResult, SaturatedRegion,
    SaturationResult, StateResult, StopReason, TermResult, peak_memory_bytes,
};
use crate::show::{Observer, RunObserver};

impl Session<'_> {
    /// The parts of a result that run and solve share.
    pub(super) fn result(
        &self,
        stop_reason: StopReason,
        analysis: &Analysis,
        design: Option<&[f64]>,
        initial_quality: f64,
        timings: &Timings,
        observer: &mut dyn RunObserver,
    ) -> Result<RunResult, Error> {
        let problem = &self.setup.problem;
        let mesh = &analysis.mesh;
        let clock = Instant::now();
        let terminals = all_terminals(problem, analysis)?;
        let terminals_seconds = clock.elapsed().as_secs_f64();
        let mut states = self.state_results(analysis, observer);
        for (index, (state, terminals)) in states.iter_mut().zip(&terminals).enumerate() {
            self.complete(index, analysis, terminals, state)?;
        }
        let StateResult { probes, losses_w, forces, saturation, coils, multipoles, .. } = states[0].clone();
        let design = problem.shape().zip(design).map(|(shape, values)| design_result(shape, values));
        let topology = mesh.topology();
        let inductance_h = terminals.into_iter().next().unwrap_or_default().inductance;
        let more = reservations(self.config, &self.setup, analysis)?;
        more.iter().for_each(|warning| observer.warning(warning));
        let warnings = self.warnings.iter().cloned().chain(more).collect();
        Ok(RunResult {
            schema_version: 1,
            command: self.command.to_owned(),
            status: stop_reason.into(),
            stop_reason,
            evaluations: 0,
            iterations: 0,
            objective: None,
            accuracy: None,
            constraints: Vec::new(),
            design,
            mesh: MeshResult {
                nodes: topology.node_count(),
                tets: topology.tets().len(),
                unknowns: problem.states().iter().map(|model| model.unknown_count()).sum(),
                worst_quality_initial: initial_quality,
                worst_quality_final: analysis.quality.worst,
            },
            frequencies_hz: self.config.load_cases().iter().map(|case| case.frequency).collect(),
            loads: self.config.loads.iter().map(|load| load.name.clone()).collect(),
            probes,
            losses_w,
            forces,
            errors: None,
            facets_change: None,
            saturation,
            states: if states.len() > 1 { states } else { Vec::new() },
            initial: Vec::new(),
            open: open(problem, analysis)?,
            coils,
            coupling: coupling(&inductance_h),
            inductance_h,
            multipoles,
            linear_solver: linear_solver(problem, analysis, analysis.worst_residual),
            timings_s: self.timings_result(timings, terminals_seconds),
            warnings,
            peak_memory_bytes: peak_memory_bytes(),
        })
    }

    /// Adds to losses and probes of a state what else depends on it.
    fn complete(
        &self,
        index: usize,
        analysis: &Analysis,
        terminals: &Terminals,
        state: &mut StateResult,
    ) -> Result<(), Error> {
        let problem = &self.setup.problem;
        let (model, solution) = (&problem.states()[index], &analysis.solutions[index]);
        let force = |body: &Body| body.force((model, &analysis.mesh, solution));
        state.forces = problem.bodies().iter().map(force).collect();
        state.saturation = saturation(model, analysis, solution);
        state.coils = coils(terminals, model.angular_frequency());
        state.multipoles = self.multipoles(model, analysis, solution)?;
        Ok(())
    }

    /// The terms of every expansion.
    fn multipoles(
        &self,
        model: &FieldModel,
        analysis: &Analysis,
        solution: &FieldSolution,
    ) -> Result<Vec<MultipoleResult>, Error> {
        let found = reported::expansions(self.config, (model, &analysis.mesh, solution))?;
        let of = |(set, (name, coefficients)): (&config::MultipoleSet, (String, Terms))| {
            let main = multipole::main_terms(set);
            let of_main = coefficients.iter().filter(|(term, _)| main.contains(term));
            let reference = of_main.map(|(_, c)| c.norm_sqr()).sum::<f64>().sqrt();
            let is_there = reference > 0.0 && rounding_of_main(&main, &coefficients).is_none();
            let term = |(term, c): &(Harmonic, c64)| HarmonicResult {
                name: term.to_string(),
                value_t: amplitude(*c, model.angular_frequency()),
                units: is_there.then(|| 1e4 * c.norm() / reference),
            };
            MultipoleResult { name, radius_m: set.radius, terms: coefficients.iter().map(term).collect() }
        };
        Ok(self.config.multipoles.iter().zip(found).map(of).collect())
    }

    /// Seconds of every stage.
    fn timings_result(&self, timings: &Timings, terminals: f64) -> BTreeMap<String, f64> {
        BTreeMap::from(
            [
                ("total", self.seconds()),
                ("setup", self.setup_seconds),
                ("remesh", timings.remesh),
                ("assembly", timings.assembly),
                ("factor", timings.factor),
                ("state", timings.state),
                ("adjoint", timings.adjoint),
                ("gradient", timings.gradient),
                ("terminals", terminals),
            ]
            .map(|(stage, seconds)| (stage.to_owned(), seconds)),
        )
    }

    /// Losses, probes and expansions of the initial design in every state, with its field; nothing where a run was interrupted, or
    /// has none.
    pub(super) fn initial_states(
        &self,
        initial: Moved,
        (best, stop_reason): (&Best, StopReason),
        observer: &mut dyn RunObserver,
    ) -> Result<(Vec<StateResult>, InitialField), Error> {
        let initial = InitialField::Moved(Box::new(initial));
        let config = self.config;
        let has_some =
            !(config.probes.is_empty() && self.setup.audits.is_empty() && config.multipoles.is_empty());
        if stop_reason == StopReason::Interrupted || !has_some {
            return Ok((Vec::new(), initial));
        }
        let problem = &self.setup.problem;
        let analysis = initial.analysis(problem, &best.analysis)?;
        let mut states = self.state_results(&analysis, observer);
        for ((state, model), solution) in states.iter_mut().zip(problem.states()).zip(&analysis.solutions) {
            state.multipoles = self.multipoles(model, &analysis, solution)?;
        }
        Ok((states, InitialField::Solved(analysis)))
    }

    /// Losses and probes of a design in every state.
    pub(super) fn state_results(
        &self,
        analysis: &Analysis,
        observer: &mut dyn RunObserver,
    ) -> Vec<StateResult> {
        let places: Vec<Point> = self.config.probes.iter().flat_map(|probe| &probe.points).copied().collect();
        let located = locate(&analysis.mesh, &places);
        (0..self.setup.problem.states().len())
            .map(|index| self.state_result(index, analysis, &located, observer))
            .collect()
    }

    /// Losses and probes of one state; `located` has an entry for every point of every probe.
    fn state_result(
        &self,
        index: usize,
        analysis: &Analysis,
        located: &[Option<Located>],
        observer: &mut dyn RunObserver,
    ) -> StateResult {
        let (model, solution) = (&self.setup.problem.states()[index], &analysis.solutions[index]);
        let mesh = &analysis.mesh;
        let places =
            self.config.probes.iter().flat_map(|probe| probe.points.iter().map(move |p| (probe, *p)));
        for ((probe, point), _) in places.zip(located).filter(|(_, located)| index == 0 && located.is_none())
        {
            // It was inside before the mesh moved: the result of a whole run is worth more than this point.
            let ([lower, upper], wanted_by) = (mesh.bounding_box(), PointsOf::Probe(probe.name.clone()));
            let error = SolverError::PointOutside { wanted_by, point, lower, upper };
            observer.warning(&format!("{error}: its field is left out"));
        }
        let found = reported::probes(self.config, located, (model, mesh, solution)).into_iter();
        let probe = |(probe, (name, b)): (&config::Probe, (String, AtPoints))| ProbeResult {
            name,
            points_m: probe.points.clone(),
            b_re_t: b.iter().map(|b| b.map(|b| b.map(|c| c.re))).collect(),
            b_im_t: b.iter().map(|b| b.map(|b| b.map(|c| c.im))).collect(),
        };
        let probes = self.config.probes.iter().zip(found).map(probe).collect();
        StateResult {
            load: model.setup().load_case.clone(),
            frequency_hz: model.setup().frequency,
            losses_w: solution.losses(model, mesh).into_iter().collect(),
            probes,
            ..StateResult::default()
        }
    }
}

/// How far every region goes into its B–H curve; `None` where all is linear.
fn saturation(model: &FieldModel, analysis: &Analysis, solution: &FieldSolution) -> Option<SaturationResult> {
    let of = |found: saturation::Saturation| SaturatedRegion {
        region: found.region,
        highest_b_t: found.highest,
        place_m: found.place,
        table_ends_b_t: found.end,
        knee_b_t: found.knee,
        volume_share_beyond_knee: found.share_beyond_knee,
    };
    (!model.is_linear()).then(|| SaturationResult {
        newton_steps: solution.newton_steps(),
        regions: saturation::by_region((model, &analysis.mesh, solution)).into_iter().map(of).collect(),
    })
}

/// What the terminals of coils see of every state; states of one matrix have the responses to 1 A in common.
fn all_terminals(problem: &Problem, analysis: &Analysis) -> Result<Vec<Terminals>, SolverError> {
    let (models, mesh) = (problem.states(), &analysis.mesh);
    let mut responded: Vec<FieldSolution> = Vec::new();
    let mut all = Vec::new();
    for ((model, solution), &method) in models.iter().zip(&analysis.solutions).zip(&analysis.methods) {
        let mut state = solution.clone();
        match (0..responded.len()).find(|&k| model.shares_matrix_with(&models[k])) {
            Some(k) => state = state.with_responses_of(&responded[k]),
            None => model.respond_to_all(mesh, method, &mut state)?,
        }
        all.push(circuit::terminals((model, mesh, &state))?);
        responded.push(state);
    }
    Ok(all)
}

/// A value in statics, a peak phasor in harmonics.
fn amplitude(c: c64, angular_frequency: f64) -> Amplitude {
    if angular_frequency == 0.0 { Amplitude::Static(c.re) } else { Amplitude::Phasor([c.re, c.im]) }
}

/// What the terminals of every coil see.
fn coils(terminals: &Terminals, angular_frequency: f64) -> Vec<CoilResult> {
    let amplitude = |c: c64| amplitude(c, angular_frequency);
    let of = |coil: &CoilTerminals| CoilResult {
        name: coil.name.clone(),
        current_a: amplitude(coil.current),
        flux_linkage_wb: amplitude(coil.flux_linkage),
        resistance_ohm: coil.resistance,
        voltage_v: amplitude(coil.voltage),
    };
    terminals.coils.iter().map(of).collect()
}

/// Coupling factors of an inductance matrix.
fn coupling(inductance: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let own = |k: usize| inductance[k][k];
    let row = |(j, row): (usize, &Vec<f64>)| {
        row.iter().enumerate().map(|(k, l)| l / (own(j) * own(k)).sqrt()).collect()
    };
    inductance.iter().enumerate().map(row).collect()
}

/// The share of the energy in open space, where there is some.
fn open(problem: &Problem, analysis: &Analysis) -> Result<Option<OpenResult>, Error> {
    let share = |(model, solution): (&FieldModel, &FieldSolution)| -> Result<Option<f64>, Error> {
        let Some(open) = model.setup().open else { return Ok(None) };
        let of = |region| -> Result<f64, SolverError> {
            Ok(Functional::energy(model, region)?.evaluate((model, &analysis.mesh, solution))?.value)
        };
        let (shell, all) = (of(Some(open.region))?, of(None)?);
        Ok(Some(if all > 0.0 { shell / all } else { 0.0 }))
    };
    let shares =
        problem.states().iter().zip(&analysis.solutions).map(share).collect::<Result<Vec<_>, _>>()?;
    let shares: Option<Vec<f64>> = shares.into_iter().collect();
    Ok(shares.map(|energy_share| OpenResult { energy_share }))
}

/// A design with what it means.
pub(super) fn design_result(shape: &Shape, values: &[f64]) -> DesignResult {
    DesignResult {
        values_m: values.to_vec(),
        lower_m: shape.lower().to_vec(),
        upper_m: shape.upper().to_vec(),
        points_m: shape.surface().points().to_vec(),
    }
}

/// The terms of the objective at a design.
pub(super) fn terms(problem: &Problem, analysis: &Analysis) -> Vec<TermResult> {
    let terms = problem.objective().into_iter().flat_map(|objective| &objective.terms);
    let of = |(term, &value): (&Term, &f64)| TermResult {
        kind: term.label.kind.to_owned(),
        region: term.label.region.clone(),
        coils: term.label.coils.clone(),
        frequency: term.label.frequency,
        load: term.label.load.clone(),
        weight: term.weight,
        value,
    };
    terms.zip(&analysis.terms).map(of).collect()
}

/// How homogeneous the field of an analysis is, for the first term that asks, of a worst case the worst of them; `initial` is the
/// objective at the initial design.
pub(super) fn homogeneity(problem: &Problem, analysis: &Analysis, initial: f64) -> Option<HomogeneityResult> {
    let objective = problem.objective()?;
    let terms = &objective.terms;
    let qualities = terms.iter().filter_map(|term| {
        let index = *term.states.first()?;
        let (model, solution) = (&problem.states()[index], &analysis.solutions[index]);
        let quality = term.functional.field_quality((model, &analysis.mesh, solution))?;
        Some((objective.goal.sign() * term.weight * quality.rms * quality.rms, quality, model))
    });
    let worse = |a: &f64, b: &f64| objective.combination == Combination::WorstCase && b > a;
    let (_, quality, model) = qualities.reduce(|a, b| if worse(&a.0, &b.0) { b } else { a })?;
    let weight = match terms.as_slice() {
        [term] if term.states.len() == 1 => Some(term.weight),
        _ => None,
    };
    Some(HomogeneityResult {
        mean_b_t: quality.mean,
        rms_ppm: 1e6 * quality.rms,
        initial_rms_ppm: weight.map(|weight| 1e6 * (initial / weight).sqrt()),
        peak_to_peak_ppm: 1e6 * quality.peak_to_peak,
        state: (problem.states().len() > 1)
            .then(|| model.setup().load_case.clone().unwrap_or_else(|| model.label())),
    })
}

/// The constraints at a design; thicknesses without the margin that a search keeps.
pub(super) fn constraints(problem: &Problem, analysis: &Analysis, bounds: &[Bound]) -> Vec<ConstraintResult> {
    let thickness = problem.shape().and_then(|shape| shape.thickness());
    let of = |((constraint, measured), bound): ((&Constraint, &Measured), &Bound)| {
        let value = match (&constraint.quantity, thickness) {
            (Quantity::Thickness { measure, .. }, Some(own)) => measure.extreme(own, &analysis.mesh),
            _ => measured.value,
        };
        ConstraintResult {
            name: constraint.name.clone(),
            value,
            bound: bound.value,
            satisfied: bound.is_satisfied(value),
            error_estimate: None,
        }
    };
    problem.constraints().iter().zip(&analysis.constraints).zip(bounds).map(of).collect()
}

/// Share of a bound by which a constraint may be beyond it without its estimated error before that is said.
const BEYOND: f64 = 1e-3;

/// Enters what constraints on the field have for estimated errors at a design, and says which are kept on this mesh alone. A bound
/// that is a share of the initial value has an error too: without the estimate `at_initial` nothing is known of such a constraint.
pub(super) fn enter_errors(
    results: &mut [ConstraintResult],
    (problem, bounds): (&Problem, &[Bound]),
    (at_initial, estimate): (Option<&ErrorEstimate>, &ErrorEstimate),
    observer: &mut dyn Observer,
) {
    for (place, &(k, of_value)) in estimate.constraints.iter().enumerate() {
        let of_bound = match problem.constraints()[k].limit.share() {
            Some(share) => at_initial.map(|initial| share * initial.constraints[place].1),
            None => Some(0.0),
        };
        let Some(error) = of_bound.map(|of_bound| of_value - of_bound) else { continue };
        let result = &mut results[k];
        result.error_estimate = Some(error);
        let beyond = bounds[k].excess(result.value + error);
        if result.satisfied && beyond > BEYOND {
            observer.notice(&format!(
                "the constraint `{}` keeps its bound on this mesh; without the estimated error of the mesh it is {:.2} % beyond",
                result.name,
                100.0 * beyond
            ));
        }
    }
}

/// How the linear systems of an analysis were solved.
pub(super) fn linear_solver(
    problem: &Problem,
    analysis: &Analysis,
    worst_residual: f64,
) -> LinearSolverResult {
    let name = |(model, method): (&FieldModel, &Option<Method>)| {
        method.map_or_else(|| model.method_name(), |method| method.name().to_owned())
    };
    let methods = problem.states().iter().zip(&analysis.methods).map(name).collect();
    LinearSolverResult { methods, worst_residual, iterations: analysis.linear_iterations }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fluxmorph_optimizer::constraint::Limit;
    use fluxmorph_optimizer::problem::{Derivatives, NoProgress, SolverCache};

    use super::*;
    use crate::build::{Mode, set_up};
    use crate::config::Config;

    /// What the observer received.
    #[derive(Default)]
    struct Notices(Vec<String>);

    impl Observer for Notices {
        fn notice(&mut self, message: &str) {
            self.0.push(message.to_owned());
        }
    }

    #[test]
    fn a_constraint_that_is_kept_by_its_error_alone_is_said() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml");
        let limits = "constraints=[{kind='loss', region='plate', upper=1, name='own'}, \
                      {kind='loss', region='plate', upper_ratio=1.1, name='share'}, \
                      {kind='volume', region='plate', upper_ratio=1}]";
        let (config, source) = Config::from_file(&path, &[limits.to_owned()]).expect("sound");
        let problem = set_up(&config, &source, Mode::Optimisation).expect("a sound problem").problem;
        let moved = problem.moved(problem.shape().expect("a design").initial()).expect("a sound mesh");
        let analysis =
            problem.analyse(moved, Derivatives::None, &mut SolverCache::default(), &mut NoProgress);
        let analysis = analysis.expect("a field");
        let (value, error) = (analysis.constraints[0].value, 0.05 * analysis.constraints[0].value);
        let estimate = ErrorEstimate {
            objective: 0.0,
            constraints: vec![(0, error), (1, error)],
            by_element: Vec::new(),
            iterations: 0,
        };
        let mut bounds = problem.bounds(None, &analysis).expect("numbers");
        // Between the value and what it is without its error.
        let between = Constraint {
            name: "own".to_owned(),
            quantity: Quantity::Field(Box::new(problem.objective().expect("one").terms[0].clone())),
            limit: Limit::AtMost(1.02 * value),
        };
        bounds[0] = between.bound(value).expect("a number");
        let entered = |at_initial| {
            let (mut results, mut notices) = (constraints(&problem, &analysis, &bounds), Notices::default());
            enter_errors(&mut results, (&problem, &bounds), (at_initial, &estimate), &mut notices);
            (results.into_iter().map(|own| own.error_estimate).collect::<Vec<_>>(), notices.0)
        };
        let (errors, notices) = entered(None);
        assert_eq!(errors, [Some(error), None, None]);
        assert_eq!(notices.len(), 1);
        assert!(notices[0].contains("`own`") && notices[0].contains("2.94 % beyond"), "{notices:?}");
        // A bound of 1.1 times the initial value has 1.1 times its error.
        let (errors, _) = entered(Some(&estimate));
        assert_eq!(errors, [Some(error), Some(error - 1.1 * error), None]);
    }
}
