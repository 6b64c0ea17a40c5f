//! One evaluation: the mesh, objective and constraints, the row of the history, and how the design compares.

use std::collections::BTreeMap;
use std::time::Instant;

use fluxmorph_geometry::ElementId;
use fluxmorph_remesh::Moved;

use super::carry::{Carriage, Standing};
use super::incumbent::{BestField, Comparison, Initial};
use super::run::Run;
use super::stop::{Refusal, Stop};
use super::{Evaluation, Record, StopReason, Watching, column};
use crate::error::Error;
use crate::geometric::WallThickness;
use crate::nlopt::Sample;
use crate::problem::{Analysis, Derivatives, Measured, Stage};

/// Share of the range of every variable within which two designs are one: what a linear continuation leaves out of an objective is
/// the square of it, about the residual that fields are solved to.
const NEARLY_THE_SAME: f64 = 1e-5;

/// How many designs in a row are answered so before the method is stopped, to search on nearer to the best design.
const MOST_REPEATED: usize = 20;

impl Run<'_> {
    /// ±F/|F0| and the constraints of a design, with their gradients; where the mesh does not carry it, what the method is to
    /// know of it (`carry`).
    pub(super) fn evaluate(&mut self, p: &[f64]) -> Result<Sample, Stop> {
        // Before the motion, and not behind it: what a signal finds begun is finished.
        if self.known(p).is_none() {
            if self.is_replaying() {
                self.check_replay()?;
            } else {
                self.check_limits()?;
            }
        }
        let mut carried = self.carry(p)?;
        let before =
            Standing { best: self.best_evaluation(), values: (self.evaluations, self.incumbent_values()) };
        let sample = match self.find_repetition(&carried) {
            Some(_) if self.repeated == MOST_REPEATED => {
                self.repeated = 0;
                let cause = "the mesh carries the method's designs no further than those before".to_owned();
                return Err(Stop::Mesh(Refusal { cause }));
            }
            Some((design, sample)) => {
                self.repeated += 1;
                carried.design = design;
                sample
            }
            None => self.sample_of(&carried.design, (&carried.moved, carried.seconds))?,
        };
        self.answer(p, (&carried, before), sample)
    }

    /// The best design or the one before with what is known of it, where the mesh carries no more than that of the step to a design:
    /// a computation would tell nothing new.
    fn find_repetition(&self, carried: &Carriage) -> Option<(Vec<f64>, Sample)> {
        let p = &carried.design;
        // What several ranks compute comes back to rounding alone, and a replay must decide alike; what is replayed may be of one
        // process, which has no record of a design that it knew.
        let has_record = || self.next.as_ref().is_none_or(|record| self.is_of(record, p));
        if !carried.is_cut() || self.is_shared_out && has_record() {
            return None;
        }
        let (lower, upper) = (self.shape().lower(), self.shape().upper());
        let is_near = |own: &[f64]| {
            (0..p.len()).all(|k| (p[k] - own[k]).abs() <= NEARLY_THE_SAME * (upper[k] - lower[k]))
        };
        let best = self.best.as_ref().map(|best| (&best.values, &best.sample));
        let known = best.into_iter().chain(self.latest.as_ref().map(|sample| (&self.last, sample)));
        let near = known.into_iter().find(|(own, _)| is_near(own));
        near.map(|(own, sample)| (own.clone(), sample.clone()))
    }

    /// ±F/|F0| and the constraints of a design, on its mesh, which took so many seconds.
    ///
    /// What is known of the best design is not computed again, nor what was computed before the run was
    /// interrupted.
    pub(super) fn sample_of(&mut self, p: &[f64], moved: (&Moved, f64)) -> Result<Sample, Stop> {
        if let Some(sample) = self.known(p) {
            return Ok(sample.clone());
        }
        if self.is_replaying() && (self.interrupted)() {
            return Err(Stop::Limit(StopReason::Interrupted));
        }
        match self.next.take() {
            Some(record) if self.is_of(&record, p) => self.replay(record),
            Some(record) => {
                let difference = self.difference(&record, p);
                self.next = Some(record);
                Err(Stop::Error(Box::new(difference)))
            }
            None => self.compute(p, moved),
        }
    }

    /// What is known of the best design.
    fn known(&self, p: &[f64]) -> Option<&Sample> {
        self.best.as_ref().filter(|best| best.values == p).map(|best| &best.sample)
    }

    /// Computes a design on its mesh, which took so many seconds.
    fn compute(&mut self, p: &[f64], (moved, before): (&Moved, f64)) -> Result<Sample, Stop> {
        let clock = Instant::now();
        self.computed += 1;
        let Self { problem, cache, observer, .. } = self;
        let progress = &mut Watching(&mut **observer);
        let mut analysis = problem.analyse(moved.clone(), Derivatives::Search, cache, progress)?;
        analysis.timings.remesh += before;
        let values: Vec<f64> = analysis.constraints.iter().map(|measured| measured.value).collect();
        let objective = analysis.objective.expect("an optimisation has an objective");
        let initial = self.initial((objective, analysis.member_values()), analysis.quality.worst, &values)?;
        let mut record = self.record(p, &initial, &analysis);
        let sample = self.sample(&initial, &record);
        // Before anything of it is kept.
        let name = |k: usize| format!("the constraint `{}`", self.problem.constraints()[k].name);
        sample.check(p.len(), (self.constraint_count(), &name), self.member_count())?;
        let comparison = self.compare(objective, &sample);
        record.improved = comparison.is_improved();
        record.row.iteration = self.iterations_after(comparison);
        let names = self.problem.constraints().iter().map(|constraint| column(&constraint.name));
        record.row.constraints = names.zip(sample.constraints.iter().map(|(c, _)| *c)).collect();
        record.row.seconds = before + clock.elapsed().as_secs_f64();
        for event in &analysis.solver_events {
            self.observer.notice(&event.to_string());
        }
        self.observer.stage(Stage::Writing);
        self.recorder.record(&record, &analysis, self.problem)?;
        self.observer.evaluation(&record.row);
        self.keep(record, sample.clone(), comparison, || BestField::Computed(Box::new(analysis)));
        Ok(sample)
    }

    /// Why a mesh is refused: what moves would reach a place at which the field is observed, or an element would be below the least
    /// quality.
    pub(super) fn refusal(&self, moved: &Moved) -> Option<String> {
        if let Err(reached) = self.problem.check_places(&moved.mesh) {
            return Some(reached.to_string());
        }
        let least = self.shape().least_quality;
        let quality = (least > 0.0).then(|| self.problem.quality(&moved.mesh))?;
        (quality.worst < least).then(|| {
            format!(
                "element {} would have the quality {:.4e}, below the minimum of {least:.4e}",
                quality.worst_element, quality.worst
            )
        })
    }

    /// Scale of the objective and bounds of the constraints, which the first design fixes.
    pub(super) fn initial(
        &mut self,
        (objective, members): (f64, Vec<f64>),
        quality: f64,
        measured: &[f64],
    ) -> Result<Initial, Error> {
        if let Some(initial) = &self.initial {
            return Ok(initial.clone());
        }
        if objective == 0.0 {
            let cause = if members.iter().any(|term| *term != 0.0) {
                "the worst term of the initial design is zero: one of the loads or frequencies has no field there, or nothing of what is \
                 asked for, as there is no loss at 0 Hz; leave it out of the objective"
            } else {
                "the objective of the initial design is zero: there is no field to change, its terms cancel, it is the deviation within \
                 a single element, or nothing is left to minimise; check coils, regions, frequencies and weights"
            };
            return Err(Error::Optimisation { cause });
        }
        let constraints = self.problem.constraints().iter().zip(measured).enumerate();
        let known = |k: usize| self.known_bounds.get(k).copied();
        let bounds = constraints.map(|(k, (own, &value))| own.bound_beside(known(k), value));
        let bounds = bounds.collect::<Result<_, _>>()?;
        let initial = Initial { objective, members, quality, bounds };
        Ok(self.initial.insert(initial).clone())
    }

    /// What the method sees of a design.
    pub(super) fn sample(&self, initial: &Initial, record: &Record) -> Sample {
        let scale = self.goal.sign() / initial.objective.abs();
        let constraints = initial.bounds.iter().zip(&record.constraints);
        Sample {
            value: scale * record.row.objective,
            gradient: record.gradient.iter().map(|d| scale * d).collect(),
            constraints: constraints
                .map(|(bound, (value, gradient))| (bound.excess(*value), bound.gradient(gradient)))
                .collect(),
            members: record
                .members
                .iter()
                .map(|(value, gradient)| (scale * value, gradient.iter().map(|d| scale * d).collect()))
                .collect(),
            limits: self
                .problem
                .constraints()
                .iter()
                .filter_map(|own| own.limits(&record.design))
                .flatten()
                .collect(),
        }
    }

    /// How a design compares with the best so far.
    pub(super) fn compare(&self, objective: f64, sample: &Sample) -> Comparison {
        match &self.best {
            None => Comparison::First,
            // Whatever its violation, see `start`.
            Some(best) if self.is_taking_up && sample.value < best.sample.value => Comparison::Better,
            Some(best) => best.compare(self.goal, objective, sample),
        }
    }

    pub(super) fn iterations_after(&self, comparison: Comparison) -> usize {
        self.iterations + usize::from(comparison == Comparison::Better)
    }

    /// The record of a design, but for how it compares with the best.
    fn record(&self, p: &[f64], initial: &Initial, analysis: &Analysis) -> Record {
        let shape = self.shape();
        let range = |thickness: &WallThickness| thickness.range(&analysis.mesh);
        let thickness = shape.thickness().map(range);
        let difference: Vec<f64> = p.iter().zip(&self.last).map(|(p, last)| p - last).collect();
        let objective = analysis.objective.expect("an optimisation has an objective");
        let gradient = analysis.gradient.clone().expect("a gradient was asked for");
        let region = |e: ElementId| analysis.mesh.topology().region_name_at(e).to_owned();
        let row = Evaluation {
            evaluation: self.evaluations,
            iteration: 0,
            objective,
            ratio: objective / initial.objective,
            gradient_norm: euclidean(&gradient),
            step_norm: euclidean(&difference),
            worst_quality: analysis.quality.worst,
            min_thickness_m: thickness.map(|t| t.0),
            max_thickness_m: thickness.map(|t| t.1),
            linear_iterations: analysis.linear_iterations,
            seconds: 0.0,
            step_to_inversion: analysis.inversion.element.map(|_| analysis.inversion.step),
            inversion_element: analysis.inversion.element.map(ElementId::index),
            inversion_region: analysis.inversion.element.map(region),
            level: self.level,
            forces: analysis.forces.clone(),
            constraints: BTreeMap::new(),
        };
        let constraint = |measured: &Measured| {
            (measured.value, measured.gradient.clone().expect("a gradient was asked for"))
        };
        Record {
            row,
            improved: false,
            stepped_back: self.stepping_back,
            design: p.to_vec(),
            gradient,
            constraints: analysis.constraints.iter().map(constraint).collect(),
            members: analysis.members.iter().map(constraint).collect(),
            methods: self.cache.methods(),
            worst_residual: analysis.worst_residual,
            timings: analysis.timings,
        }
    }
}

fn euclidean(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}
