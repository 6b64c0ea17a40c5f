//! What the tests of the element kernels share: an element, fields, a bilinear form and central differences.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;

use crate::family::LocalIntegral;

pub(crate) const SKEW: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];

/// Components at the nodes; pseudo-random but always the same.
pub(crate) fn values<const N: usize, const C: usize>(seed: u32) -> [[c64; C]; N] {
    let noise = |x: f64| c64::new((12.9898 * x + 1.0).sin(), (78.233 * x + 2.0).sin());
    std::array::from_fn(|a| std::array::from_fn(|c| noise(f64::from(seed + (C * a + c) as u32))))
}

/// `Σ l_ai K_ab,ij u_bj` with the blocks `K_ab` of an element matrix.
pub(crate) fn bilinear<const N: usize, const C: usize>(
    l: &[[c64; C]; N],
    block: impl Fn(usize, usize) -> [[c64; 4]; 4],
    u: &[[c64; C]; N],
) -> c64 {
    let mut sum = c64::default();
    for (a, b) in (0..N).flat_map(|a| (0..N).map(move |b| (a, b))) {
        let block = block(a, b);
        for (i, j) in (0..C).flat_map(|i| (0..C).map(move |j| (i, j))) {
            sum += l[a][i] * block[i][j] * u[b][j];
        }
    }
    sum
}

/// `df/ds` at zero by a central difference of step `h`.
pub(crate) fn central_difference(h: f64, f: impl Fn(f64) -> c64) -> c64 {
    (f(h) - f(-h)) / (2.0 * h)
}

/// Asserts that `exact[k]` is the derivative of `value` by the place of vertex `k`.
#[track_caller]
pub(crate) fn assert_shape_derivative<const M: usize>(
    [h, tolerance]: [f64; 2],
    vertices: [Point; M],
    value: impl Fn([Point; M]) -> c64,
    exact: &[[c64; 3]],
) {
    assert_eq!(exact.len(), M);
    for (k, d) in (0..M).flat_map(|k| (0..3).map(move |d| (k, d))) {
        let difference = central_difference(h, |s| {
            let mut moved = vertices;
            moved[k][d] += s;
            value(moved)
        });
        assert!((difference - exact[k][d]).norm() < tolerance, "direction {d} of vertex {k}");
    }
}

/// Both derivatives of an element integral against central differences.
#[track_caller]
pub(crate) fn derivatives_hold<const N: usize, const M: usize>(
    vertices: [Point; M],
    integral: impl Fn([Point; M], [[c64; 4]; N]) -> LocalIntegral<M>,
) {
    let field = values(11);
    let exact = integral(vertices, field);
    // Truncation and rounding of a central difference of values of order one balance near 1e-5.
    let (h, tolerance) = (1e-5, 1e-8 * (1.0 + exact.value.abs()));
    for a in 0..N {
        for c in 0..4 {
            for direction in [c64::new(1.0, 0.0), c64::new(0.0, 1.0)] {
                let difference = central_difference(h, |s| {
                    let mut moved = field;
                    moved[a][c] += s * direction;
                    integral(vertices, moved).value.into()
                });
                let derivative = 2.0 * (exact.potentials.values()[a][c] * direction).re;
                assert!((difference - derivative).norm() < tolerance, "potential {c} of node {a}");
            }
        }
    }
    let value = |moved| integral(moved, field).value.into();
    assert_shape_derivative([h, tolerance], vertices, value, &exact.positions.map(|p| p.map(c64::from)));
}
