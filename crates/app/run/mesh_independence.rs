//! Is the gain of a run the shape's, or the mesh's? Initial and best shape again, on a mesh the optimiser never saw.
//!
//! An optimiser sees the discrete objective: the field's, and the error of a mesh that moves along with the design. What it
//! gains from that error shrinks where the cells do. So the run's mesh is generated anew with every cell that moves or is
//! observed divided (`DividedMesh`), brought to both shapes, and the ratio of the two values is the *verified ratio*; the
//! constraints are measured there too. Variables of a control grid mean the same on any mesh; where the nodes are the
//! variables, the displacement of the old surface is interpolated on the fresh one ([`ShapePair`]). A check
//! that cannot be done is reported, and costs a run nothing else. A mesh that cannot be generated anew has all its elements
//! cut instead, at both shapes ([`FinerProblem`]).
//!
//! What both meshes share shows in neither ratio: the size of the box and its far cells, materials, conditions, elements and
//! their order, the model of every region.
//!
//! Does not live here: whether the gradient is the objective's, which is `verify`.

use fluxmorph_geometry::Millimetres;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::constraint::{Bound, Constraint};
use fluxmorph_optimizer::driver::StopReason;
use fluxmorph_optimizer::memory_estimate::Sizes;
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};

use super::confirmation::ShapeMeshes;
use super::finer::{Cut, FinerMesh, FinerProblem, both, looked_at_once};
use super::shape_pair::{ShapePair, ShapesOnMesh};
use super::summary;
use crate::build::{DividedMesh, Mode, memory_limit, set_up_on};
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::files::{ConstraintResult, ObjectiveResult, ShapeDeviation, Verification, VerificationMesh};
use crate::show::{self, Observer};

/// Counted work of a shape on a fresh mesh, in evaluations, beyond which elements are cut instead. The shipped runs have 4 to 21, and
/// second-order edge elements of `shield_edge.toml`, which would take twenty minutes after a search of three, 29.
const MOST_EVALUATIONS: f64 = 25.0;

/// Share of its motion by which the surface of a control grid may be off that of the run, or its facets off what it describes: between
/// the nodes of coarse cells a smooth shape is off by some percent.
const LARGEST_DEVIATION: f64 = 0.1;

/// Why facets may be far from what a control grid describes.
const WHY_FAR: &str = "as the control grid is finer than the cells of the surface, or bends within them";

/// Share of the gain by which both ratios may be apart all the same.
const LARGEST_DIFFERENCE: f64 = 0.1;

/// Whether a check was finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// It was, or none was wanted, or the run itself had been cut short.
    Finished,
    /// A signal came first.
    CutShort,
}

/// The mesh-independence check of a run: is its gain that of the shape, or of the mesh?
#[derive(Clone, Copy, Debug)]
pub struct MeshIndependence<'a> {
    /// Its configuration.
    pub config: &'a Config,
    /// The text of the configuration.
    pub source: &'a SourceMap,
    /// How it ended.
    pub stop_reason: StopReason,
    /// Its initial and its best shape.
    pub shapes: &'a ShapePair,
    /// The mesh to check on; `None` where there is none.
    pub fresh: Option<&'a FreshMesh>,
    /// The meshes of both shapes: what is cut where no mesh can be generated anew.
    pub meshes: Option<&'a ShapeMeshes>,
    /// What the run's problem holds, from which the memory of a finer one follows.
    pub sizes: Sizes,
    /// Its constraints.
    pub constraints: &'a [ConstraintResult],
}

/// What a check comes to.
enum Outcome {
    Found(Verification),
    /// A signal came first.
    CutShort,
    /// There is not enough memory.
    TooLarge(String),
    /// A design costs so many times what one of the run does.
    TooDear(f64),
}

/// The mesh of a check.
#[derive(Clone, Debug)]
pub struct FreshMesh {
    mesh: DividedMesh,
    /// Parts of a cell along each axis.
    parts: usize,
    /// Bytes that the process holds at the peak of the check, about: the least and the most.
    memory: [usize; 2],
    /// Counted work of a design of the run [ns].
    work: f64,
}

