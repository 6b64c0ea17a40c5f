//! The elastic map from design nodes to the whole mesh (Eq. 3).
//!
//! `K_dd Δx_d = f_d − K_db Δx_b`: `b` are the components prescribed by the design, `d` the unknown ones; components held
//! at zero drop out. `K` is assembled and factored once, on the reference mesh: `Δx` is one fixed affine function of
//! `Δx_b`, which is what makes an objective of the moved mesh a function of the design and its gradient exact.

use std::sync::Arc;

use fluxmorph_geometry::fem::{BlockPattern, BoundGroup, Coupling, CsrMatrix, DofMap, ElementGroup};
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};

use crate::boundary::{Boundary, Constraints};
use crate::elasticity::{Isotropic, Stiffness, stiffness};
use crate::error::RemeshError;
use crate::force::nodal_force;
use crate::policy::StiffnessPolicy;
use crate::restraint;
use crate::solver::{ElasticSolver, SolverAnalysis, SolverChoice};
use crate::subregion::Subregion;

/// Which way the nodes of the elastic body may move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Guidance {
    /// Every way: the paper's elasticity.
    #[default]
    Free,
    /// Along one coordinate axis (0, 1, 2) only, as if on rails. For designs that move along that axis: a column of thin
    /// cells then inverts only where it is squeezed to nothing, never through sideways motion, and the system has a third
    /// of the unknowns.
    Axis(usize),
}

impl Guidance {
    fn allows(self, component: usize) -> bool {
        match self {
            Self::Free => true,
            Self::Axis(axis) => component == axis,
        }
    }
}

/// What is remeshed and how.
#[derive(Clone, Debug, Default)]
pub struct RemeshSetup {
    /// The parts of the remesh region; their elements together are the region, and they do not overlap.
    pub subregions: Vec<Subregion>,
    /// How stiffness follows element size, over the whole region, on the first reference mesh; a rebase may take another.
    pub policy: StiffnessPolicy,
    /// Which way nodes may move; design nodes move as the design says.
    pub guidance: Guidance,
    /// Nodes whose displacement the design prescribes, in the order in which it comes.
    pub design_nodes: Vec<NodeId>,
    /// Surfaces with a kind; nodes of [`crate::BoundaryKind::Design`] surfaces follow the listed design nodes, ascending.
    pub boundaries: Vec<Boundary>,
    /// Further nodes that do not move.
    pub fixed_nodes: Vec<NodeId>,
    /// How the elastic system is solved.
    pub solver: SolverChoice,
}

/// What follows from topology and set-up alone, and outlives a new reference mesh.
#[derive(Debug)]
struct Plan {
    setup: RemeshSetup,
    topology: Arc<Topology>,
    /// Elements of the region, ascending, and the subregion of each.
    elements: Vec<ElementId>,
    subregion_of: Vec<u32>,
    design_nodes: Vec<NodeId>,
    unknowns: DofMap<3>,
    prescribed: DofMap<3>,
    stiffness: (BlockPattern<3>, BoundGroup<4>),
    coupling: (BlockPattern<3>, BoundGroup<4>),
    /// Positions in `elements` of the elements of `coupling`.
    coupled: Vec<u32>,
    analysis: SolverAnalysis,
    force: Option<Vec<f64>>,
}

