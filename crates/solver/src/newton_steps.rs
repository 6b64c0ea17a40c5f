//! What the steps of Newton's method have in common, in statics and for phasors: their linear systems, one after the other, and
//! what a sequence of residuals says.
//!
//! A tangent on nearly flat elements has solutions whose residual is small while parts of them that hardly count in it are large:
//! as large as a preconditioner in single precision leaves them. Their rounding then is what the residual of the state stays at, far
//! above what the law asks for. Where that happens the state is solved for again from where it began, by the next method of the
//! ladder; what it is depends on mesh, model, start and the method in use alone, which a journal has.

use crate::error::{NewtonFailure, SolverError};
use crate::linear::{FieldSystem, Left, LinearSolverCache, Method, PreparedSystem, SolverEvent};
use crate::model::{AssembledMatrix, FieldModel};

/// Steps after which there is no hope: five to fifteen are usual.
pub(crate) const MOST_STEPS: usize = 60;

/// Relative residual above which a state is refused [1].
const REQUIRED: f64 = 1e-10;

/// The same where no method of the linear solver is left that could lower it: what a linear solution has to reach on such a mesh.
const REQUIRED_AT_LAST: f64 = 1e-9;

/// A residual that a step leaves at more than this part of itself is rounding, once it is below `REQUIRED`.
const STAGNATION: f64 = 0.1;

/// Relative residual [1] below which Newton's method is in its last, quadratic steps: what stays there does not stay for the law.
const NEAR: f64 = 1e-6;

/// Steps in a row below `NEAR` that leave more than half of the residual, after which it is taken to stay: one may change the side of
/// a law's kink.
const MOST_IDLE: usize = 3;

/// What a residual says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    Converged,
    Falling,
    /// It does not fall any more, and is too large.
    Stays,
}

/// How residuals fall from step to step.
#[derive(Debug)]
pub(crate) struct Descent {
    tolerance: f64,
    before: f64,
    idle: usize,
}

impl Descent {
    /// Towards a relative residual.
    pub(crate) fn new(tolerance: f64) -> Self {
        Self { tolerance, before: f64::INFINITY, idle: 0 }
    }

    /// What a further residual says.
    pub(crate) fn after(&mut self, residual: f64) -> Verdict {
        let before = std::mem::replace(&mut self.before, residual);
        self.idle = if residual <= NEAR && residual > 0.5 * before { self.idle + 1 } else { 0 };
        if residual <= self.tolerance || residual <= REQUIRED && residual > STAGNATION * before {
            Verdict::Converged
        } else if self.idle >= MOST_IDLE {
            Verdict::Stays
        } else {
            Verdict::Falling
        }
    }
}

/// Why a state with this residual is given up.
pub(crate) fn failure(residual: f64) -> NewtonFailure {
    if residual <= NEAR { NewtonFailure::Rounding } else { NewtonFailure::Law }
}

/// The linear systems of the steps.
pub(crate) struct StepSystems<'a> {
    model: &'a FieldModel,
    /// What one leaves for the next.
    cache: LinearSolverCache,
    events: Vec<SolverEvent>,
}

impl<'a> StepSystems<'a> {
    /// Those of a state of a model, which begin with the method of a cache and what it keeps of factors.
    pub(crate) fn new(model: &'a FieldModel, cache: &mut LinearSolverCache) -> Self {
        let cache = std::mem::take(cache).method_and_kept();
        Self { model, cache: Self::first(model, cache), events: Vec::new() }
    }

    /// What the first of them begins with. In statics a factor serves the tangents after its own as long as it pays; for phasors
    /// it is applied many times a step, and every tangent has its own.
    fn first(model: &FieldModel, cache: LinearSolverCache) -> LinearSolverCache {
        if model.angular_frequency() > 0.0 { cache } else { cache.within_a_state() }
    }

    /// The system of a matrix, with its circuits.
    ///
    /// # Errors
    /// As [`FieldModel::prepare_with`].
    pub(crate) fn prepare(
        &mut self,
        matrix: impl Into<AssembledMatrix>,
    ) -> Result<PreparedSystem, SolverError> {
        self.model.prepare_with(matrix, &mut self.cache)
    }

    /// Keeps what a system leaves for the next one.
    pub(crate) fn keep(&mut self, system: FieldSystem) {
        self.events.extend_from_slice(system.events());
        self.cache = system.into_cache().without_initial_guess();
    }

    /// What happened in the systems so far.
    pub(crate) fn into_events(self) -> Vec<SolverEvent> {
        self.events
    }

    /// Whether Newton's method ends with this residual in a state, where its steps are solved by this method.
    pub(crate) fn is_state(&self, verdict: Verdict, residual: f64, method: Option<Method>) -> bool {
        verdict == Verdict::Converged || verdict == Verdict::Stays && self.is_least(residual, method)
    }

