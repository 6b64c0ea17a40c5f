//! The matrix of the field problem in one finite-element space: equation numbers, pattern, assembly.
//!
//! All of it follows from topology, conditions and from where ψ is defined, and is made once; the values come from a
//! [`WeakForm`] of any frequency above zero, or of statics. Of a distributed mesh, a rank has all equation numbers,
//! but only the rows of its own nodes and the elements that touch them ([`LocalEntities`]).

use fluxmorph_geometry::fem::{
    BlockPattern, BoundGroup, Coupling, CsrMatrix, DofMap, ElementGroup, Hosts, LocalMatrix, RotatedMatrix,
    c64,
};
use fluxmorph_geometry::parallel::{CoarseSpace, Ownership, RowLayout};
use fluxmorph_geometry::tet4::area_vector;
use fluxmorph_geometry::{CarrierId, ElementId, Mesh, NodeId};

use crate::boundary::Boundary;
use crate::circuit::{SolidRows, Solids};
use crate::element::tensor::{CurlsOfRule, TensorTerm};
use crate::element::volume::Coefficients;
use crate::elements::{ElementFamily, Order};
use crate::error::SolverError;
use crate::family::{self, Local, Matrices};
use crate::linear::{aggregation, hats};
use crate::local_entities::LocalEntities;
use crate::prolongation::{ScalarSpace, components, injection, prolongation};
use crate::space::{Carriers, Space};
use crate::surface::SurfaceTerm;
use crate::tangents::Tangents;
use crate::unknowns::{PSI, Unknowns};
use crate::weak_form::WeakForm;

/// Relative residual from which iterations are few, so that the coarse factor may be most of the work.
const ROUGH: f64 = 1e-4;

/// Coarse unknowns from which it is, and linear functions are joined to aggregates then.
const JOINED_FROM: usize = 100_000;

/// A finite-element space with its unknowns and the pattern of their matrix.
#[derive(Debug)]
pub(crate) struct Discretisation {
    pub(crate) space: Space,
    pub(crate) unknowns: Unknowns,
    /// Rows of this rank against all columns; the whole where there is one rank.
    pub(crate) pattern: BlockPattern<4>,
    groups: Box<dyn Bound>,
    /// Elements and triangles of the groups, where these are not all.
    pub(crate) local: Option<LocalEntities>,
    /// Elements and surface triangles with a carrier whose `A` is prescribed.
    lifted: (Vec<ElementId>, Vec<usize>),
}

/// Elements and surface triangles bound to the pattern: what adds their matrices.
trait Bound: std::fmt::Debug + Send + Sync {
    /// Adds the matrices of all elements and triangles of this rank to `values`; of B–H laws they have the linear parts.
    fn add(&self, of: &Discretisation, weak_form: &WeakForm, mesh: &Mesh, values: &mut [c64]);
    /// Adds what the tangents of B–H laws have beyond these.
    fn add_tangents(&self, of: &Discretisation, tangents: &Tangents, mesh: &Mesh, values: &mut [c64]);
    /// `f −= K A_prescribed` of the elements and triangles that prescribed values touch.
    fn subtract_lift(&self, of: &Discretisation, weak_form: &WeakForm, mesh: &Mesh, load: &mut [c64]);
    /// What conduction has of the matrix of an element, times some coefficients.
    fn conduction_times(
        &self,
        of: &Discretisation,
        weak_form: &WeakForm,
        mesh: &Mesh,
        e: ElementId,
        x: &Local,
    ) -> Local;
}

/// Groups of elements with `N` and triangles with `F` carriers.
struct Groups<K: 'static, const N: usize, const F: usize> {
    matrices: &'static K,
    tets: BoundGroup<N>,
    triangles: BoundGroup<F>,
}

impl<K, const N: usize, const F: usize> std::fmt::Debug for Groups<K, N, F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Groups").finish_non_exhaustive()
    }
}

impl<K: Matrices<N, F>, const N: usize, const F: usize> Bound for Groups<K, N, F> {
    fn add(&self, of: &Discretisation, weak_form: &WeakForm, mesh: &Mesh, values: &mut [c64]) {
        let all = |_: ElementId| true;
        of.add_group(&self.tets, values, all, |e| {
            let e = of.element(e);
            weak_form.tet(self.matrices, of.space.cell(mesh, e), e)
        });
        of.add_group(&self.triangles, values, all, |t| {
            let t = of.local.as_ref().map_or(t.index(), |local| local.triangles[t.index()]);
            weak_form.triangle(self.matrices, mesh, t)
        });
    }

