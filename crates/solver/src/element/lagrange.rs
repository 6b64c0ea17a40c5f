//! Lagrange shape functions on a simplex in barycentric coordinates, and the exact means of their products.
//!
//! A simplex with `M` vertices has barycentric coordinates `λ_1 … λ_M`, `Σ λ = 1`. Every shape function of the degrees 1
//! and 2 is a homogeneous polynomial in them once `1` is written as `Σ λ`, so two facts are all that is needed: its
//! derivatives are `∂N_a/∂λ_m = Σ_b slope[a][m][b] λ_b`, and by Euler `N_a = 1/degree Σ_m λ_m ∂N_a/∂λ_m`. Means over a simplex of dimension `d` follow from
//! `⟨λ^α⟩ = d! α! / (|α| + d)!` (Stroud, Approximate Calculation of Multiple Integrals, 1971, section 7.4). A
//! change of all `∂N_a/∂λ_m` by the same amount changes no gradient, since `Σ_m ∇λ_m = 0`.
//!
//! Quadratic elements number the vertices first, then the edges' midpoints: of a tetrahedron in the order of
//! [`fluxmorph_geometry::tet4::EDGES`], of a triangle in that of [`TRIANGLE_EDGES`].

use std::sync::LazyLock;

use fluxmorph_geometry::tet4::EDGES;

use super::quadrature::Node;
use super::tabulated::{Rule, Tabulated};

/// Local vertices of the edges of a triangle.
pub const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// `N` shape functions on a simplex with `M` vertices.
#[derive(Debug)]
pub struct Lagrange<const N: usize, const M: usize> {
    degree: f64,
    /// `∂N_a/∂λ_m = Σ_b slope[a][m][b] λ_b`.
    slope: [[[f64; M]; M]; N],
    /// `⟨N_a N_b⟩`.
    pub mass: [[f64; N]; N],
    /// `⟨N_a ∂N_b/∂λ_m⟩`, index `[a][b][m]`.
    pub advection: [[[f64; M]; N]; N],
    /// `⟨∂N_a/∂λ_m ∂N_b/∂λ_n⟩`, index `[a][b][m][n]`.
    pub stiffness: [[[[f64; M]; M]; N]; N],
    /// `∫∇N_a·∇N_b = Σ_e laplace[a][b][e] V g_m·g_n` over the edges `e = (m, n)` of a tetrahedron, in the order of
    /// [`EDGES`]: with `g_m·g_m = −Σ_{n≠m} g_m·g_n`, the factor is `S_mn + S_nm − S_mm − S_nn` of the `stiffness` `S`.
    /// Zero for triangles.
    pub laplace: [[[f64; 6]; N]; N],
    /// At the points of every rule; empty for triangles.
    tables: Vec<Vec<Tabulated<N>>>,
}

static LINEAR_TET: LazyLock<Lagrange<4, 4>> = LazyLock::new(|| Lagrange::new(1.0, linear()).tabulate());
static LINEAR_TRIANGLE: LazyLock<Lagrange<3, 3>> = LazyLock::new(|| Lagrange::new(1.0, linear()));
static QUADRATIC_TET: LazyLock<Lagrange<10, 4>> =
    LazyLock::new(|| Lagrange::new(2.0, quadratic(&EDGES)).tabulate());
static QUADRATIC_TRIANGLE: LazyLock<Lagrange<6, 3>> =
    LazyLock::new(|| Lagrange::new(2.0, quadratic(&TRIANGLE_EDGES)));

impl Lagrange<4, 4> {
    /// The linear tetrahedron.
    pub fn tet() -> &'static Self {
        &LINEAR_TET
    }
}

impl Lagrange<10, 4> {
    /// The quadratic tetrahedron.
    pub fn tet() -> &'static Self {
        &QUADRATIC_TET
    }
}

impl Lagrange<3, 3> {
    /// The linear triangle.
    pub fn triangle() -> &'static Self {
        &LINEAR_TRIANGLE
    }
}

