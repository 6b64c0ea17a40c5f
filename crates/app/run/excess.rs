//! What impedance surfaces leave out of losses ([`excess_losses`]), in words, and what an objective of losses has more by it.
//!
//! Every mesh and all elements leave it out alike: it is in no estimate of the error and in no check, and a shape may have its gain
//! from it.

use std::collections::BTreeMap;

use fluxmorph_geometry::Readable;
use fluxmorph_geometry::fem::c64;
use fluxmorph_optimizer::constraint::{Bound, Quantity};
use fluxmorph_optimizer::objective::Term;
use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_solver::audit::{ExcessLoss, excess_losses};
use fluxmorph_solver::circuit::{currents, powers};
use fluxmorph_solver::{Boundary, FieldModel, FieldSolution, FieldState};

use super::Session;
use super::reported::under;
use crate::build::is_pushed;
use crate::config::{Config, ObjectiveKind};
use crate::files::{LEAST_LEFT_OUT, WHERE_LEFT_OUT};
use crate::show::Observer;

/// What impedance surfaces leave out of losses in words, of each conductor where that is the largest share.
pub(super) fn of_conductors(config: &Config, problem: &Problem, analysis: &Analysis) -> Vec<String> {
    let mut worst: BTreeMap<String, (ExcessLoss, &FieldModel)> = BTreeMap::new();
    for (model, solution) in problem.states().iter().zip(&analysis.solutions) {
        for found in excess_losses((model, &analysis.mesh, solution)) {
            let largest = worst.get(&found.region).map_or(LEAST_LEFT_OUT, |(own, _)| own.share().abs());
            if found.share().abs() > largest {
                worst.insert(found.region.clone(), (found, model));
            }
        }
    }
    let text = |(found, model): &(ExcessLoss, &FieldModel)| {
        let more = if found.share() > 0.0 { "more" } else { "less" };
        let mut reasons = [
            (
                found.at_edges,
                "at its sharp edges: there a conductor is no half space",
                ", or mesh its edges round",
            ),
            (found.of_curvature, "where it is round: there a conductor is no half space", ""),
            (
                found.of_variation,
                "where the field along it changes within some skin depths: there it goes down faster",
                "",
            ),
        ];
        // The one that has most of that sign.
        reasons.sort_by(|a, b| (found.more() * b.0).total_cmp(&(found.more() * a.0)));
        let [(_, why, cure), ..] = reasons;
        let force = if is_pushed(config, &found.region) {
            "; force and torque on it are off too, by up to 0.4 times that percentage on the bodies that were looked at"
        } else {
            ""
        };
        format!(
            "`{}` has about {:.1} % {more} loss at {} Hz{} than its impedance surface, mostly {why}, \
             and no error bar counts that{force}. Where its loss matters, or the field in a bore or slit \
             of a few skin depths, mesh it (model = \"volume\"){cure}",
            found.region,
            100.0 * found.share().abs(),
            Readable(model.setup().frequency),
            under(model),
        )
    };
    worst.values().map(text).collect()
}

/// What impedance surfaces leave out of the losses of a design, in each state.
pub(super) struct LeftOut(Vec<OfState>);

/// What they leave out of one state.
struct OfState {
    /// Losses of surfaces and what they leave out, by region [W].
    losses: BTreeMap<String, [f64; 2]>,
    /// The one coil, where it alone excites the field: then all losses are its. Of others the currents are taken as they are.
    coil: Option<OneCoil>,
}

/// The only coil of a device.
#[derive(Clone, Copy)]
struct OneCoil {
    /// Its current [A].
    current: f64,
    /// Its power, complex [W].
    power: c64,
    /// The reactance in series with it where a voltage drives it [Ω].
    behind_voltage: Option<f64>,
}

impl OneCoil {
    /// `2 P / I²` [Ω]; `None` of a coil without current.
    fn impedance_of(&self, power: c64) -> Option<c64> {
        (self.current > 0.0).then(|| 2.0 * power / self.current.powi(2))
    }

    /// What becomes of all losses where the resistance grows by that of so many more [W]: of a voltage less current comes.
    fn share_left(&self, more: f64) -> Option<f64> {
        let Some(reactance) = self.behind_voltage else { return Some(1.0) };
        let before = self.impedance_of(self.power)? + c64::new(0.0, reactance);
        Some((before / (before + self.impedance_of(more.into())?)).norm_sqr())
    }

