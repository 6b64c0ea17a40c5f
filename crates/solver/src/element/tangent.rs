//! `∫ curl w_a · M curl w_b` with a symmetric tensor `M` at each point of a rule: what a B–H law adds to an element.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, dot};

/// Most points of a rule for products of curls.
pub const MOST_POINTS: usize = 4;

/// Curls of all functions of an element with `N` carriers at the points of its rule, index `[point][carrier][component]`.
#[derive(Clone, Copy, Debug)]
pub struct Curls<const N: usize> {
    /// How many points there are.
    pub count: usize,
    /// The volume that each point stands for [m³].
    pub weights: [f64; MOST_POINTS],
    /// `curl w`.
    pub curls: [[[Point; 4]; N]; MOST_POINTS],
}

impl<const N: usize> Default for Curls<N> {
    fn default() -> Self {
        Self { count: 0, weights: [0.0; MOST_POINTS], curls: [[[[0.0; 3]; 4]; N]; MOST_POINTS] }
    }
}

/// The matrix of the tensors at the points.
#[derive(Clone, Debug)]
pub struct CurlMatrix<const N: usize> {
    of: Curls<N>,
    /// `weight M curl w`.
    turned: [[[Point; 4]; N]; MOST_POINTS],
}

impl<const N: usize> CurlMatrix<N> {
    /// From one symmetric tensor [m/H] a point.
    pub fn new(of: Curls<N>, tensors: &[[Point; 3]; MOST_POINTS]) -> Self {
        let mut turned = of.curls;
        for (point, functions) in turned.iter_mut().enumerate().take(of.count) {
            let (weight, tensor) = (of.weights[point], &tensors[point]);
            functions
                .iter_mut()
                .flatten()
                .for_each(|curl| *curl = tensor.map(|row| weight * dot(row, *curl)));
        }
        Self { of, turned }
    }

    /// Adds the entries of carrier `a` against `b`.
    #[inline]
    fn add(&self, a: usize, b: usize, block: &mut [[c64; 4]; 4]) {
        for (curls, turned) in self.of.curls.iter().zip(&self.turned).take(self.of.count) {
            for (row, curl) in block.iter_mut().zip(&curls[a]) {
                for (entry, turned) in row.iter_mut().zip(&turned[b]) {
                    *entry += dot(*curl, *turned);
                }
            }
        }
    }
}

/// The matrix of an element, and what its B–H law adds.
pub struct WithTangent<L, const N: usize> {
    /// Of the linear part.
    pub linear: L,
    /// `None` where the material is linear.
    pub tangent: Option<Box<CurlMatrix<N>>>,
}

impl<L: LocalMatrix<c64, N, 4>, const N: usize> LocalMatrix<c64, N, 4> for WithTangent<L, N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let mut block = self.linear.block(a, b);
        if let Some(tangent) = &self.tangent {
            tangent.add(a, b, &mut block);
        }
        block
    }

    #[inline]
    fn scalars(&self) -> Option<[[f64; N]; N]> {
        if self.tangent.is_some() { None } else { self.linear.scalars() }
    }
}