impl Lagrange<6, 3> {
    /// The quadratic triangle.
    pub fn triangle() -> &'static Self {
        &QUADRATIC_TRIANGLE
    }
}

/// `N_a = λ_a`.
fn linear<const M: usize>() -> [[[f64; M]; M]; M] {
    std::array::from_fn(|a| std::array::from_fn(|m| [f64::from(u8::from(a == m)); M]))
}

/// `N_a = 2 λ_a² − λ_a Σλ` at vertices, `4 λ_a λ_b` on edges.
fn quadratic<const N: usize, const M: usize>(edges: &[[usize; 2]]) -> [[[f64; M]; M]; N] {
    let delta = |i: usize, j: usize| f64::from(u8::from(i == j));
    std::array::from_fn(|a| {
        std::array::from_fn(|m| {
            std::array::from_fn(|b| {
                if a < M {
                    4.0 * delta(a, m) * delta(a, b) - delta(a, m) - delta(a, b)
                } else {
                    let [i, j] = edges[a - M];
                    4.0 * (delta(i, m) * delta(j, b) + delta(j, m) * delta(i, b))
                }
            })
        })
    })
}

/// `⟨Π λ_i⟩` over the listed indices on a simplex with `M` vertices.
fn mean<const M: usize>(indices: &[usize]) -> f64 {
    let factorial = |n: usize| (1..=n).product::<usize>() as f64;
    let powers: f64 = (0..M).map(|m| factorial(indices.iter().filter(|&&i| i == m).count())).product();
    factorial(M - 1) * powers / factorial(indices.len() + M - 1)
}

impl<const N: usize, const M: usize> Lagrange<N, M> {
    fn new(degree: f64, slope: [[[f64; M]; M]; N]) -> Self {
        let pairs: Vec<(usize, usize)> = (0..M).flat_map(|i| (0..M).map(move |j| (i, j))).collect();
        let value = |a: usize, (i, j): (usize, usize)| slope[a][i][j] / degree;
        let mass = |a: usize, b: usize| -> f64 {
            pairs
                .iter()
                .flat_map(|&p| pairs.iter().map(move |&q| (p, q)))
                .map(|(p, q)| value(a, p) * value(b, q) * mean::<M>(&[p.0, p.1, q.0, q.1]))
                .sum()
        };
        let advection = |a: usize, b: usize, m: usize| -> f64 {
            pairs
                .iter()
                .flat_map(|&p| (0..M).map(move |c| (p, c)))
                .map(|(p, c)| value(a, p) * slope[b][m][c] * mean::<M>(&[p.0, p.1, c]))
                .sum()
        };
        let stiffness = |a: usize, b: usize, m: usize, n: usize| -> f64 {
            pairs.iter().map(|&(c, d)| slope[a][m][c] * slope[b][n][d] * mean::<M>(&[c, d])).sum()
        };
        Self {
            degree,
            slope,
            mass: std::array::from_fn(|a| std::array::from_fn(|b| mass(a, b))),
            advection: std::array::from_fn(|a| {
                std::array::from_fn(|b| std::array::from_fn(|m| advection(a, b, m)))
            }),
            stiffness: std::array::from_fn(|a| {
                std::array::from_fn(|b| {
                    std::array::from_fn(|m| std::array::from_fn(|n| stiffness(a, b, m, n)))
                })
            }),
            laplace: [[[0.0; 6]; N]; N],
            tables: Vec::new(),
        }
    }

    /// `∂N_a/∂λ_m` at a point.
    #[inline]
    pub fn slope(&self, a: usize, m: usize, lambda: &[f64; M]) -> f64 {
        self.slope[a][m].iter().zip(lambda).map(|(s, l)| s * l).sum()
    }

    /// `N_a` at a point.
    #[inline]
    pub fn value(&self, a: usize, lambda: &[f64; M]) -> f64 {
        (0..M).map(|m| lambda[m] * self.slope(a, m, lambda)).sum::<f64>() / self.degree
    }

    /// The coefficient of `λ_b` in `∂N_a/∂λ_m`.
    #[inline]
    pub fn slope_coefficient(&self, a: usize, m: usize, b: usize) -> f64 {
        self.slope[a][m][b]
    }
}

