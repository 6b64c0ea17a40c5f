//! What is shown of a search that goes on after a pause: not again what was shown of it before.

use fluxmorph_optimizer::driver::{Evaluation, Observer};
use fluxmorph_optimizer::problem::Stage;
use fluxmorph_solver::newton::NewtonProgress;

/// An observer that is told of nothing until the first evaluations are over.
pub(super) struct Behind<'a> {
    pub(super) observer: &'a mut dyn Observer,
    /// Evaluations that it has seen before.
    pub(super) seen: usize,
}

impl Behind<'_> {
    fn tell(&mut self, what: impl FnOnce(&mut dyn Observer)) {
        if self.seen == 0 {
            what(self.observer);
        }
    }
}

impl Observer for Behind<'_> {
    fn line(&mut self, text: &str) {
        self.tell(|observer| observer.line(text));
    }

    fn phase(&mut self, name: &str) {
        self.tell(|observer| observer.phase(name));
    }

    fn stage(&mut self, stage: Stage) {
        self.tell(|observer| observer.stage(stage));
    }

    fn newton(&mut self, progress: NewtonProgress) {
        self.tell(|observer| observer.newton(progress));
    }

    fn note(&mut self, message: &str) {
        self.tell(|observer| observer.note(message));
    }

    fn evaluation(&mut self, evaluation: &Evaluation) {
        self.tell(|observer| observer.evaluation(evaluation));
        self.seen = self.seen.saturating_sub(1);
    }

    fn notice(&mut self, message: &str) {
        self.tell(|observer| observer.notice(message));
    }

    fn warning(&mut self, message: &str) {
        self.tell(|observer| observer.warning(message));
    }
}
