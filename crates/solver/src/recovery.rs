//! Flux density at points: the curl of a polynomial fitted to the potentials around.
//!
//! `B` of linear elements is constant in each and of first order. The potentials at the nodes are of second order, so
//! the curl of a quadratic fitted to them (of quadratic elements: of a cubic) is better by one order where the mesh is
//! regular, and it stays so beside a
//! symmetry plane or a material's face, where all elements lie on one side and a mean of their `B` would not
//! (polynomial-preserving recovery; Zhang and Naga, SIAM J. Sci. Comput. 26 (2005) 1192). Across a material boundary
//! the true field jumps, so only elements of the probed element's material take part.
//!
//! Edge elements have no potentials at nodes, and their gauge leaves `A` rough: there a polynomial is fitted to `B` itself at
//! the points of elements where it is best (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 33 (1992) 1331).

use std::collections::BTreeSet;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::{Point, sub};
use fluxmorph_geometry::{CarrierId, ElementId, Mesh};
use rayon::prelude::*;

use crate::element::Complex3;
use crate::element::quadrature::Node;
use crate::element::tabulated::Rule;
use crate::element::volume::curl;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldSolution;
use crate::space::{ElementFamily, Order};

/// Layers of elements around the probed one after which no fit is tried.
const LAYERS_LIMIT: usize = 3;

/// Exponents of `x, y, z` in the monomials up to a degree: the constant, the coordinates, then the higher ones.
fn monomials(degree: usize) -> Vec<[i32; 3]> {
    let mut exponents: Vec<[i32; 3]> = Vec::new();
    for total in 0..=degree as i32 {
        for i in (0..=total).rev() {
            for j in (0..=total - i).rev() {
                exponents.push([i, j, total - i - j]);
            }
        }
    }
    exponents
}

/// The part of a monomial that the others do not already contain, relative to it, below which the nodes do not
/// determine its coefficient: nodes in two parallel planes, for instance, leave one square open.
const DEPENDENT: f64 = 1e-3;

/// The recovered flux density [T] at a point of an element.
///
/// `A` at the nodes of all elements that share a vertex with `element` and have its material, fitted by least squares with a
/// polynomial of one degree more than that of the elements; of edge elements `B` in them, with one of their degree. A further
/// layer of elements where these do not determine it.
/// In a part of the material too small for any fit, the element's own mean.
pub fn recovered_flux_density(
    solution: &FieldSolution,
    model: &FieldModel,
    mesh: &Mesh,
    element: ElementId,
    point: Point,
) -> Complex3 {
    let topology = model.topology();
    // A magnet's face is one even where its permeability is that of air, and that of open space is one of the map.
    let material = |e: ElementId| {
        let linear = model.materials()[topology.region_of()[e.index()].index()];
        let is_open = model.form().stretch_of(e).is_some();
        (linear, model.remanence_of(e), model.curve_of(e), is_open)
    };
    let mut elements = BTreeSet::from([element]);
    for _ in 0..LAYERS_LIMIT {
        elements = elements
            .iter()
            .flat_map(|&e| topology.tet(e))
            .flat_map(|n| topology.elements_around(n))
            .copied()
            .filter(|&e| material(e) == material(element))
            .collect();
        let fitted = match model.space().family() {
            ElementFamily::Nodal => fitted_curl(solution, model, mesh, &elements, point),
            ElementFamily::Edge => fitted_flux_density(solution, model, mesh, &elements, point),
        };
        if let Some(flux_density) = fitted {
            return flux_density;
        }
    }
    solution.flux_density(model, mesh, element)
}

/// The curl at a point of the polynomial fitted to the potentials at the nodes of some elements.
fn fitted_curl(
    solution: &FieldSolution,
    model: &FieldModel,
    mesh: &Mesh,
    elements: &BTreeSet<ElementId>,
    point: Point,
) -> Option<Complex3> {
    let space = model.space();
    let nodes: BTreeSet<CarrierId> = elements.iter().flat_map(|&e| space.carriers_of(e)).copied().collect();
    let offsets: Vec<Point> = nodes.iter().map(|&n| sub(space.position(mesh, n), point)).collect();
    let potential = |&n: &CarrierId| {
        let [x, y, z, _] = solution.potentials(model, n);
        [x, y, z]
    };
    let values: Vec<Complex3> = nodes.iter().map(potential).collect();
    Some(curl(&fit(space.order().degree() + 1, &offsets, &values)?.gradient))
}

/// The value at a point of the polynomial fitted to the flux densities in some elements, taken where they are of one order
/// better: at the centroid, or at the four points of the rule of degree 2.
fn fitted_flux_density(
    solution: &FieldSolution,
    model: &FieldModel,
    mesh: &Mesh,
    elements: &BTreeSet<ElementId>,
    point: Point,
) -> Option<Complex3> {
    let order = model.space().order();
    let rule: &[Node] = match order {
        Order::Linear => Rule::Centroid.nodes(),
        Order::Quadratic => Rule::Degree2.nodes(),
    };
    let samples = || elements.iter().flat_map(|&e| rule.iter().map(move |(lambda, _)| (e, lambda)));
    let place = |(e, lambda): (ElementId, &[f64; 4])| -> Point {
        let vertices = mesh.vertices(e);
        std::array::from_fn(|d| (0..4).map(|a| lambda[a] * vertices[a][d]).sum::<f64>() - point[d])
    };
    let offsets: Vec<Point> = samples().map(place).collect();
    let values: Vec<Complex3> =
        samples().map(|(e, lambda)| solution.at(model, mesh, e, lambda).flux_density).collect();
    Some(fit(order.degree(), &offsets, &values)?.value)
}

