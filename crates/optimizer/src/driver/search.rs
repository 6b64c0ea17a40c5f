//! From one search of the method to the next: trust region, tolerance, and what follows from how a search ended.
//!
//! [`Search::decide`] only looks; the other methods act, each in one way.

use super::run::Run;
use super::settings::LEAST_GAIN;
use super::stop::{Refusal, Stop};
use super::trust_region::TrustRegion;
use super::{Settings, StopReason};
use crate::error::Error;
use crate::nlopt::{Ending, Minimisation, Outcome, Sample, minimise};

/// How much of the trust region is left after a design in it was refused and nothing was gained.
const SHRINK: f64 = 0.5;

/// Evaluations in a row that may bring constraints hardly nearer to being kept, where no design keeps all: a step by `slsqp` takes up to
/// ten, and where bounds are out of reach it goes on for the objective without end.
const MOST_ASTRAY: usize = 15;

/// Share of the violation that so many must take away.
const MENDED: f64 = 0.1;

/// How often the trust region may shrink without a gain: to an eighth.
const MAX_SHRINKS: usize = 3;

/// Factor on `ftol_rel` after the first search, and where a method ends after its first steps: it begins with a cautious
/// step, whose small gain is no convergence.
const RESTART_TOLERANCE: f64 = 0.1;

/// Evaluations within which a method has done no more than its cautious first step.
const CAUTIOUS: usize = 3;

/// Share of the gain promised at the start above which a search in a small trust region has not converged. Runs that have
/// promise less than a hundredth (`configs/shield_quick.toml`: 0.0001, with two frequencies 0.001).
const STILL_PROMISED: f64 = 0.1;

/// Multiple of the tolerance that the gradient may promise where a search has converged. What it promises is far above what is to be
/// had: at the ends of the shipped runs up to eight times the tolerance, and sixteen times in `configs/actuator.toml`, which goes on
/// for four evaluations in vain.
const PROMISED_TOLERANCES: f64 = 10.0;

/// How often an end after the cautious first step, or with much promised, is not believed.
const MAX_TIGHTENINGS: usize = 3;

/// How one search of the method ended.
pub(super) struct Ended {
    outcome: Outcome<Stop>,
    /// Whether it improved on the best design before it.
    gained: bool,
    evaluations: usize,
}

/// What follows from a search.
pub(super) enum NextStep {
    Stop(StopReason),
    /// What the gradient promises, where that is why.
    TightenTolerance {
        promised: Option<f64>,
    },
    /// From the best design, where the mesh leaves little room, the search has come from outside the constraints, or the gradient
    /// still promises much.
    SearchOn,
    /// For a design that keeps all constraints, where the method has found none.
    Restore,
    /// Around the best design.
    MoveTrustRegion,
    ShrinkTrustRegion {
        refused: Refusal,
        gained: bool,
    },
}

/// Whether another design may be better than the best one by more than the tolerance, or keep what that violates.
fn may_gain(run: &Run<'_>) -> bool {
    run.violates() || !run.leaves_less_than(1.0)
}

/// The state of the search for the best design between two starts of the method.
pub(super) struct Search<'a> {
    settings: &'a Settings,
    trust: TrustRegion,
    ftol_rel: f64,
    /// How often the trust region shrank since the last gain.
    shrinks: usize,
    tightenings: usize,
    /// Whether the worst constraint is minimised as long as no design keeps all.
    is_restoring: bool,
    /// The design refused last.
    refused: Option<Refusal>,
}

impl<'a> Search<'a> {
    pub(super) fn new(run: &Run<'_>, settings: &'a Settings) -> Self {
        Self {
            settings,
            trust: TrustRegion::new(run.centre(), 1.0),
            ftol_rel: settings.ftol_rel,
            shrinks: 0,
            tightenings: 0,
            is_restoring: false,
            refused: None,
        }
    }

