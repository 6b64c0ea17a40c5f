//! What a run keeps as its evaluations come: fields, journal, history.
//!
//! The order is that of what must be on the disk first: a field file and the collection that names it, then the record in
//! the journal, which makes the evaluation one that a resumed run replays, then the row of the history.

use std::collections::VecDeque;

use fluxmorph_geometry::io::pvd_text;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::driver::{Record, Recorder};
use fluxmorph_optimizer::problem::{Analysis, Problem};

use super::Session;
use super::pieces::SharedPieces;
use crate::config::FieldsKept;
use crate::error::Error;
use crate::files::fields::{self, FieldData};
use crate::files::{History, RunDirectory};
use crate::run::journal::Journal;
use crate::show::Evaluation;

/// Writes journal, history and fields into the run directory.
pub(super) struct DirectoryRecorder {
    directory: RunDirectory,
    journal: Journal,
    history: History,
    kept: FieldsKept,
    /// Evaluations with a field file, ascending.
    written: Vec<usize>,
    /// The level of the evaluation before.
    level: Option<usize>,
    /// Evaluations of before that are still to be replayed.
    replayed: VecDeque<Record>,
    /// The most ranks that had a share in these; `None` where one process computed them.
    ranks: Option<usize>,
    /// Where all ranks write the fields.
    pieces: Option<SharedPieces>,
}

impl DirectoryRecorder {
    /// Behind the records that the journal holds: history, collection and field files are brought to these.
    pub(super) fn new(session: &Session<'_>, journal: Journal, replayed: Vec<Record>) -> Result<Self, Error> {
        let (directory, problem) = (session.directory.clone(), &session.setup.problem);
        let kept = session.config.output.fields;
        let names: Vec<&str> =
            problem.constraints().iter().map(|constraint| constraint.name.as_str()).collect();
        let rows: Vec<&Evaluation> = replayed.iter().map(|record| &record.row).collect();
        let history = History::create(&directory, (&names, &problem.forces_at_rest()), &rows)?;
        let mut written = directory.evaluations_with_fields()?;
        let is_first = |k: usize| k == 0 || replayed[k - 1].row.level != replayed[k].row.level;
        written.retain(|&k| k < replayed.len() && is_wanted(kept, &replayed[k], is_first(k)));
        let level = replayed.last().map(|record| record.row.level);
        // No collection names a file that is removed.
        if written.is_empty() {
            directory.remove(&directory.collection())?;
        } else {
            write_collection(&directory, &written)?;
        }
        directory.remove_leftovers(&written)?;
        // Of another best design, where the run has ended before.
        directory.remove(&directory.error_map())?;
        let (pieces, ranks) = (session.pieces(), session.manifest.ranks);
        let replayed = replayed.into();
        Ok(Self { directory, journal, history, kept, written, level, replayed, ranks, pieces })
    }

    /// Whether there are evaluations of before that are still to be replayed.
    pub(super) fn is_replaying(&self) -> bool {
        !self.replayed.is_empty()
    }

    /// The level of the next evaluation that is to be replayed; `None` where none is left.
    pub(super) fn next_level(&self) -> Option<usize> {
        self.replayed.front().map(|record| record.row.level)
    }

    /// Writes the field of the best design with what each element adds to its estimated error, where fields are kept.
    pub(super) fn write_error(
        &self,
        problem: &Problem,
        analysis: &Analysis,
        error: &[f64],
    ) -> Result<(), Error> {
        if self.kept == FieldsKept::Nothing || error.is_empty() {
            return Ok(());
        }
        let bytes = field_bytes(problem, analysis, Some(error))?;
        Ok(self.directory.write(&self.directory.error_map(), &bytes)?)
    }

