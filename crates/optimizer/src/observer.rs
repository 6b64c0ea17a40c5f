//! Who watches a run: the driver tells what happens, an observer shows it.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::output::{ConstraintResult, RunResult};
use crate::rounds::RoundEvent;

/// One evaluation of objective, constraints and gradients; a row of the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Number of the evaluation, from 0.
    pub evaluation: usize,
    /// Evaluations so far that improved on the best before them; the first counts as 0.
    pub iteration: usize,
    /// The objective itself, whether it is minimised or maximised.
    pub objective: f64,
    /// The objective over that of evaluation 0.
    pub ratio: f64,
    /// Euclidean norm of the gradient with respect to the design variables [objective / m].
    pub gradient_norm: f64,
    /// Euclidean norm of the change of the design variables since the evaluation before [m].
    pub step_norm: f64,
    /// Worst quality of an element (Eq. 4).
    pub worst_quality: f64,
    /// Least thickness of the moved body along the direction of motion [m]; `None` where it has none.
    pub min_thickness_m: Option<f64>,
    /// Greatest thickness [m].
    pub max_thickness_m: Option<f64>,
    /// Iterations of the linear solver, state and adjoint.
    pub linear_iterations: usize,
    /// Wall time of the evaluation [s].
    pub seconds: f64,
    /// Multiple of the motion from the round's reference at which the first element inverts; `None` if none ever does.
    pub step_to_inversion: Option<f64>,
    /// That element.
    pub inversion_element: Option<usize>,
    /// Its region.
    pub inversion_region: Option<String>,
    /// Rounds of the mesh motion begun so far (see [`crate::driver`]).
    pub round: usize,
    /// Relative distance of every constraint from its bound, satisfied where ≤ 0, by column (see [`column`]).
    #[serde(flatten)]
    pub constraints: BTreeMap<String, f64>,
}

/// The column of the history that holds a constraint.
pub fn column(constraint: &str) -> String {
    format!("c_{constraint}")
}

impl Evaluation {
    /// The columns of `history.csv` before those of the constraints.
    pub const COLUMNS: [&'static str; 15] = [
        "evaluation",
        "iteration",
        "objective",
        "ratio",
        "gradient_norm",
        "step_norm",
        "worst_quality",
        "min_thickness_m",
        "max_thickness_m",
        "linear_iterations",
        "seconds",
        "step_to_inversion",
        "inversion_element",
        "inversion_region",
        "round",
    ];
}

/// What is known when a run starts.
#[derive(Debug, Clone, Copy)]
pub struct Started<'a> {
    /// Title of the configuration.
    pub title: &'a str,
    /// Algorithm of the optimisation; `None` for a single analysis.
    pub algorithm: Option<&'a str>,
    /// Design variables.
    pub variables: usize,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Tetrahedra of the mesh.
    pub tets: usize,
    /// Unknowns of the field problem.
    pub unknowns: usize,
    /// The run directory; `None` when nothing is written.
    pub directory: Option<&'a Path>,
}

/// Is told what happens during a run. Every method does nothing unless it is overridden.
pub trait Observer {
    /// The problem is set up.
    fn started(&mut self, started: &Started<'_>) {
        let _ = started;
    }

    /// A long part of the work begins, in a few words: `assembling`.
    fn phase(&mut self, name: &str) {
        let _ = name;
    }

    /// Something has happened, in a line.
    fn note(&mut self, message: &str) {
        let _ = message;
    }

    /// An evaluation is complete.
    fn evaluation(&mut self, evaluation: &Evaluation) {
        let _ = evaluation;
    }

    /// The mesh has a new reference, or a remedy was taken.
    fn round(&mut self, event: &RoundEvent) {
        let _ = event;
    }

    /// Something that was left out, and why; nothing to act on.
    fn notice(&mut self, message: &str) {
        let _ = message;
    }

    /// Something the user should know; the run goes on.
    fn warning(&mut self, message: &str) {
        let _ = message;
    }

