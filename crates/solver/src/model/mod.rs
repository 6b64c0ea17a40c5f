//! The field problem on a topology: what does not change while the mesh moves.
//!
//! Lives here: what a model has at one frequency (weak form) and at all (spaces with their unknowns and patterns, sources,
//! analysis of the linear solver). Does not live here: what it is made from ([`crate::setup`]) and how (`construction`), its solution (`solve`), assembly
//! (`discretisation`), element formulas ([`crate::element`]), the linear solver ([`crate::linear`]), what is done with a
//! solution ([`crate::solution`], [`crate::functional`]).

mod construction;

use std::sync::Arc;

use fluxmorph_geometry::fem::{CsrMatrix, c64};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::bh::BhCurve;
use crate::circuit::{Equations, SolidRows, Solids, Windings};
use crate::coil::Coil;
use crate::discretisation::Discretisation;
use crate::distributed::Distributed;
use crate::element::volume::Coefficients;
use crate::error::SolverError;
use crate::linear::{FieldSystem, LinearSolverCache, LocalSystem, PreparedSystem, SystemAnalysis};
use crate::load::Sources;
use crate::material::Material;
use crate::open::Shell;
use crate::recovery::Walls;
use crate::setup::FieldModelSetup;
use crate::space::Space;
use crate::surface::{Conductor, SurfaceTerm};
use crate::tangents::Tangents;
use crate::unknowns::Unknowns;
use crate::weak_form::WeakForm;

/// A field problem, ready to be solved on any mesh with its topology.
///
/// Currents, prescribed fields and the shell of open space are those of the mesh of the set-up: their elements must not move.
/// [`FieldModel::torn_source`] finds one that would.
///
/// A clone shares what is large.
#[derive(Clone, Debug)]
pub struct FieldModel {
    setup: Arc<FieldModelSetup>,
    angular_frequency: f64,
    weak_form: Arc<WeakForm>,
    shared: Arc<SharedParts>,
    sources: Arc<Sources>,
    windings: Arc<Windings>,
    /// Where the problem is distributed over ranks.
    distributed: Option<Arc<Distributed>>,
}

/// What all frequencies above zero have in common, and all load cases.
#[derive(Debug)]
struct SharedParts {
    fine: Discretisation,
    solids: Solids,
    walls: Walls,
    /// Of one process.
    analysis: Option<Arc<SystemAnalysis>>,
}

/// A matrix as assembled, wherever it is, with what solid conductors add to it.
#[derive(Debug)]
pub struct AssembledMatrix {
    field: FieldMatrix,
    solids: SolidRows,
}

#[derive(Debug)]
enum FieldMatrix {
    /// In this process.
    Local(CsrMatrix<c64>),
    /// To be assembled by the ranks, with nodes at these places [m].
    OnRanks(Vec<Point>),
}

/// That of a model without solid conductors.
impl From<CsrMatrix<c64>> for AssembledMatrix {
    fn from(matrix: CsrMatrix<c64>) -> Self {
        Self { field: FieldMatrix::Local(matrix), solids: SolidRows::default() }
    }
}

impl From<(CsrMatrix<c64>, SolidRows)> for AssembledMatrix {
    fn from((matrix, solids): (CsrMatrix<c64>, SolidRows)) -> Self {
        Self { field: FieldMatrix::Local(matrix), solids }
    }
}

impl FieldModel {
    pub(crate) fn has_reentrant_walls(&self) -> bool {
        self.weak_form.has_reentrant_walls()
    }

    /// Assembles the matrix on a mesh with this model's topology: the rows of this rank, where there are several. Of B–H
    /// laws it has the linear parts.
    pub fn assemble(&self, mesh: &Mesh) -> CsrMatrix<c64> {
        self.shared.fine.assemble(&self.weak_form, mesh)
    }

    /// The matrix with the tangents of B–H laws, from the one with their linear parts.
    pub(crate) fn with_tangents(
        &self,
        linear: &CsrMatrix<c64>,
        tangents: &Tangents,
        mesh: &Mesh,
    ) -> CsrMatrix<c64> {
        let mut matrix = linear.clone();
        self.shared.fine.add_tangents(tangents, mesh, &mut matrix);
        matrix
    }