    fn add_tangents(&self, of: &Discretisation, tangents: &Tangents, mesh: &Mesh, values: &mut [c64]) {
        let tensors = |e: ElementId| tangents.of(of.element(e));
        of.add_group(
            &self.tets,
            values,
            |e| tensors(e).is_some(),
            |e| {
                let CurlsOfRule { count, weights, curls } =
                    self.matrices.flux_curls(&of.space.cell(mesh, of.element(e)));
                let tensors = tensors(e).expect("an element with a law");
                TensorTerm::new((0..count).map(|p| (weights[p], &tensors[p], &curls[p])))
            },
        );
    }

    fn subtract_lift(&self, of: &Discretisation, weak_form: &WeakForm, mesh: &Mesh, load: &mut [c64]) {
        let (elements, triangles) = &of.lifted;
        for &e in elements {
            let matrix = weak_form.tet(self.matrices, of.space.cell(mesh, e), e);
            of.subtract_lift(of.space.carriers_of(e), &matrix, load);
        }
        for &t in triangles {
            let matrix = weak_form.triangle(self.matrices, mesh, t);
            of.subtract_lift(&of.space.triangle(weak_form.triangles()[t]), &matrix, load);
        }
    }

    fn conduction_times(
        &self,
        of: &Discretisation,
        weak_form: &WeakForm,
        mesh: &Mesh,
        e: ElementId,
        x: &Local,
    ) -> Local {
        let law = Coefficients { reluctivity: 0.0, extra_penalty: 0.0, ..*weak_form.coefficients_of(e) };
        let matrix = self.matrices.tet(of.space.cell(mesh, e), law);
        Local::new(N, |a| {
            let mut row = [c64::default(); 4];
            for (b, x) in x.values().iter().enumerate().take(N) {
                let block = matrix.block(a, b);
                (0..4).for_each(|i| row[i] += (0..4).map(|j| block[i][j] * x[j]).sum::<c64>());
            }
            row
        })
    }
}

