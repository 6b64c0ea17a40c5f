//! What was computed before a run was interrupted is replayed, as long as the method asks for the same to the last bit.

use std::time::Instant;

use super::incumbent::{BestField, Incumbent};
use super::run::Run;
use super::stop::Stop;
use super::{Best, Observer, Record, StopReason};
use crate::error::Error;
use crate::nlopt::Sample;
use crate::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};

/// Largest difference of a design to that of its record, relative to the largest variable, where the work of either is or was
/// shared out: sums over ranks have no fixed last bits. Well above what they leave,
/// and far below the steps of a method.
const CLOSE: f64 = 1e-7;

impl Run<'_> {
    /// Whether a record is that of a design on this mesh: to the last bit, or closely where ranks had a share in it.
    pub(super) fn is_of(&self, record: &Record, p: &[f64]) -> bool {
        let follows = record.row.evaluation == self.evaluations() && record.design.len() == p.len();
        follows && self.first_other(&record.design, p).is_none()
    }

    /// The first variable in which a design is another one than that of a record.
    fn first_other(&self, was: &[f64], is: &[f64]) -> Option<usize> {
        let largest = was.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let is_other = |(was, is): (&f64, &f64)| match self.is_shared_out {
            true => (was - is).abs() > CLOSE * largest,
            false => was.to_bits() != is.to_bits(),
        };
        was.iter().zip(is).position(is_other)
    }

    /// Ends a search where the run had come to its last evaluation, or to the last before a look at the search, which a step back took.
    pub(super) fn check_replay(&self) -> Result<(), Stop> {
        let stepped_back = self.next.as_ref().and_then(|record| record.stepped_back);
        let limit = stepped_back.filter(|&reason| reason == StopReason::MaxEvaluations);
        limit.map_or(Ok(()), |limit| Err(Stop::Limit(limit)))
    }

    /// Why a record is not the answer to what the method asks for.
    pub(super) fn difference(&self, record: &Record, p: &[f64]) -> Error {
        let Record { row, design, .. } = record;
        let cause = match self.first_other(design, p) {
            _ if row.evaluation != self.evaluations() => {
                format!("evaluation {} follows where {} is expected", row.evaluation, self.evaluations())
            }
            Some(k) => format!("variable {k} was {:e} m, now the method asks for {:e} m", design[k], p[k]),
            None => format!("it has {} variables, now there are {}", design.len(), p.len()),
        };
        Error::Replay { evaluation: row.evaluation, cause }
    }

    /// The answer to a design that was computed before the run was interrupted.
    pub(super) fn replay(&mut self, record: Record) -> Result<Sample, Stop> {
        let values: Vec<f64> = record.constraints.iter().map(|(value, _)| *value).collect();
        let members = record.members.iter().map(|(value, _)| *value).collect();
        let initial = self.initial((record.row.objective, members), record.row.worst_quality, &values)?;
        let sample = self.sample(&initial, &record);
        let cache = std::mem::replace(&mut self.cache, SolverCache::with_methods(&record.methods));
        let comparison = self.compare(record.row.objective, &sample);
        if comparison.is_improved() != record.improved
            || self.iterations_after(comparison) != record.row.iteration
        {
            let (evaluation, cause) = (record.row.evaluation, "it compares otherwise with the others");
            return Err(Stop::Error(Box::new(Error::Replay { evaluation, cause: cause.to_owned() })));
        }
        // The time of a resumed run begins where it has something to compute.
        self.clock = Instant::now();
        self.observer.evaluation(&record.row);
        self.keep(record, sample.clone(), comparison, || BestField::Replayed(Box::new(cache)));
        Ok(sample)
    }

    /// The best design with its field: one that was replayed is computed, and comes out as it was.
    pub(super) fn with_field(&mut self, best: Incumbent) -> Result<Best, Error> {
        let Incumbent { evaluation, values, objective, violation, field, .. } = best;
        let analysis = match field {
            BestField::Computed(analysis) => *analysis,
            BestField::Replayed(mut cache) => {
                computed_again(&values, &mut cache, self.problem, self.observer)?
            }
        };
        Ok(Best { evaluation, values, objective, violation, analysis })
    }
}

impl Incumbent {
    /// Computes its field where it was replayed.
    pub(super) fn compute_field(
        &mut self,
        problem: &Problem,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        if let BestField::Replayed(cache) = &mut self.field {
            let analysis = computed_again(&self.values, cache, problem, observer)?;
            self.field = BestField::Computed(Box::new(analysis));
        }
        Ok(())
    }
}

/// The field of a design that was computed before the run was interrupted.
fn computed_again(
    values: &[f64],
    cache: &mut SolverCache,
    problem: &Problem,
    observer: &mut dyn Observer,
) -> Result<Analysis, Error> {
    observer.phase("computing the field of the best design");
    problem.evaluate(values, Derivatives::Search, cache, &mut NoProgress)
}
