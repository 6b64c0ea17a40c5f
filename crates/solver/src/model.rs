//! The field problem on a topology: what does not change while the mesh moves.
//!
//! Lives here: the set-up and its checks, and what a model has at one frequency (weak form) and at all (spaces with
//! their unknowns and patterns, sources, analysis of the linear solver). Does not live here: assembly (`discretisation`),
//! element formulas ([`crate::element`]), the linear solver ([`crate::linear`]), what is done with a solution
//! ([`crate::solution`], [`crate::functional`]).

use std::sync::Arc;

use fluxmorph_geometry::fem::{CsrMatrix, c64};
use fluxmorph_geometry::parallel::Ownership;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::amplitude;
use crate::bh::BhCurve;
use crate::boundary::{self, Boundary};
use crate::circuit::{self, Border, Excitation, Winding, Windings};
use crate::coil::{Coil, Condition, ConditionedSurface, continuity, planes};
use crate::discretisation::Discretisation;
use crate::distributed::Distributed;
use crate::element::volume::Coefficients;
use crate::error::SolverError;
use crate::linear::{
    DistributedSettings, FieldKind, FieldSystem, LinearSolverCache, LinearSolverSettings, LocalSystem,
    PreparedSystem, SystemAnalysis, SystemPattern,
};
use crate::load::Sources;
use crate::material::Material;
use crate::newton::{self, NewtonObserver};
use crate::nonlinear::Tangents;
use crate::open::{self, OpenRegion, Shell};
use crate::solution::FieldSolution;
use crate::space::{ElementFamily, Order, Space};
use crate::surface::{Conductor, SurfaceTerm};
use crate::unknowns::Unknowns;
use crate::weak_form::WeakForm;

/// Everything that defines a field problem beside the mesh.
#[derive(Clone, Debug)]
pub struct FieldModelSetup {
    /// Frequency [Hz]; zero for magnetostatics.
    pub frequency: f64,
    /// Penalty factor `p = ν_p/ν` [1]. Default 1: the components of `A` then decouple inside a material.
    pub penalty: f64,
    /// What is continuous between elements. Default edge.
    pub family: ElementFamily,
    /// Polynomial order of the potentials. Default linear.
    pub order: Order,
    /// Material of every region, by `RegionId`.
    pub materials: Vec<Material>,
    /// `B_r` [T] of every region, by `RegionId`; shorter where the rest has none. Statics only.
    pub remanence: Vec<Point>,
    /// B–H law of every region, by `RegionId`; shorter where the rest is linear. Above 0 Hz it is that of the amplitude. The
    /// permeability of the region's material is then that of the penalty of nodal elements.
    pub bh: Vec<Option<Arc<BhCurve>>>,
    /// Conductors replaced by their surfaces.
    pub conductors: Vec<Conductor>,
    /// Coils.
    pub coils: Vec<Coil>,
    /// Windings of the coils, by their place in `coils`; shorter where the rest has none.
    pub windings: Vec<Option<Winding>>,
    /// Conditions on named surfaces; outer faces without one are natural.
    pub boundaries: Vec<(String, Boundary)>,
    /// The region that stands for open space, if one does.
    pub open: Option<OpenRegion>,
    /// Linear solver.
    pub linear_solver: LinearSolverSettings,
    /// The ranks over which the problem is distributed, and how they solve; `None` for one process.
    pub ownership: Option<(Ownership, DistributedSettings)>,
}

impl Default for FieldModelSetup {
    /// A static problem without anything in it.
    fn default() -> Self {
        Self {
            frequency: 0.0,
            penalty: 1.0,
            family: ElementFamily::default(),
            order: Order::default(),
            materials: Vec::new(),
            remanence: Vec::new(),
            bh: Vec::new(),
            conductors: Vec::new(),
            coils: Vec::new(),
            windings: Vec::new(),
            boundaries: Vec::new(),
            open: None,
            linear_solver: LinearSolverSettings::default(),
            ownership: None,
        }
    }
}

