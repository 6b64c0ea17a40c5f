//! The elastic map from design nodes to the whole mesh (Eq. 3).
//!
//! `K_dd Δx_d = f_d − K_db Δx_b`: `b` are the components prescribed by the design, `d` the unknown ones; components held
//! at zero drop out. `K` is assembled and factored once, on the reference mesh: `Δx` is one fixed affine function of
//! `Δx_b`, which is what makes an objective of the moved mesh a function of the design and its gradient exact.

use std::sync::Arc;

use fluxmorph_geometry::fem::{
    BlockPattern, BoundGroup, Coupling, CsrMatrix, DofMap, ElementGroup, LocalMatrix, RotatedMatrix,
};
use fluxmorph_geometry::parallel::Ownership;
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::body::Body;
use crate::boundary::{Boundary, NodeConditions};
use crate::distributed::DistributedElastic;
use crate::error::RemeshError;
use crate::force::nodal_force;
use crate::freedom::Freedom;
use crate::policy::StiffnessPolicy;
use crate::restraint;
use crate::solver::{ElasticSolver, SolverAnalysis, SolverChoice};
use crate::subregion::Subregion;

/// Which way the nodes of the elastic body may move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KinematicConstraint {
    /// Every way: the paper's elasticity.
    #[default]
    Free,
    /// Along one coordinate axis (0, 1, 2) only. For designs that move along that axis: a column of thin
    /// cells then inverts only where it is squeezed to nothing, never through sideways motion, and the system has a third
    /// of the unknowns.
    Axis(usize),
}

impl KinematicConstraint {
    /// Bit `c` is set where component `c` is held at zero.
    pub(crate) fn held(self) -> u8 {
        match self {
            Self::Free => 0,
            Self::Axis(axis) => 0b111 & !(1 << axis),
        }
    }
}

/// How the mesh follows the design.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionLaw {
    /// By linear elasticity (Eq. 3), frozen on the undeformed mesh.
    #[default]
    Linear,
    /// All nodes along one coordinate axis (0, 1, 2), by a convex energy on the undeformed mesh (`rails`): for
    /// designs that move along that axis. All in one process.
    Rails(usize),
    /// All nodes in all directions, by a hyperelastic energy on the undeformed mesh (`hyperelastic`). All in one
    /// process.
    Hyperelastic,
}

/// What is remeshed and how.
#[derive(Clone, Debug, Default)]
pub struct RemeshSetup {
    /// The parts of the remesh region; their elements together are the region, and they do not overlap.
    pub subregions: Vec<Subregion>,
    /// How stiffness follows element size, over the whole region.
    pub policy: StiffnessPolicy,
    /// Which way nodes may move; design nodes move as the design says.
    pub kinematic_constraint: KinematicConstraint,
    /// How the mesh follows the design.
    pub law: MotionLaw,
    /// Nodes whose displacement the design prescribes, in the order in which it comes.
    pub design_nodes: Vec<NodeId>,
    /// Surfaces with a kind; nodes of [`crate::BoundaryKind::Design`] surfaces follow the listed design nodes, ascending.
    pub boundaries: Vec<Boundary>,
    /// How the elastic system is solved in one process.
    pub solver: SolverChoice,
    /// The ranks over which it is distributed; `None` for one process.
    pub ownership: Option<Ownership>,
}

/// What follows from topology and set-up alone; tangents share it.
#[derive(Debug)]
struct Plan {
    setup: RemeshSetup,
    body: Arc<Body>,
    design_nodes: Vec<NodeId>,
    unknowns: Arc<Freedom>,
    prescribed: DofMap<3>,
    /// In one process.
    stiffness: Option<(BlockPattern<3>, BoundGroup<4>)>,
    coupling: (BlockPattern<3>, BoundGroup<4>),
    /// Positions in the body of the elements of `coupling`.
    coupled: Vec<u32>,
    /// Elements of which a node may move, ascending.
    moving: Arc<[ElementId]>,
    analysis: SolverAnalysis,
    force: Option<Vec<f64>>,
}

/// The affine map `Δx_b → Δx` of Eq. 3 over all mesh nodes, factored, with its transpose.
#[derive(Debug)]
pub struct ElasticMap {
    plan: Arc<Plan>,
    solver: ElasticSolver,
    /// `K_db`, shape `(n_unknowns, 3 n_design)`.
    coupling: CsrMatrix<f64>,
    offset: Vec<Point>,
}

