//! The arrays that a design leaves for ParaView (docs/output.md lists them with their units), of the whole mesh or of a
//! part of it.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::io::{ArrayData, Field, VtuPiece, pvtu_text, vtu_bytes};
use fluxmorph_geometry::quality::qualities_of;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId};
use fluxmorph_optimizer::body::Body;
use fluxmorph_optimizer::constraint::Quantity;
use fluxmorph_optimizer::objective::Term;
use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_solver::{FieldModel, FieldSolution, FieldState};
use rayon::prelude::*;

/// What the arrays of a design are made from; a rank has no more of it.
#[derive(Clone, Copy, Debug)]
pub struct FieldData<'a> {
    /// The moved mesh.
    pub mesh: &'a Mesh,
    /// Displacement of every node from the undeformed mesh [m], shape `(n_nodes, 3)`.
    pub displacement: &'a [Point],
    /// dF/dx at the nodes [unit of F per m], shape `(n_nodes, 3)`; `None` is written as zeros.
    pub sensitivity: Option<&'a [Point]>,
    /// Thickness of the designed bodies at their design nodes [m], zero at others, shape `(n_nodes,)`; `None`: no such array.
    pub thickness: Option<&'a [f64]>,
    /// What every element adds to the estimated error of the objective [unit of F], shape `(n_tets,)`; `None`: no such array.
    pub error: Option<&'a [f64]>,
    /// What every element misses of the field quality that is asked for [T], zero in others, shape `(n_tets,)`; `None`: no such
    /// array.
    pub deviation: Option<&'a [f64]>,
    /// One solution per state. For a piece only the potentials at its nodes matter.
    pub solutions: &'a [FieldSolution],
    /// Bodies with the forces at their nodes in the first state, but for those that share a region with one before them; empty: no such
    /// array.
    pub bodies: &'a [Body],
}

impl<'a> FieldData<'a> {
    /// Those of an analysed design, without forces.
    pub fn of(analysis: &'a Analysis) -> Self {
        Self {
            mesh: &analysis.mesh,
            displacement: &analysis.displacement,
            sensitivity: analysis.sensitivity.as_deref(),
            thickness: None,
            error: None,
            deviation: None,
            solutions: &analysis.solutions,
            bodies: &[],
        }
    }
}

/// Thickness of the designed bodies at the nodes of a design [m], where they have one.
pub fn thickness(problem: &Problem, analysis: &Analysis) -> Option<Vec<f64>> {
    let shape = problem.shape()?;
    Some(shape.thickness()?.over_nodes(shape.surface(), &analysis.mesh))
}

/// The functionals of a problem: the terms of its objective, and its constraints of the field.
fn functionals(problem: &Problem) -> impl Iterator<Item = &Term> {
    let of_constraints = problem.constraints().iter().filter_map(|constraint| match &constraint.quantity {
        Quantity::Field(term) => Some(&**term),
        _ => None,
    });
    problem.objective().into_iter().flat_map(|sum| &sum.terms).chain(of_constraints)
}

/// What every element misses of the field quality that the objective or a constraint asks for [T], zero in others; `None` where
/// none does. Of several in one element the first counts, each at its first frequency.
pub fn deviation(problem: &Problem, analysis: &Analysis) -> Option<Vec<f64>> {
    let mut all: Vec<Option<f64>> = vec![None; analysis.mesh.topology().tets().len()];
    for term in functionals(problem) {
        let Some(&state) = term.states.first() else { continue };
        let (model, solution) = (&problem.states()[state], &analysis.solutions[state]);
        for (e, own) in term.functional.deviations((model, &analysis.mesh, solution)) {
            all[e.index()].get_or_insert(own);
        }
    }
    let is_asked_for = all.iter().any(Option::is_some);
    is_asked_for.then(|| all.into_iter().map(Option::unwrap_or_default).collect())
}

