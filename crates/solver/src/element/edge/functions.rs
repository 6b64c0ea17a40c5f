//! The functions of edge elements on a simplex whose vertices are numbered in ascending order.
//!
//! With the vertices ascending, every edge points from its lower to its higher vertex in all elements that share it, and
//! no signs are kept. On the edge `i < j` and the face `i < j < k`:
//!
//! | carrier, component | function | kind |
//! |---|---|---|
//! | edge, 0 | `W_ij = λ_i ∇λ_j − λ_j ∇λ_i` | rotational (Whitney) |
//! | edge, 2 | `∇(λ_i λ_j)` | gradient |
//! | edge, 3 | `∇(λ_i λ_j (λ_i − λ_j))` | gradient, second order |
//! | face, 0 | `λ_k W_ij` | rotational, second order |
//! | face, 1 | `λ_i W_jk` | rotational, second order |
//! | face, 2 | `∇(λ_i λ_j λ_k)` | gradient, second order |
//!
//! The gradients of the vertices' functions are within the Whitney functions. First order with its gradients is all
//! linear fields (Nédélec's second kind), second order all quadratic ones; without the gradients the curls are the same
//! (Nédélec, Numer. Math. 35 (1980) 315 and 50 (1986) 57; hierarchical form: Webb, IEEE Trans. Antennas Propag. 47
//! (1999) 1244).

use fluxmorph_geometry::tet4::EDGES;

use super::polynomial::Polynomial;
use crate::elements::Order;

/// Component of the Whitney function of an edge.
pub(crate) const WHITNEY: usize = 0;

/// Whether a component of an edge or of a face is a gradient.
pub(crate) fn is_gradient(order: Order, is_edge: bool, component: usize) -> bool {
    component == 2 || component == 3 && is_edge && order == Order::Quadratic
}

/// Local vertices of the faces of a simplex with ascending vertices.
pub(crate) const ASCENDING_FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];

/// Local edges of a triangle with ascending vertices.
pub(crate) const ASCENDING_TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// A function `Σ_n p_n ∇λ_n`, and where it belongs.
#[derive(Clone, Debug)]
pub(super) struct Function {
    /// Local number of the edge, or of the face after all edges.
    pub(super) carrier: usize,
    /// Its component there.
    pub(super) component: usize,
    /// `p_n`.
    pub(super) along: [Polynomial; 4],
}

impl Function {
    /// The factors of `∇λ_m × ∇λ_n` in its curl for the pairs `m < n` of [`EDGES`].
    pub(super) fn curl(&self) -> [Polynomial; 6] {
        EDGES.map(|[m, n]| self.along[n].derivative(m).plus(-1.0, &self.along[m].derivative(n)))
    }
}

fn whitney(i: usize, j: usize) -> [Polynomial; 4] {
    let mut along: [Polynomial; 4] = Default::default();
    along[j] = Polynomial::coordinate(i);
    along[i] = Polynomial::default().plus(-1.0, &Polynomial::coordinate(j));
    along
}

fn gradient(of: &Polynomial) -> [Polynomial; 4] {
    std::array::from_fn(|n| of.derivative(n))
}