impl Discretisation {
    /// Numbers the unknowns of the given family and order and finds their couplings.
    ///
    /// # Errors
    /// As [`Unknowns::new`].
    pub(crate) fn new(
        mesh: &Mesh,
        (family, order): (ElementFamily, Order),
        weak_form: &WeakForm,
        boundaries: &[(String, Boundary)],
        ownership: Option<&Ownership>,
    ) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let space = Space::new(topology, family, order);
        let unknowns = Unknowns::new(mesh, &space, &weak_form.conductors(), boundaries)?;
        let turned = |carriers: &[CarrierId]| carriers.iter().any(|&n| unknowns.frame(n).is_some());
        let local = ownership.map(|own| LocalEntities::new(topology, weak_form.triangles(), own));
        let coupling_of = |e: ElementId| {
            if family == ElementFamily::Edge {
                // Gradients have no curl: they couple in conductors alone.
                return Coupling::full(if weak_form.conducts(e) { 4 } else { 2 });
            }
            let decoupled = !weak_form.couples_components(e) && !turned(space.carriers_of(e));
            let potential = if decoupled { Coupling::diagonal(3) } else { Coupling::full(3) };
            if weak_form.conducts(e) { potential.union(with_psi()) } else { potential }
        };
        let rows = match ownership {
            None => unknowns.dofs.clone(),
            Some(ownership) => {
                let owned = |carrier: CarrierId| ownership.owns(space.vertices_of(carrier)[0]);
                DofMap::new(space.carrier_count(), |carrier, c| {
                    owned(carrier) && unknowns.dofs.equation(carrier, c).is_some()
                })
            }
        };
        let (pattern, groups) =
            pattern(&space, (&rows, &unknowns.dofs), local.as_ref(), coupling_of, weak_form);
        let lifted = find_lifted(mesh, &space, &unknowns, weak_form.triangles());
        Ok(Self { space, unknowns, pattern, groups, local, lifted })
    }

    /// The prolongation from a coarse space: linear elements for quadratic ones, joined to aggregates where there are many and the
    /// tolerance is rough; for linear ones ψ in full and aggregates of `A`, by the couplings of `matrix`, with hats
    /// beside them around iron.
    ///
    /// # Errors
    /// As [`Unknowns::new`]; [`SolverError::Parameter`] for first-order edge elements, which have none.
    pub(crate) fn prolongation(
        &self,
        mesh: &Mesh,
        weak_form: &WeakForm,
        boundaries: &[(String, Boundary)],
        (matrix, tolerance): (&CsrMatrix<c64>, f64),
    ) -> Result<CsrMatrix<f64>, SolverError> {
        let conductors = weak_form.conductors();
        if self.space.family() == ElementFamily::Edge {
            if self.space.order() == Order::Linear {
                let expected =
                    "a factor, or an incomplete one: first-order edge elements have no coarse level";
                return Err(SolverError::parameter("linear_solver.method", "two_level", expected));
            }
            let edges = Space::new(mesh.topology(), ElementFamily::Edge, Order::Linear);
            let coarse = Unknowns::new(mesh, &edges, &conductors, boundaries)?;
            return Ok(injection(&coarse, &self.unknowns));
        }
        if self.space.order() == Order::Quadratic {
            let vertices = Space::new(mesh.topology(), ElementFamily::Nodal, Order::Linear);
            let coarse = Unknowns::new(mesh, &vertices, &conductors, boundaries)?;
            let linear = prolongation(&coarse, &self.space, &self.unknowns, ScalarSpace::default());
            let is_joined = tolerance >= ROUGH && linear.structure.column_count >= JOINED_FROM;
            return Ok(if is_joined {
                aggregation::of_linear_functions(linear, components(&coarse), matrix)
            } else {
                linear
            });
        }
        let all: Vec<u32> = (0..self.unknowns.dofs.count() as u32).collect();
        Ok(self.coarse_space(mesh, weak_form, (&all, matrix)).prolongation)
    }

    /// The coarse space of linear nodal elements on the rows of some equations, ascending, by the couplings of their matrix: ψ in full
    /// and aggregates of `A`, with hats around iron.
    fn coarse_space(
        &self,
        mesh: &Mesh,
        weak_form: &WeakForm,
        (rows, matrix): (&[u32], &CsrMatrix<c64>),
    ) -> CoarseSpace {
        let dofs = &self.unknowns.dofs;
        let aggregates = |passes| aggregation::aggregates(dofs, rows, matrix, passes);
        if dofs.count() < hats::UNKNOWNS || weak_form.reluctivity_contrast() < hats::RELUCTIVITY_CONTRAST {
            let aggregates = aggregates(aggregation::PASSES);
            let own = aggregates.count;
            return CoarseSpace {
                prolongation: aggregation::prolongation(aggregates),
                own,
                diagonal_factor: 1.0,
            };
        }
        let nodes = hats::Nodes {
            points: mesh.points(),
            elements: mesh.topology().tets(),
            axes: hats::axes(weak_form.interfaces().map(|t| area_vector(t.map(|n| mesh.point(n))))),
            frame: |node| self.unknowns.frame(node),
        };
        let aggregates = aggregates(aggregation::PASSES_BESIDE_HATS);
        let prolongation = hats::prolongation(dofs, &nodes, (rows, &aggregates));
        CoarseSpace { prolongation, own: aggregates.count, diagonal_factor: hats::DIAGONAL_FACTOR }
    }

    /// The coarse space of the rows of this rank, by the couplings of the matrix that it assembles; linear nodal elements alone have
    /// one.
    pub(crate) fn coarse_space_of(
        &self,
        layout: &RowLayout,
        weak_form: &WeakForm,
        mesh: &Mesh,
    ) -> Option<CoarseSpace> {
        let has_one = (self.space.family(), self.space.order()) == (ElementFamily::Nodal, Order::Linear);
        has_one.then(|| self.coarse_space(mesh, weak_form, (layout.owned(), &self.assemble(weak_form, mesh))))
    }

    /// What the unknowns of quadratic nodal elements are ordered by: the ends of their edges, each component's for itself, for
    /// most do not couple. `None` for all others: of edge elements the factor would be a third larger than by the matrix graph.
    pub(crate) fn hosts(&self) -> Option<Hosts> {
        if (self.space.family(), self.space.order()) != (ElementFamily::Nodal, Order::Quadratic) {
            return None;
        }
        let host = |(carrier, c)| self.space.vertices_of(carrier).map(|v| (4 * v.index() + c) as u32);
        Some(Hosts::new(self.unknowns.dofs.places().map(host).collect()))
    }

    /// Which rows change while some elements move, and with the state, by equation; `None` where none moves.
    pub(crate) fn changes(&self, moving: &[ElementId], weak_form: &WeakForm) -> Option<Vec<bool>> {
        if moving.is_empty() {
            return None;
        }
        let mut changes = vec![false; self.unknowns.dofs.count()];
        for &e in moving.iter().chain(weak_form.elements_with_a_law()) {
            let equations = |&carrier| (0..4).filter_map(move |c| self.unknowns.dofs.equation(carrier, c));
            self.space.carriers_of(e).iter().flat_map(equations).for_each(|row| changes[row] = true);
        }
        Some(changes)
    }

    /// Assembles the matrix, or the rows of this rank, on a mesh with this topology; of B–H laws it has the linear parts.
    pub(crate) fn assemble(&self, weak_form: &WeakForm, mesh: &Mesh) -> CsrMatrix<c64> {
        let mut matrix = CsrMatrix::zeros(self.pattern.structure());
        self.groups.add(self, weak_form, mesh, &mut matrix.values);
        matrix
    }

    /// Adds what the tangents of B–H laws have beyond their linear parts.
    pub(crate) fn add_tangents(&self, tangents: &Tangents, mesh: &Mesh, matrix: &mut CsrMatrix<c64>) {
        self.groups.add_tangents(self, tangents, mesh, &mut matrix.values);
    }

    /// An element of the mesh by its number among those of this rank.
    #[inline]
    fn element(&self, number: ElementId) -> ElementId {
        self.local.as_ref().map_or(number, |local| local.elements[number.index()])
    }

    /// Assembles what takes part of one group, turned into the frames of the nodes where some have their own.
    fn add_group<const N: usize, L: LocalMatrix<c64, N, 4>>(
        &self,
        group: &BoundGroup<N>,
        values: &mut [c64],
        takes_part: impl Fn(ElementId) -> bool + Sync,
        matrix: impl Fn(ElementId) -> L + Sync,
    ) {
        if self.unknowns.has_frames() {
            self.pattern.assemble_where(group, values, takes_part, |e| {
                RotatedMatrix::new(matrix(e), group.carriers_of(e).map(|n| self.unknowns.frame(n)))
            });
        } else {
            self.pattern.assemble_where(group, values, takes_part, matrix);
        }
    }

    /// `f −= K A_prescribed`: what the prescribed part of `A` does to the load.
    pub(crate) fn lift(&self, weak_form: &WeakForm, mesh: &Mesh, load: &mut [c64]) {
        self.groups.subtract_lift(self, weak_form, mesh, load);
    }

    /// What solid conductors add to the matrix on a mesh.
    pub(crate) fn solid_rows(&self, solids: &Solids, weak_form: &WeakForm, mesh: &Mesh) -> SolidRows {
        let times = |e: ElementId, x: &Local| self.groups.conduction_times(self, weak_form, mesh, e, x);
        let scatter = |e: ElementId, local: &Local, load: &mut [c64]| {
            for (&carrier, values) in self.space.carriers_of(e).iter().zip(local.values()) {
                self.unknowns.scatter_add(load, carrier, *values);
            }
        };
        solids.rows(self.unknowns.dofs.count(), times, scatter)
    }

    /// `f −= K A_prescribed` for one element.
    fn subtract_lift<const N: usize>(
        &self,
        carriers: &[CarrierId],
        matrix: &impl LocalMatrix<c64, N, 4>,
        load: &mut [c64],
    ) {
        for (b, &from) in carriers.iter().enumerate() {
            let Some(potential) = self.unknowns.prescribed_at(from) else { continue };
            for (a, &to) in carriers.iter().enumerate() {
                let block = matrix.block(a, b);
                let row = |i: usize| -> c64 { (0..3).map(|j| -block[i][j] * potential[j]).sum() };
                self.unknowns.scatter_add(load, to, [row(0), row(1), row(2), row(PSI)]);
            }
        }
    }
}

