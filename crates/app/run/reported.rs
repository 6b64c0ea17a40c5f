//! What a state reports beside the objective, and its errors: what a field of one order more has more of it, or one on halved edges.
//!
//! The estimate of the objective has that field at hand; a second evaluation of losses, forces, currents, flux linkages, expansions and
//! probes on it costs next to nothing. Does not live here: the fields (`estimate`) and what is written of a state (`summary`).

use std::collections::BTreeMap;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::locate::{Located, locate};
use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_optimizer::body::{Body, BodyForce};
use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_solver::circuit::{currents, direct_resistances, flux_linkages};
use fluxmorph_solver::element::amplitude;
use fluxmorph_solver::multipole::Harmonic;
use fluxmorph_solver::{FieldModel, FieldState, recovery};

use crate::build::multipole;
use crate::config::{Config, MultipoleSet, Probe};
use crate::error::Error;
use crate::files::{ForceError, StateErrors};

/// Differences that are rounding, as a share of the value.
const ROUNDING: f64 = 1e-9;

/// Whether a difference is more than rounding of a value, or no number.
fn is_changed(difference: f64, value: f64) -> bool {
    difference.is_nan() || difference > ROUNDING * value
}

/// Whether the states of a problem report anything beside the objective.
pub(super) fn is_something(config: &Config, problem: &Problem) -> bool {
    let has_losses = |model: &FieldModel| {
        let conducts = model.materials().iter().any(|material| material.conductivity > 0.0);
        model.angular_frequency() > 0.0 && (conducts || !model.conductors().is_empty())
    };
    let has_coils = config.coils.iter().any(|coil| coil.turns.is_some());
    !config.probes.is_empty()
        || !problem.bodies().is_empty()
        || has_coils
        || !config.multipoles.is_empty()
        || problem.states().iter().any(has_losses)
}

/// The load of a state, behind what is said of it.
pub(super) fn under(model: &FieldModel) -> String {
    model.setup().load_case.as_ref().map_or(String::new(), |load| format!(" under the load `{load}`"))
}

/// What a state reports, by names.
pub(super) struct Reported {
    losses: Vec<(String, f64)>,
    currents: Vec<(String, c64)>,
    resistances: Vec<(String, f64)>,
    flux_linkages: Vec<(String, c64)>,
    forces: Vec<BodyForce>,
    expansions: Vec<(String, Terms)>,
    probes: Vec<(String, AtPoints)>,
}

/// B at the points of a probe [T]; `None` outside the mesh.
pub(super) type AtPoints = Vec<Option<[c64; 3]>>;

/// The terms of an expansion [T].
pub(super) type Terms = Vec<(Harmonic, c64)>;

/// B at the points of probes [T], of which each has an entry in `located`; `None` outside the mesh.
pub(super) fn probes(
    config: &Config,
    located: &[Option<Located>],
    state: FieldState<'_>,
) -> Vec<(String, AtPoints)> {
    let mut located = located.iter();
    let mut of_probe = |probe: &Probe| {
        let at = |(place, located): (&Point, &Option<Located>)| {
            let (e, _) = (*located)?;
            Some(recovery::recovered_flux_density(state, e, *place))
        };
        (probe.name.clone(), probe.points.iter().zip(located.by_ref()).map(at).collect())
    };
    config.probes.iter().map(&mut of_probe).collect()
}

/// The terms of every expansion.
pub(super) fn expansions(
    config: &Config,
    (model, mesh, solution): FieldState<'_>,
) -> Result<Vec<(String, Terms)>, Error> {
    let of = |set: &MultipoleSet| {
        let multipoles = multipole::multipoles(config, set, mesh, model)?;
        Ok((set.name.clone(), multipoles.coefficients((model, mesh, solution))?))
    };
    config.multipoles.iter().map(of).collect()
}

/// A name, the size of its value, and the error of that.
type Entry = (String, f64, f64);

/// Values by names with their sizes, and their errors by the same.
fn entries<T>(own: &[(String, T)], size: impl Fn(&T) -> f64, errors: &BTreeMap<String, f64>) -> Vec<Entry> {
    let error = |name: &String| errors.get(name).copied().unwrap_or_default();
    own.iter().map(|(name, own)| (name.clone(), size(own), error(name))).collect()
}

/// Errors relative to the largest value.
fn shares_of(kind: &str, entries: Vec<Entry>) -> Vec<(String, f64)> {
    let largest = entries.iter().map(|(_, value, _)| *value).fold(0.0, f64::max);
    entries.into_iter().map(|(name, _, error)| (format!("{kind} `{name}`"), error / largest)).collect()
}

impl Reported {
    /// That of a field; `None` where an expansion cannot be had of it.
    pub(super) fn of(
        (config, bodies): (&Config, &[Body]),
        (model, mesh, solution): FieldState<'_>,
    ) -> Option<Self> {
        let points = config.probes.iter().flat_map(|probe| &probe.points).copied().collect::<Vec<Point>>();
        let expansions = expansions(config, (model, mesh, solution)).ok()?;
        Some(Self {
            losses: solution.losses(model, mesh),
            currents: currents(model, solution),
            resistances: direct_resistances(model),
            flux_linkages: flux_linkages((model, mesh, solution)),
            forces: bodies.iter().map(|body| body.force((model, mesh, solution))).collect(),
            expansions,
            probes: probes(config, &locate(mesh, &points), (model, mesh, solution)),
        })
    }