impl<const N: usize> Lagrange<N, 4> {
    /// The functions at the points of a rule.
    #[inline]
    pub fn at(&self, rule: Rule) -> &[Tabulated<N>] {
        &self.tables[rule as usize]
    }

    fn tabulate(mut self) -> Self {
        let along: [[usize; 2]; N] =
            std::array::from_fn(|a| a.checked_sub(4).map_or([a, a], |edge| EDGES[edge]));
        let at = |&(lambda, share): &Node| Tabulated {
            share,
            values: std::array::from_fn(|a| self.value(a, &lambda)),
            along,
            slopes: std::array::from_fn(|a| {
                // A vertex's function has one and the same derivative along all other vertices, which is taken off.
                let common = if a < 4 { self.slope(a, (a + 1) % 4, &lambda) } else { 0.0 };
                let [m, n] = along[a];
                let second = if m == n { 0.0 } else { self.slope(a, n, &lambda) };
                [self.slope(a, m, &lambda) - common, second]
            }),
        };
        let tables = Rule::ALL.map(|rule| rule.nodes().iter().map(at).collect()).into();
        self.tables = tables;
        self.laplace =
            self.stiffness.map(|row| row.map(|s| EDGES.map(|[m, n]| s[m][n] + s[n][m] - s[m][m] - s[n][n])));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner<const M: usize>(i: usize) -> [f64; M] {
        std::array::from_fn(|m| f64::from(u8::from(m == i)))
    }

    fn middle<const M: usize>([i, j]: [usize; 2]) -> [f64; M] {
        std::array::from_fn(|m| 0.5 * f64::from(u8::from(m == i || m == j)))
    }

    fn check<const N: usize, const M: usize>(shape: &Lagrange<N, M>, nodes: &[[f64; M]]) {
        for (b, node) in nodes.iter().enumerate() {
            for a in 0..N {
                assert!((shape.value(a, node) - f64::from(u8::from(a == b))).abs() < 1e-15);
            }
        }
        // The functions sum to one: so do their means, and each row of the mass matrix gives ⟨N_a⟩.
        let total: f64 = shape.mass.iter().flatten().sum();
        assert!((total - 1.0).abs() < 1e-15);
        // A gradient of the constant function vanishes up to what is common to all λ.
        for a in 0..N {
            for m in 1..M {
                let sum = |m: usize| (0..N).map(|b| shape.advection[a][b][m]).sum::<f64>();
                assert!((sum(m) - sum(0)).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_the_others() {
        let vertices: Vec<[f64; 4]> = (0..4).map(corner).collect();
        check(Lagrange::<4, 4>::tet(), &vertices);
        let all: Vec<[f64; 4]> = vertices.into_iter().chain(EDGES.map(middle)).collect();
        check(Lagrange::<10, 4>::tet(), &all);
        let vertices: Vec<[f64; 3]> = (0..3).map(corner).collect();
        check(Lagrange::<3, 3>::triangle(), &vertices);
        let all: Vec<[f64; 3]> = vertices.into_iter().chain(TRIANGLE_EDGES.map(middle)).collect();
        check(Lagrange::<6, 3>::triangle(), &all);
    }

    #[test]
    fn means_are_those_of_the_literature() {
        // Linear: 1/10 and 1/20. Quadratic tetrahedron (Zienkiewicz, The Finite Element Method, app. on integration):
        // ⟨N_v⟩ = −1/20, ⟨N_e⟩ = 1/5.
        let linear = Lagrange::<4, 4>::tet();
        assert!((linear.mass[0][0] - 0.1).abs() < 1e-16 && (linear.mass[0][1] - 0.05).abs() < 1e-16);
        let quadratic = Lagrange::<10, 4>::tet();
        let average = |a: usize| quadratic.mass[a].iter().sum::<f64>();
        assert!((average(0) + 0.05).abs() < 1e-15 && (average(7) - 0.2).abs() < 1e-15);
    }
}