/// A field problem, ready to be solved on any mesh with its topology.
///
/// A clone shares what is large.
#[derive(Clone, Debug)]
pub struct FieldModel {
    setup: Arc<FieldModelSetup>,
    angular_frequency: f64,
    weak_form: Arc<WeakForm>,
    shared: Arc<SharedParts>,
    /// Where the problem is distributed over ranks.
    distributed: Option<Arc<Distributed>>,
}

/// What all frequencies above zero have in common.
#[derive(Debug)]
struct SharedParts {
    fine: Discretisation,
    sources: Sources,
    windings: Arc<Windings>,
    /// Of one process.
    analysis: Option<Arc<SystemAnalysis>>,
}

/// A matrix as assembled, wherever it is.
#[derive(Debug)]
pub enum AssembledMatrix {
    /// In this process.
    Local(CsrMatrix<c64>),
    /// To be assembled by the ranks, with nodes at these places [m].
    OnRanks(Vec<Point>),
}

impl From<CsrMatrix<c64>> for AssembledMatrix {
    fn from(matrix: CsrMatrix<c64>) -> Self {
        Self::Local(matrix)
    }
}

impl FieldModel {
    /// Sets up the problem on a reference mesh: equation numbers, pattern, symbolic factor, coil integrals.
    ///
    /// # Errors
    /// [`SolverError`] names what is missing or out of range.
    pub fn new(mesh: &Mesh, setup: FieldModelSetup) -> Result<Self, SolverError> {
        let (angular_frequency, weak_form) = Self::weak_form(mesh, &setup)?;
        let ownership = setup.ownership.as_ref().map(|(ownership, _)| ownership);
        let fine =
            Discretisation::new(mesh, (setup.family, setup.order), &weak_form, &setup.boundaries, ownership)?;
        let field = if angular_frequency == 0.0 { FieldKind::Static } else { FieldKind::Harmonic };
        let pattern = SystemPattern {
            structure: fine.pattern.structure(),
            hosts: fine.hosts(),
            reference: &|| fine.assemble(&weak_form, None, mesh),
            prolongation: &|matrix| fine.prolongation(mesh, &weak_form, &setup.boundaries, matrix),
        };
        let analysis = match ownership {
            None => Some(SystemAnalysis::new(pattern, (field, setup.order), setup.linear_solver)?),
            Some(_) => None,
        };
        let magnetisation: Vec<Point> = setup
            .remanence
            .iter()
            .zip(&setup.materials)
            .map(|(b, m)| b.map(|b| m.reluctivity() * b))
            .collect();
        let given = circuit::given_currents(&setup.coils, &setup.windings, angular_frequency);
        let sources = Sources::new(mesh, &given, &magnetisation)?;
        let windings = Windings::new(mesh, &setup.coils, &setup.windings, (&fine.space, &fine.unknowns))?;
        let windings = Arc::new(windings);
        check_sources(mesh, &setup)?;
        let mut joined = weak_form.conductors().joined(mesh, &setup.boundaries)?;
        let curl_free = (&fine.space, fine.unknowns.harmonic_fields());
        continuity::check(mesh, &setup.coils, &mut joined, curl_free)?;
        if let Some(shell) = weak_form.shell() {
            open::check_contents(shell, mesh, &setup, sources.fixed_elements())?;
        }
        let shared = Arc::new(SharedParts { fine, sources, windings, analysis: analysis.map(Arc::new) });
        Ok(Self::whole(setup, (angular_frequency, weak_form), shared))
    }

