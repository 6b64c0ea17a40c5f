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

use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::constraint::Bound;
use fluxmorph_optimizer::driver::StopReason;
use fluxmorph_optimizer::memory_estimate::Sizes;
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};

use super::confirmation::ShapeMeshes;
use super::finer::{Cut, FinerMesh, FinerProblem, looked_at_once};
use super::shape_pair::ShapePair;
use super::summary;
use crate::build::{DividedMesh, Mode, memory_limit, set_up_on};
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::files::{ObjectiveResult, Verification};
use crate::show::Observer;

/// Counted work of a shape on a fresh mesh, in evaluations, beyond which elements are cut instead. The shipped runs have 4 to 21, and
/// second-order edge elements of `shield_edge.toml`, which would take twenty minutes after a search of three, 29.
const MOST_EVALUATIONS: f64 = 25.0;

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
        let factor = config.output.verify_refinement;
        if factor == 0.0 || problem.shape().is_none() || problem.objective().is_none() {
            return None;
        }
        let parts = factor.ceil() as usize;
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
        if self.config.output.verify_refinement == 0.0 {
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
        match outcome {
            Ok(Outcome::Found(verification)) => {
                for constraint in verification.constraints.iter().filter(|constraint| !constraint.satisfied) {
                    let (name, share) = (&constraint.name, constraint.value / constraint.bound - 1.0);
                    observer.warning(&format!(
                        "on the fresh mesh the best shape violates the constraint `{name}`: {:+.2} % from its bound",
                        100.0 * share
                    ));
                }
                objective.verified_ratio = Some(verification.ratio);
                objective.verification = Some(verification);
            }
            Ok(Outcome::TooLarge(shortage)) => observer
                .notice(&format!("the best shape is not checked on a finer mesh, which takes {shortage}")),
            Ok(Outcome::CutShort | Outcome::TooDear(_)) => {
                observer
                    .notice("the best shape is not checked on a fresh mesh: the run was stopped before that");
                if !cut_short {
                    return Check::CutShort;
                }
            }
            Err(error) => {
                observer.warning(&format!(
                    "the best shape could not be checked on a fresh mesh: {error}; output.verify_refinement = 0 leaves this check out"
                ));
            }
        }
        Check::Finished
    }

    /// Both values on the run's own meshes with all elements cut.
    fn compute_on_finer_elements(&self, interrupted: &dyn Fn() -> bool) -> Result<Outcome, Error> {
        let Some(meshes) = self.meshes else { return Ok(Outcome::CutShort) };
        let parts = self.config.output.verify_refinement;
        let mesh = FinerMesh::new(self.config, &meshes.full, Cut::Growth(parts))?;
        if let Some(shortage) = memory_limit::shortage(self.sizes.on_other_mesh(mesh.growth())[0]) {
            return Ok(Outcome::TooLarge(shortage));
        }
        let finer = FinerProblem::on(mesh, self.source)?;
        if let Some(shortage) = memory_limit::shortage_of(&finer.setup.problem) {
            return Ok(Outcome::TooLarge(shortage));
        }
        let tets = finer.setup.problem.original().topology().tets().len();
        let values = finer.values(&meshes.solved, interrupted)?;
        let found = values.map(|values| verification(parts, tets, values)).transpose()?;
        Ok(found.map_or(Outcome::CutShort, Outcome::Found))
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
        let displacements = self.shapes.displacements(&config, &setup)?;
        let problem = setup.problem;
        let tets = problem.original().topology().tets().len();
        let (mut values, mut bounds, mut constraints) = (Vec::new(), Vec::new(), Vec::new());
        let mut cache = SolverCache::default();
        for displacement in displacements {
            if interrupted() {
                return Ok(Outcome::CutShort);
            }
            let analysis = analysis_at(&problem, &mut cache, &displacement)?;
            if values.is_empty() {
                bounds = bounds_at(&problem, &analysis)?;
            }
            constraints = summary::constraints(&problem, &analysis, &bounds);
            values.push(analysis.objective.unwrap_or(f64::NAN));
        }
        let (refinement, values) = (fresh.parts as f64, [values[0], values[1]]);
        let found = verification(refinement, tets, values)?;
        Ok(Outcome::Found(Verification { constraints, ..found }))
    }
}

/// What was found on a mesh with so many elements.
fn verification(refinement: f64, tets: usize, [initial, best]: [f64; 2]) -> Result<Verification, Error> {
    let ratio = best / initial;
    if !ratio.is_finite() {
        let cause = "the objective of the initial design is zero on the fresh mesh";
        return Err(OptimizerError::Optimisation { cause }.into());
    }
    Ok(Verification { refinement, tets, initial, best, ratio, constraints: Vec::new() })
}

