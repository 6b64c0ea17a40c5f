//! Plain lines: one for each evaluation, and a summary; or less of it.

use std::io::Write;
use std::time::Instant;

use fluxmorph_optimizer::problem::Stage;
use fluxmorph_solver::newton::NewtonProgress;

use super::lines::Lines;
use super::table::Columns;
use super::{Evaluation, Observer, RunObserver, Started, Styles, show};
use crate::files::RunResult;
use crate::printable::printable;

/// A stage that takes longer [s] is shown with its time, outside of evaluations: people begin to wonder then.
const LONG_STAGE: f64 = 2.0;

/// How much is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Amount {
    /// The warnings alone.
    Warnings,
    /// These and, in the end, the results.
    Results,
    /// Everything, with a line for each evaluation.
    All,
}

/// Shows plain lines.
#[derive(Debug)]
pub struct Console<W> {
    writer: W,
    amount: Amount,
    lines: Lines,
    /// The stage in hand and when it began; `None` within the evaluations of a run, which have a line each.
    stage: Option<(Stage, Instant)>,
    has_evaluations: bool,
}

impl Console<std::io::Stderr> {
    /// Everything, on standard error.
    pub fn stderr() -> Self {
        Self { lines: Lines::new(Styles::for_stderr(), Columns::All), ..Self::new(std::io::stderr()) }
    }

    /// So much of it.
    #[must_use]
    pub fn with(self, amount: Amount) -> Self {
        Self { amount, ..self }
    }
}

impl<W: Write> Console<W> {
    /// Everything, on any writer, without colours.
    pub fn new(writer: W) -> Self {
        let lines = Lines::new(Styles::default(), Columns::All);
        Self { writer, amount: Amount::All, lines, stage: None, has_evaluations: false }
    }

    /// Shows the time of the stage in hand, if it was long.
    fn end_stage(&mut self) {
        if let Some((stage, began)) = self.stage.take() {
            let seconds = began.elapsed().as_secs_f64();
            if seconds >= LONG_STAGE && stage != Stage::Other {
                self.line(&format!("  {:<28} {seconds:>7.1} s", stage.describe()));
            }
        }
    }

    /// Shows lines that may have styles, where so much is shown.
    fn styled_lines(&mut self, least: Amount, lines: &[String]) {
        if self.amount >= least {
            lines.iter().for_each(|line| show(&mut self.writer, line));
        }
    }
}

impl<W: Write> Observer for Console<W> {
    fn line(&mut self, text: &str) {
        self.styled_lines(Amount::All, &[printable(text).into_owned()]);
    }

    fn phase(&mut self, name: &str) {
        self.end_stage();
        self.line(&format!("{name} ..."));
    }

    fn stage(&mut self, stage: Stage) {
        self.end_stage();
        if !self.has_evaluations {
            self.stage = Some((stage, Instant::now()));
        }
    }

    fn newton(&mut self, progress: NewtonProgress) {
        if !self.has_evaluations {
            let NewtonProgress { steps, residual, energy, .. } = progress;
            let energy = energy.map_or(String::new(), |energy| format!(", energy {energy:.6e} J"));
            self.line(&format!("  Newton step {steps:>2}: residual {residual:.1e}{energy}"));
        }
    }

    fn evaluation(&mut self, row: &Evaluation) {
        let lines = self.lines.evaluation(row);
        self.styled_lines(Amount::All, &lines);
    }

    fn warning(&mut self, message: &str) {
        self.styled_lines(Amount::Warnings, &[self.lines.warning(message)]);
    }
}

impl<W: Write> RunObserver for Console<W> {
    fn started(&mut self, started: &Started<'_>) {
        self.end_stage();
        self.has_evaluations = started.optimizer.is_some();
        let lines = self.lines.started(started);
        self.styled_lines(Amount::All, &lines);
    }

    fn finished(&mut self, result: &RunResult) {
        self.end_stage();
        self.styled_lines(Amount::Results, &self.lines.finished(result));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::evaluation;
    use super::*;

    #[test]
    fn one_header_stands_over_all_rows() {
        let mut bytes = Vec::new();
        let mut console = Console::new(&mut bytes);
        for number in [0, 10, 999] {
            console.evaluation(&evaluation(number));
        }
        let text = String::from_utf8(bytes).expect("text");
        assert_eq!((text.lines().count(), text.matches("F/F0").count()), (4, 1), "{text}");
    }

    #[test]
    fn a_long_stage_is_shown_with_its_time() {
        let mut bytes = Vec::new();
        let mut console = Console::new(&mut bytes);
        console.stage(Stage::Assembling);
        let began = Instant::now().checked_sub(std::time::Duration::from_secs(3)).expect("the machine is up");
        console.stage = Some((Stage::Factoring, began));
        console.stage(Stage::State);
        console.end_stage();
        let text = String::from_utf8(bytes).expect("text");
        assert!(text.starts_with("  factoring ") && text.ends_with("3.0 s\n"), "{text}");
    }
}