    /// That of a state; `None` where something else excites the field, too.
    fn of((model, mesh, solution): FieldState<'_>) -> Option<Self> {
        let setup = model.setup();
        let is_applied = |boundary: &Boundary| matches!(boundary, Boundary::UniformField(_));
        let (currents, powers) = (currents(model, solution), powers((model, mesh, solution)));
        let ([winding], [(_, current)], [(_, power)]) = (&setup.windings[..], &currents[..], &powers[..])
        else {
            return None;
        };
        let driven = winding.filter(|winding| winding.voltage.is_some());
        let behind_voltage = driven.map(|winding| winding.impedance(model.angular_frequency()).im);
        let own = Self { current: current.norm(), power: *power, behind_voltage };
        (!setup.boundaries.iter().any(|(_, boundary)| is_applied(boundary))).then_some(own)
    }
}

impl OfState {
    /// What a quantity of this kind has more, of a region or of a coil; `None` where it has no loss of a surface.
    fn more(&self, kind: &str, region: Option<&String>) -> Option<f64> {
        let is = |own: ObjectiveKind| kind == own.name();
        let all = || self.losses.values().map(|[_, more]| *more).reduce(|a, b| a + b);
        let left = |coil: OneCoil| coil.share_left(all()?);
        match region {
            Some(region) if is(ObjectiveKind::Loss) => {
                let [own, more] = self.losses.get(region)?;
                Some((own + more) * self.coil.map_or(Some(1.0), left)? - own)
            }
            _ if is(ObjectiveKind::Power) => {
                let own = self.coil?.power.re;
                Some((own + all()?) * left(self.coil?)? - own)
            }
            _ if is(ObjectiveKind::Resistance) => Some(self.coil?.impedance_of(all()?.into())?.re),
            // Q = X/R: the reactance stays.
            _ if is(ObjectiveKind::QualityFactor) => {
                let OneCoil { power, .. } = self.coil.filter(|coil| coil.current > 0.0)?;
                Some(power.im / (power.re + all()?) - power.im / power.re)
            }
            _ => None,
        }
    }
}

impl LeftOut {
    /// That of an analysis.
    pub(super) fn of(problem: &Problem, analysis: &Analysis) -> Self {
        let of_state = |(model, solution): (&FieldModel, &FieldSolution)| {
            let found = excess_losses((model, &analysis.mesh, solution)).into_iter();
            let losses = found.map(|own| (own.region.clone(), [own.of_surface, own.more()])).collect();
            OfState { losses, coil: OneCoil::of((model, &analysis.mesh, solution)) }
        };
        Self(problem.states().iter().zip(&analysis.solutions).map(of_state).collect())
    }

    /// What a term has more, about [its unit]; `None` where it has no loss of an impedance surface.
    fn of_term(&self, term: &Term) -> Option<f64> {
        let of = |&state: &usize| self.0[state].more(term.label.kind, term.label.region.as_ref());
        term.states.iter().filter_map(of).reduce(|a, b| a + b)
    }

    /// What the objective of the analysis has more, about [its unit]; `None` where it has no loss of an impedance surface.
    pub(super) fn of_objective(&self, problem: &Problem, analysis: &Analysis) -> Option<f64> {
        problem.objective()?.terms.iter().find_map(|term| self.of_term(term))?;
        Some(problem.objective_has_more(analysis, |term| self.of_term(term).unwrap_or(0.0)))
    }

    /// What each constraint on what has a loss of an impedance surface has more, with its number [its unit].
    fn of_constraints(&self, problem: &Problem) -> impl Iterator<Item = (usize, f64)> {
        problem.constraints().iter().enumerate().filter_map(|(k, constraint)| match &constraint.quantity {
            Quantity::Field(term) => Some((k, self.of_term(term)?)),
            _ => None,
        })
    }

    /// Bounds that are kept by the losses of the surfaces alone, in words; those that are shares of what the initial design has where
    /// it is known what that leaves out.
    pub(super) fn broken_bounds(
        &self,
        problem: &Problem,
        (analysis, bounds): (&Analysis, &[Bound]),
        at_initial: Option<&Self>,
    ) -> Vec<String> {
        let of_bound = |k: usize| match problem.constraints()[k].limit.share() {
            Some(share) => {
                let initial = at_initial?.of_constraints(problem).find(|own| own.0 == k)?;
                Some(share * initial.1)
            }
            None => Some(0.0),
        };
        let of = |(k, more): (usize, f64)| {
            let (bound, value) = (&bounds[k], analysis.constraints[k].value);
            let beyond = bound.excess(value + more - of_bound(k)?);
            (bound.is_satisfied(value) && beyond > LEAST_LEFT_OUT).then(|| {
                format!(
                    "the constraint `{}` keeps its bound by the loss of impedance surfaces; with what these leave out \
                     {WHERE_LEFT_OUT} it is about {:.1} % beyond",
                    problem.constraints()[k].name,
                    100.0 * beyond
                )
            })
        };
        self.of_constraints(problem).filter_map(of).collect()
    }
}

