//! The field problem on a topology: what does not change while the mesh moves.
//!
//! Lives here: the choice of coefficients from materials, of surface terms from interfaces, equation numbers, pattern
//! and assembly of matrix and load. Does not live here: element formulas ([`crate::element`]), what is done with a
//! solution ([`crate::solution`], [`crate::functional`]).

use std::sync::Arc;

use fluxmorph_geometry::fem::{
    BlockPattern, BoundGroup, Coupling, CsrMatrix, ElementGroup, LocalMatrix, c64,
};
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::boundary::Boundary;
use crate::coil::{Coil, Condition, ConditionedSurface, planes};
use crate::element::lagrange::Lagrange;
use crate::element::quadratic::LagrangeTet;
use crate::element::volume::{AphiTet, Coefficients};
use crate::element::{impedance::ImpedanceTriangle, interface::InterfaceTriangle};
use crate::error::SolverError;
use crate::framed::Framed;
use crate::linear::{LinearSolverSettings, PreparedSystem, SystemAnalysis};
use crate::load::Sources;
use crate::material::Material;
use crate::solution::FieldSolution;
use crate::space::{Order, Space};
use crate::surface::{Conductor, SurfaceMatrix, SurfaceTerm, Surfaces};
use crate::unknowns::{PSI, Unknowns};

/// Everything that defines a field problem beside the mesh.
#[derive(Clone, Debug)]
pub struct FieldModelSetup {
    /// Frequency [Hz]; zero for magnetostatics.
    pub frequency: f64,
    /// Penalty factor `p = ν_p/ν` [1]. Default 1: the components of `A` then decouple inside a material.
    pub penalty: f64,
    /// Polynomial order of the potentials. Default linear.
    pub order: Order,
    /// Material of every region, by `RegionId`.
    pub materials: Vec<Material>,
    /// `B_r` [T] of every region, by `RegionId`; shorter where the rest has none. Statics only.
    pub remanence: Vec<Point>,
    /// Conductors replaced by impedance surfaces.
    pub impedance_surfaces: Vec<Conductor>,
    /// Coils.
    pub coils: Vec<Coil>,
    /// Conditions on named surfaces; outer faces without one are natural.
    pub boundaries: Vec<(String, Boundary)>,
    /// Linear solver.
    pub linear_solver: LinearSolverSettings,
}

impl Default for FieldModelSetup {
    /// A static problem without anything in it.
    fn default() -> Self {
        Self {
            frequency: 0.0,
            penalty: 1.0,
            order: Order::default(),
            materials: Vec::new(),
            remanence: Vec::new(),
            impedance_surfaces: Vec::new(),
            coils: Vec::new(),
            boundaries: Vec::new(),
            linear_solver: LinearSolverSettings::default(),
        }
    }
}

/// A field problem, ready to be solved on any mesh with its topology.
#[derive(Debug)]
pub struct FieldModel {
    topology: Arc<Topology>,
    space: Space,
    angular_frequency: f64,
    coefficients: Vec<Coefficients>,
    materials: Vec<Material>,
    remanence: Vec<Point>,
    conductors: Vec<Conductor>,
    coils: Vec<Coil>,
    unknowns: Unknowns,
    pattern: BlockPattern<4>,
    groups: Groups,
    surfaces: Surfaces,
    sources: Sources,
    /// Elements and surface triangles with a node whose `A` is prescribed.
    lifted: (Vec<ElementId>, Vec<usize>),
    analysis: SystemAnalysis,
}

/// Elements and surface triangles bound to the pattern, by order.
#[derive(Debug)]
enum Groups {
    Linear { tets: BoundGroup<4>, triangles: BoundGroup<3> },
    Quadratic { tets: BoundGroup<10>, triangles: BoundGroup<6> },
}