/// The VTU file of an analysed design: the moved mesh, potentials, displacement and sensitivity at its nodes; fields,
/// loss, region and quality in its elements.
///
/// Fields of the first state have plain names, those of the others a suffix, their load or frequency: `B_re_200Hz`.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] names an array that is not finite: nothing of it is written.
pub fn vtu(states: &[FieldModel], data: &FieldData<'_>) -> Result<Vec<u8>, MeshError> {
    let topology = data.mesh.topology();
    let (nodes, elements): (Vec<_>, Vec<_>) = (topology.nodes().collect(), topology.elements().collect());
    let arrays = Arrays::new(states, data, &nodes, &elements);
    vtu_bytes(data.mesh, &arrays.at_nodes(), &arrays.in_cells())
}

/// The VTU file of some elements of a design and the nodes that they touch: what [`vtu`] has for them without forces, which take
/// elements of other pieces, and their numbers in the whole mesh.
///
/// # Errors
/// As [`vtu`], for values of the piece.
pub fn piece(
    states: &[FieldModel],
    data: &FieldData<'_>,
    elements: &[ElementId],
) -> Result<Vec<u8>, MeshError> {
    let piece = VtuPiece::new(data.mesh.topology(), elements);
    let arrays = Arrays::new(states, data, piece.nodes(), piece.elements());
    piece.bytes(data.mesh.points(), &arrays.at_nodes(), &arrays.in_cells())
}

/// The text of the PVTU file of pieces that [`piece`] made; their paths are relative to it.
pub fn header(states: &[FieldModel], data: &FieldData<'_>, pieces: &[String]) -> String {
    let arrays = Arrays::new(states, data, &[], &[]);
    pvtu_text(&arrays.at_nodes(), &arrays.in_cells(), pieces)
}

/// The arrays over some nodes and elements.
struct Arrays {
    states: Vec<StateArrays>,
    displacement: Vec<Point>,
    sensitivity: Vec<Point>,
    thickness: Option<Vec<f64>>,
    region: Vec<i32>,
    quality: Vec<f64>,
    error: Option<Vec<f64>>,
    deviation: Option<Vec<f64>>,
    force: Option<Vec<Point>>,
}

impl Arrays {
    fn new(states: &[FieldModel], data: &FieldData<'_>, nodes: &[NodeId], elements: &[ElementId]) -> Self {
        let regions = data.mesh.topology().region_of();
        let at = |values: &[Point]| -> Vec<Point> { nodes.iter().map(|n| values[n.index()]).collect() };
        let in_elements = |all: &[f64]| elements.iter().map(|e| all[e.index()]).collect();
        let force = (!data.bodies.is_empty()).then(|| {
            let mut force = vec![[0.0; 3]; data.mesh.points().len()];
            let mut drawn: Vec<&Body> = Vec::new();
            for body in data.bodies {
                if drawn.iter().all(|own| !own.overlaps(body)) {
                    drawn.push(body);
                }
            }
            let of = |body: &Body| body.nodal((&states[0], data.mesh, &data.solutions[0]));
            for (node, own) in drawn.into_iter().flat_map(of) {
                (0..3).for_each(|d| force[node.index()][d] += own[d]);
            }
            at(&force)
        });
        let states = states.iter().zip(data.solutions).enumerate();
        Self {
            force,
            states: states
                .map(|(index, (model, solution))| {
                    StateArrays::new((model, data.mesh, solution), index, nodes, elements)
                })
                .collect(),
            displacement: at(data.displacement),
            sensitivity: data.sensitivity.map_or_else(|| vec![[0.0; 3]; nodes.len()], at),
            thickness: data.thickness.map(|all| nodes.iter().map(|n| all[n.index()]).collect()),
            region: elements.iter().map(|e| regions[e.index()].0 as i32).collect(),
            quality: qualities_of(data.mesh, elements),
            error: data.error.map(in_elements),
            deviation: data.deviation.map(in_elements),
        }
    }