/// The functions on a simplex with these edges and faces: the rotational ones first, then the gradients.
pub(super) fn functions(order: Order, edges: &[[usize; 2]], faces: &[[usize; 3]]) -> Vec<Function> {
    let coordinate = Polynomial::coordinate;
    let (mut rotational, mut gradients) = (Vec::new(), Vec::new());
    for (carrier, &[i, j]) in edges.iter().enumerate() {
        rotational.push(Function { carrier, component: WHITNEY, along: whitney(i, j) });
        let bubble = coordinate(i).times(&coordinate(j));
        gradients.push(Function { carrier, component: 2, along: gradient(&bubble) });
        if order == Order::Quadratic {
            let odd = bubble.times(&coordinate(i).plus(-1.0, &coordinate(j)));
            gradients.push(Function { carrier, component: 3, along: gradient(&odd) });
        }
    }
    if order == Order::Quadratic {
        for (f, &[i, j, k]) in faces.iter().enumerate() {
            let carrier = edges.len() + f;
            let times = |l: usize, along: [Polynomial; 4]| along.map(|p| p.times(&coordinate(l)));
            rotational.push(Function { carrier, component: 0, along: times(k, whitney(i, j)) });
            rotational.push(Function { carrier, component: 1, along: times(i, whitney(j, k)) });
            let bubble = coordinate(i).times(&coordinate(j)).times(&coordinate(k));
            gradients.push(Function { carrier, component: 2, along: gradient(&bubble) });
        }
    }
    rotational.append(&mut gradients);
    rotational
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_have_no_curl_and_there_are_as_many_functions_as_the_complete_spaces_have() {
        for (order, count, rotational) in [(Order::Linear, 12, 6), (Order::Quadratic, 30, 14)] {
            let all = functions(order, &EDGES, &ASCENDING_FACES);
            assert_eq!(all.len(), count);
            for (f, function) in all.iter().enumerate() {
                let turns = function.curl().iter().any(|p| *p != Polynomial::default());
                assert_eq!(turns, f < rotational, "function {f}");
            }
        }
    }

    /// Their Gram matrix has full rank: no coefficient is left undetermined in a conductor.
    #[test]
    fn the_functions_are_independent() {
        use super::super::super::differences::SKEW;
        use crate::element::quadrature;
        use fluxmorph_geometry::tet4::{Tet4, dot};
        let tet = Tet4::new(SKEW);
        for order in [Order::Linear, Order::Quadratic] {
            let all = functions(order, &EDGES, &ASCENDING_FACES);
            let value = |f: &Function, lambda: &[f64; 4]| -> [f64; 3] {
                std::array::from_fn(|d| (0..4).map(|n| f.along[n].value(lambda) * tet.gradients[n][d]).sum())
            };
            let product = |a: &Function, b: &Function| -> f64 {
                let at = |(lambda, share): &quadrature::Node| share * dot(value(a, lambda), value(b, lambda));
                quadrature::degree_5().iter().map(at).sum()
            };
            let norms: Vec<f64> = all.iter().map(|f| product(f, f).sqrt()).collect();
            let mut gram: Vec<Vec<f64>> = all
                .iter()
                .zip(&norms)
                .map(|(a, s)| all.iter().zip(&norms).map(|(b, t)| product(a, b) / (s * t)).collect())
                .collect();
            // The pivots of its elimination are the squares of what each function adds to those before; rounding is 1e-15.
            for k in 0..gram.len() {
                assert!(gram[k][k] > 1e-6, "{order:?}: function {k} is a sum of others, {:e}", gram[k][k]);
                for i in k + 1..gram.len() {
                    let factor = gram[i][k] / gram[k][k];
                    let (above, below) = gram.split_at_mut(i);
                    for (x, y) in below[0].iter_mut().zip(&above[k]) {
                        *x -= factor * y;
                    }
                }
            }
        }
    }

    /// Tangential components on a face are those of the functions of that face alone: what makes the fields conform.
    #[test]
    fn on_a_face_only_its_own_functions_have_tangential_components() {
        let all = functions(Order::Quadratic, &EDGES, &ASCENDING_FACES);
        for (face, vertices) in ASCENDING_FACES.iter().enumerate() {
            let opposite = (0..4).find(|v| !vertices.contains(v)).expect("one vertex is left");
            let mut lambda = [0.2, 0.3, 0.5, 0.0];
            lambda.swap(opposite, 3);
            for function in &all {
                let own = match function.carrier.checked_sub(6) {
                    Some(f) => f == face,
                    None => EDGES[function.carrier].iter().all(|v| vertices.contains(v)),
                };
                // On the face ∇λ of the opposite vertex has no tangential part, and the other three sum to none.
                let along = vertices.map(|v| function.along[v].value(&lambda));
                let tangential = along.iter().any(|&p| (p - along[0]).abs() > 1e-14);
                assert!(own || !tangential, "carrier {} on face {face}", function.carrier);
            }
        }
    }
}