    /// The run has ended.
    fn finished(&mut self, result: &RunResult) {
        let _ = result;
    }
}

/// Shows nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {}

/// Shows the warnings alone.
#[derive(Debug)]
pub struct Quiet<W>(pub W);

impl<W: Write> Observer for Quiet<W> {
    fn warning(&mut self, message: &str) {
        show_warning(&mut self.0, message);
    }
}

fn show_warning(writer: &mut impl Write, message: &str) {
    show(writer, &format!("warning: {message}"));
}

/// A message that cannot be shown, as on a closed terminal, is no reason to stop a run.
fn show(writer: &mut impl Write, text: &str) {
    let _ = writeln!(writer, "{text}").and_then(|()| writer.flush());
}

/// The last column of the table, of a width that common names of constraints fit into.
fn worst_of(text: &str) -> String {
    format!("  {text:<24.40}")
}

/// Shows one plain line for each evaluation, and a summary.
#[derive(Debug)]
pub struct Console<W> {
    writer: W,
    header_is_shown: bool,
}

impl Console<std::io::Stderr> {
    /// On standard error.
    pub fn stderr() -> Self {
        Self::new(std::io::stderr())
    }
}

impl<W: Write> Console<W> {
    /// On any writer.
    pub fn new(writer: W) -> Self {
        Self { writer, header_is_shown: false }
    }

    fn line(&mut self, text: &str) {
        show(&mut self.writer, text);
    }
}

impl<W: Write> Observer for Console<W> {
    fn started(&mut self, started: &Started<'_>) {
        self.line(started.title);
        let Started { nodes, tets, unknowns, .. } = started;
        self.line(&format!("mesh: {nodes} nodes, {tets} tetrahedra, {unknowns} unknowns"));
        if let Some(algorithm) = started.algorithm {
            self.line(&format!("optimisation: {} design variables, {algorithm}", started.variables));
        }
        if let Some(directory) = started.directory {
            self.line(&format!("writing to {}", directory.display()));
        }
    }

    fn phase(&mut self, name: &str) {
        self.line(&format!("{name} ..."));
    }

    fn note(&mut self, message: &str) {
        self.line(message);
    }

    fn evaluation(&mut self, row: &Evaluation) {
        if !self.header_is_shown {
            self.header_is_shown = true;
            let constraint =
                if row.constraints.is_empty() { String::new() } else { worst_of("worst constraint") };
            self.line(&format!(
                "{:>4} {:>4} {:>13} {:>8} {:>9} {:>9} {:>8} {:>15} {:>6} {:>7}{constraint}",
                "eval", "iter", "F", "F/F0", "|dF/dp|", "step mm", "quality", "thickness mm", "linear", "s"
            ));
        }
        let constraint = row
            .constraints
            .iter()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map(|(column, c)| worst_of(&format!("{c:+.1e} {}", column.trim_start_matches("c_"))))
            .unwrap_or_default();
        let thickness = match (row.min_thickness_m, row.max_thickness_m) {
            (Some(least), Some(most)) => format!("{:.2} .. {:.2}", least * 1e3, most * 1e3),
            _ => "-".to_owned(),
        };
        self.line(&format!(
            "{:>4} {:>4} {:>13.6e} {:>8.5} {:>9.2e} {:>9.3} {:>8.4} {:>15} {:>6} {:>7.2}{constraint}",
            row.evaluation,
            row.iteration,
            row.objective,
            row.ratio,
            row.gradient_norm,
            row.step_norm * 1e3,
            row.worst_quality,
            thickness,
            row.linear_iterations,
            row.seconds,
        ));
    }

    fn round(&mut self, event: &RoundEvent) {
        self.line(&event.describe());
    }

    fn notice(&mut self, message: &str) {
        self.line(&format!("note: {message}"));
    }

    fn warning(&mut self, message: &str) {
        show_warning(&mut self.writer, message);
    }

