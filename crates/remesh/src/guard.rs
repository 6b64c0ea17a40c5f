//! How far a motion may go: the exact step to the first inverted element, and the guard of a move.
//!
//! Along `x + s Δx` the volume of a tetrahedron is a cubic in `s`. With the edges `e_i` from vertex 0 and their changes
//! `u_i`, `6 V(s) = (e_1 + s u_1) · (e_2 + s u_2) × (e_3 + s u_3) = c_0 + c_1 s + c_2 s² + c_3 s³`, `c_0 > 0`. With
//! `t = 1/s` the first inversion is the *largest* root of `t³ + (c_1 t² + c_2 t + c_3)/c_0`, which is bounded, and is
//! bracketed by the critical points of that cubic: no scanning, no step size.

use fluxmorph_geometry::tet4::{Point, cross, dot, sub};
use fluxmorph_geometry::{ElementId, Mesh, MeshError, tet4};
use rayon::prelude::*;

use crate::error::RemeshError;

/// Elements that one task looks at: within it, what cannot come before the first inversion so far is passed over.
const CHUNK: usize = 1024;

/// Share of the step to the first inversion within which elements invert together: those that symmetry makes alike differ by rounding.
const TOGETHER: f64 = 1e-9;

/// The first inversion along a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepToInversion {
    /// Multiple of the motion at which the first volume vanishes; infinite if none ever does.
    pub step: f64,
    /// The element whose volume vanishes there; of several, which may differ by rounding, the first.
    pub element: Option<ElementId>,
}

impl StepToInversion {
    /// No element ever inverts.
    pub const NEVER: Self = Self { step: f64::INFINITY, element: None };
}

/// The smallest multiple of `displacement` [m], shape `(n_nodes, 3)`, at which an element of the mesh loses its volume.
///
/// Exact up to rounding; the same bits for any number of threads. A displacement that is not finite has the step 0.
///
/// # Panics
/// If there is not one displacement per node.
#[expect(clippy::disallowed_methods, reason = "the least of numbers has no order")]
pub fn step_to_inversion(mesh: &Mesh, displacement: &[Point]) -> StepToInversion {
    assert_eq!(displacement.len(), mesh.points().len(), "one displacement per node");
    let tets = mesh.topology().tets();
    let root = |e: usize, known: f64| {
        first_root(mesh.vertices(ElementId::new(e)), tets[e].map(|n| displacement[n.index()]), known)
    };
    let least = |chunk: usize| {
        let elements = chunk * CHUNK..tets.len().min((chunk + 1) * CHUNK);
        elements.fold(f64::INFINITY, |least, e| root(e, least).map_or(least, |step| least.min(step)))
    };
    let chunks = (0..tets.len().div_ceil(CHUNK)).into_par_iter();
    let step = chunks.map(least).reduce(|| f64::INFINITY, f64::min);
    if step == f64::INFINITY {
        return StepToInversion::NEVER;
    }
    let last = step * (1.0 + TOGETHER);
    let inverts = |e: &usize| root(*e, last).is_some_and(|own| own <= last);
    let element = (0..tets.len()).into_par_iter().with_min_len(CHUNK).find_first(inverts);
    StepToInversion { step, element: element.map(ElementId::new) }
}

/// The mesh moved by `displacement` [m], shape `(n_nodes, 3)`, unless that inverts an element.
///
/// # Errors
/// [`RemeshError::Inverted`] names the first element to invert along the motion and the share of it that can be taken;
/// [`RemeshError::Mesh`] for a displacement that is not finite or does not fit the mesh.
pub fn check_step(mesh: &Mesh, displacement: &[Point]) -> Result<Mesh, RemeshError> {
    match mesh.moved(displacement) {
        Err(MeshError::Inverted { element: worst, .. }) => {
            let first = step_to_inversion(mesh, displacement);
            // Rounding may put the root of an element that ends up flat just beyond the step.
            let element = first.element.filter(|_| first.step <= 1.0).unwrap_or(worst);
            Err(RemeshError::Inverted {
                element,
                region: mesh.topology().region_name_at(element).to_owned(),
                centroid: tet4::centroid(mesh.vertices(element)),
                fraction: first.step.min(1.0),
            })
        }
        moved => Ok(moved?),
    }
}