    fn at_nodes(&self) -> Vec<Field<'_>> {
        let (first, others) = self.states.split_first().expect("a problem has a state");
        let mut fields: Vec<Field<'_>> = first.at_nodes().into();
        fields.push(Field { name: "displacement", data: ArrayData::Vector(&self.displacement) });
        fields.push(Field { name: "sensitivity", data: ArrayData::Vector(&self.sensitivity) });
        let thickness = self.thickness.as_ref();
        fields.extend(thickness.map(|values| Field { name: "thickness", data: ArrayData::Scalar(values) }));
        let force = self.force.as_ref();
        fields.extend(force.map(|force| Field { name: "force", data: ArrayData::Vector(force) }));
        fields.extend(others.iter().flat_map(StateArrays::at_nodes));
        fields
    }

    fn in_cells(&self) -> Vec<Field<'_>> {
        let (first, others) = self.states.split_first().expect("a problem has a state");
        let mut fields: Vec<Field<'_>> = first.in_cells().into();
        fields.push(Field { name: "region", data: ArrayData::Integer(&self.region) });
        fields.push(Field { name: "quality", data: ArrayData::Scalar(&self.quality) });
        let error = self.error.as_ref();
        fields.extend(error.map(|error| Field { name: "error_estimate", data: ArrayData::Scalar(error) }));
        let deviation = self.deviation.as_ref();
        fields.extend(deviation.map(|own| Field { name: "deviation", data: ArrayData::Scalar(own) }));
        fields.extend(others.iter().flat_map(StateArrays::in_cells));
        fields
    }
}

/// Names of the arrays of one state, in the order of [`StateArrays`].
const NODE_ARRAYS: [&str; 4] = ["A_re", "A_im", "psi_re", "psi_im"];
const CELL_ARRAYS: [&str; 6] = ["B_re", "B_im", "B_abs", "J_re", "J_im", "loss_density"];

/// The arrays of one state.
struct StateArrays {
    node_names: [String; 4],
    cell_names: [String; 6],
    a: [Vec<Point>; 2],
    psi: [Vec<f64>; 2],
    b: [Vec<Point>; 2],
    b_abs: Vec<f64>,
    j: [Vec<Point>; 2],
    loss: Vec<f64>,
}

impl StateArrays {
    fn new(
        (model, mesh, solution): FieldState<'_>,
        index: usize,
        nodes: &[NodeId],
        elements: &[ElementId],
    ) -> Self {
        let potentials = solution.nodal_potentials(model, mesh, nodes);
        let a: Vec<[c64; 3]> = potentials.par_iter().map(|p| [p[0], p[1], p[2]]).collect();
        let b = parts(&solution.flux_densities_of(model, mesh, elements));
        let magnitude = |(re, im): (&Point, &Point)| re.iter().chain(im).map(|c| c * c).sum::<f64>().sqrt();
        let b_abs = b[0].par_iter().zip(&b[1]).map(magnitude).collect();
        let suffix = match index {
            0 => String::new(),
            _ => format!("_{}", model.label()),
        };
        Self {
            node_names: NODE_ARRAYS.map(|name| format!("{name}{suffix}")),
            cell_names: CELL_ARRAYS.map(|name| format!("{name}{suffix}")),
            a: parts(&a),
            psi: [potentials.iter().map(|p| p[3].re).collect(), potentials.iter().map(|p| p[3].im).collect()],
            b,
            b_abs,
            j: parts(&solution.current_densities_of(model, mesh, elements)),
            loss: solution.loss_densities_of(model, mesh, elements),
        }
    }

    fn at_nodes(&self) -> [Field<'_>; 4] {
        let data = [
            ArrayData::Vector(&self.a[0]),
            ArrayData::Vector(&self.a[1]),
            ArrayData::Scalar(&self.psi[0]),
            ArrayData::Scalar(&self.psi[1]),
        ];
        let mut names = self.node_names.iter();
        data.map(|data| Field { name: names.next().map_or("", String::as_str), data })
    }

    fn in_cells(&self) -> [Field<'_>; 6] {
        let data = [
            ArrayData::Vector(&self.b[0]),
            ArrayData::Vector(&self.b[1]),
            ArrayData::Scalar(&self.b_abs),
            ArrayData::Vector(&self.j[0]),
            ArrayData::Vector(&self.j[1]),
            ArrayData::Scalar(&self.loss),
        ];
        let mut names = self.cell_names.iter();
        data.map(|data| Field { name: names.next().map_or("", String::as_str), data })
    }
}

/// Real and imaginary parts.
fn parts(values: &[[c64; 3]]) -> [Vec<Point>; 2] {
    [|c: c64| c.re, |c: c64| c.im].map(|part| values.par_iter().map(|v| v.map(part)).collect())
}