/// The bounds of the constraints where this is the analysis of the initial shape.
fn bounds_at(problem: &Problem, initial: &Analysis) -> Result<Vec<Bound>, Error> {
    let pairs = problem.constraints().iter().zip(&initial.constraints);
    Ok(pairs.map(|(constraint, measured)| constraint.bound(measured.value)).collect::<Result<_, _>>()?)
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::build::{Setup, set_up};

    /// The coarse shield; without its control grid and a filter every node is a variable.
    fn quick(variables_on_nodes: bool) -> (Config, SourceMap) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml");
        let (mut config, source) = Config::from_file(&path, &[]).expect("a shipped configuration");
        if variables_on_nodes && let Some(design) = &mut config.design {
            (design.grid, design.filter_radius) = (None, Some(0.0));
        }
        (config, source)
    }

    /// A smooth shape near the frame that the shield's optimiser finds, by the place of every variable.
    fn dished(setup: &Setup) -> Vec<f64> {
        let points = setup.problem.shape().expect("a shape").surface().points();
        points.iter().map(|x| 0.2 * x[0].max(0.5 * x[1]) - 4e-3).collect()
    }

    /// What the observer received.
    #[derive(Default)]
    struct Recorded {
        notices: Vec<String>,
        warnings: Vec<String>,
    }

    impl Observer for Recorded {
        fn notice(&mut self, message: &str) {
            self.notices.push(message.to_owned());
        }

        fn warning(&mut self, message: &str) {
            self.warnings.push(message.to_owned());
        }
    }

    fn verified(
        config: &Config,
        source: &SourceMap,
        shapes: &ShapePair,
        stop_reason: StopReason,
        interrupted: bool,
    ) -> (ObjectiveResult, Recorded) {
        let mut objective = ObjectiveResult {
            initial: 1.0,
            best: 0.5,
            ratio: 0.5,
            best_evaluation: 1,
            verified_ratio: None,
            verification: None,
            homogeneity: None,
            terms: Vec::new(),
        };
        let mut recorded = Recorded::default();
        let problem = set_up(config, source, Mode::Optimisation).expect("a sound problem").problem;
        let fresh = FreshMesh::of(config, &problem).map(|fresh| FreshMesh { memory: [0; 2], ..fresh });
        let (fresh, meshes, sizes) = (fresh.as_ref(), None, Sizes::of(&problem));
        let check = MeshIndependence { config, source, stop_reason, shapes, fresh, meshes, sizes };
        check.verify(&mut objective, &|| interrupted, &mut recorded);
        (objective, recorded)
    }

    #[test]
    fn the_same_cells_give_the_same_ratio_whatever_carries_the_shape() {
        for on_nodes in [false, true] {
            let (mut config, source) = quick(on_nodes);
            config.output.verify_refinement = 1.0;
            let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
            let best = dished(&setup);
            let value = |p: &[f64]| {
                let analysis = setup
                    .problem
                    .evaluate(p, Derivatives::None, &mut SolverCache::default(), &mut NoProgress)
                    .expect("a valid mesh");
                analysis.objective.expect("an objective")
            };
            let shape = setup.problem.shape().expect("a shape");
            let expected = value(&best) / value(shape.initial());
            let shapes = ShapePair::of(&config, &setup, &best).expect("a design surface");
            assert_eq!(matches!(shapes, ShapePair::Displacements { .. }), on_nodes);
            let (objective, recorded) =
                verified(&config, &source, &shapes, StopReason::ObjectiveConverged, false);
            let found = objective.verification.unwrap_or_else(|| panic!("{:?}", recorded.warnings));
            assert_eq!(objective.verified_ratio, Some(found.ratio));
            // The residual that every linear solution has to reach, twice.
            assert!((found.ratio - expected).abs() < 2e-9 * expected, "{} {expected}", found.ratio);
        }
    }

    #[test]
    fn a_smooth_shape_on_nodes_keeps_its_value_on_a_finer_surface() {
        let ratio = |on_nodes| {
            let (mut config, source) = quick(on_nodes);
            config.output.verify_refinement = 2.0;
            let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
            let shapes = ShapePair::of(&config, &setup, &dished(&setup)).expect("a design surface");
            let (objective, recorded) =
                verified(&config, &source, &shapes, StopReason::ObjectiveConverged, false);
            objective.verified_ratio.unwrap_or_else(|| panic!("{:?}", recorded.warnings))
        };
        let (grid, nodes) = (ratio(false), ratio(true));
        println!("verified ratio of one shape: on a grid {grid:.6}, on nodes {nodes:.6}");
        // Bilinear on squares or linear on triangles: the two differ along the ridge of the shape alone.
        assert!((grid - nodes).abs() < 2e-3, "{grid} {nodes}");
        assert!(grid < 0.99, "the shape changes the field: {grid}");
    }

    #[test]
    fn a_run_that_was_stopped_is_not_checked() {
        let (config, source) = quick(false);
        let shapes = ShapePair::Variables([vec![0.0; 91], vec![1e-3; 91]]);
        for (reason, interrupted) in [
            (StopReason::Interrupted, false),
            (StopReason::MaxTime, false),
            (StopReason::ObjectiveConverged, true),
        ] {
            let (objective, recorded) = verified(&config, &source, &shapes, reason, interrupted);
            assert_eq!(objective.verified_ratio, None);
            assert!(
                recorded.notices.len() == 1 && recorded.notices[0].contains("was stopped"),
                "{:?}",
                recorded.notices
            );
        }
    }

    #[test]
    fn every_cell_that_moves_or_is_observed_is_halved_and_no_other() {
        let (config, source) = quick(false);
        let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
        let fresh = FreshMesh::of(&config, &setup.problem).expect("a generated mesh");
        let mesh = fresh.mesh.build(&config, &source).expect("sound parameters");
        let lines = |mesh: &fluxmorph_geometry::Mesh, axis: usize| {
            let mut all: Vec<f64> = mesh.points().iter().map(|x| x[axis]).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        };
        // Plate, moving air and observation cells of the quarter: 160 × 280 mm, from −60 to 30 mm.
        for (axis, low, high) in [(0, 0.0, 0.16), (1, 0.0, 0.28), (2, -0.06, 0.03)] {
            let (old, new) = (lines(&setup.full_mesh, axis), lines(&mesh, axis));
            let inside = |lines: &[f64]| lines.iter().filter(|&&c| (low..=high).contains(&c)).count();
            assert_eq!(inside(&new) - 1, 2 * (inside(&old) - 1), "axis {axis}");
            assert_eq!(new.len() - inside(&new), old.len() - inside(&old), "axis {axis}, far cells");
        }
    }

    #[test]
    fn where_a_fresh_mesh_costs_too_much_elements_are_cut() {
        let (config, source) = quick(false);
        let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
        let problem = &setup.problem;
        let shape = problem.shape().expect("a shape");
        let original = problem.original().clone();
        let best = shape.carried(shape.initial(), &dished(&setup)).expect("a mild shape").moved.mesh;
        let (full, tets) = (setup.full_mesh.clone(), original.topology().tets().len());
        let meshes = ShapeMeshes { full, solved: [original, best] };
        let fresh = FreshMesh { work: 1.0, ..FreshMesh::of(&config, problem).expect("a generated mesh") };
        let shapes = ShapePair::of(&config, &setup, &dished(&setup)).expect("a design");
        let check = MeshIndependence {
            config: &config,
            source: &source,
            stop_reason: StopReason::ObjectiveConverged,
            shapes: &shapes,
            fresh: Some(&fresh),
            meshes: Some(&meshes),
            sizes: Sizes::of(problem),
        };
        let mut recorded = Recorded::default();
        let found = check.compute(&fresh, &|| false, &mut recorded).expect("both are computed");
        let Outcome::Found(found) = found else { panic!("cut short, or too large") };
        assert!(found.tets >= 2 * tets && (0.5..0.999).contains(&found.ratio), "{found:?}");
        assert!(
            recorded.notices.iter().any(|notice| notice.contains("cut, instead")),
            "{:?}",
            recorded.notices
        );
    }

    #[test]
    fn constraints_are_measured_anew_and_a_violated_one_is_a_warning() {
        let (mut config, source) = quick(false);
        let text = "[[constraints]]\nkind = \"volume\"\nregion = \"plate\"\nupper_ratio = 1.0\n";
        let whole = format!("{}\n{text}", source.text());
        config.constraints = Config::from_str(&whole, "device.toml").expect("sound").0.constraints;
        let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
        let shapes = ShapePair::of(&config, &setup, &[1e-3; 91]).expect("a design");
        let (objective, recorded) =
            verified(&config, &source, &shapes, StopReason::ObjectiveConverged, false);
        let constraints = objective.verification.expect("it is computed").constraints;
        // The plate of 120 × 240 × 10 mm, a millimetre thicker everywhere.
        assert!((constraints[0].bound - 2.88e-4).abs() < 1e-12, "{constraints:?}");
        assert!((constraints[0].value - 1.1 * 2.88e-4).abs() < 1e-12 && !constraints[0].satisfied);
        assert!(
            recorded.warnings.len() == 1 && recorded.warnings[0].contains("`volume_plate`: +10.00 %"),
            "{:?}",
            recorded.warnings
        );
    }

    #[test]
    fn the_initial_design_as_the_best_is_the_ratio_one() {
        let (config, source) = quick(false);
        let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
        let shapes = ShapePair::of(&config, &setup, &[0.0; 91]).expect("a design");
        assert_eq!(shapes, ShapePair::Unchanged);
        let (objective, recorded) = verified(&config, &source, &shapes, StopReason::MeshLimited, false);
        assert_eq!((objective.verified_ratio, objective.verification), (Some(1.0), None));
        assert!(recorded.notices.is_empty() && recorded.warnings.is_empty());
    }
}
