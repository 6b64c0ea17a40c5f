//! The field problem of a configuration on a finer mesh, for any shape of the mesh that was cut.
//!
//! A shape is where the nodes of the mesh that is solved on lie. New nodes lie in the middle of its edges: the shape stays what
//! it is, facets of curved surfaces too, and no elastic map is needed. What differs is the error of the field alone. All
//! shapes of one mesh share what follows from the finer topology.
//!
//! Does not live here: how meshes are cut (`fluxmorph_geometry::refine`), and what the values are compared with
//! (`mesh_independence`).

use fluxmorph_geometry::refine::{Bisection, RefineLimits, Refinement, uniform};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId};
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};
use fluxmorph_remesh::{Moved, StepToInversion};

use crate::build::{Mode, Setup, memory_limit, remaining_nodes, set_up_on, with_cells_written_down};
use crate::config::{Config, Constraint, SourceMap};
use crate::error::Error;

/// A mesh that was cut, with the configuration of the field alone.
#[derive(Debug)]
pub struct FinerMesh {
    config: Config,
    refinement: Refinement,
    /// All nodes of the mesh that was cut [m].
    coarse: Vec<Point>,
    /// Those of them that are solved on.
    remaining: Vec<NodeId>,
    /// Elements of the mesh that was cut.
    tets: usize,
}

/// A field problem on a finer mesh.
#[derive(Debug)]
pub struct FinerProblem {
    /// The problem, without a design.
    pub setup: Setup,
    refinement: Refinement,
    /// All nodes of the mesh that was cut [m].
    coarse: Vec<Point>,
    /// Those of the mesh that is solved on, before it was cut and after.
    remaining: [Vec<NodeId>; 2],
}

/// How a mesh is made finer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    /// All edges halved so many times.
    Halvings(u32),
    /// At least so many times the elements: halved as often as that fits, then bisected.
    Growth(f64),
}

impl FinerMesh {
    /// A mesh with all its regions, cut.
    ///
    /// # Errors
    /// [`MeshError::RefinementLimit`] where the memory does not suffice.
    pub fn new(config: &Config, mesh: &Mesh, cut: Cut) -> Result<Self, Error> {
        let config = field_alone(config);
        let mesh = with_cells_written_down(&config, mesh)?;
        let (coarse, tets) = (mesh.points().to_vec(), mesh.topology().tets().len());
        let remaining = remaining_nodes(&config, mesh.topology());
        let refinement = cut.of(mesh).map_err(fluxmorph_optimizer::Error::from)?;
        Ok(Self { config, refinement, coarse, remaining, tets })
    }

    /// Its elements over those of the mesh that was cut.
    pub fn growth(&self) -> f64 {
        self.refinement.mesh().topology().tets().len() as f64 / self.tets as f64
    }
}

impl FinerProblem {
    /// The problem of a configuration on a mesh with all its regions, cut; its design moves nothing here.
    ///
    /// # Errors
    /// As [`FinerMesh::new`], and what the set-up fails with.
    pub fn new(config: &Config, source: &SourceMap, mesh: &Mesh, cut: Cut) -> Result<Self, Error> {
        Self::on(FinerMesh::new(config, mesh, cut)?, source)
    }

    /// The same on a mesh that was cut before.
    pub fn on(mesh: FinerMesh, source: &SourceMap) -> Result<Self, Error> {
        let FinerMesh { config, refinement, coarse, remaining, .. } = mesh;
        let setup = set_up_on((refinement.mesh().clone(), None), &config, source, Mode::Analysis)?;
        let remaining = [remaining, remaining_nodes(&config, refinement.mesh().topology())];
        Ok(Self { setup, refinement, coarse, remaining })
    }

    /// Of every node that the mesh has more than the one that was cut, the two in whose middle it lies.
    pub fn parents(&self) -> &[[NodeId; 2]] {
        self.refinement.parents()
    }

    /// The finer mesh of a shape, given by the mesh that was solved on.
    ///
    /// # Errors
    /// [`MeshError::Inverted`] where elements are so flat that their parts vanish in rounding.
    pub fn moved(&self, shape: &Mesh) -> Result<Moved, Error> {
        let mut all = self.coarse.clone();
        for (node, point) in self.remaining[0].iter().zip(shape.points()) {
            all[node.index()] = *point;
        }
        let fine = self.refinement.prolong(&all);
        let points = self.remaining[1].iter().map(|node| fine[node.index()]).collect();
        let original = self.setup.problem.original();
        let mesh =
            Mesh::new(original.topology().clone(), points).map_err(fluxmorph_optimizer::Error::from)?;
        let displacement = vec![[0.0; 3]; mesh.points().len()];
        Ok(Moved { mesh, displacement, inversion: StepToInversion::NEVER, tangent: None, newton_steps: 0 })
    }

    /// The analysis of a shape.
    ///
    /// # Errors
    /// As [`FinerProblem::moved`] and [`Problem::analyse`].
    pub fn analyse(&self, shape: &Mesh, cache: &mut SolverCache) -> Result<Analysis, Error> {
        let problem: &Problem = &self.setup.problem;
        Ok(problem.analyse(self.moved(shape)?, Derivatives::None, cache, &mut NoProgress)?)
    }