    /// Runs the method once within the trust region, from the best design.
    pub(super) fn minimise(&mut self, run: &mut Run<'_>) -> Ended {
        let bounds = self.trust.bounds(run.shape());
        let [lower, upper] = bounds.clone();
        let (replaced, limits) = run.replaced();
        let shown = run.constraint_count() - replaced.len() + limits;
        let restores = self.is_restoring && run.violates() && shown > 0;
        let leeway = run.leeway();
        let of_problem = if restores { shown } else { 0 };
        let minimisation = Minimisation {
            algorithm: self.settings.algorithm,
            lower,
            upper,
            constraints: shown + run.mesh_constraint_count() - of_problem,
            members: if restores { of_problem } else { run.member_count() },
            ftol_rel: self.ftol_rel,
            xtol_rel: self.settings.xtol_rel,
            first_step: self.settings.first_step,
        };
        let before = (run.evaluations(), run.incumbent_values());
        let (may_stray, mut mended) = (self.is_restoring, before);
        let outcome = minimise(&minimisation, &run.centre(), |p| {
            let from = (run.evaluations(), run.incumbent_design());
            let mut sample = run.evaluate(p)?;
            if run.is_stagnant(from, &sample, (&bounds, self.ftol_rel)) {
                return Err(Stop::Stagnant);
            }
            if run.has_gained(mended, MENDED) {
                mended = (run.evaluations(), run.incumbent_values());
            } else if !may_stray && run.violates() && run.evaluations() - mended.0 >= MOST_ASTRAY {
                return Err(Stop::Astray);
            }
            sample.limits.iter_mut().zip(&leeway).for_each(|((c, _), leeway)| *c -= leeway);
            match sample.with_limits(&replaced, run.constraint_count()) {
                _ if restores && !run.violates() => Err(Stop::CutShort),
                sample if restores => Ok(with_violation_as_objective(sample, of_problem)),
                sample => Ok(sample),
            }
        });
        let evaluations = run.evaluations() - before.0;
        if let Outcome::Interrupted(Stop::Mesh(refusal)) = &outcome {
            self.ftol_rel = self.ftol_rel.min(RESTART_TOLERANCE * self.settings.ftol_rel);
            self.refused = Some(refusal.clone());
        }
        let gained = run.has_gained(before, self.settings.least_gain());
        Ended { outcome, gained, evaluations }
    }

    /// What follows from how a search ended.
    ///
    /// # Errors
    /// Of an evaluation, and [`Error::FirstDesign`] where there is no best design to return to.
    pub(super) fn decide(&self, run: &mut Run<'_>, ended: Ended) -> Result<NextStep, Error> {
        let Ended { outcome, gained, evaluations } = ended;
        match outcome {
            Outcome::Ended(ending) => Ok(self.after_ending(run, ending, gained, evaluations)),
            Outcome::Failed(_) if run.violates() && !self.is_restoring => Ok(NextStep::Restore),
            // At an optimum that bounds and constraints hold there is no step to be made.
            Outcome::Failed(_) if run.is_held() => Ok(NextStep::Stop(StopReason::ObjectiveConverged)),
            Outcome::Failed(cause) if run.has_best() => {
                run.warn(cause);
                Ok(NextStep::Stop(StopReason::MethodStalled))
            }
            Outcome::Failed(cause) => Err(Error::Optimisation { cause }),
            Outcome::Interrupted(Stop::CutShort) => Ok(NextStep::SearchOn),
            Outcome::Interrupted(Stop::Stagnant) => {
                let is_on = self.ftol_rel > 0.0;
                let ending = if is_on { Ending::Objective } else { Ending::Roundoff };
                // That is no cautious first step.
                Ok(self.after_ending(run, ending, gained, evaluations.max(CAUTIOUS + 1)))
            }
            Outcome::Interrupted(Stop::Astray) => Ok(NextStep::Restore),
            Outcome::Interrupted(Stop::Limit(reason)) => Ok(NextStep::Stop(reason)),
            Outcome::Interrupted(Stop::Error(error)) if run.has_best() && error.is_numerical() => {
                run.warn(&error.to_string());
                Ok(NextStep::Stop(StopReason::NumericalFailure))
            }
            Outcome::Interrupted(Stop::Error(error)) => Err(*error),
            Outcome::Interrupted(Stop::Mesh(Refusal { cause })) if !run.has_best() => {
                Err(Error::FirstDesign { cause })
            }
            Outcome::Interrupted(Stop::Mesh(refusal)) => Ok(self.after_refusal(run, refusal, gained)),
        }
    }

    /// After a method that ended by itself.
    fn after_ending(&self, run: &mut Run<'_>, ending: Ending, gained: bool, evaluations: usize) -> NextStep {
        let has_entered = ending == Ending::Entered;
        if has_entered && gained && (!run.violates() || self.is_restoring) {
            return NextStep::SearchOn;
        }
        if run.violates() && !self.is_restoring {
            return NextStep::Restore;
        }
        // A method that was given nothing new will not be at its next start either.
        let is_stuck = run.is_held_back && evaluations == 0;
        let may_tighten = self.ftol_rel > 0.0 && self.tightenings < MAX_TIGHTENINGS && !is_stuck;
        if ending == Ending::Objective && evaluations <= CAUTIOUS && may_tighten {
            return NextStep::TightenTolerance { promised: None };
        }
        // In a small trust region much is promised that is out of reach.
        let is_free = may_tighten && self.ftol_rel > LEAST_GAIN && self.trust.scale == 1.0;
        let promised = run.promised(PROMISED_TOLERANCES).filter(|_| ending == Ending::Objective);
        let unbelieved = run.surely_promised().filter(|_| ending == Ending::Objective && is_free);
        let held_back = self.trust.holds_back(run.shape(), &run.centre());
        match &self.refused {
            _ if held_back && gained => NextStep::MoveTrustRegion,
            _ if gained && promised.is_some() && !run.is_held() => NextStep::SearchOn,
            _ if unbelieved.is_some() => NextStep::TightenTolerance { promised: unbelieved },
            Some(refusal) if held_back && self.trust.scale < 1.0 => {
                self.after_refusal(run, refusal.clone(), gained)
            }
            _ => NextStep::Stop(match ending {
                // At an optimum that bounds and constraints hold there is no step but rounding.
                Ending::Roundoff if run.is_held() => StopReason::ObjectiveConverged,
                Ending::Roundoff => StopReason::RoundoffLimited,
                _ if may_gain(run) && (run.is_held_back || self.is_throttled(run)) => StopReason::MeshLimited,
                Ending::Objective | Ending::Entered => StopReason::ObjectiveConverged,
                Ending::Step => StopReason::StepConverged,
            }),
        }
    }