/// A fitted polynomial at the origin.
struct Fit {
    value: Complex3,
    /// `∂_d A_j`, index `[d][j]`.
    gradient: [Complex3; 3],
}

/// The polynomial of a degree fitted to values at points, at the origin.
///
/// The least-squares problem is solved by orthogonal factorisation of its matrix (modified Gram–Schmidt), coordinates
/// scaled to the extent of the points in each direction; the weight `exp(−|ξ|²)` in these coordinates lets the nearest
/// nodes count most. `None` where the points do not determine the polynomial.
fn fit(degree: usize, points: &[Point], values: &[Complex3]) -> Option<Fit> {
    let monomials = monomials(degree);
    let terms = monomials.len();
    if points.len() < terms {
        return None;
    }
    let scale: Point = std::array::from_fn(|d| points.iter().map(|p| p[d].abs()).fold(0.0, f64::max));
    let mut columns = vec![Vec::with_capacity(points.len()); terms];
    let mut rest = Vec::with_capacity(points.len());
    for (p, value) in points.iter().zip(values) {
        let [x, y, z]: Point = std::array::from_fn(|d| p[d] / scale[d]);
        let weight = (-(x * x + y * y + z * z)).exp();
        for (column, &[i, j, k]) in columns.iter_mut().zip(&monomials) {
            column.push(weight * x.powi(i) * y.powi(j) * z.powi(k));
        }
        rest.push(value.map(|v| weight * v));
    }
    let product = |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
    let mut upper = vec![vec![0.0; terms]; terms];
    let mut right = vec![[c64::default(); 3]; terms];
    for k in 0..terms {
        let (done, open) = columns.split_at_mut(k);
        let column = &mut open[0];
        let before = product(column, column).sqrt();
        for (i, q) in done.iter().enumerate() {
            upper[i][k] = product(q, column);
            for (c, q) in column.iter_mut().zip(q) {
                *c -= upper[i][k] * q;
            }
        }
        let length = product(column, column).sqrt();
        // A direction without extent makes the length not a number.
        if length.is_nan() || length <= DEPENDENT * before {
            return None;
        }
        upper[k][k] = length;
        for c in column.iter_mut() {
            *c /= length;
        }
        for d in 0..3 {
            right[k][d] = column.iter().zip(&rest).map(|(q, v)| v[d] * *q).sum();
            for (v, q) in rest.iter_mut().zip(column.iter()) {
                v[d] -= right[k][d] * *q;
            }
        }
    }
    for k in (0..terms).rev() {
        for d in 0..3 {
            for later in k + 1..terms {
                let known = right[later][d];
                right[k][d] -= upper[k][later] * known;
            }
            right[k][d] /= upper[k][k];
        }
    }
    let gradient = std::array::from_fn(|d| right[1 + d].map(|c| c / scale[d]));
    Some(Fit { value: right[0], gradient })
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
    let outside = |point: Point| {
        let [lower, upper] = mesh.bounding_box();
        SolverError::ProbeOutside { probe: name.to_owned(), point, lower, upper }
    };
    let located = locate(mesh, points).into_iter().zip(points);
    let elements = located
        .map(|(found, &point)| found.map(|(e, _)| (e, point)).ok_or_else(|| outside(point)))
        .collect::<Result<Vec<(ElementId, Point)>, _>>()?;
    Ok(elements
        .into_par_iter()
        .map(|(e, point)| recovered_flux_density(solution, model, mesh, e, point))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(lines: [usize; 3]) -> Vec<Point> {
        let mut points = Vec::new();
        for i in 0..lines[0] {
            for j in 0..lines[1] {
                points.extend((0..lines[2]).map(|k| [0.01 * i as f64, 0.3 * j as f64, 1e-4 * k as f64]));
            }
        }
        points
    }

    #[test]
    fn the_gradient_of_a_quadratic_is_exact_at_the_corner_of_its_points() {
        let field = |[x, y, z]: Point| -> Complex3 {
            let quadratic =
                |a: f64| 0.4 + a * x - y + 70.0 * z + 3.0 * x * y - a * z * z + 9.0 * y * z + x * x;
            [c64::from(quadratic(2.0)), c64::new(0.0, quadratic(-5.0)), c64::default()]
        };
        let points = grid([3, 3, 3]);
        let values: Vec<Complex3> = points.iter().map(|&p| field(p)).collect();
        let gradient = fit(2, &points, &values).expect("27 points determine a quadratic").gradient;
        let exact = [[2.0, -5.0], [-1.0, -1.0], [70.0, 70.0]];
        for d in 0..3 {
            // Values of order 1 on a patch of 0.2 mm: rounding of 1e-16 / 2e-4, a hundredfold.
            assert!((gradient[d][0] - exact[d][0]).norm() < 1e-10);
            assert!((gradient[d][1] - c64::new(0.0, exact[d][1])).norm() < 1e-10);
        }
    }

    #[test]
    fn points_that_leave_a_coefficient_open_are_refused() {
        let constant = |n: usize| vec![[c64::from(1.0); 3]; n];
        for lines in [[3, 3, 2], [3, 3, 1], [9, 2, 1]] {
            let points = grid(lines);
            assert!(fit(2, &points, &constant(points.len())).is_none(), "{lines:?}");
        }
    }
}