/// Smallest positive `s` at which the tetrahedron `x + s u` has no volume, infinite if there is none; `None` where it is
/// known without solving to lie beyond `known`.
fn first_root(vertices: [Point; 4], displacement: [Point; 4], known: f64) -> Option<f64> {
    let edges = [1, 2, 3].map(|v| sub(vertices[v], vertices[0]));
    let changes = [1, 2, 3].map(|v| sub(displacement[v], displacement[0]));
    if changes == [[0.0; 3]; 3] {
        return Some(f64::INFINITY);
    }
    let ([e1, e2, e3], [u1, u2, u3]) = (edges, changes);
    let determinant = |a, b, c| dot(a, cross(b, c));
    let c0 = determinant(e1, e2, e3);
    let c1 = determinant(u1, e2, e3) + determinant(e1, u2, e3) + determinant(e1, e2, u3);
    let c2 = determinant(e1, u2, u3) + determinant(u1, e2, u3) + determinant(u1, u2, e3);
    let c3 = determinant(u1, u2, u3);
    let monic = [c1 / c0, c2 / c0, c3 / c0];
    if !monic.iter().all(|c| c.is_finite()) {
        return Some(0.0);
    }
    let bound = root_bound(monic);
    (bound * known >= 1.0 || known.is_infinite()).then(|| 1.0 / largest_positive_root(monic, bound))
}

/// No root of `t³ + a t² + b t + c` is larger: with `r` the largest of `|a|`, `|b|^½`, `|c|^⅓` and `x = r/t`, a root needs
/// `1 − x − x² − x³ ≤ 0`, that is `t ≤ 1.8393 r`.
fn root_bound([a, b, c]: [f64; 3]) -> f64 {
    1.84 * a.abs().max(b.abs().sqrt()).max(c.abs().cbrt())
}

/// Largest positive root of `q(t) = t³ + a t² + b t + c`, of which `bound` is an upper bound; zero if there is none.
fn largest_positive_root([a, b, c]: [f64; 3], bound: f64) -> f64 {
    if bound == 0.0 {
        return 0.0;
    }
    let q = |t: f64| ((t + a) * t + b) * t + c;
    // Local minimum and maximum of q, where they exist, without cancellation.
    let discriminant = a * a - 3.0 * b;
    if discriminant > 0.0 {
        let far = -(a + discriminant.sqrt().copysign(a));
        let (x, y) = (far / 3.0, b / far);
        let (maximum, minimum) = (x.min(y), x.max(y));
        if minimum > 0.0 && q(minimum) <= 0.0 {
            return bisect(q, minimum, bound);
        }
        // Right of the minimum there is no root; left of the maximum q rises from q(0) = c.
        if minimum > 0.0 {
            return if c < 0.0 && maximum > 0.0 { bisect(q, 0.0, maximum) } else { 0.0 };
        }
    }
    if c < 0.0 { bisect(q, 0.0, bound) } else { 0.0 }
}

/// The root of `q` in `low ..= high`, where `q(low) ≤ 0 < q(high)` and `q` rises: bisection to neighbouring numbers.
///
/// Returns the upper end: rounding errs towards the smaller step.
fn bisect(q: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        if q(middle) <= 0.0 { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(coefficients: [f64; 3]) -> f64 {
        largest_positive_root(coefficients, root_bound(coefficients))
    }

    #[test]
    fn roots_of_cubics_in_every_arrangement_are_found() {
        // (t − r0)(t − r1)(t − r2)
        let cubic = |r: [f64; 3]| {
            [-(r[0] + r[1] + r[2]), r[0] * r[1] + r[1] * r[2] + r[2] * r[0], -r[0] * r[1] * r[2]]
        };
        for roots in
            [[1.0, 2.0, 3.0], [-1.0, 2.0, 0.5], [-3.0, -2.0, 0.25], [1e-6, 1.0, 1e3], [-1e3, 7.0, -1.0]]
        {
            let largest = roots.iter().copied().fold(0.0, f64::max);
            let found = root(cubic(roots));
            assert!((found / largest - 1.0).abs() < 1e-9, "{roots:?}: {found}");
        }
        assert_eq!(root(cubic([-1.0, -2.0, -3.0])), 0.0);
        // t³ − 2 t² + 2 t − 1 = (t − 1)(t² − t + 1); a monotone one: t³ + t − 2 = (t − 1)(t² + t + 2).
        assert!((root([-2.0, 2.0, -1.0]) - 1.0).abs() < 1e-12);
        assert!((root([0.0, 1.0, -2.0]) - 1.0).abs() < 1e-12);
        // Quadratic and linear volumes: c = 0, b = 0.
        assert!((root([-0.5, 0.0, 0.0]) - 0.5).abs() < 1e-12);
        assert_eq!(root([0.5, 0.0, 0.0]), 0.0);
    }
}