impl Session<'_> {
    /// What impedance surfaces leave out of the objective at the initial and at the best design of a run [its unit], where it has a
    /// loss of one and the initial field is known; bounds that are kept by the surfaces alone are reported and added to the warnings.
    pub(super) fn excess_of_run(
        &self,
        initial: Option<&Analysis>,
        (best, bounds): (&Analysis, &[Bound]),
        warnings: &mut Vec<String>,
        observer: &mut dyn Observer,
    ) -> Option<[f64; 2]> {
        let problem = &self.setup.problem;
        let at_best = LeftOut::of(problem, best);
        let at_initial = initial.map(|initial| (initial, LeftOut::of(problem, initial)));
        let left_out_initially = at_initial.as_ref().map(|(_, left_out)| left_out);
        for warning in at_best.broken_bounds(problem, (best, bounds), left_out_initially) {
            observer.warning(&warning);
            warnings.push(warning);
        }
        let (initial, left_out) = at_initial?;
        Some([left_out.of_objective(problem, initial)?, at_best.of_objective(problem, best)?])
    }
}

/// What impedance surfaces leave out of the objective of the initial and of the best design, in words; `None` where it is hardly
/// anything.
pub(super) fn described([at_initial, at_best]: [f64; 2], [initial, best]: [f64; 2]) -> Option<String> {
    let [first, last] = [at_initial / initial.abs(), at_best / best.abs()];
    (first.abs().max(last.abs()) > LEAST_LEFT_OUT).then(|| {
        format!(
            "what impedance surfaces leave out, {WHERE_LEFT_OUT}, changes the objective by about {:+.2} % at \
             the initial and {:+.2} % at the best design, of what it is there, and F/F0 from {:.5} to {:.5}, which no \
             error bar and no mesh counts; where that matters, mesh these regions (model = \"volume\")",
            100.0 * first,
            100.0 * last,
            best / initial,
            (best + at_best) / (initial + at_initial)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_of_losses_and_of_what_one_coil_sees_of_them() {
        let losses = BTreeMap::from([("plate".to_owned(), [2.0, 3.0]), ("wall".to_owned(), [2.0, 1.0])]);
        let coil = OneCoil { current: 4.0, power: c64::new(6.0, 60.0), behind_voltage: None };
        let mut state = OfState { losses, coil: Some(coil) };
        let plate = "plate".to_owned();
        assert_eq!(state.more("loss", Some(&plate)), Some(3.0));
        assert_eq!(state.more("loss", Some(&"meshed".to_owned())), None);
        assert_eq!(state.more("power", None), Some(4.0));
        assert_eq!(state.more("resistance", None), Some(0.5), "2 P / I²");
        assert_eq!(state.more("quality_factor", None), Some(-4.0), "60 / 10 less 60 / 6");
        assert_eq!(state.more("energy", Some(&plate)), None);
        // 0.75 Ω become 1.25 Ω, and the 7.5 Ω of the coil are in resonance with what is in series: 3/5 of the current is left.
        state.coil = Some(OneCoil { behind_voltage: Some(-7.5), ..coil });
        let more = |state: &OfState, kind, region| state.more(kind, region).expect("it has a surface's loss");
        assert!((more(&state, "power", None) - (10.0 * 0.36 - 6.0)).abs() < 1e-12);
        assert!((more(&state, "loss", Some(&plate)) - (5.0 * 0.36 - 2.0)).abs() < 1e-12);
        assert_eq!(state.more("resistance", None), Some(0.5), "that of 1 A");
        state.coil = None;
        assert_eq!(state.more("resistance", None), None, "of several coils nothing is known");
        assert_eq!(state.more("loss", Some(&plate)), Some(3.0));
    }

    #[test]
    fn what_is_left_out_is_said_beyond_a_hundredth_of_either_design() {
        let text = described([1.0, 4.0], [-100.0, 50.0]).expect("of the best");
        assert!(text.contains("+1.00 % at the initial and +8.00 % at the best"), "{text}");
        assert!(text.contains("from -0.50000 to -0.54545"), "{text}");
        assert_eq!(described([0.9, -0.4], [100.0, 50.0]), None);
    }
}