impl FieldModel {
    /// Sets up the problem on a reference mesh: equation numbers, pattern, symbolic factor, coil integrals.
    ///
    /// # Errors
    /// [`SolverError`] names what is missing or out of range.
    pub fn new(mesh: &Mesh, setup: FieldModelSetup) -> Result<Self, SolverError> {
        check(mesh, &setup)?;
        let topology = Arc::clone(mesh.topology());
        let space = Space::new(&topology, setup.order);
        let angular_frequency = 2.0 * std::f64::consts::PI * setup.frequency;
        let coefficients: Vec<Coefficients> = setup
            .materials
            .iter()
            .map(|m| Coefficients {
                reluctivity: m.reluctivity(),
                extra_penalty: (setup.penalty - 1.0) * m.reluctivity(),
                eddy: c64::new(0.0, angular_frequency * m.conductivity),
            })
            .collect();
        let conducting =
            |e: ElementId| coefficients[topology.region_of()[e.index()].index()].eddy != c64::default();
        let conductor_elements: Vec<ElementId> = topology.elements().filter(|&e| conducting(e)).collect();
        let unknowns = Unknowns::new(mesh, &space, &conductor_elements, &setup.boundaries)?;

        let turned = |nodes: &[NodeId]| nodes.iter().any(|&n| unknowns.frame(n).is_some());
        let couplings = topology
            .elements()
            .map(|e| {
                let decoupled = setup.penalty == 1.0 && !turned(space.nodes_of(e));
                let potential = if decoupled { Coupling::diagonal(3) } else { Coupling::full(3) };
                if conducting(e) { potential.union(with_psi()) } else { potential }
            })
            .collect();
        let surfaces = Surfaces::new(
            mesh,
            &coefficients,
            &setup.boundaries,
            &setup.impedance_surfaces,
            angular_frequency,
        )?;
        let (pattern, groups) = pattern(&space, &unknowns, couplings, &surfaces);
        let analysis = SystemAnalysis::new(pattern.structure(), setup.linear_solver)?;
        let magnetisation: Vec<Point> =
            setup.remanence.iter().zip(&coefficients).map(|(b, c)| b.map(|b| c.reluctivity * b)).collect();
        let sources = Sources::new(mesh, &setup.coils, &magnetisation)?;
        check_sources(mesh, &setup)?;
        let lifted = lifted(&topology, &space, &unknowns, &surfaces);
        Ok(Self {
            topology,
            space,
            angular_frequency,
            coefficients,
            materials: setup.materials,
            remanence: setup.remanence,
            conductors: setup.impedance_surfaces,
            coils: setup.coils,
            unknowns,
            pattern,
            groups,
            surfaces,
            sources,
            lifted,
            analysis,
        })
    }

    /// Assembles the matrix on a mesh with this model's topology.
    pub fn assemble(&self, mesh: &Mesh) -> CsrMatrix<c64> {
        let mut matrix = CsrMatrix::zeros(self.pattern.structure());
        let values = &mut matrix.values;
        match &self.groups {
            Groups::Linear { tets, triangles } => {
                self.add_group(tets, values, |e| self.linear_tet(mesh, e));
                self.add_group(triangles, values, |t| {
                    self.surface_matrix(Lagrange::<3, 3>::triangle(), mesh, t.index())
                });
            }
            Groups::Quadratic { tets, triangles } => {
                self.add_group(tets, values, |e| self.quadratic_tet(mesh, e));
                self.add_group(triangles, values, |t| {
                    self.surface_matrix(Lagrange::<6, 3>::triangle(), mesh, t.index())
                });
            }
        }
        matrix
    }

    /// Assembles one group, turned into the frames of the nodes where some have their own.
    fn add_group<const N: usize, L: LocalMatrix<c64, N, 4>>(
        &self,
        group: &BoundGroup<N>,
        values: &mut [c64],
        matrix: impl Fn(ElementId) -> L + Sync,
    ) {
        if self.unknowns.has_frames() {
            self.pattern.assemble(group, values, |e| {
                Framed::new(matrix(e), group.nodes_of(e).map(|n| self.unknowns.frame(n)))
            });
        } else {
            self.pattern.assemble(group, values, matrix);
        }
    }

    fn linear_tet(&self, mesh: &Mesh, e: ElementId) -> AphiTet {
        AphiTet::new(Tet4::new(mesh.vertices(e)), *self.coefficients_of(e))
    }

    fn quadratic_tet(&self, mesh: &Mesh, e: ElementId) -> LagrangeTet<10> {
        let tet = Tet4::new(mesh.vertices(e));
        LagrangeTet::new(Lagrange::<10, 4>::tet(), tet, *self.coefficients_of(e))
    }