impl FreshMesh {
    /// That of a problem which is set up; `None` where no check is wanted, or no other mesh can be generated.
    pub fn of(config: &Config, problem: &Problem) -> Option<Self> {
        let output = &config.output;
        if !output.is_verified_on_finer_cells() || problem.shape().is_none() || problem.objective().is_none()
        {
            return None;
        }
        let parts = output.verify_refinement.ceil() as usize;
        let mesh = DividedMesh::of(config, problem, parts)?;
        let growth = mesh.tet_count()? as f64 / config.mesh.tet_count()?.max(1) as f64;
        let memory = Sizes::of(problem).on_other_mesh(growth);
        Some(Self { memory, mesh, parts, work: problem.work_of_design() })
    }

    /// Bytes that the process holds at the peak of the check, about: the least and the most, as [`Sizes::on_other_mesh`].
    pub fn memory(&self) -> [usize; 2] {
        self.memory
    }
}

impl MeshIndependence<'_> {
    /// Fills in the verified ratio. Where there is none, the reason is reported to the observer.
    ///
    /// `interrupted` is asked before each part of the work.
    pub fn verify(
        &self,
        objective: &mut ObjectiveResult,
        interrupted: &dyn Fn() -> bool,
        observer: &mut dyn Observer,
    ) -> Check {
        if !self.config.output.is_verified_on_finer_cells() {
            return Check::Finished;
        }
        if *self.shapes == ShapePair::Unchanged {
            objective.verified_ratio = Some(1.0);
            return Check::Finished;
        }
        if let Some(shortage) = self.fresh.and_then(|fresh| memory_limit::shortage(fresh.memory[0])) {
            observer
                .notice(&format!("the best shape is not checked on a fresh mesh, which takes {shortage}"));
            return Check::Finished;
        }
        let cut_short = matches!(self.stop_reason, StopReason::Interrupted | StopReason::MaxTime);
        let outcome = match self.fresh {
            _ if cut_short || interrupted() => Ok(Outcome::CutShort),
            Some(fresh) => {
                observer.phase("checking the best shape on a fresh mesh");
                self.compute(fresh, interrupted, observer)
            }
            None => {
                observer.phase("checking the best shape on finer elements");
                self.compute_on_finer_elements(interrupted)
            }
        };
        if !matches!(outcome, Ok(Outcome::Found(_))) {
            let facets = self.shapes.facet_deviation().and_then(of_facets);
            facets.iter().for_each(|facets| observer.notice(facets));
        }
        match outcome {
            Ok(Outcome::Found(verification)) => {
                for constraint in verification.violated() {
                    let (name, bound) = (&constraint.name, constraint.bound);
                    observer.warning(&format!(
                        "on the finer mesh the best shape violates the constraint `{name}`: {}",
                        excess(constraint.value - bound, bound)
                    ));
                }
                if let Some(notice) = of_another_shape(&verification, objective.ratio) {
                    observer.notice(&notice);
                }
                objective.verified_ratio = Some(verification.ratio);
                objective.verification = Some(verification);
            }
            Ok(Outcome::TooLarge(shortage)) => observer
                .notice(&format!("the best shape is not checked on a finer mesh, which takes {shortage}")),
            Ok(Outcome::CutShort | Outcome::TooDear(_)) => {
                observer
                    .notice("the best shape is not checked on a finer mesh: the run was stopped before that");
                if !cut_short {
                    return Check::CutShort;
                }
            }
            Err(error) => {
                observer.warning(&format!(
                    "the best shape could not be checked on a finer mesh: {error}; output.verify_refinement = 0 leaves this check out"
                ));
            }
        }
        Check::Finished
    }

    /// Both values on the run's own meshes with all elements cut.
    fn compute_on_finer_elements(&self, interrupted: &dyn Fn() -> bool) -> Result<Outcome, Error> {
        let Some(meshes) = self.meshes else { return Ok(Outcome::CutShort) };
        let parts = self.config.output.verify_refinement;
        let mesh = FinerMesh::new(&looked_at_once(self.config.clone()), &meshes.full, Cut::Growth(parts))?;
        if let Some(shortage) = memory_limit::shortage(self.sizes.on_other_mesh(mesh.growth())[0]) {
            return Ok(Outcome::TooLarge(shortage));
        }
        let finer = FinerProblem::on(mesh, self.source)?;
        if let Some(shortage) = memory_limit::shortage_of(&finer.setup.problem) {
            return Ok(Outcome::TooLarge(shortage));
        }
        let Some(analyses) = finer.analyses(&meshes.solved, interrupted)? else {
            return Ok(Outcome::CutShort);
        };
        let found = self.verification(&finer.setup.problem, (VerificationMesh::Cut, parts), &analyses)?;
        Ok(Outcome::Found(Verification { deviation: self.shapes.facet_deviation(), ..found }))
    }

    /// Both values on the fresh mesh, or on cut elements where it cannot be moved to the best shape or costs too much.
    fn compute(
        &self,
        fresh: &FreshMesh,
        interrupted: &dyn Fn() -> bool,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Error> {
        match self.compute_on(fresh, interrupted) {
            Err(Error::Optimizer(error)) if error.is_unreached() && self.meshes.is_some() => {
                observer.notice(
                    "a fresh mesh cannot be moved to the best shape without inverting elements: both shapes are checked on their \
                     own elements, cut, instead",
                );
                self.compute_on_finer_elements(interrupted)
            }
            Ok(Outcome::TooDear(times)) => {
                observer.notice(&format!(
                    "a fresh mesh costs {times:.0} evaluations for each shape: both are checked on their own elements, cut, instead"
                ));
                self.compute_on_finer_elements(interrupted)
            }
            computed => computed,
        }
    }

    /// Both values on the fresh mesh.
    fn compute_on(&self, fresh: &FreshMesh, interrupted: &dyn Fn() -> bool) -> Result<Outcome, Error> {
        let config = fresh_configuration(self.config);
        let mesh = (fresh.mesh.build(&config, self.source)?, None);
        let setup = set_up_on(mesh, &config, self.source, Mode::Analysis)?;
        // What the factor of this very mesh takes is known now.
        if let Some(shortage) = memory_limit::shortage_of(&setup.problem) {
            return Ok(Outcome::TooLarge(shortage));
        }
        let times = setup.problem.work_of_design() / fresh.work;
        if times > MOST_EVALUATIONS && self.meshes.is_some() {
            return Ok(Outcome::TooDear(times));
        }
        if interrupted() {
            return Ok(Outcome::CutShort);
        }
        let ShapesOnMesh { displacements, deviation } = self.shapes.on(&config, &setup)?;
        let problem = setup.problem;
        let analyse =
            |displacement: &Vec<Point>, cache: &mut SolverCache| analysis_at(&problem, cache, displacement);
        let Some(analyses) = both(displacements.each_ref(), interrupted, analyse)? else {
            return Ok(Outcome::CutShort);
        };
        let mesh = (VerificationMesh::Fresh, fresh.parts as f64);
        let found = self.verification(&problem, mesh, &analyses)?;
        Ok(Outcome::Found(Verification { deviation, ..found }))
    }

    /// What the analyses of the initial and the best shape on such a mesh come to.
    fn verification(
        &self,
        problem: &Problem,
        (mesh, refinement): (VerificationMesh, f64),
        [initial, best]: &[Analysis; 2],
    ) -> Result<Verification, Error> {
        let [of_initial, of_best] = [initial, best].map(|analysis| analysis.objective.unwrap_or(f64::NAN));
        let ratio = of_best / of_initial;
        if !ratio.is_finite() {
            let cause = "the objective of the initial design is zero on the finer mesh";
            return Err(OptimizerError::Optimisation { cause }.into());
        }
        // A share of an initial value that is not positive there: the bound of the run.
        let known = |own: &Constraint| {
            self.constraints.iter().find(|found| found.name == own.name).map(|found| found.bound)
        };
        let measured = problem.constraints().iter().zip(&initial.constraints);
        let bounds = measured.map(|(own, at_initial)| own.bound_beside(known(own), at_initial.value));
        let bounds: Vec<Bound> = bounds.collect::<Result<_, OptimizerError>>()?;
        Ok(Verification {
            mesh,
            refinement,
            tets: problem.original().topology().tets().len(),
            deviation: None,
            initial: of_initial,
            best: of_best,
            ratio,
            constraints: summary::constraints(problem, best, &bounds),
        })
    }
}