    /// The analyses of two shapes; `None` where a signal comes first.
    pub fn analyses(
        &self,
        shapes: &[Mesh; 2],
        interrupted: &dyn Fn() -> bool,
    ) -> Result<Option<[Analysis; 2]>, Error> {
        both(shapes.each_ref(), interrupted, |shape, cache| self.analyse(shape, cache))
    }
}

impl Cut {
    /// A mesh cut so.
    fn of(self, mesh: Mesh) -> Result<Refinement, MeshError> {
        let limits = RefineLimits { most_tets: memory_limit::most_tets(), ..RefineLimits::default() };
        let count = |refinement: &Refinement| refinement.mesh().topology().tets().len();
        let mut refinement = Refinement::none(mesh);
        let wanted = match self {
            Self::Halvings(times) => 8f64.powi(times as i32),
            Self::Growth(growth) => growth,
        } * count(&refinement) as f64;
        while 8.0 * count(&refinement) as f64 <= wanted {
            let halved = uniform(refinement.mesh(), limits)?;
            refinement = refinement.then(halved);
        }
        if count(&refinement) as f64 >= wanted {
            return Ok(refinement);
        }
        let mut bisection = Bisection::new(refinement.mesh(), limits);
        while (bisection.element_count() as f64) < wanted {
            let all: Vec<ElementId> = (0..bisection.element_count()).map(ElementId::new).collect();
            bisection.refine(&all)?;
        }
        Ok(refinement.then(bisection.refinement()?))
    }
}

/// Two analyses with one cache; `None` where a signal comes first.
pub(super) fn both<S>(
    [first, second]: [S; 2],
    interrupted: &dyn Fn() -> bool,
    mut analyse: impl FnMut(S, &mut SolverCache) -> Result<Analysis, Error>,
) -> Result<Option<[Analysis; 2]>, Error> {
    let cache = &mut SolverCache::default();
    if interrupted() {
        return Ok(None);
    }
    let first = analyse(first, cache)?;
    if interrupted() {
        return Ok(None);
    }
    Ok(Some([first, analyse(second, cache)?]))
}

/// A configuration without what moves, and without constraints on that.
fn field_alone(config: &Config) -> Config {
    let mut alone = Config { design: None, remesh: None, morph: None, ..config.clone() };
    alone.constraints.retain(is_of_field);
    alone
}

/// Whether a constraint is on the field, and not on the shape alone.
pub(super) fn is_of_field(constraint: &Constraint) -> bool {
    constraint.limit.functional().is_some_and(|own| own.kind.is_of_field())
}

/// Relative residual of a field whose objective is looked at once: its digits are far below the errors that a check is about, and
/// no differences are taken of it.
const TOLERANCE: f64 = 1e-7;

/// A configuration of a problem whose fields are solved to what a check needs.
pub(super) fn looked_at_once(mut config: Config) -> Config {
    let tolerance = &mut config.analysis.linear_solver.tolerance;
    *tolerance = tolerance.max(TOLERANCE);
    config
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fluxmorph_geometry::tet4::volume;

    use super::*;
    use crate::build::{Mode, set_up};

    /// The coarse shield as shipped, and with its plate replaced by an impedance surface, whose nodes inside are not solved on.
    fn devices() -> Vec<(Config, SourceMap)> {
        [("shield_quick", vec![]), ("shield_impedance", vec!["mesh.shield.refinement=0.5".to_owned()])]
            .map(|(name, overrides): (&str, Vec<String>)| {
                let path =
                    Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(name).with_extension("toml");
                Config::from_file(&path, &overrides).expect("a shipped configuration")
            })
            .into()
    }

    #[test]
    fn a_shape_has_its_value_on_its_own_elements_and_its_bodies_on_finer_ones() {
        for (config, source) in devices() {
            let setup = set_up(&config, &source, Mode::Optimisation).expect("a sound problem");
            let shape = setup.problem.shape().expect("a shape");
            let design: Vec<f64> = (0..shape.surface().variable_count()).map(|k| 1e-5 * k as f64).collect();
            let analysis = setup
                .problem
                .evaluate(&design, Derivatives::None, &mut SolverCache::default(), &mut NoProgress)
                .expect("a sound mesh");
            let finer =
                |cut| FinerProblem::new(&config, &source, &setup.full_mesh, cut).expect("a sound problem");
            let cache = &mut SolverCache::default();
            let same = finer(Cut::Halvings(0)).analyse(&analysis.mesh, cache).expect("a sound mesh");
            let [found, expected] = [&same, &analysis].map(|a| a.objective.expect("an objective"));
            // The residual that every linear solution has to reach.
            assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
            let halved = finer(Cut::Growth(1.5)).moved(&analysis.mesh).expect("a sound mesh").mesh;
            let (topology, coarse) = (halved.topology(), analysis.mesh.topology());
            assert!(topology.tets().len() >= coarse.tets().len() * 3 / 2);
            for name in coarse.region_names() {
                let of = |mesh: &Mesh| -> f64 {
                    let topology = mesh.topology();
                    let elements = topology.elements_of(topology.region(name).expect("inherited"));
                    elements.into_iter().map(|e| volume(mesh.vertices(e))).sum()
                };
                let (found, expected) = (of(&halved), of(&analysis.mesh));
                // Sums of 1e5 terms of one sign.
                assert!((found - expected).abs() <= 1e-11 * expected, "{name}: {found} {expected}");
            }
        }
    }
}
