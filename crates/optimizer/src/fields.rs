//! The arrays that a design leaves for ParaView (docs/configuration.md lists them with their units).

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::io::{ArrayData, Field, vtu_bytes};
use fluxmorph_geometry::quality::qualities;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, MeshError, NodeId};
use fluxmorph_solver::{FieldModel, FieldSolution};
use rayon::prelude::*;

use crate::problem::{Analysis, Problem};

/// The VTU file of an analysed design: the moved mesh, potentials, displacement and sensitivity at its nodes; fields,
/// loss, region and quality in its elements.
///
/// Fields of the first frequency have plain names, those of the others a suffix: `B_re_200Hz`.
///
/// # Errors
/// [`MeshError::NotFiniteArray`] names an array that is not finite: nothing of it is written.
pub fn vtu(problem: &Problem, analysis: &Analysis) -> Result<Vec<u8>, MeshError> {
    let mesh = &analysis.mesh;
    let states: Vec<StateArrays> = (0..problem.states.len())
        .map(|index| StateArrays::new(&problem.states[index], &analysis.solutions[index], mesh, index))
        .collect();
    let zeros;
    let sensitivity = match &analysis.sensitivity {
        Some(sensitivity) => sensitivity,
        None => {
            zeros = vec![[0.0; 3]; mesh.points().len()];
            &zeros
        }
    };
    let region: Vec<i32> = mesh.topology().region_of().iter().map(|r| r.0 as i32).collect();
    let quality = qualities(mesh);
    let (first, others) = states.split_first().expect("a problem has a state");
    let mut at_nodes: Vec<Field<'_>> = first.at_nodes().into();
    at_nodes.push(Field { name: "displacement", data: ArrayData::Vector(&analysis.displacement) });
    at_nodes.push(Field { name: "sensitivity", data: ArrayData::Vector(sensitivity) });
    let mut in_cells: Vec<Field<'_>> = first.in_cells().into();
    in_cells.push(Field { name: "region", data: ArrayData::Integer(&region) });
    in_cells.push(Field { name: "quality", data: ArrayData::Scalar(&quality) });
    for state in others {
        at_nodes.extend(state.at_nodes());
        in_cells.extend(state.in_cells());
    }
    vtu_bytes(mesh, &at_nodes, &in_cells)
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
    fn new(model: &FieldModel, solution: &FieldSolution, mesh: &Mesh, index: usize) -> Self {
        let potentials: Vec<[c64; 4]> = (0..mesh.points().len())
            .into_par_iter()
            .map(|i| solution.potentials(model, NodeId::new(i)))
            .collect();
        let a: Vec<[c64; 3]> = potentials.par_iter().map(|p| [p[0], p[1], p[2]]).collect();
        let b = parts(&solution.flux_densities(model, mesh));
        let magnitude = |(re, im): (&Point, &Point)| re.iter().chain(im).map(|c| c * c).sum::<f64>().sqrt();
        let b_abs = b[0].par_iter().zip(&b[1]).map(magnitude).collect();
        let suffix = match index {
            0 => String::new(),
            _ => suffix(model.angular_frequency()),
        };
        Self {
            node_names: NODE_ARRAYS.map(|name| format!("{name}{suffix}")),
            cell_names: CELL_ARRAYS.map(|name| format!("{name}{suffix}")),
            a: parts(&a),
            psi: [potentials.iter().map(|p| p[3].re).collect(), potentials.iter().map(|p| p[3].im).collect()],
            b,
            b_abs,
            j: parts(&solution.current_densities(model, mesh)),
            loss: solution.loss_densities(model, mesh),
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

/// `_200Hz`; to a microhertz, and without a point, which ParaView's calculator takes for an operator.
fn suffix(angular_frequency: f64) -> String {
    let hertz = (angular_frequency / (2.0 * std::f64::consts::PI) * 1e6).round() / 1e6;
    format!("_{hertz}Hz").replace('.', "_")
}

/// Real and imaginary parts.
fn parts(values: &[[c64; 3]]) -> [Vec<Point>; 2] {
    [|c: c64| c.re, |c: c64| c.im].map(|part| values.par_iter().map(|v| v.map(part)).collect())
}

#[cfg(test)]
mod tests {
    use super::suffix;

    #[test]
    fn the_suffix_of_a_frequency_can_stand_in_a_name() {
        let of = |hertz: f64| suffix(2.0 * std::f64::consts::PI * hertz);
        assert_eq!(
            (of(200.0), of(0.5), of(16.7)),
            ("_200Hz".to_owned(), "_0_5Hz".to_owned(), "_16_7Hz".to_owned())
        );
    }
}