    /// Writes the field of an evaluation, and the collection of all.
    pub(super) fn write(
        &mut self,
        evaluation: usize,
        problem: &Problem,
        analysis: &Analysis,
    ) -> Result<(), Error> {
        if self.written.last() == Some(&evaluation) {
            return Ok(());
        }
        write_field(&self.directory, self.pieces.as_ref(), evaluation, problem, (analysis, None))?;
        self.written.push(evaluation);
        write_collection(&self.directory, &self.written)
    }

    /// Keeps a complete evaluation.
    fn keep(&mut self, record: &Record, analysis: &Analysis, problem: &Problem) -> Result<(), Error> {
        if let Some(level) = self.next_level() {
            let cause = format!(
                "evaluation {} would follow on a mesh of {} refinements, where the journal has one on a mesh of {level}: the \
                 refinements of `{}` are missing and could not be made again, or are others; restore the file, or begin the run \
                 again with --force",
                record.row.evaluation,
                record.row.level,
                self.directory.refinements().display()
            );
            return Err(Error::NotResumable { path: self.directory.path().to_owned(), cause });
        }
        // A log that is open goes on wherever its folder is moved to; what is written at the end does not.
        self.directory.check_place()?;
        let is_first = self.level != Some(record.row.level);
        self.level = Some(record.row.level);
        if is_wanted(self.kept, record, is_first) {
            self.write(record.row.evaluation, problem, analysis)?;
        }
        self.journal.append(record)?;
        Ok(self.history.append(&record.row)?)
    }
}

impl Recorder for DirectoryRecorder {
    fn is_bitwise_reproducible(&self) -> bool {
        self.ranks.is_none()
    }

    fn replay(&mut self, level: usize) -> Option<Record> {
        let is_of_level = self.replayed.front().is_some_and(|record| record.row.level == level);
        if is_of_level { self.replayed.pop_front() } else { None }
    }

    fn record(
        &mut self,
        record: &Record,
        analysis: &Analysis,
        problem: &Problem,
    ) -> Result<(), OptimizerError> {
        Ok(self.keep(record, analysis, problem)?)
    }
}

/// Whether the field of an evaluation is written when it is computed; the first one on a mesh is that of the initial design.
fn is_wanted(kept: FieldsKept, record: &Record, is_first: bool) -> bool {
    match kept {
        FieldsKept::Every => true,
        FieldsKept::Improved => record.improved,
        FieldsKept::FirstLast => is_first,
        FieldsKept::Nothing => false,
    }
}

/// Writes the field file of an evaluation, with the estimated error of every element where there is one, or the pieces of
/// all ranks.
pub(super) fn write_field(
    directory: &RunDirectory,
    pieces: Option<&SharedPieces>,
    evaluation: usize,
    problem: &Problem,
    (analysis, error): (&Analysis, Option<&[f64]>),
) -> Result<(), Error> {
    if let Some(pieces) = pieces {
        return pieces.write(directory, evaluation, problem, analysis);
    }
    Ok(directory.write_field(evaluation, &field_bytes(problem, analysis, error)?)?)
}

/// The VTU file of a field.
fn field_bytes(problem: &Problem, analysis: &Analysis, error: Option<&[f64]>) -> Result<Vec<u8>, Error> {
    let (thickness, deviation) = (fields::thickness(problem, analysis), fields::deviation(problem, analysis));
    let data = FieldData {
        error,
        thickness: thickness.as_deref(),
        deviation: deviation.as_deref(),
        bodies: problem.bodies(),
        ..FieldData::of(analysis)
    };
    Ok(fields::vtu(problem.states(), &data)?)
}

/// Writes the PVD file over all field files; its time is the evaluation number.
pub(super) fn write_collection(directory: &RunDirectory, evaluations: &[usize]) -> Result<(), Error> {
    let files = directory.fields_in_collection(evaluations)?;
    let text = pvd_text(evaluations.iter().zip(&files).map(|(&e, file)| (e as f64, file.as_str())))?;
    Ok(directory.write(&directory.collection(), text.as_bytes())?)
}