/// The pattern of the rows against the columns, and the elements and triangles of this rank bound to it.
fn pattern(
    space: &Space,
    dofs: (&DofMap<4>, &DofMap<4>),
    local: Option<&LocalEntities>,
    coupling_of: impl Fn(ElementId) -> Coupling,
    weak_form: &WeakForm,
) -> (BlockPattern<4>, Box<dyn Bound>) {
    let couplings: Vec<Coupling> = match local {
        None => (0..space.element_count()).map(|e| coupling_of(ElementId::new(e))).collect(),
        Some(local) => local.elements.iter().map(|&e| coupling_of(e)).collect(),
    };
    let face = |(triangle, term)| {
        let components = if matches!(term, SurfaceTerm::Interface(_)) { 3 } else { 4 };
        (space.triangle(triangle), Coupling::full(components))
    };
    let all = weak_form.surface();
    let faces: Vec<(Vec<CarrierId>, Coupling)> = match local {
        None => all.map(face).collect(),
        Some(local) => {
            let all: Vec<_> = all.collect();
            local.triangles.iter().map(|&t| face(all[t])).collect()
        }
    };
    let parts = (dofs, local, couplings, faces.as_slice());
    match (space.carriers(), space.family()) {
        (Carriers::Four(tets), _) => bind(&*family::NODAL_1, tets, parts),
        (Carriers::Six(tets), _) => bind(&*family::EDGE_1, tets, parts),
        (Carriers::Ten(tets), ElementFamily::Nodal) => bind(&*family::NODAL_2, tets, parts),
        (Carriers::Ten(tets), ElementFamily::Edge) => bind(&*family::EDGE_2, tets, parts),
    }
}