    fn finished(&mut self, result: &RunResult) {
        self.line("");
        let mut row = |name: &str, text: String| self.line(&format!("{name:<22} {text}"));
        row("ended", result.stop_reason.describe().to_owned());
        if let Some(objective) = &result.objective {
            let evaluation = format!("at evaluation {}", objective.best_evaluation);
            row("objective, initial", format!("{:.6e}", objective.initial));
            row("objective, best", format!("{:.6e} {evaluation}", objective.best));
            row("F/F0", format!("{:.5}", objective.ratio));
            if let Some(fresh) = &objective.verification {
                row("F/F0 on a fresh mesh", format!("{:.5} ({} tetrahedra)", fresh.ratio, fresh.tets));
            }
        }
        for constraint in &result.constraints {
            let ConstraintResult { name, value, bound, satisfied } = constraint;
            let verdict = if *satisfied { "kept" } else { "NOT KEPT" };
            row("constraint", format!("{name}: {value:.6e}, bound {bound:.6e}, {verdict}"));
        }
        row("evaluations", format!("{} ({} iterations)", result.evaluations, result.iterations));
        let mesh = &result.mesh;
        row(
            "worst quality",
            format!("{:.4}, was {:.4}", mesh.worst_quality_final, mesh.worst_quality_initial),
        );
        for (region, loss) in &result.losses_w {
            row("loss", format!("{loss:.6e} W in {region}"));
        }
        row("worst residual", format!("{:.1e}", result.linear_solver.worst_residual));
        if let Some(total) = result.timings_s.get("total") {
            row("time", format!("{total:.1} s"));
        }
        row("peak memory", format!("{:.0} MiB", result.peak_memory_bytes as f64 / (1024.0 * 1024.0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evaluation(number: usize) -> Evaluation {
        Evaluation {
            evaluation: number,
            iteration: number,
            objective: 1.2e-4,
            ratio: 0.51,
            gradient_norm: 3.0,
            step_norm: 0.004,
            worst_quality: 0.1,
            min_thickness_m: Some(0.005),
            max_thickness_m: Some(0.03),
            linear_iterations: 40,
            seconds: 1.0,
            step_to_inversion: Some(1.25),
            inversion_element: Some(17),
            inversion_region: Some("plate".to_owned()),
            round: 0,
            constraints: BTreeMap::new(),
        }
    }

    #[test]
    fn the_console_shows_one_header_and_aligned_rows() {
        let mut bytes = Vec::new();
        let mut console = Console::new(&mut bytes);
        for number in [0, 10, 999] {
            console.evaluation(&evaluation(number));
        }
        let text = String::from_utf8(bytes).expect("text");
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 4, "{text}");
        assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{text}");
        assert!(lines[1].contains("5.00 .. 30.00") && lines[1].contains("0.51000"), "{text}");
    }

    #[test]
    fn the_console_names_the_worst_constraint_of_a_row() {
        let mut bytes = Vec::new();
        let constraints = [("c_volume_plate", -1e-3), ("c_loss", 0.25)].map(|(name, c)| (name.to_owned(), c));
        let row = Evaluation { constraints: constraints.into(), ..evaluation(1) };
        Console::new(&mut bytes).evaluation(&row);
        let text = String::from_utf8(bytes).expect("text");
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[0].contains("worst constraint") && lines[1].contains("+2.5e-1 loss"), "{text}");
        assert_eq!(lines[0].len(), lines[1].len(), "{text}");
    }

    #[test]
    fn the_summary_names_the_outcome() {
        let mut bytes = Vec::new();
        Console::new(&mut bytes).finished(&crate::output::example_result());
        let text = String::from_utf8(bytes).expect("text");
        for fragment in [
            "the objective has converged",
            "F/F0",
            "0.50000",
            "8 (7 iterations)",
            "in plate",
            "0.50000 (147000 tetrahedra)",
        ] {
            assert!(text.contains(fragment), "{fragment}\n{text}");
        }
    }

    #[test]
    fn a_closed_writer_is_no_reason_to_stop() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
        }
        Console::new(Closed).evaluation(&evaluation(0));
    }
}