/// That the best shape is so far from what its control grid describes that another mesh has another one: on a fresh mesh, where the
/// ratios of both differ, and on cut elements, which have the facets of the run.
fn of_another_shape(found: &Verification, ratio: f64) -> Option<String> {
    let deviation = found.deviation?;
    if found.mesh == VerificationMesh::Cut {
        return of_facets(deviation).map(|facets| format!("{facets}; cut elements keep the facets"));
    }
    let differs = (found.ratio - ratio).abs() > LARGEST_DIFFERENCE * (ratio - 1.0).abs();
    (differs && is_far(deviation)).then(|| {
        format!(
            "F/F0 on the fresh mesh, {}, is that of another shape: {} that of the run, {WHY_FAR}; with a coarser grid or smaller cells \
             both have one shape",
            show::ratio(found.ratio),
            distance(deviation)
        )
    })
}

/// That facets are so far from what a control grid describes that another mesh has another shape.
fn of_facets(deviation: ShapeDeviation) -> Option<String> {
    is_far(deviation).then(|| {
        format!(
            "the facets of the best shape are {} the surface that design.grid describes, {WHY_FAR}: on another mesh the same variables \
             are another shape, whose F/F0 may differ; take a coarser grid or smaller cells",
            distance(deviation)
        )
    })
}