    /// That of all states of an analysis.
    pub(super) fn of_states(config: &Config, problem: &Problem, analysis: &Analysis) -> Vec<Option<Self>> {
        let states = problem.states().iter().zip(&analysis.solutions);
        states
            .map(|(model, solution)| Self::of((config, problem.bodies()), (model, &analysis.mesh, solution)))
            .collect()
    }

    /// Errors of losses, currents, resistances, flux linkages, forces, expansions and the field at probes, relative to the largest of
    /// their kind, with their names: as many for whatever errors, in one order; zero where there is none, NaN of a point outside.
    pub(super) fn shares(&self, errors: &StateErrors) -> Vec<(String, f64)> {
        let force = |own: &BodyForce| {
            let error = errors.forces.get(&own.name).map_or(0.0, |error| error.force_n);
            (own.name.clone(), norm(own.force_n), error)
        };
        let mut all = [
            shares_of("the loss in", entries(&self.losses, |own| own.abs(), &errors.losses_w)),
            shares_of("the current of", entries(&self.currents, |own| own.norm(), &errors.currents_a)),
            shares_of(
                "the resistance of",
                entries(&self.resistances, |own| own.abs(), &errors.resistances_ohm),
            ),
            shares_of(
                "the flux linkage of",
                entries(&self.flux_linkages, |own| own.norm(), &errors.flux_linkages_wb),
            ),
            shares_of("the force on", self.forces.iter().map(force).collect()),
        ]
        .concat();
        for (set, terms) in &self.expansions {
            let own = errors.multipoles_t.get(set);
            let error = |term: &Harmonic| {
                own.and_then(|errors| errors.get(&term.to_string())).copied().unwrap_or_default()
            };
            let terms = terms.iter().map(|(term, value)| (set.clone(), value.norm(), error(term)));
            all.extend(shares_of("a term of", terms.collect()));
        }
        for (probe, points) in &self.probes {
            let own = errors.probes_t.get(probe);
            let error = |k: usize| own.and_then(|errors| *errors.get(k)?).unwrap_or(f64::NAN);
            let points = points
                .iter()
                .enumerate()
                .map(|(k, b)| (probe.clone(), b.as_ref().map_or(0.0, amplitude), error(k)));
            all.extend(shares_of("B at the probe", points.collect()));
        }
        all
    }

    /// The errors, so many times what a better field has more; `None` where one is no number.
    pub(super) fn errors(&self, better: &Self, times: f64) -> Option<StateErrors> {
        let length = |a: &[c64], b: &[c64]| {
            times * a.iter().zip(b).map(|(a, b)| (b - a).norm_sqr()).sum::<f64>().sqrt()
        };
        let number =
            |((name, own), (_, more)): (&(String, f64), &(String, f64))| (name.clone(), times * (more - own));
        let amplitude = |((name, own), (_, more)): (&(String, c64), &(String, c64))| {
            (name.clone(), length(&[*own], &[*more]))
        };
        let force = |(own, more): (&BodyForce, &BodyForce)| {
            let force_n = times * norm(sub(more.force_n, own.force_n));
            let torque_nm = times * norm(sub(more.torque_nm, own.torque_nm));
            (own.name.clone(), ForceError { force_n, torque_nm })
        };
        let probe = |((name, own), (_, more)): (&(String, Vec<_>), &(String, Vec<_>))| {
            let at = |(own, more): (&Option<[c64; 3]>, &Option<[c64; 3]>)| {
                Some(length(own.as_ref()?, more.as_ref()?))
            };
            (name.clone(), own.iter().zip(more).map(at).collect::<Vec<_>>())
        };
        let expansion = |((name, own), (_, more)): (&(String, Vec<_>), &(String, Vec<_>))| {
            let term = |((term, own), (_, more)): (&(Harmonic, c64), &(Harmonic, c64))| {
                (term.to_string(), length(&[*own], &[*more]))
            };
            let mut errors: BTreeMap<_, _> = own.iter().zip(more).map(term).collect();
            // One difference may vanish by chance; all terms come from the same values around the expansion.
            let rms = (errors.values().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
            errors.values_mut().for_each(|error| *error = error.max(rms));
            (name.clone(), errors)
        };
        let errors = StateErrors {
            multipoles_t: self.expansions.iter().zip(&better.expansions).map(expansion).collect(),
            losses_w: self.losses.iter().zip(&better.losses).map(number).collect(),
            // A current that is given has none, nor has the resistance of a straight bar.
            currents_a: self
                .currents
                .iter()
                .zip(&better.currents)
                .filter(|((_, own), (_, more))| is_changed((more - own).norm(), own.norm()))
                .map(amplitude)
                .collect(),
            resistances_ohm: self
                .resistances
                .iter()
                .zip(&better.resistances)
                .filter(|((_, own), (_, more))| is_changed((more - own).abs(), own.abs()))
                .map(number)
                .collect(),
            flux_linkages_wb: self.flux_linkages.iter().zip(&better.flux_linkages).map(amplitude).collect(),
            forces: self.forces.iter().zip(&better.forces).map(force).collect(),
            probes_t: self.probes.iter().zip(&better.probes).map(probe).collect(),
        };
        errors.is_finite().then_some(errors)
    }
}