    fn surface_matrix<const N: usize>(
        &self,
        shape: &'static Lagrange<N, 3>,
        mesh: &Mesh,
        triangle: usize,
    ) -> SurfaceMatrix<N> {
        let vertices = self.surfaces.triangles[triangle].map(|n| mesh.point(n));
        match self.surfaces.terms[triangle] {
            SurfaceTerm::Interface(jump) => {
                SurfaceMatrix::Interface(InterfaceTriangle::new(shape, vertices, jump))
            }
            SurfaceTerm::Impedance(coefficient, _) => {
                SurfaceMatrix::Impedance(ImpedanceTriangle::new(shape, vertices, coefficient))
            }
        }
    }

    /// The load of all sources and of the prescribed part of `A` [A m], one entry per unknown.
    pub fn load(&self, mesh: &Mesh) -> Vec<c64> {
        let mut load = vec![c64::default(); self.unknowns.dofs.count()];
        self.sources.add_load(&self.space, &self.unknowns, mesh, &mut load);
        let (elements, triangles) = &self.lifted;
        match &self.groups {
            Groups::Linear { triangles: bound, .. } => {
                for &e in elements {
                    self.subtract_lift(self.space.nodes_of(e), &self.linear_tet(mesh, e), &mut load);
                }
                for &t in triangles {
                    let matrix = self.surface_matrix(Lagrange::<3, 3>::triangle(), mesh, t);
                    self.subtract_lift(&bound.nodes_of(ElementId::new(t)), &matrix, &mut load);
                }
            }
            Groups::Quadratic { triangles: bound, .. } => {
                for &e in elements {
                    self.subtract_lift(self.space.nodes_of(e), &self.quadratic_tet(mesh, e), &mut load);
                }
                for &t in triangles {
                    let matrix = self.surface_matrix(Lagrange::<6, 3>::triangle(), mesh, t);
                    self.subtract_lift(&bound.nodes_of(ElementId::new(t)), &matrix, &mut load);
                }
            }
        }
        load
    }

    /// `f −= K A_prescribed` for one element.
    fn subtract_lift<const N: usize>(
        &self,
        nodes: &[NodeId],
        matrix: &impl LocalMatrix<c64, N, 4>,
        load: &mut [c64],
    ) {
        for (b, &from) in nodes.iter().enumerate() {
            let Some(potential) = self.unknowns.prescribed_at(from) else { continue };
            for (a, &to) in nodes.iter().enumerate() {
                let block = matrix.block(a, b);
                let row = |i: usize| -> c64 { (0..3).map(|j| -block[i][j] * potential[j]).sum() };
                self.unknowns.scatter_add(load, to, [row(0), row(1), row(2), row(PSI)]);
            }
        }
    }

    /// Factors what the linear solver needs for a mesh; shared by the state and its adjoint.
    ///
    /// # Errors
    /// As [`PreparedSystem::new`].
    pub fn prepare(&self, matrix: CsrMatrix<c64>) -> Result<PreparedSystem, SolverError> {
        PreparedSystem::new(&self.analysis, matrix)
    }

    /// Solves the state problem on a mesh; also returns the prepared system for the adjoint.
    ///
    /// # Errors
    /// [`SolverError`] when the factorisation or the iteration fails.
    pub fn solve(&self, mesh: &Mesh) -> Result<(FieldSolution, PreparedSystem), SolverError> {
        let system = self.prepare(self.assemble(mesh))?;
        let state = self.solve_prepared(&system, &self.load(mesh))?;
        Ok((state, system))
    }

