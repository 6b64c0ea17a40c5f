//! The unknowns of linear elements seen as unknowns of quadratic ones on the same mesh: `x₂ = P x₁`.
//!
//! A linear function is quadratic, with the mean of its ends at the middle of an edge. Components that a condition fixes on
//! either side have no column or no row; where nodes have frames of their own, components are turned from one to the other.
//! With conditions on planes the linear space is a subspace of the quadratic one, and `Pᵀ K₂ P` is the linear matrix; on a
//! conditioned curved surface the frames of vertices and midpoints differ, and it nearly is.

use std::sync::Arc;

use fluxmorph_geometry::CarrierId;
use fluxmorph_geometry::directions::Frame;
use fluxmorph_geometry::fem::CsrMatrix;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::tet4::dot;

use crate::space::Space;
use crate::unknowns::{PSI, Unknowns};

/// Cosine below which two directions count as at right angles: the rounding of unit vectors.
const RIGHT_ANGLE: f64 = 1e-14;

/// What the coarse space has of the scalar potential.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScalarSpace {
    /// Linear functions: the coarse space is that of the linear elements.
    Linear,
    /// All quadratic functions. Default: gradients of quadratic functions are linear, so that the coarse space holds fields
    /// `(A, ψ) = (∇χ, −χ)`, which carry no current. With linear ψ it does not, and a conductor thicker than the skin
    /// depth takes half as many iterations more.
    #[default]
    Quadratic,
}

/// The prolongation from unknowns on the vertices to those of a space on the same topology; shape
/// `(fine.dofs.count(), n_coarse)`. The columns are the unknowns `coarse`; with [`ScalarSpace::Quadratic`] their components
/// of `A`, in the same order, and then those of `ψ` of `fine`.
pub fn prolongation(
    coarse: &Unknowns,
    space: &Space,
    fine: &Unknowns,
    scalar: ScalarSpace,
) -> CsrMatrix<f64> {
    let Columns { number, mut count } = Columns::new(coarse, scalar);
    let axes = |unknowns: &Unknowns, node| unknowns.frame(node).map_or(Frame::COORDINATES.axes, |f| f.axes);
    let mut row_starts = vec![0u32];
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    let mut row: Vec<(u32, f64)> = Vec::new();
    for node in (0..space.carrier_count()).map(CarrierId::new) {
        let ends = space.vertices_of(node);
        let (ends, weight) = if ends[0] == ends[1] { (&ends[..1], 1.0) } else { (&ends[..], 0.5) };
        let own = axes(fine, node);
        for c in (0..4).filter(|&c| fine.dofs.equation(node, c).is_some()) {
            row.clear();
            if c == PSI && scalar == ScalarSpace::Quadratic {
                row.push((count, 1.0));
                count += 1;
            } else if c == PSI {
                let potentials = ends.iter().filter_map(|&end| coarse.dofs.equation(end, PSI));
                row.extend(potentials.map(|equation| (number[equation], weight)));
            } else {
                for &end in ends {
                    let others = axes(coarse, end.into());
                    let unknown = |&d: &usize| coarse.dofs.equation(end, d).is_some();
                    for d in (0..3).filter(unknown) {
                        let cosine = dot(own[c], others[d]);
                        let equation = coarse.dofs.equation(end, d).filter(|_| cosine.abs() > RIGHT_ANGLE);
                        row.extend(equation.map(|equation| (number[equation], weight * cosine)));
                    }
                }
            }
            row.sort_unstable_by_key(|entry| entry.0);
            columns.extend(row.iter().map(|entry| entry.0));
            values.extend(row.iter().map(|entry| entry.1));
            row_starts.push(columns.len() as u32);
        }
    }
    let structure = CsrStructure { column_count: count as usize, row_starts, columns };
    CsrMatrix { structure: Arc::new(structure), values }
}

/// The components of `A` of the columns of [`prolongation`] with [`ScalarSpace::Quadratic`], without those of `ψ`, which follow.
pub(crate) fn components(coarse: &Unknowns) -> Vec<usize> {
    coarse.dofs.places().map(|place| place.1).filter(|&c| c != PSI).collect()
}