    /// The matrix on a mesh with this model's topology, wherever it is to be.
    pub fn assembled(&self, mesh: &Mesh) -> AssembledMatrix {
        let field = match &self.distributed {
            None => FieldMatrix::Local(self.assemble(mesh)),
            Some(_) => FieldMatrix::OnRanks(mesh.points().to_vec()),
        };
        AssembledMatrix { field, solids: self.solid_rows(mesh) }
    }

    /// What solid conductors add to the matrix on a mesh.
    pub(crate) fn solid_rows(&self, mesh: &Mesh) -> SolidRows {
        self.shared.fine.solid_rows(self.solids(), &self.weak_form, mesh)
    }

    /// The load of all sources and of the prescribed part of `A` [A m], one entry per unknown, then the net current [A] of each
    /// segment of a solid conductor, zero where a voltage drives it.
    pub fn load(&self, mesh: &Mesh) -> Vec<c64> {
        let fine = &self.shared.fine;
        let mut load = vec![c64::default(); fine.unknowns.dofs.count()];
        self.sources.add_load(&fine.space, &fine.unknowns, mesh, &mut load);
        fine.lift(&self.weak_form, mesh, &mut load);
        load.extend(self.windings.solid_currents(self.coils()));
        load
    }

    /// Prepares what the linear solver needs for a mesh; shared by the state and its adjoint.
    ///
    /// # Errors
    /// As [`FieldModel::prepare_with`].
    pub fn prepare(&self, matrix: impl Into<AssembledMatrix>) -> Result<PreparedSystem, SolverError> {
        self.prepare_with(matrix, &mut LinearSolverCache::default())
    }

    /// As [`FieldModel::prepare`], with what is cached of an earlier mesh or of another frequency.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] when the factorisation fails: the system is singular; [`SolverError::Rank`] where a rank does.
    ///
    /// # Panics
    /// For a matrix that is not where the model is, or without the rows of its solid conductors.
    pub fn prepare_with(
        &self,
        matrix: impl Into<AssembledMatrix>,
        cache: &mut LinearSolverCache,
    ) -> Result<PreparedSystem, SolverError> {
        let AssembledMatrix { field, solids } = matrix.into();
        assert_eq!(solids.count(), self.solids().count(), "the rows of all solid conductors");
        let field = match (field, &self.distributed, &self.shared.analysis) {
            (FieldMatrix::Local(matrix), _, Some(analysis)) => {
                let system = LocalSystem::new(analysis, matrix, cache)?;
                FieldSystem::Local(Box::new(system))
            }
            (FieldMatrix::OnRanks(points), Some(distributed), _) => {
                let system = distributed.prepare(&points, &self.setup.linear_solver)?;
                FieldSystem::Distributed(system)
            }
            _ => panic!("a matrix belongs where its model is"),
        };
        PreparedSystem::new(field, (Equations::new(self.windings(), solids, self.angular_frequency), None))
    }

    /// What defines the problem.
    pub fn setup(&self) -> &FieldModelSetup {
        &self.setup
    }

    /// Number of unknowns of the field, without the voltages of solid conductors.
    pub fn unknown_count(&self) -> usize {
        self.unknowns().dofs.count()
    }

    /// Equation numbers, fixed values and grounded nodes.
    pub fn unknowns(&self) -> &Unknowns {
        &self.shared.fine.unknowns
    }

    /// What carries the unknowns.
    pub fn space(&self) -> &Space {
        &self.shared.fine.space
    }

    /// The topology the model was set up on.
    pub fn topology(&self) -> &Arc<Topology> {
        self.weak_form.topology()
    }

    /// `ω` [rad/s].
    pub fn angular_frequency(&self) -> f64 {
        self.angular_frequency
    }

    /// Material of every region.
    pub fn materials(&self) -> &[Material] {
        &self.setup.materials
    }

    /// `B_r` [T] of the region of an element.
    pub fn remanence_of(&self, e: ElementId) -> Point {
        let region = self.topology().region_of()[e.index()];
        self.setup.remanence.get(region.index()).copied().unwrap_or_default()
    }