    /// The model, distributed where it has ranks.
    fn whole(
        setup: FieldModelSetup,
        (angular_frequency, weak_form): (f64, WeakForm),
        shared: Arc<SharedParts>,
    ) -> Self {
        let setup = Arc::new(setup);
        let weak_form = Arc::new(weak_form);
        let mut model = Self { setup, angular_frequency, weak_form, shared, distributed: None };
        if let Some((ownership, settings)) = &model.setup.ownership {
            model.distributed = Some(Arc::new(Distributed::new(&model, ownership, settings)));
        }
        model
    }

    /// The same problem at another frequency [Hz]; between frequencies above zero, equation numbers, pattern, symbolic
    /// factor and coil integrals are shared.
    ///
    /// # Errors
    /// As [`FieldModel::new`].
    pub fn at_frequency(&self, mesh: &Mesh, frequency: f64) -> Result<Self, SolverError> {
        let setup = FieldModelSetup { frequency, ..(*self.setup).clone() };
        if frequency == 0.0 || self.angular_frequency == 0.0 {
            return Self::new(mesh, setup);
        }
        let weak_form = Self::weak_form(mesh, &setup)?;
        Ok(Self::whole(setup, weak_form, Arc::clone(&self.shared)))
    }

    /// Checks a set-up; `ω` [rad/s] and the weak form.
    fn weak_form(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(f64, WeakForm), SolverError> {
        check(mesh, setup)?;
        boundary::check_applied(mesh, &setup.boundaries, &setup.conductors)?;
        let angular_frequency = 2.0 * std::f64::consts::PI * setup.frequency;
        let numbers = (angular_frequency, setup.penalty);
        let form = WeakForm::new(
            mesh,
            (setup.family, setup.order),
            numbers,
            &setup.materials,
            &setup.boundaries,
            &setup.conductors,
            setup.open.as_ref(),
        )?;
        Ok((angular_frequency, form.with_curves(&setup.bh)))
    }

    pub(crate) fn has_reentrant_walls(&self) -> bool {
        self.weak_form.has_reentrant_walls()
    }

    /// Assembles the matrix on a mesh with this model's topology: the rows of this rank, where there are several. Of B–H
    /// laws it has the linear parts.
    pub fn assemble(&self, mesh: &Mesh) -> CsrMatrix<c64> {
        self.shared.fine.assemble(&self.weak_form, None, mesh)
    }

    /// As [`FieldModel::assemble`], with the tangents of B–H laws.
    pub(crate) fn assemble_tangent(&self, mesh: &Mesh, tangents: &Tangents) -> CsrMatrix<c64> {
        self.shared.fine.assemble(&self.weak_form, Some(tangents), mesh)
    }

    /// The matrix on a mesh with this model's topology, wherever it is to be.
    pub fn assembled(&self, mesh: &Mesh) -> AssembledMatrix {
        match &self.distributed {
            None => AssembledMatrix::Local(self.assemble(mesh)),
            Some(_) => AssembledMatrix::OnRanks(mesh.points().to_vec()),
        }
    }

    /// The load of all sources and of the prescribed part of `A` [A m], one entry per unknown.
    pub fn load(&self, mesh: &Mesh) -> Vec<c64> {
        let SharedParts { fine, sources, .. } = &*self.shared;
        let mut load = vec![c64::default(); fine.unknowns.dofs.count()];
        sources.add_load(&fine.space, &fine.unknowns, mesh, &mut load);
        fine.lift(&self.weak_form, mesh, &mut load);
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
    /// For a matrix that is not where the model is.
    pub fn prepare_with(
        &self,
        matrix: impl Into<AssembledMatrix>,
        cache: &mut LinearSolverCache,
    ) -> Result<PreparedSystem, SolverError> {
        let field = match (matrix.into(), &self.distributed, &self.shared.analysis) {
            (AssembledMatrix::Local(matrix), _, Some(analysis)) => {
                let system = LocalSystem::new(analysis, matrix, cache)?;
                FieldSystem::Local(Box::new(system))
            }
            (AssembledMatrix::OnRanks(points), Some(distributed), _) => {
                let system = distributed.prepare(&points, &self.setup.linear_solver)?;
                FieldSystem::Distributed(system)
            }
            _ => panic!("a matrix belongs where its model is"),
        };
        let (windings, angular_frequency) = (self.windings(), self.angular_frequency);
        PreparedSystem::new(field, |solve| Border::new(windings, angular_frequency, solve))
    }

    /// Solves the state problem on a mesh; also returns the prepared system for the adjoint.
    ///
    /// # Errors
    /// [`SolverError`] when the factorisation or the iteration fails.
    pub fn solve(&self, mesh: &Mesh) -> Result<(FieldSolution, PreparedSystem), SolverError> {
        if !self.is_linear() {
            return self.solve_nonlinear(mesh, (&LinearSolverCache::default(), None), &mut |_| {});
        }
        let mut system = self.prepare(self.assembled(mesh))?;
        let state = self.solve_prepared(&mut system, &self.load(mesh))?;
        Ok((state, system))
    }

    /// Solves the state problem of a model with B–H laws; also returns the system with the tangent in that state, for the
    /// adjoint. Of `cache` only the method that worked last takes part; Newton's method begins with `start`, the unknowns of a
    /// similar state, and where there is none with the field of the linear parts.
    ///
    /// # Errors
    /// [`SolverError::Newton`], and those of [`PreparedSystem::solve`].
    ///
    /// # Panics
    /// Where all is linear.
    pub fn solve_nonlinear(
        &self,
        mesh: &Mesh,
        (cache, start): (&LinearSolverCache, Option<&[c64]>),
        observer: &mut NewtonObserver<'_>,
    ) -> Result<(FieldSolution, PreparedSystem), SolverError> {
        assert!(!self.is_linear(), "a model with B–H laws");
        let solve = if self.angular_frequency > 0.0 { amplitude::solve } else { newton::solve };
        match solve(self, mesh, (cache, start), observer) {
            Err(SolverError::Newton { .. }) if start.is_some() => solve(self, mesh, (cache, None), observer),
            solved => solved,
        }
    }

    /// Solves the state problem with a prepared system and a load.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub fn solve_prepared(
        &self,
        system: &mut PreparedSystem,
        load: &[c64],
    ) -> Result<FieldSolution, SolverError> {
        let (values, report, currents) = system.solve_with(load, Excitation::Voltages)?;
        Ok(FieldSolution::state(values, report).with_currents(currents))
    }

    /// Solves for 1 A in a winding by its place, which the state then holds as its response; again only where it does not yet.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve_field`].
    pub fn respond(
        &self,
        system: &mut PreparedSystem,
        winding: usize,
        state: &mut FieldSolution,
    ) -> Result<(), SolverError> {
        if state.response(winding).is_none() {
            let (values, report) = system.solve_field(self.windings().load(winding))?;
            state.respond(winding, FieldSolution::adjoint(values, report));
        }
        Ok(())
    }

    /// What defines the problem.
    pub fn setup(&self) -> &FieldModelSetup {
        &self.setup
    }

    /// Number of unknowns.
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

    /// Elements that a coil meets: these must not move.
    pub fn source_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.shared.sources.fixed_elements().chain(self.windings().fixed_elements())
    }