/// The unknowns of first-order edge elements as unknowns of second-order ones, whose functions they are too; shape
/// `(fine.dofs.count(), coarse.dofs.count())`.
pub fn injection(coarse: &Unknowns, fine: &Unknowns) -> CsrMatrix<f64> {
    let equations = |unknowns: &Unknowns, carrier: usize| -> [Option<usize>; 4] {
        let is_carrier = carrier < unknowns.dofs.carrier_count();
        std::array::from_fn(|c| is_carrier.then(|| unknowns.dofs.equation(CarrierId::new(carrier), c))?)
    };
    let rows = (0..fine.dofs.carrier_count()).flat_map(|carrier| {
        let pairs = equations(fine, carrier).into_iter().zip(equations(coarse, carrier));
        pairs.filter_map(|(row, column)| row.map(|_| column.map(|c| (c, 1.0)).into_iter().collect()))
    });
    CsrMatrix::from_rows(coarse.dofs.count(), rows.collect::<Vec<_>>())
}

/// Column of every unknown on the vertices.
struct Columns {
    number: Vec<u32>,
    count: u32,
}

impl Columns {
    fn new(coarse: &Unknowns, scalar: ScalarSpace) -> Self {
        let mut number = vec![u32::MAX; coarse.dofs.count()];
        let mut count = 0;
        for node in (0..coarse.dofs.carrier_count()).map(CarrierId::new) {
            for c in (0..4).filter(|&c| c != PSI || scalar == ScalarSpace::Linear) {
                if let Some(equation) = coarse.dofs.equation(node, c) {
                    number[equation] = count;
                    count += 1;
                }
            }
        }
        Self { number, count }
    }
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::Mesh;
    use fluxmorph_geometry::fem::c64;
    use fluxmorph_geometry::generate::{ShieldParameters, SphereParameters, shield, sphere};

    use super::*;
    use crate::boundary::Boundary;
    use crate::elements::{ElementFamily, Order};
    use crate::linear::aggregation;
    use crate::linear::transfer::Transfer;
    use crate::material::Material;
    use crate::model::FieldModel;
    use crate::setup::FieldModelSetup;
    use crate::unknowns::Conductors;

    fn unknowns(
        mesh: &Mesh,
        order: Order,
        conductors: &Conductors,
        boundaries: &[(String, Boundary)],
    ) -> (Space, Unknowns) {
        let space = Space::new(mesh.topology(), ElementFamily::Nodal, order);
        let unknowns = Unknowns::new(mesh, &space, conductors, boundaries).expect("conditions that agree");
        (space, unknowns)
    }

    /// An octant of a conducting ball: planes, a curved surface, ψ inside. The prolonged field is the mean of the ends in
    /// every direction that is free.
    #[test]
    fn midpoints_get_the_mean_of_their_ends_in_free_directions() {
        let parameters = SphereParameters { divisions: 3, ..SphereParameters::default() };
        let mesh = sphere(&parameters).expect("a sphere");
        let topology = mesh.topology();
        let elements = topology.elements_of(topology.region("sphere").expect("its region"));
        let conductors = Conductors { elements, ..Conductors::default() };
        let of = |(surface, boundary): (&str, Boundary)| (surface.to_owned(), boundary);
        let boundaries = [
            ("x_min", Boundary::FluxParallel),
            ("y_min", Boundary::FluxParallel),
            ("z_min", Boundary::FluxNormal),
            ("outer", Boundary::FluxParallel),
        ]
        .map(of);
        let (_, coarse) = unknowns(&mesh, Order::Linear, &conductors, &boundaries);
        let (space, fine) = unknowns(&mesh, Order::Quadratic, &conductors, &boundaries);
        assert!(fine.has_frames() && coarse.has_frames());
        let p = prolongation(&coarse, &space, &fine, ScalarSpace::Linear);
        let x: Vec<c64> = (0..coarse.dofs.count()).map(|i| c64::new((0.7 * i as f64).sin(), 0.1)).collect();
        let mut y = vec![c64::default(); fine.dofs.count()];
        Transfer::new(p).add_prolongation(&x, &mut y);
        for node in (0..space.carrier_count()).map(CarrierId::new) {
            let [a, b] = space.vertices_of(node).map(|end| coarse.gather(&x, end.into()));
            let mean: [c64; 4] = std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
            let field = fine.gather(&y, node);
            let axes = fine.frame(node).map_or(Frame::COORDINATES.axes, |frame| frame.axes);
            for (k, axis) in axes.into_iter().enumerate() {
                let along = |v: [c64; 4]| (0..3).map(|d| v[d] * axis[d]).sum::<c64>();
                let expected =
                    if fine.dofs.equation(node, k).is_some() { along(mean) } else { c64::default() };
                assert!((along(field) - expected).norm() < 1e-13, "{node:?} direction {k}");
            }
            if fine.dofs.equation(node, PSI).is_some() {
                assert!((field[PSI] - mean[PSI]).norm() < 1e-15);
            }
        }
    }