    /// The B–H law of the region of an element; `None` where it is linear.
    #[inline]
    pub fn curve_of(&self, e: ElementId) -> Option<&BhCurve> {
        self.weak_form.curve_of(e)
    }

    /// Elements with a B–H law, ascending.
    pub fn elements_with_a_law(&self) -> &[ElementId] {
        self.weak_form.elements_with_a_law()
    }

    /// Whether no element has a B–H law.
    pub fn is_linear(&self) -> bool {
        self.elements_with_a_law().is_empty()
    }

    /// Conductors replaced by their surfaces.
    pub fn conductors(&self) -> &[Conductor] {
        &self.setup.conductors
    }

    /// The coils.
    pub fn coils(&self) -> &[Coil] {
        &self.setup.coils
    }

    /// Elements of the shell that stands for open space, ascending: these must not move.
    pub fn open_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.weak_form.shell().into_iter().flat_map(Shell::elements)
    }

    /// Whether an element carries eddy currents, so that it has ψ.
    pub fn has_eddy_currents(&self, e: ElementId) -> bool {
        self.weak_form.conducts(e)
    }

    /// Whether an element is of the shell that stands for open space.
    pub(crate) fn is_open(&self, e: ElementId) -> bool {
        self.weak_form.stretch_of(e).is_some()
    }

    /// The first coil whose region an element is in, whatever its current.
    pub(crate) fn coil_at(&self, element: ElementId) -> Option<usize> {
        self.coils().iter().position(|coil| coil.shape.flows_in(element))
    }

    /// An element with a node that `moves` although a coil does not allow it: a winding is fixed in space, and in its window all
    /// that moves around a node must be inside, up to the ends of the coil.
    pub fn torn_source(&self, moves: impl Fn(NodeId) -> bool) -> Option<ElementId> {
        self.all_sources().find_map(|sources| sources.torn_element(self.topology(), &moves))
    }

    fn all_sources(&self) -> impl Iterator<Item = &Sources> {
        std::iter::once(&*self.sources).chain(self.windings().sources())
    }

    /// Whether nothing excites a field: no coil, magnet or applied field.
    pub fn is_unexcited(&self) -> bool {
        self.sources.is_empty()
            && !self.windings().is_driven(self.coils())
            && self.unknowns().prescribed_carriers().next().is_none()
    }

    pub(crate) fn windings(&self) -> &Arc<Windings> {
        &self.windings
    }

    pub(crate) fn solids(&self) -> &Solids {
        &self.shared.solids
    }

    /// How the linear systems of one process are solved, and what that takes; `None` where they are on several ranks.
    pub fn linear_solver(&self) -> Option<&SystemAnalysis> {
        self.shared.analysis.as_deref()
    }

    /// What the linear systems are solved with, in a word or two.
    pub fn method_name(&self) -> String {
        match (&self.shared.analysis, &self.setup.ownership) {
            (Some(analysis), _) => analysis.method().name().to_owned(),
            (None, Some((_, settings))) => settings.method_for(self.unknown_count()).name().to_owned(),
            (None, None) => String::new(),
        }
    }

    /// The same without the ranks over which it is distributed: for what needs no matrix.
    pub fn of_one_process(&self) -> Self {
        Self { distributed: None, ..self.clone() }
    }

    pub(crate) fn distributed(&self) -> Option<&Distributed> {
        self.distributed.as_deref()
    }

    pub(crate) fn discretisation(&self) -> &Discretisation {
        &self.shared.fine
    }

    /// `ν`, `(p − 1)ν` and `jωσ` of an element.
    #[inline]
    pub fn coefficients_of(&self, e: ElementId) -> &Coefficients {
        self.weak_form.coefficients_of(e)
    }

    pub(crate) fn form(&self) -> &Arc<WeakForm> {
        &self.weak_form
    }

    pub(crate) fn surface(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.weak_form.surface()
    }

    pub(crate) fn walls(&self) -> &Walls {
        &self.shared.walls
    }

    pub(crate) fn sources(&self) -> &Sources {
        &self.sources
    }
}
