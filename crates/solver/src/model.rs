//! The field problem on a topology: what does not change while the mesh moves.
//!
//! Lives here: the choice of coefficients from materials, of surface terms from interfaces, equation numbers, pattern
//! and assembly of matrix and load. Does not live here: element formulas ([`crate::element`]), what is done with a
//! solution ([`crate::solution`], [`crate::objective`]).

use std::collections::HashSet;
use std::sync::Arc;

use fluxmorph_geometry::fem::{
    BlockPattern, BoundGroup, Coupling, CsrMatrix, ElementGroup, LocalMatrix, c64,
};
use fluxmorph_geometry::tet4::{self, Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::coil::{self, Coil, Racetrack};
use crate::element::impedance::{self, ImpedanceTriangle};
use crate::element::interface::InterfaceTriangle;
use crate::element::volume::{AphiTet, Coefficients, source_load};
use crate::error::SolverError;
use crate::linear::{LinearSolverSettings, PreparedSystem, SystemAnalysis};
use crate::material::Material;
use crate::solution::FieldSolution;
use crate::unknowns::{PSI, Unknowns};

/// Sine of the angle between a face's normal and a coil's axis up to which `T` counts as normal to the face: rounding.
const NORMAL_TOLERANCE: f64 = 1e-6;

/// A condition on a planar outer surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// B·n = 0.
    FluxParallel,
    /// n × H = 0.
    FluxNormal,
}

/// A conductor that is not meshed but replaced by its impedance surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Conductor {
    /// Name of the region it stood for.
    pub name: String,
    /// Its surface, oriented out of the surrounding mesh.
    pub surface: Vec<[NodeId; 3]>,
    /// Its material.
    pub material: Material,
}

/// Everything that defines a field problem beside the mesh.
#[derive(Clone, Debug)]
pub struct FieldModelSetup {
    /// Frequency [Hz]; zero for magnetostatics.
    pub frequency: f64,
    /// Penalty factor `p = ν_p/ν` [1].
    pub penalty: f64,
    /// Material of every region, by `RegionId`.
    pub materials: Vec<Material>,
    /// Conductors replaced by impedance surfaces.
    pub impedance_surfaces: Vec<Conductor>,
    /// Coils.
    pub coils: Vec<Coil>,
    /// Conditions on named surfaces; outer faces without one are natural.
    pub boundaries: Vec<(String, Boundary)>,
    /// Linear solver.
    pub linear_solver: LinearSolverSettings,
}

/// A term of the weak form on one triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SurfaceTerm {
    /// Jump of the reluctivity `ν_inside − ν_outside` [m/H].
    Interface(f64),
    /// `jω/Zs` [1/H] of the conductor with this index.
    Impedance(c64, usize),
}

/// The matrix of one surface term.
enum SurfaceMatrix {
    Interface(InterfaceTriangle),
    Impedance(ImpedanceTriangle),
}

impl LocalMatrix<c64, 3, 4> for SurfaceMatrix {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        match self {
            Self::Interface(triangle) => triangle.block(a, b),
            Self::Impedance(triangle) => triangle.block(a, b),
        }
    }
}

/// A field problem, ready to be solved on any mesh with its topology.
#[derive(Debug)]
pub struct FieldModel {
    topology: Arc<Topology>,
    angular_frequency: f64,
    coefficients: Vec<Coefficients>,
    materials: Vec<Material>,
    conductors: Vec<Conductor>,
    coils: Vec<Coil>,
    unknowns: Unknowns,
    pattern: BlockPattern<4>,
    tets: BoundGroup<4>,
    triangles: BoundGroup<3>,
    surface_nodes: Vec<[NodeId; 3]>,
    surface_terms: Vec<SurfaceTerm>,
    /// `∫_e T dV` of all coils with their currents, real and imaginary part [A m²].
    moments: Vec<(ElementId, [c64; 3])>,
    analysis: SystemAnalysis,
}

impl FieldModel {
    /// Sets up the problem on a reference mesh: equation numbers, pattern, symbolic factor, coil integrals.
    ///
    /// # Errors
    /// [`SolverError`] names what is missing or out of range.
    pub fn new(mesh: &Mesh, setup: FieldModelSetup) -> Result<Self, SolverError> {
        check(mesh, &setup)?;
        let topology = Arc::clone(mesh.topology());
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
        let unknowns = Unknowns::new(mesh, &conductor_elements, &setup.boundaries)?;

        let potential = if setup.penalty == 1.0 { Coupling::diagonal(3) } else { Coupling::full(3) };
        let couplings = topology
            .elements()
            .map(|e| if conducting(e) { potential.union(with_psi()) } else { potential })
            .collect();
        let volumes = ElementGroup::new(topology.node_count(), topology.tets().to_vec(), couplings);
        let (surface_nodes, surface_terms) =
            surface_terms(&topology, &coefficients, &setup, angular_frequency)?;
        let surfaces = ElementGroup::new(
            topology.node_count(),
            surface_nodes.clone(),
            vec![Coupling::full(3); surface_nodes.len()],
        );
        let pattern = BlockPattern::symmetric(&unknowns.dofs, &volumes, &surfaces);
        let (tets, triangles) = (pattern.bind(&volumes), pattern.bind(&surfaces));
        let analysis = SystemAnalysis::new(pattern.structure(), setup.linear_solver)?;
        let moments = total_moments(mesh, &setup.coils)?;
        check_sources(mesh, &setup)?;
        Ok(Self {
            topology,
            angular_frequency,
            coefficients,
            materials: setup.materials,
            conductors: setup.impedance_surfaces,
            coils: setup.coils,
            unknowns,
            pattern,
            tets,
            triangles,
            surface_nodes,
            surface_terms,
            moments,
            analysis,
        })
    }

