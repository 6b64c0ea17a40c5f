//! Flux density at points: element values averaged to the nodes within one material, then interpolated.
//!
//! `B` of linear elements is constant in each and jumps between them; the volume-weighted mean at a node is one order
//! better inside a material. Across a material boundary the true field jumps, so only elements of the probed
//! element's material take part.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4, dot, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use rayon::prelude::*;

use crate::element::Complex3;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldSolution;

/// How far outside a tet, in barycentric coordinates, a point still counts as inside: rounding of a shared face.
const INSIDE_TOLERANCE: f64 = -1e-9;

/// The element that holds a point, and the point's barycentric coordinates in it; the first of several.
pub fn locate(mesh: &Mesh, point: Point) -> Option<(ElementId, [f64; 4])> {
    let elements = mesh.topology().tets().len();
    let coordinates = |e: ElementId| {
        let vertices = mesh.vertices(e);
        let tet = Tet4::new(vertices);
        let offset = sub(point, vertices[0]);
        let mut bary = tet.gradients.map(|g| dot(g, offset));
        bary[0] += 1.0;
        bary
    };
    (0..elements)
        .into_par_iter()
        .map(ElementId::new)
        .find_first(|&e| coordinates(e).iter().all(|&b| b >= INSIDE_TOLERANCE))
        .map(|e| (e, coordinates(e)))
}

/// The recovered flux density [T] at a node, from the elements around it with the material of `like`.
pub fn nodal_flux_density(
    solution: &FieldSolution,
    model: &FieldModel,
    mesh: &Mesh,
    node: NodeId,
    like: ElementId,
) -> Complex3 {
    let topology = model.topology();
    let material = |e: ElementId| model.materials()[topology.region_of()[e.index()].index()];
    let mut sum = [c64::default(); 3];
    let mut volume = 0.0;
    for &e in topology.elements_around(node).iter().filter(|&&e| material(e) == material(like)) {
        let v = Tet4::new(mesh.vertices(e)).volume;
        let b = solution.flux_density(model, mesh, e);
        volume += v;
        for d in 0..3 {
            sum[d] += v * b[d];
        }
    }
    sum.map(|s| s / volume)
}

/// The recovered flux density [T] at the points of a probe.
///
/// # Errors
/// [`SolverError::ProbeOutside`] for the first point that no element holds.
pub fn probe(
    solution: &FieldSolution,
    model: &FieldModel,
    mesh: &Mesh,
    name: &str,
    points: &[Point],
) -> Result<Vec<Complex3>, SolverError> {
    points
        .iter()
        .map(|&point| {
            let (e, bary) = locate(mesh, point).ok_or_else(|| {
                let [lower, upper] = mesh.bounding_box();
                SolverError::ProbeOutside { probe: name.to_owned(), point, lower, upper }
            })?;
            let mut b = [c64::default(); 3];
            for (node, weight) in model.topology().tet(e).into_iter().zip(bary) {
                let nodal = nodal_flux_density(solution, model, mesh, node, e);
                for d in 0..3 {
                    b[d] += weight * nodal[d];
                }
            }
            Ok(b)
        })
        .collect()
}
