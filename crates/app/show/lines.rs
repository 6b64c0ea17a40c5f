//! The lines of a run, the same on a terminal above its bar and elsewhere.

use super::styles::{Styles, styled};
use super::summary::{self, Named};
use super::table::{self, Columns};
use super::{Evaluation, Started};
use crate::config::FieldsKept;
use crate::files::RunResult;
use crate::printable::printable;

/// What has been said so far, as far as later lines depend on it.
#[derive(Debug)]
pub(super) struct Lines {
    styles: Styles,
    columns: Columns,
    named: Named,
    header_is_shown: bool,
}

impl Lines {
    /// Of a run that has not begun.
    pub(super) fn new(styles: Styles, columns: Columns) -> Self {
        Self { styles, columns, named: Named::default(), header_is_shown: false }
    }

    /// The problem is set up.
    pub(super) fn started(&mut self, started: &Started<'_>) -> Vec<String> {
        self.named = Named::of(started);
        let Started { title, nodes, tets, unknowns, variables, .. } = started;
        let mut lines = vec![
            styled(self.styles.strong, title),
            format!("mesh: {nodes} nodes, {tets} tetrahedra, {unknowns} unknowns"),
        ];
        if let Some(optimizer) = started.optimizer {
            let algorithm = optimizer.algorithm.name();
            // To a micrometre.
            let millimetres = |radius: f64| (radius * 1e6).round() / 1e3;
            let filter = started.filter_radius.map(|r| format!(", filtered over {} mm", millimetres(r)));
            let filter = filter.unwrap_or_default();
            lines.push(format!("optimisation: {variables} design variables{filter}, {algorithm}"));
            if let Some(motion) = &started.motion {
                lines.push(format!("mesh motion: {motion}"));
            }
        }
        if let Some(directory) = started.directory {
            let is_part = started.optimizer.is_some() && started.fields == FieldsKept::Improved;
            let part = if is_part { ", fields of evaluations that improve" } else { "" };
            lines.push(format!("writing to {}{part}", printable(&directory.display().to_string())));
        }
        lines
    }

    /// An evaluation is complete: its row, the first one under a header.
    pub(super) fn evaluation(&mut self, row: &Evaluation) -> Vec<String> {
        let is_first = !std::mem::replace(&mut self.header_is_shown, true);
        let header = is_first.then(|| styled(self.styles.faint, &table::header(row, self.columns)));
        let row = printable(&table::row(row, self.columns)).into_owned();
        header.into_iter().chain([row]).collect()
    }

    /// Something the user should know.
    pub(super) fn warning(&self, message: &str) -> String {
        self.styles.warning_line(message)
    }

    /// The run has ended: a blank line and the summary.
    pub(super) fn finished(&self, result: &RunResult) -> Vec<String> {
        let summary = summary::lines(result, &self.named, &self.styles);
        [String::new()].into_iter().chain(summary).collect()
    }
}
