//! The matrix of the field problem in one finite-element space: equation numbers, pattern, assembly.
//!
//! All of it follows from topology, conditions and from where ψ is defined, and is made once; the values come from a
//! [`WeakForm`] of any frequency above zero, or of statics. Of a distributed mesh, a rank has all equation numbers,
//! but only the rows of its own nodes and the elements that touch them ([`LocalEntities`]).

use fluxmorph_geometry::fem::{
    BlockPattern, BoundGroup, Coupling, CsrMatrix, DofMap, ElementGroup, LocalMatrix, c64,
};
use fluxmorph_geometry::parallel::Ownership;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::boundary::Boundary;
use crate::element::lagrange::Lagrange;
use crate::error::SolverError;
use crate::linear::aggregation;
use crate::local_entities::LocalEntities;
use crate::prolongation::{ScalarSpace, prolongation};
use crate::rotated::RotatedMatrix;
use crate::space::{Order, Space};
use crate::unknowns::{PSI, Unknowns};
use crate::weak_form::WeakForm;

/// A finite-element space with its unknowns and the pattern of their matrix.
#[derive(Debug)]
pub(crate) struct Discretisation {
    pub(crate) space: Space,
    pub(crate) unknowns: Unknowns,
    /// Rows of this rank against all columns; the whole where there is one rank.
    pub(crate) pattern: BlockPattern<4>,
    groups: Groups,
    /// Elements and triangles of the groups, where these are not all.
    pub(crate) local: Option<LocalEntities>,
    /// Elements and surface triangles with a node whose `A` is prescribed.
    lifted: (Vec<ElementId>, Vec<usize>),
}

/// Elements and surface triangles bound to the pattern, by order.
#[derive(Debug)]
enum Groups {
    Linear { tets: BoundGroup<4>, triangles: BoundGroup<3> },
    Quadratic { tets: BoundGroup<10>, triangles: BoundGroup<6> },
}