    /// Assembles the matrix on a mesh with this model's topology.
    pub fn assemble(&self, mesh: &Mesh) -> CsrMatrix<c64> {
        let mut matrix = CsrMatrix::zeros(self.pattern.structure());
        self.pattern.assemble(&self.tets, &mut matrix.values, |e| {
            AphiTet::new(Tet4::new(mesh.vertices(e)), *self.coefficients_of(e))
        });
        self.pattern.assemble(&self.triangles, &mut matrix.values, |t| {
            let vertices = self.surface_nodes[t.index()].map(|n| mesh.point(n));
            match self.surface_terms[t.index()] {
                SurfaceTerm::Interface(jump) => {
                    SurfaceMatrix::Interface(InterfaceTriangle::new(vertices, jump))
                }
                SurfaceTerm::Impedance(coefficient, _) => {
                    SurfaceMatrix::Impedance(ImpedanceTriangle::new(vertices, coefficient))
                }
            }
        });
        matrix
    }

    /// The load `∫T·curl w` [A m] of all coils, one entry per unknown.
    pub fn load(&self, mesh: &Mesh) -> Vec<c64> {
        let mut load = vec![c64::default(); self.unknowns.dofs.count()];
        for &(e, moment) in &self.moments {
            let tet = Tet4::new(mesh.vertices(e));
            let re = source_load(&tet, moment.map(|m| m.re));
            let im = source_load(&tet, moment.map(|m| m.im));
            for (a, n) in self.topology.tet(e).into_iter().enumerate() {
                let at = |d: usize| c64::new(re[a][d], im[a][d]);
                self.unknowns.dofs.scatter_add(&mut load, n, [at(0), at(1), at(2), c64::default()]);
            }
        }
        load
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
        Ok(FieldSolution::new(values, report))
    }

    /// Number of unknowns.
    pub fn unknown_count(&self) -> usize {
        self.unknowns.dofs.count()
    }

    /// Equation numbers and grounded nodes.
    pub fn unknowns(&self) -> &Unknowns {
        &self.unknowns
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

    /// Conductors replaced by impedance surfaces.
    pub fn conductors(&self) -> &[Conductor] {
        &self.conductors
    }

    /// The coils.
    pub fn coils(&self) -> &[Coil] {
        &self.coils
    }

    /// Elements that a coil's `T` meets: these must not move.
    pub fn source_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.moments.iter().map(|&(e, _)| e)
    }

    /// Bytes of the matrix and the factor that one solution needs.
    pub fn memory_estimate(&self) -> usize {
        let entries = self.pattern.structure().columns.len();
        entries * (size_of::<c64>() + size_of::<f64>() + size_of::<u32>()) + self.analysis.factor_bytes()
    }

    pub(crate) fn coefficients_of(&self, e: ElementId) -> &Coefficients {
        &self.coefficients[self.topology.region_of()[e.index()].index()]
    }

    pub(crate) fn surface(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.surface_nodes.iter().copied().zip(self.surface_terms.iter().copied())
    }
}

/// Refuses a coil whose `T` has a tangential part on a face that is not flux-parallel.
///
/// The load `∫T·curl w` holds the surface term `∮(T × n)·w`: it vanishes where the tangential `w` does (flux-parallel
/// planes) or where `T` is normal to the face; elsewhere it would make the natural condition `n × (H − T) = 0`.
fn check_sources(mesh: &Mesh, setup: &FieldModelSetup) -> Result<(), SolverError> {
    let topology = mesh.topology();
    let mut flux_parallel = HashSet::new();
    for (name, _) in setup.boundaries.iter().filter(|(_, b)| *b == Boundary::FluxParallel) {
        flux_parallel.extend(topology.surface(name)?.iter().map(sorted));
    }
    let open = topology.facets().iter().filter(|f| f.outside.is_none());
    for facet in open.filter(|f| !flux_parallel.contains(&sorted(&f.nodes))) {
        let vertices = facet.nodes.map(|n| mesh.point(n));
        let place = tet4::centroid(vertices);
        let normal = tet4::area_vector(vertices);
        let area = tet4::norm(normal);
        for coil in &setup.coils {
            let across = (1.0 - (normal[coil.shape.axis()] / area).powi(2)).max(0.0).sqrt();
            if across > NORMAL_TOLERANCE && meets(&coil.shape, vertices) {
                let surface = setup
                    .boundaries
                    .iter()
                    .find(|(name, _)| {
                        topology
                            .surface(name)
                            .is_ok_and(|s| s.iter().any(|t| sorted(t) == sorted(&facet.nodes)))
                    })
                    .map_or_else(
                        || "an outer face without a condition, or an impedance surface,".to_owned(),
                        |(name, _)| format!("the flux-normal surface `{name}`"),
                    );
                return Err(SolverError::SourceOnBoundary { coil: coil.name.clone(), surface, place });
            }
        }
    }
    Ok(())
}

