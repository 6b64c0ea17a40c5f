//! The matrix of an edge tetrahedron, and the loads of its sources.
//!
//! `∫ν curl A·curl w + jωσ ∫(A + ∇ψ)·(w + ∇q)`: no penalty, and no gradients but in conductors.

use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, Tet4, dot};

use super::super::point::stretch;
use super::super::tensor::CurlsOfRule;
use super::super::volume::Coefficients;
use super::super::{Complex3, dot3};
use super::{Ascending, EdgeShape, combine};

/// The matrix of a tetrahedron with `N` carriers and `M` functions, shape `(N × 4, N × 4)`; zero where a carrier has no
/// function of a component.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeTet<const N: usize, const M: usize> {
    shape: &'static EdgeShape<N, M>,
    coefficients: Coefficients,
    /// `∫curl·curl`, of rotational functions.
    curl: [[f64; M]; M],
    /// `∫·`, zero where nothing conducts.
    mass: [[f64; M]; M],
}

impl<const N: usize, const M: usize> EdgeTet<N, M> {
    /// The element matrix for given geometry and coefficients.
    pub(crate) fn new(shape: &'static EdgeShape<N, M>, tet: &Ascending, coefficients: Coefficients) -> Self {
        let mut curl = [[0.0; M]; M];
        for at in &shape.tables[shape.curl_rule() as usize] {
            let weight = at.share * tet.volume;
            let curls: [Point; M] = std::array::from_fn(|f| {
                if f < shape.rotational { combine(&at.curl[f], &tet.products) } else { [0.0; 3] }
            });
            add_products(&mut curl, weight, &curls, shape.rotational);
        }
        let mut mass = [[0.0; M]; M];
        if coefficients.eddy != c64::default() {
            for at in &shape.tables[shape.value_rule() as usize] {
                let weight = at.share * tet.volume;
                let values: [Point; M] = std::array::from_fn(|f| combine(&at.along[f], &tet.gradients));
                add_products(&mut mass, weight, &values, M);
            }
        }
        Self { shape, coefficients, curl, mass }
    }
}

/// Adds the products of the first `count` vectors to the upper triangle.
#[inline]
fn add_products<const M: usize>(sum: &mut [[f64; M]; M], weight: f64, vectors: &[Point; M], count: usize) {
    for f in 0..count {
        for g in f..count {
            sum[f][g] += weight * dot(vectors[f], vectors[g]);
        }
    }
}

impl<const N: usize, const M: usize> LocalMatrix<c64, N, 4> for EdgeTet<N, M> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        let Coefficients { reluctivity, eddy, .. } = self.coefficients;
        let (rows, columns) = (self.shape.number[a], self.shape.number[b]);
        rows.map(|row| {
            columns.map(|column| {
                let (Some(f), Some(g)) = (row, column) else { return c64::default() };
                let (f, g) = (usize::from(f.min(g)), usize::from(f.max(g)));
                c64::new(reluctivity * self.curl[f][g], 0.0) + eddy * self.mass[f][g]
            })
        })
    }
}

impl<const N: usize, const M: usize> EdgeShape<N, M> {
    /// `∂/∂x_k (λᵀ K_e u)` for the four vertices of `plain`, shape `(4, 3)`; the coefficients are held.
    pub(crate) fn shape_derivative(
        &self,
        (plain, tet): (&Tet4, &Ascending),
        law: &Coefficients,
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
    ) -> [Complex3; 4] {
        let mut tensor = [[c64::default(); 3]; 3];
        let rule = if law.eddy == c64::default() { self.curl_rule() } else { self.value_rule() };
        for ((share, l), (_, u)) in self.fields(rule, tet, adjoint).zip(self.fields(rule, tet, state)) {
            let (nu, eddy) = (c64::from(share * law.reluctivity), share * law.eddy);
            add_symmetric(&mut tensor, nu, &l.flux_density, &u.flux_density);
            if eddy != c64::default() {
                add_symmetric(&mut tensor, -eddy, &l.electric_potential, &u.electric_potential);
            }
        }
        stretch(plain, &tensor)
    }

    /// `∂/∂x_k ∫ H(B_u)·B_l` for the four vertices of `plain`, shape `(4, 3)`, of a law that gives `H(B_u)` and `∂H/∂B B_l`
    /// from `B_l` and `B_u`; the coefficients are held.
    pub(crate) fn flux_shape_derivative(
        &self,
        (plain, tet): (&Tet4, &Ascending),
        adjoint: &[[c64; 4]],
        state: &[[c64; 4]],
        law: impl Fn(Complex3, Complex3) -> [Complex3; 2],
    ) -> [Complex3; 4] {
        let mut tensor = [[c64::default(); 3]; 3];
        let rule = self.curl_rule();
        for ((share, l), (_, u)) in self.fields(rule, tet, adjoint).zip(self.fields(rule, tet, state)) {
            let (l, u) = (l.flux_density, u.flux_density);
            let [field, turned] = law(l, u);
            for d in 0..3 {
                for i in 0..3 {
                    tensor[d][i] += share * (field[d] * l[i] + turned[d] * u[i]);
                }
                tensor[d][d] -= share * dot3(turned, u);
            }
        }
        stretch(plain, &tensor)
    }

    /// Curls of all functions at the points of the rule that is exact for their products.
    pub(crate) fn curls(&self, tet: &Ascending) -> CurlsOfRule<N> {
        let mut of = CurlsOfRule::default();
        for at in &self.tables[self.curl_rule() as usize] {
            of.weights[of.count] = at.share * tet.volume;
            for (f, &(carrier, component)) in self.slots.iter().enumerate().take(self.rotational) {
                of.curls[of.count][carrier][component] = combine(&at.curl[f], &tet.products);
            }
            of.count += 1;
        }
        of
    }

