//! Reluctivities that are tensors and vary inside an element: what they add to the matrix of a scalar one.
//!
//! With `ν(x) = ν_0 I + D(x)` the weak form has the further term `∫curl w·D curl A`, the same for both families since it
//! is of curls alone; all else, the gauge of nodal elements too, keeps `ν_0`. The term is taken at the points of a
//! rule: the curls of the functions are tabulated there, `D` is given there. Who makes `D` is not decided here: a
//! stretched shell ([`crate::open`]) does, and the tangent of a B–H curve (`crate::nonlinear`).

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, dot};

use super::tabulated::Rule;

/// A symmetric tensor [m/H], by rows.
pub type Tensor = [Point; 3];

/// What a reluctivity has beyond the scalar one, at the points of a rule [m/H].
#[derive(Clone, Debug)]
pub struct TensorField {
    /// Where the values are.
    pub rule: Rule,
    /// `D = ν − ν_0 I`, one a point.
    pub values: Vec<Tensor>,
}

/// `D v`.
#[inline]
pub fn apply(tensor: &Tensor, v: Point) -> Point {
    [dot(tensor[0], v), dot(tensor[1], v), dot(tensor[2], v)]
}

/// The curls [1/m² of edge functions, 1/m of nodal ones] of the functions at one point, by carrier and component.
pub type Curls<const N: usize> = [[Point; 4]; N];

/// Most points of the rule that is exact for products of curls.
pub const MOST_POINTS: usize = 4;

/// Most functions of an element: four of each of the ten carriers of second order.
const MOST_FUNCTIONS: usize = 40;

/// Curls at the points of the rule that is exact for their products.
#[derive(Clone, Copy, Debug)]
pub struct CurlsOfRule<const N: usize> {
    /// How many points there are.
    pub count: usize,
    /// The volume that each point stands for [m³].
    pub weights: [f64; MOST_POINTS],
    /// `curl w`.
    pub curls: [Curls<N>; MOST_POINTS],
}

impl<const N: usize> Default for CurlsOfRule<N> {
    fn default() -> Self {
        Self { count: 0, weights: [0.0; MOST_POINTS], curls: [[[[0.0; 3]; 4]; N]; MOST_POINTS] }
    }
}

/// `∫curl w·D curl A` over an element with `N` carriers, shape `(N × 4, N × 4)`.
#[derive(Clone, Debug)]
pub struct TensorTerm<const N: usize> {
    blocks: Box<[[[[f64; 4]; 4]; N]; N]>,
}

impl<const N: usize> TensorTerm<N> {
    /// From the volume that a point stands for [m³], the tensor and the curls there, point by point.
    pub fn new<'a>(points: impl Iterator<Item = (f64, &'a Tensor, &'a Curls<N>)> + Clone) -> Self {
        // A quarter of the functions and more have no curl, and add nothing: which ones depends on the family.
        let with_curl =
            |&(a, i): &(usize, usize)| points.clone().any(|(_, _, curls)| curls[a][i] != [0.0; 3]);
        let (mut functions, mut count) = ([(0, 0); MOST_FUNCTIONS], 0);
        for function in (0..4 * N).map(|k| (k / 4, k % 4)).filter(with_curl) {
            functions[count] = function;
            count += 1;
        }
        let functions = &functions[..count];
        // Rows up to the diagonal.
        let mut sums = [[0.0; MOST_FUNCTIONS]; MOST_FUNCTIONS];
        let [mut x, mut y, mut z] = [[0.0; MOST_FUNCTIONS]; 3];
        for (volume, tensor, curls) in points {
            for (k, &(a, i)) in functions.iter().enumerate() {
                [x[k], y[k], z[k]] = curls[a][i];
            }
            for (k, row) in sums[..count].iter_mut().enumerate() {
                let u = apply(tensor, [x[k], y[k], z[k]]).map(|c| volume * c);
                for (((sum, x), y), z) in row[..=k].iter_mut().zip(&x).zip(&y).zip(&z) {
                    *sum += dot([*x, *y, *z], u);
                }
            }
        }
        let mut blocks = Box::new([[[[0.0; 4]; 4]; N]; N]);
        for (k, row) in sums[..count].iter().enumerate() {
            let (b, j) = functions[k];
            for (&(a, i), &sum) in functions[..=k].iter().zip(row) {
                blocks[a][b][i][j] = sum;
                blocks[b][a][j][i] = sum;
            }
        }
        Self { blocks }
    }
}

impl<const N: usize> LocalMatrix<c64, N, 4> for TensorTerm<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        self.blocks[a][b].map(|row| row.map(c64::from))
    }
}