/// Rows and columns; the elements and triangles of this rank where there are several; couplings of these elements; carriers
/// and coupling of these triangles.
type Parts<'a> = (
    (&'a DofMap<4>, &'a DofMap<4>),
    Option<&'a LocalEntities>,
    Vec<Coupling>,
    &'a [(Vec<CarrierId>, Coupling)],
);

fn bind<K: Matrices<N, F>, const N: usize, const F: usize>(
    matrices: &'static K,
    tets: &[[CarrierId; N]],
    ((rows, columns), local, couplings, faces): Parts<'_>,
) -> (BlockPattern<4>, Box<dyn Bound>) {
    let count = columns.carrier_count();
    let tets = match local {
        None => tets.to_vec(),
        Some(local) => local.elements.iter().map(|e| tets[e.index()]).collect(),
    };
    let carriers = |face: &(Vec<CarrierId>, Coupling)| -> [CarrierId; F] {
        face.0.as_slice().try_into().expect("a triangle of the same family and order")
    };
    let triangles = faces.iter().map(carriers).collect();
    let volumes = ElementGroup::new(count, tets, couplings);
    let faces = ElementGroup::new(count, triangles, faces.iter().map(|face| face.1).collect());
    let pattern = BlockPattern::of_rows(rows, columns, &volumes, &faces);
    let groups = Groups { matrices, tets: pattern.bind(&volumes), triangles: pattern.bind(&faces) };
    (pattern, Box::new(groups))
}

/// Elements and surface triangles with a carrier whose `A` is prescribed, ascending.
fn find_lifted(
    mesh: &Mesh,
    space: &Space,
    unknowns: &Unknowns,
    triangles: &[[NodeId; 3]],
) -> (Vec<ElementId>, Vec<usize>) {
    let mut prescribed = vec![false; space.carrier_count()];
    for carrier in unknowns.prescribed_carriers() {
        prescribed[carrier.index()] = true;
    }
    let touches = |carriers: &[CarrierId]| carriers.iter().any(|n| prescribed[n.index()]);
    let elements = mesh.topology().elements().filter(|&e| touches(space.carriers_of(e))).collect();
    let triangles = (0..triangles.len()).filter(|&t| touches(&space.triangle(triangles[t]))).collect();
    (elements, triangles)
}

/// ψ with itself and with every component of `A`.
fn with_psi() -> Coupling {
    (0..4).fold(Coupling::NONE, |set, i| set.with(i, PSI).with(PSI, i))
}