    /// `λ_b`-weighted source moments `M_b = ∫T λ_b dV` [A m²], in ascending order of the vertices, to the load
    /// `f_a = ∫T·curl w_a`.
    pub(crate) fn curl_load(&self, tet: &Ascending, moments: &[Complex3; 4]) -> [[c64; 4]; N] {
        let mut load = [[c64::default(); 4]; N];
        let along = moments.map(|m| tet.products.map(|x| (0..3).map(|d| m[d] * x[d]).sum::<c64>()));
        for (f, &(carrier, component)) in self.slots.iter().enumerate().take(self.rotational) {
            load[carrier][component] = (0..4)
                .flat_map(|b| (0..6).map(move |p| (b, p)))
                .map(|(b, p)| self.curl_slope[f][b][p] * along[b][p])
                .sum();
        }
        load
    }

    /// Load `∫J·w_a dV` of a current density that is constant in the element [A/m²].
    pub(crate) fn current_load(&self, tet: &Ascending, current_density: &Complex3) -> [[c64; 4]; N] {
        let mut load = [[c64::default(); 4]; N];
        for at in &self.tables[self.value_rule() as usize] {
            let weight = at.share * tet.volume;
            for (f, &(carrier, component)) in self.slots.iter().enumerate() {
                let value = combine(&at.along[f], &tet.gradients);
                load[carrier][component] +=
                    (0..3).map(|d| weight * value[d] * current_density[d]).sum::<c64>();
            }
        }
        load
    }

    /// `∂/∂x_k (λᵀ f)` for the load of a source `T` that is constant in the element and moves with it, shape `(4, 3)`:
    /// `δ∫T·B = ∫T·(∇v)B`.
    pub(crate) fn magnet_shape_derivative(
        &self,
        (plain, tet): (&Tet4, &Ascending),
        source: Point,
        adjoint: &[[c64; 4]],
    ) -> [Complex3; 4] {
        let b = self.at_centroid(tet, adjoint).flux_density;
        stretch(plain, &source.map(|t| b.map(|b| t * b)))
    }
}

/// Adds `c (l uᵀ + u lᵀ − (l·u) I)`.
#[inline]
fn add_symmetric(tensor: &mut [Complex3; 3], c: c64, l: &Complex3, u: &Complex3) {
    let product = c * (l[0] * u[0] + l[1] * u[1] + l[2] * u[2]);
    for d in 0..3 {
        for i in 0..3 {
            tensor[d][i] += c * (l[d] * u[i] + u[d] * l[i]);
        }
        tensor[d][d] -= product;
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::differences::{SKEW, bilinear, values};
    use super::super::super::quadrature;
    use super::*;

    const LAW: Coefficients = Coefficients { reluctivity: 1.7, extra_penalty: 0.0, eddy: c64::new(0.0, 2.3) };

    fn ascending() -> Ascending {
        Ascending::new(&Tet4::new(SKEW), [2, 0, 3, 1])
    }

    fn the_matrix_is_the_weak_form<const N: usize, const M: usize>(shape: &'static EdgeShape<N, M>) {
        let (l, u) = (values::<N, 4>(1), values::<N, 4>(90));
        let tet = ascending();
        let mut sum = c64::default();
        for (lambda, weight) in quadrature::degree_5() {
            let of = |coefficients: &[[c64; 4]; N]| {
                let mut at = super::super::FieldPoint::default();
                for (carrier, component, value, curl) in shape.functions_at(&tet, lambda) {
                    for d in 0..3 {
                        at.electric_potential[d] += value[d] * coefficients[carrier][component];
                        at.flux_density[d] += curl[d] * coefficients[carrier][component];
                    }
                }
                at
            };
            let (l, u) = (of(&l), of(&u));
            for d in 0..3 {
                sum += weight
                    * tet.volume
                    * (LAW.reluctivity * l.flux_density[d] * u.flux_density[d]
                        + LAW.eddy * l.electric_potential[d] * u.electric_potential[d]);
            }
        }
        let matrix = EdgeTet::new(shape, &tet, LAW);
        let exact = bilinear(&l, |a, b| matrix.block(a, b), &u);
        assert!((sum - exact).norm() < 1e-12 * exact.norm(), "{sum} {exact}");
    }

    #[test]
    fn of_both_orders_it_is_the_weak_form() {
        the_matrix_is_the_weak_form(EdgeShape::<6, 12>::tet());
        the_matrix_is_the_weak_form(EdgeShape::<10, 30>::tet());
    }

    fn loads<const N: usize, const M: usize>(shape: &'static EdgeShape<N, M>) {
        let l = values::<N, 4>(7);
        let source = [0.3, -1.2, 0.8];
        let tet = ascending();
        let moments = [source.map(|t| c64::from(0.25 * tet.volume * t)); 4];
        let load = shape.curl_load(&tet, &moments);
        let value: c64 = load.as_flattened().iter().zip(l.as_flattened()).map(|(f, l)| f * l).sum();
        let curl: Complex3 =
            shape.fields(shape.curl_rule(), &tet, &l).fold([c64::default(); 3], |sum, at| {
                std::array::from_fn(|d| sum[d] + at.0 * tet.volume * at.1.flux_density[d])
            });
        let integral: c64 = (0..3).map(|d| source[d] * curl[d]).sum();
        assert!((value - integral).norm() < 1e-13);
    }

    #[test]
    fn the_loads_of_sources_and_magnets() {
        loads(EdgeShape::<6, 12>::tet());
        loads(EdgeShape::<10, 30>::tet());
    }
}