    fn coarse_shield() -> Mesh {
        let parameters = ShieldParameters {
            refinement: 0.25,
            skin: vec![1e-3],
            side_skin: Vec::new(),
            ..ShieldParameters::default()
        };
        shield(&parameters).expect("a coarse shield")
    }

    fn model(mesh: &Mesh, order: Order) -> FieldModel {
        let steel = Material { relative_permeability: 800.0, conductivity: 7e6 };
        let names = mesh.topology().region_names();
        let setup = FieldModelSetup {
            family: ElementFamily::Nodal,
            frequency: 60.0,
            order,
            materials: names.iter().map(|n| if n == "plate" { steel } else { Material::AIR }).collect(),
            boundaries: ["x_min", "y_min", "z_max"]
                .map(|surface| (surface.to_owned(), Boundary::FluxParallel))
                .to_vec(),
            ..FieldModelSetup::default()
        };
        FieldModel::new(mesh, setup).expect("a sound problem")
    }

    /// Linear functions that are joined are so within their component: a field whose components are constant stays one.
    #[test]
    fn joined_functions_hold_what_is_constant_in_a_component() {
        let mesh = coarse_shield();
        let (linear, quadratic) = (model(&mesh, Order::Linear), model(&mesh, Order::Quadratic));
        let coarse = linear.unknowns();
        let p = prolongation(coarse, quadratic.space(), quadratic.unknowns(), ScalarSpace::Quadratic);
        let components = components(coarse);
        let of_a = components.len();
        let joined =
            aggregation::of_linear_functions(p.clone(), components.clone(), &quadratic.assemble(&mesh));
        let (before, after) = (p.structure.column_count, joined.structure.column_count);
        // Four an aggregate, but for what finds no partner; ψ in full.
        assert!(after - (before - of_a) < of_a / 3, "{after} of {before}, {of_a} of them of A");
        for row in 0..p.structure.row_count() {
            let sum = |p: &CsrMatrix<f64>| p.values[p.structure.row(row)].iter().sum::<f64>();
            assert_eq!(sum(&p), sum(&joined), "row {row}");
        }
        let mut component_of = vec![None; after];
        for row in 0..p.structure.row_count() {
            let own = p.structure.columns[p.structure.row(row)].iter().map(|&c| components.get(c as usize));
            let Some(own) = own.reduce(|a, b| if a == b { a } else { None }) else { continue };
            for k in joined.structure.row(row) {
                let known = component_of[joined.structure.columns[k] as usize].get_or_insert(own);
                assert_eq!(*known, own, "row {row}");
            }
        }
    }

    /// With conditions on planes the linear space is a subspace of the quadratic one.
    #[test]
    fn the_galerkin_product_is_the_matrix_of_linear_elements() {
        let mesh = coarse_shield();
        let (linear, quadratic) = (model(&mesh, Order::Linear), model(&mesh, Order::Quadratic));
        let (space, fine) = (quadratic.space(), quadratic.unknowns());
        let transfer = Transfer::new(prolongation(linear.unknowns(), space, fine, ScalarSpace::Linear));
        let matrix = quadratic.assemble(&mesh);
        let product = transfer.coarse_matrix(&transfer.coarse_structure(&matrix.structure), &matrix);
        let expected = linear.assemble(&mesh);
        for row in 0..expected.structure.row_count() {
            let diagonal = |i: usize| expected.entry(i, i).expect("it is stored").norm();
            for k in product.structure.row(row) {
                let column = product.structure.columns[k] as usize;
                let value = expected.entry(row, column).unwrap_or_default();
                // Sums of some hundred terms of the size of the diagonals.
                let scale = (diagonal(row) * diagonal(column)).sqrt();
                let error = (product.values[k] - value).norm();
                assert!(error < 1e-11 * scale, "({row}, {column}): {error:e} of {scale:e}");
            }
        }
    }
}