/// Whether a coil's `T` is felt on a triangle, looked at on a fine grid of its points.
fn meets(coil: &Racetrack, vertices: [Point; 3]) -> bool {
    const STEPS: usize = 12;
    (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j))).any(|(i, j)| {
        let (s, t) = (i as f64 / STEPS as f64, j as f64 / STEPS as f64);
        let x: Point = std::array::from_fn(|d| {
            vertices[0][d] + s * (vertices[1][d] - vertices[0][d]) + t * (vertices[2][d] - vertices[0][d])
        });
        coil.potential(x) != 0.0
    })
}

/// The nodes of a triangle, ascending: the same for both orientations.
fn sorted(triangle: &[NodeId; 3]) -> [NodeId; 3] {
    let mut key = *triangle;
    key.sort_unstable();
    key
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
    assert_eq!(setup.materials.len(), mesh.topology().region_names().len(), "one material a region");
    for (material, region) in setup.materials.iter().zip(mesh.topology().region_names()) {
        let Material { relative_permeability: mu, conductivity: sigma } = *material;
        if !(mu > 0.0 && mu.is_finite()) {
            return refuse(&format!("relative_permeability of `{region}`"), mu, "a positive number");
        }
        if !(sigma >= 0.0 && sigma.is_finite()) {
            return refuse(&format!("conductivity of `{region}`"), sigma, "zero or more siemens per metre");
        }
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

/// Triangles at which ν jumps, natural outer faces, and impedance surfaces.
fn surface_terms(
    topology: &Topology,
    coefficients: &[Coefficients],
    setup: &FieldModelSetup,
    angular_frequency: f64,
) -> Result<(Vec<[NodeId; 3]>, Vec<SurfaceTerm>), SolverError> {
    // On planes at right angles to an axis the term couples components that the condition fixes: nothing to store.
    let mut conditioned = HashSet::new();
    for (name, _) in &setup.boundaries {
        conditioned.extend(topology.surface(name)?.iter().map(sorted));
    }
    let reluctivity = |e: ElementId| coefficients[topology.region_of()[e.index()].index()].reluctivity;
    let (mut nodes, mut terms) = (Vec::new(), Vec::new());
    for facet in topology.facets() {
        let outside = facet.outside.map_or(0.0, reluctivity);
        let jump = reluctivity(facet.inside) - outside;
        if jump != 0.0 && !(facet.outside.is_none() && conditioned.contains(&sorted(&facet.nodes))) {
            nodes.push(facet.nodes);
            terms.push(SurfaceTerm::Interface(jump));
        }
    }
    for (index, conductor) in setup.impedance_surfaces.iter().enumerate() {
        let Some(skin_depth) = conductor.material.skin_depth(angular_frequency) else {
            return Err(SolverError::Parameter {
                what: format!("model of `{}`", conductor.name),
                value: "impedance".to_owned(),
                expected: "an impedance surface needs a conductivity and a frequency above zero; use model = \"volume\""
                    .to_owned(),
            });
        };
        let coefficient =
            impedance::surface_coefficient(angular_frequency, conductor.material.conductivity, skin_depth);
        for triangle in &conductor.surface {
            nodes.push(*triangle);
            terms.push(SurfaceTerm::Impedance(coefficient, index));
        }
    }
    Ok((nodes, terms))
}

/// `Σ_coils N I ∫_e T dV`, ascending by element.
fn total_moments(mesh: &Mesh, coils: &[Coil]) -> Result<Vec<(ElementId, [c64; 3])>, SolverError> {
    let mut all: Vec<(ElementId, [c64; 3])> = Vec::new();
    for coil in coils {
        let moments: Vec<(ElementId, Point)> = coil::moments(&coil.shape, mesh);
        if moments.is_empty() {
            return Err(SolverError::NoSource {
                cause: format!(
                    "the coil `{}` lies outside the mesh; check its centre and the mesh unit",
                    coil.name
                ),
            });
        }
        all.extend(moments.into_iter().map(|(e, m)| (e, m.map(|m| coil.ampere_turns * m))));
    }
    all.sort_by_key(|&(e, _)| e);
    let mut merged: Vec<(ElementId, [c64; 3])> = Vec::with_capacity(all.len());
    for (e, moment) in all {
        match merged.last_mut() {
            Some((last, sum)) if *last == e => {
                for d in 0..3 {
                    sum[d] += moment[d];
                }
            }
            _ => merged.push((e, moment)),
        }
    }
    Ok(merged)
}