    /// Whether a residual that stays is as small as there is any, where the steps were solved by this method.
    pub(crate) fn is_least(&self, residual: f64, method: Option<Method>) -> bool {
        residual <= REQUIRED || residual <= REQUIRED_AT_LAST && self.more_robust(method).is_none()
    }

    /// Whether no method is left that could lower what is left of a state, and that is rounding.
    pub(crate) fn is_rounding(&self, method: Option<Method>, left: Option<Left<'_>>) -> bool {
        let required = self.model.setup().linear_solver.required;
        self.more_robust(method).is_none() && left.is_some_and(|left| left.is_rounding(required))
    }

    /// A method, or else the first choice, and the next more robust one that fits, if there is one.
    fn more_robust(&self, method: Option<Method>) -> Option<[Method; 2]> {
        let analysis = self.model.linear_solver()?;
        let from = method.unwrap_or(analysis.method());
        Some([from, analysis.more_robust(from)?])
    }

    /// Goes over to a more robust method, where there is one that fits and the residual of a state stays for rounding.
    pub(crate) fn escalate(&mut self, error: &SolverError) -> bool {
        let SolverError::Newton { steps, residual, failure: NewtonFailure::Rounding, .. } = error else {
            return false;
        };
        let Some([from, to]) = self.more_robust(self.cache.method()) else { return false };
        let cause =
            format!("Newton's method stays at the relative residual {residual:.1e} after {steps} steps");
        self.events.push(SolverEvent::FellBack { from, to, cause });
        self.cache = Self::first(self.model, LinearSolverCache::with_method(Some(to)));
        true
    }
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::generate::{BlockParameters, block};

    use super::*;
    use crate::linear::Method;
    use crate::{FieldModelSetup, Material};

    fn verdicts(residuals: &[f64]) -> Vec<Verdict> {
        let mut descent = Descent::new(1e-11);
        residuals.iter().map(|&residual| descent.after(residual)).collect()
    }

    #[test]
    fn a_residual_ends_small_or_is_seen_to_stay() {
        use Verdict::{Converged, Falling, Stays};
        assert_eq!(verdicts(&[5.0, 4.0, 3.9, 0.1, 1e-5, 1e-12]).pop(), Some(Converged));
        // Rounding below what is required is no fault; above it is.
        assert_eq!(verdicts(&[1.0, 1e-4, 4e-11, 3e-11]), [Falling, Falling, Falling, Converged]);
        assert_eq!(verdicts(&[1e-4, 1.3e-8, 1.2e-8, 1.3e-8, 1.3e-8])[3..], [Falling, Stays]);
        // Far from the solution a law may keep it, and a kink one step near it.
        assert!(verdicts(&[0.9; 50]).iter().all(|&v| v == Falling));
        assert!(verdicts(&[1e-7, 9e-8, 1e-9, 9e-10, 2e-10]).iter().all(|&v| v == Falling));
    }

    #[test]
    fn rounding_takes_the_next_method_until_there_is_none_and_a_law_does_not() {
        let mesh = block(&BlockParameters { size: [0.2; 3], cells: [2; 3] }).expect("a mesh");
        let setup = FieldModelSetup { materials: vec![Material::AIR], ..FieldModelSetup::default() };
        let model = FieldModel::new(&mesh, setup).expect("a sound problem");
        let failed = |failure| SolverError::Newton {
            steps: 9,
            residual: 1.3e-8,
            region: "air".to_owned(),
            place: [0.0; 3],
            flux_density: 1.0,
            failure,
        };
        let mut systems =
            StepSystems::new(&model, &mut LinearSolverCache::with_method(Some(Method::RealFactorSingle)));
        assert!(!systems.escalate(&failed(NewtonFailure::Law)));
        let single = Some(Method::RealFactorSingle);
        assert!(systems.is_least(5e-11, single) && !systems.is_least(5e-10, single));
        for method in [Method::RealFactor, Method::Direct] {
            assert!(systems.escalate(&failed(NewtonFailure::Rounding)));
            assert_eq!(systems.cache.method(), Some(method));
        }
        assert!(!systems.escalate(&failed(NewtonFailure::Rounding)));
        // What nothing could lower is a state where a linear solution would be one.
        let direct = Some(Method::Direct);
        assert!(systems.is_least(5e-10, direct) && !systems.is_least(2e-9, direct));
        let said: Vec<String> = systems.into_events().iter().map(ToString::to_string).collect();
        assert_eq!(said.len(), 2);
        assert!(said[0].contains("stays at the relative residual 1.3e-8 after 9 steps"), "{}", said[0]);
    }
}