    /// Whether the method came to its tolerance only because the trust region is small, which is said then.
    fn is_throttled(&self, run: &mut Run<'_>) -> bool {
        let scale = self.trust.scale;
        let Some([before, now]) = run.promised_gains() else { return false };
        let is_throttled = scale < 1.0 && !run.violates() && now > STILL_PROMISED * before;
        if is_throttled {
            run.warn(&format!(
                "not converged: the search came to its tolerance in a trust region of {:.1} % of the bound range, where the \
                 gradient still promises {:.0} % of what it did at the start; a smoother design (a filter, a control grid), surfaces \
                 that slide or a lower minimum quality let the mesh go further",
                100.0 * scale,
                100.0 * now / before
            ));
        }
        is_throttled
    }

    /// Nearer to the best design, as long as that helps.
    fn after_refusal(&self, run: &mut Run<'_>, refusal: Refusal, gained: bool) -> NextStep {
        match run.limit_reached() {
            Some(reason) => NextStep::Stop(reason),
            None if gained || self.shrinks < MAX_SHRINKS => {
                NextStep::ShrinkTrustRegion { refused: refusal, gained }
            }
            None if run.violates() && !self.is_restoring => NextStep::Restore,
            None if !may_gain(run) => NextStep::Stop(StopReason::ObjectiveConverged),
            None => {
                run.warn(&format!("{}: the mesh carries the design no further", refusal.cause));
                NextStep::Stop(StopReason::MeshLimited)
            }
        }
    }

    /// Continues with a tighter tolerance after a cautious first step, or where the gradient promises much.
    pub(super) fn tighten_tolerance(&mut self, run: &mut Run<'_>, promised: Option<f64>) {
        self.tightenings += 1;
        self.ftol_rel *= RESTART_TOLERANCE;
        let plan = format!(": the search goes on with a relative tolerance of {:.0e}", self.ftol_rel);
        let what = match promised {
            Some(promised) => {
                format!("the gradient still promises {:.0} % of the objective", 100.0 * promised)
            }
            None => "the method ended after a few evaluations".to_owned(),
        };
        run.note_going_on(&what, &plan);
    }

    /// Begins again at the best design, as the first search does.
    pub(super) fn begin_anew(&mut self, run: &mut Run<'_>) {
        *self = Self::new(run, self.settings);
        run.note_going_on("the initial design is the best one", ": the search begins anew");
    }

    /// Continues with the worst constraint as the objective.
    pub(super) fn restore(&mut self, run: &mut Run<'_>) {
        self.is_restoring = true;
        (self.ftol_rel, self.tightenings) = (self.settings.ftol_rel, 0);
        self.move_trust_region(run);
        let plan = ": the search goes on for one with the least violation";
        run.note_going_on("no design yet keeps all constraints", plan);
    }

    /// Centres the trust region on the best design.
    pub(super) fn move_trust_region(&mut self, run: &Run<'_>) {
        self.trust = TrustRegion::new(run.centre(), self.trust.scale);
    }

    /// Shrinks the trust region around the best design.
    pub(super) fn shrink_trust_region(&mut self, run: &mut Run<'_>, refused: &Refusal, gained: bool) {
        self.shrinks = if gained { 1 } else { self.shrinks + 1 };
        self.trust = TrustRegion::new(run.centre(), SHRINK * self.trust.scale);
        let plan = format!(
            "; the search goes on within {:.2} % of the bound range around the best design",
            100.0 * self.trust.scale
        );
        run.note_going_on(&refused.cause, &plan);
    }
}

/// What the method sees of a design while none keeps the constraints of the problem: the worst of these is the objective. The others
/// are what the mesh leaves of room.
fn with_violation_as_objective(mut sample: Sample, of_problem: usize) -> Sample {
    let others = sample.constraints.split_off(of_problem);
    let members = std::mem::replace(&mut sample.constraints, others);
    let of_worse = |worst: usize, k: usize| if members[k].0 > members[worst].0 { k } else { worst };
    let (value, gradient) = members[(1..members.len()).fold(0, of_worse)].clone();
    Sample { value, gradient, members, ..sample }
}