/// The affine map `Δx_b → Δx` of Eq. 3 over all mesh nodes, factored, with its transpose.
#[derive(Debug)]
pub struct ElasticMap {
    plan: Arc<Plan>,
    policy: StiffnessPolicy,
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
        Self::assembled(reference, Arc::new(Plan::new(reference, setup)?), policy)
    }

    /// The map of the same set-up on a moved mesh of the same topology, a new reference, with this or another stiffness
    /// policy. Pattern and symbolic factor are kept, stiffness and numeric factor are new.
    ///
    /// # Errors
    /// [`fluxmorph_geometry::MeshError::Factorisation`], and [`RemeshError::NotConverged`] for a fictitious force.
    ///
    /// # Panics
    /// If the mesh has another topology.
    pub fn rebased(&self, reference: &Mesh, policy: StiffnessPolicy) -> Result<Self, RemeshError> {
        assert!(Arc::ptr_eq(reference.topology(), &self.plan.topology), "a rebase keeps the topology");
        Self::assembled(reference, Arc::clone(&self.plan), policy)
    }

    fn assembled(reference: &Mesh, plan: Arc<Plan>, policy: StiffnessPolicy) -> Result<Self, RemeshError> {
        let weighting = policy.weighting(reference, &plan.elements);
        let element_matrix = |i: usize| -> Stiffness {
            let law = plan.setup.subregions[plan.subregion_of[i] as usize].law();
            let vertices = reference.vertices(plan.elements[i]);
            let (factor, tensor) = weighting.of(vertices);
            let law = Isotropic { young: law.young * factor, ..law };
            stiffness(&Tet4::new(vertices), &law, &tensor)
        };
        let stiffness_matrix = || {
            let (pattern, group) = &plan.stiffness;
            let mut matrix = CsrMatrix::zeros(pattern.structure());
            pattern.assemble(group, &mut matrix.values, |e| element_matrix(e.index()));
            matrix
        };
        let (pattern, group) = &plan.coupling;
        let mut coupling = CsrMatrix::zeros(pattern.structure());
        pattern.assemble(group, &mut coupling.values, |e| element_matrix(plan.coupled[e.index()] as usize));
        let solver = ElasticSolver::new(&plan.analysis, stiffness_matrix)?;
        let mut map = Self { plan, policy, solver, coupling, offset: Vec::new() };
        map.offset = match map.plan.force.clone() {
            Some(force) => map.solved(force)?,
            None => vec![[0.0; 3]; map.plan.topology.node_count()],
        };
        Ok(map)
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
        let mut right_side = vec![0.0; plan.unknowns.count()];
        self.coupling.mul(&prescribed, &mut right_side);
        let mut displacement = self.solved(right_side)?;
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
    fn solved(&self, mut unknowns: Vec<f64>) -> Result<Vec<Point>, RemeshError> {
        self.solver.solve_in_place(&mut unknowns, "displacement")?;
        let topology = &self.plan.topology;
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
    pub(crate) fn unknowns(&self) -> &DofMap<3> {
        &self.plan.unknowns
    }

    /// Columns of the prescribed components `b`.
    pub(crate) fn prescribed(&self) -> &DofMap<3> {
        &self.plan.prescribed
    }

    /// The stiffness policy of this reference.
    pub fn policy(&self) -> StiffnessPolicy {
        self.policy
    }

    /// What is remeshed and how, as given.
    pub fn setup(&self) -> &RemeshSetup {
        &self.plan.setup
    }

    /// Which way the nodes may move.
    pub fn guidance(&self) -> Guidance {
        self.plan.setup.guidance
    }

    /// The design nodes, in the order of their displacements.
    pub fn design_nodes(&self) -> &[NodeId] {
        &self.plan.design_nodes
    }

    /// The elements of the remesh region, ascending.
    pub fn elements(&self) -> &[ElementId] {
        &self.plan.elements
    }

    /// Number of equations of Eq. 3 (the column "Equ. Num." of Table 2).
    pub fn equation_count(&self) -> usize {
        self.plan.unknowns.count()
    }

    /// Bytes of the solver at most: the factors, and the matrix where it is kept.
    pub fn solver_bytes(&self) -> usize {
        self.plan.analysis.solver_bytes(self.plan.stiffness.0.structure())
    }

    /// Whether a displacement component at a node is an unknown of Eq. 3.
    pub fn is_unknown(&self, node: NodeId, component: usize) -> bool {
        self.plan.unknowns.equation(node, component).is_some()
    }
}

impl Plan {
    fn new(reference: &Mesh, setup: RemeshSetup) -> Result<Self, RemeshError> {
        let topology = Arc::clone(reference.topology());
        let (elements, subregion_of) = region_elements(&topology, &setup.subregions)?;
        let constraints = Constraints::new(reference, &setup, &elements)?;
        let node_count = topology.node_count();
        let unknowns = DofMap::<3>::new(node_count, |node, c| {
            setup.guidance.allows(c) && constraints.is_unknown(node, c)
        });
        let prescribed = DofMap::<3>::new(node_count, |node, _| constraints.is_design[node.index()]);
        restraint::check(reference, &elements, &unknowns)?;

        // Positions in `elements` of those at a design node: no other couples to the design.
        let at_design = |e: ElementId| topology.tet(e).iter().any(|n| constraints.is_design[n.index()]);
        let coupled: Vec<u32> =
            (0..).zip(&elements).filter(|&(_, &e)| at_design(e)).map(|(position, _)| position).collect();
        let bound = |columns, connectivity: Vec<[NodeId; 4]>| {
            let couplings = vec![Coupling::full(3); connectivity.len()];
            let group = ElementGroup::new(node_count, connectivity, couplings);
            let pattern = BlockPattern::rectangular(&unknowns, columns, &group);
            let group = pattern.bind(&group);
            (pattern, group)
        };
        let stiffness = bound(&unknowns, elements.iter().map(|&e| topology.tet(e)).collect());
        let at_coupled = coupled.iter().map(|&position| topology.tet(elements[position as usize]));
        let coupling = bound(&prescribed, at_coupled.collect());
        let analysis = SolverAnalysis::new(setup.solver, &unknowns, stiffness.0.structure())?;
        let force = nodal_force(&topology, &setup.subregions, &unknowns);
        let design_nodes = constraints.design_nodes;
        Ok(Self {
            setup,
            topology,
            elements,
            subregion_of,
            design_nodes,
            unknowns,
            prescribed,
            stiffness,
            coupling,
            coupled,
            analysis,
            force,
        })
    }
}

/// The elements of all subregions, ascending, and the subregion of each.
fn region_elements(
    topology: &Topology,
    subregions: &[Subregion],
) -> Result<(Vec<ElementId>, Vec<u32>), RemeshError> {
    let element_count = topology.tets().len();
    let mut owner: Vec<Option<u32>> = vec![None; element_count];
    for (s, subregion) in (0u32..).zip(subregions) {
        subregion.validate()?;
        for &element in &subregion.elements {
            let name = |s: u32| subregions[s as usize].name.clone();
            match owner.get_mut(element.index()) {
                None => {
                    let subregion = name(s);
                    return Err(RemeshError::DanglingElement { subregion, element, elements: element_count });
                }
                Some(Some(first)) if *first != s => {
                    return Err(RemeshError::Overlap { element, first: name(*first), second: name(s) });
                }
                Some(slot) => *slot = Some(s),
            }
        }
    }
    let (elements, subregion_of): (Vec<_>, Vec<_>) =
        topology.elements().filter_map(|e| Some((e, owner[e.index()]?))).unzip();
    if elements.is_empty() { Err(RemeshError::EmptyRegion) } else { Ok((elements, subregion_of)) }
}