impl ElasticMap {
    /// Assembles and factors the elastic system on the reference mesh.
    ///
    /// # Errors
    /// Any set-up fault of [`RemeshError`], [`fluxmorph_geometry::MeshError::Factorisation`], and
    /// [`RemeshError::NotConverged`] for a fictitious force.
    pub fn new(reference: &Mesh, setup: RemeshSetup) -> Result<Self, RemeshError> {
        let policy = setup.policy;
        let plan = Arc::new(Plan::new(reference, setup)?);
        let body = &plan.body;
        let weighting = policy.weighting(reference, &body.elements);
        let of = |position: usize| body.stiffness(reference, &weighting, position);
        let coupling = plan.coupling_matrix(of);
        let solver = ElasticSolver::new(&plan.analysis, || plan.matrix(of), (reference, policy))?;
        let mut map = Self { plan, solver, coupling, offset: Vec::new() };
        map.offset = match map.plan.force.clone() {
            Some(force) => map.solve(force)?,
            None => vec![[0.0; 3]; map.plan.topology().node_count()],
        };
        Ok(map)
    }

    /// The map of a body of the same set-up whose elements, by their position in [`ElasticMap::elements`], have other symmetric
    /// matrices, and no force: the tangent of a law that is not linear.
    ///
    /// # Errors
    /// [`fluxmorph_geometry::MeshError::Factorisation`].
    ///
    /// # Panics
    /// If the system is distributed.
    pub(crate) fn with_stiffness<L: LocalMatrix<f64, 4, 3>>(
        &self,
        of: impl Fn(usize) -> L + Sync,
    ) -> Result<Self, RemeshError> {
        let plan = Arc::clone(&self.plan);
        let coupling = plan.coupling_matrix(&of);
        let solver = ElasticSolver::of_matrix(&plan.analysis, plan.matrix(&of))?;
        let offset = vec![[0.0; 3]; plan.topology().node_count()];
        Ok(Self { plan, solver, coupling, offset })
    }

    /// Weight a volume of every element of the body on a mesh, for motion along an axis, or in all directions: Young's modulus of its subregion by the
    /// stiffness policy.
    pub(crate) fn weights(&self, mesh: &Mesh, axis: Option<usize>) -> Vec<f64> {
        let body = &self.plan.body;
        let weighting = self.plan.setup.policy.weighting(mesh, &body.elements);
        (0..body.elements.len()).map(|position| body.weight(mesh, &weighting, position, axis)).collect()
    }

    /// `K_dd⁻¹` of a nodal right side, shape `(n_nodes, 3)`; zero where there is no unknown.
    ///
    /// # Errors
    /// As [`ElasticMap::linear`].
    pub(crate) fn solve_nodal(&self, right_side: Vec<Point>) -> Result<Vec<Point>, RemeshError> {
        let mut unknowns = vec![0.0; self.plan.unknowns.dofs().count()];
        for (node, value) in (0..).map(NodeId).zip(right_side) {
            self.plan.unknowns.scatter_add(&mut unknowns, node, value);
        }
        self.solve(unknowns)
    }

    /// `K_dd⁻¹` of one component of a nodal right side, along an axis; zero where it is no unknown.
    ///
    /// # Errors
    /// As [`ElasticMap::linear`].
    pub(crate) fn solve_along(&self, right_side: Vec<f64>, axis: usize) -> Result<Vec<f64>, RemeshError> {
        let point = |value: f64| std::array::from_fn(|d| if d == axis { value } else { 0.0 });
        let solution = self.solve_nodal(right_side.into_iter().map(point).collect())?;
        Ok(solution.iter().map(|u| u[axis]).collect())
    }