/// The matrix of an element with the scalar reluctivity, and the term of the tensor where it has one.
#[derive(Clone, Debug)]
pub struct WithTensor<L, const N: usize> {
    /// With `ν_0`.
    pub scalar: L,
    /// Of `D`.
    pub term: Option<TensorTerm<N>>,
}

impl<L: LocalMatrix<c64, N, 4>, const N: usize> LocalMatrix<c64, N, 4> for WithTensor<L, N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let mut block = self.scalar.block(a, b);
        if let Some(term) = &self.term {
            for (row, added) in block.iter_mut().zip(&term.blocks[a][b]) {
                for (entry, added) in row.iter_mut().zip(added) {
                    *entry += *added;
                }
            }
        }
        block
    }

    #[inline]
    fn scalars(&self) -> Option<[[f64; N]; N]> {
        if self.term.is_some() { None } else { self.scalar.scalars() }
    }
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::tet4::Tet4;

    use super::super::differences::{SKEW, bilinear, values};
    use super::super::volume::Coefficients;
    use super::*;
    use crate::family::{Cell, EDGE_1, EDGE_2, Matrices, NODAL_1, NODAL_2};

    const D: Tensor = [[0.7, 0.2, -0.3], [0.2, 1.1, 0.4], [-0.3, 0.4, 0.5]];

    fn with_tensor<const N: usize, const F: usize>(
        family: &impl Matrices<N, F>,
        law: Coefficients,
        field: &TensorField,
    ) -> impl LocalMatrix<c64, N, 4> {
        let cell = Cell { tet: Tet4::new(SKEW), order: [2, 0, 3, 1] };
        let curls = family.curls(&cell, field.rule);
        let points = field.rule.nodes().iter().zip(&field.values).zip(&curls);
        let term =
            TensorTerm::new(points.map(|(((_, share), d), curls)| (share * cell.tet.volume, d, curls)));
        WithTensor { scalar: family.tet(cell, law), term: Some(term) }
    }

    fn check<const N: usize, const F: usize>(family: &impl Matrices<N, F>) {
        let law = Coefficients { reluctivity: 1.7, extra_penalty: 0.0, eddy: c64::default() };
        let cell = Cell { tet: Tet4::new(SKEW), order: [2, 0, 3, 1] };
        let (l, u) = (values::<N, 4>(3), values::<N, 4>(70));
        // `∫curl λ·D(x) curl u` of a tensor that varies, by the field at the points.
        let rule = Rule::Degree5;
        let values: Vec<Tensor> =
            rule.nodes().iter().map(|(x, _)| D.map(|row| row.map(|d| (1.0 + x[1]) * d))).collect();
        let expected: c64 = rule
            .nodes()
            .iter()
            .zip(&values)
            .map(|((x, share), d)| {
                let [l, u] = [&l, &u].map(|f| family.field(&cell, x, f).flux_density);
                let product = |i: usize, j: usize| l[i] * d[i][j] * u[j];
                share * cell.tet.volume * (0..9).map(|k| product(k / 3, k % 3)).sum::<c64>()
            })
            .sum();
        let scalar = family.tet(cell, law);
        let field = TensorField { rule, values };
        let whole = with_tensor(family, law, &field);
        let added = bilinear(&l, |a, b| whole.block(a, b), &u) - bilinear(&l, |a, b| scalar.block(a, b), &u);
        assert!((added - expected).norm() < 1e-12 * expected.norm(), "{added} {expected}");
    }

    #[test]
    fn the_term_is_the_weak_form_of_the_field_for_both_families_and_orders() {
        check(&*NODAL_1);
        check(&*NODAL_2);
        check(&*EDGE_1);
        check(&*EDGE_2);
    }

    #[test]
    fn an_isotropic_tensor_in_edge_elements_is_a_larger_reluctivity() {
        let law = |reluctivity| Coefficients { reluctivity, extra_penalty: 0.0, eddy: c64::default() };
        let isotropic = [[0.6, 0.0, 0.0], [0.0, 0.6, 0.0], [0.0, 0.0, 0.6]];
        let field = TensorField { rule: Rule::Degree2, values: vec![isotropic; 4] };
        let cell = Cell { tet: Tet4::new(SKEW), order: [2, 0, 3, 1] };
        let (split, whole) = (with_tensor(&*EDGE_2, law(1.7), &field), EDGE_2.tet(cell, law(2.3)));
        for (a, b) in (0..10).flat_map(|a| (0..10).map(move |b| (a, b))) {
            let (x, y) = (split.block(a, b), whole.block(a, b));
            assert!((0..16).all(|k| (x[k / 4][k % 4] - y[k / 4][k % 4]).norm() < 1e-13));
        }
    }
}