    /// Whether nothing excites a field: no coil, magnet or applied field.
    pub fn is_unexcited(&self) -> bool {
        self.shared.sources.is_empty()
            && !self.windings().is_driven()
            && self.unknowns().prescribed_carriers().next().is_none()
    }

    pub(crate) fn windings(&self) -> &Arc<Windings> {
        &self.shared.windings
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

    pub(crate) fn form(&self) -> &WeakForm {
        &self.weak_form
    }

    pub(crate) fn surface(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.weak_form.surface()
    }

    pub(crate) fn sources(&self) -> &Sources {
        &self.shared.sources
    }
}

/// Refuses coils that meet the outside of the mesh where their source would be wrong.
fn check_sources(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(), SolverError> {
    let mut surfaces = Vec::new();
    for (name, boundary) in &setup.boundaries {
        let condition = match boundary {
            Boundary::FluxParallel => Condition::FluxParallel,
            Boundary::FluxNormal => Condition::FluxNormal,
            Boundary::UniformField(_) => Condition::Prescribed,
        };
        surfaces.push(ConditionedSurface { name, condition, triangles: mesh.topology().surface(name)? });
    }
    planes::check(mesh, &setup.coils, &surfaces)
}

fn check(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(), SolverError> {
    let refuse = |what: &str, value: f64, expected: &str| {
        Err(SolverError::Parameter {
            what: what.to_owned(),
            value: value.to_string(),
            expected: expected.to_owned(),
        })
    };
    if !(setup.frequency >= 0.0 && setup.frequency.is_finite()) {
        return refuse("frequency", setup.frequency, "a frequency in hertz, zero or more");
    }
    if !(setup.penalty > 0.0 && setup.penalty.is_finite()) {
        return refuse("penalty", setup.penalty, "a positive factor; 1 is right for almost all cases");
    }
    let regions = mesh.topology().region_names().len();
    if setup.materials.len() != regions || setup.remanence.len() > regions {
        let count = setup.materials.len().max(setup.remanence.len()) as f64;
        return refuse("number of materials", count, "one material a region, and at most one remanence");
    }
    for (material, region) in setup.materials.iter().zip(mesh.topology().region_names()) {
        let Material { relative_permeability: mu, conductivity: sigma } = *material;
        if !(mu > 0.0 && mu.is_finite()) {
            return refuse(&format!("relative_permeability of `{region}`"), mu, "a positive number");
        }
        if !(sigma >= 0.0 && sigma.is_finite()) {
            return refuse(&format!("conductivity of `{region}`"), sigma, "zero or more siemens per metre");
        }
    }
    if setup.frequency > 0.0 && setup.remanence.iter().any(|b| *b != [0.0; 3]) {
        return refuse("frequency", setup.frequency, "0 Hz: a permanent magnet makes a static field");
    }
    check_laws(setup)?;
    for conductor in &setup.conductors {
        if conductor.surface.is_empty() {
            return Err(SolverError::EmptyRegion {
                region: conductor.name.clone(),
                expected: "the surface that replaces a conductor needs faces",
            });
        }
    }
    Ok(())
}

/// Refuses B–H laws where they have no meaning.
fn check_laws(setup: &FieldModelSetup) -> Result<(), SolverError> {
    let refuse = |what: &str, value: String, expected: &str| {
        Err(SolverError::Parameter { what: what.to_owned(), value, expected: expected.to_owned() })
    };
    let has_law = |r: usize| setup.bh.get(r).is_some_and(Option::is_some);
    if setup.bh.len() > setup.materials.len() {
        return refuse("number of B–H laws", setup.bh.len().to_string(), "at most one a region");
    }
    if !setup.bh.iter().any(Option::is_some) {
        return Ok(());
    }
    let is_driven = setup.windings.iter().flatten().any(|winding| winding.voltage.is_some());
    if setup.frequency > 0.0 && is_driven {
        return refuse(
            "voltage",
            "of a coil beside a B–H curve".to_owned(),
            "a given current: above 0 Hz a circuit is solved with linear materials",
        );
    }
    if setup.ownership.is_some() {
        return refuse(
            "ranks",
            "several".to_owned(),
            "one process: a B–H curve is solved by Newton's method in one",
        );
    }
    if let Some(r) = (0..setup.remanence.len()).find(|&r| has_law(r) && setup.remanence[r] != [0.0; 3]) {
        let remanence = format!("{:?}", setup.remanence[r]);
        return refuse(
            "remanence",
            remanence,
            "a material with a permeability: a magnet has a straight recoil line",
        );
    }
    Ok(())
}