fn is_far(ShapeDeviation { distance_m, motion_m }: ShapeDeviation) -> bool {
    distance_m > LARGEST_DEVIATION * motion_m
}

fn distance(ShapeDeviation { distance_m, motion_m }: ShapeDeviation) -> String {
    let [distance, motion] = [distance_m, motion_m].map(Millimetres);
    format!("up to {distance:.3} mm (of {motion:.3} mm of motion) away from")
}

/// The configuration without what belongs to its own mesh.
fn fresh_configuration(config: &Config) -> Config {
    let mut fresh = Config { probes: Vec::new(), ..config.clone() };
    if let Some(design) = &mut fresh.design {
        // A list has one value for every node of the old surface.
        design.initial = crate::config::InitialDesign::Uniform(0.0);
        // The old surface's displacements are taken over as they are.
        design.filter_radius = design.grid.is_none().then_some(0.0);
    }
    looked_at_once(fresh)
}

/// The analysis of a shape.
fn analysis_at(
    problem: &Problem,
    cache: &mut SolverCache,
    displacement: &[Point],
) -> Result<Analysis, Error> {
    let moved = match problem.shape() {
        Some(shape) => shape.motion().moved(displacement)?,
        None => problem.moved(&[])?,
    };
    Ok(problem.analyse(moved, Derivatives::None, cache, &mut NoProgress)?)
}

/// How far a value is above or below its bound, as a share of this where it is none of zero.
fn excess(beyond: f64, bound: f64) -> String {
    let side = if beyond > 0.0 { "above" } else { "below" };
    match (beyond / bound).abs() {
        share if !share.is_finite() => format!("{:.1e} in its unit {side} its bound", beyond.abs()),
        share @ 1e-4.. => format!("{:.2} % {side} its bound", 100.0 * share),
        share => format!("{share:.1e} of its bound {side} it"),
    }
}

#[cfg(test)]
mod tests;