    /// Solves the state problem with a prepared system and a load.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub fn solve_prepared(
        &self,
        system: &PreparedSystem,
        load: &[c64],
    ) -> Result<FieldSolution, SolverError> {
        let (values, report) = system.solve(load)?;
        Ok(FieldSolution::state(values, report))
    }

    /// Number of unknowns.
    pub fn unknown_count(&self) -> usize {
        self.unknowns.dofs.count()
    }

    /// Equation numbers, fixed values and grounded nodes.
    pub fn unknowns(&self) -> &Unknowns {
        &self.unknowns
    }

    /// The nodes that carry the unknowns.
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// The topology the model was set up on.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// `ω` [rad/s].
    pub fn angular_frequency(&self) -> f64 {
        self.angular_frequency
    }

    /// Material of every region.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// `B_r` [T] of the region of an element.
    pub fn remanence_of(&self, e: ElementId) -> Point {
        let region = self.topology.region_of()[e.index()];
        self.remanence.get(region.index()).copied().unwrap_or_default()
    }

    /// Conductors replaced by impedance surfaces.
    pub fn conductors(&self) -> &[Conductor] {
        &self.conductors
    }

    /// The coils.
    pub fn coils(&self) -> &[Coil] {
        &self.coils
    }

    /// Elements that a coil meets: these must not move.
    pub fn source_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.sources.fixed_elements()
    }

    /// Whether nothing excites a field: no coil, magnet or applied field.
    pub fn is_unexcited(&self) -> bool {
        self.sources.is_empty() && self.unknowns.prescribed_nodes().next().is_none()
    }

    /// Bytes of the matrix and the factor that one solution needs.
    pub fn memory_estimate(&self) -> usize {
        let entries = self.pattern.structure().columns.len();
        entries * (size_of::<c64>() + size_of::<f64>() + size_of::<u32>()) + self.analysis.factor_bytes()
    }

    /// `ν`, `(p − 1)ν` and `jωσ` of an element.
    pub fn coefficients_of(&self, e: ElementId) -> &Coefficients {
        &self.coefficients[self.topology.region_of()[e.index()].index()]
    }

    pub(crate) fn surface(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.surfaces.iter()
    }

    pub(crate) fn sources(&self) -> &Sources {
        &self.sources
    }
}

/// The pattern of the system, and its elements and triangles bound to it.
fn pattern(
    space: &Space,
    unknowns: &Unknowns,
    couplings: Vec<Coupling>,
    surfaces: &Surfaces,
) -> (BlockPattern<4>, Groups) {
    let surface_couplings = vec![Coupling::full(3); surfaces.triangles.len()];
    let count = space.node_count();
    match (space.linear_tets(), space.quadratic_tets()) {
        (Some(tets), _) => {
            let volumes = ElementGroup::new(count, tets.to_vec(), couplings);
            let faces = ElementGroup::new(count, surfaces.triangles.clone(), surface_couplings);
            let pattern = BlockPattern::symmetric(&unknowns.dofs, &volumes, &faces);
            let groups = Groups::Linear { tets: pattern.bind(&volumes), triangles: pattern.bind(&faces) };
            (pattern, groups)
        }
        (None, tets) => {
            let volumes = ElementGroup::new(count, tets.unwrap_or_default().to_vec(), couplings);
            let triangles = surfaces.triangles.iter().map(|&t| space.quadratic_triangle(t)).collect();
            let faces = ElementGroup::new(count, triangles, surface_couplings);
            let pattern = BlockPattern::symmetric(&unknowns.dofs, &volumes, &faces);
            let groups = Groups::Quadratic { tets: pattern.bind(&volumes), triangles: pattern.bind(&faces) };
            (pattern, groups)
        }
    }
}

/// Elements and surface triangles with a node whose `A` is prescribed, ascending.
fn lifted(
    topology: &Topology,
    space: &Space,
    unknowns: &Unknowns,
    surfaces: &Surfaces,
) -> (Vec<ElementId>, Vec<usize>) {
    let mut prescribed = vec![false; space.node_count()];
    for n in unknowns.prescribed_nodes() {
        prescribed[n.index()] = true;
    }
    let touches = |nodes: &[NodeId]| nodes.iter().any(|n| prescribed[n.index()]);
    let elements = topology.elements().filter(|&e| touches(space.nodes_of(e))).collect();
    let triangles =
        (0..surfaces.triangles.len()).filter(|&t| touches(&space.triangle(surfaces.triangles[t]))).collect();
    (elements, triangles)
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

/// ψ with itself and with every component of `A`.
fn with_psi() -> Coupling {
    (0..4).fold(Coupling::NONE, |set, i| set.with(i, PSI).with(PSI, i))
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
    for conductor in &setup.impedance_surfaces {
        if conductor.surface.is_empty() {
            return Err(SolverError::EmptyRegion {
                region: conductor.name.clone(),
                expected: "an impedance surface needs faces",
            });
        }
    }
    Ok(())
}