impl Discretisation {
    /// Numbers the unknowns of the given order and finds their couplings.
    ///
    /// # Errors
    /// As [`Unknowns::new`].
    pub(crate) fn new(
        mesh: &Mesh,
        order: Order,
        weak_form: &WeakForm,
        boundaries: &[(String, Boundary)],
        ownership: Option<&Ownership>,
    ) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let space = Space::new(topology, order);
        let unknowns = Unknowns::new(mesh, &space, &conductor(weak_form), boundaries)?;
        let turned = |nodes: &[NodeId]| nodes.iter().any(|&n| unknowns.frame(n).is_some());
        let local = ownership.map(|own| LocalEntities::new(topology, weak_form.triangles(), own));
        let coupling_of = |e: ElementId| {
            let decoupled = !weak_form.couples_components() && !turned(space.nodes_of(e));
            let potential = if decoupled { Coupling::diagonal(3) } else { Coupling::full(3) };
            if weak_form.conducts(e) { potential.union(with_psi()) } else { potential }
        };
        let rows = match ownership {
            None => unknowns.dofs.clone(),
            Some(ownership) => {
                let owned = |node: NodeId| ownership.owns(space.vertices_of(node)[0]);
                DofMap::new(space.node_count(), |node, c| {
                    owned(node) && unknowns.dofs.equation(node, c).is_some()
                })
            }
        };
        let (pattern, groups) =
            pattern(&space, (&rows, &unknowns.dofs), local.as_ref(), coupling_of, weak_form.triangles());
        let lifted = find_lifted(mesh, &space, &unknowns, weak_form.triangles());
        Ok(Self { space, unknowns, pattern, groups, local, lifted })
    }

    /// The prolongation from a coarse space: linear elements for quadratic ones; for linear ones conductors in full and
    /// aggregates elsewhere, by the couplings of `matrix`.
    ///
    /// # Errors
    /// As [`Unknowns::new`].
    pub(crate) fn prolongation(
        &self,
        mesh: &Mesh,
        weak_form: &WeakForm,
        boundaries: &[(String, Boundary)],
        matrix: &CsrMatrix<c64>,
    ) -> Result<CsrMatrix<f64>, SolverError> {
        let conductor = conductor(weak_form);
        if self.space.order() == Order::Quadratic {
            let vertices = Space::new(mesh.topology(), Order::Linear);
            let coarse = Unknowns::new(mesh, &vertices, &conductor, boundaries)?;
            return Ok(prolongation(&coarse, &self.space, &self.unknowns, ScalarSpace::default()));
        }
        let mut conducts = vec![false; self.space.node_count()];
        for node in conductor.iter().flat_map(|&e| self.space.nodes_of(e)) {
            conducts[node.index()] = true;
        }
        let kept = |node: NodeId| conducts[node.index()];
        Ok(aggregation::prolongation(&self.unknowns.dofs, matrix, kept, aggregation::PASSES))
    }

    /// Assembles the matrix, or the rows of this rank, on a mesh with this topology.
    pub(crate) fn assemble(&self, weak_form: &WeakForm, mesh: &Mesh) -> CsrMatrix<c64> {
        let mut matrix = CsrMatrix::zeros(self.pattern.structure());
        let values = &mut matrix.values;
        let local = self.local.as_ref();
        let element = |e: ElementId| local.map_or(e, |local| local.elements[e.index()]);
        let triangle = |t: ElementId| local.map_or(t.index(), |local| local.triangles[t.index()]);
        match &self.groups {
            Groups::Linear { tets, triangles } => {
                self.add_group(tets, values, |e| weak_form.linear_tet(mesh, element(e)));
                self.add_group(triangles, values, |t| {
                    weak_form.triangle(Lagrange::<3, 3>::triangle(), mesh, triangle(t))
                });
            }
            Groups::Quadratic { tets, triangles } => {
                self.add_group(tets, values, |e| weak_form.quadratic_tet(mesh, element(e)));
                self.add_group(triangles, values, |t| {
                    weak_form.triangle(Lagrange::<6, 3>::triangle(), mesh, triangle(t))
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
                RotatedMatrix::new(matrix(e), group.nodes_of(e).map(|n| self.unknowns.frame(n)))
            });
        } else {
            self.pattern.assemble(group, values, matrix);
        }
    }

    /// `f −= K A_prescribed`: what the prescribed part of `A` does to the load.
    pub(crate) fn lift(&self, weak_form: &WeakForm, mesh: &Mesh, load: &mut [c64]) {
        let (elements, triangles) = &self.lifted;
        match &self.groups {
            Groups::Linear { .. } => {
                for &e in elements {
                    self.subtract_lift(self.space.nodes_of(e), &weak_form.linear_tet(mesh, e), load);
                }
                for &t in triangles {
                    let matrix = weak_form.triangle(Lagrange::<3, 3>::triangle(), mesh, t);
                    self.subtract_lift(&self.space.triangle(weak_form.triangles()[t]), &matrix, load);
                }
            }
            Groups::Quadratic { .. } => {
                for &e in elements {
                    self.subtract_lift(self.space.nodes_of(e), &weak_form.quadratic_tet(mesh, e), load);
                }
                for &t in triangles {
                    let matrix = weak_form.triangle(Lagrange::<6, 3>::triangle(), mesh, t);
                    self.subtract_lift(&self.space.triangle(weak_form.triangles()[t]), &matrix, load);
                }
            }
        }
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
}

/// Elements in which eddy currents flow, ascending.
fn conductor(weak_form: &WeakForm) -> Vec<ElementId> {
    weak_form.topology().elements().filter(|&e| weak_form.conducts(e)).collect()
}

/// The pattern of the rows against the columns, and the elements and triangles of this rank bound to it.
fn pattern(
    space: &Space,
    (rows, columns): (&DofMap<4>, &DofMap<4>),
    local: Option<&LocalEntities>,
    coupling_of: impl Fn(ElementId) -> Coupling,
    triangles: &[[NodeId; 3]],
) -> (BlockPattern<4>, Groups) {
    let count = space.node_count();
    let couplings: Vec<Coupling> = match local {
        None => (0..space.element_count()).map(|e| coupling_of(ElementId::new(e))).collect(),
        Some(local) => local.elements.iter().map(|&e| coupling_of(e)).collect(),
    };
    let triangles: Vec<[NodeId; 3]> = match local {
        None => triangles.to_vec(),
        Some(local) => local.triangles.iter().map(|&t| triangles[t]).collect(),
    };
    let surface_couplings = vec![Coupling::full(3); triangles.len()];
    fn local_tets<const N: usize>(tets: &[[NodeId; N]], local: Option<&LocalEntities>) -> Vec<[NodeId; N]> {
        match local {
            None => tets.to_vec(),
            Some(local) => local.elements.iter().map(|e| tets[e.index()]).collect(),
        }
    }
    match (space.linear_tets(), space.quadratic_tets()) {
        (Some(tets), _) => {
            let volumes = ElementGroup::new(count, local_tets(tets, local), couplings);
            let faces = ElementGroup::new(count, triangles, surface_couplings);
            let pattern = BlockPattern::of_rows(rows, columns, &volumes, &faces);
            let groups = Groups::Linear { tets: pattern.bind(&volumes), triangles: pattern.bind(&faces) };
            (pattern, groups)
        }
        (None, tets) => {
            let volumes = ElementGroup::new(count, local_tets(tets.unwrap_or_default(), local), couplings);
            let triangles = triangles.iter().map(|&t| space.quadratic_triangle(t)).collect();
            let faces = ElementGroup::new(count, triangles, surface_couplings);
            let pattern = BlockPattern::of_rows(rows, columns, &volumes, &faces);
            let groups = Groups::Quadratic { tets: pattern.bind(&volumes), triangles: pattern.bind(&faces) };
            (pattern, groups)
        }
    }
}

/// Elements and surface triangles with a node whose `A` is prescribed, ascending.
fn find_lifted(
    mesh: &Mesh,
    space: &Space,
    unknowns: &Unknowns,
    triangles: &[[NodeId; 3]],
) -> (Vec<ElementId>, Vec<usize>) {
    let mut prescribed = vec![false; space.node_count()];
    for n in unknowns.prescribed_nodes() {
        prescribed[n.index()] = true;
    }
    let touches = |nodes: &[NodeId]| nodes.iter().any(|n| prescribed[n.index()]);
    let elements = mesh.topology().elements().filter(|&e| touches(space.nodes_of(e))).collect();
    let triangles = (0..triangles.len()).filter(|&t| touches(&space.triangle(triangles[t]))).collect();
    (elements, triangles)
}

/// ψ with itself and with every component of `A`.
fn with_psi() -> Coupling {
    (0..4).fold(Coupling::NONE, |set, i| set.with(i, PSI).with(PSI, i))
}