    /// `Δx` of every mesh node [m] for the displacement `Δx_b` of the design nodes [m], shapes `(n_nodes, 3)` and
    /// `(n_design, 3)`: `offset + linear(Δx_b)`. Zero outside the remesh region.
    ///
    /// # Errors
    /// As [`ElasticMap::linear`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn displacement(&self, design: &[Point]) -> Result<Vec<Point>, RemeshError> {
        let mut displacement = self.linear(design)?;
        for (u, o) in displacement.iter_mut().zip(&self.offset) {
            for d in 0..3 {
                u[d] += o[d];
            }
        }
        Ok(displacement)
    }

    /// The linear part: `Δx_d = −K_dd⁻¹ K_db Δx_b`, and `Δx_b` itself at the design nodes; shape `(n_nodes, 3)` [m].
    ///
    /// # Errors
    /// [`RemeshError::NotConverged`] when the iterative solver fails, [`RemeshError::NotFinite`].
    ///
    /// # Panics
    /// If there is not one displacement per design node.
    pub fn linear(&self, design: &[Point]) -> Result<Vec<Point>, RemeshError> {
        let plan = &self.plan;
        assert_eq!(design.len(), plan.design_nodes.len(), "one displacement per design node");
        let mut prescribed = vec![0.0; plan.prescribed.count()];
        for (&node, u) in plan.design_nodes.iter().zip(design) {
            plan.prescribed.scatter_add(&mut prescribed, node, u.map(|u| -u));
        }
        let mut right_side = vec![0.0; plan.unknowns.dofs().count()];
        self.coupling.mul(&prescribed, &mut right_side);
        let mut displacement = self.solve(right_side)?;
        for (node, u) in plan.design_nodes.iter().zip(design) {
            displacement[node.index()] = *u;
        }
        Ok(displacement)
    }

    /// The constant part, `Δx_d = K_dd⁻¹ f_d`: what the fictitious force alone does; zero for `f = 0`. Shape
    /// `(n_nodes, 3)` [m].
    pub fn offset(&self) -> &[Point] {
        &self.offset
    }

    /// Solves for the unknowns and spreads them over the mesh nodes.
    fn solve(&self, mut unknowns: Vec<f64>) -> Result<Vec<Point>, RemeshError> {
        self.solver.solve_in_place(&mut unknowns, "displacement")?;
        let topology = self.plan.topology();
        Ok(topology.nodes().map(|node| self.plan.unknowns.gather(&unknowns, node)).collect())
    }

    pub(crate) fn solver(&self) -> &ElasticSolver {
        &self.solver
    }

    /// `K_db`.
    pub(crate) fn coupling(&self) -> &CsrMatrix<f64> {
        &self.coupling
    }

    /// Equations of the unknown components `d`.
    pub(crate) fn unknowns(&self) -> &Freedom {
        &self.plan.unknowns
    }

    /// Columns of the prescribed components `b`.
    pub(crate) fn prescribed(&self) -> &DofMap<3> {
        &self.plan.prescribed
    }

    /// What is remeshed and how, as given.
    pub fn setup(&self) -> &RemeshSetup {
        &self.plan.setup
    }

    /// Which way the nodes may move.
    pub fn kinematic_constraint(&self) -> KinematicConstraint {
        self.plan.setup.kinematic_constraint
    }

    /// The design nodes, in the order of their displacements.
    pub fn design_nodes(&self) -> &[NodeId] {
        &self.plan.design_nodes
    }

    /// The elements of the remesh region, ascending.
    pub fn elements(&self) -> &[ElementId] {
        &self.plan.body.elements
    }

    /// Number of equations of Eq. 3 (the column "Equ. Num." of Table 2).
    pub fn equation_count(&self) -> usize {
        self.plan.unknowns.dofs().count()
    }

    /// Bytes of the solver at most: the factors, and the matrix where it is kept; zero where it is distributed.
    pub fn solver_bytes(&self) -> usize {
        let of = |(pattern, _): &(BlockPattern<3>, _)| self.plan.analysis.solver_bytes(pattern.structure());
        self.plan.stiffness.as_ref().map_or(0, of)
    }

    /// Elements of the body, and those beside it that share a node that may move: faces at which the body ends move too
    /// where they are listed as sliding or free. Ascending.
    pub fn moving(&self) -> &Arc<[ElementId]> {
        &self.plan.moving
    }

    /// Quality of the elements that may move, on a mesh of this topology.
    pub fn quality(&self, mesh: &Mesh) -> QualityReport {
        let own = || QualityReport::of_elements(mesh, self.moving()).expect("an elastic body has elements");
        match &self.plan.analysis {
            // Where a rank fails, the next command that needs it says so; this one does not.
            SolverAnalysis::Distributed(distributed) => {
                distributed.quality(mesh).ok().flatten().unwrap_or_else(own)
            }
            _ => own(),
        }
    }

    /// The part of a nodal vector along the unknowns of Eq. 3: without what is prescribed or held, or at right angles to a
    /// plane that a node keeps to.
    pub fn unknown_part(&self, node: NodeId, vector: Point) -> Point {
        self.plan.unknowns.part(node, vector)
    }

    /// Whether a node may move by an unknown of Eq. 3.
    pub fn is_unknown(&self, node: NodeId) -> bool {
        self.plan.unknowns.dofs().unknown_bits(node) != 0
    }
}

impl Plan {
    fn topology(&self) -> &Arc<Topology> {
        &self.body.topology
    }

    /// `K_dd` of element matrices by their position in the body.
    fn matrix<L: LocalMatrix<f64, 4, 3>>(&self, of: impl Fn(usize) -> L + Sync) -> CsrMatrix<f64> {
        let (pattern, group) = self.stiffness.as_ref().expect("one process has the whole pattern");
        let mut matrix = CsrMatrix::zeros(pattern.structure());
        pattern.assemble(group, &mut matrix.values, |e: ElementId| self.turned(&of, e.index()));
        matrix
    }

    /// `K_db` of them.
    fn coupling_matrix<L: LocalMatrix<f64, 4, 3>>(&self, of: impl Fn(usize) -> L + Sync) -> CsrMatrix<f64> {
        let (pattern, group) = &self.coupling;
        let mut matrix = CsrMatrix::zeros(pattern.structure());
        pattern.assemble(group, &mut matrix.values, |e: ElementId| {
            self.turned(&of, self.coupled[e.index()] as usize)
        });
        matrix
    }

    /// The matrix of the element at a position in the body, in the frames of its nodes.
    fn turned<L>(&self, of: impl Fn(usize) -> L, position: usize) -> RotatedMatrix<'_, L, 4> {
        self.unknowns.turned(of(position), self.topology().tet(self.body.elements[position]))
    }

    fn new(reference: &Mesh, setup: RemeshSetup) -> Result<Self, RemeshError> {
        if let KinematicConstraint::Axis(axis @ 3..) = setup.kinematic_constraint {
            return Err(RemeshError::Axis { axis });
        }
        let body = Arc::new(Body::new(reference.topology(), &setup.subregions)?);
        let Body { topology, elements, .. } = &*body;
        let mut conditions = NodeConditions::new(reference, &setup, elements)?;
        let node_count = topology.node_count();
        let frames = std::mem::take(&mut conditions.frames);
        let dofs = DofMap::of_nodes(node_count, |node, c| conditions.is_unknown(node, c));
        let unknowns = Arc::new(Freedom::new(dofs, frames));
        let prescribed = DofMap::<3>::of_nodes(node_count, |node, _| conditions.is_design[node.index()]);
        restraint::check(reference, elements, &unknowns)?;

        // Positions in the body of those at a design node: no other couples to the design.
        let at_design = |e: ElementId| topology.tet(e).iter().any(|n| conditions.is_design[n.index()]);
        let coupled: Vec<u32> =
            (0..).zip(elements).filter(|&(_, &e)| at_design(e)).map(|(position, _)| position).collect();
        let at_coupled = coupled.iter().map(|&position| topology.tet(elements[position as usize]));
        let coupling = bind_pattern(unknowns.dofs(), &prescribed, at_coupled.collect());
        let moving = moving_elements(&body, unknowns.dofs(), &conditions.design_nodes);
        let (stiffness, analysis) = match &setup.ownership {
            Some(ownership) => {
                let distributed = DistributedElastic::new(ownership, (&body, &unknowns), &moving);
                (None, SolverAnalysis::Distributed(Arc::new(distributed)))
            }
            None => {
                let tets = elements.iter().map(|&e| topology.tet(e)).collect();
                let stiffness = bind_pattern(unknowns.dofs(), unknowns.dofs(), tets);
                let analysis = SolverAnalysis::new(setup.solver, unknowns.dofs(), stiffness.0.structure())?;
                (Some(stiffness), analysis)
            }
        };
        let force = nodal_force(topology, &setup.subregions, &unknowns);
        let design_nodes = conditions.design_nodes;
        Ok(Self {
            setup,
            body,
            design_nodes,
            unknowns,
            prescribed,
            stiffness,
            coupling,
            coupled,
            moving,
            analysis,
            force,
        })
    }
}

/// The pattern of the rows against the columns over some elements, and these bound to it.
pub(crate) fn bind_pattern(
    rows: &DofMap<3>,
    columns: &DofMap<3>,
    connectivity: Vec<[NodeId; 4]>,
) -> (BlockPattern<3>, BoundGroup<4>) {
    let couplings = vec![Coupling::full(3); connectivity.len()];
    let group = ElementGroup::new(rows.carrier_count(), connectivity, couplings);
    let pattern = BlockPattern::rectangular(rows, columns, &group);
    let group = pattern.bind(&group);
    (pattern, group)
}

/// Elements of the body, and those around nodes that may move.
fn moving_elements(body: &Body, unknowns: &DofMap<3>, design_nodes: &[NodeId]) -> Arc<[ElementId]> {
    let topology = &body.topology;
    let mut moves = vec![false; topology.tets().len()];
    body.elements.iter().for_each(|e| moves[e.index()] = true);
    let free = topology.nodes().filter(|&n| unknowns.unknown_bits(n) != 0);
    for node in free.chain(design_nodes.iter().copied()) {
        topology.elements_around(node).iter().for_each(|e| moves[e.index()] = true);
    }
    topology.elements().filter(|e| moves[e.index()]).collect()
}
